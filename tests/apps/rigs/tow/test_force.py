"""Tows by a force that varies, that start late, or of a body whose mass is known: the truth comes back."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial import Polynomial
from scipy.integrate import solve_ivp
from scipy.optimize import minimize_scalar

from tank2sim.apps.rigs.tow.equation_error import discretise, fit_mean_speed
from tank2sim.apps.rigs.tow.identify import identify_tow, tow_card_text
from tank2sim.apps.rigs.tow.output_error import TowOptions, fit_speeds
from tank2sim.apps.rigs.tow.records import Tows, force_words, parse_force
from tank2sim.errors import InputError

LATE = TowOptions(start_delay=True)
VARYING = Polynomial([12.0, 0.1, -0.0015])


def exact(force, *, mass=3000.0, b3=150.0, delay=0.0, end=60.0):
    times = np.linspace(0, end, 31)
    found = solve_ivp(
        lambda t, v: (force(t) - b3 * v * abs(v)) / mass, (delay, end), [0.0], rtol=1e-11, atol=1e-13, dense_output=True
    )
    speed = np.where(times > delay, found.sol(np.maximum(times, delay))[0], 0.0)
    return Tows(Path("exact.csv"), ("speed_1_mps",), times, speed[:, None])


@pytest.mark.parametrize("force", [Polynomial([11.63]), VARYING])
def test_output_error_finds_mass_drag_and_start(force):
    fit = fit_speeds(exact(force, delay=3.3), force, ("B3",), LATE)
    np.testing.assert_allclose(fit.estimates, [3000, 150, 3.3], rtol=2e-6)


def test_both_methods_know_a_force_that_varies():
    tows = exact(VARYING)
    result = identify_tow(tows, VARYING, 2243.0, terms=("B3",), speed_degree=9)
    for name in ("paper", "qr", "output_error"):
        np.testing.assert_allclose(result.methods[name].values, [3000, 150], rtol=2e-5)
    assert result.force_N == pytest.approx(12 + 0.1 * 30 - 0.0015 * 1200)  # the mean over 60 s
    assert result.force_polynomial == (12.0, 0.1, -0.0015)
    # the mean alone is another force
    assert abs(identify_tow(tows, result.force_N, 2243.0, terms=("B3",)).methods["output_error"].values[1] - 150) > 15


@settings(max_examples=8, deadline=None)
@given(pull=st.floats(0.2, 5), pace=st.floats(0.2, 5))
def test_estimates_scale_with_force_speed_and_not_with_the_delay(table_1, pull, pace):
    one = fit_speeds(table_1, 11.63, ("B3",), LATE).estimates
    other = fit_speeds(replace(table_1, speed_mps=pace * table_1.speed_mps), 11.63 * pull, ("B3",), LATE).estimates
    np.testing.assert_allclose(other, [one[0] * pull / pace, one[1] * pull / pace**2, one[2]], rtol=1e-5)


def test_a_delay_explains_table_1_and_is_in_the_result(table_1):
    result = identify_tow(table_1, terms=("B3",), options=LATE)
    fit = result.methods["output_error"]
    assert fit.unknowns == fit.estimated == ("M", "B3", "delay")
    np.testing.assert_allclose(fit.values, [2772, 185, 2.1], rtol=0.02)
    assert fit.estimates["start_delay_s"] == fit.start_delay_s == fit.values[2]
    assert "start_delay_s" not in result.methods["qr"].estimates
    assert not any("a late start" in warning for warning in result.notices)
    text = tow_card_text(result, fit, name="late", source="test")
    assert "delay" not in text.split("[surge]")[1].split("[")[0] and "total_mass_kg = 2772" in text


def test_a_known_mass_leaves_the_drag(table_1):
    result = identify_tow(table_1, terms=("B3",), options=TowOptions(total_mass_kg=2800.0))
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
        ({"terms": (), "options": TowOptions(total_mass_kg=2800.0)}, "--total-mass-kg: leaves nothing to estimate"),
        ({"options": TowOptions(total_mass_kg=-1.0)}, "--total-mass-kg: is -1; a positive number was expected"),
    ],
)
def test_faulty_assumptions_are_refused(table_1, asked, said):
    with pytest.raises(InputError, match=said):
        identify_tow(table_1, **asked)
