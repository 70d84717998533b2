"""(7), (8), (9) of paper 3 against Lamb's value and the numbers of papers.md 3.3."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tank2sim.apps.rigs.yaw import theory
from tank2sim.dynamics.ellipsoid import lamb_coefficients
from tests.dynamics.ellipsoid_quadrature import by_quadrature, turning

TOP = math.pi / 12


@settings(max_examples=25, deadline=None)
@given(st.floats(1.5, 8.0), st.floats(0.2, 0.95))
def test_corrected_7_is_lambs_exact_value(p, q):
    assert theory.ratio_by_7(p, q) == pytest.approx(lamb_coefficients(p, 1.0, q).k66, rel=1e-10)


@pytest.mark.parametrize("axes", [(3.35, 0.8), (2.0, 0.5), (6.0, 0.9)])
def test_corrected_7_is_lambs_value_by_quadrature(axes):
    p, q = axes
    alpha, beta, _ = by_quadrature(p, 1.0, q)
    assert theory.ratio_by_7(p, q) == pytest.approx(turning(p, 1.0, alpha, beta), rel=1e-9)


def test_numbers_of_the_ellipsoid():
    assert theory.depth_factor(0.08 / 0.22) == pytest.approx(1.34397, abs=5e-6)
    assert theory.depth_factor(0.10 / 0.24) == pytest.approx(1.45169, abs=5e-6)
    assert theory.ellipsoid_water_inertia(theory.ELLIPSOID) == pytest.approx(0.137209, abs=5e-7)
    assert theory.ratio_by_7(3.35, 0.8) == pytest.approx(0.440693, abs=5e-7)
    assert theory.ratio_by_7(3.35, 0.8, as_printed=True) == pytest.approx(0.04311, abs=5e-6)
    assert 1e4 * theory.added_inertia_by_7(theory.ELLIPSOID) == pytest.approx(812.7, abs=0.05)
    assert theory.added_inertia_by_7(theory.ELLIPSOID) == pytest.approx(
        theory.added_inertia_of_ellipsoid(theory.ELLIPSOID), rel=1e-10
    )


def test_9_gives_the_papers_second_draught_and_not_its_first():
    assert 1e4 * theory.added_inertia_by_9(theory.SHIP_MOTION_T2) == pytest.approx(797.1, abs=0.05)
    assert 1e4 * theory.added_inertia_by_9(theory.SHIP_MOTION_T1) == pytest.approx(497.4, abs=0.05)
    assert 1e4 * theory.ship_water_inertia(theory.SHIP_MOTION_T2) == pytest.approx(1027.86, abs=0.01)


def test_8_as_printed_and_the_variant_that_comes_nearest_to_the_table():
    printed = {("T1", "accelerating"): 469.0, ("T1", "braking"): 479.8}
    printed |= {("T2", "accelerating"): 1078.9, ("T2", "braking"): 1097.2}
    near = {("T1", "accelerating"): 456.6, ("T1", "braking"): 464.4}
    near |= {("T2", "accelerating"): 1057.1, ("T2", "braking"): 1070.5}
    bodies = {"T1": theory.SHIP_MOTION_T1, "T2": theory.SHIP_MOTION_T2}
    for (draught, stage), value in printed.items():
        body = bodies[draught]
        assert 1e4 * theory.added_inertia_by_8(body, TOP, stage) == pytest.approx(value, abs=0.1)
        variant = theory.added_inertia_by_8(body, 0.1957, stage, bracket=0.08)
        assert 1e4 * variant == pytest.approx(near[draught, stage], abs=0.1)


def test_8_hangs_on_the_block_coefficient():
    assert 1e4 * theory.sensitivity_of_8(theory.SHIP_MOTION_T1, TOP, "accelerating") == pytest.approx(107, abs=1)
    assert 1e4 * theory.sensitivity_of_8(theory.SHIP_MOTION_T2, TOP, "accelerating") == pytest.approx(169, abs=1)


def test_7_outside_its_axes_and_8_without_block_are_refused():
    with pytest.raises(ValueError, match="L > B > 2T"):
        theory.ratio_by_7(3.35, 1.0)
    with pytest.raises(ValueError, match="block coefficient"):
        theory.added_inertia_by_8(theory.ELLIPSOID, TOP, "braking")


def test_the_table_of_theory_tells_what_reproduces():
    rows = {own.formula: own for own in theory.theory_values(theory.SHIP_MOTION_T2, 0.2618)}
    assert rows["(9)"].remark.startswith("the published number reproduces")
    assert rows["(8) braking"].remark.startswith("the published number does not")
    (only,) = theory.theory_values(theory.ELLIPSOID, 0.2618)
    assert only.value_kgm2 == pytest.approx(812.7e-4, rel=1e-3) and only.printed_kgm2 == pytest.approx(509.7e-4)
    deep = theory.FloatingBody(length_m=0.67, beam_m=0.1, draught_m=0.08, depth_m=0.22)
    assert theory.theory_values(deep, 0.2618)[0].formula == "Lamb"
