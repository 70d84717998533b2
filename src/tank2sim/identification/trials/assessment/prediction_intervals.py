"""Prediction intervals of manoeuvring figures, and the scatter of estimates, by simulation with random disturbances.

Each member has its own random generator (numpy's SeedSequence, spawned): results depend on the seed alone, not on the
executor or the order of its work.

Random forces that the model does not explain are first-order Gauss-Markov forces X, Y, N: covariance P exp(-|tau|/T).
In simulation each is a sum of harmonics,

    F(t) = sum over j of a_j cos(w_j t) + b_j sin(w_j t),    a_j, b_j ~ N(0, P/m),    j = 1 ... m,

whose frequencies are drawn from the spectrum, which is Cauchy's distribution of scale 1/T (the spectral representation
of Shinozuka and Jan 1972, J. Sound Vib. 25): a function of time, so that integration and events stay as they are.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import nullcontext, suppress
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import chain

import casadi as ca
import numpy as np
from scipy.optimize import minimize_scalar

from tank2sim.arrays import Array
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.dynamics import build
from tank2sim.dynamics.card_parameters import card_parameters, study_model
from tank2sim.dynamics.model import Model, Parameter, Quantity, State
from tank2sim.errors import InputError
from tank2sim.identification.trials.assessment.evaluation import Comparison, PredictedMembers, compare_card, or_none
from tank2sim.identification.trials.assessment.model_selection import MethodChoice
from tank2sim.identification.trials.methods.coloured_noise import white
from tank2sim.identification.trials.methods.output_error import Pieces, Shooting, Shot, cut, whitened
from tank2sim.identification.trials.methods.weak_form import WeakForm, WeakWindows, sensor_noise
from tank2sim.identification.trials.options import PIECE
from tank2sim.identification.trials.problem.estimation_problem import (
    DrivenShip,
    Estimate,
    Problem,
    model_bounds,
    scaled_prior,
)
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.identification.trials.problem.water_current import WaterCurrent
from tank2sim.simulation.figures import Figures
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.manoeuvres import Manoeuvre
from tank2sim.simulation.recorded import Recorded, recorded, repeat, steerable
from tank2sim.simulation.rows import Chain, RowFunction
from tank2sim.simulation.run import simulate
from tank2sim.simulation.scheme import runge_kutta_step
from tank2sim.units import from_si

HARMONICS = 16
"""Harmonics of a force (project choice): one in each sixteenth of its power, from slow drift to shaking."""

LAGS = 12
"""Residuals up to this many half windows apart determine the correlation time (project choice: 4 L/u0)."""

FORCES = {"X": "N", "Y": "N", "N": "N.m"}

FORCE_DRAWS = 12
"""Draws of the forces on each run, from which their size follows: to 3 % with the KVLCC2's seven zigzags (project
choice)."""


@dataclass(frozen=True, eq=False)
class Disturbances:
    """Gauss-Markov forces."""

    covariance: Array  # (3, 3): Covariance of X, Y (N) and N (N m)
    correlation_s: float  # Time in which their correlation falls to 1/e, s

    def times(self, factor: float) -> Disturbances:
        """Forces `factor` times as large."""
        return replace(self, covariance=factor**2 * self.covariance)


def disturbances_of(problem: Problem, values: Array) -> Disturbances:
    """Forces in the trials beyond the model with its free parameters at `values` (k,).

    From the covariances of the weak form's residuals from window to window, less the part of sensor noise. They include
    model error, which looks like a force.
    """
    form = WeakForm(problem)
    acceleration, correlation_s = gauss_markov(form, form.at(values))
    masses = _mass_matrix(problem.model, problem.parameters(values))
    return Disturbances(masses @ acceleration @ masses.T, correlation_s)


def gauss_markov(form: WeakForm, windows: WeakWindows) -> tuple[Array, float]:
    """Covariance (3, 3) and correlation time, s, of the random accelerations that fit the residuals best.

    Least squares over the covariances at lags 0 to :data:`LAGS`.
    """
    step = form.runs[0].run.step_s
    bump = form.runs[0].averaging[0].toarray().ravel()
    bump = bump[bump > 0]
    noise = np.mean([run.motion.noise**2 for run in form.runs], axis=0)
    count, lag = len(bump), len(bump) // 2
    covariances = _lagged(form, windows)
    size = np.sqrt(np.maximum(np.diag(covariances[0]), 1e-100))
    slopes = np.diff(np.concatenate([[0.0], bump, [0.0]])) / step
    for place in range(min(3, len(covariances))):  # noise of a sample is in every window that contains it
        shared = slopes[place * lag :] @ slopes[: len(slopes) - place * lag]
        covariances[place] -= np.diag(noise) * shared
    traces = np.array([np.trace(lagged / np.outer(size, size)) for lagged in covariances])
    overlap = np.correlate(bump, bump, "full")
    apart = np.arange(-count + 1, count) * step

    def theory(correlation_s: float) -> Array:
        distances = np.abs(apart[None, :] - np.arange(len(covariances))[:, None] * lag * step)
        return np.asarray(np.exp(-distances / correlation_s) @ overlap)

    def misfit(logarithm: float) -> float:
        shape = theory(float(np.exp(logarithm)))
        height = max(float(shape @ traces / (shape @ shape)), 0.0)
        return float(np.sum((traces - height * shape) ** 2))

    half = lag * step
    best = minimize_scalar(misfit, bounds=(np.log(0.1 * half), np.log(30 * half)), method="bounded")
    correlation_s = float(np.exp(best.x))
    shape = theory(correlation_s)
    covariance = np.einsum("l,lij->ij", shape, covariances) / (shape @ shape)
    values, vectors = np.linalg.eigh((covariance + covariance.T) / 2 / np.outer(size, size))
    return (vectors * np.maximum(values, 0.0)) @ vectors.T * np.outer(size, size), correlation_s


def motion_factor(problem: Problem, estimate: Estimate, disturbances: Disturbances) -> float:
    """Factor on random forces with which simulated motion departs from the model's as far as the measured one does.

    Accelerations that the model lacks are not independent of the motion: the fit lets them cancel over a manoeuvre, and
    drawn at random they would drive a ship farther from the model than the trials are. Pieces of the runs are therefore
    simulated with and without :data:`FORCE_DRAWS` draws of the forces. From both departures, drawn and measured, the
    linearised model's initial states and coefficients take what they can explain; sensor noise does not count as
    departure. At most 1: accelerations show every force, and the motion errors of sensors, too; 1 where the model
    leaves all bounds or no force acts.
    """
    if not disturbances.covariance.any():
        return 1.0
    weights = [white(estimate.noise.get(name) or 1.0) for name in problem.seen]
    settling, shooting = Shooting(problem, starts_alone=True), Shooting(problem)
    count = 1 + FORCE_DRAWS  # departures, the measured one first
    products, noise = np.zeros((count + len(problem.free), count + len(problem.free))), 0.0
    rngs = generators(len(problem.runs))
    for run, rng in zip(problem.runs, rngs, strict=True):
        pieces = cut(problem, run, PIECE * problem.ship_time)
        shot = settling.settled(pieces, estimate.values, weights)
        if not np.isfinite(shot.cost):
            return 1.0
        residuals, by = shooting.linearised(pieces, shot, estimate.values, weights)
        departures = [_departure(problem, estimate, disturbances, pieces, shot, rng) for _ in range(FORCE_DRAWS)]
        changes = [whitened(shot.residuals, change, weights).reshape(residuals.shape) for change in departures]
        every = np.stack([residuals, *changes], axis=-1)
        starts = shot.starts.shape[1]
        for columns, J in zip(every, by, strict=True):
            free_of_starts = _without_span(J[:, :starts], np.column_stack([columns, J[:, starts:]]))
            products += free_of_starts.T @ free_of_starts
        deviations = sensor_noise(problem, run) / [weight.sigma for weight in weights]
        noise += float(np.sum(np.where(np.isnan(shot.residuals), 0.0, deviations**2)))
    before = problem.before(estimate.values, scaled_prior(problem, estimate.prior_scale))[0]
    pull, information = products[count:, :count], products[count:, count:]
    taken = np.linalg.solve(information + before, pull)
    squares = np.diag(products)[:count] + np.sum(taken * (information @ taken - 2 * pull), axis=0)
    expected = float(np.mean(squares[1:]))
    return float(np.sqrt(np.clip((squares[0] - noise) / expected, 0.0, 1.0))) if 0 < expected < np.inf else 1.0


def _departure(
    problem: Problem,
    estimate: Estimate,
    disturbances: Disturbances,
    pieces: Pieces,
    shot: Shot,
    rng: np.random.Generator,
) -> Array:
    """Seen variables with drawn forces, less those without (pieces, n + 1, ny)."""
    assert problem.ship is not None
    model, steps, shown = _simulator(problem.ship, problem.seen)
    forces = draw_disturbances(disturbances, fastest_rate(model), rng)
    p = model.parameter_values({**dict(zip(estimate.free, map(float, estimate.values), strict=True)), **forces})
    step, count = pieces.run.step_s, pieces.inputs.shape[1] - 1
    found = []
    for number, (start, inputs) in enumerate(zip(shot.starts, pieces.inputs, strict=True)):
        clock = number * count * step  # the last state
        found.append(shown(steps.run(np.append(start, clock), inputs[:-1], p, np.array([step])), inputs, p)[0])
    return np.stack(found) - (shot.residuals + pieces.measured)


def _without_span(basis: Array, columns: Array) -> Array:
    """Columns (n, m) less their projection on a basis (n, b), whose columns may be dependent."""
    left, sizes, _ = np.linalg.svd(basis, full_matrices=False)
    span = left[:, sizes > 1e-9 * sizes.max(initial=0.0)]
    return np.asarray(columns - span @ (span.T @ columns), dtype=np.float64)


def disturbed(model: Model) -> Model:
    """The model with random forces; :func:`draw_disturbances` names their parameters, 0 by default."""
    clock = State(
        name="disturbance.clock",
        unit="s",
        description="Time since the start",
        derivative="disturbance.pace",
        start=0.0,
    )
    pace = Quantity(name="disturbance.pace", unit="1", description="1: time passes", value=ca.SX(1.0))
    rates = [_parameter(f"disturbance.rate_{j}", "rad/s") for j in range(HARMONICS)]
    model = model.extend(clock, pace, *rates)
    angles = [rate.symbol * clock.symbol for rate in rates]
    for force, unit in FORCES.items():
        waves = [
            (_parameter(f"disturbance.{force}_{wave}_{j}", unit), function(angle))
            for j, angle in enumerate(angles)
            for wave, function in (("cos", ca.cos), ("sin", ca.sin))
        ]
        total = sum((parameter.symbol * value for parameter, value in waves), start=ca.SX(0.0))
        model = model.extend(*(parameter for parameter, _ in waves))
        model = model.redefine(f"force.{force}", lambda old, total=total: old + total)  # type: ignore[misc]
    return model


def draw_disturbances(disturbances: Disturbances, fastest: float, rng: np.random.Generator) -> dict[str, float]:
    """Parameters of a :func:`disturbed` model for one course of the forces, drawn by `rng`.

    `disturbances`: Their covariance and correlation time. `fastest`: Highest frequency that integration resolves,
    rad/s: higher frequencies are set to it.
    """
    share = (np.arange(HARMONICS) + rng.random(HARMONICS)) / HARMONICS  # one in each part of equal power
    rates = np.minimum(np.tan(np.pi / 2 * share) / disturbances.correlation_s, fastest)
    values, vectors = np.linalg.eigh(disturbances.covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0) / HARMONICS)
    parameters = {f"disturbance.rate_{j}": float(rate) for j, rate in enumerate(rates)}
    for wave in ("cos", "sin"):
        heights = root @ rng.standard_normal((3, HARMONICS))
        for force, row in zip(FORCES, heights, strict=True):
            parameters |= {f"disturbance.{force}_{wave}_{j}": float(height) for j, height in enumerate(row)}
    return parameters


def fastest_rate(model: Model) -> float:
    """Highest frequency that a model's step resolves, rad/s: ten steps in a period (project choice)."""
    return 2 * np.pi / (10 * model.step_s)


