"""``tank2sim autopilot``: a heading controller for a ship, judged, tried and exported."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import click
from rich.markup import escape

from tank2sim.analysis.heading.control import INTEGRAL_BAND_RAD
from tank2sim.analysis.heading.designs import DESIGNS, LqrWeights
from tank2sim.analysis.heading.study import AutopilotStudy, StudySettings, study_autopilot
from tank2sim.analysis.heading.track_keeping import read_waypoints
from tank2sim.cards import ManoeuvringCard, read_card
from tank2sim.cli.console import json_option, json_text, screen, show_notices, show_table
from tank2sim.cli.overrides import parse_changes
from tank2sim.cli.progress import showing_stages
from tank2sim.dynamics import build
from tank2sim.errors import InputError
from tank2sim.files import plain_json, write_together
from tank2sim.native.compiler import find_compiler
from tank2sim.simulation.integrator import NO_COMPILER

if TYPE_CHECKING:
    from tank2sim.dynamics.model import Model

_POSITIVE = click.FloatRange(min=0, min_open=True)
_NOT_NEGATIVE = click.FloatRange(min=0)


@click.command("autopilot")
@click.argument("card")
@click.option("--design", type=click.Choice(DESIGNS), default="pid", show_default=True, help="Way of design.")
@click.option("--speed", type=_POSITIVE, metavar="MPS", help="Speed of the design, m/s; by default u0.")
@click.option("--heading-weight", type=_POSITIVE, default=5.0, show_default=True, metavar="DEG",
              help="LQR: heading error that is as bad as ...")  # fmt: skip
@click.option("--rudder-weight", type=_POSITIVE, default=5.0, show_default=True, metavar="DEG",
              help="... this rudder.")  # fmt: skip
@click.option("--wave-filter", type=_POSITIVE, metavar="RADPS", help="PID: let the rudder rest at this frequency.")
@click.option("--course-change", type=click.FloatRange(-170, 170), default=20.0, show_default=True, metavar="DEG",
              help="Change of course to try, + to starboard.")  # fmt: skip
@click.option("--current", type=_NOT_NEGATIVE, metavar="MPS", help="Current, towards east.")
@click.option("--wind", type=_NOT_NEGATIVE, metavar="MPS", help="Wind, from north-east. The ship steers north.")
@click.option("--wave-yaw", type=_NOT_NEGATIVE, metavar="DEG", help="Yawing by waves, standard deviation.")
@click.option("--seed", type=int, metavar="N", help="Seed of the waves.")
@click.option("--track", type=click.Path(path_type=Path), metavar="FILE.csv", help="Also keep a track: x_m,y_m.")
@click.option("--export", type=click.Path(path_type=Path), metavar="AP.fmu", help="Write the controller as an FMU.")
@click.option("--fmi", type=click.Choice(["2", "3"]), default="2", show_default=True, help="Version of FMI.")
@click.option("--verify", is_flag=True, help="With --export: co-simulate it with the ship's FMU, against one model.")
@click.option("-o", "--page", type=click.Path(path_type=Path), metavar="PAGE.html", help="Write a page with charts.")
@click.option("--set", "settings", multiple=True, metavar="KEY=VALUE", help="A value in place of the card's.")
@json_option
def command(card: str, *, track: Path | None, settings: tuple[str, ...], **more: object) -> None:
    """Design a heading controller for CARD (a file, or the name of a bundled ship), judge it and try it."""
    ship = read_card(card, parse_changes(settings))
    if not isinstance(ship, ManoeuvringCard):
        raise InputError(ship.source, "model.kind", "has no rudder", "an autopilot needs a linear or abkowitz card")
    if more["course_change"] == 0:
        raise InputError("--course-change", "", "is 0", "give the angle to turn by, in deg")
    if more["verify"] and not more["export"]:
        raise InputError("--verify", "", "needs an FMU", "give --export AP.fmu, too")
    export, page, json_file = (_path(more[key]) for key in ("export", "page", "json_file"))
    waypoints = None if track is None else read_waypoints(track)
    model = build(ship)
    try:
        study = study_autopilot(ship, model, _settings(waypoints, **more))
    except InputError as fault:
        if track is None or fault.source != "--track":
            raise
        raise InputError(track, fault.place, fault.problem, fault.remedy) from None  # the library knows no file
    result: dict[str, object] = study.as_json()
    notices = [*study.notices, *([] if find_compiler() else [NO_COMPILER])]
    contents: dict[Path, str | bytes] = {}
    if export:
        contents[export], result["export"] = _exported(model, study, str(more["fmi"]), bool(more["verify"]))
    if page:
        from tank2sim.report.autopilot.page import piloted_page
        from tank2sim.report.kit.page import render_page

        contents[page] = render_page(piloted_page(plain_json(result)))
    if json_file:
        contents[json_file] = json_text(result)
    inputs = [Path(ship.source), *([] if track is None else [track])]
    write_together(contents, inputs=inputs, outputs=[export, page, json_file])
    _show(study)
    if export:
        _show_export(export, result["export"])
    show_notices(notices)


def _path(value: object) -> Path | None:
    assert value is None or isinstance(value, Path)
    return value


def _settings(waypoints: object, **more: object) -> StudySettings:
    def angle(name: str) -> float | None:
        return None if more[name] is None else math.radians(float(more[name]))  # type: ignore[arg-type]

    weather = {
        "current_mps": more["current"],
        "wind_mps": more["wind"],
        "wave_yaw_rad": angle("wave_yaw"),
        "seed": more["seed"],
    }
    return StudySettings(
        kind=str(more["design"]),
        speed_mps=more["speed"],  # type: ignore[arg-type]  # click has checked them
        weights=LqrWeights(heading_rad=angle("heading_weight") or 0, rudder_rad=angle("rudder_weight") or 0),
        wave_filter_radps=more["wave_filter"],  # type: ignore[arg-type]
        course_change_rad=angle("course_change") or 0,
        weather=weather,  # type: ignore[arg-type]
        waypoints=waypoints,  # type: ignore[arg-type]
    )


def _exported(model: Model, study: AutopilotStudy, fmi: str, verify: bool) -> tuple[bytes, dict[str, object]]:
    from tank2sim.fmu.autopilot import make_autopilot_fmu  # takes most of a second to import

    with showing_stages("making the FMU") as told:
        made = make_autopilot_fmu(study.design, fmi=int(fmi), told=told)
        result = made.as_json()
        if verify:
            from tank2sim.fmu.autopilot import verify_together

            told("co-simulating ship and autopilot")
            result["co_simulation"] = verify_together(model, study.design, made).as_json()
    return made.content, result


def _show(study: AutopilotStudy) -> None:
    screen.print(escape(study.design.source), soft_wrap=True)
    show_table("Controller", ["figure", "value"], [[name, value] for name, value in study.design.gains.items()])
    screen.print(_limits(study.limits), soft_wrap=True)
    heads = ["speed (m/s)", "gain up", "gain down to", "phase (deg)", "delay (s)", "Ms", "-3 dB (rad/s)", "stable"]
    rows = [
        [
            margin.speed_mps,
            *(
                float(f"{value:.3g}")  # more digits do not go next to each other, and mean nothing
                for value in (
                    margin.gain_margin_up,
                    margin.gain_margin_down,
                    margin.phase_margin_deg,
                    margin.delay_margin_s,
                    margin.sensitivity_peak,
                    margin.bandwidth_radps,
                )
            ),
            margin.stable,
        ]
        for margin in study.margins
    ]
    show_table("Margins with the steering gear, the first at the speed of the design", heads, rows)
    limits = [math.degrees(one) for one in (study.steps.within_rate_rad, study.steps.within_angle_rad)]
    screen.print(f"Linear up to a step of {limits[0]:.3g} deg (rate of the gear) and {limits[1]:.3g} deg (angle)")
    heads = ["run", "ordered (deg)", "rise (s)", "overshoot (deg)", "settled (s)", "rudder (deg)", "at full rate (s)"]
    show_table("Course changes", heads, [[name, *vars(change).values()] for name, change in study.changes.items()])
    kept = study.keeping
    screen.print(
        f"Course keeping in current, wind and waves over {kept.duration_s:.0f} s: heading error "
        f"{kept.heading_error_rms_deg:.3g} deg rms (mean {kept.heading_error_mean_deg:.2g}), rudder "
        f"{kept.rudder_rms_deg:.3g} deg rms, {kept.rudder_travel_degps:.3g} deg/s on the move, "
        f"at full rate {kept.rate_limited_percent:.3g} % of the time",
        soft_wrap=True,
    )
    if study.tracks:
        heads = ["guidance", "length (m)", "time (s)", "finished", "largest (m)", "rms (m)", "on legs (m)", "stays (m)"]
        tracks = [[name, *vars(track.figures).values()] for name, track in study.tracks.items()]
        show_table("Cross-track error", heads, tracks)


def _limits(limits: Mapping[str, float]) -> str:
    text = f"Rudder ordered up to {limits['largest_rudder_deg']:.3g} deg"
    if "anti_windup_time_s" in limits:
        text += f"; the integral takes up to {math.degrees(INTEGRAL_BAND_RAD):.3g} deg of a heading error"
    return text


def _show_export(path: Path, told: object) -> None:
    assert isinstance(told, dict)
    screen.print(f"{path}: FMI {told['fmi']}, {told['size_bytes'] / 1000:.0f} kB", soft_wrap=True, markup=False)
    if "co_simulation" in told:
        heads = ["communication step (s)", "largest difference of heading (deg)"]
        title = f"Ship and autopilot co-simulated, against one model: order {told['co_simulation']['order']:.2f}"
        show_table(title, heads, [[row["step_s"], row["error_deg"]] for row in told["co_simulation"]["steps"]])
