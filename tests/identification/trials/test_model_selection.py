"""Choosing among models: information criteria against theory, folds, and the simpler model of equals."""

import pickle
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from scipy.signal import lfilter

from tank2sim.cards import parse_card
from tank2sim.errors import InputError
from tank2sim.identification.trials.assessment.model_selection import (
    CrossValidation,
    HeldOutFold,
    criteria,
    criteria_of,
    cross_validate,
    effective_samples,
    farthest,
    predictive_weights,
    simplest,
    yaw_rate_error,
)
from tank2sim.identification.trials.methods.equation_error import EquationErrorSettings, equation_error
from tank2sim.identification.trials.problem.problem_from_card import problem_from_card
from tests.identification.trials.made_up_ship import CARD, problem, trial, turn, zigzag

ESTIMATOR = partial(equation_error, settings=EquationErrorSettings(rounds=2))


def distance_of_Nd(problem, estimate):
    """A score that a process can be sent."""
    return abs(estimate.values[-1] / 0.0015 - 1) + 0.001 * len(problem.runs)


@pytest.fixture(scope="module")
def asked():
    runs = {"small": zigzag(5), "middle": zigzag(15), "large": turn(30)}
    trials = [trial(rudder, name=name, duration=150.0, seed=k) for k, (name, rudder) in enumerate(runs.items())]
    return problem(trials, free=("Yv", "Nv", "Nr", "Nd"))


def test_coloured_residuals_count_for_as_many_as_theory_says():
    phi, rng = 0.8, np.random.default_rng(1)
    series = [lfilter([1.0], [1.0, -phi], rng.standard_normal((4000, 2)), axis=0) for _ in range(5)]
    expected = 20000 * (1 - phi) / (1 + phi)  # variance of a mean of AR(1)
    assert effective_samples(series) == pytest.approx(expected, rel=0.15)
    assert effective_samples([rng.standard_normal((5000, 3))]) == pytest.approx(5000, rel=0.1)


def test_criteria_are_those_of_textbooks():
    rng = np.random.default_rng(2)
    residuals = 0.3 * rng.standard_normal((1000, 1))
    found = criteria_of([residuals], 4.0, samples=1000.0)
    deviance = 1000 * np.log(np.mean(residuals**2))
    assert found.aic == pytest.approx(deviance + 8)
    assert found.bic == pytest.approx(deviance + 4 * np.log(1000))


def test_criteria_prefer_the_term_that_is_there_and_not_the_one_that_is_not(asked):
    with_all = criteria(asked, equation_error(asked))
    trials = [trial(zigzag(15), name="middle", duration=150.0, seed=1), trial(turn(30), duration=150.0, seed=2)]
    full = problem(trials, free=("Nv", "Nr", "Nd"))
    bare = problem(trials, free=("Nv", "Nr"))
    bare = replace(bare, model=bare.model.redefine("rudder.N", lambda old: 0.8 * old))
    idle = problem(trials, free=("Nv", "Nr", "Nd", "N0"))  # N0 of the ship is 0
    answers = {name: equation_error(one) for name, one in (("full", full), ("bare", bare), ("idle", idle))}
    n = criteria(full, answers["full"]).samples
    bics = {name: criteria(one, answers[name], n).bic for name, one in (("full", full), ("bare", bare), ("idle", idle))}
    assert with_all.parameters == pytest.approx(4, abs=0.2)
    assert bics["full"] < bics["bare"] - 10
    assert bics["full"] < bics["idle"]


def test_each_run_is_left_out_once_and_the_largest_last(asked):
    seen = []

    def score(left, estimate):
        seen.append(tuple(run.name for run in left.runs))
        return 1.0

    result = cross_validate(asked, ESTIMATOR, score)
    assert seen == [("small",), ("middle",), ("large",), ("large",)]
    assert [fold.held_out for fold in result.single] == seen[:3]
    assert result.extrapolation.held_out == ("large",)


def test_largest_amplitude_is_that_of_the_yaw_rate(asked):
    assert farthest(asked.runs) == (2,)
    assert farthest([*asked.runs, asked.runs[2], *asked.runs[:2] * 2]) == (2, 3)


def test_a_fold_is_fitted_without_what_is_left_out(asked):
    result = cross_validate(asked, ESTIMATOR, distance_of_Nd)
    alone = ESTIMATOR(asked.with_runs(asked.runs[1:]))
    np.testing.assert_array_equal(result.single[0].values, alone.values)
    assert result.single[0].error == distance_of_Nd(asked.with_runs(asked.runs[:1]), alone)


