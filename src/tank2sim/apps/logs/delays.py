"""By how much a rate of turn is late against the heading, with its standard error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tank2sim.apps.logs.clock import usual_step
from tank2sim.apps.logs.reference import interpolated, thinned_series
from tank2sim.arrays import Array

SEGMENT_S = 60.0
"""Length of the segments, each with an offset and a drift of its own, s: gyros drift over minutes (project choice)."""

LEAST_SEGMENTS = 6
"""Segments from which a scatter between them means something (project choice)."""

LEAST_DELAY_S = 0.1
"""Delay below which a channel is left as it is, s (project choice: a ship turns by 0.2 deg at most in it)."""

SURE_ERRORS = 5.0
"""Standard errors by which a delay that is applied differs from 0 (project choice)."""

_LARGEST_DELAY_S = 3.0
_STEPS = 6


@dataclass(frozen=True)
class RateDelay:
    """By how much a rate of turn is late against the heading, s (negative: the heading is late), and its error."""

    delay_s: float
    standard_error_s: float

    @property
    def certain(self) -> bool:
        """Whether it is large and sure enough to be applied."""
        return abs(self.delay_s) > max(LEAST_DELAY_S, SURE_ERRORS * self.standard_error_s)


def rate_delay(heading_time_s: Array, heading_rad: Array, rate_time_s: Array, rate_radps: Array) -> RateDelay | None:
    """Delay of a rate of turn (m,), rad/s, against a continuous heading (n,), rad; None where too little overlaps.

    The heading is the integral of the rate a delay d later, which to first order in each segment is

        psi(t) = s A(t) + d r(t) + a + b t,  A the integral of r,

    solved by least squares, with the rate moved by d until it no longer changes. The standard error is that of the
    scatter between segments (Liang and Zeger 1986, Biometrika 73), so that drift of the sensors is in it.
    """
    rate_at, rate = thinned_series(rate_time_s, rate_radps, 0.2)
    if len(rate_at) < 3 or len(heading_time_s) < 3:
        return None
    area = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(rate_at))])
    at, heading = thinned_series(heading_time_s, heading_rad, 0.2)
    longest = 5 * max(usual_step(rate_at), usual_step(at))
    segment = np.floor((at - at[0]) / SEGMENT_S).astype(np.int64)
    delay, error = 0.0, np.inf
    for _ in range(_STEPS):
        columns = [interpolated(at + delay, rate_at, values, longest) for values in (area, rate)]
        parts = [
            _without_line(at[rows], np.column_stack([heading[rows], *(column[rows] for column in columns)]))
            for number in np.unique(segment)
            if (rows := np.flatnonzero((segment == number) & np.isfinite(columns[0]))).size > 10
        ]
        if len(parts) < LEAST_SEGMENTS:
            return None
        X, y = np.concatenate([part[:, 1:] for part in parts]), np.concatenate([part[:, 0] for part in parts])
        normal = X.T @ X
        if np.linalg.cond(normal / np.sqrt(np.outer(np.diag(normal), np.diag(normal)))) > 1e8:
            return None
        (scale, step), *_ = np.linalg.lstsq(X, y, rcond=None)
        scores = np.array([part[:, 1:].T @ (part[:, 0] - part[:, 1:] @ [scale, step]) for part in parts])
        inverse = np.linalg.inv(normal)
        spread = np.sqrt((inverse @ (scores.T @ scores) @ inverse)[1, 1] * len(parts) / (len(parts) - 1))
        change, error = step / scale, float(spread / abs(scale))
        delay += float(change)
        if abs(delay) > _LARGEST_DELAY_S:
            return None
        if abs(change) < 0.01:
            break
    return RateDelay(delay, error)


def _without_line(time_s: Array, columns: Array) -> Array:
    """Columns (n, k) less their straight lines in time."""
    line = np.column_stack([np.ones(len(time_s)), time_s - time_s.mean()])
    return np.asarray(columns - line @ np.linalg.lstsq(line, columns, rcond=None)[0])
