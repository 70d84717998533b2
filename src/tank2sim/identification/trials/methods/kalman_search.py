"""The search of the Kalman smoother: parameters by Gauss-Newton with gains held, noise levels by scoring."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tank2sim.arrays import Array
from tank2sim.identification.trials.methods.kalman_gains import Variances, innovation_tangents, varied
from tank2sim.identification.trials.methods.kalman_pass import (
    Batch,
    FilterPass,
    Levels,
    batch_of,
    filter_pass,
    measured_trajectory,
)
from tank2sim.identification.trials.methods.posterior import BLOCK
from tank2sim.identification.trials.methods.process_noise import Disturbed
from tank2sim.identification.trials.problem.estimation_problem import Problem

USUAL_TIME = 0.5
"""Time constant of a random acceleration before the trials, in ship times L/u0, to within a factor of
:data:`TIME_FACTOR` (ours: what a model leaves out of the flow passes with the ship's own length)."""

TIME_FACTOR = 3.0
"""Standard error of that, as a factor (project choice)."""

USUAL_PUSH = 0.2
"""Random acceleration at which the search begins, in nominal values of the state a ship time (ours: rather much, for
then the problem is nearly linear)."""

RANGE = 1e5
"""Factor by which process noise may leave the level at which the search begins, to either side: to nothing, or all."""

_FINEST = 0.1
"""A measurement's noise is at least this share of what its third differences show (ours: a smoothed record is rougher
than its noise, and likelihood would take it for exact)."""

VARIATION = 1e-3
"""Step of the finite differences by the logarithm of a noise level."""

ENOUGH = 0.05
"""A search ends when an iteration gains less in -2 log likelihood: no estimate moves by a quarter of its error."""

LONGEST_STEP = 1.5
"""Largest change of the logarithm of a noise level in an iteration (project choice)."""


@dataclass(frozen=True, eq=False)
class SearchTask:
    """What does not change during a search.

    Parameters
    ----------
    problem : Problem
        k free parameters.
    disturbed : Disturbed
        Its model with random accelerations.
    batch : Batch
        Its runs.
    first : Levels
        Where the levels begin.
    """

    problem: Problem
    disturbed: Disturbed
    batch: Batch
    first: Levels

    def stand(self, values: Array, levels: Levels, along: tuple[Array, Array]) -> Stand:
        """A pass of the filter, linearised along a trajectory (before, after), and -2 log posterior."""
        made = filter_pass(self.disturbed, self.batch, self.problem.parameters(values), levels, along)
        own = ((values - self.problem.prior_mean) / self.problem.prior_error) ** 2
        usual = self.time_precision * (levels.vector - self.first.vector) ** 2
        return Stand(values, levels, made, made.cost + float(own.sum() + usual.sum()))

    def again(self, stand: Stand) -> Stand:
        """The same parameters and levels, looked at once more along the newest trajectory."""
        return self.stand(stand.values, stand.levels, (stand.made.before, stand.made.after))

    def begin(self, values: Array) -> Stand:
        """Where a search begins: linearised along the trajectory of a first pass, which was along what was measured."""
        first = self.stand(values, self.first, measured_trajectory(self.problem, self.batch))
        return self.again(first)

    @property
    def time_precision(self) -> Array:
        """Inverse variance of the levels' logarithms before the trials; 0 except for time constants."""
        m, ny, count = len(self.first.process), len(self.first.measurement), len(self.first.vector)
        precision = np.zeros(count)
        precision[m : count - ny] = 1 / np.log(TIME_FACTOR) ** 2
        return precision

    def moved(self, levels: Levels, matrix: Array, slope: Array, damping: float) -> Levels:
        """Levels after a damped step within their range; one that pushes against an end of it takes no part."""
        first, ny, logs = self.first.vector, len(self.first.measurement), levels.vector
        low, high = first - np.log(RANGE), first + np.log(RANGE)
        low[-ny:] = first[-ny:] + np.log(_FINEST)
        free = ~(((logs <= low) & (slope > 0)) | ((logs >= high) & (slope < 0)))
        own = matrix[np.ix_(free, free)]
        step = np.zeros(len(logs))
        step[free] = np.linalg.solve(own + damping * np.diag(np.diag(own)), slope[free])
        return levels.at(np.clip(logs - np.clip(step, -LONGEST_STEP, LONGEST_STEP), low, high))


@dataclass(frozen=True, eq=False)
class Stand:
    """Where a search stands: parameters (k,), levels, the filter's pass with them, -2 log posterior less a constant."""

    values: Array
    levels: Levels
    made: FilterPass
    cost: float


def task_of(problem: Problem, *, white: bool = False, drifting: bool = False) -> SearchTask:
    """The task of a problem, with white random accelerations or such with a time constant, and sensors that drift."""
    disturbed = Disturbed(problem.model, problem.free, problem.seen, drifting=drifting)
    batch = batch_of(problem, disturbed.lasting)
    return SearchTask(problem, disturbed, batch, _first_levels(problem, disturbed, batch, white))


def _first_levels(problem: Problem, disturbed: Disturbed, batch: Batch, white: bool) -> Levels:
    """Measurement noise from third differences (their variance is 20 times that of white noise), and usual pushes."""
    roughness = []
    for column in np.moveaxis(np.where(batch.known, batch.measured, np.nan), 2, 0):
        known = column[~np.isnan(column)]
        spread = float(known.std()) if len(known) else 1.0
        third = np.diff(column, n=3, axis=1)
        third = third[~np.isnan(third)]
        rough = float(np.sqrt(np.mean(third**2) / 20)) if len(third) else 0.1 * spread
        roughness.append(max(rough, 1e-6 * spread, 1e-12))
    nominal = [state.nominal for state in problem.model.states if state.name in disturbed.pushed]
    drifts = disturbed.lasting - len(nominal)
    process = np.append(USUAL_PUSH * np.array(nominal) / problem.ship_time, roughness[:drifts])
    time = np.full(len(process), USUAL_TIME * problem.ship_time)
    with np.errstate(divide="ignore"):  # log 0 for white
        time = np.log(np.where(white & (np.arange(len(time)) < len(nominal)), 0.0, time))
    return Levels(np.log(process), time, np.log(roughness))


def maximised(
    task: SearchTask, stand: Stand, iterations: int, report: Callable[[Stand], None], *, hold: bool = False
) -> list[Stand]:
    """Damped steps of parameters and levels together while the likelihood grows: where the search stood, best last.

    With `hold` the parameters stay, and only the levels move.
    """
    path, damping = [stand], 0.0
    for _ in range(iterations):
        stand = path[-1]
        H, g = (np.eye(len(stand.values)), np.zeros(len(stand.values))) if hold else normal(task, stand)
        matrix, slope = _level_normal(task, stand)
        for _attempt in range(8):
            values = stand.values - np.linalg.solve(H + damping * np.diag(np.diag(H)), g)
            values = np.clip(values, *task.problem.bounds)
            levels = task.moved(stand.levels, matrix, slope, damping)
            with np.errstate(all="ignore"):  # a step too far may leave all bounds
                tried = task.stand(values, levels, (stand.made.before, stand.made.after))
            if tried.cost < stand.cost:
                break
            damping = max(10 * damping, 1e-2)
        else:
            break
        path.append(tried)
        damping = damping / 10 if damping > 1e-3 else 0.0
        report(tried)
        if stand.cost - tried.cost < ENOUGH:
            break
    return path


def normal(task: SearchTask, stand: Stand) -> tuple[Array, Array]:
    """Normal equations (k, k), (k,) of the parameters, gains held, with the prior."""
    J, r = whitened(stand.made)
    problem = task.problem
    flat = J.reshape(-1, J.shape[-1])
    H: Array = flat.T @ flat + np.diag(1 / problem.prior_error**2)
    g: Array = flat.T @ r.reshape(-1) + (stand.values - problem.prior_mean) / problem.prior_error**2
    return H, g


def scores(task: SearchTask, made: FilterPass) -> list[Array]:
    """Shares (blocks, k) of each run's blocks of time in the gradient."""
    J, r = whitened(made)
    pull = (J * r[..., None]).sum(axis=2)
    found = []
    for one, length, step in zip(pull, task.batch.lengths, task.batch.steps, strict=True):
        blocks = min(length, max(1, round(length * step / (BLOCK * task.problem.ship_time))))
        edges = np.linspace(0, length, blocks + 1).astype(int)[:-1]
        found.append(np.add.reduceat(one[:length], edges, axis=0))
    return found


def whitened(made: FilterPass) -> tuple[Array, Array]:
    """Derivatives (runs, n, ny, k) of the whitened innovations by the parameters, gains held, and themselves."""
    J, _ = innovation_tangents(made.tangents, made.gains)
    return J, made.white


def _level_normal(task: SearchTask, stand: Stand) -> tuple[Array, Array]:
    """Information on the levels' logarithms and slope of half the cost, by finite differences along the trajectory."""
    levels, made = stand.levels, stand.made
    logs = levels.vector
    variants = [levels, *(levels.at(logs + VARIATION * row) for row in np.eye(len(logs)))]
    each = [variant.variances(task.batch, task.disturbed.nominal) for variant in variants]
    variances = Variances(
        np.stack([one.process for one in each]),
        np.stack([one.measurement for one in each]),
        np.stack([one.start for one in each]),
    )
    factors = np.stack([variant.factors(task.batch.steps) for variant in variants])
    cost, information = varied(made.tangents, variances, made.innovations, made.after, factors)
    prior = task.time_precision
    slope = 0.5 * (cost[1:] - cost[0]) / VARIATION + prior * (logs - task.first.vector)
    matrix = information[1:, 1:] / VARIATION**2 + np.diag(prior + 1e-3)  # a level that nothing shows stays
    return matrix, slope
