"""``tank2sim autopilot``: a heading controller for a ship, judged, tried and exported."""

from __future__ import annotations

from pathlib import Path

import click

from tank2sim.analysis.heading.designs import DESIGNS
from tank2sim.analysis.heading.study import LARGEST_CHANGE_DEG
from tank2sim.api.bounds import NonNegativeArgument, PositiveArgument, Seed, SpeedArgument
from tank2sim.api.ship import load
from tank2sim.cli.console import json_option, show_result, write_result
from tank2sim.cli.options import OutputFile, number, page_option, plot_option, set_option
from tank2sim.cli.progress import showing_stages
from tank2sim.errors import InputError
from tank2sim.files import FMU

_POSITIVE, _NOT_NEGATIVE = number(PositiveArgument), number(NonNegativeArgument)
_CHANGE = click.FloatRange(-LARGEST_CHANGE_DEG, LARGEST_CHANGE_DEG)


@click.command("autopilot")
@click.argument("card")
@click.option("--design", type=click.Choice(DESIGNS), default="pid", show_default=True, help="Way of design.")
@click.option("--speed", type=number(SpeedArgument), metavar="MPS", help="Speed of the design, m/s; by default u0.")
@click.option("--heading-weight", type=_POSITIVE, default=5.0, show_default=True, metavar="DEG",
              help="LQR: heading error that is as bad as ...")  # fmt: skip
@click.option("--rudder-weight", type=_POSITIVE, default=5.0, show_default=True, metavar="DEG",
              help="... this rudder.")  # fmt: skip
@click.option("--wave-filter", type=_POSITIVE, metavar="RADPS", help="PID: let the rudder rest at this frequency.")
@click.option("--course-change", type=_CHANGE, default=20.0, show_default=True, metavar="DEG",
              help="Change of course to try, + to starboard.")  # fmt: skip
@click.option("--current", type=_NOT_NEGATIVE, metavar="MPS", help="Current, towards east.")
@click.option("--wind", type=_NOT_NEGATIVE, metavar="MPS", help="Wind, from north-east. The ship steers north.")
@click.option("--wave-yaw", type=_NOT_NEGATIVE, metavar="DEG", help="Yawing by waves, standard deviation.")
@click.option("--seed", type=number(Seed), metavar="N", help="Seed of the waves.")
@click.option("--track", type=click.Path(path_type=Path), metavar="FILE.csv", help="Also keep a track: x_m,y_m.")
@click.option("--export", type=OutputFile(FMU), metavar="AP.fmu", help="Write the controller as an FMU.")
@click.option("--fmi", type=click.Choice(["2", "3"]), default="2", show_default=True, help="Version of FMI.")
@click.option("--verify", is_flag=True, help="With --export: co-simulate it with the ship's FMU, against one model.")
@page_option("-o")
@plot_option
@set_option
@json_option
def command(
    card: str,
    design: str,
    speed: float | None,
    heading_weight: float,
    rudder_weight: float,
    wave_filter: float | None,
    course_change: float,
    current: float | None,
    wind: float | None,
    wave_yaw: float | None,
    seed: int | None,
    track: Path | None,
    export: Path | None,
    fmi: str,
    verify: bool,
    page: Path | None,
    plot: Path | None,
    values: dict[str, object],
    json_file: Path | None,
) -> None:
    """Design a heading controller for CARD (a file, or the name of a bundled ship), judge it and try it."""
    if verify and not export:
        raise InputError("--verify", "", "needs an FMU", "give --export AP.fmu, too")
    ship = load(card, values)
    result = ship.autopilot(
        design,
        speed_mps=speed,
        heading_weight_deg=heading_weight,
        rudder_weight_deg=rudder_weight,
        wave_filter_radps=wave_filter,
        course_change_deg=course_change,
        current_mps=current,
        wind_mps=wind,
        wave_yaw_deg=wave_yaw,
        seed=seed,
        track=track,
    )
    if export:
        with showing_stages("making the FMU") as report:
            result = result.make_fmu(export, fmi=int(fmi), verify=verify, report=report)
    inputs = [Path(ship.card.source), *([track] if track else [])]
    write_result(result, inputs, json_file=json_file, page=page, plot=plot, files=result.files)
    show_result(result)
