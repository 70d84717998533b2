"""Bands of an ensemble: intervals of nine of ten members, for figures, histories and tracks."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tank2sim.arrays import Array, Number
from tank2sim.simulation.ensemble import Ensemble

QUANTILES = (0.05, 0.50, 0.95)
"""Lower end, middle and upper end of a band."""

STILL_RUNNING = 0.99
"""Share of running members below which a band over time ends: fast members end first, all on the same side of the band,
and each moves its edge. Of the 5 % beyond an edge this is a fifth (project choice)."""


FOLLOWED = 10.0
"""Steps of the leading track within which a member must pass the next normal: it needs about one, longer or shorter by
its distance over the radius of the track; a whole lap, which must not be skipped, has more (project choice)."""

_ROUNDED = 0.001
"""Tolerance, in steps, of a track at a normal: positions have single precision (project choice)."""


@dataclass(frozen=True)
class Band:
    """A band of a figure: 5, 50 and 95 % quantiles and standard deviation over the members that show it (`shown_by`).

    The standard deviation is nan for one member.
    """

    p5: float
    p50: float
    p95: float
    standard_deviation: Number
    shown_by: int


@dataclass(frozen=True, eq=False)
class BandOverTime:
    """A band of a signal: its 5, 50 and 95 % quantiles (n,) at the times of the bands; nan where no member runs."""

    p5: Array
    p50: Array
    p95: Array


@dataclass(frozen=True, eq=False)
class TrackBand:
    """Lines between which nine of ten members' tracks lie, independent of time.

    The leading track belongs to the member nearest to the median of x and y at equal time. At each time of the bands it
    has a normal, which each member's track passes at some distance to starboard; low, middle and high are the quantiles
    of these distances. A member that is ahead or astern on the same track thus has distance zero, and on a second lap
    each member passes on its second lap.

    It ends (nan afterwards) where fewer than :data:`STILL_RUNNING` of the members reach the normal: they lag behind at
    the end of the run, or their distance equals the radius of the track and they would pass it backwards. Until then
    the few missing members keep their last distance.

    Parameters
    ----------
    middle_m, low_m, high_m : array (n, 2)
        x and y, m, of the 50, 5 and 95 % quantiles, at the times of the bands (of the leading track).
    """

    middle_m: Array
    low_m: Array
    high_m: Array

    @property
    def count(self) -> int:
        """Times up to its end."""
        return int(np.isfinite(self.middle_m[:, 0]).sum())


def figure_bands(found: Ensemble) -> dict[str, Band]:
    """The band of every figure, by name."""
    bands = {}
    for name, values in found.figures.items():
        if np.isfinite(values).any():
            bands[name] = band_of(values)
    return bands


def band_of(values: Array) -> Band:
    """The band of the finite ones of values (n,), at least one."""
    shown = values[np.isfinite(values)]
    p5, p50, p95 = (float(value) for value in np.quantile(shown, QUANTILES))
    return Band(p5, p50, p95, float(np.std(shown, ddof=1)) if len(shown) > 1 else math.nan, len(shown))


def history_bands(
    found: Ensemble, times: Array, signals: tuple[str, ...]
) -> tuple[Array, dict[str, BandOverTime], TrackBand | None]:
    """Times (n,) at which enough members still run, the bands of the signals, and the band of the track.

    `signals` are the names of the rows of the histories; the track needs ``x_m`` and ``y_m``.
    """
    kept = found.histories
    if kept is None:
        return times[:0], {}, None
    begun = np.isfinite(kept[:, 0, 0])
    running = np.isfinite(kept[:, 0, :]).sum(axis=0)
    count = int(np.sum(running >= STILL_RUNNING * max(int(begun.sum()), 1)))
    kept = kept[begun]
    bands = {}
    for row, name in enumerate(signals):
        bands[name] = BandOverTime(*_quantiles(kept[:, row, :count]))
    track = None
    if count > 1 and {"x_m", "y_m"} <= set(signals):
        tracks = kept[:, [signals.index("x_m"), signals.index("y_m")]].transpose(0, 2, 1)
        track = track_band(tracks.astype(float), count)
    return times[:count], bands, track


def _quantiles(values: NDArray[np.floating]) -> Array:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # a time without running members has no quantile
        found: Array = np.nanquantile(values.astype(float), QUANTILES, axis=0)
    return found


def track_band(tracks: Array, count: int) -> TrackBand:
    """The band of tracks (members, times, 2), m, at the first `count` times; nan where a member has ended."""
    leading = _leading(tracks[:, :count])
    normals, off = _passed(tracks, leading)
    come = np.isfinite(off).sum(axis=0) >= STILL_RUNNING * len(tracks)
    end = count if come.all() else int(np.argmin(come))
    # The few missing members keep their last distance: without them, most on the same side, an edge would jump.
    known = np.maximum.accumulate(np.where(np.isfinite(off), np.arange(count), 0), axis=1)
    quantiles = _quantiles(np.where(np.arange(count) < end, np.take_along_axis(off, known, axis=1), np.nan))
    low, middle, high = (leading + quantile[:, None] * normals for quantile in quantiles)
    return TrackBand(middle, low, high)


def _leading(tracks: Array) -> Array:
    """The track (n, 2) nearest to the median, of those that run to the end."""
    whole = np.isfinite(tracks[:, :, 0]).all(axis=1)
    ran = tracks[whole] if whole.any() else tracks
    apart = np.nanmean(np.sum((ran - np.nanmedian(tracks, axis=0)) ** 2, axis=2), axis=1)
    found: Array = ran[int(np.argmin(apart))]
    return found


def _passed(tracks: Array, leading: Array) -> tuple[Array, Array]:
    """Unit normals (n, 2) to starboard of the leading track, and distances (members, n) along them; nan where lost."""
    along = np.gradient(leading, axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1), 1e-12)[:, None]
    normals = np.column_stack([-along[:, 1], along[:, 0]])
    steps = np.linalg.norm(np.diff(leading, axis=0, append=2 * leading[-1:] - leading[-2:-1]), axis=1)
    off = np.full((len(tracks), len(leading)), np.nan)
    at, places = np.zeros(len(tracks), dtype=int), tracks[:, 0].copy()
    for k, point in enumerate(leading):
        places, at = _followed(tracks, (places, at), (point, along[k]), steps[max(k - 1, 0)])
        off[:, k] = (places - point) @ normals[k]
    return normals, off


def _followed(
    tracks: Array, last: tuple[Array, NDArray[np.intp]], normal: tuple[Array, Array], step: float
) -> tuple[Array, NDArray[np.intp]]:
    """Positions where each track next passes the normal to a course, and the time index before; nan if lost."""
    places, at = last[0].copy(), last[1].copy()
    point, along = normal
    ahead = (places - point) @ along
    rounded = _ROUNDED * step
    places[ahead > rounded] = np.nan
    going = np.flatnonzero(ahead < -rounded)
    remaining = np.full(len(tracks), FOLLOWED * step)
    while len(going):
        beyond = at[going] + 1 >= tracks.shape[1]
        places[going[beyond]] = np.nan
        going = going[~beyond]
        to = tracks[going, at[going] + 1]
        before, after = (places[going] - point) @ along, (to - point) @ along
        passes = after >= -rounded
        share = np.where(passes, np.minimum(before / np.where(passes, before - after, 1.0), 1.0), 1.0)
        moved = share[:, None] * (to - places[going])
        places[going] += moved
        remaining[going] -= np.linalg.norm(moved, axis=1)
        places[going[remaining[going] < 0]] = np.nan
        at[going[~passes]] += 1
        going = going[~passes & np.isfinite(places[going, 0])]
    return places, at
