"""The fit of a craft by the Kalman smoother, what each trial contributed, and free-running predictions.

Gusts are random accelerations, slow errors of receiver and compass are drifts of the sensors, current and mean wind
are constant in a trial: :mod:`tank2sim.identification.trials.methods.kalman`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from tank2sim.arrays import Array
from tank2sim.errors import InputError
from tank2sim.identification.craft.first_values import PREDICTED_S, estimate_by_velocities
from tank2sim.identification.craft.problem import (
    COMPASS_SPREADS,
    DISTURBANCES,
    FORCE_SPREAD,
    deviates,
    with_disturbances,
)
from tank2sim.identification.trials.methods.gauss_newton import StoppedSearchError
from tank2sim.identification.trials.methods.kalman import (
    KalmanEstimate,
    KalmanSettings,
    SearchPoint,
    SearchTask,
    Smoothed,
    estimate_at,
    kalman,
    normal,
    task_of,
)
from tank2sim.identification.trials.methods.kalman_pass import PUSHED, FilterFault, Levels, smooth_states
from tank2sim.identification.trials.problem.estimation_problem import Estimate, Problem, SearchReport, silent
from tank2sim.identification.trials.problem.sampled_runs import SampledRun
from tank2sim.simulation.sensitivity import Sensitivity

PREDICTION_LEAD_S = 10.0
"""Time of a held-out trial in which the filter finds its state, s: several time constants (project choice)."""

SHORTEST_PREDICTION_S = 10.0
"""Shortest prediction that counts, s (project choice)."""

IDENTIFIED_SHARE = 0.25
"""Largest standard error of an identified coefficient, over its value (project choice: its sign is then certain at four
standard errors)."""

TRIALS_SHARE = 0.5
"""Largest standard error after the trials over that before of a coefficient that they determine (project choice)."""

STABILISING = ("derivatives.Yv", "derivatives.Yvabsv", "derivatives.Nr", "derivatives.Nrabsr")
"""Coefficients whose damping holds a craft on its course."""

STRONGER = (1.0, 2.0, 4.0, 8.0, 16.0)
"""Factors on these with which the search begins, one after the other (project choice)."""

FEWEST_TRIALS = 5
"""Fewest trials whose currents and winds determine how much these differ (project choice)."""

_DISTURBED_SHARES = (1.0, 0.3, 0.1, 0.03, 0.01)
"""Spreads of current and wind, over the usual ones, that are tried with an estimate that knows neither."""

_NEARLY_NONE = 0.1
"""Largest of these shares with which there is next to no current and wind: 0.03 m/s (project choice)."""

_WAYS = (1.0, 0.75, 0.5)
"""Shares of the way from the card to an estimate that are tried, the first that a filter follows being taken."""

_STEPS_FROM_NEAR = 20
"""Most steps of a search that begins at the estimate by velocities, each of the filter over all trials."""

LEAST_SPREAD = 0.03
"""Least spread of a disturbance between trials, over that before them: 0.01 m/s of a current (project choice)."""

_EXPECTATIONS = 1000
"""Rounds after which the spread between trials no longer changes in what is printed."""

_LINEARISATIONS = 5
"""Passes of the filter, each linearised along the one before: the trajectory of the last no longer moves."""

AXES = {f"motion.{key}": words for key, words in (("u", "surge"), ("v", "sway"), ("r", "yaw"), ("psi", "heading"))}
AXES |= {"motion.x": "position to north", "motion.y": "position to east"}
"""Names of the motion's states in messages."""


class CoefficientVerdict(StrEnum):
    """Estimate of a coefficient from the trials."""

    IDENTIFIED = "identified"
    BOUNDED = "bounded"
    PRIOR = "not determined"


