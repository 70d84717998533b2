"""The drift of a turning circle: by IMO's pairs a full turn apart, and by a circle in a moving frame.

A uniform current drifts the circle of a steady turn as a whole. A constant wind drifts it, too, across the wind, and to
opposite sides for turns to port and to starboard. Pairs of one turn cannot separate the two.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tank2sim.arrays import Array

STEADY_FROM = math.pi
"""Change of heading from which a turn counts as steady: after 180 deg (MSC/Circ.1053, 3.4.2)."""

FULL_TURN = 2 * math.pi

LEAST_PAIRS = math.radians(30.0)
"""Arc of second points, less than which the pairs are too few. Project choice: 30 s of a slow ship."""

LEAST_ARC = math.radians(135.0)
"""Least arc of a steady turn for a circle in a moving frame: on a shorter one, centre and drift go together. Project
choice: 180 deg are enough in a current alone."""


@dataclass(frozen=True, kw_only=True)
class CircleDrift:
    """Drift of a turning circle.

    `north_mps`, `east_mps`: velocity of the circle over the ground; `spread_mps`: root mean square of the pairs about
    their mean, None without pairs (it shows a drift that changes; a constant wind has almost none); `residual_m`: root
    mean square distance of the track from the circle in the moving frame, large in a wind; `method`: ``pairs a full
    turn apart`` or ``circle in a moving frame``; `turned_deg`: change of heading of the record.
    """

    north_mps: float
    east_mps: float
    spread_mps: float | None
    residual_m: float
    method: str
    turned_deg: float

    @property
    def vector(self) -> Array:
        """North and east (2,), m/s."""
        return np.array([self.north_mps, self.east_mps])


def circle_drift(time_s: Array, north_m: Array, east_m: Array, heading_rad: Array) -> CircleDrift | None:
    """The drift of a turn from its execute on; None of one that is too short to show it.

    Positions one full turn apart, of a steady turn in a uniform current, are apart by the current alone
    (MSC/Circ.1053, 3.4.2): ``v_i = (x(psi + 2 pi) - x(psi)) / (t(psi + 2 pi) - t(psi))``, and their mean is the drift.
    A record of less than 540 deg lacks these pairs. A steady turn is then fitted by least squares,

        x = c_x + V_x t + a cos(psi) + b sin(psi),   y = c_y + V_y t + a sin(psi) - b cos(psi).

    All arrays (n,) begin at the execute; the heading is continuous.
    """
    turned = np.maximum.accumulate(np.abs(heading_rad - heading_rad[0]))
    steady = turned >= STEADY_FROM
    reached, spread, method = float(turned[-1]), None, "circle in a moving frame"
    if reached < STEADY_FROM + LEAST_ARC:
        return None
    found, residual = _moving_circle(*(values[steady] for values in (time_s, north_m, east_m, heading_rad)))
    if reached >= STEADY_FROM + FULL_TURN + LEAST_PAIRS:
        # The instants at which a heading is reached; where noise makes the heading fall, the first of them.
        rising = np.concatenate([[True], np.diff(turned) > 0])
        later = turned[steady & rising & (turned >= STEADY_FROM + FULL_TURN)]
        times = [np.interp(angles, turned[rising], time_s[rising]) for angles in (later - FULL_TURN, later)]
        tracks = [np.array([np.interp(at, time_s, values) for values in (north_m, east_m)]) for at in times]
        velocities = (tracks[1] - tracks[0]) / (times[1] - times[0])
        found = velocities.mean(axis=1)
        spread = float(np.sqrt(np.mean(np.sum((velocities - found[:, None]) ** 2, axis=0))))
        method = "pairs a full turn apart"
    return CircleDrift(
        north_mps=float(found[0]),
        east_mps=float(found[1]),
        spread_mps=spread,
        residual_m=residual,
        method=method,
        turned_deg=math.degrees(reached),
    )


def _moving_circle(time: Array, north: Array, east: Array, heading: Array) -> tuple[Array, float]:
    """Drift (2,), m/s, of a steady turn, and the root mean square distance from it, m."""
    t, cos, sin = time - time[0], np.cos(heading), np.sin(heading)
    one, none = np.ones_like(t), np.zeros_like(t)
    columns = [(one, none), (none, one), (t, none), (none, t), (cos, sin), (sin, -cos)]
    matrix = np.array([np.concatenate(column) for column in columns]).T
    measured = np.concatenate([north, east])
    solution = np.linalg.lstsq(matrix, measured, rcond=None)[0]
    left = measured - matrix @ solution
    return solution[2:4], math.sqrt(2 * float(np.mean(left**2)))
