"""The steady-turning diagram: closed forms, symmetry, long simulated turns, folds, and ships that run away."""

from __future__ import annotations

import math
import time

import numpy as np
import pytest

from tank2sim.analysis.stability.straight_line import stability
from tank2sim.analysis.turning.continuation import EDGE, OUTSIDE, Bounds, follow_branch
from tank2sim.analysis.turning.diagram import CurveEnds, TurningEquations, hull_states, steady_turning
from tank2sim.cards import parse_card, read_card
from tank2sim.dynamics import build
from tank2sim.errors import InputError
from tank2sim.simulation.manoeuvres import Turn
from tank2sim.simulation.run import simulate
from tests.analysis.turning.cubic_ship import STABLE, UNSTABLE, cubic_ship, fold, rudder_rad


def test_a_curve_is_followed_all_the_way_round_a_circle() -> None:
    def circle(y):
        return np.array([y @ y - 1.0]), 2 * y[None, :]

    found = follow_branch(
        circle, np.array([1.0, 0.0]), np.array([0.0, 1.0]), Bounds(np.full(2, -2.0), np.full(2, 2.0), 300)
    )
    angle = np.unwrap(np.arctan2(found.points[:, 1], found.points[:, 0]))
    np.testing.assert_allclose(np.linalg.norm(found.points, axis=1), 1.0, atol=1e-10)
    assert np.all(np.diff(angle) > 0) and angle[-1] > 2 * np.pi


def test_a_curve_ends_on_the_limit_of_lambda_and_within_its_bounds() -> None:
    def line(y):
        return np.array([y[0] - 3 * y[1]]), np.array([[1.0, -3.0]])

    on_edge = follow_branch(line, np.zeros(2), np.ones(2), Bounds(np.full(2, -2.0), np.array([9.0, 0.5])))
    assert on_edge.ended == EDGE and on_edge.points[-1] == pytest.approx([1.5, 0.5], abs=1e-12)
    outside = follow_branch(line, np.zeros(2), np.ones(2), Bounds(np.full(2, -2.0), np.array([0.9, 0.5])))
    assert outside.ended == OUTSIDE and np.all(outside.points[:, 0] <= 0.9)


def test_a_linear_ship_turns_as_cramers_rule_says() -> None:
    """r/delta = (N_v Y_d - Y_v N_d)/(Y_v N_r - N_v Y_r) U/L of the printed numbers (rudder positive to port)."""
    found = steady_turning(build(read_card("mariner", {"model.kind": "linear"})))
    Yv, Yr, Yd, Nv, Nr, Nd = -1160e-5, -499e-5, -278e-5, -264e-5, -166e-5, 139e-5
    gain = (Nv * Yd - Yv * Nd) / (Yv * Nr - Nv * Yr) * 7.7175 / 160.93
    np.testing.assert_allclose(found.yaw_rate_radps, gain * found.rudder_rad, atol=1e-12)
    assert found.stable.all() and not found.folds and found.loop is None
    assert np.degrees(found.rudder_rad[[0, -1]]) == pytest.approx([-35.0, 35.0])


def test_the_folds_of_a_cubic_ship_are_where_they_are_in_closed_form() -> None:
    found = steady_turning(cubic_ship(UNSTABLE))
    rudder, rate = fold(UNSTABLE)
    assert rudder < 0 < rate  # to starboard she goes on turning against a little port rudder
    assert [one.yaw_rate_radps for one in found.folds] == pytest.approx([-rate, rate], rel=1e-9)
    assert [one.rudder_rad for one in found.folds] == pytest.approx([-rudder, rudder], rel=1e-9)
    assert found.loop is not None and found.loop.width_deg == pytest.approx(math.degrees(2 * abs(rudder)), rel=1e-9)
    height = math.degrees(2 * math.sqrt(3) * rate)  # r'^2 = -N_r/N_rrr at no rudder
    assert found.loop.height_degps == pytest.approx(height, rel=1e-5)


@pytest.mark.parametrize("N_r", [STABLE, UNSTABLE])
def test_every_point_of_a_cubic_ship_lies_on_her_characteristic(N_r: float) -> None:
    found = steady_turning(cubic_ship(N_r))
    expected = [rudder_rad(N_r, rate) for rate in found.yaw_rate_radps]
    np.testing.assert_allclose(found.rudder_rad, expected, atol=1e-10)
    np.testing.assert_allclose(found.speed_mps * np.cos(found.drift_rad), 7.7175, rtol=1e-10)


def test_the_turns_of_a_cubic_ship_are_unstable_between_her_folds_and_stable_elsewhere() -> None:
    found = steady_turning(cubic_ship(UNSTABLE))
    _, rate = fold(UNSTABLE)
    inside = np.abs(found.yaw_rate_radps) < rate * (1 - 1e-9)
    assert not found.stable[inside].any()
    assert found.stable[np.abs(found.yaw_rate_radps) > rate * (1 + 1e-9)].all()
    assert [stable for _, stable in found.turns_at(0.0)] == [True, False, True]


