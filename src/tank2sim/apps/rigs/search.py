"""Output error of a body with one degree of freedom: the search by its sensitivities, and the scatter it leaves."""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np
from scipy.optimize import OptimizeResult, least_squares

from tank2sim.arrays import Array
from tank2sim.identification.conditioning import column_norms
from tank2sim.identification.trials.methods.gauss_newton import is_minimum

WithSlopes = Callable[[Array], tuple[Array, Array]]
"""Unknowns (k,) to values (n,) and their derivatives (n, k)."""


def least_misfit(
    misfit: WithSlopes,
    start: Array,
    bounds: tuple[Array, Array] | None = None,
    *,
    tolerances: tuple[float, float, float],
    most_steps: int | None = None,
) -> OptimizeResult | None:
    """Least squares of a misfit from `start` within bounds; the tolerances are of unknowns, cost and gradient.

    None where the search fails, leaves the finite numbers, or never moves from a start that is not a minimum.
    """
    # Residuals and Jacobian are asked for one after the other, at the same point.
    at = functools.lru_cache(maxsize=2)(lambda *unknown: misfit(np.array(unknown)))
    low, high = bounds or (np.full(len(start), -np.inf), np.full(len(start), np.inf))
    try:
        found = least_squares(
            lambda unknown: at(*unknown)[0],
            start,
            lambda unknown: at(*unknown)[1],
            (low, high),
            xtol=tolerances[0],
            ftol=tolerances[1],
            gtol=tolerances[2],
            max_nfev=most_steps,
        )
    except ValueError:  # the motion of the start leaves all bounds
        return None
    if not found.success or not np.isfinite(found.x).all():
        return None
    variance = max(float(np.mean(found.fun**2)), np.finfo(float).tiny)
    H, g = found.jac.T @ found.jac, found.jac.T @ found.fun
    stays = is_minimum(H, g, variance=variance, bounded=(found.x, low, high))
    return found if stays or not np.array_equal(found.x, start) else None


def pseudo_inverse(design: Array) -> Array:
    """Inverse (k, n) of a design (n, k) whose columns are first scaled to equal length."""
    norms = column_norms(design)
    inverse: Array = np.linalg.pinv(design / norms) / norms[:, None]
    return inverse
