"""Kalman smoother with maximum likelihood: parameters, process noise and measurement noise from the innovations.

Random accelerations (first-order Gauss-Markov, or white) act on the rates of u, v and r, and each measured signal has
white noise. An extended Kalman filter predicts each measurement from the earlier ones; -2 log of their likelihood is

    sum over instants of  log det S + e' S^-1 e,

with e the innovation and S its covariance (Schweppe 1965, IEEE Trans. Inf. Theory 11; Maine and Iliff 1981, SIAM J.
Appl. Math. 41). Gains are computed once for each iterate and then held, so that the residual is the innovation of a
fixed-gain observer and Gauss-Newton applies with exact derivatives; noise levels move by scoring on the same
likelihood. The limits are output error without process noise, and equation error with large process noise.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from tank2sim.arrays import Array
from tank2sim.identification.trials.methods.gauss_newton import is_minimum, refuse_stopped
from tank2sim.identification.trials.methods.kalman_gains import smooth_states
from tank2sim.identification.trials.methods.kalman_pass import FilterPass, Levels
from tank2sim.identification.trials.methods.kalman_search import (
    SearchPoint,
    SearchTask,
    maximise,
    normal,
    scores,
    task_of,
)
from tank2sim.identification.trials.methods.posterior import evidence_scale, sandwich, scaled_prior
from tank2sim.identification.trials.problem.estimation_problem import Estimate, Problem, SearchReport, silent

_ROUNDS = 3
"""Most widths of the prior in a search."""

SAME_SCALE = 0.05
"""A relative change of the prior's width below this counts as none (project choice)."""


@dataclass(frozen=True)
class KalmanSettings:
    """Settings of the Kalman smoother."""

    white: bool = False  # Random accelerations are independent from step to step; else their time constant is estimated
    # Each sensor has a drift next to its white noise, also first-order Gauss-Markov (three to six times as
    # slow)
    drifting: bool = False
    # Multiply the prior's standard errors, by groups, by the factor of largest evidence, at least 1
    scale_prior: bool = True
    iterations: int = 40  # Most iterations for each width of the prior


@dataclass(frozen=True)
class CorrelatedNoise:
    """Time-correlated noise: a random acceleration on the rate of a state, or the drift of a sensor."""

    # Standard deviation in m/s2, rad/s2 or the signal's unit; for white noise, of its mean over a step
    deviation: float
    time_s: float  # Time constant, s; 0 for white noise


@dataclass(frozen=True, eq=False)
class Smoothed:
    """Smoothed run."""

    name: str  # Name of the run
    # `states`, `state_errors`: (n, nx): The model's states and their standard errors (parameters taken as
    # exact)
    states: Array
    state_errors: Array
    # `accelerations`, `acceleration_errors`: (n, m): Random accelerations, unexplained by the model, over the
    # step after each instant, in the order of :attr:`KalmanEstimate.process_noise`, m/s2 or rad/s2. Times the
    # mass matrix they are unexplained forces.
    accelerations: Array
    acceleration_errors: Array
    drifts: Array  # (n, ny): Drifts of the sensors, in the signals' units; (n, 0) without drift
    innovations: Array  # (n, ny): Whitened: independent with unit variance if the model holds; nan where not measured


@dataclass(frozen=True, eq=False)
class KalmanEstimate(Estimate):
    """An estimate with its noise levels."""

    process_noise: Mapping[str, CorrelatedNoise] = field(default_factory=dict)  # By state, as ``motion.u``
    # Standard deviation of the white noise by measured variable (``noise`` holds that of the innovations)
    measurement_noise: Mapping[str, float] = field(default_factory=dict)
    # Drift of each sensor by measured variable; empty without drift
    drift: Mapping[str, CorrelatedNoise] = field(default_factory=dict)
    smoothed: tuple[Smoothed, ...] = ()  # In the order of the runs


