"""Passes of a Kalman filter over all runs at once: noise levels, linearisation, innovations and their likelihood.

The Kalman filter's gains along a linearised trajectory, the derivatives of its innovations, and the smoother.

Runs of a batch are padded to the same length, and left at their ends; an instant without a measurement has a row of
zeros in C, a residual of 0 and a variance of 1, and adds nothing to the likelihood. All functions work on stacks of
small matrices with any leading axes; the last of them is the run.

A model with random accelerations, and the functions of a filter for it: steps, tangents, observed values.

The accelerations are held over a step and decay from step to step: ``a[k+1] = phi a[k] + w[k]``, a first-order
Gauss-Markov process (white for phi = 0). The sensors may drift in the same way, each by a b that is added to its
observed value. The filter's state is z = (x, a, b).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from tank2sim.arrays import Array
from tank2sim.dynamics.model import Input, Model
from tank2sim.identification.trials.methods.output_error import SENSED_BY, cut
from tank2sim.identification.trials.problem.estimation_problem import Problem
from tank2sim.simulation.rows import Chain, RowFunction
from tank2sim.simulation.scheme import runge_kutta_step

PUSHED = ("motion.u", "motion.v", "motion.r")
"""States whose rates have random accelerations, if the model has the state."""

LARGEST_PART = 0.5
"""Longest integration step, in the shortest time constant of the motion (project choice: Runge and Kutta's error is
then 0.03 % of a fast mode, and the scheme is far from unstable)."""

MOST_PARTS = 20
"""Most integration steps from an instant to the next (project choice: a wilder motion leaves all bounds)."""

_PROBED_S = 1e-3
"""Step whose slopes show the rates of decay, s: far below the time constants of vessels."""


@dataclass(frozen=True, eq=False)
class Tangents:
    """Derivatives along a run of n instants."""

    # `A`, `B`: (n, nz, nz), (n, nz, k): Slopes of the next state by the state (after the measurement) and by the free
    # parameters
    A: Array
    B: Array
    # `C`, `D`: (n, ny, nz), (n, ny, k): Slopes of the observed values by the state (before the measurement) and by the
    # free parameters
    C: Array
    D: Array


class Disturbed:
    """Filter steps of a model with random accelerations.

    `model`: nx states; m of :data:`PUSHED` are among them. `free`: Names of the k parameters of the derivatives.
    `seen`: Names of the ny states and quantities that are measured. `drifting`: Every sensor drifts: nz = nx + m + ny,
    else nz = nx + m.
    """

    def __init__(self, model: Model, free: Sequence[str], seen: Sequence[str], *, drifting: bool = False):
        pushed = [state for state in model.states if state.name in PUSHED]
        self.pushed = tuple(state.name for state in pushed)
        self.nominal = np.array([state.nominal for state in model.states])
        self._places = np.array([place for place, state in enumerate(model.states) if state in pushed])
        whole, pushes = _pushed(model, [state.derivative for state in pushed])
        drifts = ca.SX.sym("drift", len(seen) if drifting else 0)
        correlated = ca.vertcat(pushes, drifts)
        self.correlated, self.parameters = int(correlated.numel()), len(free)
        z, phi, h = ca.vertcat(model.x, correlated), ca.SX.sym("phi", self.correlated), ca.SX.sym("h")
        theta = ca.vcat([model.symbol(name) for name in free])
        moved = runge_kutta_step(whole)(model.x, ca.vertcat(model.u, pushes), model.p, h)
        following = ca.vertcat(moved, phi * correlated)
        shown = whole.expand(ca.vcat([model.symbol(name) for name in seen]))
        shown = shown + drifts if drifting else shown
        y, K = ca.SX.sym("y", len(seen)), ca.SX.sym("K", z.numel(), len(seen))
        corrected = ca.substitute(following, z, z + K @ (y - shown))
        arguments, cse = [z, model.u, model.p], {"cse": True}
        step_derivatives = [ca.densify(ca.jacobian(following, expression)) for expression in (z, theta)]
        shown_by = [ca.densify(expression) for expression in (shown, ca.jacobian(shown, z), ca.jacobian(shown, theta))]
        self._observer = Chain(ca.Function("observer", [*arguments, y, ca.vec(K), phi, h], [corrected], cse))
        self._tangents = RowFunction(ca.Function("pushed_tangents", [*arguments, phi, h], step_derivatives, cse))
        self._moved = RowFunction(ca.Function("pushed_moved", [*arguments, phi, h], [following], cse))
        self._shown = RowFunction(ca.Function("pushed_shown", arguments, shown_by, cse))

    def parts(self, states: Array, inputs: Array, p: Array, h: float) -> int:
        """Integration steps from an instant to the next, by the fastest mode of the motion along states (n, nz)."""
        case = p, np.ones(self.correlated), np.array([_PROBED_S])
        slopes = self._tangents(states, inputs, *case)[0].reshape(len(states), states.shape[1], -1)
        block = slopes[:, self._places[:, None], self._places] - np.eye(len(self._places))
        block = block[np.isfinite(block).all(axis=(1, 2))]
        fastest = float(np.abs(np.linalg.eigvals(block)).max()) / _PROBED_S if len(block) else 0.0
        return int(np.clip(np.ceil(fastest * h / LARGEST_PART), 1, MOST_PARTS))

    def predicted(
        self, start: Array, inputs: Array, measured: Array, gains: Array, case: tuple[Array, ...], parts: int = 1
    ) -> Array:
        """States (n, nz) before each measurement, of the observer with given gains.

        `start` (nz,). `inputs` (n, nu). `measured` (n, ny): Without nan: any value where not measured, with a column of
        zeros in the gain. `gains` (n, nz, ny). `case`: Parameters p, factors phi (nz - nx,), step h (1,). `parts`:
        Integration steps from an instant to the next.
        """
        p, phi, h = case
        columns = gains[:-1].transpose(0, 2, 1).reshape(len(gains) - 1, -1)
        # A measurement corrects the first part, and accelerations decay after the last.
        corrected = np.zeros((len(columns) * parts, columns.shape[1]))
        corrected[::parts] = columns
        decay = np.ones((len(corrected), len(phi)))
        decay[parts - 1 :: parts] = phi
        rows = np.repeat(inputs[:-1], parts, axis=0), np.repeat(measured[:-1], parts, axis=0)
        return self._observer.run(start, rows[0], p, rows[1], corrected, decay, h / parts)[::parts]

    def seen(self, states: Array, inputs: Array, p: Array) -> Array:
        """Observed values (n, ny) at states z (n, nz)."""
        return self._shown(states, inputs, p)[0]

    def tangents(self, before: Array, after: Array, inputs: Array, case: tuple[Array, ...], parts: int = 1) -> Tangents:
        """Derivatives at the states before and after each measurement (n, nz), over `parts` integration steps."""
        p, phi, h = case
        (n, nz), undecayed, slopes = before.shape, np.ones(len(phi)), []
        for part in range(1, parts + 1):
            of_part = self._tangents(after, inputs, p, phi if part == parts else undecayed, h / parts)
            slopes.append([each.reshape(n, -1, nz).transpose(0, 2, 1) for each in of_part])
            if part < parts:
                after = self._moved(after, inputs, p, undecayed, h / parts)[0]
        A, B = slopes[0]
        for by_state, by_theta in slopes[1:]:
            A, B = by_state @ A, by_state @ B + by_theta
        seen, C, D = self._shown(before, inputs, p)
        ny = seen.shape[1]
        return Tangents(
            A=A,
            B=B,
            C=C.reshape(n, nz, ny).transpose(0, 2, 1),
            D=D.reshape(n, -1, ny).transpose(0, 2, 1),
        )


def _pushed(model: Model, rates: Sequence[str]) -> tuple[Model, ca.SX]:
    """The model with an input added to each of the quantities `rates`, and the symbols of these inputs."""
    inputs = tuple(
        Input(name=f"process.{rate}", unit=model[rate].unit, description=f"Random acceleration in {rate}")
        for rate in rates
    )
    whole = model.extend(*inputs)
    for rate, push in zip(rates, inputs, strict=True):
        whole = whole.redefine(rate, lambda old, push=push: old + push.symbol)  # type: ignore[misc]
    return whole, ca.vcat([push.symbol for push in inputs])


@dataclass(frozen=True, eq=False)
class Variances:
    """Variances of the process and of the measurements."""

    process: Array  # (..., runs, nz): Variances of the noise added to the state in a step (diagonal)
    measurement: Array  # (..., runs, n, ny): 1 where not measured
    start: Array  # (..., runs, nz, nz): Covariance of the first state
    # Instants of each run; the rest of the n is padding; by default all have n
    lengths: Sequence[int] | None = None


@dataclass(frozen=True, eq=False)
class Gains:
    """Gains and covariances of a pass of the filter."""

    K: Array  # (runs, n, nz, ny): Gains; 0 in the padding
    # (runs, n, ny, ny): W, the inverse of the Cholesky factor of the innovation's covariance S: ``W S W' = 1``; 1 in
    # the padding
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


def smooth_states(filtered: FilterPass) -> tuple[Array, Array]:
    """States (runs, n, nz) from all measurements, before and after each instant, and their standard errors.

    The smoother of Rauch, Tung and Striebel (1965, AIAA J. 3) in the form of Bierman (1973, Automatica 9), which needs
    no inverse of the state's covariance, nearly singular where process noise is small.
    """
    A, C, found, before = filtered.tangents.A, filtered.tangents.C, filtered.gains, filtered.before
    runs, n, nz = before.shape
    states, errors = np.empty_like(before), np.empty_like(before)
    adjoint, spread = np.zeros((runs, nz, 1)), np.zeros((runs, nz, nz))
    for k in range(n - 1, -1, -1):
        WC = found.whitener[:, k] @ C[:, k]
        white = found.whitener[:, k] @ filtered.innovations[:, k, :, None]
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


def innovation_tangents(tangents: Tangents, found: Gains) -> Array:
    """Derivatives of the whitened innovations by the parameters (runs, n, ny, k), with the gains held."""
    A, B, C, D = tangents.A, tangents.B, tangents.C, tangents.D
    runs, n, _, k = D.shape
    result, following = np.zeros(D.shape), np.zeros((runs, A.shape[-1], k))
    for rows, on in _together(found.lengths, runs, n):
        S = following[on]
        for row in rows:
            e = -(C[on, row] @ S + D[on, row])
            result[on, row] = found.whitener[on, row] @ e
            S = A[on, row] @ (S + found.K[on, row] @ e) + B[on, row]
        following[on] = S
    return result


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
    # (runs, nz): First guess of the first states, from the nearby measurements; without random acceleration or drift
    starts: Array


def batch_of(problem: Problem, correlated: int) -> Batch:
    """The runs of a problem, for a filter with `correlated` random accelerations and drifts."""
    lengths = tuple(len(run.measured) for run in problem.runs)
    padding = [((0, max(lengths) - length), (0, 0)) for length in lengths]
    padded = list(zip(problem.runs, padding, strict=True))
    inputs = np.stack([np.pad(run.inputs, rows, mode="edge") for run, rows in padded])
    measured = np.stack([np.pad(run.measured, rows, constant_values=np.nan) for run, rows in padded])
    known = ~np.isnan(measured)
    starts = [np.append(cut(problem, run, None).starts[0], np.zeros(correlated)) for run in problem.runs]
    steps = np.array([run.step_s for run in problem.runs])
    return Batch(inputs, np.where(known, measured, 0.0), known, lengths, steps, np.stack(starts))


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
        return Variances(process, measurement, start, batch.lengths)


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

    @property
    def slopes(self) -> Array:
        """Derivatives of the whitened innovations (runs, n, ny, k) by the parameters, with the gains held."""
        return innovation_tangents(self.tangents, self.gains)


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
