"""Standard errors of estimates with correlated residuals, and the width of the prior by its evidence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.linalg import eigh

from tank2sim.arrays import Array
from tank2sim.identification.trials.problem.estimation_problem import Problem

BLOCK = 5.0
"""Residuals farther apart than this many ship lengths count as independent in standard errors (project choice: the
memory of the flow and of a slow model error are of that order)."""

MOST_FITTED = 2 / 3
"""Largest assumed share of the residuals' variance that the fit absorbed: beyond it the blocks hardly outnumber the
parameters, and the correction of their scatter would itself be scatter (project choice)."""


def scaled_prior(problem: Problem, scale: Mapping[str, float]) -> Array:
    """Standard errors before the trials (k,), those of :attr:`Problem.groups` times the scale of their group."""
    return np.array([scale.get(group, 1.0) for group in problem.groups]) * problem.prior_error


def evidence_scale(problem: Problem, information: Array, values: Array, scale: Mapping[str, float]) -> dict[str, float]:
    """Factor on the prior's errors of each group that has the largest evidence, at least 1 (MacKay 1992, Neural
    Computation 4): distance from the prior's mean over the number of parameters that the trials determine.

    Parameters
    ----------
    problem : Problem
        k free parameters.
    information : array (k, k)
        Of the trials alone.
    values : array (k,)
        Estimates.
    scale : mapping
        The factors of these estimates.
    """
    prior = scaled_prior(problem, scale)
    scaled = information * np.outer(prior, prior)
    fixed = 1 - np.diag(np.linalg.inv(scaled + np.eye(len(prior))))
    distances = ((values - problem.prior_mean) / problem.prior_error) ** 2
    groups = np.array(problem.groups)
    return {
        group: max(1.0, float(np.sqrt(distances[groups == group].sum() / max(fixed[groups == group].sum(), 1.0))))
        for group in sorted(set(problem.groups) - {""})
    }


def sandwich(information: Array, prior_error: Array, scores: Sequence[Array], captive: Array | float = 0.0) -> Array:
    """Covariance (k, k) of estimates, robust to the true correlation of the residuals (Huber 1967; Newey and West
    1987).

    Parameters
    ----------
    information : array (k, k)
        Of the trials alone, under the noise model.
    prior_error : array (k,)
        With its scale.
    scores : sequence of arrays (blocks, k)
        Gradient of each run by blocks of :data:`BLOCK` ship lengths, in the order of time.
    captive : array (k, k), optional
        Information of captive tests, which counts as that of a prior.
    """
    # In units of the prior's errors the matrices are well scaled: a parameter without trials has information 0 against
    # 1.
    scaled = information * np.outer(prior_error, prior_error)
    known = np.eye(len(prior_error)) + captive * np.outer(prior_error, prior_error)
    bread = np.linalg.inv(scaled + known)
    determined = float(np.trace(bread @ scaled))
    spread = bread @ (_meat(scaled, [score * prior_error for score in scores], determined) + known) @ bread
    return spread * np.outer(prior_error, prior_error)


def _meat(information: Array, scores: Sequence[Array], determined: float) -> Array:
    """Covariance of the gradient (k, k) from blocks of time and their neighbours (Newey and West 1987, one lag).

    Model error correlates residuals far longer than the noise model; white-noise theory would make the intervals
    several times too narrow. The result is at least that theory's `information` in every direction. The fit of the
    `determined` parameters absorbs a share of the residuals: determined/B with B blocks of equal weight (Bell and
    McCaffrey 2002, Survey Methodology 28).
    """
    total = np.zeros_like(information)
    for score in scores:
        lagged = score[1:].T @ score[:-1]
        total += score.T @ score + 0.5 * (lagged + lagged.T)
    count = sum(len(score) for score in scores)
    total *= 1 / (1 - min(determined / max(count, 1), MOST_FITTED))
    values, vectors = eigh(
        total, information + 1e-9 * np.eye(len(total))
    )  # 1e-9 of the prior's information: negligible
    root = information @ vectors
    meat: Array = (root * np.maximum(values, 1.0)) @ root.T
    return meat
