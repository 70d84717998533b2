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

    `problem`: k free parameters. `information` (k, k): Information of the trials alone. `values` (k,): Estimates.
    `scale`: The factors of these estimates.
    """
    prior = scaled_prior(problem, scale)
    scaled = information * np.outer(prior, prior)
    fixed = 1 - np.diag(np.linalg.solve(scaled + problem.known, problem.known))
    distance = (values - problem.prior_mean) / problem.prior_error
    groups = np.array(problem.groups)
    factors = {}
    for group in sorted(set(problem.groups) - {""}):
        rows = np.flatnonzero(groups == group)
        squares = float(distance[rows] @ problem.known[np.ix_(rows, rows)] @ distance[rows])
        factors[group] = max(1.0, float(np.sqrt(squares / max(fixed[rows].sum(), 1.0))))
    return factors


def sandwich(information: Array, unit: Array, scores: Sequence[Array], before: Array) -> Array:
    """Covariance (k, k) of estimates, robust to the true correlation of the residuals (Huber 1967; Newey and West
    1987).

    `information` (k, k): Information of the trials alone, under the noise model. `unit` (k,): Sizes of the parameters,
    which scale the matrices: the prior's errors. `scores` each (blocks, k): Gradient of each run by blocks of
    :data:`BLOCK` ship lengths, in the order of time. `before` (k, k): Information before the trials: of the prior, and
    of captive tests that were fitted with them.
    """
    # In units of the prior's errors the matrices are well scaled: a parameter without trials has information 0 against
    # 1.
    size = np.outer(unit, unit)
    scaled, known = information * size, before * size
    bread = np.linalg.inv(scaled + known)
    determined = float(np.trace(bread @ scaled))
    spread = bread @ (_meat(scaled, [score * unit for score in scores], determined) + known) @ bread
    return spread * size


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
    # To a diagonal of 1 at most: trials with hardly any noise have an information so large that the rounding of one
    # parameter's exceeds all of another's. What is added is negligible: 1e-9 of the prior's, 1e-10 of its own.
    size = 1 / np.sqrt(np.diag(information) + 1.0)
    square = np.outer(size, size)
    scaled = 0.5 * (information + information.T) * square
    values, vectors = eigh(total * square, scaled + np.diag(1e-9 * size**2 + 1e-10))
    root = scaled @ vectors
    meat: Array = (root * np.maximum(values, 1.0)) @ root.T
    return meat / square
