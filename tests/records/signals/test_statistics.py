import sys

import numpy as np
import pytest

from tank2sim.errors import InputError
from tank2sim.records.signals.statistics import (
    Stationary,
    autocorrelation,
    mean_and_deviation,
    normality,
    probability_density,
    stationarity,
)
from tests.records.signals.made import first_order, series, white


def verdicts(make, seeds=14):
    return [stationarity(one, autocorrelation(one)).verdict for one in (series(make(seed)) for seed in range(seeds))]


@pytest.mark.parametrize("steps", [2.0, 50.0])
def test_a_first_order_process_is_stationary_whatever_its_correlation_time(steps):
    found = verdicts(lambda seed: first_order(seed, steps))
    assert found.count(Stationary.YES) >= 10
    assert Stationary.NO not in found


def test_a_random_walk_is_not_stationary():
    found = verdicts(lambda seed: np.cumsum(white(seed)))
    assert found.count(Stationary.NO) >= 8
    assert found.count(Stationary.YES) <= 2


def test_noise_on_a_straight_line_is_stationary_about_a_trend():
    found = verdicts(lambda seed: first_order(seed, 10.0) + np.linspace(0.0, 8.0, 4000))
    assert found.count(Stationary.TREND) >= 12


def test_a_step_in_the_level_is_no_stationary_signal():
    found = verdicts(lambda seed: white(seed) + np.where(np.arange(4000) < 2000, 0.0, 1.0))
    assert Stationary.YES not in found


def test_the_four_outcomes_are_distinguished_by_the_two_tests():
    found = stationarity(series(white(1)), autocorrelation(series(white(1))))
    assert found.about_level.dickey_fuller < 0.01
    assert found.about_level.kpss > 0.05
    walk = series(np.cumsum(white(1)))
    found = stationarity(walk, autocorrelation(walk))
    assert found.about_level.dickey_fuller > 0.05
    assert found.about_level.kpss < 0.05


def test_halves_tell_mean_and_variance():
    values = np.concatenate([white(1, 2000), 5.0 + white(2, 2000, spread=3.0)])
    found = stationarity(series(values), autocorrelation(series(values)))
    assert found.mean_of_halves == pytest.approx((0.0, 5.0), abs=0.2)
    assert found.variance_of_halves == pytest.approx((1.0, 9.0), rel=0.1)


@pytest.mark.parametrize("steps", [0.01, 10.0])
def test_correlated_normal_samples_are_not_called_abnormal(steps):
    normal = [normality(one, autocorrelation(one)).normal for one in (series(first_order(s, steps)) for s in range(40))]
    assert normal.count(False) <= 5


def test_all_samples_together_would_be_too_eager():
    from scipy import stats

    rejected = [stats.normaltest(first_order(seed, 10.0)).pvalue < 0.05 for seed in range(40)]
    assert sum(rejected) > 10


@pytest.mark.parametrize(
    ("make", "reported"),
    [(np.exp, "skewed to high"), (lambda x: -np.exp(x), "skewed to low"), (lambda x: x**3, "heavy tails"),
     (np.sign, "flat")],
)  # fmt: skip
def test_what_is_not_normal_is_said_to_be_so_and_how(make, reported):
    one = series(make(first_order(4, 3.0)))
    found = normality(one, autocorrelation(one))
    assert found.normal is False
    assert reported in found.verdict


def test_too_few_independent_samples_are_not_judged():
    one = series(first_order(1, 300.0))
    found = normality(one, autocorrelation(one))
    assert found.normal is None
    assert found.independent_samples < 20


def test_the_density_of_normal_noise_is_the_normal_one():
    found = probability_density(series(3.0 + 2.0 * white(1, 20000)))
    assert np.trapezoid(found.density, found.values) == pytest.approx(1.0, abs=1e-3)
    exact = np.exp(-0.5 * ((found.values - 3.0) / 2.0) ** 2) / (2.0 * np.sqrt(2.0 * np.pi))
    assert np.max(np.abs(found.normal - exact)) < 0.01
    assert np.max(np.abs(found.density - exact)) < 0.012


def test_directions_have_mean_and_deviation_on_the_circle():
    # Made continuous, a direction about north may be turns away; a normal one wrapped keeps its deviation (Mardia).
    values = np.unwrap(np.radians(-20.0) + 0.4 * white(3)) + 4 * np.pi
    mean, deviation = mean_and_deviation("wind_direction_rad", values)
    assert np.degrees(mean) == pytest.approx(340.0, abs=1.5) and deviation == pytest.approx(0.4, rel=0.05)
    assert mean_and_deviation("delta_rad", values) == pytest.approx((values.mean(), values.std()))
    found = stationarity(series(values, name="psi_rad"), autocorrelation(series(values)))
    assert np.degrees(found.mean_of_halves) == pytest.approx((340.0, 340.0), abs=2.0)
    assert found.variance_of_halves == pytest.approx((0.16, 0.16), rel=0.1)
    assert mean_and_deviation("psi_rad", np.full(60, 2 * np.pi))[0] == pytest.approx(0.0, abs=1e-9)


def test_without_the_extra_the_tests_are_refused_by_its_name(monkeypatch):
    monkeypatch.setitem(sys.modules, "statsmodels.tsa.stattools", None)
    one = series(first_order(1, 5.0))
    with pytest.raises(InputError) as refused:
        stationarity(one, autocorrelation(one))
    assert "tank2sim[signals]" in refused.value.remedy
