"""Roots in an interval, against functions whose roots are known and scipy's."""

from __future__ import annotations

import math

import pytest
from scipy.optimize import brentq

from tank2sim.simulation.trajectory import bracketed_root


@pytest.mark.parametrize(
    ("function", "low", "high"),
    [
        (math.cos, 1.0, 2.0),
        (lambda x: x**3 - 2, 0.0, 5.0),
        (lambda x: math.exp(x) - 1e6, 0.0, 100.0),
        (lambda x: math.atan(1e6 * (x - 0.3)), -1.0, 1.0),
        (lambda x: (x - 1) ** 3 + 1e-3 * (x - 1), 0.0, 1.7),
        (lambda x: 2 - x, 0.0, 3.0),
    ],
)
def test_the_root_is_that_of_scipy(function, low, high):
    expected = brentq(function, low, high, xtol=1e-15)
    assert bracketed_root(function, low, high) == pytest.approx(expected, abs=1e-12)


def test_an_end_may_be_the_root():
    assert bracketed_root(lambda x: x, 0.0, 1.0) == 0.0
    assert bracketed_root(lambda x: x - 1, 0.0, 1.0) == 1.0


def test_without_a_change_of_sign_it_refuses():
    with pytest.raises(ValueError, match="change of sign"):
        bracketed_root(lambda x: x * x + 1, -1.0, 1.0)