def kalman(
    problem: Problem,
    start: Array | None = None,
    settings: KalmanSettings | None = None,
    progress: SearchReport = silent,
    levels: Levels | None = None,
) -> KalmanEstimate:
    """Estimate the free parameters and the noise levels by maximum likelihood of the innovations.

    `problem`: k free parameters; the model has at least one of u, v and r as a state. `start` (k,): Start of the
    search; by default the prior's mean. `progress`: Called with each better estimate; its exceptions propagate.
    `levels`: Noise levels at the start; by default from the measurements. Raises StoppedSearchError: The search cannot
    move from its start, although the data ask for it.
    """
    settings = settings or KalmanSettings()
    task = task_of(problem, white=settings.white, drifting=settings.drifting)
    best = task.first_point((problem.prior_mean if start is None else start).copy(), levels)
    costs: tuple[float, ...] = ()
    scale: Mapping[str, float] = {}
    for number in range(_ROUNDS):
        best, found = maximise(
            task, best, settings.iterations, lambda point: progress("kalman", point.values, point.cost)
        )
        costs += found
        if not costs:
            stays = is_minimum(*normal(task, best), bounded=(best.values, *problem.bounds))
            refuse_stopped("the Kalman filter", stays)
        wanted = evidence_scale(problem, _information(task, best), best.values, scale)
        same = all(abs(factor / scale.get(group, 1.0) - 1) < SAME_SCALE for group, factor in wanted.items())
        if not settings.scale_prior or number == _ROUNDS - 1 or same:
            break
        scale = wanted
        task = replace(task, problem=replace(problem, prior_error=scaled_prior(problem, scale)))
        best = task.relinearise(best)
    return estimate_at(task, best, costs, scale)


def _information(task: SearchTask, point: SearchPoint) -> Array:
    """Information of the trials alone (k, k)."""
    return normal(task, point)[0] - task.problem.prior_precision(task.problem.prior_error)


def estimate_at(
    task: SearchTask, best: SearchPoint, costs: tuple[float, ...] = (), scale: Mapping[str, float] | None = None
) -> KalmanEstimate:
    """The estimate at a point of the search.

    `costs`: Of the search. `scale`: Factors on the prior's standard errors by group.
    """
    problem, batch = task.problem, task.batch
    information = _information(task, best)
    before = problem.prior_precision(problem.prior_error)
    spread = np.sqrt((best.filtered.innovations**2).sum(axis=(0, 1)) / np.maximum(batch.known.sum(axis=(0, 1)), 1))
    each = zip(np.exp(best.levels.process), np.exp(best.levels.time), strict=True)
    correlated = [CorrelatedNoise(float(deviation), float(time)) for deviation, time in each]
    return KalmanEstimate(
        method="kalman",
        free=problem.free,
        values=best.values,
        covariance=sandwich(information, problem.prior_error, scores(task, best.filtered), before),
        information=information,
        noise=dict(zip(problem.seen, map(float, spread), strict=True)),
        cost=costs,
        prior_scale=dict(scale or {}),
        process_noise=dict(zip(task.disturbed.pushed, correlated, strict=False)),
        drift=dict(zip(problem.seen, correlated[len(task.disturbed.pushed) :], strict=False)),
        measurement_noise=dict(zip(problem.seen, map(float, np.exp(best.levels.measurement)), strict=True)),
        smoothed=_smoothed_runs(task, best.filtered),
    )


def _smoothed_runs(task: SearchTask, filtered: FilterPass) -> tuple[Smoothed, ...]:
    nx, nxm = len(task.disturbed.nominal), len(task.disturbed.nominal) + len(task.disturbed.pushed)
    states, errors = smooth_states(
        filtered.tangents.A, filtered.tangents.C, filtered.gains, filtered.before, filtered.innovations
    )
    white = np.where(task.batch.known, filtered.white, np.nan)
    return tuple(
        Smoothed(
            run.name,
            states[number, :n, :nx],
            errors[number, :n, :nx],
            states[number, :n, nx:nxm],
            errors[number, :n, nx:nxm],
            states[number, :n, nxm:],
            white[number, :n],
        )
        for number, (run, n) in enumerate(zip(task.problem.runs, task.batch.lengths, strict=True))
    )