@dataclass(frozen=True, eq=False)
class CraftFit:
    """Fit of a craft."""

    problem: Problem
    estimate: KalmanEstimate  # Estimate of the k free parameters
    by_run: Array  # (runs, k, k): Information of each run
    # Random acceleration in surge that the filter needs, over that by the largest thrust; inf if it loses a trial
    gust_share: float = 0.0

    @property
    def holds(self) -> bool:
        """Whether the filter explains the trials by the model, and gusts by no more than the wind that is expected."""
        return self.gust_share <= FORCE_SPREAD

    @property
    def verdicts(self) -> tuple[CoefficientVerdict, ...]:
        """Verdict on each free parameter (k,).

        Identified: the error is at most :data:`IDENTIFIED_SHARE` of the value. Bounded: the trials have narrowed it to
        :data:`TRIALS_SHARE` of what was known before. Else it is not determined.
        """
        values, errors = np.abs(self.estimate.values), self.estimate.standard_errors
        certain = np.where(
            errors <= IDENTIFIED_SHARE * values, CoefficientVerdict.IDENTIFIED, CoefficientVerdict.BOUNDED
        )
        unknown = errors > TRIALS_SHARE * self.problem.prior_error
        return tuple(map(CoefficientVerdict, np.where(unknown, CoefficientVerdict.PRIOR, certain).tolist()))

    @property
    def undetermined(self) -> list[str]:
        """Free parameters of the craft that the trials do not determine."""
        pairs = zip(self.problem.free, self.verdicts, strict=True)
        return [name for name, each in pairs if each is CoefficientVerdict.PRIOR and name not in COMPASS_SPREADS]

    def best_run(self, place: int) -> int:
        """The run without which the standard error of a free parameter would grow most."""
        prior = self.problem.prior_precision(self.problem.prior_error)
        whole = self.by_run.sum(axis=0) + prior
        variances = [np.linalg.inv(whole - share)[place, place] for share in self.by_run]
        return int(np.argmax(variances))


def fit_craft(problem: Problem, progress: SearchReport = silent) -> CraftFit:
    """Estimate the free parameters of a craft with the noise levels.

    The compass has a deviation where the estimate by velocities shows one. The search begins at that estimate, which is
    taken itself where the model does not hold (:attr:`CraftFit.holds`), or where the filter loses a trial. With
    :data:`FEWEST_TRIALS` the filter searches twice: the second time current, wind and bias of each trial are known
    beforehand as well as they agreed between trials the first time (empirical Bayes), for they change slowly.

    `problem`: By :func:`.craft_problem`. `progress`: Called with each better estimate.
    """
    found = estimate_by_velocities(problem)
    if found is None or not deviates(found):
        problem = problem.without(COMPASS_SPREADS)  # what the trials do not show only widens the others
        found = estimate_by_velocities(problem)
    steps = KalmanSettings.iterations if found is None else _STEPS_FROM_NEAR
    settings = KalmanSettings(drifting=True, scale_prior=False, iterations=steps)
    try:
        fit = _fit_of(problem, _first_estimate(problem, settings, progress, found))
    except InputError:
        if found is None or (other := _at_velocities(problem, found)) is None:
            raise
        return replace(other, gust_share=np.inf)
    if found is not None and not fit.holds and (other := _at_velocities(problem, found)):
        return replace(other, gust_share=fit.gust_share)
    if len(problem.runs) < FEWEST_TRIALS:
        return fit
    narrower = with_disturbances(problem, *_disturbances_of(problem, fit.estimate.smoothed))
    try:
        return _fit_of(narrower, kalman(narrower, fit.estimate.values, settings, progress, fit.estimate.levels))
    except InputError:  # it stops, or loses a trial: the first estimate stays
        return fit


def _fit_of(problem: Problem, estimate: KalmanEstimate) -> CraftFit:
    """The fit of an estimate by the filter."""
    thrust = problem.model["disturbance.north"].nominal / FORCE_SPREAD
    mass = problem.parameters(estimate.values)[problem.model.parameter_names.index("ship.mass")]
    gusts = float(estimate.process_noise["motion.u"].deviation * mass / thrust)
    return CraftFit(problem, estimate, information(problem, estimate.values, estimate.levels), gusts)