def _parameter(name: str, unit: str) -> Parameter:
    return Parameter(name=name, unit=unit, description="Of a random force", start=0.0)


def _lagged(form: WeakForm, windows: WeakWindows) -> Array:
    """Covariances (lags, 3, 3) of residuals at lags of half windows."""
    pieces = [windows.residuals[part] for part in form.pieces]
    lags = min(LAGS + 1, max(len(piece) for piece in pieces))
    sums, counts = np.zeros((lags, 3, 3)), np.zeros(lags)
    for piece in pieces:
        for lag in range(min(lags, len(piece))):
            early, late = piece[: len(piece) - lag], piece[lag:]
            sums[lag] += (late.T @ early + early.T @ late) / 2
            counts[lag] += len(early)
    return sums / counts[:, None, None]


def _mass_matrix(model: Model, p: Array) -> Array:
    """Mass matrix (3, 3) at rest, SI."""
    names = ("surge", "sway", "sway_yaw", "yaw_sway", "yaw")
    expression = model.expand(ca.vcat([model.symbol(f"inertia.{name}") for name in names]))
    function = ca.Function("masses", [model.x, model.u, model.p], [expression])
    start = np.array(model.initial(p)).ravel()
    surge, sway, sway_yaw, yaw_sway, yaw = np.array(function(start, model.input_values(), p)).ravel()
    return np.array([[surge, 0.0, 0.0], [0.0, sway, sway_yaw], [0.0, yaw_sway, yaw]])


