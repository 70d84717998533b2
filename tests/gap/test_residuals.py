"""What a fitted explanation leaves and tells: against least squares trial by trial, and forces known in newtons."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from gap_truth import SHIP_TOML, Made, Setting, write
from gap_truth.integrate import integrate
from gap_truth.lane import lanes_of
from gap_truth.record import recorded

from tank2sim.cards import ManoeuvringCard, parse_card
from tank2sim.gap.diagnosis.residuals import each_trial, estimates, force_lacking
from tank2sim.gap.inference.fit import ExplanationFit
from tank2sim.gap.inference.likelihood import Likelihood
from tank2sim.gap.inference.prior import likelihood_from_card
from tank2sim.identification.trials.problem.prepare_trials import measured
from tests.gap.dense import Dense
from tests.gap.toy import Toy, toy_motion
from tests.gap.toy_likelihood import LOGS, NOISE, WIDTH, forms_of, judge

# -- what each trial says ------------------------------------------------------------------------------------------


def by_hand(of: Likelihood, fit: ExplanationFit, run: int, place: int) -> tuple[float, float]:
    """A parameter and its standard error by generalised least squares of one run as one Gaussian vector."""
    toy, part = fit.hypothesis, Dense(of.linear(fit.hypothesis, fit.theta), NOISE, run)

    def error(theta):
        driving, shown = of.residual(toy, theta)
        return part.error(driving[run], shown[run])

    e = error(fit.theta)
    slopes = np.stack([(error(fit.theta + 0.01 * axis) - e) / 0.01 for axis in np.eye(len(fit.theta))], axis=-1)
    vary = [WIDTH * of.of_coefficients(toy, fit.theta)]
    vary.append(forms_of(of, toy, fit.theta))
    covariance = part.covariance.copy()
    for column_of_run in np.moveaxis(np.concatenate(vary, axis=-1)[run], -1, 0):
        column = part.of_driving @ column_of_run.ravel()
        covariance += np.outer(column, column)
    remaining = [index for index in range(len(fit.theta)) if index != place]
    covariance += slopes[:, remaining] @ fit.covariance[np.ix_(remaining, remaining)] @ slopes[:, remaining].T
    weighed = np.linalg.solve(covariance, slopes[:, place])
    information = weighed @ slopes[:, place]
    return float(fit.theta[place] - weighed @ e / information), float(1 / np.sqrt(information))


@pytest.mark.parametrize("theta", [(0.8,), (0.8, -0.6), (0.8, -0.6, 0.5)])
def test_each_trial_says_what_its_own_least_squares_say(theta) -> None:
    of = judge(toy_motion(theta, (0.3, -0.2)))
    toy = Toy((None,) * len(theta))
    fit = of.at_best(toy, np.array(theta), [LOGS], [0])
    by_trial = each_trial(of, fit)
    assert list(by_trial) == [estimate.variable for estimate in toy.estimated]
    for place, values in enumerate(by_trial.values()):
        assert list(values) == ["a", "b"]
        for run, found in enumerate(values.values()):
            assert found == pytest.approx(by_hand(of, fit, run, place), rel=1e-6)
            value, error = found
            assert abs(value - theta[place]) < 4 * error < 4.0


def test_a_trial_that_tells_nothing_is_left_out() -> None:
    motion = toy_motion((0.8,))
    silent = motion.measured.copy()
    silent[1] = np.nan
    of = judge(replace(motion, measured=silent))
    (values,) = each_trial(of, of.at_best(Toy((None,)), np.array([0.8]), [LOGS], [0])).values()
    assert list(values) == ["a"]


def test_estimates_are_told_by_effect_and_parameter() -> None:
    toy = Toy((None, None))
    fit = ExplanationFit(toy, np.array([0.5, -0.3]), np.diag([0.04, 0.09]), LOGS, 0.0, np.zeros(0))
    first, second = estimates(fit)
    assert first == ("gyro_bias", {"size": 0.5}, {"size": pytest.approx(0.2)})
    assert second == ("current", {"size": -0.3}, {"size": pytest.approx(0.3)})


def test_what_trials_do_not_determine_is_uncertain_by_its_whole_range_and_no_more() -> None:
    toy = Toy((None, None))
    low, high = toy.bounds
    fit = ExplanationFit(toy, np.array([0.5, -0.3]), np.diag([1e12, 0.09]), LOGS, 0.0, np.zeros(0))
    (_, values, errors), (*_, other) = estimates(fit)
    uniform = np.random.default_rng(1).uniform(low[0], high[0], 200_000)
    assert values == {"size": 0.5}
    assert errors == {"size": pytest.approx(np.std(uniform), rel=0.01)} and other == {"size": pytest.approx(0.3)}


# -- the force that is lacking -------------------------------------------------------------------------------------

LENGTH_M, WATER_KGPM3, SPEED_MPS = 160.93, 1025.0, 7.7175
NEWTONS = 0.5 * WATER_KGPM3 * LENGTH_M**2 * SPEED_MPS**2
"""Of a prime force at the design speed; a moment has the length more."""

PUSHES = {
    "X": ("out_drag_step", {"X": -3e-4, "t0": 80.0}, -3e-4 * NEWTONS),
    "Y": ("out_tug", {"F": 3e-4, "lever": 0.0, "t0": 80.0, "dur": 300.0}, 3e-4 * NEWTONS),
    "N": ("out_tug", {"F": 3e-4, "lever": -0.4, "t0": 80.0, "dur": 300.0}, -1.2e-4 * NEWTONS * LENGTH_M),
}


@cache
def short_runs() -> dict[str, Made]:
    """Three minutes of the straight course of a Mariner that is pushed from 80 s on, by the generator of trials."""
    (lane,) = lanes_of(Setting((), 1, manoeuvres=("straight",)))
    lane = replace(lane, manoeuvre=replace(lane.manoeuvre, duration_s=180.0, keeps_course=False))
    pushes = {equation: {effect: parameters} for equation, (effect, parameters, _) in PUSHES.items()} | {"none": {}}
    lanes = [replace(lane, effects=effects) for effects in pushes.values()]
    history = integrate(lanes)
    return {
        equation: Made(lane.setting, {}, {"straight": recorded(lanes[place], history, place)})
        for place, equation in enumerate(pushes)
    }


def short_run(equation: str, folder: Path) -> Likelihood:
    write(short_runs()[equation], folder)
    card = parse_card(SHIP_TOML, "ship.toml")
    assert isinstance(card, ManoeuvringCard)
    return likelihood_from_card(card, measured([folder / "straight.csv"], card))


def none_of(likelihood: Likelihood) -> ExplanationFit:
    return likelihood.at_best(likelihood.none, np.zeros(0), [likelihood.belief.logs], [15])


@pytest.mark.parametrize("equation", PUSHES)
def test_a_force_that_was_added_is_found_in_newtons(equation: str, tmp_path: Path) -> None:
    *_, true = PUSHES[equation]
    likelihood = short_run(equation, tmp_path)
    found = force_lacking(likelihood, none_of(likelihood))
    assert found is not None and found.equation == equation and set(found.trials) == {"straight"}
    before, after = found.time_s < 70.0, (found.time_s > 95.0) & (found.time_s < 165.0)
    assert np.median(found.force[after]) == pytest.approx(true, rel=0.15)
    assert abs(np.median(found.force[before])) < 0.15 * abs(true)
    assert set(found.states) == {"rudder", "drift", "yaw rate", "speed", "heading"}
    assert found.states["speed"][before] == pytest.approx(SPEED_MPS, abs=0.1)


def test_where_nothing_is_added_no_force_is_lacking(tmp_path: Path) -> None:
    likelihood = short_run("none", tmp_path)
    assert force_lacking(likelihood, none_of(likelihood)) is None
