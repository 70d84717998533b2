"""The loops of the filter over time, compiled: forward for covariances and for columns, backward for slopes.

Their equations are in :mod:`.kalman_filter`. They are loops over small, mostly sparse matrices, for which the
overhead of NumPy calls dominates; Numba compiles them once and caches the result on disk. States are ordered as in
:mod:`.kalman_filter`: 6 errors of the motion, 3 accelerations, ny sensor errors. A row of `known` that is False has
zeros for its row of the reading matrix H.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tank2sim.arrays import Array

_Truths = NDArray[np.bool_]

compiled = njit(cache=True, fastmath={"contract", "reassoc", "nsz"})
"""Products and sums in any order, which makes them twice as fast; nan propagates."""


@compiled
def _advance(moved: Array, z: Array, phi: Array, push: Array, fading: Array) -> None:
    """F z into `moved`, the whole transition F being (phi, push, 0; 0, fading)."""
    for i in range(6):
        moved[i] = 0.0
        for j in range(9):
            f = phi[i, j] if j < 6 else push[i, j - 6]
            for c in range(z.shape[1]):
                moved[i, c] += f * z[j, c]
    for i in range(6, len(z)):
        f = fading[i - 6]
        for c in range(z.shape[1]):
            moved[i, c] = f * z[i, c]


@compiled
def _inverse_root(S: Array) -> Array:
    """Inverse of the lower Cholesky factor of S; a matrix of nan if S is not positive definite."""
    n = S.shape[0]
    L, W = np.zeros((n, n)), np.zeros((n, n))
    for i in range(n):
        for j in range(i + 1):
            total = S[i, j]
            for c in range(j):
                total -= L[i, c] * L[j, c]
            if i > j:
                L[i, j] = total / L[j, j]
            elif total > 0:
                L[i, i] = np.sqrt(total)
            else:
                return np.full((n, n), np.nan)
    for i in range(n):
        W[i, i] = 1.0 / L[i, i]
        for j in range(i):
            total = 0.0
            for c in range(j, i):
                total -= L[i, c] * W[c, j]
            W[i, j] = total / L[i, i]
    return W


@compiled
def _read(P: Array, reading: Array, known: _Truths) -> Array:
    """P H' (nz, ny)."""
    nz, ny = P.shape[0], reading.shape[0]
    PH = np.zeros((nz, ny))
    for a in range(nz):
        for i in range(ny):
            if known[i]:
                total = P[a, 9 + i]
                for j in range(6):
                    total += P[a, j] * reading[i, j]
                PH[a, i] = total
    return PH


@compiled
def covariances(
    start: Array, transition: Array, push: Array, fading: Array, added: Array, seeing: tuple[Array, _Truths, Array]
) -> tuple[Array, Array, Array]:
    """Gains, inverse roots of the innovations' covariances, and covariances after each measurement.

    Parameters
    ----------
    start : array (nz,)
        Variances at the beginning.
    transition : array (R, T - 1, 6, 6)
    push : array (R, T - 1, 6, 3)
        Errors of the motion by accelerations a step before.
    fading : array (nz - 6,)
        Share of accelerations and sensor errors that remains a step later.
    added : array (R, T - 1, nz, nz)
        Covariance of the process noise.
    seeing : arrays (R, T, ny, 6), (R, T, ny), (ny,)
        Readings by states, mask of the measurements, variances of their white noise.
    """
    reading, known, white_noise = seeing
    runs, blocks, ny, _ = reading.shape
    nz = 9 + ny
    gain, white = np.empty((runs, blocks, nz, ny)), np.empty((runs, blocks, ny, ny))
    filtered, FP = np.empty((runs, blocks, nz, nz)), np.empty((nz, nz))
    for run in range(runs):
        P = np.diag(start)
        for k in range(blocks):
            H, seen = reading[run, k], known[run, k]
            PH = _read(P, H, seen)
            S = np.eye(ny)
            for i in range(ny):
                if seen[i]:
                    for j in range(ny):
                        S[i, j] = PH[9 + i, j]
                        for a in range(6):
                            S[i, j] += H[i, a] * PH[a, j]
                    S[i, i] += white_noise[i]
            W = _inverse_root(S)
            G = PH @ W.T
            P = P - G @ G.T
            gain[run, k], white[run, k], filtered[run, k] = G @ W, W, P
            if k + 1 < blocks:
                _advance(FP, P, transition[run, k], push[run, k], fading)
                _advance(P, FP.T.copy(), transition[run, k], push[run, k], fading)
                P += added[run, k]
                P = 0.5 * (P + P.T)
    return gain, white, filtered