LEVELS = (0.025, 0.5, 0.975)
"""Levels of the quantiles of an interval of 95 %, and its median."""

NORMAL_95 = 1.96
"""Half the width of a normal distribution's 95 % interval, in standard deviations."""

IN_BANDS = {f"overshoots_deg.{number}": f"overshoot_{number}_deg" for number in (1, 2)}
"""Name of a figure of members (:func:`bands`) to its name in a comparison, where they differ."""


@dataclass(frozen=True, eq=False)
class Fit:
    """A fit in one structure."""

    started: ManoeuvringCard  # The start card of the estimate, in the structure
    unseen: tuple[str, ...]  # Parameters that the trials do not show, held as the card has them
    problem: Problem
    estimate: Estimate
    card: ManoeuvringCard  # With the estimate
    current: WaterCurrent | None = None  # Estimated with the coefficients
    choice: MethodChoice | None = None  # Where the options leave the method open

    @property
    def whole(self) -> bool:
        """Whether the card is compared with runs at all their speeds."""
        return self.started.model.valid_speed_mps is None

    def disturbances(self) -> Disturbances | None:
        """Random forces that the fit does not explain, as large as the residuals of the motion show; None where the
        velocities were not measured."""
        found = or_none(disturbances_of, self.problem, self.estimate.values)
        return found and found.times(motion_factor(self.problem, self.estimate, found))


