"""Output error by multiple shooting: the model's own motion is held against the measured one, piece by piece.

Gauss-Newton with Levenberg's damping on exact derivatives; noise of each signal is white plus first-order
autoregressive and estimated from the residuals (:mod:`.noise`); initial states are estimated with the parameters. The
width of the prior can be scaled by the evidence (MacKay 1992, Neural Computation 4).
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np

from tank2sim.arrays import Array
from tank2sim.identification.trials.methods.coloured_noise import ColouredNoise, estimate_coloured_noise, white
from tank2sim.identification.trials.methods.posterior import evidence_scale, sandwich, scaled_prior
from tank2sim.identification.trials.methods.shooting import Normal, Pieces, Shooting, cut
from tank2sim.identification.trials.problem.estimation_problem import Estimate, Problem, SearchReport, silent

LONGEST_SEARCH = 25
"""Steps after which a search ends; it needs 3 to 10."""

INTERRUPTED = "interrupted: the estimates are the best found until then"


@dataclass(frozen=True)
class OutputErrorSettings:
    """How output error is done.

    Parameters
    ----------
    piece_s : float or None
        Length of a piece, s; None takes whole runs (never for a course-unstable ship: its motion runs away).
    coloured : bool
        Noise with its autoregressive part; else white.
    scale_prior : bool
        The prior's standard errors are multiplied by the factor of largest evidence, at least 1.
    rounds : int
        Times that noise (and prior) are estimated again.
    """

    piece_s: float | None = None
    coloured: bool = True
    scale_prior: bool = True
    rounds: int = 4


@dataclass
class _Search:
    """Where the search stands."""

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

    Parameters
    ----------
    problem : Problem
        k free parameters.
    start : array (k,), optional
        Where the search begins; by default the prior's mean.
    settings : OutputErrorSettings, optional
    progress : callable
        Called with each better estimate; what it raises passes through.
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
                normals = _minimise(work, search, tolerance=1e-4 if last else 1e-2)
                if not last:
                    search.noise = _new_noise(problem, pieces, normals, settings)
                    if settings.scale_prior:
                        information = np.asarray(sum(normal.matrix for normal in normals))
                        search.scale = evidence_scale(problem, information, search.values, search.scale)
        except KeyboardInterrupt:
            notices.append(INTERRUPTED)
            normals = work.normals(search)
    return _estimate(problem, search, normals, tuple(notices))


def _first_noise(problem: Problem, pieces: list[Pieces]) -> tuple[ColouredNoise, ...]:
    """A tenth of the spread of each signal: nothing is known of the residuals yet."""
    every = np.concatenate([piece.run.measured for piece in pieces])
    spread = np.nanstd(every, axis=0)
    return tuple(white(0.1 * float(one) if one > 0 else 1.0) for one in spread)


@dataclass(frozen=True, eq=False)
class _Work:
    """What does not change during a search. Runs are independent, and machine code lets threads run side by side."""

    problem: Problem
    shooting: Shooting
    pieces: list[Pieces]
    threads: ThreadPoolExecutor
    progress: SearchReport

    def normals(self, search: _Search) -> list[Normal]:
        """Normal equations of all runs where the search stands."""
        return list(
            self.threads.map(
                lambda piece, start: self.shooting.normal(piece, start, search.values, search.noise),
                self.pieces,
                search.starts,
            )
        )

    def cost(self, search: _Search, values: Array, starts: list[Array], prior: Array) -> float:
        """Sum of squares of all runs and of the prior at other values and initial states."""
        own = float(np.sum(((values - self.problem.prior_mean) / prior) ** 2))
        runs = self.threads.map(
            lambda piece, start: self.shooting.cost(piece, start, values, search.noise), self.pieces, starts
        )
        return own + sum(runs)


def _minimise(work: _Work, search: _Search, tolerance: float) -> list[Normal]:
    """Damped Gauss-Newton steps from where the search stands; leaves it at the best point."""
    problem, damping = work.problem, 0.0
    prior = scaled_prior(problem, search.scale)
    best = work.cost(search, search.values, search.starts, prior)
    for _ in range(LONGEST_SEARCH):
        normals = work.normals(search)
        H = sum(normal.matrix for normal in normals) + np.diag(1 / prior**2)
        g = sum(normal.vector for normal in normals) + (search.values - problem.prior_mean) / prior**2
        for _ in range(12):
            step = -np.linalg.solve(H + damping * np.diag(np.diag(H)), g)
            step = np.clip(search.values + step, *problem.bounds) - search.values
            starts = [
                start - (normal.step + normal.states @ step).reshape(start.shape)
                for start, normal in zip(search.starts, normals, strict=True)
            ]
            cost = work.cost(search, search.values + step, starts, prior)
            if cost < best:
                break
            damping = max(10 * damping, 1e-3)
        else:
            return normals
        gain, best = best - cost, cost
        search.values, search.starts = search.values + step, starts
        search.costs.append(cost)
        damping = damping / 10 if damping > 1e-6 else 0.0
        work.progress("output error", search.values, cost)
        if gain < tolerance * max(1.0, 1e-3 * best):
            break
    return work.normals(search)


def _new_noise(
    problem: Problem, pieces: list[Pieces], normals: list[Normal], settings: OutputErrorSettings
) -> tuple[ColouredNoise, ...]:
    noise = []
    for place in range(len(problem.seen)):
        residuals = [one for normal in normals for one in normal.residuals[:, :, place]]
        measured = np.concatenate([piece.measured[:, :, place].ravel() for piece in pieces])
        smallest = 1e-6 * float(np.nanmax(np.abs(measured)) or 1.0)
        found = estimate_coloured_noise(residuals, smallest)
        noise.append(found if settings.coloured else white(found.deviation))
    return tuple(noise)


def _estimate(problem: Problem, search: _Search, normals: list[Normal], notices: tuple[str, ...]) -> Estimate:
    information = np.asarray(sum(normal.matrix for normal in normals))
    prior = scaled_prior(problem, search.scale)
    return Estimate(
        method="output_error",
        free=problem.free,
        values=search.values,
        covariance=sandwich(information, prior, [normal.scores for normal in normals]),
        information=information,
        noise={name: one.deviation for name, one in zip(problem.seen, search.noise, strict=True)},
        cost=tuple(search.costs),
        prior_scale=search.scale,
        notices=notices,
    )
