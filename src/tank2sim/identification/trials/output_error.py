"""Output error by multiple shooting: the model's own motion is held against the measured one, piece by piece.

Gauss-Newton with Levenberg's damping on exact derivatives; noise of each signal is white plus first-order
autoregressive and estimated from the residuals (:mod:`.noise`); initial states are estimated with the parameters. The
width of the prior can be scaled by the evidence (MacKay 1992, Neural Computation 4).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from tank2sim.dynamics.model import Vector
from tank2sim.identification.trials.noise import Noise, estimated_noise, white
from tank2sim.identification.trials.problem import Estimate, Problem, Progress, silent
from tank2sim.identification.trials.shooting import Normal, Pieces, Shooting, Weights, cut

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Settings:
    """How output error is done.

    Parameters
    ----------
    piece_s : float or None
        Length of a piece, s; None takes whole runs (never for a course-unstable ship: its motion runs away).
    coloured : bool
        Noise with its autoregressive part; else white.
    joints : bool
        The end of a piece is tied to the beginning of the next, as firmly as the defects show.
    scale_prior : bool
        The prior's standard errors are multiplied by the factor of largest evidence, at least 1.
    rounds : int
        Times that noise (and prior) are estimated anew.
    """

    piece_s: float | None = None
    coloured: bool = True
    joints: bool = False
    scale_prior: bool = True
    rounds: int = 4


@dataclass
class _Search:
    """Where the search stands."""

    values: Vector
    starts: list[Array]
    weights: Weights
    scale: float = 1.0
    costs: list[float] = field(default_factory=list)


def output_error(
    problem: Problem, start: Vector | None = None, settings: Settings | None = None, progress: Progress = silent
) -> Estimate:
    """Estimate the free parameters by output error.

    Parameters
    ----------
    problem : Problem
        k free parameters.
    start : array (k,), optional
        Where the search begins; by default the prior's mean.
    settings : Settings, optional
    progress : callable
        Told of each better estimate; what it raises passes through.
    """
    settings = settings or Settings()
    shooting = Shooting(problem)
    pieces = [cut(problem, run, settings.piece_s) for run in problem.runs]
    values = problem.prior_mean if start is None else start
    search = _Search(values.copy(), [piece.starts.copy() for piece in pieces], _first_weights(problem, pieces))
    for number in range(settings.rounds):
        import os

        if os.environ.get("T"):
            print(
                [(round(n.sigma, 5), round(n.phi, 3), round(n.psi, 3)) for n in search.weights.noise],
                search.costs[-1:],
                search.scale,
            )
        last = number == settings.rounds - 1
        normals = _minimise(problem, shooting, pieces, search, progress, tolerance=1e-4 if last else 1e-2)
        if last:
            break
        search.weights = _new_weights(problem, pieces, search, normals, settings)
        if settings.scale_prior:
            search.scale = _evidence_scale(problem, search, normals)
    return _estimate(problem, pieces, search, normals)


def _first_weights(problem: Problem, pieces: list[Pieces]) -> Weights:
    """A tenth of the spread of each signal: nothing is known of the residuals yet."""
    every = np.concatenate([piece.run.measured for piece in pieces])
    spread = np.nanstd(every, axis=0)
    return Weights(tuple(white(0.1 * float(one) if one > 0 else 1.0) for one in spread))


def _minimise(
    problem: Problem, shooting: Shooting, pieces: list[Pieces], search: _Search, progress: Progress, tolerance: float
) -> list[Normal]:
    """Damped Gauss-Newton steps from where the search stands; leaves it at the best point."""
    damping = 0.0
    prior = search.scale * problem.prior_error

    def cost_at(values: Vector, starts: list[Array]) -> float:
        runs = zip(pieces, starts, strict=True)
        own = float(np.sum(((values - problem.prior_mean) / prior) ** 2))
        return own + sum(shooting.cost(piece, start, values, search.weights) for piece, start in runs)

    best = cost_at(search.values, search.starts)
    for _ in range(25):
        runs = zip(pieces, search.starts, strict=True)
        normals = [shooting.normal(piece, start, search.values, search.weights) for piece, start in runs]
        H = sum(normal.matrix for normal in normals) + np.diag(1 / prior**2)
        g = sum(normal.vector for normal in normals) + (search.values - problem.prior_mean) / prior**2
        for _ in range(12):
            step = -np.linalg.solve(H + damping * np.diag(np.diag(H)), g)
            starts = [
                start - (normal.step + normal.states @ step).reshape(start.shape)
                for start, normal in zip(search.starts, normals, strict=True)
            ]
            cost = cost_at(search.values + step, starts)
            if cost < best:
                break
            damping = max(10 * damping, 1e-3)
        else:
            return normals
        gain = best - cost
        search.values, search.starts, best = search.values + step, starts, cost
        search.costs.append(cost)
        damping = damping / 10 if damping > 1e-6 else 0.0
        progress("output error", search.values, cost)
        if gain < tolerance * max(1.0, 1e-3 * best):
            break
    runs = zip(pieces, search.starts, strict=True)
    return [shooting.normal(piece, start, search.values, search.weights) for piece, start in runs]


def _new_weights(
    problem: Problem, pieces: list[Pieces], search: _Search, normals: list[Normal], settings: Settings
) -> Weights:
    noise = []
    for place in range(len(problem.seen)):
        residuals = [one for normal in normals for one in normal.residuals[:, :, place]]
        measured = np.concatenate([piece.measured[:, :, place].ravel() for piece in pieces])
        smallest = 1e-6 * float(np.nanmax(np.abs(measured)) or 1.0)
        found = estimated_noise(residuals, smallest)
        noise.append(found if settings.coloured else white(found.deviation))
    joints = None
    if settings.joints:
        defects = [
            normal.ends[:-1] - start[1:] for normal, start in zip(normals, search.starts, strict=True) if len(start) > 1
        ]
        if defects:
            nominal = np.array([state.nominal for state in problem.model.states])
            joints = np.maximum(np.sqrt(np.mean(np.concatenate(defects) ** 2, axis=0)), 1e-7 * nominal)
    return Weights(tuple(noise), joints)


def _evidence_scale(problem: Problem, search: _Search, normals: list[Normal]) -> float:
    """Factor on the prior's errors: distance from the mean over the number of parameters that the trials determine."""
    prior = search.scale * problem.prior_error
    H = sum(normal.matrix for normal in normals) + np.diag(1 / prior**2)
    determined = len(prior) - float(np.trace(np.linalg.inv(H) / prior**2))
    away = float(np.sum(((search.values - problem.prior_mean) / problem.prior_error) ** 2))
    return max(1.0, float(np.sqrt(away / max(determined, 1.0))))


