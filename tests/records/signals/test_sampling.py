import numpy as np
import pytest

from tank2sim.errors import InputError
from tank2sim.records.signals.sampling import at_common_times, even_series
from tests.records.signals.made import series, trial

TIME = 0.1 * np.arange(400)
WAVE = np.sin(TIME)


def test_even_samples_stay_as_they_are():
    found = even_series(trial(TIME, r_radps=WAVE), "r_radps")
    assert np.array_equal(found.values, WAVE)
    assert found.step_s == pytest.approx(0.1)
    assert found.notices == ()


def test_times_rounded_as_a_file_writes_them_are_even():
    rounded = np.round(TIME / 3.0, 3)
    found = even_series(trial(rounded, r_radps=WAVE), "r_radps")
    assert np.array_equal(found.values, WAVE)
    assert found.notices == ()


def test_a_short_gap_is_bridged_and_said():
    broken = WAVE.copy()
    broken[100:104] = np.nan
    found = even_series(trial(TIME, r_radps=broken), "r_radps")
    # A line over 0.5 s of a sine of amplitude 1 and 1 rad/s misses by at most 0.5^2/8.
    assert np.max(np.abs(found.values - WAVE)) < 0.0313
    assert "gaps of up to 0.5 s" in found.notices[0]


@pytest.mark.parametrize("rows", [slice(100, 106), slice(200, 300)])
def test_a_long_gap_is_refused_with_its_times_unless_allowed(rows):
    broken = WAVE.copy()
    broken[rows] = np.nan
    made = trial(TIME, r_radps=broken)
    with pytest.raises(InputError, match=rf"made.csv: column r_degps: has no value from {TIME[rows.start - 1]:g}"):
        even_series(made, "r_radps")
    assert len(even_series(made, "r_radps", max_gap_s=20.0).values) == 400


def test_an_order_is_held_over_a_gap():
    order = np.where(TIME < 10.0, 0.0, 0.2)
    order[98:102] = np.nan
    found = even_series(trial(TIME, delta_order_rad=order), "delta_order_rad")
    assert set(found.values.tolist()) == {0.0, 0.2}
    assert found.values[101] == 0.0


def test_missing_ends_are_cut_off_and_said():
    broken = WAVE.copy()
    broken[:50] = broken[-20:] = np.nan
    found = even_series(trial(TIME, r_radps=broken), "r_radps")
    assert (found.start_s, len(found.values)) == (5.0, 330)
    assert "known from 5 to 37.9 s only" in found.notices[0]


def test_jittered_times_are_brought_to_an_even_step():
    jittered = TIME + np.random.default_rng(3).uniform(-0.03, 0.03, TIME.size)
    found = even_series(trial(jittered, r_radps=np.sin(jittered)), "r_radps")
    # A line over 0.16 s misses by at most 0.16^2/8.
    assert np.max(np.abs(found.values - np.sin(found.time_s))) < 3.2e-3
    assert "unevenly sampled" in found.notices[0]


def test_a_slow_sensor_among_fast_ones_keeps_its_own_step():
    slow = np.where(np.arange(TIME.size) % 5 == 0, WAVE, np.nan)
    found = even_series(trial(TIME, x_m=slow), "x_m")
    assert found.step_s == pytest.approx(0.5)
    assert np.array_equal(found.values, WAVE[::5])


def test_a_direction_goes_through_north_without_a_jump():
    course = np.mod(np.deg2rad(350.0 + TIME), 2 * np.pi)
    found = even_series(trial(TIME, cog_rad=course), "cog_rad")
    assert np.allclose(np.diff(found.values), np.deg2rad(0.1))


def test_too_few_values_are_refused():
    with pytest.raises(InputError, match="has 49 values, and at least 50"):
        even_series(trial(TIME[:49], r_radps=WAVE[:49]), "r_radps")


def test_two_signals_meet_at_the_same_times():
    first, second = series(WAVE, 0.1), series(np.sin(2.0 + 0.2 * np.arange(150)), 0.2, start_s=2.0)
    first, second = at_common_times(first, second)
    assert np.array_equal(first.time_s, second.time_s)
    assert first.start_s == 2.0
    assert np.max(np.abs(first.values - second.values)) < 6e-3
