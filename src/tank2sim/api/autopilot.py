"""A heading autopilot of a ship, and one of heading and speed of a craft: designed, judged and tried."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tank2sim.analysis.heading.craft import study_craft_autopilot
from tank2sim.analysis.heading.study import StudySettings, check_course_change, check_settings, study_autopilot
from tank2sim.analysis.heading.track_keeping import check_waypoints, read_waypoints
from tank2sim.api.ship import Ship
from tank2sim.arrays import Array
from tank2sim.cards import CraftCard, ManoeuvringCard
from tank2sim.errors import InputError
from tank2sim.native.compiler import find_compiler
from tank2sim.results.autopilot import AutopilotResult, CraftAutopilotResult
from tank2sim.simulation.integrator import NO_COMPILER

if TYPE_CHECKING:
    import pandas as pd


def pilot_ship(
    ship: Ship,
    settings: StudySettings,
    track: pd.DataFrame | Sequence[Sequence[float]] | Array | str | Path | None,
) -> AutopilotResult:
    """Design a heading controller and simulate it. Raises as :meth:`.Ship.autopilot`.

    Parameters
    ----------
    ship : Ship
        It is steered.
    settings : StudySettings
        Of the design and its runs.
    track : DataFrame, array, path or None
        Waypoints, as of :meth:`.Ship.autopilot`.
    """
    card = ship.card
    if not isinstance(card, ManoeuvringCard):
        raise InputError(
            card.source,
            "model.kind",
            "has no rudder",
            "an autopilot needs a ship with a rudder, or a craft with thrusters",
        )
    check_settings(settings)
    try:
        study, piloted = study_autopilot(card, ship.model, replace(settings, waypoints=_waypoints(track)))
    except InputError as fault:
        if not isinstance(track, str | Path) or fault.source != "--track":
            raise
        raise InputError(track, fault.place, fault.problem, fault.remedy) from None  # the library knows no file
    return AutopilotResult(replace(study, notices=(*study.notices, *_no_compiler())), piloted)


def _waypoints(track: pd.DataFrame | Sequence[Sequence[float]] | Array | str | Path | None) -> Array | None:
    if track is None:
        return None
    if isinstance(track, str | Path):
        return read_waypoints(track)
    import pandas as pd

    try:
        table = track[["x_m", "y_m"]] if isinstance(track, pd.DataFrame) else track
        points = np.asarray(table, dtype=float)
    except (KeyError, TypeError, ValueError):
        points = np.zeros(0)
    if points.ndim != 2 or points.shape[1] != 2:
        raise InputError("--track", "", "is not a table of x_m and y_m", "give waypoints (n, 2), m north and east")
    check_waypoints(points, "--track", lambda row: f"waypoint {row + 1}")
    return points


def pilot_craft(ship: Ship, *, speed_mps: float | None, course_change_deg: float) -> CraftAutopilotResult:
    """Design the autopilot of a craft and try it. Raises as :meth:`.Ship.autopilot`.

    Parameters
    ----------
    ship : Ship
        With the card of a craft.
    speed_mps : float, optional
        Of the design and of its runs; by default that of the card.
    course_change_deg : float
        To try, + to starboard.
    """
    assert isinstance(ship.card, CraftCard)
    change = math.radians(course_change_deg)
    check_course_change(change)
    if speed_mps is not None and not 0 < speed_mps < math.inf:
        raise InputError("--speed", "", f"{speed_mps:g} m/s is not a speed ahead", "give a positive one")
    study, piloted = study_craft_autopilot(ship.card, ship.model, speed_mps=speed_mps, course_change_rad=change)
    return CraftAutopilotResult(replace(study, notices=_no_compiler()), piloted)


def _no_compiler() -> tuple[str, ...]:
    return () if find_compiler() else (NO_COMPILER,)
