"""Errors of a model on trials: over windows, whole runs and figures of manoeuvres, in units of sensor noise."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import ParamSpec, TypeVar

import numpy as np

from tank2sim.arrays import Array
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.dynamics import build
from tank2sim.errors import InputError
from tank2sim.identification.trials.methods.coloured_noise import white
from tank2sim.identification.trials.methods.output_error import Shooting, cut
from tank2sim.identification.trials.problem.estimation_problem import Problem
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.identification.trials.problem.problem_from_card import problem_from_card
from tank2sim.identification.trials.problem.sampled_runs import SampledRun
from tank2sim.records.audit import record_noise
from tank2sim.records.trials import Trial
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.manoeuvres import Turn
from tank2sim.simulation.motion_record import OBSERVED_SIGNALS
from tank2sim.simulation.recorded import recorded, repeat, steerable
from tank2sim.simulation.trajectory import Trajectory

_Given = ParamSpec("_Given")
_Found = TypeVar("_Found")

_WINDOW = 5.0
"""Length of the windows of a free-running comparison, in L/u0 (30 s of a 7 m model at 1.18 m/s)."""

TURN_FIGURE_NAMES = ("advance_m", "transfer_m", "tactical_diameter_m")
_OVERSHOOTS = 2
"""Number of compared overshoots, as in IMO MSC.137(76). Later ones repeat the errors of the first."""

_LEAST_NOISE = 1e-3
"""Noise of a signal without stated noise is taken as this share of its standard deviation at least (project choice)."""


@dataclass(frozen=True)
class Following:
    """Errors of a model on one run."""

    name: str
    # Signal to (root mean square of the error, of the measurement less its mean) over windows of :data:`_WINDOW`, each
    # with its own initial state; SI
    windows: Mapping[str, tuple[float, float]]
    # Signal to root mean square error over the whole run from one initial state; inf where the motion diverged
    whole: Mapping[str, float]

    def relative(self, signal: str) -> float:
        """Error over windows as a share of the signal."""
        error, size = self.windows[signal]
        return error / size if size > 0 else np.inf


def replay_error(
    problem: Problem, values: Array, noise: Mapping[str, float], *, windows: bool = True, whole: bool = True
) -> tuple[Following, ...]:
    """Errors of the model at `values` (k,) on each run of a problem, over windows and over the whole run.

    `noise` weighs signals in the initial states; without `windows` or `whole` these errors are left out.
    """
    shooting = Shooting(problem, starts_alone=True)
    weights = [white(noise[name]) for name in problem.seen]

    def errors(run: SampledRun, length: float | None) -> dict[str, tuple[float, float]]:
        """Signal to error and size."""
        pieces = cut(problem, run, length)
        residuals, measured = shooting.settled(pieces, values, weights).residuals, pieces.measured
        return {
            name: (_rms(residuals[:, :, place]), _spread(name, measured[:, :, place]))
            for place, name in enumerate(problem.seen)
            if not np.isnan(measured[:, :, place]).all()
        }

    def following(run: SampledRun) -> Following:
        over_windows = errors(run, _WINDOW * problem.ship_time) if windows else {}
        over_whole = {name: error for name, (error, _) in errors(run, None).items()} if whole else {}
        return Following(run.name, over_windows, over_whole)

    with ThreadPoolExecutor(os.cpu_count()) as threads:  # a simulation is machine code: threads run in parallel
        return tuple(threads.map(following, problem.runs))


def pooled(results: Sequence[Following], signal: str) -> float:
    """Error over windows of all runs together, as a share of the signal."""
    pairs = np.array([result.windows[signal] for result in results if signal in result.windows])
    if not len(pairs) or not pairs[:, 1].any():
        return np.nan  # a signal that is zero throughout has no relative error
    return float(np.sqrt(np.sum(pairs[:, 0] ** 2) / np.sum(pairs[:, 1] ** 2)))


@dataclass(frozen=True)
class FigureComparison:
    """A figure of a manoeuvre."""

    # `trial`, `name`: Trial, and name of the figure with its unit
    trial: str
    name: str
    measured: float
    predicted: float | None  # By the closed-loop simulation; None where the simulation does not reach it
    interval: tuple[float, float] | None = None  # 95 % prediction interval; None where it was not computed

    @property
    def error(self) -> float:
        """Predicted less measured; for distances as a share of the measured one."""
        if self.predicted is None:
            return np.nan
        difference = self.predicted - self.measured
        return difference / self.measured if self.name.endswith("_m") else difference

    @property
    def missed(self) -> bool:
        """Whether the measured figure is outside its prediction interval."""
        return self.interval is not None and not self.interval[0] <= self.measured <= self.interval[1]


def or_none(function: Callable[_Given, _Found], *given: _Given.args, **named: _Given.kwargs) -> _Found | None:
    """The result of a `function`; None where the records do not allow it, or a motion leaves all bounds."""
    try:
        return function(*given, **named)
    except InputError:
        return None


def predicted_figures(card: ManoeuvringCard, trials: Sequence[Trial]) -> tuple[FigureComparison, ...]:
    """Figures of the turns and zigzags among trials, measured and simulated in closed loop from the measured start.

    `card`: Card of the ship. `trials`: At the ship's size; trials other than turns and zigzags are ignored.
    """
    integrator = Integrator(build(steerable(card)))
    figures = []
    for trial in trials:
        record = recorded(trial, integrator.model)
        if record is None:
            continue
        turn, run = isinstance(record.manoeuvre, Turn), or_none(repeat, record, integrator)
        predicted = select_figures(run.figures, turn=turn) if run else {}  # without a run none is reached
        figures += [
            FigureComparison(trial.name, name, value, predicted.get(name))
            for name, value in select_figures(record.figures, turn=turn).items()
        ]
    return tuple(figures)


@dataclass(frozen=True, eq=False)
class Passage:
    """One trial and its simulation by a model."""

    name: str  # Name of the trial
    # True for a turn or zigzag: the model was steered as in the manoeuvre, from the measured start. False: it was
    # driven by the recorded rudder, from the initial state that fits the record best.
    closed_loop: bool
    time_s: Array  # (n,): In the trial's own time
    measured: Mapping[str, Array]  # Measured signals among :data:`_SHOWN` (n,), nan where not measured
    model_time_s: Array  # (m,): In the trial's own time; empty where the motion left all bounds
    simulated: Mapping[str, Array]  # Each of :data:`_SHOWN` (m,)


_SHOWN = ("rudder", "motion.psi", "motion.r", "motion.speed", "motion.beta", "motion.x", "motion.y")
"""Signals of a passage: rudder angle (its order where only that is known), heading, yaw rate, speed and drift angle
(through the water, or over the ground where only that was measured), position; SI, rad."""


def comparison_windows(
    problem: Problem, card: ManoeuvringCard, trials: Sequence[Trial], noise: Mapping[str, float]
) -> tuple[Passage, ...]:
    """Trials and their simulations by a card's model: turns and zigzags in closed loop, others replayed.

    `problem`: Set up with a card and these trials; its prior means are the card's values. `card`: That card. `trials`:
    One for each run of the problem. `noise`: Standard deviation by variable: weighs signals in the initial state of a
    replayed trial.
    """
    integrator = Integrator(build(steerable(card)))
    found = []
    for trial, run in zip(trials, problem.runs, strict=True):
        record = recorded(trial, integrator.model)
        repeated = or_none(repeat, record, integrator) if record else None
        replayed = None if record else _replayed(problem, run, noise)
        simulated = repeated.trajectory if repeated else replayed
        given = {name: run.column(name) for name in run.seen if not np.isnan(run.column(name)).all()}
        times, columns = np.zeros(0), {}
        if simulated is not None:
            times = simulated.t + (record.begin_s if record else run.begin_s)
            columns = _shown_of(simulated, ground=not {"motion.u", "motion.v"} <= given.keys())
        measured = _measured_in(run, given, problem)
        found.append(Passage(run.name, record is not None, run.times, measured, times, columns))
    return tuple(found)


def _measured_in(run: SampledRun, given: Mapping[str, Array], problem: Problem) -> dict[str, Array]:
    rudder = run.inputs[:, problem.model.input_names.index("rudder.command")]
    columns = {"rudder": rudder, **{name: values for name, values in given.items() if name in _SHOWN}}
    for ahead, side in (("motion.u_ground", "motion.v_ground"), ("motion.u", "motion.v")):
        if ahead in given and side in given:
            speed = np.hypot(given[ahead], given[side])
            columns |= {"motion.speed": speed, "motion.beta": _drift(given[side], speed)}
    if "motion.sog" in given:
        columns.setdefault("motion.speed", given["motion.sog"])
    return columns


def _shown_of(simulated: Trajectory, *, ground: bool) -> dict[str, Array]:
    names = simulated.model.outputs
    rudder = simulated["rudder.angle" if "rudder.angle" in names else "rudder.command"]
    columns = {"rudder": rudder, **{name: simulated[name] for name in _SHOWN[1:]}}
    if ground:
        over = simulated["motion.cog"] - simulated["motion.psi"]
        columns |= {"motion.speed": simulated["motion.sog"], "motion.beta": _drift(np.sin(over), np.ones_like(over))}
    return columns


def _drift(side: Array, speed: Array) -> Array:
    """-asin(v/U), rad; 0 at rest."""
    share = np.divide(side, speed, out=np.zeros_like(speed), where=speed != 0)
    angle: Array = -np.arcsin(np.clip(share, -1, 1))
    return angle


def _replayed(problem: Problem, run: SampledRun, noise: Mapping[str, float]) -> Trajectory | None:
    """The whole run with its recorded inputs, from the initial state that fits the record best; None if it diverges."""
    model, values = problem.model, problem.prior_mean
    shooting, pieces = Shooting(problem, starts_alone=True), cut(problem, run, None)
    x = shooting.settled(pieces, values, [white(noise.get(name) or 1.0) for name in problem.seen]).states[0]
    u, p = pieces.inputs[0], problem.parameters(values)
    y = np.array(model.output(x.T, u.T, np.repeat(p[:, None], len(x), axis=1))).T
    found = Trajectory(model, run.step_s * np.arange(len(x), dtype=float), x, u, y)
    return found if found.is_finite() else None


def select_figures(figures: Mapping[str, object], *, turn: bool) -> dict[str, float]:
    """Compared figures, each a number."""
    if turn:
        return {name: float(value) for name in TURN_FIGURE_NAMES if isinstance(value := figures.get(name), float)}
    overshoots = figures.get("overshoots_deg", [])
    assert isinstance(overshoots, list)
    return {f"overshoot_{place + 1}_deg": float(value) for place, value in enumerate(overshoots[:_OVERSHOOTS])}


def _rms(values: Array) -> float:
    if not np.isfinite(values[~np.isnan(values)]).all():
        return np.inf
    with np.errstate(over="ignore"):
        return float(np.sqrt(np.nanmean(values**2)))


def _spread(name: str, values: Array) -> float:
    """Size of a signal: of a rate or a sway velocity about zero, of any other signal about its mean."""
    about = 0.0 if name in ("motion.r", "motion.v") else np.nanmean(values)
    return float(np.sqrt(np.nanmean((values - about) ** 2)))


@dataclass(frozen=True, eq=False)
class PredictedMembers:
    """Ships behind prediction intervals: numbers drawn, by the dotted keys of the card and as its file has them, and
    figures named ``trial: figure``; each (members,), nan where a ship has none."""

    coefficients: Mapping[str, Array]
    figures: Mapping[str, Array]


@dataclass(frozen=True, eq=False)
class Comparison:
    """Comparison of a model with trials: over windows and whole runs, and in the figures of manoeuvres.

    `members`: of held-out trials with prediction intervals, else None.
    """

    following: tuple[Following, ...]
    figures: tuple[FigureComparison, ...]
    members: PredictedMembers | None = None


def compare_card(
    card: ManoeuvringCard, trials: Measured, residual: Mapping[str, float], *, whole: bool = False
) -> Comparison:
    """Compare a card's model with trials.

    `card`, `trials`: Card and trials of the same size. `residual`: Expected standard deviation of each variable's
    error: it weighs the signals in the fit of a window's initial state. With weights of sensor noise alone, the state
    would follow a single signal. `whole`: Compare also outside the card's range of speeds.
    """
    problem = problem_from_card(card, trials.trials, trials.driven_by, whole=whole)
    weights = {name: residual.get(name) or 1.0 for name in problem.seen}
    return Comparison(
        replay_error(problem, problem.prior_mean, weights),
        predicted_figures(card, trials.trials),
    )


def noise_of(trials: Measured, problem: Problem) -> dict[str, float]:
    """Measurement noise of each variable, SI: as stated in the files, else estimated; the largest of all trials.

    At least :data:`_LEAST_NOISE`: a smoothed record shows no noise, but is not exact.
    """
    noise: dict[str, float] = {}
    for trial in trials.trials:
        levels = {**record_noise(trial), **trial.noise}
        for signal, variable in OBSERVED_SIGNALS.items():
            if variable in problem.seen and levels.get(signal):
                least = _LEAST_NOISE * float(np.nanstd(trial.signals[signal])) if signal not in trial.noise else 0.0
                noise[variable] = max(noise.get(variable, 0.0), least, float(levels[signal]))
    return noise


def misfit(comparison: Comparison, noise: Mapping[str, float]) -> float:
    """Root mean square over runs and signals of (simulated - measured)/noise, each run from one initial state."""
    ratios = [
        error / noise[name]
        for result in comparison.following
        for name, error in result.whole.items()
        if noise.get(name)
    ]
    return float(np.sqrt(np.mean(np.square(ratios)))) if ratios else np.nan
