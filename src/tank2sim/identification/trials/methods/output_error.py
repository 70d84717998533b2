"""Output error by multiple shooting: comparison of the model's motion with the measured one, piece by piece.

Gauss-Newton with Levenberg's damping on exact derivatives; noise of each signal is white plus first-order
autoregressive and estimated from the residuals (:mod:`.coloured_noise`); initial states are estimated with the
parameters. The width of the prior can be scaled by the evidence (MacKay 1992, Neural Computation 4).

Multiple shooting: runs cut into pieces, each with its own initial state, which is estimated with the parameters.

Each piece is compared with its measurements; its end is not tied to the start of the next. The initial states are
eliminated from the normal equations (a Schur complement), so that these have the size of the parameters. The `noise` of
the methods is per seen variable (ny).
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from tank2sim.arrays import Array
from tank2sim.identification.trials.methods.coloured_noise import ColouredNoise, estimate_coloured_noise, white
from tank2sim.identification.trials.methods.gauss_newton import (
    damped_gauss_newton,
    is_minimum,
    refuse_stopped,
    within_bounds,
)
from tank2sim.identification.trials.problem.estimation_problem import (
    BLOCK,
    Estimate,
    FittedMotion,
    Problem,
    SearchReport,
    evidence_scale,
    sandwich,
    scaled_prior,
    silent,
)
from tank2sim.identification.trials.problem.sampled_runs import SampledRun, rudder_at_start
from tank2sim.notices import Notice
from tank2sim.simulation.sensitivity import Sensitivity

START_WINDOW = 5
"""First guess of an initial state: a straight line through this many instants on either side (project choice)."""


@dataclass(frozen=True, eq=False)
class Pieces:
    """A run cut into pieces of equal length that share their ends."""

    run: SampledRun  # The run
    inputs: Array  # (pieces, n + 1, nu)
    # (pieces, n + 1, ny): The last row is nan except in the last piece: it is the first of the next piece
    measured: Array
    starts: Array  # (pieces, nx): First guess of the initial states


SENSED_BY = {
    "motion.psi": "compass.heading",
    "motion.r": "gyro.rate",
    "motion.u": "compass.u",
    "motion.v": "compass.v",
}
"""State to the reading of a sensor with errors of its own that is nearly the state."""


def cut(problem: Problem, run: SampledRun, length_s: float | None) -> Pieces:
    """Pieces of about `length_s` s; the whole run for None. Up to one step per piece remains unused at the end."""
    steps = len(run.measured) - 1
    count = 1 if length_s is None else max(1, round(steps * run.step_s / length_s))
    n = steps // count
    rows = np.arange(count)[:, None] * n + np.arange(n + 1)
    measured = run.measured[rows].copy()
    measured[:-1, -1] = np.nan
    starts = np.stack([_start(problem, run, first) for first in rows[:, 0]])
    return Pieces(run, run.inputs[rows], measured, starts)


def _start(problem: Problem, run: SampledRun, first: int) -> Array:
    """State of the model at an instant, from nearby measurements; else its start value."""
    model = problem.model
    values = {name: _local(run.column(name), first) for name in run.seen}
    p = model.parameter_values()
    default = np.array(model.initial(p)).ravel()
    state = []
    for place, variable in enumerate(model.states):
        value = values.get(variable.name, values.get(SENSED_BY.get(variable.name, "")))
        if value is None and variable.name == "motion.u":
            value = values.get("motion.u_ground", values.get("motion.sog"))
        if value is None and variable.name == "motion.v":
            value = values.get("motion.v_ground")
        if variable.name == "rudder.angle":
            order = run.inputs[:, model.input_names.index("rudder.command")]
            value = float(order[first - 1]) if first else rudder_at_start(run, order, problem.ship_time)
        state.append(default[place] if value is None else value)
    return np.array(state)


def _local(column: Array, first: int) -> float | None:
    low, high = max(0, first - START_WINDOW), min(len(column), first + START_WINDOW + 1)
    places = np.arange(low, high) - first
    near = column[low:high]
    known = ~np.isnan(near)
    if np.count_nonzero(known) < 2:
        return None
    return float(np.polyfit(places[known], near[known], 1)[1])


@dataclass(frozen=True, eq=False)
class Shot:
    """Simulated motion of the pieces of one run."""

    starts: Array  # (pieces, nx): Initial states
    states: Array  # (pieces, n + 1, nx)
    residuals: Array  # (pieces, n + 1, ny): Simulated less measured
    cost: float  # Sum of squares, with the weak prior of the initial states; inf where the motion leaves all bounds


@dataclass(frozen=True, eq=False)
class Normal:
    """Normal equations of one run with the initial states eliminated, at given parameters and initial states."""

    matrix: Array  # (k, k)
    vector: Array  # (k,): ``matrix @ step = -vector`` for the parameters alone
    states: Array  # (unknown, k): Change of the initial states: ``-(step + states @ parameter step)``
    step: Array
    # `white`, `white_by`: (pieces, samples) and (pieces, samples, nx + k): Whitened residuals, and their derivatives by
    # the initial state of the piece and by the parameters
    white: Array
    white_by: Array


class Shooting:
    """Motion of pieces and its normal equations, for the parameters `free` of a problem.

    `starts_alone`: Derivatives by initial states alone: the normal equations have no parameters.
    """

    def __init__(self, problem: Problem, *, starts_alone: bool = False):
        self.problem = problem
        self.sensitivity = Sensitivity(problem.model, () if starts_alone else problem.free, problem.seen)
        # Weak prior of initial states: within a nominal value of the guess.
        self.wide = np.array([state.nominal for state in problem.model.states])

    def shot(self, pieces: Pieces, starts: Array, values: Array, noise: Sequence[ColouredNoise]) -> Shot:
        """Motion of the pieces of a run from `starts`, with the parameters `values`."""
        p, h = self.problem.parameters(values), pieces.run.step_s
        pairs = zip(starts, pieces.inputs, strict=True)
        states = np.stack([self.sensitivity.motion(start, inputs[:-1], p, h) for start, inputs in pairs])
        flat = states.reshape(-1, states.shape[2]), pieces.inputs.reshape(-1, pieces.inputs.shape[2])
        residuals = self.sensitivity.shown(*flat, p).reshape(pieces.measured.shape) - pieces.measured
        if not np.isfinite(states).all() or np.abs(states).max() > 1e9:
            return Shot(starts, states, residuals, np.inf)
        cost = float(np.sum(whitened(residuals, residuals, noise) ** 2))
        cost += float(np.sum(((starts - pieces.starts) / self.wide) ** 2))
        return Shot(starts, states, residuals, cost)

    def linearised(
        self, pieces: Pieces, shot: Shot, values: Array, noise: Sequence[ColouredNoise]
    ) -> tuple[Array, Array]:
        """Whitened residuals of a run and their derivatives: `white` and `white_by` of :class:`Normal`."""
        p, count = self.problem.parameters(values), len(shot.starts)
        _, by, _ = self.sensitivity.derivatives(shot.states, pieces.inputs, p, pieces.run.step_s)
        white = whitened(shot.residuals, shot.residuals, noise)
        white_by = whitened(shot.residuals, by.reshape(*by.shape[:2], -1), noise, by.shape[3])
        return white.reshape(count, -1), white_by.reshape(count, -1, by.shape[3])

    def normal(self, pieces: Pieces, shot: Shot, values: Array, noise: Sequence[ColouredNoise]) -> Normal:
        """Normal equations of one run."""
        count, nx = shot.starts.shape
        r, J = self.linearised(pieces, shot, values, noise)
        products = J.transpose(0, 2, 1) @ J
        pull = (J.transpose(0, 2, 1) @ r[:, :, None])[:, :, 0]
        # Unknowns: initial states of all pieces, then parameters.
        k = products.shape[1] - nx
        size = count * nx
        H, g = np.zeros((size + k, size + k)), np.zeros(size + k)
        spread = np.tile(self.wide, count)
        H[np.arange(size), np.arange(size)] = 1 / spread**2
        for piece in range(count):
            at = np.r_[piece * nx : (piece + 1) * nx, size : size + k]
            H[np.ix_(at, at)] += products[piece]
            g[at] += pull[piece]
        g[:size] += ((shot.starts - pieces.starts) / self.wide**2).ravel()
        inner = np.linalg.inv(H[:size, :size])
        mixed = inner @ H[:size, size:]
        matrix, vector = H[size:, size:] - H[size:, :size] @ mixed, g[size:] - mixed.T @ g[:size]
        return Normal(matrix, vector, mixed, inner @ g[:size], r, J)

    def scores(self, pieces: Pieces, normal: Normal) -> Array:
        """Shares of `vector` in the order of time, each of :data:`BLOCK` lengths or less (blocks, k): for standard
        errors."""
        count, nx = pieces.starts.shape
        rows, ny = pieces.measured.shape[1:]
        blocks = max(1, round(rows * pieces.run.step_s / (BLOCK * self.problem.ship_time)))
        edges = np.linspace(0, rows, blocks + 1).astype(int)[:-1] * ny
        pull = np.add.reduceat(normal.white_by * normal.white[:, :, None], edges, axis=1)  # (pieces, blocks, nx + k)
        by_piece = normal.states.reshape(count, nx, -1)
        scores: Array = pull[:, :, nx:] - np.einsum("pbx,pxk->pbk", pull[:, :, :nx], by_piece)
        return scores.reshape(count * blocks, -1)

    def settled(self, pieces: Pieces, values: Array, noise: Sequence[ColouredNoise]) -> Shot:
        """Motion from the initial states that fit a run best, at these parameters."""
        best = self.shot(pieces, pieces.starts.copy(), values, noise)
        for _ in range(3):  # the motion is nearly linear in its initial state: three steps are enough
            if not np.isfinite(best.cost):
                break
            step = self.normal(pieces, best, values, noise).step.reshape(best.starts.shape)
            moved = self.shot(pieces, best.starts - step, values, noise)
            if moved.cost >= best.cost:
                break
            best = moved
        return best


def whitened(residuals: Array, values: Array, noise: Sequence[ColouredNoise], columns: int = 1) -> Array:
    """Values (pieces, n, ny * columns) whitened like the residuals; 0 where not measured."""
    shape = (*residuals.shape[:2], residuals.shape[2], columns)
    values, result = values.reshape(shape), np.empty(shape)
    for place, signal_noise in enumerate(noise):
        known, used = _samples(residuals[:, :, place], signal_noise)
        filled = values[:, :, place].copy()
        filled[~known] = 0.0
        result[:, :, place] = signal_noise.whitened(filled)
        result[:, :, place][~used] = 0.0
    return result.reshape(*residuals.shape[:2], -1)


def whitening_transposed(residuals: Array, white: Array, noise: Sequence[ColouredNoise]) -> Array:
    """The transpose of :func:`whitened` applied to `white` (pieces, n, ny): derivatives by whitened residuals become
    derivatives by residuals."""
    result = np.zeros_like(white)
    for place, signal_noise in enumerate(noise):
        known, used = _samples(residuals[:, :, place], signal_noise)
        pull = signal_noise.whitened_transposed(np.where(used, white[:, :, place], 0.0))
        result[:, :, place] = np.where(known, pull, 0.0)
    return result


def _samples(residuals: Array, noise: ColouredNoise) -> tuple[np.ndarray, np.ndarray]:
    """Which samples (pieces, n) are measured, and which of them count."""
    known = ~np.isnan(residuals)
    if not noise.phi:
        return known, known
    # A sample after a gap would be compared with the filled-in zero.
    return known, known & np.concatenate([np.ones_like(known[:, :1]), known[:, :-1]], axis=1)


LONGEST_SEARCH = 25
"""Steps after which a search ends; it needs 3 to 10."""

INTERRUPTED = Notice("interrupted: the estimates are the best found so far")


@dataclass(frozen=True)
class OutputErrorSettings:
    """Settings of output error."""

    # Length of a piece, s; None takes whole runs (not for a course-unstable ship: its motion diverges)
    piece_s: float | None = None
    coloured: bool = True  # Noise with an autoregressive part; else white
    scale_prior: bool = True  # Multiply the prior's standard errors by the factor of largest evidence, at least 1
    rounds: int = 4  # Number of estimates of noise (and prior)


def output_error(
    problem: Problem,
    start: Array | None = None,
    settings: OutputErrorSettings | None = None,
    progress: SearchReport = silent,
) -> Estimate:
    """Estimate the free parameters by output error.

    `start` (k,): Start of the search; by default the prior's mean. `progress`: Called with each better estimate; its
    exceptions propagate. Raises StoppedSearchError: The search cannot move from its start, although the data ask for
    it.
    """
    settings = settings or OutputErrorSettings()
    notices: tuple[Notice, ...] = ()
    with ThreadPoolExecutor(max_workers=os.cpu_count()) as threads:
        search = _Search(problem, settings, problem.prior_mean if start is None else start, progress, threads)
        try:
            for number in range(settings.rounds):
                last = number == settings.rounds - 1
                shots, normals = search.minimise(tolerance=1e-4 if last else 1e-2)
                if not last:
                    search.widen(shots, normals)
        except KeyboardInterrupt:
            notices = (INTERRUPTED,)
            normals = search.normals(search.point(search.values, search.starts))
    prior, values = scaled_prior(problem, search.scale), search.values
    if not search.costs and not notices:
        stays = is_minimum(*search.whole_normal(values, normals), bounded=(values, *problem.bounds))
        refuse_stopped("output error", stays)
    information = np.asarray(sum(normal.matrix for normal in normals))
    scores = list(map(search.shooting.scores, search.pieces, normals))
    return Estimate(
        method="output_error",
        free=problem.free,
        values=values,
        covariance=sandwich(information, prior, scores, problem.before(values, prior)[0]),
        information=information,
        noise={name: noise.deviation for name, noise in zip(problem.seen, search.noise, strict=True)},
        cost=tuple(search.costs),
        prior_scale=search.scale,
        notices=notices,
        motion=FittedMotion(settings.piece_s, tuple(search.starts), search.noise),
    )


@dataclass(frozen=True, eq=False)
class _Point:
    """Parameters (k,), motion of each run, and the sum of squares with the prior."""

    values: Array
    shots: list[Shot]
    cost: float


class _Search:
    """A search, with its best point so far. Runs are independent, and machine code lets threads run in parallel."""

    def __init__(
        self,
        problem: Problem,
        settings: OutputErrorSettings,
        values: Array,
        progress: SearchReport,
        threads: ThreadPoolExecutor,
    ):
        self.problem, self.settings, self.progress, self.threads = problem, settings, progress, threads
        self.shooting = Shooting(problem)
        self.pieces = [cut(problem, run, settings.piece_s) for run in problem.runs]
        self.values, self.starts = values.copy(), [piece.starts.copy() for piece in self.pieces]
        # A tenth of the spread of each signal, before any residual is known.
        spread = np.nanstd(np.concatenate([run.measured for run in problem.runs]), axis=0)
        self.noise = tuple(white(0.1 * float(size) if size > 0 else 1.0) for size in spread)
        self.scale: dict[str, float] = {}
        self.costs: list[float] = []

    def point(self, values: Array, starts: list[Array]) -> _Point:
        """Motion of all runs."""
        shoot = self.shooting.shot
        shots = list(self.threads.map(lambda piece, at: shoot(piece, at, values, self.noise), self.pieces, starts))
        before = self.problem.before(values, scaled_prior(self.problem, self.scale))[2]
        return _Point(values, shots, before + sum(shot.cost for shot in shots))

    def normals(self, point: _Point) -> list[Normal]:
        """Normal equations of all runs."""
        solve = self.shooting.normal
        pairs = self.pieces, point.shots
        return list(self.threads.map(lambda piece, shot: solve(piece, shot, point.values, self.noise), *pairs))

    def whole_normal(self, values: Array, normals: list[Normal]) -> tuple[Array, Array]:
        """Normal equations (k, k), (k,) of all runs, the captive tests and the prior."""
        known, pull, _ = self.problem.before(values, scaled_prior(self.problem, self.scale))
        matrix, vector = (sum(getattr(normal, name) for normal in normals) for name in ("matrix", "vector"))
        return np.asarray(matrix) + known, np.asarray(vector) + pull

    def minimise(self, tolerance: float) -> tuple[list[Shot], list[Normal]]:
        """Damped Gauss-Newton steps from the best point so far: motion and normal equations at the new best one."""

        def move(start: _Point, normals: list[Normal], damping: float) -> _Point:
            H, g = self.whole_normal(start.values, normals)
            step = within_bounds(H + damping * np.diag(np.diag(H)), g, start.values, self.problem.bounds)
            # A share of the states' own step, too: with both small enough the sum of squares falls.
            starts = [
                shot.starts - (normal.step / (1 + damping) + normal.states @ step).reshape(shot.starts.shape)
                for shot, normal in zip(start.shots, normals, strict=True)
            ]
            return self.point(start.values + step, starts)

        def report(better: _Point, gain: float) -> bool:
            self.values, self.starts = better.values, [shot.starts for shot in better.shots]
            self.costs.append(better.cost)
            self.progress("output error", better.values, better.cost)
            return gain < tolerance * max(1.0, 1e-3 * better.cost)

        first = self.point(self.values, self.starts)
        found = damped_gauss_newton(first, self.normals, move, report, LONGEST_SEARCH)
        best, _, last = found
        return best.shots, last or self.normals(best)

    def widen(self, shots: list[Shot], normals: list[Normal]) -> None:
        """Estimate the noise by the residuals, and the width of the prior by its evidence."""
        noise, problem = [], self.problem
        for place in range(len(problem.seen)):
            residuals = [residual for shot in shots for residual in shot.residuals[:, :, place]]
            measured = np.concatenate([piece.measured[:, :, place].ravel() for piece in self.pieces])
            found = estimate_coloured_noise(residuals, 1e-6 * float(np.nanmax(np.abs(measured)) or 1.0))
            noise.append(found if self.settings.coloured else white(found.deviation))
        self.noise = tuple(noise)
        if self.settings.scale_prior:
            information = np.asarray(sum(normal.matrix for normal in normals))
            if problem.captive is not None:
                information = information + problem.captive.normal(problem.parameters(self.values))[0]
            self.scale = evidence_scale(problem, information, self.values, self.scale)
