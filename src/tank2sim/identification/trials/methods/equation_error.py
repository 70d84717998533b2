"""Equation error in its weak form: comparison of the model's accelerations with the measured changes of velocity.

Generalised least squares: the covariance of the three equations and the colour of their residuals are estimated from
them, the prior is a ridge. The problem is linear in the derivatives, so that a single step solves it from any start,
and only unmeasured states are simulated. Noise in the regressors pulls the estimates towards zero: they are smoothed
first, and a notice gives the remaining share. Gusts move the ship in phase with themselves, which pulls the damping
towards zero by the share of the motion that they cause (as in any regression on the motion): a start for output error.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from tank2sim.arrays import Array
from tank2sim.errors import InputError
from tank2sim.identification.trials.methods.coloured_noise import ColouredNoise, estimate_coloured_noise, white
from tank2sim.identification.trials.methods.gauss_newton import damped_gauss_newton, is_minimum, refuse_stopped
from tank2sim.identification.trials.methods.weak_form import WEAK_EQUATIONS, WIDTH, WeakForm, WeakWindows
from tank2sim.identification.trials.problem.estimation_problem import (
    BLOCK,
    Estimate,
    Problem,
    SearchReport,
    evidence_scale,
    sandwich,
    scaled_prior,
    silent,
)
from tank2sim.notices import Notice

REPORTED_NOISE = 0.01
"""Share of noise in a regressor's variance from which a notice reports it: its coefficients may be too small by it."""


@dataclass(frozen=True)
class EquationErrorSettings:
    """Settings of equation error."""

    width: float = WIDTH  # Width of the test functions, in L/u0
    # Multiply the prior's standard errors, by groups, by the factor of largest evidence, at least 1
    scale_prior: bool = True
    rounds: int = 3  # Number of estimates of noise (and prior)


@dataclass(frozen=True, eq=False)
class WhiteningWeights:
    """Weights that whiten residuals: the root of the covariance of the three equations, and the colour of each."""

    inverse: Array  # (3, 3): L^-1, with L L' the covariance of the residuals, L lower triangular
    colour: tuple[ColouredNoise, ...]  # Colour of the three components of L^-1 e

    def whitened(self, values: Array, pieces: tuple[slice, ...]) -> Array:
        """Residuals (windows, 3) or their derivatives (windows, 3, k), whitened."""
        flat = values.reshape(len(values), 3, -1)
        components = np.einsum("ij,wjk->iwk", self.inverse, flat)
        whole = np.empty_like(components)
        for place, noise in enumerate(self.colour):
            for piece in pieces:
                if not components[place, piece].size:
                    continue
                whole[place, piece] = noise.whitened(components[place, piece][None])[0]
        result: Array = whole.transpose(1, 0, 2).reshape(values.shape)
        return result


@dataclass(frozen=True, eq=False)
class _Normal:
    """Normal equations of all runs."""

    cost: float
    information: Array
    gradient: Array
    scores: list[Array]


def equation_error(
    problem: Problem,
    start: Array | None = None,
    settings: EquationErrorSettings | None = None,
    progress: SearchReport = silent,
) -> Estimate:
    """Estimate the free parameters by equation error.

    `problem`: k free parameters. `start` (k,): Start of the search; by default the prior's mean. `progress`: Called
    with each better estimate; its exceptions propagate. Raises InputError: A run lacks velocities and signals that
    determine them, all runs are shorter than a window, or the search cannot move from its start, although the data ask
    for it (:class:`.StoppedSearchError`).
    """
    settings = settings or EquationErrorSettings()
    problem = replace(problem, captive=None)  # by the trials alone
    form = WeakForm(problem, settings.width)
    if not len(form.change):
        names = ", ".join(run.run.name for run in form.runs)
        remedy = (
            f"heading and positions, or u, v and r, are needed without gaps over {2 * form.half:.3g} s at least: add "
            "the rows that are missing, with straight lines where a gap is short, or the readings of another sensor"
        )
        raise InputError(names, "", "has no stretch long enough", remedy)
    first = values = (problem.prior_mean if start is None else start).astype(float)
    windows = form.at(values)
    # A tenth of the spread of each acceleration, before any residual is known.
    spread = 0.1 * np.sqrt(np.mean(form.change**2, axis=0))
    weights = WhiteningWeights(np.diag(1 / np.where(spread > 0, spread, 1.0)), (white(1.0),) * 3)
    scale: dict[str, float] = {}
    costs = []
    for number in range(settings.rounds):
        prior = scaled_prior(problem, scale)
        values, windows, normal = _minimise(form, values, windows, weights, prior, progress)
        costs.append(normal.cost)
        if number < settings.rounds - 1:
            weights = weights_of(form, windows)
            if settings.scale_prior:
                scale = evidence_scale(problem, normal.information, values, scale)
    if np.array_equal(values, first):
        known, pull, _ = problem.before(values, prior)
        stays = is_minimum(normal.information + known, normal.gradient + pull, bounded=(values, *problem.bounds))
        refuse_stopped("equation error", stays)
    deviations = np.sqrt(np.mean(windows.residuals**2, axis=0))
    return Estimate(
        method="equation_error",
        free=problem.free,
        values=values,
        covariance=sandwich(normal.information, prior, normal.scores, problem.prior_precision(prior)),
        information=normal.information,
        noise=dict(zip(WEAK_EQUATIONS, map(float, deviations), strict=True)),
        cost=tuple(costs),
        prior_scale=scale,
        notices=(*form.notices, *_form_notices(form)),
    )


