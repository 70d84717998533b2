"""Widening of a prior against the marginal likelihood, which for separate measurements has a closed form."""

from __future__ import annotations

import numpy as np
import pytest

from tank2sim.identification.trials.problem.estimation_problem import Problem, evidence_scale, sandwich, scaled_prior
from tests.marks import first_fast

STATED = 0.05


def asked(names: list[str], error: float = STATED) -> Problem:
    ones = np.ones(len(names))
    return Problem(model=None, free=tuple(names), prior_mean=ones, prior_error=error * ones, runs=())


@first_fast("noise", [1e-6, 0.05, 0.2])
@pytest.mark.parametrize("true", [2.0, 6.0])
def test_the_scale_is_the_one_that_makes_the_measurements_likeliest(noise: float, true: float) -> None:
    """Of theta + noise, theta scattered by k times the stated error: k^2 = (mean square - noise^2)/error^2."""
    count = 100
    problem = asked([f"derivatives.Y{n}" for n in range(count)])
    rng = np.random.default_rng(5)
    measured = 1 + true * STATED * rng.standard_normal(count) + noise * rng.standard_normal(count)
    likeliest = np.sqrt(np.mean((measured - 1) ** 2) - noise**2) / STATED
    information = np.eye(count) / noise**2
    scale = {"Y": 1.0}
    for _ in range(400):
        prior = scaled_prior(problem, scale)
        values = (measured / noise**2 + 1 / prior**2) / (1 / noise**2 + 1 / prior**2)
        scale = evidence_scale(problem, information, values, scale)
    assert scale["Y"] == pytest.approx(likeliest, rel=1e-3)
    assert scale["Y"] == pytest.approx(true, rel=0.25)


def test_each_equation_has_its_own_scale_and_none_is_below_one() -> None:
    problem = asked([f"derivatives.{force}{n}" for force in "XYN" for n in range(4)])
    away = np.repeat([0.3, 3.0, 7.0], 4) * STATED * np.tile([1, -1, 1, -1], 3)
    scale = evidence_scale(problem, 1e12 * np.eye(12), 1 + away, {})
    assert scale == pytest.approx({"X": 1.0, "Y": 3.0, "N": 7.0}, rel=1e-6)


def test_a_parameter_of_which_little_is_known_or_no_derivative_widens_nothing() -> None:
    """Its stated error is a quarter of its value, or more."""
    values = np.array([1 + 9 * 0.25])
    assert evidence_scale(asked(["derivatives.Yv"], 0.25), 1e12 * np.eye(1), values, {}) == {}
    assert evidence_scale(asked(["steering.time_constant"]), 1e12 * np.eye(1), values, {}) == {}
    assert set(evidence_scale(asked(["derivatives.Yv"], 0.249), 1e12 * np.eye(1), values, {})) == {"Y"}


def test_what_the_trials_do_not_show_does_not_widen_the_prior() -> None:
    problem = asked(["derivatives.Yv", "derivatives.Yr"])
    information = np.diag([1e12, 0.0])
    scale = evidence_scale(problem, information, np.array([1 + 4 * STATED, 1.0]), {})
    assert scale["Y"] == pytest.approx(4.0), "one parameter is fixed, and it is four errors away"


def test_parameters_that_the_trials_see_only_together_have_errors_all_the_same() -> None:
    random = np.random.default_rng(3)
    seen = random.standard_normal((400, 3)) * 1e3
    columns = seen @ random.standard_normal((3, 12))  # 12 parameters, of which 3 combinations are seen
    information = columns.T @ columns
    rounded = information * (1 + 1e-11 * random.standard_normal(information.shape))
    scores = [columns * random.standard_normal((400, 1))]
    found = sandwich(rounded, np.ones(12), scores, np.eye(12))
    assert np.all(np.diag(found) > 0)
    # Nothing but the prior is known of the other nine combinations.
    np.testing.assert_allclose(np.linalg.eigvalsh(found)[3:], 1.0, rtol=0.1)
