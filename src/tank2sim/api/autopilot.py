"""A heading autopilot of a ship, and one of heading and speed of a craft: designed, judged and tried."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from tank2sim.api.verbs import Output, Progress, verb
from tank2sim.arguments import ArgumentBounds, Seed
from tank2sim.errors import ArgumentError, InputError
from tank2sim.files import FMU
from tank2sim.quantities import Speed, StreamSpeed, WaveFrequency, WeightAngle, WindSpeed, YawingAngle

if TYPE_CHECKING:
    import pandas as pd

    from tank2sim.arrays import Array
    from tank2sim.dynamics.vessel import Vessel
    from tank2sim.results.autopilot import AutopilotResult, CraftAutopilotResult

LARGEST_CHANGE_DEG = 170.0
"""Largest change of course. Project choice: well below 180 deg, where port and starboard are equivalent."""

CourseAngle = Annotated[float, ArgumentBounds(-LARGEST_CHANGE_DEG, LARGEST_CHANGE_DEG)]


def write_controller(
    result: AutopilotResult | CraftAutopilotResult,
    path: Path,
    *,
    fmi: Literal[2, 3] = 2,
    verify: bool = False,
    report: Progress = lambda _: None,
) -> AutopilotResult | CraftAutopilotResult:
    """Make the FMU of a controller.

    Parameters
    ----------
    fmi : int
        Version of FMI.
    verify : bool
        With --export: co-simulate the FMU with the ship's FMU, and compare with one model of both.
    report : callable
        Called with the stage that begins.
    """
    return result.make_fmu(path, fmi=fmi, verify=verify, report=report)


@verb(
    "heading controllers, designed, simulated and exported",
    Output("--export", FMU, "Write the controller as an FMU.", write_controller, "AP.fmu"),
    results=(
        "tank2sim.results.autopilot:AutopilotResult",
        "tank2sim.results.autopilot:CraftAutopilotResult",
    ),
)
def autopilot(
    ship: Vessel,
    design: Literal["pd", "pid", "lqr", "robust"] = "pid",
    *,
    speed_mps: Speed | None = None,
    heading_weight_deg: WeightAngle = 5.0,
    rudder_weight_deg: WeightAngle = 5.0,
    wave_filter_radps: WaveFrequency | None = None,
    course_change_deg: CourseAngle = 20.0,
    current_mps: StreamSpeed | None = None,
    wind_mps: WindSpeed | None = None,
    wave_yaw_deg: YawingAngle | None = None,
    seed: Seed | None = None,
    track: pd.DataFrame | Sequence[Sequence[Any]] | Array | str | Path | None = None,
) -> AutopilotResult | CraftAutopilotResult:
    """Design a heading controller for a ship, judge its loop and try it.

    A craft with thrusters gets a controller of heading and speed, without choice of `design`, weights and wave filter.

    Parameters
    ----------
    ship : Vessel
        A ship with a rudder, or a craft with fixed thrusters.
    design : str
        Way of design.
    speed_mps : float, optional
        Speed of the design, m/s; by default the speed of the card.
    heading_weight_deg : float
        Heading error, deg, that costs the LQR as much as the rudder weight.
    rudder_weight_deg : float
        Rudder, deg, that costs the LQR as much as the heading weight.
    wave_filter_radps : float, optional
        Frequency, rad/s, at which the rudder of the PID rests.
    course_change_deg : float
        Change of course to try, deg, + to starboard.
    current_mps : float, optional
        Current towards east, m/s; by default as in a fresh breeze, by Froude's law.
    wind_mps : float, optional
        Wind from north-east, m/s; the ship steers north.
    wave_yaw_deg : float, optional
        Yawing by waves, deg, standard deviation.
    seed : int, optional
        Seed of the waves.
    track : DataFrame, array (n, 2) or path, optional
        Waypoints x_m (north) and y_m (east) of a track to keep, too; on the command line a CSV file.

    Raises
    ------
    InputError
        The ship has neither rudder nor fixed thrusters, a value is out of bounds, or no controller holds the ship.
    """
    from tank2sim.analysis.heading.craft import study_craft_autopilot
    from tank2sim.analysis.heading.designs import LqrWeights
    from tank2sim.analysis.heading.study import StudySettings, study_autopilot
    from tank2sim.analysis.heading.track_keeping import waypoints_of
    from tank2sim.cards import SteeredBy
    from tank2sim.results.autopilot import AutopilotResult, CraftAutopilotResult
    from tank2sim.simulation.integrator import compiler_notices

    if course_change_deg == 0:
        raise ArgumentError("course_change_deg", "", "is 0", "give the angle to turn by")
    card = ship.steered()
    of_lqr = {"heading_weight_deg": heading_weight_deg, "rudder_weight_deg": rudder_weight_deg}
    if card.steered_by is SteeredBy.THRUSTERS:
        remedy = "leave it out: the controller of a craft with thrusters has one design"
        of_rudder = of_lqr | {"wave_filter_radps": wave_filter_radps, "design": design}
        _refuse_unused(of_rudder, "is of a rudder", remedy)
    elif design != "lqr":
        _refuse_unused(of_lqr, f"is not part of the design {design!r}", "leave it out, or choose lqr")
    weights = LqrWeights(heading_rad=math.radians(heading_weight_deg), rudder_rad=math.radians(rudder_weight_deg))
    settings = StudySettings(
        kind=design,
        speed_mps=speed_mps,
        weights=weights,
        wave_filter_radps=wave_filter_radps,
        course_change_rad=math.radians(course_change_deg),
        weather={
            "current_mps": current_mps,
            "wind_mps": wind_mps,
            "wave_yaw_rad": None if wave_yaw_deg is None else math.radians(wave_yaw_deg),
            "seed": seed,
        },
        waypoints=None if track is None else waypoints_of(track),
    )
    try:
        if card.steered_by is SteeredBy.THRUSTERS:
            craft, piloted = study_craft_autopilot(card, ship.model, settings)
            return CraftAutopilotResult(replace(craft, notices=(*craft.notices, *compiler_notices())), piloted)
        study, piloted = study_autopilot(card.manoeuvring(), ship.model, settings)
    except ArgumentError as fault:
        if fault.source != "track" or not isinstance(track, str | Path):
            raise
        raise InputError(track, fault.place, fault.problem, fault.remedy) from None  # named by the file
    return AutopilotResult(replace(study, notices=(*study.notices, *compiler_notices())), piloted)


def _refuse_unused(given: dict[str, Any], problem: str, remedy: str) -> None:
    """Refuse arguments that the design does not use and that are not at their defaults."""
    usual = {"heading_weight_deg": 5.0, "rudder_weight_deg": 5.0, "design": "pid", "wave_filter_radps": None}
    if name := next((name for name, value in given.items() if value != usual[name]), ""):
        raise ArgumentError(name, "", problem, remedy)