def _at_velocities(problem: Problem, found: Estimate) -> CraftFit | None:
    """The fit with the estimate by velocities, with the spread of current and wind that predicts best.

    Where the filter loses the motion, the estimate goes only a part of the way from the card (:data:`_WAYS`). None if
    it loses it still, or if predictions are best with current or wind, which the estimate ignores.
    """
    for way in _WAYS:
        values = problem.prior_mean + way * (found.values - problem.prior_mean)
        fits = _filtered_with(problem, replace(found, values=values))
        if fits:
            best = min(fits, key=lambda share: _unpredicted(fits[share]))
            return fits[best] if best <= _NEARLY_NONE else None
    return None


def _filtered_with(problem: Problem, found: Estimate) -> dict[float, CraftFit]:
    """Fits with an estimate, by the share of the usual current and wind, where the filter follows the motion."""
    wide = np.array([problem.model[name].nominal for name in DISTURBANCES])
    outside = np.array([name != "gyro.bias" for name in DISTURBANCES])
    fits = {}
    for share in _DISTURBED_SHARES:
        posed = with_disturbances(problem, np.zeros(len(wide)), np.where(outside, share * wide, wide))
        task = task_of(posed, drifting=True)
        try:
            point = task.first_point(found.values)
            by_run = information(posed, found.values, task.first)
        except (InputError, np.linalg.LinAlgError):
            continue
        if not np.isfinite(point.cost):
            continue
        filtered = estimate_at(task, point)
        estimate = replace(
            filtered, method=found.method, covariance=found.covariance, information=found.information, cost=found.cost
        )
        fits[share] = CraftFit(posed, estimate, by_run)
    return fits


def _unpredicted(fit: CraftFit) -> float:
    """Errors at the ends of free predictions of the fitted trials, rms distance times rms heading; inf if they fail."""
    try:
        ends = np.concatenate([np.zeros((0, 3)), *(found.ends for found in predict_free(fit, fit.problem.runs))])
    except InputError:
        return np.inf
    distance, turned = np.hypot(ends[:, 0], ends[:, 1]), np.angle(np.exp(1j * ends[:, 2]))
    seen = np.isfinite(distance) & np.isfinite(turned)
    return float(np.sqrt(np.mean(distance[seen] ** 2) * np.mean(turned[seen] ** 2))) if seen.any() else np.inf


def _first_estimate(
    problem: Problem, settings: KalmanSettings, progress: SearchReport, by_velocities: Estimate | None
) -> KalmanEstimate:
    """The estimate from that by velocities, from the card, or with stronger damping if that craft is too unstable."""
    damping = np.array([name in STABILISING for name in problem.free])
    task = task_of(problem, drifting=True)
    fault: InputError | None = None
    starts = [np.where(damping, factor * problem.prior_mean, problem.prior_mean) for factor in STRONGER]
    for start in starts if by_velocities is None else [by_velocities.values, *starts]:
        try:
            point = task.first_point(start)
            if point.filtered.wild is not None:
                raise FilterFault(point.filtered.wild)
            if all(np.isfinite(part).all() for part in normal(task, point)):
                return kalman(problem, start, settings, progress)
        except FilterFault as error:
            fault = fault or not_followed(problem, error.place)
        except StoppedSearchError as error:
            fault = fault or error
    raise fault or not_followed(problem, (0, 0, 0))


def not_followed(problem: Problem, place: tuple[int, int, int]) -> InputError:
    """The error that names trial, time and axis at which the filter loses the motion (run, instant, state)."""
    run = problem.runs[place[0]]
    names = [*problem.model.state_names, *(f"random acceleration {name}" for name in PUSHED)]
    name = names[place[2]] if place[2] < len(names) else "the drift of a sensor"
    axis = AXES.get(name, name)
    remedy = "check mass, thrust curves and damping of the card, and the places and signs of the thrusters"
    where = f"{axis} at {run.times[place[1]]:.4g} s"
    return InputError(run.origin, where, "the card does not move as the trial does, not even roughly", remedy)


