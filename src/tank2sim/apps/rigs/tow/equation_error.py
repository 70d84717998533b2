"""Surge mass and drag from tows by the error of equation (1.5): the method of paper 1 (Wilinski & Zellman 1984).

The mean speed of the tows is fitted by a polynomial v*(t) with derivative a*(t); in (1.5),

    M a* + B1 v*^4 + B2 v*^3 + B3 v*^2 = T,

the unknowns are then linear, and the integral (1.6) of the squared error has its least value where the normal
equations (1.12) hold. The coefficients printed in the paper, (2.3), do not solve its own equations: with its polynomial
(2.1) the error J is 4.464 at them and 0.515 at the solution M 2776, B1 13033, B2 -4554, B3 557. The text prints (2.1)
with +0.00493; its printed inner products belong to -0.00493.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Polynomial

from tank2sim.apps.rigs.tow.records import Tows, as_force
from tank2sim.apps.rigs.tow.surge import DRAG_POWERS
from tank2sim.arrays import Array
from tank2sim.errors import InputError
from tank2sim.identification.conditioning import column_norms

_FEWEST_INTERVALS = 10


@dataclass(frozen=True, eq=False)
class SpeedFit:
    """The polynomial v*(t), m/s over s, through the mean speeds of the tows.

    `scatter_mps` is the standard deviation of a reading about it; `covariance` (degree + 1, degree + 1) is that of the
    coefficients of (t / span)^k, with the span up to the last reading.
    """

    polynomial: Polynomial
    span_s: float
    scatter_mps: float
    covariance: Array


@dataclass(frozen=True, eq=False)
class EquationError:
    """The integral (1.6) as a sum over the nodes (s) of Simpson's rule with their weights (s).

    `basis` (nodes, 1 + terms) is w of (1.12): a* and the powers of v* of the drag terms, in the order of (1.5). With a
    known M only the drag terms are unknown; M is the first of all estimates in either case.
    """

    time_s: Array
    weights: Array
    basis: Array
    terms: tuple[str, ...]
    force_N: Array
    mass_kg: float | None = None

    @property
    def known(self) -> Array:
        """The leading estimates that are known: none, or M."""
        return np.array([] if self.mass_kg is None else [self.mass_kg])

    @property
    def inner_products(self) -> Array:
        """b_ij of (1.12), (1 + terms, 1 + terms)."""
        return self.basis.T @ (self.weights[:, None] * self.basis)

    @property
    def force_products(self) -> Array:
        """b_i0 of (1.12), (1 + terms,)."""
        return (self.weights * self.force_N) @ self.basis

    @property
    def design(self) -> Array:
        """Basis with each node weighted by the root of its weight: its normal matrix is b_ij."""
        return np.sqrt(self.weights)[:, None] * self.basis

    @property
    def free_design(self) -> Array:
        """The columns of :attr:`design` of the unknowns."""
        return self.design[:, len(self.known) :]

    @property
    def target(self) -> Array:
        """Right-hand side that belongs to :attr:`design`, (nodes,)."""
        return np.sqrt(self.weights) * self.force_N

    def J(self, estimates: Array) -> float:
        """J of (1.6), N s^(1/2), for (M, B...), (1 + terms,)."""
        return float(np.linalg.norm(self.design @ estimates - self.target))


def fit_mean_speed(tows: Tows, degree: int = 2) -> SpeedFit:
    """Least-squares polynomial through the mean of the tows at each time, as in (2.1).

    The scatter assumes independent readings of equal variance after the release; the speed at t = 0 is zero without
    error. InputError if the readings after the release do not outnumber the coefficients.
    """
    span = float(tows.time_s[-1])
    powers = np.vander(tows.time_s / span, degree + 1, increasing=True)
    fit = np.linalg.pinv(powers)
    coefficients = fit @ tows.mean_speed_mps
    moving = tows.time_s > 0
    residuals = (tows.speed_mps - (powers @ coefficients)[:, None])[moving]
    freedom = np.count_nonzero(~np.isnan(residuals)) - (degree + 1)
    if freedom < 1:
        problem = f"{freedom + degree + 1} readings after the release do not test a polynomial of degree {degree}"
        raise InputError(tows.path, "", problem, "give more readings")
    variance = float(np.nansum(residuals**2)) / freedom
    spread = fit * np.sqrt(variance * moving / tows.counts)
    polynomial = Polynomial(coefficients / span ** np.arange(degree + 1))
    return SpeedFit(polynomial, span, float(np.sqrt(variance)), spread @ spread.T)


def simpson_nodes(times_s: Array) -> tuple[Array, Array]:
    """Nodes and weights of Simpson's rule over the recorded time, in an even number of intervals.

    The intervals are the median sampling step, or slightly shorter for an even number; at least ten, as in the paper
    for Table 1.
    """
    begin, end = float(times_s[0]), float(times_s[-1])
    count = round((end - begin) / float(np.median(np.diff(times_s))))
    count = max(_FEWEST_INTERVALS, count + count % 2)
    weights = np.ones(count + 1)
    weights[1:-1:2] = 4.0
    weights[2:-1:2] = 2.0
    return np.linspace(begin, end, count + 1), weights * (end - begin) / count / 3.0


def discretise(
    speed: Polynomial,
    times_s: Array,
    terms: tuple[str, ...],
    force: float | Polynomial,
    *,
    mass_kg: float | None = None,
) -> EquationError:
    """The discrete form of (1.6) for a speed polynomial v*(t), m/s, and a force T(t), N, over the times of the
    readings.

    Drag terms are any of B1, B2, B3 in this order; M is given if it is known.
    """
    time, weights = simpson_nodes(times_s)
    v = speed(time)
    basis = np.column_stack([speed.deriv()(time), *(v ** DRAG_POWERS[term] for term in terms)])
    return EquationError(time, weights, basis, terms, as_force(force)(time), mass_kg)


def solve_normal_equations(problem: EquationError) -> Array:
    """(M, B...) from (1.12), as in the paper."""
    known, products = problem.known, problem.inner_products
    first = len(known)
    right = problem.force_products[first:] - products[first:, :first] @ known
    return np.concatenate([known, np.linalg.solve(products[first:, first:], right)])


def solve_by_qr(problem: EquationError) -> Array:
    """(M, B...) from the same least-squares problem by QR, which halves the digits lost to its condition."""
    known = problem.known
    norms = column_norms(problem.free_design)
    q, r = np.linalg.qr(problem.free_design / norms)
    right = problem.target - problem.design[:, : len(known)] @ known
    return np.concatenate([known, np.linalg.solve(r, q.T @ right) / norms])


def covariance(problem: EquationError, estimates: Array, speed: SpeedFit) -> Array:
    """Covariance (1 + terms, 1 + terms) of the least-squares estimates, from the scatter of the readings.

    The scatter is propagated to first order through the polynomial and the solution, under the assumptions that (1.5)
    with these terms is true, that the polynomial can follow it, and that the readings after the release have
    independent errors of equal variance. A known mass has no variance. The usual s^2 (A'A)^-1 of the residuals of (1.5)
    is not used: these residuals are the misfit of smooth curves, not noise, and on simulated tows it gave less than
    half of the true standard error of M.
    """
    first, free = len(problem.known), problem.free_design
    norms = column_norms(free)
    r = np.linalg.qr(free / norms)[1]
    residuals = problem.target - problem.design @ estimates
    v, scaled_time = speed.polynomial(problem.time_s), problem.time_s / speed.span_s
    columns = []
    for k in range(len(speed.covariance)):
        v_change = scaled_time**k
        a_change = k * scaled_time ** max(k - 1, 0) / speed.span_s
        drag_changes = [DRAG_POWERS[term] * v ** (DRAG_POWERS[term] - 1) * v_change for term in problem.terms]
        design_change = np.sqrt(problem.weights)[:, None] * np.column_stack([a_change, *drag_changes])
        right = (design_change.T @ residuals)[first:] - free.T @ (design_change @ estimates)
        columns.append(np.linalg.solve(r, np.linalg.solve(r.T, right / norms)) / norms)
    sensitivity = np.vstack([np.zeros((first, len(columns))), np.column_stack(columns)])
    return sensitivity @ speed.covariance @ sensitivity.T
