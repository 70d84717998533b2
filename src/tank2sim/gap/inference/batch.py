"""The measured motion of all trials side by side, about which every explanation of the gap is linearised.

The motion that was measured, smoothed, is within the noise of the true one whatever effect is missing. About it the
error of the motion is small, the filter of :mod:`.kalman_filter` is linear, and an effect enters as its addition to the
rates of the states along this motion. A simulated motion would drift away from the measured one, and need a new
linearisation for each explanation.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tank2sim.arrays import Array
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.dynamics.model import Model
from tank2sim.identification.trials.methods.weak_form import MEASURED_STATES, measured_motion, sensor_noise
from tank2sim.identification.trials.problem.estimation_problem import Problem
from tank2sim.identification.trials.problem.sampled_runs import SampledRun, on_steps, seen_in
from tank2sim.records.signals.columns import DIRECTION_COLUMNS
from tank2sim.records.trials import Trial, rows_in, sampling_step
from tank2sim.simulation.motion_record import FED, motion_record
from tank2sim.simulation.recorded import SMOOTHING

_Truths = NDArray[np.bool_]

BLOCKS_PER_SHIP_TIME = 8
"""Blocks in L/u0: two fifths of the fastest motion of a hull, whose yaw rate answers in about 0.3 L/u0 (project
choice)."""

FINE_PER_SHIP_TIME = 200
"""Fine steps in L/u0 at most, if the record has so many samples: a step of the rudder order must not be averaged with
the value before it, or a gear at its limit would respond too early."""

SMALLEST_MOVE = np.deg2rad(0.5)
"""Change of the rudder's order from one fine step to the next that counts as a move, rad: below the smallest order of a
helmsman, above the rounding of a record (project choice)."""

_LEAST_NOISE = 1e-5
"""Noise of a sample over the variable's nominal size, for records without any: no filter can take these as exact
(project choice: far below the noise of any sensor)."""


GUESSED = (0.1, 0.1, 1e-3, 0.01, 1.0, 1.0)
"""Error of the smoothed motion in u, v (m/s), r (rad/s), psi (rad), x and y (m) where they were derived (project
choice)."""


@dataclass(frozen=True, eq=False)
class MeasuredBatch:
    """Trials side by side, padded to one length."""

    names: tuple[str, ...]  # Names of the R runs
    seen: tuple[str, ...]  # The ny variables that are measured
    step_s: float  # Fine step, s: over these the rates are integrated
    # Fine steps in a block, over which measurements are averaged; odd, so that an instant is the middle of a block.
    fine: int
    begin_s: Array  # (R,): Time of the first fine instant in each trial's own time
    lengths: NDArray[np.int64]  # (R,): Number of blocks of each run
    states: Array  # (R, n, 6): Smoothed motion at the fine instants, in the order of KNOWN
    inputs: Array  # (R, n - 1, nu): Mean of each input from an instant to the next
    measured: Array  # (R, T, ny): Mean over each block, nan where nothing was measured
    # (ny,): Standard deviation of the mean over a block, of the part that is too fast for a ship, in a run that reads
    # as often as the median.
    noise: Array
    # (R,): Time from one reading of the rudder's order to the next, s: within it the order changed, at an unknown
    # instant. 0 where the rudder's angle was measured.
    unsure_s: Array
    # (R,): True for a run that begins at its execute: its rudder was amidships until the first reading.
    at_execute: _Truths
    # Input of an effect (``wind.speed``) to its record (R, n - 1), SI, of those that every trial recorded and that
    # `inputs` does not hold; directions without jumps of a full turn.
    recorded: Mapping[str, Array] = field(default_factory=dict)
    # (R,): Readings of a sensor in a fine step, 1 or more; the measured values are their means.
    averaged: Array = field(default_factory=lambda: np.ones(1))

    @property
    def readings(self) -> float:
        """Readings of a sensor in a block, median over the runs."""
        return self.fine * float(np.median(self.averaged))

    @property
    def noise_shares(self) -> Array:
        """Variance of the noise of each run's means, over the same of a run that reads as often as the median (R,)."""
        shares: Array = np.median(self.averaged) / np.broadcast_to(self.averaged, len(self.names))
        return shares

    @property
    def block_s(self) -> float:
        """Length of a block, s."""
        return self.step_s * self.fine

    @property
    def blocks(self) -> int:
        """Blocks of the longest run, T."""
        return int(self.measured.shape[1])

    @property
    def inside(self) -> _Truths:
        """Mask of the blocks that belong to a run and are not padding (R, T)."""
        return np.arange(self.blocks) < self.lengths[:, None]

    @property
    def times(self) -> Array:
        """Middle of each block in the trial's own time (R, T), s."""
        middle = (np.arange(self.blocks) * self.fine + self.fine // 2) * self.step_s
        times: Array = self.begin_s[:, None] + middle
        return times

    @cached_property
    def block_states(self) -> Array:
        """Mean of the states from the middle of a block to the middle of the next (R, T - 1, 6)."""
        middles = 0.5 * (self.states[:, 1:] + self.states[:, :-1])
        return self.over_blocks(middles)

    @cached_property
    def states_in_blocks(self) -> Array:
        """Means of the states over each block (R, T, 6)."""
        return self.in_blocks(self.states)

    @property
    def block_inputs(self) -> Array:
        """Means of the inputs from the middle of a block to the middle of the next (R, T - 1, nu)."""
        return self.over_blocks(self.inputs)

    def order_moves(self, command: int) -> NDArray[np.float64]:
        """Mask of the blocks from one change of the rudder's order to the next, a column for each (R, T - 1, moves).

        Changes within a block of each other are one move; `command` is the place of ``rudder.command`` in the inputs.
        """
        masks = []
        for run, order in enumerate(self.inputs[:, :, command]):
            changes = np.flatnonzero(np.abs(np.diff(order)) > SMALLEST_MOVE) + 1
            begins = [change for before, change in pairwise([-np.inf, *changes]) if change - before > self.fine]
            blocks = [int((begin - self.fine // 2) // self.fine) for begin in begins]
            for first, after in pairwise([*(max(block, 0) for block in blocks), self.blocks]):
                mask = np.zeros((len(self.inputs), self.blocks - 1))
                mask[run, first:after] = 1.0
                masks.append(mask)
        return np.stack(masks, axis=-1) if masks else np.zeros((len(self.inputs), self.blocks - 1, 0))

    def over_blocks(self, values: Array) -> Array:
        """Means of values of fine steps (R, n - 1, k) from the middle of a block to the middle of the next (R, T - 1,
        k)."""
        inside = values[:, self.fine // 2 : self.fine // 2 + (self.blocks - 1) * self.fine]
        return _means_of_blocks(inside, self.fine)

    def in_blocks(self, values: Array) -> Array:
        """Means over each block of values at the fine instants (R, n, k): (R, T, k)."""
        return _means_of_blocks(values, self.fine)

    @property
    def middles(self) -> Array:
        """States in the middle of each block (R, T, 6)."""
        return self.states[:, self.fine // 2 :: self.fine]

    @property
    def errors(self) -> Array:
        """Approximate error of each state (6,): the noise of its sensor; a guess where no sensor measures it."""
        noise = dict(zip(self.seen, self.noise, strict=True))
        return np.array([noise.get(name, guess) for name, guess in zip(MEASURED_STATES, GUESSED, strict=True)])

    def shift(self, away: Array, transition: Array, lack: Array, added: Array) -> MeasuredBatch:
        """Return the same trials, linearised about a motion that differs from this one by `away`.

        Parameters
        ----------
        away : array (R, T, 6)
            In the middles of the blocks.
        transition : array (R, T - 1, 6, 6)
            exp(A h) from each middle to the next.
        lack : array (R, n - 1, 6)
            Rates of the model less those of this motion, at each fine step.
        added : array (R, T - 1, 6)
            Rates that are added to the model's, over each block.
        """
        # log(exp(A h))/h to second order is enough within a block: its end is known
        small = transition - np.eye(6)
        slope = (small - small @ small / 2) / self.block_s
        begin, count, h = self.fine // 2, self.blocks - 1, self.step_s
        inside = lack[:, begin : begin + count * self.fine].reshape(len(lack), count, self.fine, 6)
        at = away[:, :-1].copy()
        course = np.empty((len(lack), count, self.fine, 6))
        for step in range(self.fine):
            course[:, :, step] = at
            rate = (slope @ at[..., None])[..., 0] + inside[:, :, step] + added
            rate = rate + 0.5 * h * (slope @ rate[..., None])[..., 0]
            at = at + h * rate
        shares = np.arange(self.fine)[:, None] / self.fine
        # After the last middle of a run nothing is known: the model continues there.
        known_end = np.where(self.inside[:, 1:, None], away[:, 1:] - at, 0.0)
        course += shares * known_end[:, :, None]
        states = self.states.copy()
        states[:, begin : begin + count * self.fine] += course.reshape(len(lack), -1, 6)
        states[:, :begin] += away[:, :1]
        states[:, begin + count * self.fine :] += away[:, -1:]
        return replace(self, states=states)


def batch_trials(model: Model, trials: Sequence[Trial], ship_time: float) -> MeasuredBatch:
    """The trials' measured motion.

    Parameters
    ----------
    model : Model
        Driven as the trials were.
    trials : sequence of Trial
        At the ship's size.
    ship_time : float
        L/u0, s.

    Raises
    ------
    InputError
        A trial is too short, or records neither velocities nor positions.
    """
    seen = seen_in(model, trials)
    samplings = [sampling_step(trial) for trial in trials]
    wanted = max(ship_time / FINE_PER_SHIP_TIME, *samplings)
    step = max(rows_in(wanted, sampling) * sampling for sampling in samplings)
    runs = tuple(on_steps(motion_record(model, trial, seen), step) for trial in trials)
    fine = 2 * round(ship_time / BLOCKS_PER_SHIP_TIME / step / 2 - 0.5) + 1
    fine = max(fine, 1)
    problem = Problem(model, (), np.zeros(0), np.zeros(0), runs)
    lengths = np.array([len(run.measured) // fine for run in runs])
    size = int(lengths.max()) * fine
    averaged = np.array([float(rows_in(step, sampling)) for sampling in samplings])
    states, inputs, measured, noise = [], [], [], []
    for run, readings in zip(runs, averaged, strict=True):
        states.append(_padded(_smooth(measured_motion(problem, run).smooth, ship_time / step), size))
        inputs.append(_padded(run.inputs, size)[:-1])
        measured.append(_means(run, size, fine))
        noise.append(sensor_noise(problem, run) * np.sqrt(readings / np.median(averaged)))
    return MeasuredBatch(
        names=tuple(run.name for run in runs),
        seen=seen,
        step_s=step,
        fine=fine,
        begin_s=np.array([run.begin_s for run in runs]),
        lengths=lengths,
        states=np.array(states),
        inputs=np.array(inputs),
        measured=np.array(measured),
        unsure_s=np.array([_unsure_s(trial) for trial in trials]),
        at_execute=np.zeros(len(runs), dtype=bool),
        recorded=_recorded(trials, runs, size, model.input_names),
        averaged=averaged,
        noise=_typical(noise, np.array([_LEAST_NOISE * model[name].nominal for name in seen])) / np.sqrt(fine),
    )


def _unsure_s(trial: Trial) -> float:
    """Time between two readings of the rudder's order, s; 0 where its angle was measured, or of a craft without one."""
    return sampling_step(trial) if "delta_order_rad" in trial.signals and "delta_rad" not in trial.signals else 0.0


def _recorded(
    trials: Sequence[Trial], runs: Sequence[SampledRun], size: int, inputs: Sequence[str]
) -> dict[str, Array]:
    """Winds and currents that every trial recorded, halfway between the fine instants, except known inputs."""
    found = {}
    for signals in (effect.measured_as for effect in EFFECTS.values() if effect.surroundings):
        names = set(signals.values())
        measured = all(np.isfinite(trial.signals.get(name, np.nan)).any() for trial in trials for name in names)
        if not measured or {FED[name] for name in names} & set(inputs):
            continue
        for signal in signals.values():
            rows = []
            for trial, run in zip(trials, runs, strict=True):
                values = trial.signals[signal]
                known = np.isfinite(values)
                whole = np.unwrap(values[known]) if signal in DIRECTION_COLUMNS else values[known]
                middles = run.begin_s + run.step_s * (np.arange(len(run.measured)) + 0.5)
                rows.append(_padded(np.interp(middles, trial.time_s[known], whole), size)[:-1])
            found[FED[signal]] = np.array(rows)
    return found


def _smooth(states: Array, ship_steps: float) -> Array:
    """States (n, 6) with heading and position smoothed like velocities: rates over a block are their differences."""
    from scipy.signal import savgol_filter  # slow to import

    window = min(int(SMOOTHING * ship_steps), len(states) - 1) // 2 * 2 + 1
    if window < 5:
        return states
    places: Array = savgol_filter(states[:, 3:], window, 3, axis=0)
    return np.hstack([states[:, :3], places])


def _typical(noise: Sequence[Array], least: Array) -> Array:
    """Median over the runs of each signal's noise (ny,), where it was measured; `least` at least."""
    known = np.array(noise)
    medians = [np.median(levels[levels > 0]) if (levels > 0).any() else 0.0 for levels in known.T]
    typical: Array = np.maximum(np.array(medians), least)
    return typical


def _means_of_blocks(values: Array, fine: int) -> Array:
    """Means of every `fine` values of each run, (R, n fine, k) to (R, n, k); einsum is 3 times as fast as ``mean``."""
    runs, steps, count = values.shape
    means: Array = np.einsum("rbfk->rbk", values.reshape(runs, steps // fine, fine, count)) / fine
    return means


def _padded(rows: Array, size: int) -> Array:
    """Rows (n, k) cut or lengthened to `size` by repeating the last one."""
    if len(rows) >= size:
        return rows[:size]
    return np.concatenate([rows, np.repeat(rows[-1:], size - len(rows), axis=0)])


def _means(run: SampledRun, size: int, fine: int) -> Array:
    count = len(run.measured) // fine
    blocks = run.measured[: count * fine].reshape(count, fine, -1)
    means = np.full((size // fine, blocks.shape[2]), np.nan)
    known = ~np.isnan(blocks)
    enough = known.all(axis=1)
    means[:count][enough] = np.where(known, blocks, 0).mean(axis=1)[enough]
    return means


__all__ = ["MEASURED_STATES", "MeasuredBatch", "batch_trials"]
