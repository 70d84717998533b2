"""Auto- and cross-correlation, the correlation time, and how many independent samples a record is worth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import signal

from tank2sim.arrays import Array
from tank2sim.records.signals.sampling import Series, at_common_times

_NORMAL = 1.959964
"""Two-sided 95 % point of the normal distribution."""


@dataclass(frozen=True, eq=False)
class Correlation:
    """Correlation coefficient of two signals, or of one with itself, against the lag.

    Parameters
    ----------
    lag_s : array (m,)
        Rising, from minus to plus a quarter of the record; positive: the second signal comes after the first.
    coefficient : array (m,)
        Between -1 and 1.
    bound_if_independent : float
        95 % of the coefficients of two independent signals with these autocorrelations are smaller, by Bartlett's
        formula: 1.96 sqrt(sum over the lags of rho_1 rho_2 / n) (Box & Jenkins 1976, section 11.1.3).
    lag_of_largest_s, largest : float
        Lag and coefficient where the coefficient is largest in size.
    """

    lag_s: Array
    coefficient: Array
    bound_if_independent: float
    lag_of_largest_s: float
    largest: float


@dataclass(frozen=True, eq=False)
class Autocorrelation:
    """Correlation of a signal with itself later.

    Parameters
    ----------
    lag_s, coefficient : array (m,)
        From lag 0, where it is 1, to a quarter of the record.
    correlation_time_s : float
        Integral of the coefficient from 0 to its first zero: the time constant of a first-order process.
    effective_count : float
        Independent samples that the record is worth, its length over twice the correlation time (Bayley & Hammersley
        1946); at most its number of samples.
    """

    lag_s: Array
    coefficient: Array
    correlation_time_s: float
    effective_count: float


def autocorrelation(series: Series) -> Autocorrelation:
    """Autocorrelation of a signal about its mean; the signal must not be constant."""
    coefficient = _coefficients(series.values, series.values)[len(series.values) - 1 :]
    kept = len(series.values) // 4 + 1
    before_zero = int(np.argmax(coefficient <= 0.0))  # it sums to -1/2 over all lags, so there is a first zero
    # The trapezoidal rule: half the value at lag 0, and so half a step for white noise, of which all samples count.
    time = series.step_s * (float(np.sum(coefficient[:before_zero])) - 0.5)
    count = min(float(len(series.values)), series.duration_s / (2.0 * time))
    return Autocorrelation(series.step_s * np.arange(kept, dtype=np.float64), coefficient[:kept], time, count)


def cross_correlation(first: Series, second: Series) -> Correlation:
    """Correlation of the second signal with the first, each about its mean; neither may be constant."""
    first, second = at_common_times(first, second)
    count = len(first.values)
    # scipy's lag is positive where its first argument comes later.
    coefficient = _coefficients(second.values, first.values)
    lags = signal.correlation_lags(count, count)
    kept = np.abs(lags) <= count // 4
    auto = [_coefficients(sequence.values, sequence.values)[kept] for sequence in (first, second)]
    bound = _NORMAL * float(np.sqrt(max(float(np.sum(auto[0] * auto[1])), 1.0) / count))
    lag, coefficient = first.step_s * lags[kept], coefficient[kept]
    place = int(np.argmax(np.abs(coefficient)))
    return Correlation(lag, coefficient, bound, float(lag[place]), float(coefficient[place]))


def _coefficients(sequence: Array, second: Array) -> Array:
    """At all lags from -(n - 1) to n - 1; divided by n and not by the number of pairs, whose scatter is greater."""
    sequence, second = sequence - sequence.mean(), second - second.mean()
    product: Array = signal.correlate(sequence, second, method="fft")
    return product / (len(sequence) * float(sequence.std()) * float(second.std()))
