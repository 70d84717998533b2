"""Steering gears, steering models and the loop of an autopilot, against their equations and other integrators."""

from __future__ import annotations

import math

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tank2sim.analysis.heading.designs import design_heading
from tank2sim.cards import read_card
from tank2sim.cards.form import SteeringGear
from tank2sim.dynamics import build
from tank2sim.dynamics.autopilot_loop import closed_loop_model, ship_steered_by_either
from tank2sim.dynamics.steering_gear import steering_gear
from tank2sim.dynamics.steering_models import STEERING_FORMS, steering_model
from tank2sim.simulation.manoeuvres import Turn
from tank2sim.simulation.run import simulate

BETA, R, DELTA = 0.3, 0.4, 0.35
C = {
    "C_y_b": 1.0,
    "C_y_w": 2.0,
    "C_y_bb": 3.0,
    "C_y_d": 5.0,
    "C_m_b": 7.0,
    "C_m_w": 11.0,
    "C_m_bbw": 13.0,
    "C_m_d": 17.0,
}


def _rates(name: str, values: dict[str, float], beta: float, r: float, delta: float) -> tuple[float, float]:
    found = STEERING_FORMS[name].rates({k: ca.SX(v) for k, v in values.items()}, ca.SX(beta), ca.SX(r), ca.SX(delta))
    return float(found[0]), float(found[1])


@pytest.mark.parametrize("name", ["base", "pavlenko", "sobolev"])
def test_equation_1_is_that_of_the_paper(name: str) -> None:
    """Signs of (1): -(C_y^b beta + C_y^bb beta |beta|) + C_y^w r + C_y^d delta, and its second line."""
    values = {**C, "C_m_ww": 0.0, "C_m_wwb": 0.0}
    sway, yaw = _rates(name, values, BETA, R, DELTA)
    assert sway == pytest.approx(-(1 * 0.3 + 3 * 0.09) + 2 * 0.4 + 5 * 0.35)
    assert yaw == pytest.approx(-(11 + 13 * 0.09) * 0.4 + 7 * 0.3 + 17 * 0.35)


@pytest.mark.parametrize("name", list(STEERING_FORMS))
def test_a_model_turns_alike_to_both_sides(name: str) -> None:
    values = {one.name: 0.5 + 0.1 * n for n, one in enumerate(STEERING_FORMS[name].coefficients)}
    here, there = _rates(name, values, BETA, R, DELTA), _rates(name, values, -BETA, -R, -DELTA)
    assert here == pytest.approx([-one for one in there])


@pytest.mark.parametrize("name", list(STEERING_FORMS))
def test_every_coefficient_of_a_form_acts(name: str) -> None:
    form = STEERING_FORMS[name]
    values = {one.name: 0.5 + 0.1 * n for n, one in enumerate(form.coefficients)}
    base = _rates(name, values, BETA, R, DELTA)
    for one in form.coefficients:
        assert _rates(name, {**values, one.name: 7.0}, BETA, R, DELTA) != pytest.approx(base), one.name
    assert set(form.rudder) | set(form.static_moment) | set(form.damping) <= {one.name for one in form.coefficients}


def test_the_transient_is_that_of_an_independent_integrator() -> None:
    """beta' = Y v/L, omega' = N (v/L)^2 by scipy, beta and heading after 200 s of 20 deg."""
    length, speed, rudder = 150.0, 7.5, math.radians(20)
    values = {"C_y_b": 0.42, "C_y_w": 0.33, "C_y_bb": 0.5, "C_y_d": 0.16}
    values |= {"C_m_b": 3.2, "C_m_w": 2.8, "C_m_bbw": 7.5, "C_m_d": 1.6}
    per = speed / length

    def rates(_: float, state: np.ndarray) -> list[float]:
        beta, omega, psi, _x, _y = state
        r = omega / per
        sway = -0.42 * beta - 0.5 * beta * abs(beta) + 0.33 * r + 0.16 * rudder
        yaw = 3.2 * beta - (2.8 + 7.5 * beta**2) * r + 1.6 * rudder
        course = psi - beta  # the bow points into the turn
        return [sway * per, yaw * per**2, omega, speed * math.cos(course), speed * math.sin(course)]

    truth = solve_ivp(rates, (0, 200), [0.0] * 5, rtol=1e-10, atol=1e-12).y[:, -1]
    run = simulate(
        steering_model("made up", STEERING_FORMS["base"], values, length, speed),
        Turn(rudder),
        duration_s=200,
        parameters={"initial.rudder_angle": rudder},
    ).trajectory
    for name, value in zip(("motion.beta", "motion.r", "motion.psi"), truth, strict=False):
        assert run[name][-1] == pytest.approx(value, rel=1e-6), name
    assert (run["motion.x"][-1], run["motion.y"][-1]) == pytest.approx(tuple(truth[3:]), abs=0.01)
    assert run["motion.v"][-1] < 0 < run["motion.r"][-1]


