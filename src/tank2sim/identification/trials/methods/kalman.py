"""Kalman smoother with maximum likelihood: parameters, process noise and measurement noise from the innovations.

Random accelerations (first-order Gauss-Markov, or white) act on the rates of u, v and r, and each measured signal has
white noise. An extended Kalman filter predicts each measurement from the earlier ones; -2 log of their likelihood is

    sum over instants of  log det S + e' S^-1 e,

with e the innovation and S its covariance (Schweppe 1965, IEEE Trans. Inf. Theory 11; Maine and Iliff 1981, SIAM J.
Appl. Math. 41). Gains are computed once for each iterate and then held, so that the residual is the innovation of a
fixed-gain observer and Gauss-Newton applies with exact derivatives; noise levels move by scoring on the same
likelihood. The limits are output error without process noise, and equation error with large process noise.

The search of the Kalman smoother: parameters by Gauss-Newton with gains held, noise levels by scoring.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from tank2sim.arrays import Array
from tank2sim.identification.trials.methods.gauss_newton import damped_gauss_newton, is_minimum, refuse_stopped
from tank2sim.identification.trials.methods.kalman_pass import (
    Batch,
    Disturbed,
    FilterPass,
    Levels,
    Variances,
    batch_of,
    filter_pass,
    measured_trajectory,
    smooth_states,
    variant_likelihoods,
)
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

USUAL_TIME = 0.5
"""Time constant of a random acceleration before the trials, in ship times L/u0, to within a factor of
:data:`TIME_FACTOR` (project choice: unmodelled flow passes with the ship's own length)."""

TIME_FACTOR = 3.0
"""Standard error of that, as a factor (project choice)."""

USUAL_PUSH = 0.2
"""Random acceleration at which the search begins, in nominal values of the state a ship time (project
choice: rather large, because the problem is then nearly linear)."""

RANGE = 1e5
"""Factor on the first process noise within which the search stays: practically none, or all."""

_FINEST = 0.1
"""A measurement's noise is at least this share of the value from its third differences (project choice: a smoothed
record is rougher than its noise, and the likelihood would treat it as exact)."""

_SHORTER = (1.0, 0.5, 0.25, 0.125)
"""Shares of the way from one trajectory of linearisation to the next, until a pass succeeds (project choice)."""

VARIATION = 1e-3
"""Step of the finite differences in the logarithm of a noise level."""

ENOUGH = 0.05
"""A search ends when an iteration gains less in -2 log likelihood: no estimate moves by a quarter of its error."""

LONGEST_STEP = 1.5
"""Largest change of the logarithm of a noise level in an iteration (project choice)."""


@dataclass(frozen=True, eq=False)
class SearchTask:
    """Constants of a search."""

    problem: Problem  # k free parameters
    disturbed: Disturbed  # The problem's model with random accelerations
    batch: Batch  # The problem's runs
    first: Levels  # First noise levels

    def point(self, values: Array, levels: Levels, along: tuple[Array, Array]) -> SearchPoint:
        """A pass of the filter, linearised along a trajectory (before, after), and -2 log posterior."""
        filtered = filter_pass(self.disturbed, self.batch, self.problem.parameters(values), levels, along)
        penalty = self.problem.before(values, self.problem.prior_error)[2]
        level_penalty = self.time_precision * (levels.vector - self.first.vector) ** 2
        return SearchPoint(values, levels, filtered, filtered.cost + float(penalty + level_penalty.sum()))

    def relinearise(self, point: SearchPoint) -> SearchPoint:
        """The same parameters and levels, linearised along the newest trajectory."""
        return self.point(point.values, point.levels, point.filtered.trajectory)

    def first_point(self, values: Array, levels: Levels | None = None) -> SearchPoint:
        """First point, linearised along the trajectory of a pass that is linearised along the measurements.

        The pass along the measurements has the first noise levels, which are wide, so that it follows them. A second
        pass that fails goes only a part of the way from the measurements to that trajectory.
        """
        along = measured_trajectory(self.problem, self.batch)
        first = self.point(values, self.first, along)
        levels = levels or self.first
        if not np.isfinite(first.cost):
            return first
        for share in _SHORTER:
            way = [old + share * (new - old) for old, new in zip(along, first.filtered.trajectory, strict=True)]
            try:
                point = self.point(values, levels, (way[0], way[1]))
            except np.linalg.LinAlgError:
                continue
            if np.isfinite(point.cost):
                return point
        return first

    @property
    def time_precision(self) -> Array:
        """Inverse variance of the levels' logarithms before the trials; 0 except for time constants."""
        m, ny, count = len(self.first.process), len(self.first.measurement), len(self.first.vector)
        precision = np.zeros(count)
        precision[m : count - ny] = 1 / np.log(TIME_FACTOR) ** 2
        return precision

    def move_levels(self, levels: Levels, matrix: Array, slope: Array, damping: float) -> Levels:
        """Levels after a step by `matrix` and `slope`, with `damping`, within their range; at an end none moves."""
        first, ny, logs = self.first.vector, len(self.first.measurement), levels.vector
        low, high = first - np.log(RANGE), first + np.log(RANGE)
        low[-ny:] = first[-ny:] + np.log(_FINEST)
        free = ~(((logs <= low) & (slope > 0)) | ((logs >= high) & (slope < 0)))
        reduced = matrix[np.ix_(free, free)]
        step = np.zeros(len(logs))
        step[free] = np.linalg.solve(reduced + damping * np.diag(np.diag(reduced)), slope[free])
        return levels.at(np.clip(logs - np.clip(step, -LONGEST_STEP, LONGEST_STEP), low, high))


@dataclass(frozen=True, eq=False)
class SearchPoint:
    """Point of a search: parameters (k,), levels, the filter's pass with them, -2 log posterior less a constant."""

    values: Array
    levels: Levels
    filtered: FilterPass
    cost: float


def task_of(problem: Problem, *, white: bool = False, drifting: bool = False) -> SearchTask:
    """The search task of a problem, with `white` or correlated random accelerations, and with drifting sensors."""
    disturbed = Disturbed(problem.model, problem.free, problem.seen, drifting=drifting)
    batch = batch_of(problem, disturbed.correlated)
    return SearchTask(problem, disturbed, batch, _first_levels(problem, disturbed, batch, white))


def _first_levels(problem: Problem, disturbed: Disturbed, batch: Batch, white: bool) -> Levels:
    """Measurement noise from third differences (their variance is 20 times the white noise's); usual pushes."""
    roughness = []
    for column in np.moveaxis(np.where(batch.known, batch.measured, np.nan), 2, 0):
        known = column[~np.isnan(column)]
        spread = float(known.std()) if len(known) else 1.0
        third = np.diff(column, n=3, axis=1)
        third = third[~np.isnan(third)]
        if not len(third):  # a receiver slower than the grid
            third = np.concatenate([np.diff(run[~np.isnan(run)], n=3) for run in column])
        rough = float(np.sqrt(np.mean(third**2) / 20)) if len(third) else 0.1 * spread
        roughness.append(max(rough, 1e-6 * spread, 1e-12))
    nominal = [state.nominal for state in problem.model.states if state.name in disturbed.pushed]
    drifts = disturbed.correlated - len(nominal)
    process = np.append(USUAL_PUSH * np.array(nominal) / problem.ship_time, roughness[:drifts])
    time = np.full(len(process), USUAL_TIME * problem.ship_time)
    with np.errstate(divide="ignore"):  # log 0 for white
        time = np.log(np.where(white & (np.arange(len(time)) < len(nominal)), 0.0, time))
    return Levels(np.log(process), time, np.log(roughness))


def maximise(
    task: SearchTask, start: SearchPoint, iterations: int, report: Callable[[SearchPoint], None]
) -> tuple[SearchPoint, tuple[float, ...]]:
    """Damped steps of parameters and levels together while the likelihood grows: the best point, and all their costs.

    At most `iterations` steps.
    """

    def linearise(point: SearchPoint) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
        return normal(task, point), _level_normal(task, point)

    def move(
        point: SearchPoint, system: tuple[tuple[Array, Array], tuple[Array, Array]], damping: float
    ) -> SearchPoint:
        (H, g), (matrix, slope) = system
        values = point.values - np.linalg.solve(H + damping * np.diag(np.diag(H)), g)
        levels = task.move_levels(point.levels, matrix, slope, damping)
        if np.isnan(values).any() or np.isnan(np.concatenate([levels.process, levels.time, levels.measurement])).any():
            return replace(point, cost=np.inf)
        along = point.filtered.trajectory
        with np.errstate(all="ignore"):  # too long a step may leave all bounds
            try:
                return task.point(np.clip(values, *task.problem.bounds), levels, along)
            except np.linalg.LinAlgError:  # a motion so unstable that the covariance is not a number
                return replace(point, cost=np.inf)

    def is_last(better: SearchPoint, gain: float) -> bool:
        report(better)
        return gain < ENOUGH

    return damped_gauss_newton(start, linearise, move, is_last, iterations, damping_range=(1e-3, 1e-2))[:2]


def normal(task: SearchTask, point: SearchPoint) -> tuple[Array, Array]:
    """Normal equations (k, k), (k,) of the parameters, gains held, with the prior."""
    problem, filtered = task.problem, point.filtered
    flat = filtered.slopes.reshape(-1, len(problem.free))
    prior, pull, _ = problem.before(point.values, problem.prior_error)
    return np.asarray(flat.T @ flat + prior), np.asarray(flat.T @ filtered.white.reshape(-1) + pull)


def scores(task: SearchTask, filtered: FilterPass) -> list[Array]:
    """Contribution (blocks, k) of each run's blocks of time to the gradient."""
    pull = (filtered.slopes * filtered.white[..., None]).sum(axis=2)
    found = []
    for run_pull, length, step in zip(pull, task.batch.lengths, task.batch.steps, strict=True):
        blocks = min(length, max(1, round(length * step / (BLOCK * task.problem.ship_time))))
        edges = np.linspace(0, length, blocks + 1).astype(int)[:-1]
        found.append(np.add.reduceat(run_pull[:length], edges, axis=0))
    return found


def _level_normal(task: SearchTask, point: SearchPoint) -> tuple[Array, Array]:
    """Information on the levels' logarithms and slope of half the cost, by finite differences along the trajectory."""
    levels, filtered = point.levels, point.filtered
    logs = levels.vector
    variants = [levels, *(levels.at(logs + VARIATION * row) for row in np.eye(len(logs)))]
    each = [variant.variances(task.batch, task.disturbed.nominal) for variant in variants]
    variances = Variances(
        np.stack([variant.process for variant in each]),
        np.stack([variant.measurement for variant in each]),
        np.stack([variant.start for variant in each]),
        task.batch.lengths,
    )
    factors = np.stack([variant.factors(task.batch.steps) for variant in variants])
    cost, information = variant_likelihoods(filtered.tangents, variances, filtered.innovations, filtered.after, factors)
    prior = task.time_precision
    slope = 0.5 * (cost[1:] - cost[0]) / VARIATION + prior * (logs - task.first.vector)
    matrix = information[1:, 1:] / VARIATION**2 + np.diag(prior + 1e-3)  # a level without information does not move
    return matrix, slope


_ROUNDS = 3
"""Most widths of the prior in a search."""

SAME_SCALE = 0.05
"""A relative change of the prior's width below this counts as none (project choice)."""


@dataclass(frozen=True)
class KalmanSettings:
    """Settings of the Kalman smoother."""

    white: bool = False  # Random accelerations are independent from step to step; else their time constant is estimated
    # Each sensor has a drift next to its white noise, also first-order Gauss-Markov (three to six times as slow)
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
    """Smoothed run: the nx states of the model; the random accelerations, unexplained by it, over the step after each
    instant, m/s2 or rad/s2 (times the mass matrix they are unexplained forces); the drifts of the sensors, if any."""

    states: Array  # (n, nz)
    errors: Array  # (n, nz): Standard errors of the states, parameters taken as exact
    innovations: Array  # (n, ny): Whitened: independent with unit variance if the model holds; nan where not measured


@dataclass(frozen=True, eq=False, kw_only=True)
class KalmanEstimate(Estimate):
    """An estimate with its noise levels."""

    levels: Levels  # As the filter takes them
    process_noise: Mapping[str, CorrelatedNoise] = field(default_factory=dict)  # By state, as ``motion.u``
    # Standard deviation of the white noise by measured variable (``noise`` holds the innovations')
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
    filtered, known = best.filtered, batch.known
    spread = np.sqrt((filtered.innovations**2).sum(axis=(0, 1)) / np.maximum(known.sum(axis=(0, 1)), 1))
    states, errors = smooth_states(filtered)
    white = np.where(known, filtered.white, np.nan)
    lengths = enumerate(batch.lengths)
    each = zip(np.exp(best.levels.process), np.exp(best.levels.time), strict=True)
    correlated = [CorrelatedNoise(float(deviation), float(time)) for deviation, time in each]
    return KalmanEstimate(
        method="kalman",
        free=problem.free,
        values=best.values,
        covariance=sandwich(information, problem.prior_error, scores(task, filtered), before),
        information=information,
        noise=dict(zip(problem.seen, map(float, spread), strict=True)),
        cost=costs,
        prior_scale=dict(scale or {}),
        levels=best.levels,
        process_noise=dict(zip(task.disturbed.pushed, correlated, strict=False)),
        drift=dict(zip(problem.seen, correlated[len(task.disturbed.pushed) :], strict=False)),
        measurement_noise=dict(zip(problem.seen, map(float, np.exp(best.levels.measurement)), strict=True)),
        smoothed=tuple(Smoothed(states[run, :n], errors[run, :n], white[run, :n]) for run, n in lengths),
    )