def generators(members: int, seed: int = 0) -> list[np.random.Generator]:
    """A random generator for each of the `members`."""
    return [np.random.default_rng(each) for each in np.random.SeedSequence(seed).spawn(members)]


def bands(
    ship: DrivenShip,
    estimate: Estimate,
    manoeuvre: Manoeuvre | Recorded,
    rngs: Sequence[np.random.Generator],
    disturbances: Disturbances | None = None,
    executor: Executor | None = None,
) -> dict[str, Array]:
    """Figures of a manoeuvre to their value in each member (members,), nan where not reached; those of a list are
    ``overshoots_deg.1`` and so on.

    Coefficients are drawn from their covariance, or from samples of their posterior, within the bounds of the model,
    and there are random forces during the manoeuvre. `ship`: Driven by the rudder's order, also if the trials were
    driven by its angle. `manoeuvre`: One of :mod:`tank2sim.simulation.manoeuvres`, or a recorded one, repeated from its
    start. `rngs`: One for each member. `disturbances`: By default none: only coefficients are uncertain. Raises
    InputError: The motion of every member leaves all bounds.
    """
    ship = replace(ship, driven_by="order")
    model = ship.model
    tasks = []
    for rng in rngs:
        drawn = np.clip(estimate.draw(rng), *model_bounds(model, estimate.free))
        values = dict(zip(estimate.free, drawn.tolist(), strict=True))
        if disturbances is not None:
            values |= draw_disturbances(disturbances, fastest_rate(model), rng)
        tasks.append((ship, manoeuvre, values))
    results = list((map if executor is None else executor.map)(_figures, tasks))
    names = dict.fromkeys(chain.from_iterable(results))
    if not names:
        raise model.fault("", "the motion leaves all bounds in every member", "check the estimates")
    members = {name: np.array([figures.get(name, np.nan) for figures in results]) for name in names}
    return {name: column for name, column in members.items() if not np.isnan(column).all()}


