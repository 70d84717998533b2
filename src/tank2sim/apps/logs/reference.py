"""Reference motion of a log: positions and headings, against which every other stream is judged."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from tank2sim.apps.logs.streams import wrapped_angle
from tank2sim.arrays import Array
from tank2sim.dynamics.geographic import EQUATORIAL_RADIUS_M, FLATTENING
from tank2sim.records.trials import usual_step

POSITION_WINDOW_S = 4.0
"""Time over which positions are differenced, s. Project choice: noise of 0.5 m of a receiver is then 0.1 m/s, and a
small craft turns by less than a quadrant."""

HEADING_WINDOW_S = 2.0
"""Time over which headings are differenced, s. Project choice: noise of 0.3 deg of a compass is then 0.2 deg/s."""

MOVING_SHARE = 0.3
"""Share of the 95th percentile of speed above which course and heading are compared. Project choice: below, current and
leeway turn the course."""

LEAST_SPEED_MPS = 0.3
"""Speed below which a course is noise, m/s: receivers leave it out below about half a knot."""

_LONGEST_BRIDGE = 3.0  # Gaps of this many windows are not bridged in differences


@dataclass(frozen=True, eq=False)
class ReferenceMotion:
    """Motion by positions and headings alone.

    - `time_s` (n,): Times of the velocities, UTC s.
    - `v_north_mps`, `v_east_mps` (n,): Over the ground, m/s.
    - `heading_time_s`, `heading_rad` (m,): Continuous heading, rad; empty where there is none.
    """

    time_s: Array
    v_north_mps: Array
    v_east_mps: Array
    heading_time_s: Array
    heading_rad: Array

    @property
    def speed_mps(self) -> Array:
        """Speed over the ground (n,)."""
        return np.asarray(np.hypot(self.v_north_mps, self.v_east_mps))

    @property
    def moving(self) -> np.ndarray:
        """Where the speed suffices to compare courses (n,)."""
        speed = self.speed_mps
        if not len(speed):
            return np.zeros(0, dtype=bool)
        return np.asarray(speed > max(LEAST_SPEED_MPS, MOVING_SHARE * float(np.percentile(speed, 95))))

    def going(self, way: Array) -> ReferenceMotion:
        """The motion with its course turned about where the sign of a `way` (n,) is negative: where the bow points."""
        sign = np.where(way < 0, -1.0, 1.0)
        return replace(self, v_north_mps=sign * self.v_north_mps, v_east_mps=sign * self.v_east_mps)


def local_metres(latitude_deg: Array, longitude_deg: Array, origin_deg: tuple[float, float]) -> tuple[Array, Array]:
    """North and east (n,), m, of an origin: the inverse of the series of :mod:`tank2sim.dynamics.geographic`.

    The series is solved for x and y by three fixed-point steps; the remainder is below 1 mm within 20 km. Radii of
    curvature in the meridian and the prime vertical as in WGS 84 (Torge & Mueller 2012, 4.1).
    """
    phi0 = math.radians(origin_deg[0])
    sine, cosine, tangent = math.sin(phi0), math.cos(phi0), math.tan(phi0)
    eccentricity = FLATTENING * (2 - FLATTENING)
    squared = 1 - eccentricity * sine**2
    prime_vertical = EQUATORIAL_RADIUS_M / math.sqrt(squared)
    meridian = prime_vertical * (1 - eccentricity) / squared
    d_phi = np.radians(latitude_deg - origin_deg[0])
    d_lambda = wrapped_angle(np.radians(longitude_deg - origin_deg[1])) * cosine
    x, y = d_phi.copy(), d_lambda.copy()
    for _ in range(3):
        bent = y**2 * tangent * prime_vertical / meridian / 2 + 1.5 * eccentricity * sine * cosine * x**2 / squared
        x, y = d_phi + bent, d_lambda / (1 + x * meridian / prime_vertical * tangent)
    return x * meridian, y * prime_vertical


def rounded_origin(latitude_deg: Array, longitude_deg: Array) -> tuple[float, float]:
    """Origin of local metres: the first position, to 0.001 deg, so that all formats of one voyage have the same."""
    return round(float(latitude_deg[0]), 3), round(float(longitude_deg[0]), 3)


def differenced(time_s: Array, values: Array, window_s: float) -> tuple[Array, Array]:
    """Slopes (k,) of a series over a window, and the times of their middles (k,); none across gaps."""
    if len(time_s) < 3:
        return np.zeros(0), np.zeros(0)
    step = usual_step(time_s)
    reach = max(1, round(max(window_s, step) / step))
    span = time_s[reach:] - time_s[:-reach]
    good = (span > 0) & (span < _LONGEST_BRIDGE * max(window_s, step))
    slopes = (values[reach:] - values[:-reach])[good] / span[good]
    return (0.5 * (time_s[reach:] + time_s[:-reach]))[good], slopes


def interpolated(at_s: Array, time_s: Array, values: Array, longest_s: float) -> Array:
    """Values (n,) at other times by straight lines; nan outside and in gaps of more than `longest_s`."""
    if len(time_s) < 2:
        return np.full(len(at_s), np.nan)
    place = np.clip(np.searchsorted(time_s, at_s), 1, len(time_s) - 1)
    inside = (at_s >= time_s[0]) & (at_s <= time_s[-1]) & (time_s[place] - time_s[place - 1] <= longest_s)
    return np.where(inside, np.interp(at_s, time_s, values), np.nan)


def interpolated_angle(at_s: Array, time_s: Array, angle_rad: Array, longest_s: float) -> Array:
    """Angles (n,), rad, at other times, by their cosines and sines; nan as in :func:`interpolated`."""
    sine, cosine = (interpolated(at_s, time_s, part, longest_s) for part in (np.sin(angle_rad), np.cos(angle_rad)))
    return np.asarray(np.arctan2(sine, cosine))


def held(at_s: Array, time_s: Array, values: Array) -> Array:
    """Values (n,) at other times, each held until the next; nan before the first."""
    place = np.searchsorted(time_s, at_s, side="right") - 1
    return np.where(place >= 0, values[np.maximum(place, 0)], np.nan)


def thinned_series(time_s: Array, values: Array, step_s: float) -> tuple[Array, Array]:
    """Means of a series in bins of `step_s`, where it is denser than that."""
    if usual_step(time_s) >= step_s:
        return time_s, values
    bins = np.floor((time_s - time_s[0]) / step_s).astype(np.int64)
    starts = np.flatnonzero(np.concatenate([[True], np.diff(bins) > 0]))
    counts = np.diff(np.append(starts, len(values)))
    return np.add.reduceat(time_s, starts) / counts, np.add.reduceat(values, starts) / counts
