"""Lamb's coefficients, against quadrature of his integrals and closed forms."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tank2sim.dynamics.ellipsoid import lamb_coefficients, lamb_integrals
from tests.dynamics.ellipsoid_quadrature import by_quadrature, turning

AXES = st.floats(0.2, 5.0)


@pytest.mark.parametrize("axes", [(0.335, 0.1, 0.08), (1.0, 2.0, 3.0), (3.0, 0.4, 0.9), (80.0, 12.0, 7.5)])
def test_integrals_and_coefficients_are_those_of_quadrature(axes):
    alpha, beta, gamma = exact = by_quadrature(*axes)
    np.testing.assert_allclose(lamb_integrals(*axes), exact, rtol=1e-10)
    found = lamb_coefficients(*axes)
    a, b, c = axes
    np.testing.assert_allclose([found.k11, found.k22, found.k33], [value / (2 - value) for value in exact], rtol=1e-10)
    expected = [turning(b, c, beta, gamma), turning(c, a, gamma, alpha), turning(a, b, alpha, beta)]
    np.testing.assert_allclose([found.k44, found.k55, found.k66], expected, rtol=1e-9)


def test_sphere_and_spheroid_have_their_closed_forms():
    sphere = lamb_coefficients(2.0, 2.0, 2.0)
    np.testing.assert_allclose(list(vars(sphere).values()), [0.5, 0.5, 0.5, 0, 0, 0], rtol=1e-14)
    e = math.sqrt(1 - (0.2 / 0.685) ** 2)
    long = math.log((1 + e) / (1 - e))
    alpha, beta = 2 * (1 - e * e) / e**3 * (long / 2 - e), 1 / e**2 - (1 - e * e) / (2 * e**3) * long
    found = lamb_coefficients(0.3425, 0.1, 0.1)
    np.testing.assert_allclose([found.k11, found.k22], [alpha / (2 - alpha), beta / (2 - beta)], rtol=1e-12)
    assert found.k66 == pytest.approx(0.534215, abs=5e-7)  # papers.md 3.3
    assert found.k44 == 0.0


@settings(max_examples=20, deadline=None)
@given(AXES, AXES, AXES, st.floats(1e-3, 1e3))
def test_coefficients_have_no_size_and_follow_the_names_of_the_axes(a, b, c, size):
    one, larger, turned = (lamb_coefficients(*axes) for axes in ((a, b, c), (size * a, size * b, size * c), (b, c, a)))
    np.testing.assert_allclose(list(vars(larger).values()), list(vars(one).values()), rtol=1e-9, atol=1e-13)
    np.testing.assert_allclose(
        [turned.k11, turned.k22, turned.k33, turned.k44, turned.k55, turned.k66],
        [one.k22, one.k33, one.k11, one.k55, one.k66, one.k44],
        rtol=1e-9,
        atol=1e-13,
    )
    assert sum(lamb_integrals(a, b, c)) == pytest.approx(2.0, rel=1e-13)
    assert all(value >= 0 for value in vars(one).values())


@pytest.mark.parametrize("axes", [(0.0, 1.0, 1.0), (1.0, -1.0, 1.0), (1.0, 1.0, math.inf)])
def test_an_axis_that_is_none_is_refused(axes):
    with pytest.raises(ValueError, match="semi-axes"):
        lamb_integrals(*axes)
