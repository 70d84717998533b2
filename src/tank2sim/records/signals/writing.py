"""A trial with a filtered column as a trial file."""

from __future__ import annotations

import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from tank2sim.arrays import Array
from tank2sim.notices import Notice
from tank2sim.records.signals.columns import DIRECTION_COLUMNS, HELD_COLUMNS, SignalName, file_columns
from tank2sim.records.signals.sampling import at_grid, even_series
from tank2sim.records.trials import Trial, with_signals

if TYPE_CHECKING:
    from tank2sim.records.signals.filtering import Filtered


def with_filtered(trial: Trial, filtered: Filtered, notice: str) -> Trial:
    """The trial with one signal filtered, at its own times; nan where the filtered signal does not reach.

    `notice` is added to the trial's notices.
    The noise stated of that signal is left out: it does not hold any more.
    """
    series = filtered.series
    name = series.name
    known = series.time_s
    values = np.interp(trial.time_s, known, series.values)
    # Rows may miss the even grid by a rounding at its two ends.
    outside = (trial.time_s < known[0] - series.step_s / 2) | (trial.time_s > known[-1] + series.step_s / 2)
    values[outside] = np.nan
    noise = {key: value for key, value in trial.noise.items() if key != name}
    return replace(with_signals(trial, {name: _on_circle(name, values)}, notice), noise=noise)


def thinned(trial: Trial, filtered: Sequence[Filtered], notice: str) -> Trial:
    """The trial at the fewer times of thinned signals, all of them; orders have their values at these times.

    `notice` is added to the trial's notices.

    Raises InputError: The signals do not have the same times.
    """
    time = filtered[0].series.time_s
    signals: dict[str, Array] = {}
    for result in filtered:
        series = result.series
        if len(series.values) != len(time) or abs(series.start_s - time[0]) > series.step_s / 10:
            names = " and ".join(SignalName(other.series.name).file for other in (filtered[0], result))
            remedy = "cut the record to where all columns are known"
            raise trial.fault(f"columns {names}", "are not known over the same times", remedy)
        signals[series.name] = _on_circle(series.name, series.values)
    for name in trial.signals:
        if name in HELD_COLUMNS:
            order = even_series(trial, name)
            signals[name] = at_grid(order.time_s, order.values, time, held=True)
    return replace(trial, time_s=time, signals=signals, noise={}, notices=(*trial.notices, Notice(notice)))


def trial_text(trial: Trial, remarks: Sequence[str], more: Mapping[str, Array] = MappingProxyType({})) -> str:
    """Text of a trial CSV, rudder positive to starboard, with `remarks` as first comment lines and `more` columns."""
    text = io.StringIO()
    for remark in remarks:
        text.write(f"# {' '.join(remark.split())}\n")
    if trial.scale is not None:
        text.write(f"# scale: {trial.scale:.10g}\n")
    if stated := [f"{SignalName(name).file} {SignalName(name).factor * trial.noise[name]:.6g}" for name in trial.noise]:
        text.write(f"# noise: {', '.join(stated)}\n")
    columns = file_columns(trial) | dict(more)
    text.write(",".join(columns) + "\n")
    for time, *values in zip(*(column.tolist() for column in columns.values()), strict=True):
        cells = (f"{value + 0.0:.10g}" if math.isfinite(value) else "" for value in values)
        text.write(",".join([f"{time:.10g}", *cells]) + "\n")
    return text.getvalue()


def _on_circle(name: str, values: Array) -> Array:
    return np.mod(values, 2.0 * np.pi) if name in DIRECTION_COLUMNS - {"psi_rad"} else values
