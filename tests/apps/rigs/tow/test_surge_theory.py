"""Drag coefficients and the mass by theory of a towed body: papers.md 1.6, and the definitions themselves."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from tank2sim.apps.rigs.tow import paper as tow_paper
from tank2sim.apps.rigs.tow.surge import SurgeCoefficients, drag
from tank2sim.apps.rigs.tow.theory import TowedBody, drag_polynomial, mass_by_theory, masses_by_theory

BODY = TowedBody(length_m=3.8, beam_m=0.9, volume_m3=2.243)


def test_coefficients_of_figure_2():
    found = drag_polynomial(tow_paper.SOLUTION, BODY)
    assert list(vars(found).values()) == pytest.approx([12.800, -3.6144, 0.27909], rel=3e-5)
    speeds = np.array([0.05, 0.10, 0.1412, 0.17])
    np.testing.assert_allclose(found.at(speeds), [0.1304, 0.0456, 0.0239, 0.0346], atol=6e-5)
    least = speeds_of_least(found)
    assert least == pytest.approx(0.1412, abs=1e-4)
    assert BODY.area_ratio == pytest.approx(8.427, abs=5e-4)
    np.testing.assert_allclose(found.times(BODY.area_ratio).at(speeds), 8.42716 * found.at(speeds), rtol=1e-5)


def speeds_of_least(polynomial):
    speeds = np.linspace(0, 0.2, 20001)
    return speeds[np.argmin(polynomial.at(speeds))]


@settings(max_examples=15, deadline=None)
@given(
    coefficients=st.tuples(*[st.floats(-1e4, 1e4)] * 3),
    length=st.floats(0.5, 20),
    density=st.floats(900, 1100),
    speed=st.floats(0.01, 3),
)
def test_the_coefficient_gives_the_drag_back(coefficients, length, density, speed):
    b1, b2, b3 = coefficients
    body = TowedBody(length_m=length, volume_m3=0.1 * length**3, density_kgpm3=density)
    found = drag_polynomial(SurgeCoefficients(total_mass_kg=1.0, B1_kgs2pm3=b1, B2_kgspm2=b2, B3_kgpm=b3), body)
    half_rho_v2 = 0.5 * density * speed**2
    expected = drag(speed, b1, b2, b3)
    scale = abs(b1) + abs(b2) + abs(b3) + 1
    assert found.at(speed) * half_rho_v2 * length**2 == pytest.approx(expected, abs=1e-9 * scale * (1 + speed) ** 4)
    by_volume = found.times(body.area_ratio).at(speed) * half_rho_v2 * body.volume_m3 ** (2 / 3)
    assert by_volume == pytest.approx(expected, abs=1e-9 * scale * (1 + speed) ** 4)


def test_reynolds_number_is_that_of_the_length():
    assert BODY.reynolds(np.array([0.1]))[0] == pytest.approx(0.1 * 3.8 / 1.139e-6)


def test_mass_by_theory_is_the_printed_one_with_the_printed_k11():
    triaxial, spheroid, printed = masses_by_theory(BODY)
    assert printed.near_surface_kg == pytest.approx(2489.2, abs=0.05)
    assert mass_by_theory(BODY, 0.16, "").near_surface_kg == pytest.approx(2497.8, abs=0.05)
    assert (triaxial.k11, spheroid.k11) == pytest.approx((0.0946, 0.0755), abs=5e-5)
    assert BODY.height_m == pytest.approx(1.2526, abs=5e-5)
    assert triaxial.deep_kg == pytest.approx(2243 * 1.0945721, rel=1e-6)


def test_k11_of_the_triaxial_body_is_lambs_integral():
    a, b, c = 1.9, 0.45, BODY.height_m / 2

    def integrand(t):
        # s = t / (1 - t), so that the range is finite
        s = t / (1 - t)
        return 1 / ((a * a + s) * np.sqrt((a * a + s) * (b * b + s) * (c * c + s))) / (1 - t) ** 2

    alpha = a * b * c * quad(integrand, 0, 1, epsabs=1e-12, epsrel=1e-12)[0]
    assert masses_by_theory(BODY)[0].k11 == pytest.approx(alpha / (2 - alpha), rel=1e-8)


def test_without_a_breadth_the_printed_k11_is_left():
    (only,) = masses_by_theory(TowedBody(length_m=3.8, volume_m3=2.243))
    assert only.k11 == 0.156
    with pytest.raises(ValueError, match="breadth"):
        _ = TowedBody(length_m=3.8, volume_m3=2.243).height_m