def bootstrap(
    problem: Problem,
    estimate: Estimate,
    estimator: Callable[[Problem], Estimate],
    disturbances: Disturbances,
    rngs: Sequence[np.random.Generator],
    executor: Executor | None = None,
) -> Array:
    """Parametric bootstrap: estimates (members, k) from runs that were simulated with the estimate (Efron 1979).

    Each run is simulated under its own inputs, with random forces and white noise of the sensors' size; the prior means
    are drawn, too, around the estimate. Members in which a run leaves all bounds are omitted; this happens in long runs
    of a course-unstable ship.

    `problem`: As the fit took it, without the scale of its prior: the `estimator`, a function of a module for an
    executor of processes, scales it again. `disturbances`: Random forces on the simulated ship. `rngs`: One for each
    member.
    """
    tasks = [(problem, estimate, estimator, disturbances, rng) for rng in rngs]
    found = (map if executor is None else executor.map)(_again, tasks)
    return np.array([values for values in found if values is not None]).reshape(-1, len(estimate.free))


@lru_cache(maxsize=8)
def _integrator(ship: DrivenShip) -> Integrator:
    return Integrator(disturbed(ship.model))


def _figures(task: tuple[DrivenShip, Manoeuvre | Recorded, dict[str, float]]) -> dict[str, float]:
    """Figures of one member, none if its motion leaves all bounds."""
    ship, manoeuvre, values = task
    integrator = _integrator(ship)
    try:
        if isinstance(manoeuvre, Recorded):
            return flat(repeat(manoeuvre, integrator, values).figures)
        return flat(simulate(integrator.model, manoeuvre, parameters=values, integrator=integrator).figures)
    except InputError:
        return {}


def flat(figures: Figures) -> dict[str, float]:
    """`figures` as single numbers: list items with their position in the name, None as nan."""
    single: dict[str, float] = {}
    for name, value in figures.items():
        if isinstance(value, list | tuple):
            single |= {f"{name}.{place}": float(item) for place, item in enumerate(value, start=1)}
        else:
            single[name] = float(value) if isinstance(value, int | float) else np.nan
    return single


@lru_cache(maxsize=8)
def _simulator(ship: DrivenShip, seen: tuple[str, ...]) -> tuple[Model, Chain, RowFunction]:
    """A disturbed ship, a step of its motion, and its observed values."""
    model = disturbed(ship.model)
    shown = ca.densify(model.expand(ca.vcat([model.symbol(name) for name in seen])))
    function = ca.Function("shown", [model.x, model.u, model.p], [shown], {"cse": True})
    return model, Chain(runge_kutta_step(model)), RowFunction(function)


def _again(
    task: tuple[Problem, Estimate, Callable[[Problem], Estimate], Disturbances, np.random.Generator],
) -> Array | None:
    """The estimate from one simulated set of runs, None if a run leaves all bounds."""
    problem, estimate, estimator, disturbances, rng = task
    assert problem.ship is not None
    model, steps, shown = _simulator(problem.ship, problem.seen)
    runs = []
    for run in problem.runs:
        forces = draw_disturbances(disturbances, fastest_rate(model), rng)
        p = model.parameter_values({**dict(zip(estimate.free, map(float, estimate.values), strict=True)), **forces})
        start = np.append(cut(problem, run, None).starts[0], 0.0)  # the clock is the last state
        states = steps.run(start, run.inputs[:-1], p, np.array([run.step_s]))
        if not np.isfinite(states).all() or np.abs(states).max() > 1e9:
            return None
        measured = shown(states, run.inputs, p)[0]
        measured += sensor_noise(problem, run) * rng.standard_normal(measured.shape)
        runs.append(replace(run, measured=np.where(np.isnan(run.measured), np.nan, measured)))
    correlated = np.linalg.cholesky(np.linalg.inv(problem.known)) @ rng.standard_normal(len(estimate.values))
    mean = estimate.values + problem.prior_error * correlated
    return estimator(replace(problem, runs=tuple(runs), prior_mean=mean)).values


