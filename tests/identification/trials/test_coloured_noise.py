"""White plus first-order autoregressive noise: against series made by recursion, and the algebra of ARMA(1,1)."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter

from tank2sim.identification.trials.methods.coloured_noise import ColouredNoise, estimate_coloured_noise, white


def series(phi, colour, rest, count, rng):
    """AR(1) of deviation `colour` from its stationary state, plus white noise of deviation `rest`."""
    shocks = colour * np.sqrt(1 - phi**2) * rng.standard_normal(count)
    shocks[0] = colour * rng.standard_normal()
    return lfilter([1.0], [1.0, -phi], shocks) + rest * rng.standard_normal(count)


@settings(max_examples=8, deadline=None)
@given(
    phi=st.floats(0.6, 0.98),
    share=st.floats(0.2, 0.8),
    scale=st.sampled_from([1e-6, 1.0, 1e3]),
    seed=st.integers(0, 99),
)
def test_estimates_whiten_what_they_were_estimated_from(phi, share, scale, seed):
    rng = np.random.default_rng(seed)
    pieces = scale * np.stack([series(phi, share, 1 - share, 8000, rng) for _ in range(4)])
    noise = estimate_coloured_noise(list(pieces), 1e-12 * scale)
    white_ones = noise.whitened(pieces)[:, 20:]
    assert np.std(white_ones) == pytest.approx(1, abs=0.1)
    for lag in (1, 2, 5):
        correlation = np.mean(white_ones[:, lag:] * white_ones[:, :-lag]) / np.mean(white_ones**2)
        assert abs(correlation) < 0.1
    assert noise.deviation == pytest.approx(np.std(pieces), rel=0.15)


def test_a_pure_autoregression_is_found():
    noise = estimate_coloured_noise([series(0.9, 2.0, 0.0, 200_000, np.random.default_rng(1))], 1e-9)
    assert noise.phi == pytest.approx(0.9, abs=0.01)
    assert noise.deviation == pytest.approx(2.0, rel=0.03)
    assert noise.psi == pytest.approx(0.0, abs=0.03)


def test_the_moving_average_factor_is_that_of_granger_and_morris():
    """Autocovariances of the ARMA(1,1) are those of AR(1) plus white noise."""
    phi, colour, rest = 0.9, 1.0, 0.5
    noise = estimate_coloured_noise([series(phi, colour, rest, 400_000, np.random.default_rng(2))], 1e-9)
    impulse = lfilter([1.0, -noise.psi], [1.0, -noise.phi], np.r_[noise.sigma, np.zeros(400)])
    for lag, expected in ((0, colour**2 + rest**2), (1, phi * colour**2), (3, phi**3 * colour**2)):
        assert impulse[lag:] @ impulse[: len(impulse) - lag] == pytest.approx(expected, rel=0.05)
    assert 0 < noise.psi < noise.phi


def test_white_noise_stays_white():
    noise = estimate_coloured_noise([3.0 * np.random.default_rng(3).standard_normal(20_000)], 1e-9)
    assert (noise.phi, noise.psi) == (0.0, 0.0)
    assert noise.sigma == pytest.approx(3.0, rel=0.02)


def test_gaps_are_passed_over_and_rounding_is_the_least():
    piece = np.random.default_rng(4).standard_normal(20_000)
    piece[::7] = np.nan
    assert estimate_coloured_noise([piece], 1e-9).deviation == pytest.approx(1.0, rel=0.03)
    assert estimate_coloured_noise([np.zeros(100)], 1e-3).deviation == pytest.approx(1e-3)
    assert estimate_coloured_noise([np.full(100, np.nan)], 1e-3).deviation == pytest.approx(1e-3)


def test_the_first_of_a_piece_is_for_its_past():
    noise = ColouredNoise(1.0, phi=0.8)
    assert noise.deviation == pytest.approx(1 / 0.6)
    np.testing.assert_allclose(noise.whitened(np.array([[3.0, 2.4, 1.0]])), [[1.8, 0.0, 1.0 - 0.8 * 2.4]], atol=1e-12)


def test_columns_are_whitened_as_residuals_are():
    rng, noise = np.random.default_rng(5), ColouredNoise(2.0, phi=0.7, psi=0.3)
    values = rng.standard_normal((2, 30, 3))
    together = noise.whitened(values)
    for column in range(3):
        np.testing.assert_allclose(together[:, :, column], noise.whitened(values[:, :, column]))


def test_without_colour_whitening_is_division():
    values = np.random.default_rng(6).standard_normal((3, 10))
    np.testing.assert_allclose(white(4.0).whitened(values), values / 4)