def _disturbances_of(problem: Problem, runs: Sequence[Smoothed]) -> tuple[Array, Array]:
    """Mean and spread (5,) of the disturbances over the trials; the spread is within the known one."""
    places = [problem.model.state_names.index(name) for name in DISTURBANCES]
    wide = np.array([problem.model[name].nominal for name in DISTURBANCES])
    if len(runs) < FEWEST_TRIALS:
        return np.zeros(len(wide)), wide
    found = np.stack([smoothed.states[0, places] for smoothed in runs])
    errors = np.stack([smoothed.errors[0, places] for smoothed in runs])
    pairs = [spread_between(*columns) for columns in zip(found.T, errors.T, wide, strict=True)]
    means, spreads = map(np.array, zip(*pairs, strict=True))
    return means, np.clip(spreads, LEAST_SPREAD * wide, wide)


def spread_between(found: Array, errors: Array, before: float) -> tuple[float, float]:
    """Mean and standard deviation of a quantity over trials, without the errors with which each trial shows it.

    Normal in the trials and between them; the greatest likelihood, by expectation and maximisation (Dempster, Laird
    and Rubin 1977, J. R. Stat. Soc. B 39).

    `found`, `errors` (n,): Value of each trial and its standard error, known beforehand to be 0 within `before`.

    Examples
    --------
    >>> import numpy as np
    >>> mean, spread = spread_between(np.array([0.9, 1.1, 1.0, 1.0]), np.full(4, 0.1), 100.0)
    >>> round(mean, 3), spread < 0.01
    (1.0, True)
    """
    precision = np.maximum(1 / np.maximum(errors, 1e-9 * before) ** 2 - 1 / before**2, 1e-6 / before**2)
    alone = found / errors**2 / precision
    mean, variance = float(np.average(alone, weights=precision)), before**2
    for _ in range(_EXPECTATIONS):
        left = 1 / (precision + 1 / variance)
        each = left * (precision * alone + mean / variance)
        mean = float(each.mean())
        variance = float(np.mean((each - mean) ** 2 + left))
    return mean, float(np.sqrt(variance))


def information(problem: Problem, values: Array, levels: Levels) -> Array:
    """Information of each run of a problem (runs, k, k) at parameters and noise levels."""
    J = _point(problem, values, levels)[1].filtered.slopes
    flat = J.reshape(len(J), -1, J.shape[-1])
    return np.asarray(np.swapaxes(flat, 1, 2) @ flat)


def _point(problem: Problem, values: Array, levels: Levels) -> tuple[SearchTask, SearchPoint]:
    """A pass of the filter over the runs; a linearisation that fails is left out.

    Raises InputError: The filter loses the motion of a trial; the message names trial, time and axis.
    """
    task = task_of(problem, drifting=True)
    # A signal that is constant in these runs has no noise of its own, and a filter that takes it as exact breaks down.
    task = replace(task, first=task.first.at(np.maximum(task.first.vector, levels.vector)))
    try:
        point = task.first_point(values, levels)
    except FilterFault as error:
        raise not_followed(problem, error.place) from None
    if point.filtered.wild is not None:
        raise not_followed(problem, point.filtered.wild)
    for _ in range(_LINEARISATIONS):
        try:
            newer = task.relinearise(point)
        except np.linalg.LinAlgError:
            break
        if not np.isfinite(newer.cost):
            break
        point = newer
    return task, point


@dataclass(frozen=True, eq=False)
class FreePrediction:
    """Free-running predictions of a held-out run, and the motion that the smoother gives."""

    run: SampledRun
    rows: Sequence[int]  # Instants predicted
    # `predicted`, `smoothed`: (m, 3): u, v (m/s through the water) and r (rad/s)
    predicted: Array
    smoothed: Array
    # (p, 3): Error of x, y (m) and psi (rad) at the end of each prediction: predicted less measured, nan if not
    # measured
    ends: Array


