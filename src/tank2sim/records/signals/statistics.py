"""Is a signal stationary, is it normal, how are its values distributed, and how many of them are independent."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any

import numpy as np
from scipy import signal, stats

from tank2sim.arrays import Array, Number
from tank2sim.errors import optional_library
from tank2sim.records.signals.columns import DIRECTION_COLUMNS
from tank2sim.records.signals.sampling import Series, at_common_times

SIGNIFICANCE = 0.05
"""Probability below which a null hypothesis is rejected, as is usual."""

FEWEST_INDEPENDENT = 20
"""Fewest independent samples for a test of normality: with fewer, the test of kurtosis is not valid (scipy.stats)."""

_BLOCKS = (200, 1000)
_DENSITY_POINTS = 201


class Stationary(StrEnum):
    """The two tests combined: their null hypotheses are opposite, so there are four outcomes.

    The fourth is parted in two by the same tests about a straight line.
    """

    YES = "stationary"
    TREND = "about a trend"
    NO = "not stationary"
    CONTRADICTORY = "contradictory"
    UNDECIDED = "undecided"


_MEANINGS = {
    Stationary.YES: "it returns to its level (Dickey-Fuller), and nothing speaks against a steady level (KPSS)",
    Stationary.TREND: 'it returns to a straight line in time, and nothing speaks against that; filter="detrend:1"',
    Stationary.NO: "its level wanders as in a random walk (both tests); mean and spectrum mean little, detrend it",
    Stationary.CONTRADICTORY: "neither a steady level nor a random walk: a step, a bend or a change of spread",
    Stationary.UNDECIDED: "the record is too short to distinguish a steady level from a random walk",
}


@dataclass(frozen=True)
class UnitRootTests:
    """p-values of the two tests about a constant level, or about a linear trend.

    - `dickey_fuller`: Augmented Dickey-Fuller; null hypothesis: a random walk. Small: it returns to its level.
    - `kpss`: Kwiatkowski, Phillips, Schmidt & Shin; null hypothesis: stationary. Small: it does not. Their table ends
      at 0.01 and 0.1, which bound what is beyond.
    """

    dickey_fuller: Number
    kpss: Number


@dataclass(frozen=True)
class Stationarity:
    """Whether a signal keeps its level and its spread.

    - `verdict`: In words, at 5 %.
    - `meaning`: The verdict in full.
    - `about_level`, `about_trend`: About a constant level, and about a linear trend.
    - `samples_averaged`: Samples averaged to one value of the tests, so that their few lags reach over the correlation
      time.
    - `mean_of_halves`, `variance_of_halves`: Both halves, in the signal's unit and its square, as by
      :func:`mean_and_deviation`.
    """

    verdict: Stationary
    meaning: str
    about_level: UnitRootTests
    about_trend: UnitRootTests
    samples_averaged: int
    mean_of_halves: tuple[Number, Number]
    variance_of_halves: tuple[Number, Number]

    def in_unit(self, factor: float) -> Stationarity:
        """The stationarity of the signal times a factor."""
        (first, second), (before, after) = self.mean_of_halves, self.variance_of_halves
        square = factor**2
        return replace(
            self,
            mean_of_halves=(factor * first, factor * second),
            variance_of_halves=(square * before, square * after),
        )


@dataclass(frozen=True)
class Normality:
    """Whether values are normally distributed, tested on samples far enough apart to be independent.

    - `verdict`: In a few words, with the samples tested; the smallest p-value times the number of tests is held against
      5 % (Bonferroni).
    - `normal`: False: rejected; None: too few samples to test.
    - `p_values`: By test: ``dagostino_pearson jarque_bera shapiro_wilk anderson_darling``.
    - `independent_samples`: Samples tested, one every two correlation times. All samples together would make the tests
      reject what is normal: they take each for new evidence.
    - `skewness`, `excess_kurtosis`: Skewness and excess kurtosis of all samples; both 0 for a normal distribution.
    """

    verdict: str
    normal: bool | None
    p_values: dict[str, Number]
    independent_samples: int
    skewness: Number
    excess_kurtosis: Number


@dataclass(frozen=True, eq=False)
class Density:
    """Probability density next to a normal distribution of the same mean and standard deviation.

    - `values` (m,): In the signal's unit.
    - `density`, `normal` (m,): In one over that unit.
    """

    values: Array
    density: Array
    normal: Array

    def in_unit(self, factor: float) -> Density:
        """The density of the signal times a factor."""
        return Density(factor * self.values, self.density / factor, self.normal / factor)


def mean_and_deviation(name: str, values: Array) -> tuple[float, float]:
    """Mean and standard deviation of a signal (n,), SI; of a direction those on the circle.

    The mean direction is the direction of the sum of unit vectors, 0 to 2 pi, and with R the length of their mean its
    deviation is sqrt(-2 ln R) (Mardia and Jupp 2000, Directional Statistics, 2.3): 350 and 10 deg have the mean 0.
    """
    if name not in DIRECTION_COLUMNS:
        return float(np.mean(values)), float(np.std(values))
    mean = float(stats.circmean(values)) % (2.0 * np.pi)  # by rounding it may be 2 pi itself
    return mean, float(stats.circstd(values))


def stationarity(series: Series, correlation: Autocorrelation) -> Stationarity:
    """Augmented Dickey-Fuller and KPSS tests (statsmodels), and the two halves side by side.

    The tests look back over a number of lags that grows with the number of samples only. So the signal is averaged
    over blocks of half a correlation time, but not to fewer than 200 nor more than 1000 values; project choice.
    """
    values = series.values
    fewest, most = _BLOCKS
    wanted = round(correlation.correlation_time_s / series.step_s / 2)
    block = max(1, min(wanted, len(values) // fewest), -(-len(values) // most))
    whole = len(values) // block * block
    means = values[:whole].reshape(-1, block).mean(axis=1)
    level, trend = _unit_root_tests(means, "c"), _unit_root_tests(means, "ct")
    halves = [mean_and_deviation(series.name, half) for half in np.array_split(values, 2)]
    verdict = _verdict(level, trend)
    return Stationarity(
        verdict=verdict,
        meaning=_MEANINGS[verdict],
        about_level=level,
        about_trend=trend,
        samples_averaged=block,
        mean_of_halves=(halves[0][0], halves[1][0]),
        variance_of_halves=(halves[0][1] ** 2, halves[1][1] ** 2),
    )


def normality(series: Series, correlation: Autocorrelation) -> Normality:
    """Tests of D'Agostino-Pearson, Jarque-Bera, Shapiro-Wilk and Anderson-Darling on independent samples."""
    normal_ad = _of_statsmodels("stats.diagnostic", "normal_ad")
    values = series.values
    apart = max(1, round(len(values) / correlation.effective_count))
    thinned = values[::apart]
    skewness, kurtosis = float(stats.skew(values)), float(stats.kurtosis(values))
    if len(thinned) < FEWEST_INDEPENDENT or np.ptp(thinned) == 0.0:
        text = f"too few samples ({len(thinned)})"
        return Normality(text, None, {}, len(thinned), skewness, kurtosis)
    p_values = {
        "dagostino_pearson": float(stats.normaltest(thinned).pvalue),
        "jarque_bera": float(stats.jarque_bera(thinned).pvalue),
        "shapiro_wilk": float(stats.shapiro(thinned[:5000]).pvalue),  # its p-value holds up to 5000 samples
        "anderson_darling": float(normal_ad(thinned)[1]),
    }
    normal = min(p_values.values()) * len(p_values) >= SIGNIFICANCE
    text = f"may be ({len(thinned)})" if normal else f"no, {_shape(skewness, kurtosis)} ({len(thinned)})"
    return Normality(text, normal, p_values, len(thinned), skewness, kurtosis)