@compiled
def _surprise(e: Array, shown: Array, z: Array, reading: Array, known: _Truths) -> None:
    """e = shown - H z, 0 where nothing was measured."""
    for i in range(len(known)):
        e[i] = 0.0
        if known[i]:
            for c in range(e.shape[1]):
                e[i, c] = shown[i, c] - z[9 + i, c]
            for j in range(6):
                h = reading[i, j]
                for c in range(e.shape[1]):
                    e[i, c] -= h * z[j, c]


@compiled
def _corrected(z: Array, whitened: Array, e: Array, gain: Array, white: Array) -> None:
    """z + gain e in its place, and white e."""
    for i in range(len(e)):
        for a in range(len(z)):
            g = gain[a, i]
            for c in range(e.shape[1]):
                z[a, c] += g * e[i, c]
        for j in range(i + 1):
            w = white[i, j]
            for c in range(e.shape[1]):
                whitened[i, c] += w * e[j, c]


@compiled
def _drive(moved: Array, spreading: Array, driving: Array) -> None:
    """Add the driving of the six errors of the motion to `moved`."""
    for i in range(6):
        for j in range(6):
            s = spreading[i, j]
            for c in range(driving.shape[1]):
                moved[i, c] += s * driving[j, c]


@compiled
def run_filter(
    seeing: tuple[Array, _Truths],
    moving: tuple[Array, Array, Array, Array],
    filtering: tuple[Array, Array],
    columns: tuple[Array, Array],
    keep: bool,
) -> tuple[Array, Array]:
    """Innovations in units of their standard deviation (R, T, ny, C), and states after each measurement.

    Parameters
    ----------
    seeing : arrays (R, T, ny, 6), (R, T, ny)
    moving : arrays (R, T - 1, 6, 6), (R, T - 1, 6, 6), (R, T - 1, 6, 3), (nz - 6,)
        Transition, spreading, push and fading.
    filtering : arrays (R, T, nz, ny), (R, T, ny, ny)
        Gains and inverse roots.
    columns : arrays (R, T - 1, 6, C), (R, T, ny, C)
        Driving and shown.
    keep : bool
        Whether the states are wanted, (R, T, nz, C); else they are (R, 1, nz, C), and have no meaning.
    """
    reading, known = seeing
    transition, spreading, push, fading = moving
    gain, white = filtering
    driving, shown = columns
    runs, blocks, ny, count = shown.shape
    nz = 9 + ny
    whitened = np.zeros((runs, blocks, ny, count))
    after = np.zeros((runs, blocks if keep else 1, nz, count))
    e, z, moved = np.zeros((ny, count)), np.zeros((nz, count)), np.zeros((nz, count))
    for run in range(runs):
        z[:] = 0.0
        for k in range(blocks):
            _surprise(e, shown[run, k], z, reading[run, k], known[run, k])
            _corrected(z, whitened[run, k], e, gain[run, k], white[run, k])
            if keep:
                after[run, k] = z
            if k + 1 < blocks:
                _advance(moved, z, transition[run, k], push[run, k], fading)
                _drive(moved, spreading[run, k], driving[run, k])
                z, moved = moved, z
    return whitened, after


@compiled
def _carried_back(r: Array, phi: Array, push: Array, fading: Array) -> Array:
    """F' r."""
    nz, count = r.shape
    later = np.zeros((nz, count))
    for i in range(6):
        for j in range(6):
            for c in range(count):
                later[j, c] += phi[i, j] * r[i, c]
        for f in range(3):
            for c in range(count):
                later[6 + f, c] += push[i, f] * r[i, c]
    for i in range(6, nz):
        for c in range(count):
            later[i, c] += fading[i - 6] * r[i, c]
    return later


@compiled
def _with_measurement(later: Array, u: Array, reading: Array, known: _Truths) -> Array:
    """later + H' u."""
    r = later.copy()
    for i in range(len(known)):
        if known[i]:
            r[9 + i] += u[i]
            for j in range(6):
                r[j] += reading[i, j] * u[i]
    return r


@compiled
def smooth_backward(
    seeing: tuple[Array, _Truths],
    moving: tuple[Array, Array, Array, Array],
    filtering: tuple[Array, Array, Array],
    whitened: Array,
    after: Array,
) -> Array:
    """States given all measurements (R, T, nz, C); arguments as of :func:`run_filter`, and the covariances after each
    measurement. r carries the information of later measurements about a state."""
    reading, known = seeing
    transition, _, push, fading = moving
    gain, white, filtered = filtering
    states = np.empty(after.shape)
    for run in range(after.shape[0]):
        r = np.zeros(after.shape[2:])
        for k in range(after.shape[1] - 1, -1, -1):
            if k + 1 < after.shape[1]:
                r = _carried_back(r, transition[run, k], push[run, k], fading)
            states[run, k] = after[run, k] + filtered[run, k] @ r
            u = white[run, k].T @ whitened[run, k] - gain[run, k].T @ r
            r = _with_measurement(r, u, reading[run, k], known[run, k])
    return states


