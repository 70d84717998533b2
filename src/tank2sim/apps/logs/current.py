"""The current of a voyage, from velocities over the ground and through the water."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tank2sim.apps.logs.clock import usual_step
from tank2sim.apps.logs.reference import POSITION_WINDOW_S, differenced, interpolated
from tank2sim.apps.logs.voyage import Voyage
from tank2sim.arrays import Array

AVERAGED_S = 60.0
"""Time over which the current is averaged for its spread, s. Project choice: receivers wander over minutes."""

_FEWEST = 10
"""Samples below which no current is determined (project choice)."""

_LEAST_TURN = 0.15
"""Least eigenvalue, of at most 0.5, of the mean square of heading vectors for which the speed ahead alone determines a
current: headings spread over about 90 deg. Project choice."""


@dataclass(frozen=True)
class DriftCurrent:
    """A current: speed (m/s), direction towards which it sets (deg from north), and how much it varies.

    - `spread_mps`: Standard deviation of its averages over :data:`AVERAGED_S`, m/s.
    - `by`: What it follows from.
    """

    speed_mps: float
    direction_deg: float
    spread_mps: float
    by: str


def drift_current(voyage: Voyage, begin_s: float, end_s: float) -> DriftCurrent | None:
    """Current between two times of a voyage; None where its log does not determine it.

    With both components of the velocity through the water it is the mean difference of the velocities over ground and
    water. With the speed ahead alone the difference of the speeds ahead is fitted by the current's component on the
    heading, for which the heading must have changed. A scale error of the log through the water is part of it.
    """
    series = voyage.series
    ground = _ground(voyage)
    if "heading" not in series or "u_water" not in series or ground is None:
        return None
    inside = (ground[0] >= begin_s) & (ground[0] <= end_s)
    time, north, east = (part[inside] for part in ground)
    if len(time) < _FEWEST:
        return None
    heading, ahead, side = (
        interpolated(time, series[name].time_s, series[name].values, 5.0) if name in series else np.zeros(0)
        for name in ("heading", "u_water", "v_water")
    )
    cosine, sine = np.cos(heading), np.sin(heading)
    if "v_water" in series:
        x, y = north - (ahead * cosine - side * sine), east - (ahead * sine + side * cosine)
        good = np.isfinite(x) & np.isfinite(y)
        if good.sum() < _FEWEST:
            return None
        time, x, y = time[good], x[good], y[good]
        bins = np.floor((time - time[0]) / AVERAGED_S).astype(int)
        counts = np.bincount(bins)
        full = counts > 0
        means = [np.bincount(bins, weights=part)[full] / counts[full] for part in (x, y)]
        spread = math.hypot(float(np.std(means[0])), float(np.std(means[1])))
        return _current(float(x.mean()), float(y.mean()), spread, "velocities over the ground and through the water")
    difference = north * cosine + east * sine - ahead
    good = np.isfinite(difference)
    matrix = np.column_stack([cosine[good], sine[good]])
    if good.sum() < _FEWEST or np.linalg.eigvalsh(matrix.T @ matrix / good.sum())[0] < _LEAST_TURN:
        return None
    mean, *_ = np.linalg.lstsq(matrix, difference[good], rcond=None)
    spread = float(np.std(difference[good] - matrix @ mean))
    return _current(float(mean[0]), float(mean[1]), spread, "speeds ahead over the ground and through the water")


def _current(north: float, east: float, spread: float, by: str) -> DriftCurrent:
    return DriftCurrent(math.hypot(north, east), math.degrees(math.atan2(east, north)) % 360, spread, by)


def _ground(voyage: Voyage) -> tuple[Array, Array, Array] | None:
    """Times and velocity to north and east over the ground."""
    series = voyage.series
    if "v_north" in series and "v_east" in series:
        north, east = series["v_north"], series["v_east"]
        return north.time_s, north.values, np.interp(north.time_s, east.time_s, east.values)
    if "sog" in series and "cog" in series:
        sog, cog = series["sog"], series["cog"]
        longest = 3 * max(usual_step(cog.time_s), 1.0)
        cosine, sine = (
            interpolated(sog.time_s, cog.time_s, part, longest) for part in (np.cos(cog.values), np.sin(cog.values))
        )
        course = np.arctan2(sine, cosine)
        return sog.time_s, sog.values * np.cos(course), sog.values * np.sin(course)
    if "x" in series and "y" in series:
        time, v_north = differenced(series["x"].time_s, series["x"].values, POSITION_WINDOW_S)
        return time, v_north, differenced(series["y"].time_s, series["y"].values, POSITION_WINDOW_S)[1]
    return None