def predict_free(fit: CraftFit, runs: Sequence[SampledRun]) -> list[FreePrediction]:
    """Predictions of :data:`PREDICTED_S` of each run by recorded revolutions, from the state that the filter has there.

    Nothing measured after its beginning enters a prediction; current and wind stay as they were found until then.

    `runs`: Held-out trials, of the same problem.
    """
    problem = fit.problem.with_runs(tuple(runs))
    names = problem.model.state_names
    task, point = _point(problem, fit.estimate.values, fit.estimate.levels)
    filtered, nx = point.filtered, len(names)
    states, _ = smooth_states(filtered)
    motion = [names.index(f"motion.{letter}") for letter in "uvr"]
    pose = ("motion.x", "motion.y", "motion.psi")
    placed = [names.index(name) for name in pose]
    measured = [problem.seen.index(name) for name in ("motion.x", "motion.y", "compass.heading")]
    sensitivity = Sensitivity(problem.model, problem.free, problem.seen)
    p = problem.parameters(fit.estimate.values)
    found = []
    for number, run in enumerate(runs):
        rows, predicted, ends = [], [], []
        count, length = len(run.measured), round(PREDICTED_S / run.step_s)
        begin = round(PREDICTION_LEAD_S / run.step_s)
        parts = task.disturbed.parts(filtered.after[number, :count], run.inputs, p, run.step_s)
        while count - begin >= SHORTEST_PREDICTION_S / run.step_s:
            end = min(begin + length, count)
            inputs = np.repeat(run.inputs[begin : end - 1], parts, axis=0)
            free = sensitivity.motion(filtered.after[number, begin, :nx], inputs, p, run.step_s / parts)[::parts]
            if not np.isfinite(free).all():
                instant, state = np.argwhere(~np.isfinite(free))[0].tolist()
                raise not_followed(problem, (number, begin + instant, state))
            rows.append(np.arange(begin + 1, end))
            predicted.append(free[1:, motion])
            ends.append(free[-1, placed] - run.measured[end - 1, measured])
            begin = end
        if rows:
            at = np.concatenate(rows)
            motions = np.concatenate(predicted), states[number, at][:, motion]
            found.append(FreePrediction(run, at.tolist(), *motions, np.array(ends)))
    return found


def predict_by_card(problem: Problem) -> list[FreePrediction]:
    """Predictions of each run as :func:`predict_free`, by the numbers of the card; noise levels come from the runs.

    The other runs, if there are enough, give current and wind of a run beforehand.

    `problem`: By :func:`.craft_problem`.
    """
    # The filter estimates something: one number of the card, within a millionth.
    first, error = problem.prior_mean[:1], 1e-6 * (np.abs(problem.prior_mean[:1]) + 1e-6)
    held = replace(problem, free=problem.free[:1], prior_mean=first, prior_error=error)
    estimate = kalman(held, first, KalmanSettings(drifting=True, scale_prior=False))
    found = []
    for number, run in enumerate(problem.runs):
        smoothed = (*estimate.smoothed[:number], *estimate.smoothed[number + 1 :])
        alone = held.with_runs((run,))
        if smoothed:
            alone = with_disturbances(alone, *_disturbances_of(held, smoothed))
        found += predict_free(CraftFit(alone, estimate, np.zeros((1, 1, 1))), [run])
    return found


def determination(predicted: Array, truth: Array) -> Array:
    """R^2 of each column (n, m): 1 less the sum of squared errors over that about the mean.

    `predicted`, `truth` (n, m).

    Examples
    --------
    >>> import numpy as np
    >>> determination(np.array([[1.0], [2.0], [3.0]]), np.array([[1.0], [2.0], [4.0]])).round(3)
    array([0.786])
    """
    errors: Array = ((predicted - truth) ** 2).sum(axis=0)
    return np.asarray(1 - errors / ((truth - truth.mean(axis=0)) ** 2).sum(axis=0))
