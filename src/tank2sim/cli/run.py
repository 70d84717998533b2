"""``tank2sim run``: one captive run, or its repeats, reduced by itself."""

from __future__ import annotations

from pathlib import Path
from typing import get_args

import click

from tank2sim.api.captive_run import TYPE_NAMES, ForceConvention, reduce_runs
from tank2sim.arguments import SpeedArgument
from tank2sim.cli.console import json_option, show_result, write_result
from tank2sim.cli.options import OutputFile, number, page_option, plot_folder_option
from tank2sim.files import TABLE


@click.command("run")
@click.argument("runs", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="RUN...")
@click.option(
    "--type", "type_name", type=click.Choice(TYPE_NAMES), help="Type of the run; by default as in the campaign."
)
@click.option(
    "--campaign",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="CAMPAIGN.toml",
    help="Tank, model, signs and columns; the run need not be in it.",
)
@click.option(
    "--force-convention",
    type=click.Choice(get_args(ForceConvention)),
    help="Whose force the file has, without a campaign; by default that on the gauge.",
)
@click.option("--speed", "speed_mps", type=number(SpeedArgument), metavar="MPS", help="Test speed.")
@click.option("--drift-deg", type=float, metavar="DEG", help="Drift angle, where file and sheet have none.")
@click.option("--rudder-deg", type=float, metavar="DEG", help="Rudder angle, where file and sheet have none.")
@click.option(
    "-o",
    "--output",
    type=OutputFile(TABLE, dir_okay=False),
    metavar="HARMONICS.csv",
    help="Write the Fourier coefficients.",
)
@click.option(
    "--cycle",
    type=OutputFile(TABLE, dir_okay=False),
    metavar="CYCLE.csv",
    help="Write the averaged cycle of the first run.",
)
@page_option()
@plot_folder_option
@json_option
def command(
    runs: tuple[Path, ...],
    type_name: str | None,
    campaign: Path | None,
    force_convention: ForceConvention | None,
    speed_mps: float | None,
    drift_deg: float | None,
    rudder_deg: float | None,
    output: Path | None,
    cycle: Path | None,
    page: Path | None,
    plots: Path | None,
    json_file: Path | None,
) -> None:
    """Reduce one captive RUN by itself: Fourier coefficients with errors, averaged cycle, residual.

    Several files are repeats of one run, and their differences are compared with the noise within them.
    """
    result = reduce_runs(
        runs,
        type=type_name,
        campaign=campaign,
        force_convention=force_convention,
        speed_mps=speed_mps,
        drift_deg=drift_deg,
        rudder_deg=rudder_deg,
    )
    files = {output: result.to_csv()} if output else {}
    if cycle:
        files[cycle] = result.cycle_csv()
    inputs = [*runs, *([campaign] if campaign else [])]
    write_result(result, inputs, json_file=json_file, page=page, plots=plots, files=files)
    show_result(result)
