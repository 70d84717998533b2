"""Bands of an ensemble: between which values nine of ten members lie, of figures, histories and tracks."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tank2sim.simulation.ensemble import Ensemble

Array = NDArray[np.float64]

QUANTILES = (0.05, 0.50, 0.95)
"""Lower end, middle and upper end of a band."""

STILL_RUNNING = 0.95
"""A band over time ends where fewer than this share of the members still run: what is left are the slow ones (ours)."""


@dataclass(frozen=True)
class Band:
    """A band of a figure: its 5, 50 and 95 % quantiles over the members that show it, and how many these are."""

    low: float
    median: float
    high: float
    shown: int

    def as_json(self) -> dict[str, object]:
        """By the names of the quantiles."""
        return {"p5": self.low, "p50": self.median, "p95": self.high, "shown_by": self.shown}


@dataclass(frozen=True, eq=False)
class BandOverTime:
    """A band of a signal: its quantiles (n,) at the times of :class:`Bands`."""

    low: Array
    median: Array
    high: Array

    def as_json(self) -> dict[str, object]:
        """By the names of the quantiles."""
        return {"p5": self.low, "p50": self.median, "p95": self.high}


@dataclass(frozen=True, eq=False)
class TrackBand:
    """The track of the median, and how far nine of ten members lie from it across its course.

    Parameters
    ----------
    middle : array (n, 2)
        x and y, m.
    low, high : array (n, 2)
        Points at its left and right: the 5 and 95 % quantiles of the members' distance across its course, to starboard.
    """

    middle: Array
    low: Array
    high: Array

    def as_json(self) -> dict[str, object]:
        """Three lines of points."""
        return {"middle_m": self.middle, "low_m": self.low, "high_m": self.high}


def figure_bands(found: Ensemble) -> dict[str, Band]:
    """The band of every figure, by name."""
    bands = {}
    for name, values in found.figures.items():
        shown = values[np.isfinite(values)]
        if len(shown):
            low, median, high = (float(one) for one in np.quantile(shown, QUANTILES))
            bands[name] = Band(low, median, high, len(shown))
    return bands


def history_bands(
    found: Ensemble, times: Array, signals: tuple[str, ...]
) -> tuple[Array, Mapping[str, BandOverTime], TrackBand | None]:
    """Times (n,) at which enough members still run, the bands of the signals, and that of the track.

    `signals` are the names of the rows of the histories; the track needs ``x_m`` and ``y_m``.
    """
    kept = found.histories
    if kept is None:
        return times[:0], {}, None
    begun = np.isfinite(kept[:, 0, 0])
    running = np.isfinite(kept[:, 0, :]).sum(axis=0)
    count = int(np.sum(running >= STILL_RUNNING * max(int(begun.sum()), 1)))
    kept = kept[begun, :, :count]
    bands = {}
    for row, name in enumerate(signals):
        low, median, high = _quantiles(kept[:, row])
        bands[name] = BandOverTime(low, median, high)
    track = None
    if count > 1 and {"x_m", "y_m"} <= set(signals):
        track = _track(kept[:, signals.index("x_m")], kept[:, signals.index("y_m")], bands)
    return times[:count], bands, track


def _quantiles(values: NDArray[np.float32]) -> Array:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # a time at which no member runs any more has none
        found: Array = np.nanquantile(values.astype(float), QUANTILES, axis=0)
    return found


def _track(x: NDArray[np.float32], y: NDArray[np.float32], bands: Mapping[str, BandOverTime]) -> TrackBand:
    middle = np.column_stack([bands["x_m"].median, bands["y_m"].median])
    along = np.gradient(middle, axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1), 1e-12)[:, None]
    across = np.column_stack([-along[:, 1], along[:, 0]])
    off = (x - middle[:, 0]) * across[:, 0] + (y - middle[:, 1]) * across[:, 1]
    low, _, high = _quantiles(off.astype(np.float32))
    return TrackBand(middle, middle + low[:, None] * across, middle + high[:, None] * across)
