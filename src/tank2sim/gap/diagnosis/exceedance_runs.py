"""Intervals in which a residual exceeds the noise."""

from __future__ import annotations

import math

import numpy as np
from scipy.ndimage import uniform_filter1d

from tank2sim.arrays import Array

EXCEEDANCE_WINDOW = 21
"""Instants over which the square of a residual is averaged to distinguish misfit from noise: half of L/u0."""

BEYOND = 4.0
"""A mean square belongs to an interval if it exceeds that of noise by this many of its own standard deviations (project
choice)."""


def exceedance_intervals(
    z: Array, limit: float | None = None, width: int = EXCEEDANCE_WINDOW
) -> list[tuple[int, int, float]]:
    """Begin, end (one past the last) and excess of each interval in which the mean square of z is beyond that of noise.

    Parameters
    ----------
    z : array (n,)
        In standard deviations of noise; nan where nothing is known.
    limit : float, optional
        By how much the mean of z^2 - 1 over the window must exceed 0; by default :data:`BEYOND` standard deviations of
        it for white noise.
    width : int
        Instants in the window; intervals nearer to each other are merged.

    Returns
    -------
    list of (int, int, float)
        The excess is the sum of z^2 - 1 over the interval; it is positive.
    """
    excess = np.where(np.isfinite(z), np.nan_to_num(z) ** 2 - 1, 0.0)
    width = min(width, len(z))
    if not width:
        return []
    # a squared normal has variance 2
    least = BEYOND * math.sqrt(2 / width) if limit is None else limit
    high = uniform_filter1d(excess, width) > least
    edges = np.flatnonzero(np.diff(np.concatenate([[0], high.astype(int), [0]])))
    pairs = [[int(begin), int(end)] for begin, end in zip(edges[::2], edges[1::2], strict=True)]
    joined: list[list[int]] = []
    for pair in pairs:
        if joined and pair[0] - joined[-1][1] < width:
            joined[-1][1] = pair[1]
        else:
            joined.append(pair)
    sums = [(begin, end, float(excess[begin:end].sum())) for begin, end in joined]
    return [run for run in sums if run[2] > 0]
