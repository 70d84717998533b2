"""Tracks of a ship from an order, with marks, figures, and the end of the card's range."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tank2sim.analysis.validation.standard_trials import figure_numbers
from tank2sim.arrays import Array
from tank2sim.simulation.card_range import CardRangeReading, Numbers, range_exit_row
from tank2sim.simulation.run import Run
from tank2sim.simulation.trajectory import Trajectory


@dataclass(frozen=True)
class TrackMark:
    """A point of a track: time, change of heading (deg; of a turn to its side, else to starboard), place (m), speed."""

    time_s: float
    heading_change_deg: float
    ahead_m: float
    starboard_m: float
    speed_mps: float


@dataclass(frozen=True, eq=False)
class ShipTrack:
    """A track from the order, in axes of the first course: ahead and to starboard, m.

    `ahead_m`, `starboard_m` (n,); `marks`: at each quarter of a turn (turns), or at equal times (stops); `figures`:
    figures, including those outside the card's range; `reading`: figures outside the card's range; `inside`: points of
    the track until it leaves the card's range; `range_exit`: the first point outside the card's range; None if there is
    none.
    """

    name: str
    ahead_m: Array
    starboard_m: Array
    marks: tuple[TrackMark, ...]
    figures: Numbers
    reading: CardRangeReading
    inside: int
    range_exit: TrackMark | None = None

    def outside(self, mark: TrackMark) -> bool:
        """True if a mark is outside the card's range."""
        return self.range_exit is not None and mark.time_s >= self.range_exit.time_s

    @property
    def study(self) -> TrackStudy:
        """All values, the track thinned to 200 points."""
        every = max(1, len(self.ahead_m) // 200)
        return TrackStudy(
            name=self.name,
            figures=self.figures,
            left_card_range_s=self.reading.exit_s,
            left_card_range_by=self.reading.how,
            outside_card_range=self.reading.outside_names,
            left_card_range_at=self.range_exit,
            marks=self.marks,
            ahead_m=self.ahead_m[::every],
            starboard_m=self.starboard_m[::every],
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class TrackStudy:
    """A track as numbers: figures, the end of the card's range (None within it), marks, and the track to draw."""

    name: str
    figures: dict[str, float]
    left_card_range_s: float | None
    left_card_range_by: str
    outside_card_range: tuple[str, ...]
    left_card_range_at: TrackMark | None
    marks: tuple[TrackMark, ...]
    ahead_m: Array
    starboard_m: Array


def circle_track(side: str, run: Run) -> ShipTrack:
    """A turning circle to its full turn; `side` is starboard or port."""
    path = run.trajectory
    sign = 1.0 if side == "starboard" else -1.0
    change = sign * np.degrees(path["motion.psi"] - path["motion.psi"][0])
    rows = [row for angle in (90.0, 180.0, 270.0, 360.0) if (row := _first_over(change, angle)) < len(change)]
    return _track(side, run, change, rows, min(_first_over(change, 360.0) + 1, len(change)))


def stop_track(name: str, run: Run) -> ShipTrack:
    """A stopping track, marked at equal times."""
    change = np.degrees(run.trajectory["motion.psi"] - run.trajectory["motion.psi"][0])
    rows = np.unique(np.linspace(0, len(change) - 1, 7).astype(int))[1:]
    return _track(name, run, change, rows.tolist(), len(change))


def _track(name: str, run: Run, change: Array, rows: list[int], end: int) -> ShipTrack:
    path = run.trajectory
    ahead, starboard = _in_first_axes(path)
    marks = tuple(_mark(path, change, row) for row in rows)
    row, figures = range_exit_row(path), figure_numbers(run.figures)
    if row is None:
        return ShipTrack(name, ahead[:end], starboard[:end], marks, figures, run.reading, end)
    exit_mark = _mark(path, change, row)
    return ShipTrack(
        name,
        ahead[:end],
        starboard[:end],
        marks,
        figure_numbers(run.figures),
        run.reading,
        min(row + 1, end),
        exit_mark,
    )


def quarter(path: ShipTrack, change_deg: float) -> TrackMark | None:
    """The mark at a change of heading; None if the turn does not reach it."""
    return next((mark for mark in path.marks if mark.heading_change_deg >= change_deg), None)


def _in_first_axes(run: Trajectory) -> tuple[Array, Array]:
    north, east = run["motion.x"] - run["motion.x"][0], run["motion.y"] - run["motion.y"][0]
    cos, sin = math.cos(run["motion.psi"][0]), math.sin(run["motion.psi"][0])
    return north * cos + east * sin, east * cos - north * sin


def _first_over(values: Array, level: float) -> int:
    over = np.flatnonzero(values >= level)
    return int(over[0]) if len(over) else len(values)


def _mark(run: Trajectory, change: Array, row: int) -> TrackMark:
    ahead, starboard = _in_first_axes(run)
    return TrackMark(
        float(run.t[row]), float(change[row]), float(ahead[row]), float(starboard[row]), float(run["motion.speed"][row])
    )
