"""The paper's method, by constant and varying forces: polynomial, inner products, solution; the truth comes back."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial import Polynomial
from printed_tows import FORCE_N, FORCE_PRODUCTS, INNER_PRODUCTS
from scipy.integrate import solve_ivp
from scipy.optimize import minimize_scalar

from tank2sim.apps.rigs.tow.equation_error import (
    covariance,
    discretise,
    fit_mean_speed,
    simpson_nodes,
    solve_by_qr,
    solve_normal_equations,
)
from tank2sim.apps.rigs.tow.identify import identify_tow, tow_card_text
from tank2sim.apps.rigs.tow.output_error import TowModel, fit_speeds
from tank2sim.apps.rigs.tow.records import force_words, parse_force
from tank2sim.apps.rigs.tow.study import SIMPLE, SIMPLE_LATE
from tank2sim.errors import InputError
from tank2sim.identification.conditioning import scaled_condition
from tests.apps.rigs.tow.made_tows import tows_of

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
    tows = tows_of(TIMES_S, means)
    np.testing.assert_allclose(fit_mean_speed(tows, degree).polynomial.coef, expected, rtol=5e-4)


def test_mass_of_the_mean_tow_and_of_each_tow(table_1):
    # papers.md 1.7, four parameters, all over 50 s
    def mass(tows):
        return solve_by_qr(discretise(fit_mean_speed(tows).polynomial, TIMES_S, TERMS, FORCE_N))[0]

    assert mass(table_1) == pytest.approx(2857, abs=0.5)
    for number, expected in enumerate([3063, 3124, 2742, 2687, 2816]):
        assert mass(table_1.only(number)) == pytest.approx(expected, abs=0.6)


@pytest.mark.parametrize("solve", [solve_normal_equations, solve_by_qr])
def test_the_truth_comes_back_from_a_tow_in_closed_form(solve):
    mass, b3, force = 3000.0, 150.0, 11.63
    top, time_constant = np.sqrt(force / b3), mass / np.sqrt(force * b3)
    times = np.linspace(0, 80, 81)
    tows = tows_of(times, top * np.tanh(times / time_constant))
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
    tows = tows_of(times, speeds)
    assert fit_mean_speed(tows).scatter_mps == pytest.approx(0.006, rel=0.05)


def test_too_few_readings_for_the_polynomial_are_refused():
    tows = tows_of(np.arange(4.0), np.arange(4.0), "few.csv")
    with pytest.raises(
        InputError, match=r"few\.csv: 3 readings after the release do not test a polynomial of degree 2"
    ):
        fit_mean_speed(tows)


def exact(force, *, mass=3000.0, b3=150.0, delay=0.0, end=60.0):
    times = np.linspace(0, end, 31)
    found = solve_ivp(
        lambda t, v: (force(t) - b3 * v * abs(v)) / mass, (delay, end), [0.0], rtol=1e-11, atol=1e-13, dense_output=True
    )
    speed = np.where(times > delay, found.sol(np.maximum(times, delay))[0], 0.0)
    return tows_of(times, speed)


@pytest.mark.parametrize("force", [Polynomial([11.63]), VARYING])
def test_output_error_finds_mass_drag_and_start(force):
    fit = fit_speeds(exact(force, delay=3.3), force, SIMPLE_LATE)
    np.testing.assert_allclose(fit.estimates, [3000, 150, 3.3], rtol=2e-6)


def test_both_methods_know_a_force_that_varies():
    tows = exact(VARYING)
    result = identify_tow(tows, VARYING, 2243.0, model=SIMPLE, speed_degree=9)
    for name in ("paper", "qr", "output_error"):
        np.testing.assert_allclose(result.methods[name].values, [3000, 150], rtol=2e-5)
    assert result.force_N == pytest.approx(12 + 0.1 * 30 - 0.0015 * 1200)  # the mean over 60 s
    assert result.force_polynomial == (12.0, 0.1, -0.0015)
    # the mean alone is another force
    assert abs(identify_tow(tows, result.force_N, 2243.0, model=SIMPLE).methods["output_error"].values[1] - 150) > 15


@settings(max_examples=8, deadline=None)
@given(pull=st.floats(0.2, 5), pace=st.floats(0.2, 5))
def test_estimates_scale_with_force_speed_and_not_with_the_delay(table_1, pull, pace):
    one = fit_speeds(table_1, 11.63, SIMPLE_LATE).estimates
    other = fit_speeds(replace(table_1, speed_mps=pace * table_1.speed_mps), 11.63 * pull, SIMPLE_LATE).estimates
    np.testing.assert_allclose(other, [one[0] * pull / pace, one[1] * pull / pace**2, one[2]], rtol=1e-5)


def test_a_delay_explains_table_1_and_is_in_the_result(table_1):
    result = identify_tow(table_1, model=SIMPLE_LATE)
    fit = result.methods["output_error"]
    assert fit.unknowns == fit.estimated == ("M", "B3", "delay")
    np.testing.assert_allclose(fit.values, [2772, 185, 2.1], rtol=0.02)
    assert fit.estimates["start_delay_s"] == fit.start_delay_s == fit.values[2]
    assert "start_delay_s" not in result.methods["qr"].estimates
    assert not any("a late start" in warning for warning in result.notices)
    text = tow_card_text(result, fit, name="late", source="test")
    assert "delay" not in text.split("[surge]")[1].split("[")[0] and "total_mass_kg = 2772" in text


def test_a_known_mass_leaves_the_drag(table_1):
    result = identify_tow(table_1, model=TowModel(("B3",), total_mass_kg=2800.0))
    read = ~np.isnan(table_1.speed_mps) & (table_1.time_s > 0)[:, None]

    def squares(b3):
        speed = np.sqrt(11.63 / b3) * np.tanh(table_1.time_s * np.sqrt(11.63 * b3) / 2800)
        return np.sum((table_1.speed_mps - speed[:, None])[read] ** 2)

    best = minimize_scalar(squares, bounds=(50, 500), method="bounded", options={"xatol": 1e-6}).x
    fit = result.methods["output_error"]
    assert fit.values == pytest.approx([2800, best], rel=1e-5)
    assert fit.estimated == ("B3",) and fit.condition_scaled == 1 and "total_mass_kg" in fit.standard_errors
    assert fit.errors[0] == 0 < fit.errors[1]
    problem = discretise(fit_mean_speed(table_1).polynomial, table_1.time_s, ("B3",), 11.63)
    root = np.sqrt(problem.weights)
    drag = root * problem.basis[:, 1]
    expected = drag @ (root * (11.63 - 2800 * problem.basis[:, 0])) / (drag @ drag)
    for name in ("paper", "qr"):
        assert result.methods[name].values == pytest.approx([2800, expected])


def test_force_from_text():
    assert parse_force("11.6, 0.02,-1e-4").coef.tolist() == [11.6, 0.02, -1e-4]
    assert force_words(parse_force("11.6,0.02,-1e-4")) == "T = 11.6 + 0.02 t - 0.0001 t^2 N"
    assert force_words(Polynomial([11.63])) == "T = 11.63 N"


@pytest.mark.parametrize("text", ["", "fast", "1,,2", "inf"])
def test_what_is_no_polynomial_is_refused(text):
    with pytest.raises(InputError, match=r"force_N: .* is not a polynomial; give numbers"):
        parse_force(text)


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"force": Polynomial([11.63, -1.0])}, r"force_N: is -38\.37 N at 50 s, and must pull forward"),
        ({"force": Polynomial([0.0])}, "force_N: is 0 N"),
        ({"model": TowModel((), total_mass_kg=2800.0)}, "total_mass_kg: leaves nothing to estimate"),
        ({"force": 0.0}, "force_N: is 0 N"),
    ],
)
def test_faulty_assumptions_are_refused(table_1, asked, said):
    with pytest.raises(InputError, match=said):
        identify_tow(table_1, **asked)