def weights_of(form: WeakForm, windows: WeakWindows) -> WhiteningWeights:
    """Covariance and colour of the residuals."""
    covariance = windows.residuals.T @ windows.residuals / len(windows.residuals)
    smallest = 1e-12 * np.mean(form.change**2, axis=0)
    covariance += np.diag(np.where(smallest > 0, smallest, 1.0))  # an equation without residual would be singular
    inverse = np.linalg.inv(np.linalg.cholesky(covariance))
    pieces = [inverse @ windows.residuals[piece].T for piece in form.pieces]
    return WhiteningWeights(
        inverse, tuple(estimate_coloured_noise([piece[place] for piece in pieces], 1e-6) for place in range(3))
    )


def normal_equations(form: WeakForm, windows: WeakWindows, weights: WhiteningWeights) -> _Normal:
    """Cost, information, gradient and its shares by blocks of time, of all runs without the prior."""
    per_block = max(1, round(BLOCK * form.problem.ship_time / form.half))
    r = weights.whitened(windows.residuals, form.pieces)
    J = -weights.whitened(windows.jacobian, form.pieces)
    pull = np.einsum("wik,wi->wk", J, r)
    of_runs = [pull[span] for span in form.spans if span.stop > span.start]
    scores = [np.add.reduceat(part, np.arange(0, len(part), per_block), axis=0) for part in of_runs]
    return _Normal(float(np.sum(r**2)), np.einsum("wik,wil->kl", J, J, optimize=True), pull.sum(axis=0), scores)


@dataclass(frozen=True, eq=False)
class _Point:
    """Parameters (k,), the windows with them, and the sum of squares with the prior."""

    values: Array
    windows: WeakWindows
    cost: float


def _minimise(
    form: WeakForm,
    values: Array,
    windows: WeakWindows,
    weights: WhiteningWeights,
    errors: Array,
    progress: SearchReport,
) -> tuple[Array, WeakWindows, _Normal]:
    """Damped Gauss-Newton steps; values, windows and normal equations at the best point."""
    problem = form.problem

    def point(values: Array, windows: WeakWindows) -> _Point:
        cost = float(np.sum(weights.whitened(windows.residuals, form.pieces) ** 2))
        return _Point(values, windows, cost + problem.before(values, errors)[2])

    def linearise(start: _Point) -> _Normal:
        return normal_equations(form, start.windows, weights)

    def move(start: _Point, normal: _Normal, damping: float) -> _Point:
        prior, pull, _ = problem.before(start.values, errors)
        # In units of the prior's errors the matrix is well scaled.
        scaled = (normal.information + prior) * np.outer(errors, errors)
        step = errors * np.linalg.solve(scaled + damping * np.diag(np.diag(scaled)), (normal.gradient + pull) * errors)
        values = np.clip(start.values - step, *problem.bounds)
        return point(values, form.at(values))

    def report(better: _Point, gain: float) -> bool:
        progress("equation error", better.values, better.cost)
        return gain < 1e-6 * max(1.0, better.cost)

    found = damped_gauss_newton(point(values, windows), linearise, move, report, steps=20)
    best, _, last = found
    return best.values, best.windows, last or linearise(best)


def _form_notices(form: WeakForm) -> Iterator[Notice]:
    """Notices of regressors with remaining noise, and of parameters that no acceleration depends on."""
    spread = np.concatenate([run.motion.smooth[:, :3] for run in form.runs]).std(axis=0)
    noise = np.sqrt(np.mean([run.motion.remaining_noise**2 for run in form.runs], axis=0))
    for name, size, error in zip("uvr", spread, noise, strict=True):
        share = (error / size) ** 2 if size > 0 else 0.0
        if share > REPORTED_NOISE:
            yield Notice(f"{100 * share:.0f} % of the variance of {name} is noise: its coefficients come out too small")
    blind = [name for name, seen in zip(form.problem.free, form.seen, strict=True) if not seen]
    if blind:
        yield Notice(f"equation error does not determine {', '.join(blind)}: no acceleration depends on them")
