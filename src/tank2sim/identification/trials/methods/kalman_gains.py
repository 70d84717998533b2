"""The Kalman filter's gains along a linearised trajectory, the derivatives of its innovations, and the smoother.

Runs of a batch are padded to the same length, and left at their ends; an instant without a measurement has a row of
zeros in C, a residual of 0 and a variance of 1, and adds nothing to the likelihood. All functions work on stacks of
small matrices with any leading axes, of which the last is the run.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tank2sim.arrays import Array
from tank2sim.identification.trials.methods.process_noise import Tangents


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
    where the model is far off.).
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
