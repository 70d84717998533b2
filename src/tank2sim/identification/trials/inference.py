"""What estimators of trials share: standard errors for residuals that hang together, and the width of the prior."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from tank2sim.dynamics.model import Vector

Array = NDArray[np.float64]

BLOCK = 5.0
"""Residuals farther apart than this many ship lengths count as independent in standard errors (ours: the memory of the
flow and of a slow model error are of that order)."""


def evidence_scale(information: Array, prior_error: Vector, away: Vector, scale: float) -> float:
    """Factor on the prior's standard errors of largest evidence, at least 1 (MacKay 1992, Neural Computation 4).

    Distance from the prior's mean over the number of parameters that the trials determine.

    Parameters
    ----------
    information : array (k, k)
        Of the trials alone.
    prior_error, away : array (k,)
        Standard errors before the trials, unscaled; estimates less the prior's mean.
    scale : float
        The factor with which the estimates were found.
    """
    prior = 1 / (scale * prior_error) ** 2
    determined = len(prior) - float(np.trace(np.linalg.inv(information + np.diag(prior)) * prior))
    return max(1.0, float(np.sqrt(np.sum((away / prior_error) ** 2) / max(determined, 1.0))))


def sandwich(information: Array, prior_error: Vector, scores: Sequence[Array]) -> Array:
    """Covariance (k, k) of estimates, for residuals as they are (Huber 1967; Newey and West 1987).

    Parameters
    ----------
    information : array (k, k)
        Of the trials alone, as if the noise model were true.
    prior_error : array (k,)
        With its scale.
    scores : sequence of arrays (blocks, k)
        Gradient of each run by blocks of :data:`BLOCK` ship lengths, in the order of time.
    """
    prior = np.diag(1 / prior_error**2)
    bread = np.linalg.inv(information + prior)
    covariance: Array = bread @ (_meat(information, scores) + prior) @ bread
    return covariance


def _meat(information: Array, scores: Sequence[Array]) -> Array:
    """Covariance of the gradient (k, k) from blocks of time and their neighbours (Newey and West 1987, one lag).

    Model error makes residuals hang together far longer than the noise model says; white-noise theory would make the
    intervals several times too narrow. In no direction is it less than that theory's `information`.
    """
    total = np.zeros_like(information)
    for score in scores:
        lagged = score[1:].T @ score[:-1]
        total += score.T @ score + 0.5 * (lagged + lagged.T)
    count = sum(len(score) for score in scores)
    total *= count / max(count - 1, 1)
    values, vectors = eigh(total, information + 1e-12 * np.diag(np.diag(information)) + 1e-300 * np.eye(len(total)))
    root = information @ vectors
    meat: Array = (root * np.maximum(values, 1.0)) @ root.T
    return meat