def test_a_long_simulated_turn_ends_on_the_diagram(mariner) -> None:
    found = steady_turning(mariner)
    for degrees in (20.0, -7.0):
        ((rate, stable),) = found.turns_at(math.radians(degrees))
        run = simulate(mariner, Turn(math.radians(degrees)), duration_s=2500.0).trajectory
        assert stable and run["motion.r"][-1] == pytest.approx(rate, rel=1e-4)


def test_speed_and_drift_of_a_hard_turn_are_those_of_a_simulated_one(mariner) -> None:
    found = steady_turning(mariner)
    run = simulate(mariner, Turn(math.radians(35.0)), duration_s=2500.0).trajectory
    assert run["motion.speed"][-1] == pytest.approx(found.speed_mps[-1], rel=1e-4)
    assert run["motion.beta"][-1] == pytest.approx(found.drift_rad[-1], rel=1e-4)


def test_turns_between_the_points_solve_the_equations(mariner) -> None:
    found, equations = steady_turning(mariner), TurningEquations(mariner)
    rates = [found.turns_at(rudder)[0][0] for rudder in np.radians([-31.0, -1.7, 0.3, 12.4])]
    for rudder, rate in zip(np.radians([-31.0, -1.7, 0.3, 12.4]), rates, strict=True):
        row = int(np.argmin(np.abs(found.rudder_rad - rudder)))
        u, v = found.speed_mps[row] * np.array([np.cos(found.drift_rad[row]), -np.sin(found.drift_rad[row])])
        y = np.array([u, v, rate, rudder]) / equations.scale
        for _ in range(20):
            residual, jacobian = equations(y)
            y[:3] -= np.linalg.solve(jacobian[:, :3], residual)
        assert y[2] * equations.scale[2] == pytest.approx(rate, rel=1e-4)


def test_the_diagram_takes_less_than_a_second_of_the_processor() -> None:
    model = build(read_card("kvlcc2-captive"))
    begin = time.process_time()
    steady_turning(model)
    assert time.process_time() - begin < 1.0


def test_a_symmetric_ship_turns_alike_to_both_sides() -> None:
    found = steady_turning(build(read_card("esso-osaka-estimated")))
    assert found.loop is not None and found.folds[0].rudder_rad == pytest.approx(-found.folds[1].rudder_rad)
    for rudder in np.radians([1.0, 10.0, 30.0]):
        port = sorted(-rate for rate, _ in found.turns_at(-rudder))
        assert port == pytest.approx(sorted(rate for rate, _ in found.turns_at(rudder)), rel=1e-6)


@pytest.mark.slow
def test_the_straight_course_of_the_diagram_is_stable_where_the_criterion_says_so(mariner) -> None:
    for model in (mariner, build(read_card("kvlcc2-captive"))):
        found = steady_turning(model)
        assert bool(found.stable[found.straight]) == stability(model).stability_criterion.stable
        assert abs(found.yaw_rate_radps[found.straight]) < 1e-12


def test_the_heel_of_a_steady_turn_is_that_of_its_centrifugal_force() -> None:
    effect = "\n[[effects]]\nname = 'roll_coupling'\n[effects.parameters]\nYphi = 1e-4\nNphi = -5e-5\n"
    card = parse_card(read_card("mariner").text + effect + "roll_period_s = 12.0\n", "roll.toml")
    model = build(card)
    found = steady_turning(model)
    assert "motion.phi" in hull_states(model) and found.heel_rad is not None
    values = dict(zip(model.parameter_names, model.parameter_values(), strict=True))
    ratio = next(value for name, value in values.items() if name.endswith("heel_ratio"))
    u = found.speed_mps * np.cos(found.drift_rad)
    np.testing.assert_allclose(found.heel_rad, -ratio * u * found.yaw_rate_radps / 9.80665, rtol=1e-6, atol=1e-12)


def test_a_ship_without_a_steady_speed_is_reported() -> None:
    with pytest.raises(InputError, match="steady speed"):
        steady_turning(build(read_card("kvlcc2-captive", {"derivatives.X0": 0.05, "derivatives.Xu": 0.02})))


def test_a_polynomial_that_runs_away_ends_the_diagram_with_a_notice() -> None:
    """With X_u > 0 a turn is no end to the speed: the diagram leaves all bounds before 35 deg of rudder."""
    found = steady_turning(build(read_card("mariner", {"derivatives.Xu": 0.002})))
    assert found.ended == CurveEnds(OUTSIDE, OUTSIDE) and sum("runs away" in one for one in found.notices) == 2
    assert np.max(np.abs(found.rudder_rad)) < math.radians(34) and np.isfinite(found.growth_per_s).all()
    assert found.loop is None  # unstable in surge, not in yaw
