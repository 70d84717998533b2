"""Prediction intervals of manoeuvring figures, and the scatter of estimates, by simulation with random disturbances.

Each member has its own random generator (numpy's SeedSequence, spawned): results depend on the seed alone, not on the
executor or the order of its work.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import nullcontext, suppress
from dataclasses import dataclass, replace
from functools import lru_cache

import casadi as ca
import numpy as np

from tank2sim.arrays import Array
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.dynamics import build
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tank2sim.identification.trials.assessment.evaluation import Comparison, compare_card
from tank2sim.identification.trials.assessment.model_selection import Criteria, criteria
from tank2sim.identification.trials.assessment.residual_forces import (
    Disturbances,
    disturbances_of,
    disturbed,
    draw_disturbances,
    fastest_rate,
)
from tank2sim.identification.trials.methods.shooting import cut
from tank2sim.identification.trials.problem.estimation_problem import Estimate, Problem
from tank2sim.identification.trials.problem.measured_motion import sensor_noise
from tank2sim.identification.trials.problem.picklable import PicklableShip, Portable, map_tasks, portable
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.identification.trials.problem.sampled_runs import SampledRun
from tank2sim.simulation.figures import Figures
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.manoeuvres import Manoeuvre
from tank2sim.simulation.recorded import Recorded, recorded, repeat, steerable
from tank2sim.simulation.rows import Chain, RowFunction
from tank2sim.simulation.run import simulate
from tank2sim.simulation.scheme import runge_kutta_step
from tank2sim.units import from_si

NORMAL_95 = 1.96
"""Half the width of a normal distribution's 95 % interval, in standard deviations."""

IN_BANDS = {f"overshoots_deg.{number}": f"overshoot_{number}_deg" for number in (1, 2)}
"""Name of a figure in :class:`Bands` to its name in a comparison, where they differ."""


@dataclass(frozen=True, eq=False)
class FittedProblem:
    """A problem, its estimate, and the card with it; `whole` for a comparison with runs at all their speeds."""

    problem: Problem
    estimate: Estimate
    card: ManoeuvringCard
    whole: bool = False


@dataclass(frozen=True, eq=False)
class WeightedFit:
    """A fit in one of several structures, and the weight of its predictions."""

    fit: FittedProblem
    weight: float


@dataclass(frozen=True)
class PredictionSettings:
    """Number of members, seed and quantiles."""

    members: int = 200  # Simulations; 200 give the ends of a 95 % band to about a tenth of its width (project choice)
    seed: int = 0
    levels: tuple[float, ...] = (0.025, 0.5, 0.975)  # Levels of the quantiles


@dataclass(frozen=True, eq=False)
class Bands:
    """Predicted distribution of the figures of a manoeuvre."""

    levels: tuple[float, ...]
    # Figure to its value at each level; those of a list are ``overshoots_deg.1`` and so on
    quantiles: Mapping[str, tuple[float, ...]]
    members: Mapping[str, Array]  # Figure to its value in each member (members,), nan where not reached
    failed: int  # Members whose motion left all bounds


def bands(
    ship: PicklableShip,
    estimate: Estimate,
    manoeuvre: Manoeuvre | Recorded,
    disturbances: Disturbances | None = None,
    settings: PredictionSettings | None = None,
    executor: Executor | None = None,
) -> Bands:
    """Bands of a manoeuvre's figures: coefficients drawn from their covariance, or from samples of their posterior, and
    random forces during the manoeuvre.

    `ship`: The model is driven by the rudder's order, also if the trials were driven by its angle. `estimate`: Values
    and covariance of parameters of the ship's model; drawn values stay within the model's bounds. `manoeuvre`: One of
    :mod:`tank2sim.simulation.manoeuvres`, or a recorded one, repeated from its start. `disturbances`: By default none:
    only coefficients are uncertain. `executor`: By default the members run in sequence in this process. Raises
    InputError: The motion of every member leaves all bounds.
    """
    settings = settings or PredictionSettings()
    ship = replace(ship, driven_by="order")
    model = ship.model()
    tasks = []
    for rng in _generators(settings):
        values = _within_bounds(model, estimate.free, estimate.draw(rng))
        if disturbances is not None:
            values |= draw_disturbances(disturbances, fastest_rate(model), rng)
        tasks.append((ship, manoeuvre, values))
    results = list(map_tasks(_figures, tasks, executor))
    reached = [figures for figures in results if figures is not None]
    if not reached:
        raise InputError(model.origin, "", "the motion leaves all bounds in every member", "check the estimates")
    names = list(dict.fromkeys(name for figures in reached for name in figures))
    members = {
        name: np.array([np.nan if figures is None else figures.get(name, np.nan) for figures in results])
        for name in names
    }
    members = {name: column for name, column in members.items() if not np.isnan(column).all()}
    quantiles = {name: tuple(map(float, np.nanquantile(member, settings.levels))) for name, member in members.items()}
    return Bands(settings.levels, quantiles, members, len(results) - len(reached))


