"""Noise of each signal from the record itself."""

from __future__ import annotations

import math

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from tank2sim.arrays import Array
from tank2sim.records.trials import MEASURED_COLUMNS, Trial

WINDOW, DEGREE = 7, 3
"""Samples and degree of the Savitzky-Golay filter: a cubic through seven samples follows a ship at any usual rate, and
leaves enough of the noise (0.67 of its variance) to measure it. Project choice."""
_POWERS = np.vander(np.arange(WINDOW) - WINDOW // 2, DEGREE + 1).astype(float)
# From a window's samples to its polynomial's values, (window, window); SciPy also fits the ends: six times as slow
_SMOOTHED: Array = _POWERS @ np.linalg.pinv(_POWERS)
_MAD = 1.4826  # of the median absolute deviation to the standard deviation of normal noise


def record_noise(trial: Trial) -> dict[str, float]:
    """Standard deviation of the white part of the noise of each measured signal, SI; what the file states is used.

    A signal is compared with its Savitzky-Golay smoothing (a cubic through seven samples, Savitzky & Golay 1964). Of
    white noise with standard deviation s the residual has s sqrt(1 - c0), c0 the middle coefficient of the filter, for
    the filter is a projection. The residual's deviation is 1.4826 times its median absolute value, so that spikes and
    steps do not count, but no less than a rounding to the smallest step between values would make it (that step over
    sqrt 12, if values repeat). Noise slower than a few samples (waves, a filter in the sensor) is not seen: the
    figure is a lower bound for coloured noise.
    """
    return {
        name: trial.noise.get(name, white_noise(values))
        for name, values in trial.signals.items()
        if name in MEASURED_COLUMNS
    }


def white_noise(values: Array) -> float:
    """Standard deviation of the white part of the noise of a signal (n,), see :func:`record_noise`."""
    known = values[np.isfinite(values)]
    if known.size < WINDOW:
        return 0.0
    middle = WINDOW // 2
    windows = sliding_window_view(known, WINDOW)
    ends = _SMOOTHED[:middle] @ known[:WINDOW], _SMOOTHED[middle + 1 :] @ known[-WINDOW:]
    residual = known - np.concatenate([ends[0], windows @ _SMOOTHED[middle], ends[1]])
    noise_share = 1.0 - float(_SMOOTHED[middle, middle])
    apart = _MAD * float(np.median(np.abs(residual)))
    return max(apart / math.sqrt(noise_share), resolution(known) / math.sqrt(12.0))


def resolution(values: Array) -> float:
    """Step to which a signal (n,) is rounded: the median of its steps other than zero, if neighbours often repeat.

    One in ten neighbours alike is taken for rounding (or a held value); of values as fine as their noise fewer are.
    """
    steps = np.abs(np.diff(values[np.isfinite(values)]))
    changes = steps[steps > 0]
    if changes.size == 0 or changes.size > 0.9 * steps.size:
        return 0.0
    return float(np.median(changes))


def rounding(values: Array) -> float:
    """Coarsest unit to which a signal (n,) is rounded, 0 if none shows: of numbers printed with three digits it is 1
    from 100 on, and 0.1 below.

    It shows where a signal stays, steps, and stays again; the 95th percentile of such steps, for a jump is none.
    """
    known = values[np.isfinite(values)]
    steps = np.abs(np.diff(known))
    small = 1e-9 * float(np.max(np.abs(known), initial=0.0))
    alone = steps[1:-1][(steps[1:-1] > small) & (steps[:-2] <= small) & (steps[2:] <= small)]
    return float(np.percentile(alone, 95)) if alone.size else 0.0
