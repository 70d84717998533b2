"""Recursive estimation: a stochastic approximation of the maximum of likelihood, in order of time.

The innovations of a Kalman filter (:mod:`.kalman`) are processed block by block. After each block the whitened
innovation r and its derivative J by the parameters, carried on from block to block, move the estimate,

    D <- f D + J' J,    b <- f b + J' (J theta - r),    theta = (P + D)^-1 (P m + b),

with m and P the prior's mean and inverse covariance: the recursive prediction-error method in its Gauss-Newton form,
with the gain sequence of Robbins and Monro (1951, Ann. Math. Stat. 22; Ljung and Soderstrom 1983, Theory and Practice
of Recursive Identification, ch. 3). Data are forgotten, never the prior, so that a coefficient without
information does not drift. The path of the estimates shows which coefficients settle, and when.

Pieces that start at measured states are not an alternative: on synthetic ships with process noise their estimates are
biased by up to half of a coefficient, with and without a correction of the initial state.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from tank2sim.arrays import Array
from tank2sim.errors import InputError
from tank2sim.identification.trials.methods.kalman_gains import innovation_tangents
from tank2sim.identification.trials.methods.kalman_pass import FilterPass, filter_pass
from tank2sim.identification.trials.methods.kalman_search import SearchPoint, SearchTask, maximise, task_of
from tank2sim.identification.trials.methods.posterior import BLOCK, sandwich
from tank2sim.identification.trials.problem.estimation_problem import Estimate, Problem, SearchReport, silent

LEVEL_ITERATIONS = 15
"""Most steps of the noise levels before each pass."""


@dataclass(frozen=True)
class RecursiveSettings:
    """Settings of the recursion.

    Parameters
    ----------
    block : float
        Time between two corrections of the estimate in ship times L/u0 (default 1: project choice).
    forgetting : float
        Factor on the weight of older data at each block, above 0 and up to 1 (nothing is forgotten).
    power : float
        The gain of the t-th block is proportional to ``t**-power``, 1/2 < power <= 1 (Robbins and Monro). With 1 all
        blocks weigh alike; with less the early blocks, of poor estimates, weigh less.
    passes : int
        Passes over all runs. Noise levels are those of largest likelihood at the estimate before a pass. In the first
        pass the model is linearised at the current estimate, in each further pass at the last estimate of the previous
        one; each begins with the prior, so that no data count twice.
    white : bool
        Random accelerations are white; else they have a time constant.
    drifting : bool
        Each sensor has a drift next to its white noise.
    """

    block: float = 1.0
    forgetting: float = 1.0
    power: float = 1.0
    passes: int = 3
    white: bool = False
    drifting: bool = False

    def __post_init__(self) -> None:
        if not 0 < self.forgetting <= 1 or not 0.5 < self.power <= 1:
            raise ValueError("forgetting is above 0 and up to 1, power above 1/2 and up to 1")
        if self.block <= 0 or self.passes < 1:
            raise ValueError("block is above 0, passes at least 1")

    def kept(self, number: int) -> float:
        """Factor on the weight of the data before block `number` (from 1) for the gain sequence."""
        if number == 1:
            return self.forgetting
        gain, before = number**-self.power, (number - 1) ** -self.power
        return float(self.forgetting * before * (1 - gain) / gain)


@dataclass(frozen=True, eq=False)
class RecursiveEstimate(Estimate):
    """An estimate with the path to it, in the last pass, after each of n blocks.

    Parameters
    ----------
    times_s : array (n,)
        Time of trials up to the end of each block, s.
    runs : tuple of str
        Name of the run of each block.
    path, path_errors : arrays (n, k)
        Estimates and their standard errors.
    """

    times_s: Array = field(default_factory=lambda: np.zeros(0))
    runs: tuple[str, ...] = ()
    path: Array = field(default_factory=lambda: np.zeros((0, 0)))
    path_errors: Array = field(default_factory=lambda: np.zeros((0, 0)))


@dataclass(frozen=True, eq=False)
class _Step:
    """Normal equations of a block, and the estimate after it."""

    run: int
    length_s: float
    at: Array
    matrix: Array
    vector: Array
    kept: float
    values: Array
    innovations: Array
    cost: float


def recursive(
    problem: Problem,
    start: Array | None = None,
    settings: RecursiveSettings | None = None,
    progress: SearchReport = silent,
) -> RecursiveEstimate:
    """Estimate the free parameters recursively.

    Parameters
    ----------
    problem : Problem
        k free parameters; the model has at least one of u, v and r as a state. The prior is the initial estimate and
        its covariance.
    start : array (k,), optional
        First point of linearisation; by default the prior's mean.
    settings : RecursiveSettings, optional
    progress : callable
        Called with the estimate after each run; its exceptions propagate.

    Raises
    ------
    InputError
        The model's motion leaves all bounds.
    """
    settings = settings or RecursiveSettings()
    task = task_of(problem, white=settings.white, drifting=settings.drifting)
    at = (problem.prior_mean if start is None else start).copy()
    point = task.first_point(at)
    costs: list[float] = []
    for number in range(settings.passes):
        if number:
            point = task.point(at, point.levels, (point.filtered.before, point.filtered.after))
        point = maximise(task, point, LEVEL_ITERATIONS, lambda _: None, hold=True)[0]
        steps: list[_Step] = []
        for step in _pass(task, point, settings, hold=number > 0):
            steps.append(step)
            if steps[-1].run != steps[max(len(steps) - 2, 0)].run:
                progress("recursive", step.values, sum(step.cost for step in steps))
        at = steps[-1].values
        costs.append(sum(step.cost for step in steps))
        progress("recursive", at, costs[-1])
    return _estimate(problem, settings, steps, costs)


def _pass(task: SearchTask, point: SearchPoint, settings: RecursiveSettings, *, hold: bool) -> Iterator[_Step]:
    """Steps over all runs; with `hold` the model stays linearised at the start of the pass."""
    problem, at = task.problem, point.values
    precision = problem.prior_precision(problem.prior_error)
    D, b, number = np.zeros_like(precision), np.zeros(len(at)), 0
    for run, length in enumerate(task.batch.lengths):
        carried: tuple[Array, Array | None, Array | None] = task.batch.starts[run], None, None
        count = max(1, round(length * task.batch.steps[run] / (settings.block * problem.ship_time)))
        edges = np.linspace(0, length, min(count, length) + 1).astype(int)
        for begin, end in pairwise(edges):
            number += 1
            filtered, J, carried = _block(task, point, at, (run, int(begin), int(end)), carried)
            r, flat = filtered.white.reshape(-1), J.reshape(-1, len(at))
            matrix, vector, kept = flat.T @ flat, flat.T @ r, settings.kept(number)
            D, b = kept * D + matrix, kept * b + matrix @ at - vector
            values = np.asarray(np.linalg.solve(precision + D, precision @ problem.prior_mean + b), dtype=float)
            innovations = np.where(task.batch.known[run, begin:end], filtered.innovations[0, : end - begin], np.nan)
            length_s = float((end - begin) * task.batch.steps[run])
            yield _Step(run, length_s, at, matrix, vector, kept, values, innovations, float(r @ r))
            at = at if hold else np.clip(values, *problem.bounds)


def _block(
    task: SearchTask,
    point: SearchPoint,
    at: Array,
    where: tuple[int, int, int],
    carried: tuple[Array, Array | None, Array | None],
) -> tuple[FilterPass, Array, tuple[Array, Array | None, Array | None]]:
    """The filter over a block: pass, derivatives, and start of the next block (state, covariance, derivatives)."""
    run, begin, end = where
    state, spread, tangent = carried
    batch = task.batch.part(run, begin, end, state, spread)
    rows = slice(run, run + 1), slice(begin, end + 1)
    along = point.filtered.before[rows], point.filtered.after[rows]
    filtered = filter_pass(task.disturbed, batch, task.problem.parameters(at), point.levels, along)
    if not np.isfinite(filtered.cost):
        name = task.problem.runs[run].origin
        raise InputError(name, "", "the model's motion leaves all bounds", "start from a card nearer to the ship")
    J, last = innovation_tangents(filtered.tangents, filtered.gains, tangent)
    return filtered, J, (filtered.before[0, -1], filtered.gains.P[0, -1], last)


def _estimate(
    problem: Problem, settings: RecursiveSettings, steps: list[_Step], costs: list[float]
) -> RecursiveEstimate:
    values = steps[-1].values
    group = max(1, round(BLOCK / settings.block))
    before = problem.prior_precision(problem.prior_error)
    information, covariances = np.zeros_like(steps[0].matrix), []
    weighted: list[Array] = []
    for step in steps:
        information = step.kept * information + step.matrix
        weighted = [*(step.kept * score for score in weighted), step.vector + step.matrix @ (values - step.at)]
        covariances.append(sandwich(information, problem.prior_error, _blocks(weighted, steps, group), before))
    innovations = np.concatenate([step.innovations for step in steps])
    count = np.count_nonzero(~np.isnan(innovations), axis=0)
    deviations = np.sqrt(np.nansum(innovations**2, axis=0) / np.where(count > 0, count, np.nan))
    return RecursiveEstimate(
        method="recursive",
        free=problem.free,
        values=values,
        covariance=covariances[-1],
        information=information,
        noise=dict(zip(problem.seen, map(float, deviations), strict=True)),
        cost=tuple(costs),
        times_s=np.cumsum([step.length_s for step in steps]),
        runs=tuple(problem.runs[step.run].name for step in steps),
        path=np.stack([step.values for step in steps]),
        path_errors=np.sqrt(np.stack([np.diag(covariance) for covariance in covariances])),
    )


def _blocks(scores: list[Array], steps: list[_Step], group: int) -> list[Array]:
    """Scores of each run, summed over `group` blocks at a time."""
    runs = np.array([step.run for step in steps[: len(scores)]])
    every = np.stack(scores)
    by_run = [every[runs == run] for run in np.unique(runs)]
    return [np.add.reduceat(run_scores, np.arange(0, len(run_scores), group), axis=0) for run_scores in by_run]