@compiled
def _seen_from_before(N: Array, K: Array, W: Array, reading: Array, known: _Truths) -> tuple[Array, Array]:
    """(I - K H)' N (I - K H) + H' W'W H, and the diagonal of W'W + K' N K.

    Not multiplied out: the terms would cancel where a sensor is good, and with them the last digits of the slopes.
    """
    nz, ny = K.shape
    H = np.zeros((ny, nz))
    for i in range(ny):
        if known[i]:
            H[i, :6] = reading[i]
            H[i, 9 + i] = 1.0
    correction, WH = np.eye(nz) - K @ H, W @ H
    D = K.T @ (N @ K) + W.T @ W
    return correction.T @ (N @ correction) + WH.T @ WH, np.diag(D)


@compiled
def _between(
    back: tuple[Array, Array, Array, Array],
    BT: Array,
    P: Array,
    smooth: Array,
    sums: tuple[Array, Array, Array, Array, Array],
) -> None:
    """Add the contribution of one step to the sums; r, N, N F are of the later block, P of the earlier."""
    r, N, NF, _ = back
    variance, fading, way, both, gain = sums
    pushing, BN, BNF = BT @ r[:6], BT @ N[:6], BT @ NF[:6]
    for i in range(len(variance)):
        variance[i] += N[6 + i, 6 + i] - np.sum(r[6 + i] ** 2)
        fading[i] += -2 * (np.sum(r[6 + i] * smooth[i]) - np.sum(NF[6 + i] * P[:, 6 + i]))
    for f in range(3):
        way[f] += np.sum(BN[f, :6] * BT[f]) - np.sum(pushing[f] ** 2)
        both[f] += 2 * (BN[f, 6 + f] - np.sum(pushing[f] * r[6 + f]))
        gain[f] += -2 * (np.sum(pushing[f] * smooth[f]) - np.sum(BNF[f] * P[:, 6 + f]))


@compiled
def backward(
    seeing: tuple[Array, _Truths],
    moving: tuple[Array, Array, Array, Array],
    filtering: tuple[Array, Array, Array],
    whitened: Array,
    after: Array,
) -> tuple[Array, Array, Array, Array, Array, Array, Array]:
    """Slopes of the cost in the parameters of the noise; arguments as of :func:`smooth_backward`.

    Returns
    -------
    variance, start, fading : arrays (nz - 6,)
        By the variance of each slow process's driving noise, by that of its beginning, by its fading.
    way, both, gain : arrays (3,)
        By the variances and the gain of a force over a block.
    white : array (ny,)
        By the variance of each sensor's white noise.
    """
    reading, known = seeing
    transition, spreading, push, fading = moving
    gain, white, filtered = filtering
    runs, blocks, nz, count = after.shape
    ny = nz - 9
    variance, start, by_fading = np.zeros(nz - 6), np.zeros(nz - 6), np.zeros(nz - 6)
    way, both, by_gain, by_white = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(ny)
    for run in range(runs):
        r, N = np.zeros((nz, count)), np.zeros((nz, nz))
        for k in range(blocks - 1, -1, -1):
            later = r
            if k + 1 < blocks:
                phi, pushed = transition[run, k], push[run, k]
                P = filtered[run, k]
                NF = _carried_back(N, phi, pushed, fading).T.copy()  # N is symmetric
                later = _carried_back(r, phi, pushed, fading)
                smooth = after[run, k, 6:] + P[6:] @ later
                BT = np.ascontiguousarray(spreading[run, k, :, :3].T)
                _between((r, N, NF, later), BT, P, smooth, (variance, by_fading, way, both, by_gain))
                N = _carried_back(NF, phi, pushed, fading)
            K, W, seen = gain[run, k], white[run, k], known[run, k]
            u = W.T @ whitened[run, k] - K.T @ later
            N, D = _seen_from_before(N, K, W, reading[run, k], seen)
            for i in range(ny):
                if seen[i]:
                    by_white[i] += D[i] - np.sum(u[i] ** 2)
            r = _with_measurement(later, u, reading[run, k], seen)
        for i in range(nz - 6):
            start[i] += N[6 + i, 6 + i] - np.sum(r[6 + i] ** 2)
    return variance, start, by_fading, way, both, by_gain, by_white
