import numpy as np
import pytest

from tank2sim.records.signals.statistics import autocorrelation, cross_correlation
from tests.records.signals.made import first_order, series, white


@pytest.mark.parametrize("steps", [5.0, 20.0])
def test_correlation_time_of_a_first_order_process_is_its_time_constant(steps):
    found = [autocorrelation(series(first_order(seed, steps), 0.1)) for seed in range(12)]
    assert np.mean([one.correlation_time_s for one in found]) == pytest.approx(0.1 * steps, rel=0.1)
    assert np.mean([one.effective_count for one in found]) == pytest.approx(4000 / (2 * steps), rel=0.12)
    lag = round(steps)
    assert np.mean([one.coefficient[lag] for one in found]) == pytest.approx(np.exp(-1.0), abs=0.05)


def test_white_noise_counts_each_sample():
    found = [autocorrelation(series(white(seed))) for seed in range(10)]
    assert np.mean([one.effective_count for one in found]) == pytest.approx(4000, rel=0.05)
    assert np.mean([one.correlation_time_s for one in found]) == pytest.approx(0.05, rel=0.05)


def test_the_effective_count_tells_the_scatter_of_the_mean():
    means = [first_order(seed, 10.0, 2000).mean() for seed in range(60)]
    counts = [autocorrelation(series(first_order(seed, 10.0, 2000))).effective_count for seed in range(10)]
    assert np.std(means) == pytest.approx(1 / np.sqrt(np.mean(counts)), rel=0.25)


def test_correlation_time_of_a_sine_is_one_over_its_angular_frequency():
    wave = np.sin(0.5 * 0.1 * np.arange(5027))
    assert autocorrelation(series(wave)).correlation_time_s == pytest.approx(2.0, rel=0.01)


@pytest.mark.parametrize("delay", [17, -8])
def test_the_lag_of_the_largest_correlation_is_how_much_later_the_second_comes(delay):
    source = first_order(1, 3.0)
    found = cross_correlation(series(source), series(-np.roll(source, delay)))
    lag, coefficient = found.lag_of_largest_s, found.largest
    assert lag == pytest.approx(0.1 * delay)
    assert coefficient == pytest.approx(-1.0, abs=0.02)


def test_independent_signals_stay_within_the_bound_in_19_of_20_lags():
    inside = []
    for seed in range(15):
        first, second = series(first_order(seed, 10.0)), series(first_order(1000 + seed, 10.0))
        found = cross_correlation(first, second)
        inside.append(np.mean(np.abs(found.coefficient) < found.bound_if_independent))
    assert np.mean(inside) == pytest.approx(0.95, abs=0.03)