def bootstrap(
    problem: Portable,
    estimate: Estimate,
    estimator: Callable[[Problem], Estimate],
    disturbances: Disturbances,
    settings: PredictionSettings | None = None,
    executor: Executor | None = None,
) -> Array:
    """Parametric bootstrap: estimates (members, k) from runs that were simulated with the estimate (Efron 1979).

    Each run is simulated under its own inputs, with random forces and white noise of the sensors' size; the prior means
    are drawn, too, around the estimate. Members in which a run leaves all bounds are omitted; this happens in long runs
    of a course-unstable ship.

    `problem`: The estimated problem. `estimate`: The true values of the simulation. `estimator`: ``estimator(problem)
    -> Estimate``; a function of a module for an executor of processes. `disturbances`: Random forces on the simulated
    ship. `settings`, `executor`: As for :func:`bands`.
    """
    tasks = [(problem, estimate, estimator, disturbances, rng) for rng in _generators(settings or PredictionSettings())]
    estimates = [values for values in map_tasks(_again, tasks, executor) if values is not None]
    return np.array(estimates).reshape(-1, len(estimate.free))


def _generators(settings: PredictionSettings) -> list[np.random.Generator]:
    return [np.random.default_rng(seed) for seed in np.random.SeedSequence(settings.seed).spawn(settings.members)]


def _within_bounds(model: Model, names: tuple[str, ...], values: Array) -> dict[str, float]:
    within = {}
    for name, value in zip(names, values, strict=True):
        lowest, highest = model[name].minimum, model[name].maximum
        within[name] = float(np.clip(value, lowest, highest)) if (lowest, highest) != (None, None) else float(value)
    return within


@lru_cache(maxsize=8)
def _integrator(ship: PicklableShip) -> Integrator:
    return Integrator(disturbed(ship.model()))


def _figures(task: tuple[PicklableShip, Manoeuvre | Recorded, dict[str, float]]) -> dict[str, float] | None:
    """Figures of one member, None if its motion leaves all bounds."""
    ship, manoeuvre, values = task
    integrator = _integrator(ship)
    try:
        if isinstance(manoeuvre, Recorded):
            return flat(repeat(manoeuvre, integrator, values).figures)
        return flat(simulate(integrator.model, manoeuvre, parameters=values, integrator=integrator).figures)
    except InputError:
        return None


def flat(figures: Figures) -> dict[str, float]:
    """Figures as single numbers: those of a list with their position in the name, None as nan."""
    single: dict[str, float] = {}
    for name, value in figures.items():
        if isinstance(value, list | tuple):
            single |= {f"{name}.{place}": float(item) for place, item in enumerate(value, start=1)}
        else:
            single[name] = float(value) if isinstance(value, int | float) else np.nan
    return single


@dataclass(frozen=True, eq=False)
class _Simulator:
    """Motion of a disturbed ship, and its observed values."""

    model: Model
    steps: Chain
    shown: RowFunction


@lru_cache(maxsize=8)
def _simulator(ship: PicklableShip, seen: tuple[str, ...]) -> _Simulator:
    model = disturbed(ship.model())
    shown = ca.densify(model.expand(ca.vcat([model.symbol(name) for name in seen])))
    function = ca.Function("shown", [model.x, model.u, model.p], [shown], {"cse": True})
    return _Simulator(model, Chain(runge_kutta_step(model)), RowFunction(function))


_Again = tuple[Portable, Estimate, Callable[[Problem], Estimate], Disturbances, np.random.Generator]


def _again(task: _Again) -> Array | None:
    """The estimate from one simulated set of runs, None if a run leaves all bounds."""
    portable, estimate, estimator, disturbances, rng = task
    problem = portable.problem()
    simulator = _simulator(portable.ship, problem.seen)
    runs = []
    for run in problem.runs:
        forces = draw_disturbances(disturbances, fastest_rate(simulator.model), rng)
        values = dict(zip(estimate.free, map(float, estimate.values), strict=True))
        p = simulator.model.parameter_values({**values, **forces})
        measured = _simulated(problem, run, simulator, p)
        if measured is None:
            return None
        noise = sensor_noise(problem, run) * rng.standard_normal(measured.shape)
        runs.append(replace(run, measured=np.where(np.isnan(run.measured), np.nan, measured + noise)))
    correlated = np.linalg.cholesky(np.linalg.inv(problem.known)) @ rng.standard_normal(len(estimate.values))
    mean = estimate.values + problem.prior_error * correlated
    return estimator(replace(problem, runs=tuple(runs), prior_mean=mean)).values


