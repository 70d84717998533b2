"""Kalman smoother with maximum likelihood: parameters, process noise and measurement noise from the innovations.

On the rates of u, v and r act random accelerations (first-order Gauss-Markov, or white), on each measured signal white
noise. An extended Kalman filter predicts each measurement from those before it; -2 log of their likelihood is

    sum over instants of  log det S + e' S^-1 e,

with e the innovation and S its covariance (Schweppe 1965, IEEE Trans. Inf. Theory 11; Maine and Iliff 1981, SIAM J.
Appl. Math. 41). Gains are taken once for each iterate and then held, so that the residual is the innovation of a
fixed-gain observer and Gauss-Newton applies with exact derivatives; noise levels move by scoring on the same
likelihood. Little process noise makes it output error, much makes it equation error.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from tank2sim.arrays import Array
from tank2sim.identification.trials.methods.kalman_gains import smooth_states
from tank2sim.identification.trials.methods.kalman_pass import FilterPass
from tank2sim.identification.trials.methods.kalman_search import SearchTask, Stand, maximised, normal, scores, task_of
from tank2sim.identification.trials.methods.posterior import evidence_scale, sandwich, scaled_prior
from tank2sim.identification.trials.problem.estimation_problem import Estimate, Problem, SearchReport, silent

_ROUNDS = 3
"""Widths of the prior that are tried, at most."""

SAME_SCALE = 0.05
"""A change of the prior's width by less than this share is none (project choice)."""


@dataclass(frozen=True)
class KalmanSettings:
    """How the Kalman smoother is done.

    Parameters
    ----------
    white : bool
        Random accelerations are drawn again in each step, else they have a time constant that is estimated.
    drifting : bool
        Each sensor has a drift next to its white noise, also first-order Gauss-Markov (three to six times as slow).
    scale_prior : bool
        The prior's standard errors are multiplied, by groups, by the factor of largest evidence, at least 1.
    iterations : int
        At most that many for each width of the prior.
    """

    white: bool = False
    drifting: bool = False
    scale_prior: bool = True
    iterations: int = 40


@dataclass(frozen=True)
class Lasting:
    """Noise with a memory: a random acceleration on the rate of one state, or the drift of a sensor.

    Parameters
    ----------
    deviation : float
        Standard deviation, m/s2 or rad/s2, or the signal's unit; of white noise that of its mean over a step.
    time_s : float
        Time constant, s; 0 for white noise.
    """

    deviation: float
    time_s: float


@dataclass(frozen=True, eq=False)
class Smoothed:
    """One run as the smoother sees it.

    Parameters
    ----------
    name : str
        Of the run.
    states, state_errors : arrays (n, nx)
        The model's states and their standard errors (parameters taken as exact).
    accelerations, acceleration_errors : arrays (n, m)
        What the model does not explain: random accelerations over the step that follows each instant, in the order of
        :attr:`KalmanEstimate.process_noise`, m/s2 or rad/s2. Times the mass matrix they are unexplained forces.
    drifts : array (n, ny)
        Of the sensors, in the signals' units; (n, 0) without.
    innovations : array (n, ny)
        Whitened: independent with unit variance if all is right; nan where nothing was measured.
    """

    name: str
    states: Array
    state_errors: Array
    accelerations: Array
    acceleration_errors: Array
    drifts: Array
    innovations: Array


@dataclass(frozen=True, eq=False)
class KalmanEstimate(Estimate):
    """An estimate with its noise.

    Parameters
    ----------
    process_noise : mapping
        By state, as ``motion.u``.
    measurement_noise : mapping
        Standard deviation of the white noise by measured variable (``noise`` holds that of the innovations).
    drift : mapping
        Of each sensor by measured variable; empty without.
    smoothed : tuple of Smoothed
        In the order of the runs.
    """

    process_noise: Mapping[str, Lasting] = field(default_factory=dict)
    measurement_noise: Mapping[str, float] = field(default_factory=dict)
    drift: Mapping[str, Lasting] = field(default_factory=dict)
    smoothed: tuple[Smoothed, ...] = ()


def kalman(
    problem: Problem,
    start: Array | None = None,
    settings: KalmanSettings | None = None,
    progress: SearchReport = silent,
) -> KalmanEstimate:
    """Estimate the free parameters and the noise levels by maximum likelihood of the innovations.

    Parameters
    ----------
    problem : Problem
        k free parameters; the model has at least one of u, v and r as a state.
    start : array (k,), optional
        Where the search begins; by default the prior's mean.
    settings : KalmanSettings, optional
    progress : callable
        Called with each better estimate; what it raises passes through.
    """
    settings = settings or KalmanSettings()
    task = task_of(problem, white=settings.white, drifting=settings.drifting)
    begin = task.begin((problem.prior_mean if start is None else start).copy())
    path, asked = [begin], problem
    scale: Mapping[str, float] = {}
    for number in range(_ROUNDS):
        path += maximised(task, path[-1], settings.iterations, lambda one: progress("kalman", one.values, one.cost))[1:]
        wanted = evidence_scale(asked, _information(task, path[-1]), path[-1].values, scale)
        same = all(abs(one / scale.get(group, 1.0) - 1) < SAME_SCALE for group, one in wanted.items())
        if not settings.scale_prior or number == _ROUNDS - 1 or same:
            break
        scale = wanted
        task = replace(task, problem=replace(asked, prior_error=scaled_prior(asked, scale)))
        path = [*path[:-1], task.again(path[-1])]
    return _estimate(task, path, scale)


def _information(task: SearchTask, stand: Stand) -> Array:
    """What the trials alone tell (k, k)."""
    information: Array = normal(task, stand)[0] - np.diag(1 / task.problem.prior_error**2)
    return information


def _estimate(task: SearchTask, path: list[Stand], scale: Mapping[str, float]) -> KalmanEstimate:
    problem, batch, best = task.problem, task.batch, path[-1]
    information = _information(task, best)
    spread = np.sqrt((best.made.innovations**2).sum(axis=(0, 1)) / np.maximum(batch.known.sum(axis=(0, 1)), 1))
    each = zip(np.exp(best.levels.process), np.exp(best.levels.time), strict=True)
    lasting = [Lasting(float(deviation), float(time)) for deviation, time in each]
    return KalmanEstimate(
        method="kalman",
        free=problem.free,
        values=best.values,
        covariance=sandwich(information, problem.prior_error, scores(task, best.made)),
        information=information,
        noise=dict(zip(problem.seen, map(float, spread), strict=True)),
        cost=tuple(stand.cost for stand in path[1:]),
        prior_scale=dict(scale),
        process_noise=dict(zip(task.disturbed.pushed, lasting, strict=False)),
        drift=dict(zip(problem.seen, lasting[len(task.disturbed.pushed) :], strict=False)),
        measurement_noise=dict(zip(problem.seen, map(float, np.exp(best.levels.measurement)), strict=True)),
        smoothed=_smoothed_runs(task, best.made),
    )


def _smoothed_runs(task: SearchTask, made: FilterPass) -> tuple[Smoothed, ...]:
    nx, nxm = len(task.disturbed.nominal), len(task.disturbed.nominal) + len(task.disturbed.pushed)
    states, errors = smooth_states(made.tangents.A, made.tangents.C, made.gains, made.before, made.innovations)
    white = np.where(task.batch.known, made.white, np.nan)
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