def compare_held_out(
    fit: Fit, held: Measured, members: int, executor: Executor | None = None, average: Sequence[tuple[Fit, float]] = ()
) -> Comparison:
    """Comparison of the new card with held-out trials, with a 95 % prediction interval of each figure.

    The intervals are of simulations with coefficients drawn from their covariance, under random forces with the size
    and correlation time of those that the fit does not explain (:func:`bands`). They are wider by what is uncertain of
    the measured point and of the heading's zero (:class:`.recorded.Recorded`). With an `average` over structures, fits
    with their weights that hold `fit`, the members of each are as many as its weight says.
    """
    plain = compare_card(fit.card, held, fit.estimate.noise, whole=fit.whole)
    if not members or not plain.figures:
        return plain
    model = build(steerable(fit.card))
    parts = [(part, part.disturbances(), round(weight * members)) for part, weight in average or ((fit, 1.0),)]
    intervals: dict[tuple[str, str], tuple[float, float]] = {}
    by_part: list[dict[str, Array]] = [{} for _ in parts]
    for trial in held.trials:
        manoeuvre = recorded(trial, model)
        if manoeuvre is None:
            continue
        pooled_members: dict[str, list[Array]] = {}
        for (part, forces, count), found in zip(parts, by_part, strict=True):
            for name, values in _members(part, forces, manoeuvre, count, executor).items():
                pooled_members.setdefault(name, []).append(values)
                found[f"{trial.name}: {IN_BANDS.get(name, name)}"] = values
        for name, figures_of_parts in pooled_members.items():
            lowest, median, highest = np.nanquantile(np.concatenate(figures_of_parts), LEVELS)
            figure = IN_BANDS.get(name, name)
            error = NORMAL_95 * from_si(figure, manoeuvre.reading_errors.get(figure, 0.0))
            below, above = math.hypot(median - lowest, error), math.hypot(highest - median, error)
            intervals[trial.name, figure] = (median - below, median + above)
    figures = tuple(replace(figure, interval=intervals.get((figure.trial, figure.name))) for figure in plain.figures)
    counts = [count for *_, count in parts]
    coefficients = [_drawn_numbers(part, count) for part, _, count in parts]
    drawn = PredictedMembers(_stacked(coefficients, counts), _stacked(by_part, counts))
    return replace(plain, figures=figures, members=drawn)


def _drawn_numbers(fit: Fit, members: int) -> dict[str, Array]:
    """Numbers that :func:`bands` draws for its members (members,), by the keys of the card and as its file has them."""
    model = DrivenShip(steerable(fit.card).text, "order").model
    rows = [np.clip(fit.estimate.draw(rng), *model_bounds(model, fit.estimate.free)) for rng in generators(members)]
    numbers = {number.name: number for number in card_parameters(fit.card, study_model(fit.card))}
    columns = zip(fit.estimate.free, np.reshape(rows, (members, -1)).T, strict=True)
    return {numbers[name].key: numbers[name].factor * values for name, values in columns if name in numbers}


def _stacked(parts: Sequence[Mapping[str, Array]], counts: Sequence[int]) -> dict[str, Array]:
    """Columns of several parts, of `counts` rows each, below each other; nan where a part lacks one."""
    names = dict.fromkeys(chain.from_iterable(parts))
    lacking = [np.full(count, np.nan) for count in counts]
    return {
        name: np.concatenate([part.get(name, none) for part, none in zip(parts, lacking, strict=True)])
        for name in names
    }


def _members(
    fit: Fit, forces: Disturbances | None, manoeuvre: Recorded, members: int, executor: Executor | None
) -> Mapping[str, Array]:
    """Figure to its value in each member of a fit; empty where no member's motion stays within bounds."""
    ship = DrivenShip(steerable(fit.card).text, "order")
    # Without an executor by threads: half of a simulation is machine code, and processes would begin too slowly.
    making = nullcontext(executor) if executor is not None else ThreadPoolExecutor(os.cpu_count())
    with making as pool, suppress(InputError):
        return bands(ship, fit.estimate, manoeuvre, generators(members), forces, pool)
    return {}
