"""Output error by multiple shooting: comparison of the model's motion with the measured one, piece by piece.

Gauss-Newton with Levenberg's damping on exact derivatives; noise of each signal is white plus first-order
autoregressive and estimated from the residuals (:mod:`.coloured_noise`); initial states are estimated with the
parameters. The width of the prior can be scaled by the evidence (MacKay 1992, Neural Computation 4).
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np

from tank2sim.arrays import Array
from tank2sim.identification.trials.methods.coloured_noise import ColouredNoise, estimate_coloured_noise, white
from tank2sim.identification.trials.methods.gauss_newton import (
    damped_gauss_newton,
    is_minimum,
    refuse_stopped,
    within_bounds,
)
from tank2sim.identification.trials.methods.posterior import evidence_scale, sandwich, scaled_prior
from tank2sim.identification.trials.methods.shooting import Normal, Pieces, Shooting, Shot, cut
from tank2sim.identification.trials.problem.estimation_problem import (
    Estimate,
    FittedMotion,
    Problem,
    SearchReport,
    silent,
)
from tank2sim.notices import Notice

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


@dataclass(frozen=True, eq=False)
class _Point:
    """Parameters (k,), motion of each run, and the sum of squares with the prior."""

    values: Array
    shots: list[Shot]
    cost: float


@dataclass
class _Search:
    """State of a search."""

    values: Array
    starts: list[Array]
    noise: tuple[ColouredNoise, ...]
    scale: dict[str, float] = field(default_factory=dict)
    costs: list[float] = field(default_factory=list)


def output_error(
    problem: Problem,
    start: Array | None = None,
    settings: OutputErrorSettings | None = None,
    progress: SearchReport = silent,
) -> Estimate:
    """Estimate the free parameters by output error.

    `problem`: k free parameters. `start` (k,): Start of the search; by default the prior's mean. `progress`: Called
    with each better estimate; its exceptions propagate. Raises StoppedSearchError: The search cannot move from its
    start, although the data ask for it.
    """
    settings = settings or OutputErrorSettings()
    shooting = Shooting(problem)
    pieces = [cut(problem, run, settings.piece_s) for run in problem.runs]
    values = problem.prior_mean if start is None else start
    search = _Search(values.copy(), [piece.starts.copy() for piece in pieces], _first_noise(problem, pieces))
    notices = []
    with ThreadPoolExecutor(max_workers=os.cpu_count()) as threads:
        work = _Work(problem, shooting, pieces, threads, progress)
        try:
            for number in range(settings.rounds):
                last = number == settings.rounds - 1
                shots, normals = _minimise(work, search, tolerance=1e-4 if last else 1e-2)
                if not last:
                    search.noise = _new_noise(problem, pieces, shots, settings)
                    if settings.scale_prior:
                        information = np.asarray(sum(normal.matrix for normal in normals))
                        information = information + _captive_normal(problem, search.values)[0]
                        search.scale = evidence_scale(problem, information, search.values, search.scale)
        except KeyboardInterrupt:
            notices.append(INTERRUPTED)
            normals = work.normals(search.values, work.shots(search.values, search.starts, search.noise), search.noise)
    if not search.costs and not notices:
        prior = problem.prior_precision(scaled_prior(problem, search.scale))
        H, g = _whole_normal(problem, search.values, prior, normals)
        refuse_stopped("output error", is_minimum(H, g, bounded=(search.values, *problem.bounds)))
    motion = FittedMotion(settings.piece_s, tuple(search.starts), search.noise)
    return _estimate(work, search, normals, tuple(notices), motion)


def _first_noise(problem: Problem, pieces: list[Pieces]) -> tuple[ColouredNoise, ...]:
    """A tenth of the spread of each signal, before any residual is known."""
    every = np.concatenate([piece.run.measured for piece in pieces])
    spread = np.nanstd(every, axis=0)
    return tuple(white(0.1 * float(size) if size > 0 else 1.0) for size in spread)


@dataclass(frozen=True, eq=False)
class _Work:
    """Constants of a search. Runs are independent, and machine code lets threads run in parallel."""

    problem: Problem
    shooting: Shooting
    pieces: list[Pieces]
    threads: ThreadPoolExecutor
    progress: SearchReport

    def shots(self, values: Array, starts: list[Array], noise: tuple[ColouredNoise, ...]) -> list[Shot]:
        """Motion of all runs."""
        return list(
            self.threads.map(lambda piece, start: self.shooting.shot(piece, start, values, noise), self.pieces, starts)
        )

    def normals(self, values: Array, shots: list[Shot], noise: tuple[ColouredNoise, ...]) -> list[Normal]:
        """Normal equations of all runs."""
        return list(
            self.threads.map(lambda piece, shot: self.shooting.normal(piece, shot, values, noise), self.pieces, shots)
        )


def _minimise(work: _Work, search: _Search, tolerance: float) -> tuple[list[Shot], list[Normal]]:
    """Damped Gauss-Newton steps from the state of the search, which holds the best point afterwards."""
    problem, noise = work.problem, search.noise
    prior = problem.prior_precision(scaled_prior(problem, search.scale))

    def point(values: Array, starts: list[Array]) -> _Point:
        distance = values - problem.prior_mean
        penalty = float(distance @ prior @ distance)
        captive = _captive_normal(problem, values)[2]
        shots = work.shots(values, starts, noise)
        return _Point(values, shots, penalty + captive + sum(shot.cost for shot in shots))

    def linearise(start: _Point) -> list[Normal]:
        return work.normals(start.values, start.shots, noise)

    def move(start: _Point, normals: list[Normal], damping: float) -> _Point:
        H, g = _whole_normal(problem, start.values, prior, normals)
        step = within_bounds(H + damping * np.diag(np.diag(H)), g, start.values, problem.bounds)
        # A share of the states' own step, too: with both small enough the sum of squares falls.
        starts = [
            shot.starts - (normal.step / (1 + damping) + normal.states @ step).reshape(shot.starts.shape)
            for shot, normal in zip(start.shots, normals, strict=True)
        ]
        return point(start.values + step, starts)

    def report(better: _Point, gain: float) -> bool:
        search.values, search.starts = better.values, [shot.starts for shot in better.shots]
        search.costs.append(better.cost)
        work.progress("output error", better.values, better.cost)
        return gain < tolerance * max(1.0, 1e-3 * better.cost)

    found = damped_gauss_newton(point(search.values, search.starts), linearise, move, report, LONGEST_SEARCH)
    best, _, last = found
    return best.shots, last or linearise(best)


def _whole_normal(problem: Problem, values: Array, prior: Array, normals: list[Normal]) -> tuple[Array, Array]:
    """Normal equations (k, k), (k,) of all runs, the captive tests and the prior."""
    tank, pull, _ = _captive_normal(problem, values)
    H = np.asarray(sum(normal.matrix for normal in normals)) + tank + prior
    g = np.asarray(sum(normal.vector for normal in normals)) + pull + prior @ (values - problem.prior_mean)
    return H, g


def _captive_normal(problem: Problem, values: Array) -> tuple[Array, Array, float]:
    """Information (k, k), gradient (k,) and cost of the captive tests at `values`; 0 without any."""
    if problem.captive is None:
        return np.zeros((len(values), len(values))), np.zeros(len(values)), 0.0
    return problem.captive.normal(problem.parameters(values))


def _new_noise(
    problem: Problem, pieces: list[Pieces], shots: list[Shot], settings: OutputErrorSettings
) -> tuple[ColouredNoise, ...]:
    noise = []
    for place in range(len(problem.seen)):
        residuals = [residual for shot in shots for residual in shot.residuals[:, :, place]]
        measured = np.concatenate([piece.measured[:, :, place].ravel() for piece in pieces])
        smallest = 1e-6 * float(np.nanmax(np.abs(measured)) or 1.0)
        found = estimate_coloured_noise(residuals, smallest)
        noise.append(found if settings.coloured else white(found.deviation))
    return tuple(noise)


def _estimate(
    work: _Work, search: _Search, normals: list[Normal], notices: tuple[Notice, ...], motion: FittedMotion
) -> Estimate:
    problem = work.problem
    information = np.asarray(sum(normal.matrix for normal in normals))
    prior = scaled_prior(problem, search.scale)
    before = problem.prior_precision(prior) + _captive_normal(problem, search.values)[0]
    return Estimate(
        method="output_error",
        free=problem.free,
        values=search.values,
        covariance=sandwich(information, prior, list(map(work.shooting.scores, work.pieces, normals)), before),
        information=information,
        noise={name: noise.deviation for name, noise in zip(problem.seen, search.noise, strict=True)},
        cost=tuple(search.costs),
        prior_scale=search.scale,
        notices=notices,
        motion=motion,
    )
