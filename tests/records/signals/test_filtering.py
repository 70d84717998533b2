import cmath
import math
import re

import numpy as np
import pytest

from tank2sim.apps.signals.study import parse_filter
from tank2sim.errors import InputError
from tank2sim.records.signals.filtering import (
    FilterType,
    butterworth,
    decimate,
    detrend,
    savitzky_golay,
    smoothing_spline,
)
from tests.records.signals.made import series, white

STEP = 0.05


def wave(frequency_hz, count=4000):
    return series(np.sin(2 * np.pi * frequency_hz * STEP * np.arange(count) + 0.7), STEP)


def measured(frequency_hz, filtered):
    """Output over input of a sine, by least squares on the middle of the record."""
    time, values = filtered.series.time_s, filtered.series.values
    inside = slice(len(time) // 3, 2 * len(time) // 3)
    angle = 2 * np.pi * frequency_hz * time[inside] + 0.7
    basis = np.column_stack([np.sin(angle), np.cos(angle)])
    sine, cosine = np.linalg.lstsq(basis, values[inside], rcond=None)[0]
    return complex(sine, cosine)


FILTERS = {
    "lowpass": lambda one: butterworth(one, FilterType.LOW, [0.5]),
    "lowpass causal": lambda one: butterworth(one, FilterType.LOW, [0.5], causal=True),
    "highpass": lambda one: butterworth(one, FilterType.HIGH, [0.2]),
    "highpass causal": lambda one: butterworth(one, FilterType.HIGH, [0.2], order=3, causal=True),
    "bandpass": lambda one: butterworth(one, FilterType.BAND, [0.1, 1.0]),
    "bandpass causal": lambda one: butterworth(one, FilterType.BAND, [0.1, 1.0], order=2, causal=True),
    "savgol": lambda one: savitzky_golay(one, 21, 3),
    "savgol rate": lambda one: savitzky_golay(one, 21, 3, derivative=1),
    "savgol acceleration": lambda one: savitzky_golay(one, 21, 4, derivative=2),
    "spline": lambda one: smoothing_spline(one, 0.5),
    "decimate": lambda one: decimate(one, 4),
}


@pytest.mark.parametrize("name", FILTERS)
@pytest.mark.parametrize("frequency_hz", [0.06, 0.23, 0.5, 0.9, 1.7])
def test_reported_gain_and_phase_are_those_of_a_sine_sent_through(name, frequency_hz):
    filtered = FILTERS[name](wave(frequency_hz))
    found, reported = measured(frequency_hz, filtered), filtered.effect.at(frequency_hz)
    assert abs(found - reported) < 2e-3 * max(1.0, abs(reported))


@pytest.mark.parametrize("name", ["lowpass", "highpass", "bandpass", "savgol", "spline", "decimate"])
def test_without_shift_of_phase_means_just_that(name):
    filtered = FILTERS[name](wave(0.3))
    assert abs(cmath.phase(measured(0.3, filtered))) < 2e-3
    assert np.all(filtered.effect.group_delay_s == 0)
    assert "no phase shift" in filtered.effect.explanation


def test_a_derivative_is_that_of_the_sine():
    filtered = savitzky_golay(wave(0.1), 9, 3, derivative=1)
    assert measured(0.1, filtered) == pytest.approx(2j * np.pi * 0.1, rel=1e-3)


def test_minus_3_db_one_way_and_minus_6_both_ways():
    assert abs(measured(0.5, butterworth(wave(0.5), FilterType.LOW, [0.5], causal=True))) == pytest.approx(
        math.sqrt(0.5), rel=1e-3
    )
    assert abs(measured(0.5, butterworth(wave(0.5), FilterType.LOW, [0.5]))) == pytest.approx(0.5, rel=1e-3)


@pytest.mark.parametrize(
    ("kind", "edges", "word"),
    [(FilterType.LOW, [0.5], "delays"), (FilterType.HIGH, [0.2], "brings"), (FilterType.BAND, [0.1, 1.0], None)],
)
def test_the_sentence_tells_the_delay_that_a_sine_gets(kind, edges, word):
    sentence = butterworth(wave(0.3), kind, edges, causal=True).effect.explanation
    reported = re.match(r"(delays|brings) ([\d.]+) Hz (?:by )?([\d.e-]+) s", sentence)
    assert reported, sentence
    frequency, shift = float(reported[2]), float(reported[3]) * (1 if reported[1] == "delays" else -1)
    found = measured(frequency, butterworth(wave(frequency), kind, edges, causal=True))
    assert cmath.phase(found * cmath.exp(2j * np.pi * frequency * shift)) == pytest.approx(0.0, abs=0.03)
    if word:
        assert reported[1] == word
        assert abs(shift) < 1.0 / frequency


def test_group_delay_is_how_much_later_a_packet_comes():
    time = STEP * np.arange(4000)
    packet = np.exp(-(((time - 100.0) / 15.0) ** 2)) * np.sin(2 * np.pi * 0.3 * time)
    filtered = butterworth(series(packet, STEP), FilterType.LOW, [0.5], causal=True)
    energy = filtered.series.values**2
    later = float(np.sum(time * energy) / np.sum(energy)) - 100.0
    reported = float(np.interp(0.3, filtered.effect.frequency_hz, filtered.effect.group_delay_s))
    assert later == pytest.approx(reported, rel=0.01)


@pytest.mark.parametrize("name", ["lowpass", "lowpass causal", "spline"])
def test_the_middle_does_not_depend_on_what_is_beyond_the_ends_reported(name):
    # The same process with another past and future: inside the ends reported the outputs agree to about 1 %.
    values = white(5, 2000)
    whole = FILTERS[name](series(values, STEP))
    part = FILTERS[name](series(values[700:1300], STEP))
    begin, end = (round(one / STEP) for one in part.effect.distorted_ends_s)
    inside = slice(begin, 600 - end)
    error = np.max(np.abs(part.series.values[inside] - whole.series.values[700:1300][inside]))
    assert error < 0.05 * np.std(whole.series.values)


def test_filters_pass_a_constant_level():
    level = series(np.full(500, 4.7), STEP)
    for name in ("lowpass", "lowpass causal", "savgol", "spline", "decimate"):
        assert np.allclose(FILTERS[name](level).series.values, 4.7, atol=1e-6)
    for name in ("highpass", "highpass causal", "bandpass"):
        assert np.allclose(FILTERS[name](level).series.values, 0.0, atol=1e-6)


def test_decimation_keeps_the_slow_and_not_what_would_fold():
    thin = decimate(series(wave(0.2).values + wave(4.3).values, STEP), 5).series
    assert thin.step_s == pytest.approx(0.25)
    assert np.max(np.abs(thin.values - wave(0.2).values[::5])[40:-40]) < 0.02


@pytest.mark.parametrize("degree", [0, 1, 3])
def test_a_trend_is_taken_out_and_a_wave_left(degree):
    time = STEP * np.arange(4000)
    slow = np.polynomial.Polynomial([3.0, 0.2, -0.004, 1e-5][: degree + 1])(time)
    filtered = detrend(series(slow + wave(0.3).values, STEP), degree)
    assert np.max(np.abs(filtered.series.values - wave(0.3).values)) < 0.05
    assert np.max(np.abs(detrend(series(slow, STEP), degree).series.values)) < 1e-9 * np.max(np.abs(slow))


def test_the_gain_reported_of_a_trend_is_the_mean_over_the_places_of_the_crests():
    frequency, time = 1.3 / 200.0, STEP * np.arange(4000)
    parts = []
    for start in np.linspace(0.0, 2 * np.pi, 6, endpoint=False):
        angle = 2 * np.pi * frequency * time + start
        kept = detrend(series(np.sin(angle), STEP), 1).series.values
        parts.append(2.0 * np.mean(kept * np.exp(-1j * angle)) * 1j)
    reported = detrend(wave(0.3), 1).effect.at(frequency)
    assert np.mean(parts) == pytest.approx(reported, abs=5e-3)


@pytest.mark.parametrize(
    "text", ["lowpass", "lowpass:a", "lowpass:0.1,0.2", "bandpass:1", "savgol:11", "savgol:11.5,3", "detrend:1,causal",
             "median:3", "decimate:inf", "spline:nan"],
)  # fmt: skip
def test_what_is_no_filter_is_refused(text):
    with pytest.raises(InputError):
        parse_filter(text).apply(wave(0.3))


@pytest.mark.parametrize(
    ("text", "reported"),
    [("lowpass:11", "not between"), ("bandpass:1,0.5", "that rise"), ("savgol:10,3", "odd number"),
     ("savgol:5001,3", "do not fit"), ("detrend:11", "not a degree"), ("detrend:-1", "not a degree"),
     ("decimate:1", "2 or more"), ("decimate:100", "2 or more"), ("spline:0.001", "not between")],
)  # fmt: skip
def test_numbers_that_do_not_fit_the_record_are_refused(text, reported):
    with pytest.raises(InputError, match=reported):
        parse_filter(text).apply(wave(0.3))


@pytest.mark.parametrize("text", ["lowpass:11", "savgol:5001,3", "spline:0.001", "decimate:100"])
def test_a_filter_that_does_not_fit_a_record_names_the_file_of_the_record(text):
    record = wave(0.3)
    with pytest.raises(InputError) as refusal:
        parse_filter(text).apply(record)
    assert str(refusal.value).startswith(f"{record.source}: filter {text.partition(':')[0]}: ")


def test_side_lobes_upside_down_are_half_a_turn_and_no_more():
    effect = savitzky_golay(wave(0.3), 21, 3).effect
    assert set(np.round(np.rad2deg(effect.phase_rad), 3)) == {0.0, 180.0}
    causal = butterworth(wave(0.3), FilterType.HIGH, [0.2], causal=True).effect
    assert np.rad2deg(causal.phase_rad[0]) == pytest.approx(360.0, abs=10.0)  # order 4 leads by a turn at zero
    assert np.rad2deg(causal.phase_rad[-1]) == pytest.approx(0.0, abs=1.0)
