"""A signal as evenly sampled values: what every test, spectrum and filter here rests on."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from tank2sim.arrays import Array
from tank2sim.errors import InputError
from tank2sim.notices import Notice
from tank2sim.records.signals.columns import DIRECTION_COLUMNS, HELD_COLUMNS, SignalName
from tank2sim.records.trials import Trial

FEWEST_SAMPLES = 50
"""Samples below which nothing is analysed; project choice: eight spectral segments of eleven samples."""

GAP_STEPS = 5
"""Longest gap that is bridged unasked, in sampling steps; project choice. A straight line over five steps loses what
has a period below about ten steps, which is already near the end of the spectrum."""

_JITTER = 0.05
"""Part of a step by which times may miss an even grid and be taken as even: at half the Nyquist frequency it is an
error of phase of 4.5 deg, and of times written with two digits at 10 Hz it is the rounding. Project choice."""


@dataclass(frozen=True, eq=False)
class Series:
    """Evenly sampled values of one signal, without gaps.

    Parameters
    ----------
    source : Path
        File of the trial.
    name : str
        Name of the signal in SI, as in ``Trial.signals``.
    start_s, step_s : float
        Time of the first sample, and from one to the next.
    values : array (n,)
        In SI.
    notices : tuple of Notice
        What was done to get here.
    """

    source: Path
    name: str
    start_s: float
    step_s: float
    values: Array
    notices: tuple[Notice, ...] = ()

    @property
    def time_s(self) -> Array:
        """Times of the samples, (n,)."""
        return self.start_s + self.step_s * np.arange(len(self.values), dtype=np.float64)

    @property
    def duration_s(self) -> float:
        """Number of samples times the step."""
        return len(self.values) * self.step_s

    @property
    def rate_hz(self) -> float:
        """Samples a second."""
        return 1.0 / self.step_s

    @property
    def constant(self) -> bool:
        """True if it does not vary by more than numbers are exact to."""
        return bool(np.ptp(self.values) <= 1e-9 * max(float(np.max(np.abs(self.values))), 1e-12))

    def with_values(self, values: Array) -> Series:
        """The same signal with other values at the same times."""
        return replace(self, values=values)


def even_series(trial: Trial, name: str, max_gap_s: float | None = None) -> Series:
    """One signal of a trial at an even step, that which its own times usually have.

    Short gaps and uneven times are bridged by straight lines (orders are held), and it says so; what is missing at
    the two ends is cut off; a direction is made continuous.

    `trial`: Any trial. `name`: Key of ``trial.signals``. `max_gap_s`, optional: Longest gap to bridge; by default five
    steps.

    Raises InputError: There are fewer than 50 values, or a gap is longer.
    """
    column = f"column {SignalName(name).file}"
    values = np.asarray(trial.signals[name], dtype=float)
    known = np.flatnonzero(np.isfinite(values))
    if known.size < FEWEST_SAMPLES:
        problem = f"has {known.size} values, and at least {FEWEST_SAMPLES} are needed"
        raise trial.fault(column, problem, "give a longer record or leave the column out")
    time, values = trial.time_s[known], values[known]
    notices = []
    if known[-1] - known[0] < len(trial.time_s) - 1:
        notices.append(f"is known from {time[0]:.6g} to {time[-1]:.6g} s only")
    if name in DIRECTION_COLUMNS:
        continuous: Array = np.unwrap(values)
        if not np.array_equal(continuous, values):
            notices.append("was made continuous through north")
            values = continuous
    step = _usual_step(time)
    # Half a step more, so that a gap of five steps in times that are rounded is five steps.
    longest = _longest_gap(trial, column, time, (GAP_STEPS + 0.5) * step if max_gap_s is None else max_gap_s)
    held = name in HELD_COLUMNS
    count = round(float(time[-1] - time[0]) / step) + 1
    step = float(time[-1] - time[0]) / (count - 1)
    grid = time[0] + step * np.arange(count, dtype=np.float64)
    if count != time.size or np.max(np.abs(time - grid)) > _JITTER * step:
        values = at_grid(time, values, grid, held=held)
        way = "held" if held else "interpolated by straight lines"
        notices.append(f"is unevenly sampled or has gaps of up to {longest:.4g} s; it was {way} at {step:.4g} s")
    messages = tuple(Notice(f"{column.removeprefix('column ')} {notice}") for notice in notices)
    return Series(trial.path, name, float(time[0]), step, values, messages)


def _longest_gap(trial: Trial, column: str, time: Array, limit: float) -> float:
    """The longest time between two values, s; refused if it is longer than `limit`."""
    gap = int(np.argmax(np.diff(time)))
    longest = float(time[gap + 1] - time[gap])
    if longest > limit:
        problem = f"has no value from {time[gap]:.6g} to {time[gap + 1]:.6g} s, longer than {limit:.3g} s"
        raise trial.fault(column, problem, "cut the record there, or allow it by max_gap_s")
    return longest


def _usual_step(time: Array) -> float:
    """The mean of the usual steps: their median is as coarse as the digits with which times are written."""
    steps = np.diff(time)
    usual = float(np.median(steps))
    return float(np.mean(steps[np.abs(steps - usual) < usual / 2]))


def at_common_times(first: Series, second: Series) -> tuple[Series, Series]:
    """Two signals of one trial at the same times: where both are known, at the shorter of their steps.

    Raises InputError: They have fewer than 50 samples in common.
    """
    start = max(first.start_s, second.start_s)
    end = min(float(first.time_s[-1]), float(second.time_s[-1]))
    step = min(first.step_s, second.step_s)
    count = int(np.floor((end - start) / step + 1e-6)) + 1
    names = " and ".join(SignalName(item.name).file for item in (first, second))
    if count < FEWEST_SAMPLES:
        problem = f"have {max(count, 0)} samples at the same times, and at least {FEWEST_SAMPLES} are needed"
        raise InputError(first.source, f"columns {names}", problem, "give a longer record")
    grid = start + step * np.arange(count, dtype=np.float64)
    return _moved(first, grid, step), _moved(second, grid, step)


def _moved(series: Series, grid: Array, step: float) -> Series:
    times = series.time_s
    if len(times) == len(grid) and np.max(np.abs(times - grid)) <= _JITTER * step:
        return series
    values = at_grid(times, series.values, grid, held=series.name in HELD_COLUMNS)
    return replace(series, start_s=float(grid[0]), step_s=step, values=values)


def at_grid(time: Array, values: Array, grid: Array, *, held: bool) -> Array:
    """Values (m,) at an even `grid` (m,), s, of `values` (n,) at `time` (n,); `held`, or by straight lines."""
    if not held:
        return np.interp(grid, time, values)
    places = np.searchsorted(time, grid + 1e-6 * (grid[1] - grid[0]), side="right") - 1
    return np.asarray(values[np.clip(places, 0, None)])