def _estimate(problem: Problem, pieces: list[Pieces], search: _Search, normals: list[Normal]) -> Estimate:
    prior = np.diag(1 / (search.scale * problem.prior_error) ** 2)
    information = np.asarray(sum(normal.matrix for normal in normals))
    bread = np.linalg.inv(information + prior)
    covariance = bread @ (_meat(information, [normal.scores for normal in normals]) + prior) @ bread
    noise: list[Noise] = list(search.weights.noise)
    return Estimate(
        method="output_error",
        free=problem.free,
        values=search.values,
        covariance=covariance,
        information=information,
        noise={name: one.deviation for name, one in zip(problem.seen, noise, strict=True)},
        cost=tuple(search.costs),
        prior_scale=search.scale,
    )


def _meat(information: Array, scores: list[Array]) -> Array:
    """Covariance of the gradient (k, k) from blocks of time and their neighbours (Newey and West 1987, one lag).

    Model error makes residuals hang together far longer than the noise model says; white-noise theory would make the
    intervals several times too narrow. In no direction is it less than that theory's `information`.
    """
    total = np.zeros_like(information)
    for score in scores:
        lagged = score[1:].T @ score[:-1]
        total += score.T @ score + 0.5 * (lagged + lagged.T)
    count = sum(len(score) for score in scores)
    total *= count / max(count - 1, 1)
    values, vectors = eigh(total, information + 1e-12 * np.diag(np.diag(information)) + 1e-300 * np.eye(len(total)))
    root = information @ vectors
    meat: Array = (root * np.maximum(values, 1.0)) @ root.T
    return meat
