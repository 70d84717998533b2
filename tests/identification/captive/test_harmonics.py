"""Harmonics of the forces of one run, against forces that are written down here."""

from __future__ import annotations

import numpy as np
import pytest

from tank2sim.identification.captive.harmonics import reduced_run
from tank2sim.records.campaign_form import RunSheet
from tank2sim.records.captive_record import CaptiveRun

FREQUENCY = 0.7
SIGMA = 0.3


def sway(periods: int, seed: int = 0, slope: float = 0.0, sigma: float = SIGMA) -> CaptiveRun:
    """Y is 2 + 5 cos - 3 sin of the phase of the velocity, white noise, and a line that rises by `slope` a second."""
    step = 2 * np.pi / FREQUENCY / 200
    time = step * np.arange(200 * periods)
    phase = FREQUENCY * time
    noise = sigma * np.random.default_rng(seed).standard_normal(time.size)
    zero = np.zeros_like(time)
    return CaptiveRun(
        name="sway.csv",
        type="pure_sway",
        sheet=RunSheet(file="sway.csv", type="pure_sway", frequency_radps=FREQUENCY),
        time_s=time,
        v_mps=0.07 * np.cos(phase),
        r_radps=zero,
        speed_mps=zero + 1.2,
        delta_rad=zero,
        X_N=zero,
        Y_N=2 + 5 * np.cos(phase) - 3 * np.sin(phase) + slope * (time - time.mean()) + noise,
        N_Nm=zero,
        y_m=0.1 * np.sin(phase),
        psi_rad=zero,
    )


def test_a_single_period_has_no_trend_and_its_sine_is_as_exact_as_white_noise_allows() -> None:
    """n readings of white noise leave an error of sigma sqrt(2/n); a trend next to a sine would make it 2.5 times."""
    found = [reduced_run(sway(1, seed)) for seed in range(60)]
    assert "trend" not in found[0].labels
    sine = found[0].labels.index("sin 1")
    off = np.array([run.fits["Y"].coefficients[sine] + 3 for run in found])
    stated = np.array([np.sqrt(run.fits["Y"].covariance[sine, sine]) for run in found])
    expected = SIGMA * np.sqrt(2 / 200)
    assert np.sqrt(np.mean(off**2)) == pytest.approx(expected, rel=0.3)
    assert np.sqrt(np.mean(stated**2)) == pytest.approx(expected, rel=0.3)


@pytest.mark.parametrize("periods", [2, 5])
def test_over_more_periods_a_drift_of_the_zero_is_no_harmonic(periods: int) -> None:
    run = reduced_run(sway(periods, slope=0.05, sigma=0.0))
    values = dict(zip(run.labels, run.fits["Y"].coefficients, strict=True))
    half = 0.05 * (200 * periods - 1) * 2 * np.pi / FREQUENCY / 200 / 2  # over half the record's length
    assert values["trend"] == pytest.approx(half, rel=1e-6)
    assert (values["cos 1"], values["sin 1"]) == pytest.approx((5, -3), rel=1e-6)
