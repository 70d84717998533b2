"""Fewer samples for the same picture: a chart a few hundred pixels wide shows no more."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tank2sim.arrays import Array, Columns

Indices = NDArray[np.int64]


def thin_line(columns: Sequence[Array], limit: int) -> Indices:
    """Samples to keep of a line that is drawn through all of them.

    The samples are cut into equal buckets, and of each bucket the lowest and the highest of every column stay, so no
    peak is lost. The first and last sample stay, and of every bucket with gaps (NaN) one gap.

    Parameters
    ----------
    columns : sequence of (n,) arrays
        What is drawn: ``[y]`` against an even time, ``[x, y]`` for a track. The unit does not matter.
    limit : int
        Samples to keep at most, except for gaps and the two ends; a shorter line keeps all.

    Returns
    -------
    (m,) array of int
        Indices, ascending.
    """
    count = len(columns[0])
    if count <= limit:
        return np.arange(count)
    buckets = max(1, limit // (2 * len(columns)))
    edges = np.linspace(0, count, buckets + 1).astype(int)
    kept = {0, count - 1}
    for column in columns:
        gap = np.isnan(column)
        low, high = np.where(gap, np.inf, column), np.where(gap, -np.inf, column)
        for begin, end in itertools.pairwise(edges.tolist()):
            kept.add(int(begin + np.argmin(low[begin:end])))
            kept.add(int(begin + np.argmax(high[begin:end])))
            if gap[begin:end].any():
                kept.add(int(begin + np.argmax(gap[begin:end])))
    return np.array(sorted(kept))


def thin_points(columns: Sequence[Array], limit: int) -> Indices:
    """Samples to keep of points that are drawn singly: evenly spread ones, and the extremes of every column.

    Parameters and result as for :func:`thin_line`; up to two extremes a column come on top of `limit`.
    """
    count = len(columns[0])
    if count <= limit:
        return np.arange(count)
    kept = set(np.linspace(0, count - 1, limit).round().astype(int).tolist())
    for column in columns:
        if not np.isnan(column).all():
            kept |= {int(np.nanargmin(column)), int(np.nanargmax(column))}
    return np.array(sorted(kept))


DRAWN_SAMPLES = 600
"""Samples of a run in the JSON of a result: as many as a chart is wide. Whole runs are for trial files."""

MEASURED_SAMPLES = 400
"""Samples of each trial in the JSON, for charts. Project choice: a chart is a few hundred pixels wide, and the record
itself is the file."""

_DIGITS = 7


def drawn_columns(columns: Mapping[str, ArrayLike], limit: int = DRAWN_SAMPLES, *, peaks: bool = False) -> Columns:
    """Columns (n,) of one table, thinned to draw, to seven digits; the first lies across.

    `columns`: Name to values (n,). `limit`: Samples to keep, about. `peaks`: Keep every peak of a record
    (:func:`thin_line`); else samples are evenly spread (:func:`thin_points`).
    """
    whole = {name: np.asarray(values, dtype=float) for name, values in columns.items()}
    up = list(whole.values())[1:]
    kept = thin_line(up, limit) if peaks else thin_points(up, limit)
    return {name: np.array([float(f"{value:.{_DIGITS}g}") for value in values[kept]]) for name, values in whole.items()}