def test_a_problem_of_another_process_is_the_same_problem(asked):
    card = parse_card(CARD, "made_up.toml")
    trials = [trial(rudder, name=str(k), duration=100.0, seed=k) for k, rudder in enumerate([zigzag(15), turn(20)])]
    posed = problem_from_card(card, trials, "angle")
    sent = pickle.loads(pickle.dumps(posed))
    here = cross_validate(posed, ESTIMATOR, distance_of_Nd)
    with ThreadPoolExecutor(2) as executor:
        there = cross_validate(sent, ESTIMATOR, distance_of_Nd, executor)
    np.testing.assert_allclose(there.errors, here.errors, rtol=1e-9)
    pickle.loads(pickle.dumps((ESTIMATOR, yaw_rate_error)))


@pytest.mark.slow
def test_the_yaw_rate_is_followed_by_the_true_ship_and_less_by_another(asked):
    truth = np.array([-0.014, -0.0032, -0.0022, 0.0015])
    estimate = replace(ESTIMATOR(asked), values=truth)
    right = yaw_rate_error(asked, estimate)
    wrong = yaw_rate_error(asked, replace(estimate, values=truth * [1, 1, 1, 1.1]))
    assert right < 0.05
    assert wrong > 1.4 * right


def test_a_problem_without_its_ship_is_not_sent(asked):
    with pytest.raises(TypeError, match="without its ship"):
        pickle.dumps(asked)


def test_a_fold_that_fails_is_infinitely_bad(asked):
    def score(left, estimate):
        raise InputError("x", "", "left all bounds", "none")

    assert np.isinf(cross_validate(asked, ESTIMATOR, score).errors).all()


def test_one_run_cannot_be_left_out(asked):
    with pytest.raises(InputError, match="only run"):
        cross_validate(asked.with_runs(asked.runs[:1]), ESTIMATOR, distance_of_Nd)


def validation(*errors):
    folds = [HeldOutFold((str(k),), error, np.empty(0)) for k, error in enumerate(errors)]
    return CrossValidation(tuple(folds[:-1]), folds[-1])


def test_the_simpler_of_equals_is_taken():
    simple, rich = validation(1.0, 2.1, 1.4, 2.9), validation(1.1, 2.0, 1.2, 2.9)
    assert simplest({"simple": simple, "rich": rich}) == "simple"
    assert simplest({"rich": rich, "simple": simple}) == "rich"


def test_the_richer_is_taken_when_it_is_surely_better():
    simple, rich = validation(1.5, 2.6, 1.8, 3.4), validation(1.1, 2.0, 1.2, 2.9)
    assert simplest({"simple": simple, "rich": rich}) == "rich"


def test_a_model_that_fails_anywhere_is_not_taken():
    assert simplest({"simple": validation(0.1, 0.1, np.inf), "rich": validation(1.0, 1.0, 1.0)}) == "rich"


def cross_validation(errors):
    folds = tuple(HeldOutFold((str(place),), error, np.empty(0)) for place, error in enumerate(errors))
    return CrossValidation(folds, folds[0])


def test_predictive_weights_are_equal_for_equal_predictions_and_follow_the_better_one():
    even = predictive_weights({"a": cross_validation([0.1, 0.2]), "b": cross_validation([0.1, 0.2])}, [5.0, 5.0])
    assert even == pytest.approx({"a": 0.5, "b": 0.5})
    samples = [10.0] * 6
    good, bad = [0.10, 0.12, 0.09, 0.11, 0.10, 0.12], [0.20, 0.22, 0.21, 0.19, 0.20, 0.23]
    weights = predictive_weights({"good": cross_validation(good), "bad": cross_validation(bad)}, samples)
    assert weights["good"] > 0.999 and sum(weights.values()) == pytest.approx(1.0)
    mixed = predictive_weights({"a": cross_validation([0.1, 0.2]), "b": cross_validation([0.2, 0.1])}, [3.0, 3.0])
    assert 0.4 < mixed["a"] < 0.6
    failed = predictive_weights({"a": cross_validation([0.1, np.inf]), "b": cross_validation([0.2, 0.3])}, [3.0, 3.0])
    assert failed["b"] > 0.9


def test_weights_of_one_fold_are_those_of_its_likelihoods():
    """n ln(e) of one fold: weights in the ratio (0.2/0.1)^4."""
    weights = predictive_weights({"a": cross_validation([0.1]), "b": cross_validation([0.2])}, [4.0])
    assert weights["a"] / weights["b"] == pytest.approx(16.0)
