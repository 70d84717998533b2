"""``tank2sim stability``: stability, steady turning and the IMO criteria of a ship."""

from __future__ import annotations

from pathlib import Path

import click

from tank2sim.arguments import SpeedArgument
from tank2sim.cli.console import json_option, show_result, write_result
from tank2sim.cli.options import ensemble_options, number, page_option, set_option
from tank2sim.errors import InputError
from tank2sim.ship import load


@click.command("stability")
@click.argument("card")
@click.option("--speed", type=number(SpeedArgument), metavar="MPS", help="Speed, m/s; by default u0.")
@set_option
@click.option(
    "--spiral/--no-spiral", "spirals", default=True, help="Simulate the spirals on the steady-turning diagram."
)
@page_option("-o")
@ensemble_options
@json_option
def command(
    card: str,
    speed: float | None,
    values: dict[str, object],
    spirals: bool,
    page: Path | None,
    members: int | None,
    seed: int,
    executor: str,
    json_file: Path | None,
) -> None:
    """Judge course stability, steady turning and the IMO criteria of CARD (a file, or a bundled ship's name)."""
    if members is None and seed:
        raise InputError(
            "--seed", f"{seed}", "is of an ensemble, and none is asked for", "add --ensemble, or leave it out"
        )
    ship = load(card, values)
    result = ship.stability(speed, spirals=spirals, members=members or 0, seed=seed, executor=executor)
    write_result(result, [ship.card.source], json_file=json_file, page=page)
    show_result(result)
