"""Keeping a track: waypoints, line of sight with lookahead and integral, cross-track errors.

    heading = a - atan((e + s z)/D),    dz/dt = D e/(D^2 + (e + s z)^2)

a is the direction of the leg, e the cross-track error (positive to its right), D the lookahead distance, z the integral
with its gain s: with s = 0 the lookahead-based line of sight of Fossen (2011), Handbook of Marine Craft Hydrodynamics
and Motion Control, 10.3.2; otherwise that with integral action of Borhaug, Pavlov & Pettersen (2008), 47th IEEE CDC,
which removes the error by a current. A leg ends within the circle of acceptance about its waypoint, or abeam of it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tank2sim.analysis.heading.runs import HeadingLoop
from tank2sim.arrays import Array, Columns
from tank2sim.errors import ArgumentError, InputError
from tank2sim.records.csv_table import read_table
from tank2sim.records.thinning import drawn_columns
from tank2sim.simulation.trajectory import Trajectory

if TYPE_CHECKING:
    import pandas as pd

GUIDANCE_STEP_S = 1.0
"""Interval of heading orders: as of positions from satellite navigation."""


@dataclass(frozen=True, kw_only=True)
class Guidance:
    """Settings of the guidance, in lengths of the ship.

    Parameters
    ----------
    lookahead_lengths : float
        D. Project choice: shorter distances reach the track sooner, but oscillate about it.
    acceptance_lengths : float
        Radius about a waypoint in which the next leg begins; 2 by Fossen (2011), 10.3.2.
    integral_share : float
        s over the speed u0 of the ship; 0: no integral. A quarter damps the error critically: with small errors
        de/dt = -U (e + s z)/D and dz/dt = e/D, thus s^2 + U/D s + U s/D^2 has one double root for s = U/4.
    """

    lookahead_lengths: float = 3.0
    acceptance_lengths: float = 2.0
    integral_share: float = 0.0


@dataclass(frozen=True, kw_only=True)
class TrackKeeping:
    """Figures of a track.

    Parameters
    ----------
    length_m : float
        Length of all its legs.
    duration_s : float
        Until the end of the last leg, or of the run.
    largest_error_m, rms_error_m : float
        Cross-track errors, corners in between.
    largest_error_on_legs_m : float
        The largest error after half of each leg, without the effect of the corner.
    mean_error_at_end_m : float
        Mean over the last quarter of the last leg sailed, positive to starboard of the track: the remaining error.
    """

    length_m: float
    duration_s: float
    finished: bool
    largest_error_m: float
    rms_error_m: float
    largest_error_on_legs_m: float
    mean_error_at_end_m: float


LONGEST_TRACK_M = 1e6
"""Longest track, m. Project choice: a day and a half at 15 kn; longer tracks are errors of units, and take minutes."""


@dataclass(frozen=True, eq=False)
class TrackRun:
    """A sailed track: the motion, and at each guidance step (n,) the leg (from 0) and cross-track error."""

    trajectory: Trajectory
    time_s: Array
    leg: Array
    error_m: Array
    figures: TrackKeeping

    def histories(self) -> Columns:
        """Position and error over time, thinned for a chart; the error positive to starboard of the track."""
        run = self.trajectory
        x_m, y_m = (np.interp(self.time_s, run.t, run[name]) for name in ("motion.x", "motion.y"))
        return drawn_columns({"t_s": self.time_s, "x_m": x_m, "y_m": y_m, "cross_track_error_m": self.error_m})


def read_waypoints(path: Path | str) -> Array:
    """Waypoints (n, 2), x north and y east in m, from a CSV with columns ``x_m`` and ``y_m``.

    Raises
    ------
    InputError
        The file is not such a table, a cell is empty, it has fewer than two, two consecutive points coincide, or the
        track is longer than :data:`LONGEST_TRACK_M`.
    """
    table = read_table(path)
    points = np.column_stack([table.column("x_m"), table.column("y_m")])
    empty = np.argwhere(np.isnan(points))
    if empty.size:
        row, column = (int(place) for place in empty[0])
        raise InputError(path, table.place(row, ("x_m", "y_m")[column]), "is empty", "give each waypoint both numbers")
    check_waypoints(points, path, lambda row: f"line {table.lines[row]}")
    return np.asarray(points)


def waypoints_of(track: pd.DataFrame | Sequence[Sequence[float]] | Array | str | Path) -> Array:
    """Waypoints (n, 2), x north and y east in m, from a table, an array or a CSV file.

    Parameters
    ----------
    track : DataFrame, array (n, 2) or path
        Columns ``x_m`` and ``y_m``.

    Raises
    ------
    InputError
        As :func:`read_waypoints`.
    """
    if isinstance(track, str | Path):
        return read_waypoints(track)
    import pandas as pd

    try:
        table = track[["x_m", "y_m"]] if isinstance(track, pd.DataFrame) else track
        points = np.asarray(table, dtype=float)
    except (KeyError, TypeError, ValueError):
        points = np.zeros(0)
    if points.ndim != 2 or points.shape[1] != 2:
        raise ArgumentError("track", "", "is not a table of x_m and y_m", "give waypoints (n, 2), m north and east")
    check_waypoints(points, "track", lambda row: f"waypoint {row + 1}")
    return points


def check_waypoints(points: Array, source: Path | str, place: Callable[[int], str]) -> None:
    """Refuse waypoints (n, 2) that do not form a track; `place` gives the location of a waypoint by its number, from 0.

    Raises
    ------
    InputError
        One is not finite, it has fewer than two, two consecutive points coincide, or the track is longer than
        :data:`LONGEST_TRACK_M`.
    """
    if len(points) < 2:
        raise InputError(source, "", "has one waypoint", "give two or more: a track begins at the first")
    lost = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if lost.size:
        raise InputError(source, place(int(lost[0])), "is not finite", "give each waypoint both numbers")
    lengths = np.hypot(*np.diff(points, axis=0).T)
    length = float(lengths.sum())
    if length > LONGEST_TRACK_M:
        problem = f"its track is {length / 1e3:.6g} km long, and at most {LONGEST_TRACK_M / 1e3:g} km can be sailed"
        raise InputError(source, "", problem, "give x_m and y_m in m, and a shorter track")
    same = np.flatnonzero(lengths < 1e-6)
    if same.size:
        problem = "is the same place as the waypoint before"
        raise InputError(source, place(int(same[0]) + 1), problem, "delete one of the two")


def line_of_sight(error: float, integral: float, lookahead: float, gain: float = 0.0) -> tuple[float, float]:
    """Heading relative to the leg (rad) and rate of the integral (1, a second) for a cross-track error.

    Parameters
    ----------
    error, integral : float
        m; and s, so that the gain times it is a length.
    lookahead : float
        m.
    gain : float
        m/s; 0: no integral.
    """
    whole = error + gain * integral
    return -math.atan2(whole, lookahead), lookahead * error / (lookahead**2 + whole**2)


def keep_track(
    loop: HeadingLoop, waypoints: Array, guidance: Guidance, inputs: Mapping[str, float | Array] | None = None
) -> TrackRun:
    """Sail along waypoints from the first, on the course of the first leg at the start.

    Parameters
    ----------
    waypoints : array (n, 2)
    inputs : mapping, optional
        Inputs of the model, by name (current, wind); held.

    Raises
    ------
    InputError
        A leg is shorter than the circle of acceptance, or the motion leaves all bounds.
    """
    length, speed = (loop.model.defaults[f"ship.{name}"] for name in ("length", "speed"))
    _refuse_short_legs(waypoints, guidance.acceptance_lengths * length)
    first = waypoints[1] - waypoints[0]
    course = math.atan2(first[1], first[0])
    start = {"initial.x": waypoints[0, 0], "initial.y": waypoints[0, 1], "initial.psi": course}
    sailed = _Sailed(waypoints, guidance, length, speed)
    steps = max(1, round(GUIDANCE_STEP_S / loop.model.step_s))
    total = float(np.hypot(*np.diff(waypoints, axis=0).T).sum())
    most = 3 * total / speed + 20 * length / speed
    x, states, us = loop.start(start), [], []
    place = [loop.model.state_names.index(f"motion.{name}") for name in "xy"]
    while not sailed.finished and sailed.time < most and np.isfinite(x).all():
        heading = sailed.heading(x[place], steps * loop.model.step_s)
        part, u = loop.advance(x, {**(inputs or {}), "heading.command": heading}, steps, start)
        states.append(part[:-1])
        us.append(u)
        x = part[-1]
    trajectory = loop.trajectory(np.vstack([*states, x[None, :]]), np.vstack(us), start)
    return sailed.run(trajectory, total)


def _refuse_short_legs(waypoints: Array, radius: float) -> None:
    legs = np.hypot(*np.diff(waypoints, axis=0).T)
    short = np.flatnonzero(legs <= radius)
    if short.size:
        where = f"leg {short[0] + 1}"
        problem = f"is {legs[short[0]]:.4g} m, and the next begins {radius:.4g} m before its end"
        raise ArgumentError("track", where, problem, "place its waypoints further apart")


class _Sailed:
    """State of a track: the leg, the integral, and the record of each guidance step."""

    def __init__(self, waypoints: Array, guidance: Guidance, length: float, speed: float):
        self._points = waypoints
        self._lookahead = guidance.lookahead_lengths * length
        self._radius = guidance.acceptance_lengths * length
        self._gain = guidance.integral_share * speed
        self._integral = 0.0
        self._leg = 0
        self._met: list[tuple[float, int, float, float]] = []
        self.time = 0.0
        self.finished = False

    def heading(self, position: Array, step: float) -> float:
        """Heading to order at a position (2,), to be held for `step` s."""
        along, error, size, course = self._on_leg(position)
        while along >= size or math.hypot(size - along, error) < self._radius:
            if self._leg + 2 >= len(self._points):
                self.finished = bool(along >= size)
                break
            self._leg += 1
            along, error, size, course = self._on_leg(position)
        self._met.append((self.time, self._leg, along / size, error))
        turned, growth = line_of_sight(error, self._integral, self._lookahead, self._gain)
        self._integral += growth * step
        self.time += step
        return course + turned

    def _on_leg(self, position: Array) -> tuple[float, float, float, float]:
        begin, end = self._points[self._leg], self._points[self._leg + 1]
        size, course = math.hypot(*(end - begin)), math.atan2(end[1] - begin[1], end[0] - begin[0])
        north, east = position - begin
        along = north * math.cos(course) + east * math.sin(course)
        return along, -north * math.sin(course) + east * math.cos(course), size, course

    def run(self, trajectory: Trajectory, total: float) -> TrackRun:
        """The sailed track, with its figures."""
        time, leg, along, error = np.array(self._met).T
        later = np.abs(error[along > 0.5]) if (along > 0.5).any() else np.abs(error)
        last = (leg == leg[-1]) & (along > along[-1] - 0.25)
        figures = TrackKeeping(
            length_m=total,
            duration_s=self.time,
            finished=self.finished,
            largest_error_m=float(np.abs(error).max()),
            rms_error_m=float(np.sqrt(np.mean(error**2))),
            largest_error_on_legs_m=float(later.max()),
            mean_error_at_end_m=float(error[last].mean()),
        )
        return TrackRun(trajectory, time, leg, error, figures)
