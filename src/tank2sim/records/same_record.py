"""Whether two trials are one record: renamed, commented, printed with other digits, cut, or with fewer columns."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from tank2sim.arrays import Array
from tank2sim.errors import InputError
from tank2sim.records.audit.noise import rounding, white_noise
from tank2sim.records.trials import MEASURED_COLUMNS, Trial, sampling_step

PRINTED = 1e-3
"""Share of a signal's spread by which printing it with other digits may change it; two runs of one manoeuvre differ by
some per cent (HSVA's zigzags by 2 to 12 % in yaw rate). Project choice."""

NOISE = 0.5
"""Two runs differ by sqrt(2) times the noise of their sensors at least, one record from itself by nothing: half the
noise lies between."""

_ROUNDED = 1.2
"""Times what rounding to the coarser of two units leaves that is put down to it (project choice)."""

_FAR = 0.3
"""Signals farther apart than this share of their spread are not looked at any closer (project choice)."""

COMMON = 0.5
"""Share of the shorter record that must lie at the same times to be compared (project choice)."""

LEAST_ROWS = 4
"""Rows at the same times below which records are not compared. Project choice: three numbers may agree by chance."""

SIGNED = ("psi_rad", "x_m", "r_radps", "y_m", "u_mps", "sog_mps", "v_mps", "u_ground_mps", "v_ground_mps", "phi_rad")
"""Signals of a signature, the first of them first. Project choice: heading and position are in most copies."""

MOST_SIGNED, LEAST_SIGNED_ROWS = 3, 16
"""Signals of a signature, and rows; below twice as many. Project choice: a few lines on a card, and half of the rows
are still enough to compare."""

STRIDES = (60, 12, 1)
"""The rows of a signature are a multiple of one of these apart, where the record is long enough. Project choice: a copy
with every second, third, ... row still has them all."""


def refuse_copies(trials: Sequence[Trial], others: Sequence[Trial] | None = None) -> None:
    """Refuse trials that are one record: among themselves, or fitted and held out if others are given.

    Raises
    ------
    InputError
        Names the second file, and which one it is again.
    """
    if others is None:
        for number, trial in enumerate(trials):
            for before in trials[:number]:
                if same_record(trial, before):
                    problem = f"is the record of {before.path.name} again"
                    raise InputError(trial.path, "", problem, "give each record once: a copy is not a second run")
        return
    for held in others:
        for trial in trials:
            if same_record(held, trial):
                problem = f"is both fitted and held out: it is the record of {trial.path.name}"
                raise InputError(held.path, "", problem, "hold out what is not fitted")


def same_record(first: Trial, second: Trial) -> bool:
    """True if all signals that both measured are the same at the same times, except for their printed digits.

    Times count from the first row of each, or as they are, whichever fits. Both are at the size of one ship. A signal
    that does not move says nothing.
    """
    if sampling_step(first) < sampling_step(second):  # at the rows of the coarser one, between which nothing is drawn
        first, second = second, first
    names = [name for name in MEASURED_COLUMNS if name in first.signals and name in second.signals]
    shifts = dict.fromkeys((0.0, float(first.time_s[0] - second.time_s[0])))
    return bool(names) and any(_same_at(first, second, names, shift) for shift in shifts)


def signature(trial: Trial) -> tuple[list[float], dict[str, list[float]]]:
    """Some rows of a trial by which :func:`same_record` knows it: times (s), and up to three signals, SI.

    Of the rows in which all of these are known, evenly spread; times to a thousandth of the step between rows, values
    to 1e-5 of their range. Empty if no signal moves.
    """
    known = {
        name: np.isfinite(values)
        for name in SIGNED
        if (values := trial.signals.get(name)) is not None and np.nanmax(values) > np.nanmin(values)
    }
    names = list(known)[:MOST_SIGNED]
    rows = np.flatnonzero(np.all([known[name] for name in names], axis=0)) if names else np.array([], dtype=int)
    if names and len(rows) < LEAST_SIGNED_ROWS:  # signals that are never known at once
        names = names[:1]
        rows = np.flatnonzero(known[names[0]])
    unit = next((unit for unit in STRIDES if len(rows) >= unit * LEAST_SIGNED_ROWS), 1)
    rows = rows[:: unit * max(1, len(rows) // (unit * LEAST_SIGNED_ROWS))]
    time = _rounded(trial.time_s[rows], 1e-3 * sampling_step(trial))
    signals = {name: trial.signals[name] for name in names}
    return time, {
        name: _rounded(signal[rows], 1e-5 * float(np.nanmax(signal) - np.nanmin(signal)))
        for name, signal in signals.items()
    }


def _rounded(values: Array, unit: float) -> list[float]:
    places = math.ceil(-math.log10(unit))
    return [round(float(value), places) for value in values]


def _same_at(first: Trial, second: Trial, names: Sequence[str], shift: float) -> bool:
    time = second.time_s + shift
    inside = (first.time_s >= time[0]) & (first.time_s <= time[-1])
    spans = [float(times[-1] - times[0]) for times in (first.time_s, time)]
    common = first.time_s[inside]
    if len(common) < LEAST_ROWS or common[-1] - common[0] < COMMON * min(spans):
        return False
    alike = False
    for name in names:
        signals = first.signals[name], second.signals[name]
        noise = min(white_noise(values) for values in signals), max(rounding(values) for values in signals)
        verdict = _alike(signals[0][inside], _at(common, time, signals[1]), *noise)
        if verdict is False:
            return False
        alike = alike or verdict is True
    return alike


def _at(common: Array, time: Array, values: Array) -> Array:
    known = ~np.isnan(values)
    if np.count_nonzero(known) < 2:
        return np.full(len(common), np.nan)
    return np.interp(common, time[known], values[known])


def _alike(first: Array, second: Array, noise: float, unit: float) -> bool | None:
    """None where neither moves; `noise` is the smaller one of the two, `unit` the coarser one of their digits."""
    known = ~np.isnan(first + second)
    if np.count_nonzero(known) < 2:
        return None
    first, second = first[known], second[known]
    spread = float(np.std(first))
    if not spread > 0:
        return None
    apart = float(np.sqrt(np.mean((first - second) ** 2)))
    if apart > _FAR * spread:
        return False
    return apart <= max(PRINTED * spread, NOISE * noise, _ROUNDED * unit / math.sqrt(12))