def test_a_coefficient_that_is_missing_or_unknown_is_named() -> None:
    with pytest.raises(ValueError, match="C_m_d"):
        steering_model("ship", STEERING_FORMS["base"], {k: v for k, v in C.items() if k != "C_m_d"}, 100, 5)
    with pytest.raises(ValueError, match="C_q"):
        steering_model("ship", STEERING_FORMS["base"], {**C, "C_q": 1.0}, 100, 5)


def test_the_catalogue_says_what_is_not_published() -> None:
    assert set(STEERING_FORMS) == {"base", "inoue-hirano", "pavlenko", "sobolev"}
    assert all(form.missing and form.source for form in STEERING_FORMS.values())
    assert any("Table" in words for words in STEERING_FORMS["base"].missing)
    assert any("curve 3" in words for words in STEERING_FORMS["inoue-hirano"].missing)


@pytest.mark.parametrize("side", [1, -1])
def test_the_japanese_equations_are_those_of_their_term_list(side: int) -> None:
    """Signs of the list of coefficients: -h beta, r, -h beta |beta|, -h beta |r|, r |r| in Y, and so on."""
    form = STEERING_FORMS["inoue-hirano"]
    printed = (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 0.5, 0.8)
    c = {one.name: value for one, value in zip(form.coefficients, printed, strict=True)}
    b, r, d, h = side * BETA, side * R, side * DELTA, 0.8
    inflow = -41 * b - 43 * r
    sway = -2 * h * b + 3 * r - 5 * h * b * abs(b) - 7 * h * b * abs(r) + 11 * r * abs(r) + 13 * d + inflow
    yaw = 17 * h * b - 19 * r - 23 * r * abs(r) - 29 * h * b * r**2 - 31 * h * b**2 * r + 37 * d + 0.5 * inflow
    assert _rates("inoue-hirano", c, b, r, d) == pytest.approx((sway, yaw))


def variables(gear: SteeringGear | None) -> dict:
    return {variable.name: variable for variable in steering_gear(gear, 20.0)[0]}


@pytest.mark.parametrize("gear", [None, SteeringGear(), SteeringGear(max_rate_radps=0.04)])
def test_a_gear_without_a_largest_angle_takes_orders_to_ninety_degrees_either_way(gear) -> None:
    found = variables(gear)
    order = found["rudder.command"]
    assert (math.degrees(order.minimum), math.degrees(order.maximum)) == pytest.approx((-90, 90))
    assert "steering.max_angle" not in found


def test_orders_are_bounded_by_the_largest_angle_of_the_gear_and_accepted_to_ninety_degrees() -> None:
    found = variables(SteeringGear(max_angle_rad=math.radians(35)))
    order = found["rudder.command"]
    assert (math.degrees(order.minimum), math.degrees(order.maximum)) == pytest.approx((-35, 35))
    assert math.degrees(order.accepted) == pytest.approx(90)
    assert math.degrees(found["steering.max_angle"].start) == pytest.approx(35)


def test_a_gear_without_a_lag_takes_a_hundredth_of_the_time_of_a_length() -> None:
    assert variables(None)["steering.time_constant"].start == pytest.approx(0.2)
    assert variables(SteeringGear(time_constant_s=2.5))["steering.time_constant"].start == 2.5
    assert len(steering_gear(None, 20.0)[1]) == 1 and not steering_gear(SteeringGear(time_constant_s=2.5), 20.0)[1]


def rates(model, states, inputs):
    """Rates by name of state, of a model at these states and inputs; all else as it starts."""
    x = [states.get(state.name, 0.0) for state in model.states]
    u = [inputs.get(variable.name, float(variable.start)) for variable in model.inputs]
    names = [state.name for state in model.states]
    return dict(zip(names, np.array(model.rhs(x, u, model.parameter_values())).ravel(), strict=True))


def test_the_rudder_goes_to_the_order_of_whoever_steers():
    ship = build(read_card("mariner"))
    autopilot = design_heading(ship).autopilot
    either = ship_steered_by_either(ship, autopilot)
    states = {"motion.u": 7.5, "motion.v": 0.1, "motion.r": 0.002, "motion.psi": 0.3, "rudder.angle": 0.05}
    states["autopilot.integral"] = 0.02
    orders = {"rudder.command": -0.1, "heading.command": 0.4}
    helm = rates(either, states, {**orders, "autopilot.steers": 0.0})
    alone = rates(ship, states, orders)
    assert {name: helm[name] for name in alone} == pytest.approx(alone, rel=1e-12)
    time = dict(zip(either.parameter_names, either.parameter_values(), strict=True))["autopilot.anti_windup_time"]
    assert helm["autopilot.integral"] == pytest.approx(-0.02 / time)
    on = rates(either, states, {**orders, "autopilot.steers": 1.0})
    assert on == pytest.approx(rates(closed_loop_model(ship, autopilot), states, orders), rel=1e-12)
    assert on["rudder.angle"] > 0 > helm["rudder.angle"]


def test_a_trimmed_start_is_that_of_the_ship_alone():
    ship = build(read_card("kvlcc2"))
    either = ship_steered_by_either(ship, design_heading(ship).autopilot)
    assert either.trim_step is not None
    assert [state.name for state in either.states][: len(ship.states)] == [state.name for state in ship.states]