def _simulated(problem: Problem, run: SampledRun, simulator: _Simulator, p: Array) -> Array | None:
    """Observed values (n, ny) of a run under its own inputs; None if the motion leaves all bounds."""
    start = np.append(cut(problem, run, None).starts[0], 0.0)  # the clock is the last state
    states = simulator.steps.run(start, run.inputs[:-1], p, np.array([run.step_s]))
    if not np.isfinite(states).all() or np.abs(states).max() > 1e9:
        return None
    return simulator.shown(states, run.inputs, p)[0]


def compare_held_out(
    fitted: FittedProblem,
    held: Measured,
    members: int,
    executor: Executor | None = None,
    average: Sequence[WeightedFit] = (),
) -> Comparison:
    """Comparison of the new card with held-out trials, with a 95 % prediction interval of each figure.

    The intervals are of simulations with coefficients drawn from their covariance, under random forces with the size
    and correlation time of those that the fit does not explain (:func:`bands`). They are wider by what is uncertain of
    the measured point and of the heading's zero (:class:`.recorded.Recorded`). With an `average` over structures, which
    holds `fitted`, the members of each are as many as its weight says.
    """
    plain = compare_card(fitted.card, held, fitted.estimate.noise, whole=fitted.whole)
    if not members or not plain.figures:
        return plain
    model = build(steerable(fitted.card))
    intervals: dict[tuple[str, str], tuple[float, float]] = {}
    for trial in held.trials:
        manoeuvre = recorded(trial, model)
        if manoeuvre is None:
            continue
        pooled_members: dict[str, list[Array]] = {}
        for part in average or (WeightedFit(fitted, 1.0),):
            settings = PredictionSettings(members=round(part.weight * members))
            for name, values in _members(part.fit, manoeuvre, settings, executor).items():
                pooled_members.setdefault(name, []).append(values)
        for name, parts in pooled_members.items():
            lowest, median, highest = np.nanquantile(np.concatenate(parts), PredictionSettings().levels)
            figure = IN_BANDS.get(name, name)
            error = NORMAL_95 * from_si(figure, manoeuvre.reading_errors.get(figure, 0.0))
            below, above = math.hypot(median - lowest, error), math.hypot(highest - median, error)
            intervals[trial.name, figure] = (median - below, median + above)
    figures = tuple(replace(figure, interval=intervals.get((figure.trial, figure.name))) for figure in plain.figures)
    return replace(plain, figures=figures)


def _members(
    fitted: FittedProblem, manoeuvre: Recorded, settings: PredictionSettings, executor: Executor | None
) -> Mapping[str, Array]:
    """Figure to its value in each member of a fit; empty where no member's motion stays within bounds."""
    if not settings.members:
        return {}
    ship = PicklableShip(steerable(fitted.card).text, "order")
    # Without an executor by threads: half of a simulation is machine code, and processes would begin too slowly.
    making = nullcontext(executor) if executor is not None else ThreadPoolExecutor(os.cpu_count())
    with making as pool, suppress(InputError):
        return bands(ship, fitted.estimate, manoeuvre, _disturbances(fitted), settings, pool).members
    return {}


def criteria_or_none(fitted: FittedProblem) -> Criteria | None:
    """Information criteria of the fit; None where the velocities were not measured."""
    try:
        return criteria(fitted.problem, fitted.estimate)
    except InputError:
        return None


def bootstrap_estimates(
    fitted: FittedProblem,
    driven_by: str,
    estimator: Callable[[Problem], Estimate],
    members: int,
    executor: Executor | None,
) -> Array | None:
    """Estimates from simulated trials (:func:`bootstrap`); None without `members` or without known residual forces."""
    if not members:
        return None
    disturbances = _disturbances(fitted)
    if disturbances is None:  # without velocities the residual forces are unknown
        return None
    # The prior is that of the fit, without its scale: the estimator scales it again.
    problem = portable(fitted.problem, fitted.card, driven_by)
    return bootstrap(problem, fitted.estimate, estimator, disturbances, PredictionSettings(members=members), executor)


def _disturbances(fitted: FittedProblem) -> Disturbances | None:
    """Random forces that the fit does not explain; None where the velocities were not measured."""
    try:
        return disturbances_of(fitted.problem, fitted.estimate.values)
    except InputError:
        return None
