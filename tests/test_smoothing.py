"""Smoothing and correlation of series, against scipy.signal."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from tank2sim.smoothing import central_weight, convolved, correlated, smooth_by_windows

RNG = np.random.default_rng(4)


@pytest.mark.parametrize(
    ("window", "degree", "derivative"), [(5, 2, 0), (41, 3, 0), (41, 3, 1), (3, 1, 1), (301, 3, 1)]
)
@pytest.mark.parametrize("shape", [(400,), (400, 3)])
def test_windows_smooth_as_those_of_scipy_up_to_both_ends(window, degree, derivative, shape) -> None:
    values = np.cumsum(RNG.standard_normal(shape), axis=0)
    expected = signal.savgol_filter(values, window, degree, deriv=derivative, delta=0.3, axis=0)
    found = smooth_by_windows(values, window, degree, derivative, 0.3)
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize(("window", "degree"), [(5, 2), (21, 3), (201, 3)])
def test_the_weight_of_a_value_is_that_of_scipy(window: int, degree: int) -> None:
    assert central_weight(window, degree) == pytest.approx(signal.savgol_coeffs(window, degree)[window // 2])


@pytest.mark.parametrize("kind", [float, complex])
def test_a_convolution_is_the_sum_of_products(kind: type) -> None:
    values, weights = RNG.standard_normal(37).astype(kind), RNG.standard_normal(9)
    values += 1j * RNG.standard_normal(37) if kind is complex else 0
    assert convolved(values, weights) == pytest.approx(np.convolve(values, weights))


def test_a_correlation_is_that_of_scipy() -> None:
    first, second = RNG.standard_normal(31), RNG.standard_normal(12)
    assert correlated(first, second) == pytest.approx(signal.correlate(first, second))
