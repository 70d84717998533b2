"""The rudder of a recorded manoeuvre: held angles, with the time of their order and the rate of the rudder."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from tank2sim.arrays import Array
from tank2sim.records.audit.noise import white_noise
from tank2sim.records.trials import (
    Trial,
    held_over_gaps,
    order_instants,
    sampling_step,
    straight_over_gaps,
    usual_step,
)

Places = NDArray[np.int64]

_LEAST_RUDDER = math.radians(2.0)
"""Least rudder angle of a manoeuvre."""

_STEADY = 0.02
_HELD = 0.05
"""A rudder is held when it stays within a share STEADY of an angle for a share HELD of the longest such time: project
choices. In the approaches of the 3 m Esso Osaka it stays for at most 2 % of that, at the first angle of zigzags of the
KVLCC2 for at least 13 % (35/5)."""

_OVER = 0.8
"""Share of the usual largest angle from which a rudder is over (project choice: above the zigzag's other angles)."""

_BAND, _PASSES = 0.1, 3.0
"""A rudder is held between two angles if it is within a BAND (a share of the usual largest angle) for more than two
rows and so many times as long as it takes to pass it at its rate (project choices; the helmsmen of the 3 m Esso Osaka,
and gears with a lag, stay below)."""

STEEPER = 3.0
"""Factor by which a moving rudder does not accelerate: gears have constant or falling rates (project choice)."""

_ROUNDS = 6
"""Iterations; each halves the error of a record that begins with a moving rudder: project choice."""

_REACHED = 0.9
"""Share of an angle at which the rudder counts as arrived: above the shares that determine its rate, below the slow
last part of a gear with a lag (project choice)."""

TURNS_AT_EXECUTE = 0.2
"""Share of the largest yaw rate of a record above which the ship turns at its execute: smoothed, it is 0.07 at most in
the trials of the 3 m Esso Osaka, 0.04 in HSVA's and MARIN's, and 0.11 in a 10/10 zigzag of a Mariner (project
choice)."""

_BEGINNING = 5
"""Rows of a record whose straight line gives its first yaw rate (project choice)."""

_TURN_ABOVE_NOISE = 5.0
"""Noises from which a mean yaw rate is a turn (project choice)."""

LEAVING = 0.05
"""Share of its change from which an order counts as changed: at once for a step, early in a ramp (project choice)."""


@dataclass(frozen=True)
class HeldAngle:
    """A rudder angle that was held."""

    angle: float  # The angle reached, rad, positive to starboard
    # Time of the order where the record has it, before the first row that shows it (:func:`.order_instants`), else the
    # start of the rudder's motion.
    execute_s: float
    moves_s: float  # Start of the rudder's motion; the execute where only the order is known
    rate: float | None  # Rate of the rudder, rad/s; None where only the order is known
    end_s: float  # Time until which it was held


def held_rudders(trial: Trial) -> list[HeldAngle]:
    """Angles at which the rudder of a trial was held, with alternating sides; empty if it was not used.

    The start of the motion is where the straight part of its course, extrapolated back, meets the previous angle. If
    the record has the order, too, its step is the execute; an order without the same angles is ignored.
    """
    moved, ordered = _of_angle(trial), _of_order(trial)
    if not moved or not ordered:
        return moved or ordered
    if len(moved) != len(ordered):
        return moved
    pairs = list(zip(moved, ordered, strict=True))
    if any(move.angle * order.angle <= 0 or order.execute_s > move.end_s for move, order in pairs):
        return moved
    return [replace(move, execute_s=order.execute_s) for move, order in pairs]


def rudder_of(trial: Trial) -> Array:
    """The rudder's angle (n,), rad, without gaps; its order if only that is known."""
    angle = _known(trial, "delta_rad")
    if angle is not None:
        return straight_over_gaps(trial.time_s, angle)
    return held_over_gaps(trial.signals["delta_order_rad"])


def holds_other_angles(trial: Trial, held: list[HeldAngle]) -> bool:
    """True if the rudder is held at another angle between two of its `held` angles, or between two times of one."""
    time, rudder, step = trial.time_s, rudder_of(trial), sampling_step(trial)
    size = _usual_largest(rudder)
    for begin, held_angle in zip([held[0].moves_s, *(before.end_s for before in held)], held, strict=False):
        inside = (time > begin) & (time <= held_angle.end_s) & (np.abs(rudder) <= _OVER * size)
        angles = np.sort(rudder[inside])
        near = np.searchsorted(angles, angles + _BAND * size, side="right") - np.arange(len(angles))
        passing = _BAND * size / held_angle.rate if held_angle.rate and held_angle.rate > 0 else 0.0
        if np.max(near, initial=0) * step > _PASSES * passing + 2 * step:
            return True
    return False


def rudder_before(trial: Trial, held: HeldAngle) -> float:
    """The rudder's angle at an execute, rad.

    It is the angle in the last row before the rudder moves. Where only orders are known, it is the order of the row
    before, for the rudder moves after its order; amidships in a record that begins at the execute.
    """
    rudder = rudder_of(trial)
    if held.rate is not None:
        return float(rudder[max(int(np.searchsorted(trial.time_s, held.moves_s, side="right")) - 1, 0)])
    row = int(np.searchsorted(trial.time_s, held.execute_s))
    return float(rudder[row - 1]) if row else 0.0


def first_rudder(time: Array, order: Array, rates: Array, headings: Array, ship_time: float) -> float:
    """The rudder's angle at the first instant of a record where only its order is known, rad.

    It is the first order; amidships where the record begins at its execute: the order is to put the rudder over, and
    the ship turns to that side later, and not yet.

    `time` (n,): s. `order` (n,): rad. `rates`, `headings` (n,): Yaw rate, rad/s, and heading, rad; nan where not
    measured. `ship_time`: L/u0, s.
    """
    if np.isnan(rates).all() and not np.isnan(headings).all():
        rates = np.gradient(straight_over_gaps(time, headings), usual_step(time))
    if np.isnan(rates).all() or not _is_over(float(order[0]), order):
        return float(order[0])
    rates = np.sign(order[0]) * straight_over_gaps(time, rates)
    largest = float(np.max(uniform_filter1d(rates, max(1, round(ship_time / usual_step(time))))))
    _, first = np.polyfit(np.arange(_BEGINNING), rates[:_BEGINNING], 1)
    turns_later = largest > _TURN_ABOVE_NOISE * white_noise(rates)
    return 0.0 if turns_later and first < TURNS_AT_EXECUTE * largest else float(order[0])


def _known(trial: Trial, name: str) -> Array | None:
    """Readings (n,) of a signal; None if there are none."""
    values = trial.signals.get(name)
    return None if values is None or np.isnan(values).all() else values


def _of_angle(trial: Trial) -> list[HeldAngle]:
    if _known(trial, "delta_rad") is None:
        return []
    time, rudder = trial.time_s, rudder_of(trial)
    found: list[HeldAngle] = []
    before = 0
    for group in _held(rudder):
        angle = float(np.median(rudder[group]))
        arrived = group[np.abs(rudder[group]) >= _REACHED * abs(angle)]
        stretch = slice(before, int(arrived[0] if len(arrived) else group[0]) + 1)
        if found:
            moves, rate = _begins(time[stretch], rudder[stretch], found[-1].angle, angle)
        else:
            moves, rate = _first_begins(time[stretch], rudder[stretch], angle)
        found.append(HeldAngle(angle, moves, moves, min(rate, math.pi), float(time[group[-1]])))
        before = int(group[-1])
    return found


def _of_order(trial: Trial) -> list[HeldAngle]:
    known = _known(trial, "delta_order_rad")
    if known is None:
        return []
    time, order, given = trial.time_s, held_over_gaps(known), order_instants(trial.time_s)
    found: list[HeldAngle] = []
    before = 0
    for group in _held(order):
        angle = float(np.median(order[group]))
        previous = (
            found[-1].angle if found else float(np.median(order[before : int(group[0])] if group[0] else order[:1]))
        )
        way = math.copysign(1.0, angle - previous) * (order[before : int(group[0]) + 1] - previous)
        still = np.flatnonzero(way < LEAVING * abs(angle - previous))
        execute = float(given[min(before + int(still[-1]) + 1, int(group[0])) if len(still) else before])
        found.append(HeldAngle(angle, execute, execute, None, float(time[group[-1]])))
        before = int(group[-1])
    return found


def _first_begins(time: Array, rudder: Array, angle: float) -> tuple[float, float]:
    """The same from the approach, whose rudder is its median until the execute: both are found iteratively."""
    origin = float(np.median(rudder))
    for _ in range(_ROUNDS):
        execute, _ = _begins(time, rudder, origin, angle)
        origin = float(np.median(rudder[: max(1, int(np.searchsorted(time, execute)))]))
    return _begins(time, rudder, origin, angle)


def _begins(time: Array, rudder: Array, origin: float, angle: float) -> tuple[float, float]:
    """Start of the rudder's motion between two angles, s, and its rate, rad/s, at the end of a stretch."""
    sign = math.copysign(1.0, angle)
    course, whole = sign * (rudder - origin), sign * (angle - origin)
    if whole == 0:
        return float(time[0]), math.inf  # the record begins with the rudder there
    quarter, most, late = (_last_crossing(time, course, share * whole) for share in (0.25, 0.7, 0.85))
    rate, last = 0.45 * whole / max(most - quarter, 1e-9), 0.15 * whole / max(late - most, 1e-9)
    if last > STEEPER * rate:  # the approach used more than a quarter of the angle, and the motion started there
        rate = last
    return most - 0.7 * whole / rate, rate


def _is_over(angle: float, rudder: Array) -> bool:
    """True if an angle (rad) is one at which a rudder (n,) is over, and not one of course keeping."""
    return abs(angle) > max(_OVER * _usual_largest(rudder), _LEAST_RUDDER)


def _usual_largest(rudder: Array) -> float:
    """Largest angle of a rudder (n,) without the 5 % beyond it, rad."""
    return float(np.percentile(np.abs(rudder), 95))


def _held(rudder: Array) -> list[Places]:
    """Samples of each held angle, with alternating sides; samples before the first belong to the approach."""
    size = _usual_largest(rudder)
    if size < _LEAST_RUDDER:
        return []
    side = np.where(np.abs(rudder) > _OVER * size, np.sign(rudder), 0)
    places = np.flatnonzero(side)
    parts = np.split(places, np.flatnonzero((np.diff(side[places]) != 0) | (np.diff(places) > 1)) + 1)
    runs = [part for part in parts if len(part) >= 3]
    if not runs:
        return []
    steady = [np.count_nonzero(np.abs(rudder[run] - np.median(rudder[run])) < _STEADY * size) for run in runs]
    kept = runs[int(np.argmax(np.array(steady) >= _HELD * max(steady))) :]
    turns = np.flatnonzero(np.diff([side[run[0]] for run in kept])) + 1
    return [np.concatenate(kept[a:b]) for a, b in pairwise([0, *turns.tolist(), len(kept)])]


def _last_crossing(time: Array, course: Array, level: float) -> float:
    below = np.flatnonzero(course < level)
    last = int(below[-1]) if len(below) else 0
    if last + 1 >= len(course):
        return float(time[last])
    share = (level - course[last]) / (course[last + 1] - course[last])
    return float(time[last] + share * (time[last + 1] - time[last]))
