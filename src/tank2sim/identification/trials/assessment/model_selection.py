"""Model selection by information criteria, and by the prediction of manoeuvres held out of the fit.

Of models that predict alike the simplest is taken: the rule of one standard error (Breiman et al. 1984,
Classification and Regression Trees, 3.4.3; Hastie, Tibshirani and Friedman 2009, 7.10).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np
from scipy.signal import correlate

from tank2sim.arrays import Array
from tank2sim.errors import InputError
from tank2sim.identification.trials.assessment.evaluation import pooled, replay_error
from tank2sim.identification.trials.methods.posterior import scaled_prior
from tank2sim.identification.trials.methods.weak_form import WeakForm
from tank2sim.identification.trials.problem.estimation_problem import Estimate, Problem
from tank2sim.identification.trials.problem.picklable import Portable, map_tasks
from tank2sim.identification.trials.problem.sampled_runs import SampledRun

FARTHEST = 4
"""One in this many runs, those of largest amplitude, is held out to test extrapolation (project choice)."""

RESAMPLINGS = 1000
"""Random weights of folds over which predictive weights are averaged (project choice: 0.01 of a weight)."""

TrialEstimator = Callable[[Problem], Estimate]
Score = Callable[[Problem, Estimate], float]
"""``score(problem of the held-out runs, estimate) -> error``, the smaller the better."""


@dataclass(frozen=True)
class Criteria:
    """Information criteria, the smaller the better; to compare models of the same runs."""

    # `aic`, `bic`: Akaike (1974) and Schwarz (1978): -2 log likelihood + 2 k, + k log n
    aic: float
    bic: float
    samples: float  # n, number of independent residuals with the same information as these coloured ones
    # k, effective number that the trials determine: a parameter held by the prior counts less than one
    parameters: float


def criteria(problem: Problem, estimate: Estimate, samples: float | None = None) -> Criteria:
    """Information criteria from the weak form's residuals, which are comparable between models of the same runs.

    `problem`: Prior and runs. `estimate`: By any method. `samples`: n, by default from the residuals of this model;
    give every model the n of the first, or differences in n exceed those in fit.
    """
    form = WeakForm(problem)
    windows = form.at(estimate.values)
    series = [window.residuals[piece] for window, run in zip(windows, form.runs, strict=True) for piece in run.pieces]
    prior = scaled_prior(problem, estimate.prior_scale)
    scaled = estimate.information * np.outer(prior, prior)
    kept = np.trace(np.linalg.solve(scaled + problem.known, problem.known))
    return criteria_of(series, float(len(prior) - kept), samples)


def criteria_of(series: Sequence[Array], parameters: float, samples: float | None = None) -> Criteria:
    """Information criteria of Gaussian residuals: `series` of pieces (n, m) without gaps, covariance unknown.

    -2 log likelihood is n log det of the residuals' covariance; n is `samples`, by default :func:`effective_samples`.
    """
    every = np.concatenate(series)
    n = effective_samples(series) if samples is None else samples
    deviance = n * float(np.linalg.slogdet(every.T @ every / len(every))[1])
    return Criteria(deviance + 2 * parameters, deviance + parameters * math.log(n), n, parameters)


def effective_samples(series: Sequence[Array]) -> float:
    """Number of independent residuals with the same information: N / (1 + 2 sum of autocorrelations).

    The sum ends at the first that is not positive (Geyer 1992, Statistical Science 7). `series` are pieces (n, m); the
    m components are taken together, each in units of its own deviation.
    """
    every = np.concatenate(series)
    size = np.sqrt(np.mean(every**2, axis=0))
    longest = max(len(piece) for piece in series)
    sums = np.zeros(longest)
    for piece in series:
        for column in (piece / np.where(size > 0, size, 1.0)).T:
            sums[: len(piece)] += correlate(column, column, method="fft")[len(piece) - 1 :]  # by lag, from 0
    correlations = sums[1:] / sums[0]
    negative = np.flatnonzero(correlations <= 0)
    positive = correlations[: negative[0]] if len(negative) else correlations
    return float(max(1.0, len(every) / (1 + 2 * positive.sum())))


@dataclass(frozen=True)
class HeldOutFold:
    """A fit without some of the runs, and its error on them."""

    held_out: tuple[str, ...]  # Names of the runs
    error: float  # Error on them, by the score; inf where the fit or the prediction failed
    values: Array  # (k,): Estimates without them, empty where the fit failed


@dataclass(frozen=True)
class CrossValidation:
    """Prediction of manoeuvres held out of the fit."""

    single: tuple[HeldOutFold, ...]  # Each run held out once, in the order of the runs
    extrapolation: HeldOutFold  # The runs of largest amplitude held out together

    @property
    def errors(self) -> Array:
        """Errors of all folds (runs + 1,), extrapolation last."""
        return np.array([*(fold.error for fold in self.single), self.extrapolation.error])


def cross_validate(
    problem: Problem | Portable, estimator: TrialEstimator, score: Score, executor: Executor | None = None
) -> CrossValidation:
    """Hold out one run at a time, and then the runs of largest amplitude together.

    `problem`: Portable (:func:`tank2sim.identification.trials.problem.picklable.portable`) if the executor works in
    other processes; `estimator` and `score` are then functions of a module, or partials of one. `estimator`:
    ``estimator(problem) -> Estimate``. `score`: ``score(problem, estimate) -> float``, where the problem has the
    held-out runs. `executor`: By default the folds run in sequence in this process. Raises InputError: The problem has
    fewer than two runs.
    """
    runs = problem.runs
    if len(runs) < 2:
        raise InputError(runs[0].origin, "", "is the only run", "cross-validation needs two runs at least")
    groups = [*((place,) for place in range(len(runs))), farthest(runs)]
    tasks = [(problem, group, estimator, score) for group in groups]
    *single, last = map_tasks(_fold, tasks, executor)
    return CrossValidation(tuple(single), last)


def farthest(runs: Sequence[SampledRun]) -> tuple[int, ...]:
    """Indices of the runs of largest amplitude, one in :data:`FARTHEST` and one at least.

    Amplitude: the 95th percentile of the absolute yaw rate, or of the heading's slope where it was not measured.
    """
    amplitudes = []
    for run in runs:
        rate = run.column("motion.r")
        if np.isnan(rate).all():
            rate = np.gradient(run.column("motion.psi"), run.step_s)
        amplitudes.append(0.0 if np.isnan(rate).all() else float(np.nanpercentile(np.abs(rate), 95)))
    count = max(1, len(runs) // FARTHEST)
    return tuple(sorted(np.argsort(amplitudes, kind="stable")[::-1][:count].tolist()))


def simplest(candidates: Mapping[str, CrossValidation]) -> str:
    """Name of the simplest model whose errors are not significantly larger than those of the best.

    `candidates`: Name to cross-validation over the same runs, from the simplest model to the one with most parameters.

    The best model has the least mean error over all folds. A simpler model is as good if the mean of its paired
    differences from the best is within one standard error of that mean; pairs cancel the difficulty of each fold.
    """
    if not candidates:
        raise ValueError("the mapping has no candidates")
    errors = {name: candidate.errors for name, candidate in candidates.items()}
    best = min(errors, key=lambda name: float(np.mean(errors[name])))

    def as_good(name: str) -> bool:
        difference = errors[name] - errors[best]
        if name == best or not np.isfinite(difference).all():
            return name == best
        return bool(difference.mean() <= difference.std(ddof=1) / math.sqrt(len(difference)))

    return next(name for name in errors if as_good(name))


def predictive_weights(candidates: Mapping[str, CrossValidation], samples: Sequence[float]) -> dict[str, float]:
    """Weight of each model by its predictions of the runs held out one at a time; they add up to 1.

    The predictive log density of fold f is -n_f log(error), up to a constant: that of n_f Gaussian residuals whose
    variance is what it turns out to be. With few folds a sum over them claims too much, so that the weights (Akaike's)
    are averaged over random weights of the folds, the Bayesian bootstrap: pseudo-BMA+ of Yao, Vehtari, Simpson and
    Gelman (2018), Bayesian Analysis 13, (7) to (10).

    `candidates`: Name to cross-validation over the same runs. `samples`: n_f, number of independent residuals in each
    run.
    """
    names = list(candidates)
    errors = np.array([[fold.error for fold in candidates[name].single] for name in names])
    density = -np.asarray(samples) * np.log(np.where(np.isfinite(errors), errors, 1e6))
    folds = np.random.default_rng(0).dirichlet(np.ones(len(samples)), RESAMPLINGS) * len(samples)
    scores = folds @ density.T
    weights = np.exp(scores - scores.max(axis=1, keepdims=True))
    weights /= weights.sum(axis=1, keepdims=True)
    return dict(zip(names, weights.mean(axis=0).tolist(), strict=True))


def yaw_rate_error(problem: Problem, estimate: Estimate) -> float:
    """A score: error of the yaw rate over free-running windows, as a share of it (:mod:`.evaluation`)."""
    spreads = np.nanstd(np.concatenate([run.measured for run in problem.runs]), axis=0)
    weights = {name: float(spread) or 1.0 for name, spread in zip(problem.seen, spreads, strict=True)}
    return pooled(replay_error(problem, estimate.values, weights, whole=False), "motion.r")


def _fold(task: tuple[Problem | Portable, tuple[int, ...], TrialEstimator, Score]) -> HeldOutFold:
    posed, group, estimator, score = task
    problem = posed.problem() if isinstance(posed, Portable) else posed
    held_out = tuple(run for place, run in enumerate(problem.runs) if place in group)
    fitted = tuple(run for place, run in enumerate(problem.runs) if place not in group)
    names = tuple(run.name for run in held_out)
    try:
        estimate = estimator(problem.with_runs(fitted))
        error = float(score(problem.with_runs(held_out), estimate))
    except (InputError, np.linalg.LinAlgError):
        return HeldOutFold(names, math.inf, np.empty(0))
    return HeldOutFold(names, error if math.isfinite(error) else math.inf, estimate.values)