def probability_density(series: Series) -> Density:
    """Kernel estimate of the density, its width by Scott's rule from all samples.

    That they are correlated hardly changes the best width (Hall, Lahiri & Truong 1995), but a bump of a record that is
    worth few independent samples may be chance.
    """
    values = series.values
    mean, spread = float(values.mean()), float(values.std())
    reach = 3.0 * spread * len(values) ** (-0.2)
    across = np.linspace(values.min() - reach, values.max() + reach, _DENSITY_POINTS)
    return Density(across, stats.gaussian_kde(values)(across), stats.norm.pdf(across, mean, spread))


def _of_statsmodels(module: str, name: str) -> Callable[..., Any]:
    """A test of the extra ``tank2sim[signals]``, loaded where it is used: it takes more than a second."""
    return getattr(optional_library(f"statsmodels.{module}", "signals", "signals"), name)  # type: ignore[no-any-return]


def _unit_root_tests(values: Array, about: str) -> UnitRootTests:
    adfuller, kpss = _of_statsmodels("tsa.stattools", "adfuller"), _of_statsmodels("tsa.stattools", "kpss")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # p-values beyond the table of KPSS, as Stationarity states
        return UnitRootTests(float(adfuller(values, regression=about)[1]), float(kpss(values, regression=about)[1]))


def _verdict(level: UnitRootTests, trend: UnitRootTests) -> Stationary:
    returns, wanders = level.dickey_fuller < SIGNIFICANCE, level.kpss < SIGNIFICANCE
    if returns and not wanders:
        return Stationary.YES
    if trend.dickey_fuller < SIGNIFICANCE <= trend.kpss:
        return Stationary.TREND
    if returns:
        return Stationary.CONTRADICTORY
    return Stationary.NO if wanders else Stationary.UNDECIDED


def _shape(skewness: float, kurtosis: float) -> str:
    """The strongest deviation from a normal distribution."""
    # Of skewed distributions such as gamma and lognormal the kurtosis is 1.5 to 2 times the square of the skewness.
    if 3.0 * skewness**2 > abs(kurtosis):
        return "skewed to high" if skewness > 0 else "skewed to low"
    return "heavy tails" if kurtosis > 0 else "flat"


_NORMAL = 1.959964  # Two-sided 95 % point of the normal distribution


@dataclass(frozen=True, eq=False)
class Correlation:
    """Correlation coefficient of two signals, or of one with itself, against the lag.

    - `lag_s` (m,): Rising, from minus to plus a quarter of the record; positive: the second signal comes after the
      first.
    - `coefficient` (m,): Between -1 and 1.
    - `bound_if_independent`: 95 % of the coefficients of two independent signals with these autocorrelations are
      smaller, by Bartlett's formula: 1.96 sqrt(sum over the lags of rho_1 rho_2 / n) (Box & Jenkins 1976, section
      11.1.3).
    - `lag_of_largest_s`, `largest`: Lag and coefficient where the coefficient is largest in size.
    """

    lag_s: Array
    coefficient: Array
    bound_if_independent: float
    lag_of_largest_s: float
    largest: float


@dataclass(frozen=True, eq=False)
class Autocorrelation:
    """Correlation of a signal with itself later.

    - `lag_s`, `coefficient` (m,): From lag 0, where it is 1, to a quarter of the record.
    - `correlation_time_s`: Integral of the coefficient from 0 to its first zero: the time constant of a first-order
      process.
    - `effective_count`: Independent samples that the record is worth, its length over twice the correlation time
      (Bayley & Hammersley 1946); at most its number of samples.
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
    # The trapezoidal rule: half the value at lag 0, and so half a step for white noise: all its samples count.
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
