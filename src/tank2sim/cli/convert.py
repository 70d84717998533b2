"""``tank2sim convert``: a card in another language."""

from __future__ import annotations

from pathlib import Path

import click

from tank2sim.analysis.conversion.polynomial_fit import SCATTER
from tank2sim.api.conversion import LANGUAGES, convert
from tank2sim.api.ship import load
from tank2sim.cli.console import json_option, screen, show_result, write_result
from tank2sim.cli.options import set_option


@click.command("convert")
@click.argument("card")
@click.option(
    "--to",
    required=True,
    metavar="|".join(LANGUAGES),
    help="; ".join(f"{name}: {words}" for name, words in LANGUAGES.items()) + ".",
)
@click.option("-o", "--output", required=True, type=click.Path(path_type=Path), metavar="FILE", help="The new file.")
@click.option("--scaling", metavar="prime|prime_ii|bis|dimensional", help="Scaling of the card.")
@click.option("--rudder-sign", metavar="port|starboard", help="Side to which a positive rudder turns the ship.")
@click.option(
    "--origin", type=float, default=0.0, metavar="M", help="New origin of the card, m forward of the old one."
)
@click.option(
    "--scatter",
    type=float,
    default=SCATTER,
    show_default=True,
    help="How far the motions of a fit are scattered about those of standard manoeuvres.",
)
@set_option
@json_option
def command(
    card: str,
    to: str,
    output: Path,
    scaling: str | None,
    rudder_sign: str | None,
    origin: float,
    scatter: float,
    values: dict[str, object],
    json_file: Path | None,
) -> None:
    """Write CARD (a file, or the name of a bundled ship) in another language or other conventions."""
    ship = load(card, values)
    result = convert(ship, to, scaling=scaling, rudder_sign=rudder_sign, origin_m=origin, scatter=scatter)
    write_result(result, [ship.card.source], json_file=json_file, files=result.files(output))
    show_result(result)
    screen.print(f"{output}: {LANGUAGES[to]}", soft_wrap=True, markup=False)
