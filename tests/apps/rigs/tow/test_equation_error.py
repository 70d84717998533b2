"""The paper's method: its polynomial (2.1), its inner products, and the solution they really have."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from printed_tows import FORCE_N, FORCE_PRODUCTS, INNER_PRODUCTS

from tank2sim.apps.rigs.tow.equation_error import (
    covariance,
    discretise,
    fit_mean_speed,
    simpson_nodes,
    solve_by_qr,
    solve_normal_equations,
)
from tank2sim.apps.rigs.tow.records import Tows
from tank2sim.errors import InputError
from tank2sim.identification.conditioning import scaled_condition

TERMS = ("B1", "B2", "B3")
TIMES_S = np.arange(0, 51, 5.0)
VARYING = Polynomial([12.0, 0.1, -0.0015])
PAPER_SPEED = Polynomial([-0.00493, 0.0043, -0.000017])  # (2.1); the inner products settle the sign of the first


@pytest.fixture
def paper():
    return discretise(PAPER_SPEED, TIMES_S, TERMS, FORCE_N)


def test_inner_products_are_those_printed(paper):
    np.testing.assert_allclose(paper.inner_products, INNER_PRODUCTS, atol=2e-7, rtol=0)
    # half a unit of the last digit, and 1.1e-5 by which all are low (T = 11.6299 N)
    np.testing.assert_allclose(paper.force_products, FORCE_PRODUCTS, rtol=1.2e-5, atol=5e-6)


def test_the_printed_sign_of_the_polynomial_gives_other_inner_products():
    wrong = discretise(Polynomial([0.00493, 0.0043, -0.000017]), TIMES_S, TERMS, FORCE_N)
    assert np.max(wrong.inner_products / INNER_PRODUCTS) == pytest.approx(1.7, abs=0.05)


def test_simpson_has_ten_intervals_of_five_seconds():
    nodes, weights = simpson_nodes(TIMES_S)
    np.testing.assert_array_equal(nodes, TIMES_S)
    np.testing.assert_allclose(weights, np.array([1, 4, 2, 4, 2, 4, 2, 4, 2, 4, 1]) * 5 / 3)


@pytest.mark.parametrize("times", [np.arange(0, 4.6, 0.1), np.arange(1, 8.0), np.array([0, 1, 2, 3.5, 9, 20])])
def test_simpson_integrates_a_cubic_exactly_over_the_recorded_time(times):
    nodes, weights = simpson_nodes(times)
    assert len(nodes) % 2 == 1
    cubic = Polynomial([1.0, -2.0, 0.5, 0.1])
    exact = cubic.integ()(times[-1]) - cubic.integ()(times[0])
    assert weights @ cubic(nodes) == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize("solve", [solve_normal_equations, solve_by_qr])
def test_solution_of_the_normal_equations_is_not_the_printed_one(paper, solve):
    estimates = solve(paper)
    np.testing.assert_allclose(estimates, [2775.71, 13033.2, -4553.94, 557.27], rtol=3e-6)
    assert paper.J(estimates) == pytest.approx(0.5150, abs=5e-5)
    assert paper.J(np.array([2550.0, 92418.0, -26096.0, 2015.0])) == pytest.approx(4.464, abs=5e-4)


def test_condition_numbers_of_the_normal_equations(paper):
    assert np.linalg.cond(paper.inner_products) == pytest.approx(3.30e6, rel=2e-3)
    assert scaled_condition(paper.design) ** 2 == pytest.approx(2.30e4, rel=2e-3)


def test_speed_polynomial_of_table_1(table_1):
    # papers.md 1.3: degree 2 with the true mean .0142
    fit = fit_mean_speed(table_1)
    np.testing.assert_allclose(fit.polynomial.coef, [-0.004727, 0.0041622, -0.00001382], rtol=2e-4)


@pytest.mark.parametrize(
    ("degree", "expected"),
    [
        (2, [-0.004501, 0.0041494, -0.00001365]),
        (3, [-0.002269, 0.003440, 0.00002355, -0.000000496]),
    ],
)
def test_speed_polynomials_of_the_printed_means(degree, expected):
    means = np.array([0, 0.0148, 0.0282, 0.0536, 0.074, 0.095, 0.11, 0.1224, 0.1408, 0.1524, 0.169])
    tows = Tows(Path("means.csv"), ("speed_1_mps",), TIMES_S, means[:, None])
    np.testing.assert_allclose(fit_mean_speed(tows, degree).polynomial.coef, expected, rtol=5e-4)


def test_mass_of_the_mean_tow_and_of_each_tow(table_1):
    # papers.md 1.7, four parameters, all over 50 s
    def mass(tows):
        return solve_by_qr(discretise(fit_mean_speed(tows).polynomial, TIMES_S, TERMS, FORCE_N))[0]

    assert mass(table_1) == pytest.approx(2857, abs=0.5)
    for number, expected in enumerate([3063, 3124, 2742, 2687, 2816]):
        read = ~np.isnan(table_1.speed_mps[:, number])
        one = replace(table_1, time_s=table_1.time_s[read], speed_mps=table_1.speed_mps[read][:, [number]])
        assert mass(one) == pytest.approx(expected, abs=0.6)


@pytest.mark.parametrize("solve", [solve_normal_equations, solve_by_qr])
def test_the_truth_comes_back_from_a_tow_in_closed_form(solve):
    mass, b3, force = 3000.0, 150.0, 11.63
    top, time_constant = np.sqrt(force / b3), mass / np.sqrt(force * b3)
    times = np.linspace(0, 80, 81)
    tows = Tows(Path("exact.csv"), ("speed_1_mps",), times, (top * np.tanh(times / time_constant))[:, None])
    speed = fit_mean_speed(tows, 9).polynomial
    np.testing.assert_allclose(solve(discretise(speed, times, ("B3",), force)), [mass, b3], rtol=1e-5)


@pytest.mark.parametrize(
    ("terms", "force", "mass_kg"),
    [
        ((), FORCE_N, None),
        (("B3",), FORCE_N, None),
        (("B2", "B3"), FORCE_N, None),
        (TERMS, FORCE_N, None),
        (("B3",), VARYING, 2800.0),
        (("B2", "B3"), VARYING, 2800.0),
    ],
)
def test_covariance_is_that_of_disturbed_readings(table_1, terms, force, mass_kg):
    def problem_of(fit):
        return discretise(fit.polynomial, table_1.time_s, terms, force, mass_kg=mass_kg)

    def estimates(speeds):
        return solve_by_qr(problem_of(fit_mean_speed(replace(table_1, speed_mps=speeds))))

    columns = []
    for place in zip(*np.nonzero(~np.isnan(table_1.speed_mps[1:])), strict=True):
        change = np.zeros_like(table_1.speed_mps)
        change[place[0] + 1, place[1]] = 1e-6
        columns.append((estimates(table_1.speed_mps + change) - estimates(table_1.speed_mps - change)) / 2e-6)
    assert len(columns) == 48
    fit = fit_mean_speed(table_1)
    sensitivity = np.column_stack(columns)
    problem = problem_of(fit)
    found = covariance(problem, solve_by_qr(problem), fit)
    expected = fit.scatter_mps**2 * sensitivity @ sensitivity.T
    estimated = slice(0 if mass_kg is None else 1, None)
    scale = np.sqrt(np.diag(expected))[estimated]
    inner = (estimated, estimated)
    np.testing.assert_allclose(
        found[inner] / np.outer(scale, scale), expected[inner] / np.outer(scale, scale), atol=1e-5
    )
    if mass_kg is not None:
        assert not found[0].any() and not found[:, 0].any()


def test_scatter_is_that_of_the_readings():
    rng = np.random.default_rng(7)
    times = np.linspace(0, 50, 101)
    speeds = PAPER_SPEED(times)[:, None] + 0.006 * rng.standard_normal((101, 20))
    tows = Tows(Path("noisy.csv"), tuple(f"speed_{k}_mps" for k in range(1, 21)), times, speeds)
    assert fit_mean_speed(tows).scatter_mps == pytest.approx(0.006, rel=0.05)


def test_too_few_readings_for_the_polynomial_are_refused():
    tows = Tows(Path("few.csv"), ("speed_1_mps",), np.arange(4.0), np.arange(4.0)[:, None])
    with pytest.raises(
        InputError, match=r"few\.csv: 3 readings after the release do not test a polynomial of degree 2"
    ):
        fit_mean_speed(tows)
