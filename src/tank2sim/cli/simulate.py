"""``tank2sim simulate``: a standard manoeuvre of a ship."""

from __future__ import annotations

from pathlib import Path

import click

from tank2sim.cli.console import json_option, show_result, write_result
from tank2sim.cli.options import OutputFile, ensemble_options, page_option, plot_option, set_option
from tank2sim.files import TABLE
from tank2sim.ship import load
from tank2sim.simulation.manoeuvres import MANOEUVRE_FORMS, THRUSTER_FORMS


@click.command("simulate")
@click.argument("card")
@click.option(
    "--manoeuvre",
    required=True,
    metavar="M",
    help=f"{MANOEUVRE_FORMS}; of a craft with thrusters {THRUSTER_FORMS}. Angles in deg, + to starboard; "
    "execute at t = 0.",
)
@click.option(
    "--duration", type=float, metavar="S", help="Length of the run in s; by default what the manoeuvre needs."
)
@set_option
@click.option("-o", "--output", "--out", type=OutputFile(TABLE), metavar="RUN.csv", help="Write the motion as a trial.")
@page_option()
@plot_option
@ensemble_options
@json_option
def command(
    card: str,
    manoeuvre: str,
    duration: float | None,
    values: dict[str, object],
    output: Path | None,
    page: Path | None,
    plot: Path | None,
    members: int | None,
    seed: int,
    executor: str,
    json_file: Path | None,
) -> None:
    """Simulate a manoeuvre of CARD (a file, or the name of a bundled ship) and read off its figures."""
    ship = load(card, values)
    result = ship.simulate(manoeuvre, duration_s=duration, members=members or 0, seed=seed, executor=executor)
    inputs = [ship.card.source, manoeuvre.removeprefix("file:")]
    files = {output: result.to_csv()} if output else {}
    write_result(result, inputs, json_file=json_file, page=page, plot=plot, files=files)
    show_result(result)
