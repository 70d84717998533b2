"""A craft's coefficients from the velocities that its positions give, by free motion as long as a prediction.

A filter that knows neither wind nor current explains a poor card by random accelerations, and its search may stay
there. Equation error needs no card that moves like the craft, and output error of long pieces finds what predicts best
(Morelli and Klein 2016, Aircraft System Identification, 2nd ed., 6 and 11.3).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import OptimizeResult, least_squares

from tank2sim.arrays import Array
from tank2sim.errors import InputError
from tank2sim.identification.trials.methods.coloured_noise import white
from tank2sim.identification.trials.methods.equation_error import EquationErrorSettings, equation_error
from tank2sim.identification.trials.methods.gauss_newton import StoppedSearchError, is_minimum, refuse_stopped
from tank2sim.identification.trials.methods.kalman_pass import velocities_of
from tank2sim.identification.trials.methods.output_error import SENSED_BY, Shooting, Shot, cut
from tank2sim.identification.trials.problem.estimation_problem import Estimate, Problem
from tank2sim.identification.trials.problem.sampled_runs import SampledRun
from tank2sim.records.trials import straight_over_gaps

PREDICTED_S = 30.0
"""Length of a free-running prediction, s, as in the published comparisons on small craft."""

_SEEN = ("motion.u", "motion.v", "motion.r", "motion.psi")
_SHOWN = ("compass.u", "compass.v", "motion.r", "compass.heading")

_FIRST_NOISE = 0.2
"""Errors of the motion over its spread, before any is known (project choice; they are estimated afterwards)."""

_ROUNDS = 3
"""Searches, each with the errors that the one before left: they change by less than a tenth in the last."""

_EVALUATIONS = 60
"""Most motions of a search; it needs 20 to 60."""

_WILD = 1e3
"""Error, in standard deviations, at which a motion that leaves all bounds is held."""

_MOST_ALIKE = 0.98
"""Largest correlation of neighbouring errors that counts: a piece has that many independent ones at least."""


def estimate_by_velocities(problem: Problem) -> Estimate | None:
    """Estimate by output error of the velocities; None where the records are too short or the search fails.

    The sum is over sqrt(1 + e^2) - 1 of the errors e in standard deviations (``soft_l1``), so that the stretches that
    the model does not hold do not decide. Neighbouring errors are alike: standard errors count independent ones.

    `problem`: By :func:`.craft_problem`.
    """
    runs = tuple(_by_velocities(run) for run in problem.runs)
    try:
        first = equation_error(problem.with_runs(runs), settings=EquationErrorSettings(scale_prior=False))
        search = _Search(problem.with_runs(tuple(replace(run, seen=_SHOWN) for run in runs)))
        noise = _FIRST_NOISE * np.nanstd(np.concatenate([run.measured for run in runs]), axis=0)
        starts = [np.clip(each, *problem.bounds) for each in (first.values, problem.prior_mean)]
        values = _best_of(search, starts, noise)
        for _ in range(_ROUNDS - 1):
            found = search.least(values, noise)
            values, errors = found.x, [shot.residuals for shot in search.shots(found.x)]
            noise = np.sqrt(np.nanmean(np.concatenate([of_run.reshape(-1, 4) for of_run in errors]) ** 2, axis=0))
        J = search.slopes(values, noise * np.sqrt(_alike(errors)))
        information = np.asarray(J.T @ J)
        covariance = np.linalg.inv(information + problem.prior_precision(problem.prior_error))
    except (InputError, np.linalg.LinAlgError, ValueError):
        return None
    return Estimate(
        method="output_error",
        free=problem.free,
        values=values,
        covariance=np.asarray(covariance),
        information=information,
        noise=dict(zip(_SHOWN, noise.tolist(), strict=True)),
        cost=(2 * float(found.cost),),
    )


class _Search:
    """Output error of a problem whose runs have the velocities; pieces start at what was measured there."""

    def __init__(self, problem: Problem):
        self.problem, self.shooting = problem, Shooting(problem)
        self.pieces = [cut(problem, run, PREDICTED_S) for run in problem.runs]
        self._last: tuple[Array, list[Shot]] | None = None

    def shots(self, values: Array) -> list[Shot]:
        """Motion of all runs; the last one is kept, since slopes are asked for where errors were."""
        if self._last is None or not np.array_equal(self._last[0], values):
            unit = (white(1.0),) * len(_SHOWN)
            shots = [self.shooting.shot(pieces, pieces.starts, values, unit) for pieces in self.pieces]
            self._last = values.copy(), shots
        return self._last[1]

    def slopes(self, values: Array, noise: Array) -> Array:
        """Derivatives of all errors in standard deviations (errors, k)."""
        known, slopes = tuple(white(float(size)) for size in noise), []
        for pieces, shot in zip(self.pieces, self.shots(values), strict=True):
            by = self.shooting.linearised(pieces, shot, values, known)[1][:, :, pieces.starts.shape[1] :]
            slopes.append(np.nan_to_num(by, posinf=0.0, neginf=0.0).reshape(-1, len(values)))
        return np.concatenate(slopes)

    def least(self, start: Array, noise: Array) -> OptimizeResult:
        """Values with the least robust sum of errors and of the distance from what was known before."""
        mean, error, (low, high) = self.problem.prior_mean, self.problem.prior_error, self.problem.bounds

        def weighted(values: Array) -> Array:
            """Errors in standard deviations, and the distance from before as the loss makes it a square."""
            errors = np.concatenate([(shot.residuals / noise).ravel() for shot in self.shots(values)])
            held = np.clip(np.nan_to_num(errors, nan=0.0, posinf=_WILD, neginf=-_WILD), -_WILD, _WILD)
            away = (values - mean) / error
            return np.concatenate([held, away * np.sqrt(1 + away**2 / 4)])

        def slopes(values: Array) -> Array:
            away = (values - mean) / error
            by = (1 + away**2 / 2) / np.sqrt(1 + away**2 / 4)
            return np.concatenate([self.slopes(values, noise), np.diag(by / error)])

        inside, most = np.clip(start, low + 1e-9, high - 1e-9), _EVALUATIONS
        found = least_squares(weighted, inside, slopes, (low, high), x_scale=error, loss="soft_l1", max_nfev=most)
        if np.array_equal(found.x, inside):
            J = found.jac
            refuse_stopped("output error", is_minimum(J.T @ J, found.grad, bounded=(inside, low, high)))
        return found


def _best_of(search: _Search, starts: Sequence[Array], noise: Array) -> Array:
    """The best values of the searches from several starts; raises StoppedSearchError if all stop at theirs."""
    found, stopped = [], None
    for start in starts:
        try:
            found.append(search.least(start, noise))
        except StoppedSearchError as error:
            stopped = error
    if not found:
        raise stopped or ValueError("no start")
    return np.asarray(min(found, key=lambda each: each.cost).x)


def _alike(errors: Sequence[Array]) -> Array:
    """Errors (4,) in a row that count as one: (1 + c)/(1 - c), c the correlation of neighbours."""
    filled = [np.nan_to_num(of_run) for of_run in errors]
    products = sum((of_run[:, 1:] * of_run[:, :-1]).sum(axis=(0, 1)) for of_run in filled)
    c = np.clip(products / sum((of_run**2).sum(axis=(0, 1)) for of_run in filled), 0.0, _MOST_ALIKE)
    return np.asarray((1 + c) / (1 - c))


def _by_velocities(run: SampledRun) -> SampledRun:
    """The run with velocities in place of positions: through the water as measured, else over the ground."""
    track = {name: run.column(SENSED_BY.get(name, name)) for name in ("motion.x", "motion.y", "motion.psi")}
    columns = {name: straight_over_gaps(run.times, column) for name, column in track.items()}
    derived = velocities_of(columns, run.step_s)
    gyro = run.column("gyro.rate")
    derived["motion.r"] = np.where(np.isfinite(gyro), gyro, derived["motion.r"])
    derived["motion.psi"] = columns["motion.psi"]
    for name in ("motion.u", "motion.v"):
        through_water = run.column(name)
        derived[name] = np.where(np.isfinite(through_water), through_water, derived[name])
    return replace(run, measured=np.column_stack([derived[name] for name in _SEEN]), seen=_SEEN)
