"""Stability and turning of a craft with two thrusters, against the equations written out and the simulation."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.stats import norm

import tank2sim as t2s
from tank2sim.analysis.stability.craft import CraftMotions, craft_stability, keeps_nearly_straight
from tank2sim.cards import parse_card
from tank2sim.errors import InputError
from tank2sim.results.stability import CraftStabilityResult
from tests.cards.made_craft import craft_card

DERIVATIVES = {"Xudot": -5.0, "Yvdot": -40.0, "Nrdot": -10.0, "Xu": -30.0, "Xuabsu": -20.0, "Yv": -60.0, "Nr": -20.0}
DERIVATIVES |= {"Nv": -2.0}
THRUSTER = {"ahead_Ns2": 0.01, "astern_Ns2": 0.006, "max_radps": 100.0, "time_constant_s": 0.3}


@pytest.fixture(scope="module")
def made_up():
    return craft_card(80.0, 16.0, DERIVATIVES, **THRUSTER)


def test_surge_and_steering_are_those_of_the_equations_written_out(made_up):
    run = craft_stability(made_up).straight_run
    n = math.sqrt(50 / 2 / 0.01)  # 30 u + 20 u|u| of both thrusters
    assert run.revolutions_rpm == pytest.approx(n * 30 / math.pi)
    assert run.surge_time_constant_s == pytest.approx(85 / (30 + 2 * 20 * 1.0))
    # (m - Yvdot) v' = Yv v - (m - Xudot) u r,  (I - Nrdot) r' = (Nv + (Yvdot - Xudot) u) v + Nr r + N  at u = 1 m/s
    A = np.array([[-60 / 120, -85 / 120], [(-2 + (-40 + 5)) / 26, -20 / 26]])
    assert sorted(mode.real for mode in run.steering_modes) == pytest.approx(sorted(np.linalg.eigvals(A).real))
    b = np.array([0.0, 2 * 0.01 * n * 0.4 / 26])  # of d/2 more at port and less at starboard
    assert pytest.approx(-np.linalg.solve(A, b)[1]) == run.K
    zero = -A[0, 0]  # of r/d, where sway answers
    assert run.T3_s == pytest.approx(1 / zero)
    assert run.T_s == pytest.approx(-np.trace(A) / np.linalg.det(A) - 1 / zero)


def test_a_steady_turn_is_that_to_which_the_simulation_comes():
    otter = t2s.load("otter")
    turn = craft_stability(otter.card).difference_turns[3]
    found = otter.simulate(f"difference:{turn.difference_rpm}", duration_s=60).figures
    assert found["steady_rate_degps"] == pytest.approx(turn.yaw_rate_degps, rel=1e-3)
    assert found["steady_diameter_m"] == pytest.approx(turn.diameter_m, rel=1e-3)
    assert found["steady_drift_deg"] == pytest.approx(turn.drift_deg, rel=1e-3)


def test_a_craft_unstable_on_a_straight_course_turns_without_a_difference():
    study = craft_stability(t2s.load("otter").card)
    assert not study.straight_run.stable
    assert study.difference_turns[0].difference_rpm == 0.0
    assert study.difference_turns[0].yaw_rate_degps > 0
    assert craft_stability(t2s.load("otter").card, 0.7).straight_run.stable


@pytest.mark.parametrize(("lengths", "nearly_straight"), [(30.0, False), (1.2e4, True)])
def test_a_loop_of_thousands_of_lengths_is_nearly_straight(lengths, nearly_straight):
    otter = t2s.load("otter")
    study = craft_stability(otter.card)
    alone = replace(study.difference_turns[0], diameter_m=lengths * otter.card.ship.length_m)
    assert keeps_nearly_straight(study.straight_run, [alone], study.length_m) is nearly_straight
    found = CraftStabilityResult(replace(study, difference_turns=(alone, *study.difference_turns[1:])))
    assert not found.stable
    assert ("by itself" in " ".join(found.headline)) is not nearly_straight


def test_thrusters_that_can_turn_are_held_ahead():
    fixed = t2s.load("otter").card
    side, turning = "y_m = 0.395", "y_m = 0.395\nmax_azimuth_deg = 30.0\nazimuth_time_constant_s = 0.5"
    free = parse_card(fixed.text.replace(side, turning), "free.toml").steered()
    assert free.thrusters != fixed.thrusters
    found, expected = craft_stability(free), craft_stability(fixed)
    assert found.straight_run.eigenvalues == pytest.approx(expected.straight_run.eigenvalues, rel=1e-6)
    assert len(found.straight_run.eigenvalues) == 3
    assert found.difference_turns[-1].diameter_m == pytest.approx(expected.difference_turns[-1].diameter_m, rel=1e-6)


def test_a_speed_beyond_the_thrusters_is_refused(made_up):
    with pytest.raises(InputError, match="not a speed ahead"):
        craft_stability(made_up, 5.0)


def test_thrusters_at_one_side_are_refused(made_up):
    card = craft_card(80.0, 16.0, DERIVATIVES, sides_m=(-0.4, -0.4), **THRUSTER)
    with pytest.raises(InputError, match="both sides"):
        craft_stability(card)


def test_bands_lie_about_the_figures_of_the_card(made_up):
    ship = t2s.Ship(made_up)
    found = ship.stability(members=8, seed=2)
    run, bands = found.study.straight_run, found.study.ensemble.figures
    assert bands["surge_time_constant_s"].p5 < run.surge_time_constant_s < bands["surge_time_constant_s"].p95
    assert bands["highest_speed_mps"].p50 == pytest.approx(found.study.highest_speed_mps, rel=0.02)
    assert found.study.ensemble.probability_stable == float(found.stable) and len(found.members) == 8


@pytest.mark.slow
def test_the_probability_of_stability_is_that_of_a_normal_number_below_its_limit(made_up):
    """Only Nv is uncertain, by 5 kg m/s. A mode begins to grow at an Nv found by
    bisection; the mean is one standard error on its stable side."""
    craft = CraftMotions(made_up)

    def growth(Nv: float) -> float:
        return max(mode.real for mode in craft.drawn({"derivatives.Nv": Nv}).straight(1.0).steering_modes)

    limit = brentq(growth, -100.0, 100.0)
    stable_side = math.copysign(1.0, growth(limit - 1.0))
    changes = {"derivatives.Nv": limit + 5.0 * stable_side, "uncertainty.Nv": 5.0}
    exact = {f"uncertainty.{name}": 0.0 for name in made_up.derivatives if name != "Nv"}
    thrusts = {f"thrusters.{n}.uncertainty.{key}": 0.0 for n in (0, 1) for key in ("ahead_Ns2", "astern_Ns2")}
    ship = t2s.Ship(made_up).replace({**exact, **thrusts, **changes})
    ensemble = ship.stability(1.0, members=200).study.ensemble
    assert ensemble.probability_stable == pytest.approx(norm.cdf(1.0), abs=3 * math.sqrt(0.84 * 0.16 / 200))
