import numpy as np
import pytest

from tank2sim.errors import InputError
from tank2sim.records.signals.spectra import spectrum, transfer_function
from tests.records.signals.made import first_order, nomoto, series, white

STEP = 0.1


def exact_first_order(frequency_hz, time_constant_steps):
    """One-sided density of the sampled process of variance 1."""
    a = np.exp(-1.0 / time_constant_steps)
    return 2.0 * STEP * (1.0 - a * a) / np.abs(1.0 - a * np.exp(-2j * np.pi * frequency_hz * STEP)) ** 2


@pytest.mark.parametrize("steps", [0.01, 5.0])
def test_confidence_limits_hold_the_true_density_in_19_of_20_cases(steps):
    inside, low_misses = [], []
    for seed in range(40):
        found = spectrum(series(first_order(seed, steps), STEP))
        true = exact_first_order(found.frequency_hz, steps)
        inside.append(np.mean((found.low < true) & (true < found.high)))
        low_misses.append(np.mean(found.low > true))
    assert np.mean(inside) == pytest.approx(0.95, abs=0.01)
    assert np.mean(low_misses) == pytest.approx(0.025, abs=0.008)


def test_the_integral_of_the_density_is_the_variance():
    found = spectrum(series(2.0 * first_order(1, 5.0), STEP))
    assert np.sum(found.density) * found.frequency_hz[0] == pytest.approx(4.0, rel=0.15)


def test_degrees_of_freedom_of_half_overlapping_hann_windows():
    averaging = spectrum(series(white(1)), segment_s=40.0).averaging
    assert (averaging.samples_in_segment, averaging.segments) == (400, 19)
    # Half-overlapping Hann windows share (1/6)^2 of their variance: 2 K/(1 + 2/36 (K - 1)/K).
    assert averaging.degrees_of_freedom == pytest.approx(38 / (1 + 18 / 19 * 2 / 36), rel=1e-3)


def test_a_sine_in_noise_is_the_distinct_main_peak():
    wave = 0.5 * np.sin(2 * np.pi * 0.8 * STEP * np.arange(4000)) + white(2)
    peak = spectrum(series(wave, STEP)).peak
    assert peak.distinct
    assert not peak.at_lowest_frequency
    assert peak.frequency_hz == pytest.approx(0.8, abs=0.012)


@pytest.mark.parametrize("steps", [0.01, 5.0, 50.0])
def test_peaks_of_noise_are_seldom_called_distinct(steps):
    peaks = [spectrum(series(first_order(seed, steps), STEP)).peak for seed in range(40)]
    assert sum(peak is not None and peak.distinct for peak in peaks) <= 4


def test_slow_signals_get_longer_segments():
    assert spectrum(series(white(1))).averaging.segments == 8
    assert spectrum(series(first_order(1, 200.0))).averaging.segments == 3


def test_an_impossible_segment_is_refused():
    for wrong in (0.5, 300.0):
        with pytest.raises(InputError, match="is not a length of a segment"):
            spectrum(series(white(1)), segment_s=wrong)


def ship(seed, noise):
    """Ten rudder angles held 5 s to 20 s each, over and over; K 0.08 1/s, T 3 s."""
    random = np.random.default_rng(seed)
    rudder = np.repeat(random.uniform(-0.3, 0.3, 400), random.integers(5, 40, 400))[:6000]
    return series(rudder, name="delta_rad"), series(nomoto(rudder, STEP, 0.08, 3.0, noise * white(seed + 500, 6000)))


def exact_nomoto(frequency_hz):
    """Of the rudder held over each step, sampled: (1 - a) z/(1 - a z), z = exp(-i omega step)."""
    a, z = np.exp(-STEP / 3.0), np.exp(-2j * np.pi * frequency_hz * STEP)
    return 0.08 * (1.0 - a) * z / (1.0 - a * z)


def test_gain_and_phase_of_a_nomoto_ship():
    found = transfer_function(*ship(1, 0.0))
    low = (found.frequency_hz > 0.02) & (found.frequency_hz < 0.5)
    omega = 2 * np.pi * found.frequency_hz[low]
    # Analytic, of the continuous system, except the half step by which a held rudder is late.
    analytic = 0.08 / (1.0 + 3.0j * omega) * np.exp(-0.5j * omega * STEP)
    assert np.max(np.abs(found.gain[low] / np.abs(analytic) - 1.0)) < 0.06
    assert np.max(np.abs(found.phase_rad[low] - np.angle(analytic))) < 0.06
    assert np.all(found.phase_rad[low] < 0)
    assert np.min(found.coherence[low]) > 0.98


def test_intervals_of_gain_and_phase_hold_the_truth_in_19_of_20_cases():
    gains, phases = [], []
    for seed in range(40):
        found = transfer_function(*ship(seed, 0.01))
        low = (found.frequency_hz > 0.01) & (found.frequency_hz < 0.06)
        ratio = found.response[low] / exact_nomoto(found.frequency_hz[low])
        gains += list(np.abs(np.log(np.abs(ratio))) < found.half_width_95[low])
        phases += list(np.abs(np.angle(ratio)) < found.half_width_95[low])
    assert np.mean(gains) == pytest.approx(0.95, abs=0.025)
    assert np.mean(phases) == pytest.approx(0.95, abs=0.025)


def test_coherence_of_independent_signals_exceeds_chance_in_1_of_20_frequencies():
    above, sure = [], []
    for seed in range(30):
        found = transfer_function(series(white(seed), name="delta_rad"), series(white(seed + 900)))
        above.append(np.mean(found.coherence > found.coherence_by_chance))
        sure.append(np.mean(found.sure))
    assert np.mean(above) == pytest.approx(0.05, abs=0.012)
    assert np.mean(sure) < 0.025


def test_noise_in_the_output_lowers_the_coherence_by_its_share():
    source = white(1, 40000)
    found = transfer_function(series(source, name="delta_rad"), series(source + white(2, 40000)), segment_s=20.0)
    assert np.mean(found.coherence) == pytest.approx(0.5, abs=0.02)
