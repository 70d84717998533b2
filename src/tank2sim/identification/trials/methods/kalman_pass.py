"""Passes of a Kalman filter over all runs at once: noise levels, linearisation, innovations and their likelihood.

The Kalman filter's gains along a linearised trajectory, the derivatives of its innovations, and the smoother.

Runs of a batch are padded to the same length, and left at their ends; an instant without a measurement has a row of
zeros in C, a residual of 0 and a variance of 1, and adds nothing to the likelihood. All functions work on stacks of
small matrices with any leading axes, of which the last is the run.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from tank2sim.arrays import Array
from tank2sim.identification.trials.methods.output_error import SENSED_BY, cut
from tank2sim.identification.trials.methods.process_noise import Disturbed, Tangents
from tank2sim.identification.trials.problem.estimation_problem import Problem


@dataclass(frozen=True, eq=False)
class Variances:
    """Variances of the process and of the measurements."""

    process: Array  # (..., runs, nz): Variances of the noise added to the state in a step (diagonal)
    measurement: Array  # (..., runs, n, ny): 1 where not measured
    start: Array  # (..., runs, nz, nz): Covariance of the first state
    # Instants of each run, of which the rest of the n is padding; by default all have n
    lengths: Sequence[int] | None = None


@dataclass(frozen=True, eq=False)
class Gains:
    """Gains and covariances of a pass of the filter."""

    K: Array  # (runs, n, nz, ny): Gains; 0 in the padding
    # (runs, n, ny, ny): W, the inverse of the Cholesky factor of the innovation's covariance S: ``W S W' = 1``;
    # 1 in the padding
    whitener: Array
    P: Array  # (runs, n, nz, nz): Covariance of the state before each measurement; 0 in the padding
    lengths: Sequence[int] | None = None  # As those of :class:`Variances`

    @property
    def log_determinant(self) -> float:
        """Sum of log det S."""
        return float(-2 * np.log(np.diagonal(self.whitener, axis1=-2, axis2=-1)).sum())


class FilterFault(np.linalg.LinAlgError):
    """The covariance of a filter is no longer positive, because the linearised motion is too unstable.

    `place`: Run, instant, and the state whose variance is largest.
    """

    def __init__(self, place: tuple[int, int, int]):
        super().__init__("the covariance of the filter is not positive")
        self.place = place


def first_place(wild: NDArray[np.bool_]) -> tuple[int, int, int]:
    """Run, instant and state of the earliest true place of an array (runs, n, nz).

    Examples
    --------
    >>> import numpy as np
    >>> first_place(np.array([[[0, 0], [0, 1]], [[1, 0], [0, 0]]]).astype(bool))
    (1, 0, 0)
    """
    runs, instants, states = np.nonzero(wild)
    place = int(np.argmin(instants))
    return int(runs[place]), int(instants[place]), int(states[place])


def _together(lengths: Sequence[int] | None, runs: int, n: int) -> Iterator[tuple[range, NDArray[np.intp]]]:
    """Instants in their order, taken apart where a run ends, each part with the runs that go on in it."""
    every = np.full(runs, n) if lengths is None else np.asarray(lengths)
    for begin, end in pairwise([0, *np.unique(every).tolist()]):
        yield range(begin, end), np.flatnonzero(every > begin)


def gains(A: Array, C: Array, variances: Variances) -> Gains:
    """Filter gains of A (runs, n, nz, nz) and C (runs, n, ny, nz)."""
    runs, n, ny, nz = C.shape
    result = Gains(
        np.zeros((runs, n, nz, ny)),
        np.tile(np.eye(ny), (runs, n, 1, 1)),
        np.zeros((runs, n, nz, nz)),
        variances.lengths,
    )
    last = variances.start.copy()
    for instants, on in _together(variances.lengths, runs, n):
        P, process = last[on], variances.process[on]
        for k in instants:
            result.P[on, k] = P
            try:
                _, W, M = _update(P, C[on, k], variances.measurement[on, k])
            except np.linalg.LinAlgError:
                raise FilterFault(_faulty(P, on, k)) from None
            result.whitener[on, k] = W
            result.K[on, k] = np.swapaxes(M, -1, -2) @ W
            P = _following(P, M, A[on, k], process)
        last[on] = P
    return result


def _faulty(P: Array, on: NDArray[np.intp], instant: int) -> tuple[int, int, int]:
    """Place of the largest variance of covariances (runs, nz, nz), the instant being known."""
    size = np.abs(np.diagonal(P, axis1=-2, axis2=-1))
    run, state = np.unravel_index(int(np.argmax(np.where(np.isfinite(size), size, np.inf))), size.shape)
    return int(on[run]), instant, int(state)


def variant_likelihoods(
    tangents: Tangents, variances: Variances, innovations: Array, after: Array, factors: Array
) -> tuple[Array, Array]:
    """Likelihood of filters with other noise levels, along the same linearised trajectory.

    `tangents`: Stacked (runs, n, ...). `variances`: With a leading axis of variants; the first variant is the filter of
    the trajectory itself. `innovations`, `after` (runs, n, ny), (runs, n, nz): Innovations of the first variant, and
    its states after each measurement. `factors` (variants, runs, g): Share of each of the last g states that remains
    after a step. Returns `cost` (variants,): -2 log likelihood: sum of log det S and of squared whitened innovations.
    Returns `information` (variants, variants): Sum of ``d d' + t t' / 2``, with d and t the changes against the first
    variant of each innovation over its standard deviation and of the logarithm of its variance: Fisher's information
    for small changes if the signals of an instant were independent. (With the true information the steps are too short
    where the model is far off.)
    """
    count, runs, g = factors.shape
    n, _, nz = tangents.C.shape[1:]
    cost, information = np.zeros(count), np.zeros((count, count))
    last, relative = variances.start.copy(), np.zeros((count, runs, nz, 1))
    places = np.arange(nz - g, nz)
    for instants, on in _together(variances.lengths, runs, n):
        P, before = last[:, on], relative[:, on]
        process, phi = variances.process[:, on], factors[:, on]
        A = np.empty((count, len(on), nz, nz))
        for k in instants:
            C = tangents.C[on, k]
            A[:] = tangents.A[on, k]
            A[..., places, places] = phi
            S, W, M = _update(P, C, variances.measurement[:, on, k])
            e = innovations[on, k, :, None] - C @ before
            white = W @ e
            cost += (white[..., 0] ** 2 - 2 * np.log(np.diagonal(W, axis1=-2, axis2=-1))).sum(axis=(1, 2))
            variance = np.diagonal(S, axis1=-2, axis2=-1)
            d = ((e - e[:1])[..., 0] / np.sqrt(variance[:1])).reshape(count, -1)
            t = ((variance - variance[:1]) / variance[:1]).reshape(count, -1)
            information += d @ d.T + 0.5 * t @ t.T
            correction = np.swapaxes(M, -1, -2) @ white
            before = A @ (before + correction - correction[:1])  # relative to the state of the first variant
            before[..., nz - g :, 0] += (phi - phi[:1]) * after[on, k, nz - g :]
            P = _following(P, M, A, process)
        last[:, on], relative[:, on] = P, before
    return cost, information


def _update(P: Array, C: Array, measurement: Array) -> tuple[Array, Array, Array]:
    """S, W and ``M = W C P``: the gain is ``M' W``, and a measurement takes ``M' M`` from P."""
    CP = C @ P
    S = CP @ np.swapaxes(C, -1, -2)
    places = np.arange(S.shape[-1])
    S[..., places, places] += measurement
    W = np.linalg.inv(np.linalg.cholesky(S))
    return S, W, W @ CP


def _following(P: Array, M: Array, A: Array, process: Array) -> Array:
    after = P - np.swapaxes(M, -1, -2) @ M
    following: Array = A @ after @ np.swapaxes(A, -1, -2)
    following = 0.5 * (following + np.swapaxes(following, -1, -2))
    places = np.arange(P.shape[-1])
    following[..., places, places] += process
    return following


def smooth_states(A: Array, C: Array, found: Gains, before: Array, innovations: Array) -> tuple[Array, Array]:
    """States (runs, n, nz) from all measurements, before and after each instant, and their standard errors.

    The smoother of Rauch, Tung and Striebel (1965, AIAA J. 3) in the form of Bierman (1973, Automatica 9), which needs
    no inverse of the state's covariance, nearly singular where process noise is small.
    """
    runs, n, nz = before.shape
    states, errors = np.empty_like(before), np.empty_like(before)
    adjoint, spread = np.zeros((runs, nz, 1)), np.zeros((runs, nz, nz))
    for k in range(n - 1, -1, -1):
        WC = found.whitener[:, k] @ C[:, k]
        white = found.whitener[:, k] @ innovations[:, k, :, None]
        kept = np.eye(nz) - found.K[:, k] @ C[:, k]
        back = np.swapaxes(A[:, k] @ kept, -1, -2)
        turned = np.swapaxes(WC, -1, -2)
        adjoint = turned @ white + back @ adjoint
        spread = turned @ WC + back @ spread @ np.swapaxes(back, -1, -2)
        P = found.P[:, k]
        states[:, k] = before[:, k] + (P @ adjoint)[..., 0]
        variance = np.diagonal(P, axis1=-2, axis2=-1) - np.diagonal(P @ spread @ P, axis1=-2, axis2=-1)
        errors[:, k] = np.sqrt(np.maximum(variance, 0.0))
    return states, errors


def innovation_tangents(tangents: Tangents, found: Gains, start: Array | None = None) -> tuple[Array, Array]:
    """Derivatives of the whitened innovations by the parameters (runs, n, ny, k), with the gains held.

    Second result: derivatives of the state before the last measurement (runs, nz, k). `start`: those before the first,
    by default 0.
    """
    A, B, C, D = tangents.A, tangents.B, tangents.C, tangents.D
    runs, n, _, k = D.shape
    result = np.zeros(D.shape)
    last = np.zeros((runs, A.shape[-1], k)) if start is None else start.copy()
    following = last.copy()
    for rows, on in _together(found.lengths, runs, n):
        S = following[on]
        for row in rows:
            before, e = S, -(C[on, row] @ S + D[on, row])
            result[on, row] = found.whitener[on, row] @ e
            S = A[on, row] @ (S + found.K[on, row] @ e) + B[on, row]
        last[on], following[on] = before, S
    return result, last


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
