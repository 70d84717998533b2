"""The current of trials at sea: estimated with the coefficients, taken out of the estimate, put on the card."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tank2sim.cards import ManoeuvringCard, parse_card
from tank2sim.dynamics import build
from tank2sim.identification.trials.identify import undetermined_notice
from tank2sim.identification.trials.methods.output_error import OutputErrorSettings, output_error
from tank2sim.identification.trials.problem.estimation_problem import driven_by_angle, with_ground_velocities
from tank2sim.identification.trials.problem.sampled_runs import prepare
from tank2sim.identification.trials.problem.water_current import (
    CURRENT_PARAMETERS,
    WaterCurrent,
    at_sea,
    card_in,
    current_alone,
    current_of,
    of_unknown_current,
    with_current,
    without_current,
)
from tank2sim.notices import foremost
from tank2sim.records.trials import Trial

from .made_up_ship import CARD, TRUTH, problem, trial, turn, zigzag

NORTH, EAST = 0.25, -0.35
SEEN = ("motion.r", "motion.psi", "motion.x", "motion.y")
FREE = ("Xu", "Yv", "Nv", "Nr", "Nd")


def drifted(made: Trial) -> Trial:
    """The trial in a current: positions alone move with the water, and nothing shows the velocity through it."""
    signals = {name: values for name, values in made.signals.items() if name not in ("u_mps", "v_mps")}
    signals["x_m"] = signals["x_m"] + NORTH * made.time_s
    signals["y_m"] = signals["y_m"] + EAST * made.time_s
    return replace(made, signals=signals, origin_deg=(54.0, 10.0))


@pytest.fixture(scope="module")
def trials() -> list[Trial]:
    return [drifted(trial(turn(20), name="turn", seed=1)), drifted(trial(zigzag(20), name="zigzag", seed=2))]


@pytest.fixture(scope="module")
def card() -> ManoeuvringCard:
    read = parse_card(CARD, "made_up.toml")
    assert isinstance(read, ManoeuvringCard)
    return read


@pytest.mark.slow
def test_current_and_coefficients_are_found_without_a_speed_through_the_water(trials, card) -> None:
    posed = problem(trials, free=FREE, seen=SEEN)
    truth = np.array([TRUTH[name] for name in FREE])
    settings = OutputErrorSettings(scale_prior=False)
    estimate, current = without_current(output_error(with_current(posed), settings=settings), card)
    assert np.abs(current.velocity - [NORTH, EAST]).max() < 0.02
    assert current.determined and current.standard_error_mps < 0.02
    assert current.direction_rad == pytest.approx(np.arctan2(EAST, NORTH) % (2 * np.pi), abs=0.06)
    assert estimate.free == posed.free
    with_it = np.abs(estimate.values / truth - 1)
    assert with_it.max() < 0.05
    ignored = output_error(posed, settings=settings)
    assert np.abs(ignored.values / truth - 1).max() > 3 * with_it.max(), "the current would bias the coefficients"


def test_elimination_leaves_the_information_of_a_marginal_normal(trials, card) -> None:
    joint = output_error(with_current(problem(trials, free=FREE, seen=SEEN)), settings=OutputErrorSettings(rounds=1))
    estimate, _ = without_current(joint, card)
    prior = np.zeros((len(joint.free), len(joint.free)))
    prior[-2:, -2:] = np.eye(2) / 0.5**2
    marginal = np.linalg.inv(np.linalg.inv(joint.information + prior)[:-2, :-2])
    assert np.allclose(estimate.information, marginal, rtol=1e-6)
    assert joint.free[-2:] == CURRENT_PARAMETERS


@pytest.mark.slow
def test_a_straight_run_does_not_determine_it(card) -> None:
    straight = [drifted(trial(lambda t: 0.0, name="straight", duration=200.0))]
    posed = problem(straight, free=("Xu", "X0"), seen=SEEN)
    _, current = without_current(output_error(with_current(posed), settings=OutputErrorSettings(rounds=2)), card)
    assert not current.determined


def test_the_current_is_beside_that_of_the_card(trials, card) -> None:
    """A card that already holds half of the current needs the other half."""
    half = card_in(card, WaterCurrent(np.array([NORTH, EAST]) / 2, np.eye(2) * 1e-4, 5.0))
    assert np.allclose(current_of(half), np.array([NORTH, EAST]) / 2, atol=1e-4)
    model = driven_by_angle(with_ground_velocities(build(half)))
    posed = problem(trials, free=FREE, seen=SEEN)
    posed = replace(posed, model=model, runs=tuple(prepare(model, one, SEEN) for one in trials))
    truth = replace(posed, prior_mean=np.array([TRUTH[name] for name in FREE]))
    _, current = without_current(output_error(current_alone(truth)), half)
    assert np.abs(current.velocity - [NORTH, EAST]).max() < 0.02


def test_a_card_takes_a_current_once_and_replaces_it(card) -> None:
    first = card_in(card, WaterCurrent(np.array([0.0, 0.4]), np.diag([0.01, 0.04]) ** 2, 5.0))
    second = card_in(first, WaterCurrent(np.array([-0.3, 0.0]), np.diag([0.01, 0.03]) ** 2, 5.0))
    (effect,) = second.effects
    assert effect.parameters["speed_mps"] == pytest.approx(0.3)
    assert effect.parameters["direction_rad"] == pytest.approx(np.pi)
    assert effect.uncertainty["speed_mps"] == pytest.approx(0.01)
    assert effect.uncertainty["direction_rad"] == pytest.approx(0.1, rel=0.01)
    assert np.allclose(current_of(second), [-0.3, 0.0], atol=1e-4)


def test_only_trials_at_sea_without_a_stated_current_have_one_to_estimate(trials, card) -> None:
    basin = [replace(one, origin_deg=None) for one in trials]
    assert at_sea(trials) and not at_sea(basin)
    assert of_unknown_current(card, trials) and not of_unknown_current(card, basin)
    sog = {**basin[0].signals, "sog_mps": np.full(len(basin[0].time_s), 5.0)}
    assert at_sea([replace(basin[0], signals=sog)])
    measured = {**trials[0].signals, "current_speed_mps": np.full(len(trials[0].time_s), 0.4)}
    assert not of_unknown_current(card, [replace(trials[0], signals=measured)])
    assert not of_unknown_current(card_in(card, WaterCurrent(np.array([0.1, 0.0]), np.eye(2), 5.0)), trials)


def test_a_current_that_is_not_determined_marks_the_result() -> None:
    loose = WaterCurrent(np.array([0.2, 0.0]), np.diag([0.01, 0.3]) ** 2, 5.0)
    assert not loose.determined and loose.standard_error_mps == pytest.approx(0.3)
    assert foremost([undetermined_notice(loose)])
