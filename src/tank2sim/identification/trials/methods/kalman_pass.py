"""Passes of a Kalman filter over all runs at once: noise levels, linearisation, innovations and their likelihood."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from tank2sim.arrays import Array
from tank2sim.identification.trials.methods.kalman_gains import Gains, Variances, first_place, gains
from tank2sim.identification.trials.methods.process_noise import Disturbed, Tangents
from tank2sim.identification.trials.methods.shooting import SENSED_BY, cut
from tank2sim.identification.trials.problem.estimation_problem import Problem

_LARGEST = 1e9
"""Size of a state, SI, that no motion has."""

_SMOOTHED_S = 1.0
"""Time over which positions give the velocity at which a filter is linearised first, s (project choice)."""


@dataclass(frozen=True, eq=False)
class Batch:
    """Runs padded to one length."""

    inputs: Array  # (runs, n, nu)
    measured: Array  # (runs, n, ny): 0 where not measured
    known: NDArray[np.bool_]  # (runs, n, ny): True where measured; False in the padding
    lengths: tuple[int, ...]  # Instants of each run
    steps: Array  # (runs,): s
    # (runs, nz): First guess of the first states, from the nearby measurements; without random acceleration or
    # drift
    starts: Array
    spread: Array | None = None  # (runs, nz, nz): Covariance of the first states; by default wide

    def part(self, run: int, begin: int, end: int, start: Array, spread: Array | None) -> Batch:
        """Instants of a run from `begin` to `end`, the last only predicted, from a state (nz,) and its covariance."""
        where = slice(run, run + 1), slice(begin, end + 1)
        known = self.known[where].copy()
        if end < self.lengths[run]:
            known[:, -1] = False
        measured = np.where(known, self.measured[where], 0.0)
        steps, covariance = self.steps[run : run + 1], None if spread is None else spread[None]
        return Batch(self.inputs[where], measured, known, (known.shape[1],), steps, start[None], covariance)


def batch_of(problem: Problem, correlated: int) -> Batch:
    """The runs of a problem, for a filter with `correlated` random accelerations and drifts."""
    pieces = [cut(problem, run, None) for run in problem.runs]
    lengths = tuple(len(run.measured) for run in problem.runs)
    n = max(lengths)
    inputs = np.stack([np.pad(run.inputs, ((0, n - len(run.inputs)), (0, 0)), mode="edge") for run in problem.runs])
    rows = [(0, n - length) for length in lengths]
    measured = np.stack(
        [
            np.pad(run.measured, (row, (0, 0)), constant_values=np.nan)
            for run, row in zip(problem.runs, rows, strict=True)
        ]
    )
    known = ~np.isnan(measured)
    starts = np.stack([np.append(piece.starts[0], np.zeros(correlated)) for piece in pieces])
    steps = np.array([run.step_s for run in problem.runs])
    return Batch(inputs, np.where(known, measured, 0.0), known, lengths, steps, starts)


@dataclass(frozen=True, eq=False)
class Levels:
    """Noise levels as natural logarithms."""

    # (g,): Standard deviations of each random acceleration, m/s2 or rad/s2, and then of each sensor's drift
    process: Array
    time: Array  # (g,): Time constants, s; -inf for white
    measurement: Array  # (ny,): Standard deviation of each measured signal's noise, in the signal's unit

    @property
    def vector(self) -> Array:
        """All finite levels."""
        times = self.time[np.isfinite(self.time)]
        return np.concatenate([self.process, times, self.measurement])

    def at(self, vector: Array) -> Levels:
        """Levels with the values of `vector`."""
        g, ny = len(self.process), len(self.measurement)
        time = self.time.copy()
        time[np.isfinite(time)] = vector[g : len(vector) - ny]
        return Levels(vector[:g], time, vector[len(vector) - ny :])

    def factors(self, steps: Array) -> Array:
        """phi (runs, g): share of an acceleration or a drift that remains after a step of each run."""
        with np.errstate(divide="ignore"):
            remaining: Array = np.exp(-steps[:, None] / np.exp(self.time))
        return remaining

    def variances(self, batch: Batch, nominal: Array) -> Variances:
        """Variances for the filter; the first states are known to within a nominal value."""
        runs, nx = len(batch.steps), len(nominal)
        power = np.exp(2 * self.process)
        process = np.concatenate([np.zeros((runs, nx)), power * (1 - self.factors(batch.steps) ** 2)], axis=1)
        start = np.broadcast_to(np.diag(np.concatenate([nominal**2, power])), (runs, nx + len(power), nx + len(power)))
        measurement = np.where(batch.known, np.exp(2 * self.measurement), 1.0)
        return Variances(process, measurement, start if batch.spread is None else batch.spread, batch.lengths)


@dataclass(frozen=True, eq=False)
class FilterPass:
    """Filtered runs with given parameters and levels."""

    # `before`, `after`: (runs, n, nz): States before and after each measurement
    before: Array
    after: Array
    innovations: Array  # (runs, n, ny): Measured less predicted; 0 where not measured
    tangents: Tangents  # Stacked (runs, n, ...), along the trajectory at which the gains were computed
    gains: Gains
    cost: float  # -2 log likelihood except for a constant; inf where the motion leaves all bounds
    wild: tuple[int, int, int] | None = None  # Run, instant and state that leave all bounds first

    @property
    def trajectory(self) -> tuple[Array, Array]:
        """States before and after each measurement."""
        return self.before, self.after

    @property
    def white(self) -> Array:
        """Whitened innovations (runs, n, ny)."""
        return (self.gains.whitener @ self.innovations[..., None])[..., 0]


def filter_pass(disturbed: Disturbed, batch: Batch, p: Array, levels: Levels, along: tuple[Array, Array]) -> FilterPass:
    """Gains along a trajectory (before, after), and the observer with these gains on its own trajectory."""
    factors = levels.factors(batch.steps)
    cases = [(p, phi, np.array([h])) for phi, h in zip(factors, batch.steps, strict=True)]
    runs, n, ny = batch.measured.shape
    nz, k = batch.starts.shape[1], disturbed.parameters
    tangents = Tangents(*(np.zeros((runs, n, *shape)) for shape in ((nz, nz), (nz, k), (ny, nz), (ny, k))))
    parts: list[int] = []
    for number, (length, case) in enumerate(zip(batch.lengths, cases, strict=True)):
        rows, mask = np.s_[number, :length], batch.known[number, :length, :, None]
        parts.append(disturbed.parts(along[1][rows], batch.inputs[rows], p, float(batch.steps[number])))
        of_run = disturbed.tangents(along[0][rows], along[1][rows], batch.inputs[rows], case, parts[-1])
        tangents.A[rows], tangents.B[rows] = of_run.A, of_run.B
        tangents.C[rows], tangents.D[rows] = np.where(mask, of_run.C, 0.0), np.where(mask, of_run.D, 0.0)
    found = gains(tangents.A, tangents.C, levels.variances(batch, disturbed.nominal))
    before = np.empty((runs, n, nz))
    for number, (length, case) in enumerate(zip(batch.lengths, cases, strict=True)):
        rows = np.s_[number, :length]
        start, inputs, measured = batch.starts[number], batch.inputs[rows], batch.measured[rows]
        before[rows] = disturbed.predicted(start, inputs, measured, found.K[rows], case, parts[number])
        before[number, length:] = before[number, length - 1]
    wild = ~(np.abs(before) < _LARGEST)  # nan, too
    if wild.any():
        place = first_place(wild)
        return FilterPass(before, before, np.zeros_like(batch.measured), tangents, found, np.inf, place)
    seen = np.stack([disturbed.seen(states, inputs, p) for states, inputs in zip(before, batch.inputs, strict=True)])
    innovations = np.where(batch.known, batch.measured - seen, 0.0)
    after = before + (found.K @ innovations[..., None])[..., 0]
    white = found.whitener @ innovations[..., None]
    return FilterPass(before, after, innovations, tangents, found, float(np.sum(white**2)) + found.log_determinant)


def measured_trajectory(problem: Problem, batch: Batch) -> tuple[Array, Array]:
    """A first trajectory: the measured states, velocities from positions, and the first states of all others."""
    n = batch.measured.shape[1]
    states = np.repeat(batch.starts[:, None], n, axis=1)
    names = problem.model.state_names
    for number in range(len(states)):
        columns = {}
        for place, name in enumerate(names):
            shown = name if name in problem.seen else SENSED_BY.get(name)
            if shown not in problem.seen:
                continue
            column = problem.seen.index(shown)
            known = np.flatnonzero(batch.known[number, :, column])
            if len(known):
                columns[name] = np.interp(np.arange(n), known, batch.measured[number, known, column])
                states[number, :, place] = columns[name]
        if {"motion.x", "motion.y", "motion.psi"} <= columns.keys():
            derived = velocities_of(columns, float(batch.steps[number]))
            for name in derived.keys() & set(names) - columns.keys():
                states[number, :, names.index(name)] = derived[name]
    return states, states


def velocities_of(columns: Mapping[str, Array], step: float) -> dict[str, Array]:
    """Velocities (n,) over the ground, along and across the vessel, and the yaw rate, by smooth position and heading.

    `columns`: ``motion.x``, ``motion.y`` and ``motion.psi`` (n,), without gaps. `step`: s.
    """
    width = max(1, round(_SMOOTHED_S / step))
    north, east, rate = (
        uniform_filter1d(np.gradient(columns[f"motion.{letter}"], step), width) for letter in ("x", "y", "psi")
    )
    along, across = np.cos(columns["motion.psi"]), np.sin(columns["motion.psi"])
    return {"motion.u": north * along + east * across, "motion.v": east * along - north * across, "motion.r": rate}
