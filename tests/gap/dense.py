"""The state space of the observer as one large Gaussian vector, stacked by brute force: no filter, no recursion."""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm
from scipy.stats import multivariate_normal

from tank2sim.gap.inference.kalman_filter import Linear, NoiseLevels
from tank2sim.gap.inference.wave_band import WaveBand


def van_loan(slope: np.ndarray, intensity: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
    """Transition and covariance over a time of dz = slope z dt + noise of an intensity, by one matrix exponential.

    Van Loan (1978), Computing integrals involving the matrix exponential, IEEE Trans. AC 23(3).
    """
    n = len(slope)
    whole = expm(np.block([[-slope, intensity], [np.zeros((n, n)), slope.T]]) * time)
    transition = whole[n:, n:].T
    return transition, transition @ whole[:n, n:]


def pushed(time_s: float, level: float, block_s: float) -> tuple[np.ndarray, np.ndarray]:
    """A speed and its acceleration of first order over a block: transition and covariance (2, 2)."""
    slope = np.array([[0.0, 1.0], [0.0, -1 / time_s]])
    return van_loan(slope, np.diag([0.0, 2 * level**2 / time_s]), block_s)


def rocked(waves: WaveBand, axis: int, block_s: float) -> tuple[np.ndarray, np.ndarray]:
    """A speed, its acceleration by waves and the quadrature over a block: transition and covariance (3, 3)."""
    fade, turn = -1 / waves.time, waves.frequency
    slope = np.array([[0.0, 1.0, 0.0], [0.0, fade, -turn], [0.0, turn, fade]])
    return van_loan(slope, 2 * waves.level[axis] ** 2 / waves.time * np.diag([0.0, 1.0, 1.0]), block_s)


class Dense:
    """One run: all states and all measurements as linear functions of independent standard normal numbers.

    z[0] = S n0; z[k+1] = F z[k] + B d[k] + Q n[k+1]; y[k] = H z[k] + white. States are 6 errors of the motion, 3
    accelerations, an error of each sensor, and in waves 3 pairs of an acceleration and its quadrature. What an
    acceleration does to its speed over a block is exact, and it does so evenly over the block: B, the mean of
    exp(A s), has it from there.
    """

    def __init__(self, what: Linear, noise: NoiseLevels, run: int, waves: WaveBand | None = None):
        _, blocks, ny, _ = what.reading.shape
        self.known = what.known[run].ravel()
        times, levels = np.r_[noise.force_s, noise.slow_s], np.r_[noise.force, noise.slow]
        fading = np.exp(-what.block_s / times)
        slow = 9 + ny
        rocks = [] if waves is None else [rocked(waves, axis, what.block_s) for axis in range(3)]
        nz = slow + 2 * len(rocks)
        pushes = [pushed(noise.force_s[axis], noise.force[axis], what.block_s) for axis in range(3)]
        by_start = np.array([transition[0, 1] for transition, _ in pushes])
        start = np.diag(np.r_[what.wide, levels, [] if waves is None else np.repeat(waves.level, 2)])
        row = np.zeros((nz, blocks * nz))
        driven = np.zeros((nz, (blocks - 1) * 6))
        of_noise, of_driving = [], []
        for k in range(blocks):
            if k:
                F = np.zeros((nz, nz))
                F[:6, :6] = what.transition[run, k - 1]
                F[:6, 6:9] = what.spreading[run, k - 1][:, :3] * by_start
                F[6:slow, 6:slow] = np.diag(fading)
                for axis, (transition, _) in enumerate(rocks):
                    pair = slice(slow + 2 * axis, slow + 2 * axis + 2)
                    F[:6, pair] = np.outer(what.spreading[run, k - 1][:, axis], transition[0, 1:])
                    F[pair, pair] = transition[1:, 1:]
                row, driven = F @ row, F @ driven
                driven[:6, (k - 1) * 6 : k * 6] += what.spreading[run, k - 1]
            row = row.copy()
            chance = (
                self._chance(what.spreading[run, k - 1], pushes, rocks, levels * np.sqrt(1 - fading**2)) if k else start
            )
            row[:, k * nz : (k + 1) * nz] += chance
            of_noise.append(row)
            of_driving.append(driven.copy())
        self.z_by_noise, self.z_by_driving = np.vstack(of_noise), np.vstack(of_driving)
        H = np.zeros((blocks * ny, blocks * nz))
        for k in range(blocks):
            H[k * ny : (k + 1) * ny, k * nz : k * nz + 6] = what.reading[run, k]
            H[k * ny : (k + 1) * ny, k * nz + 9 : k * nz + slow] = np.eye(ny)
        self.H = H[self.known]
        self.shape = blocks, nz
        white = np.sqrt(what.noise_shares[run]) * np.tile(noise.white, blocks)[self.known]
        seen = self.H @ self.z_by_noise
        self.covariance = seen @ seen.T + np.diag(white**2)
        self.of_driving = self.H @ self.z_by_driving

    @staticmethod
    def _chance(spreading, pushes, rocks, kicks) -> np.ndarray:
        """What a block adds by chance, by independent normal numbers: two of each acceleration, one of each sensor,
        three of each acceleration by waves."""
        root = np.diag(np.r_[np.zeros(9), kicks[3:], np.zeros(2 * len(rocks))])
        for axis, (_, covariance) in enumerate(pushes):
            (speed, both), (_, remaining) = np.linalg.cholesky(covariance).T
            root[:6, axis], root[6 + axis, axis] = spreading[:, axis] * speed, both
            root[6 + axis, 3 + axis] = remaining
        for axis, (_, covariance) in enumerate(rocks):
            first = 6 + len(kicks) + 2 * axis
            columns = [6 + axis, first, first + 1]
            rows = np.linalg.cholesky(covariance)
            root[:6, columns] = np.outer(spreading[:, axis], rows[0])
            root[first : first + 2, columns] = rows[1:]
        return root

    def error(self, driving, shown):
        """What was shown less what the driving leads to, over all that was measured."""
        return shown.ravel()[self.known] - self.of_driving @ driving.ravel()

    def cost(self, driving, shown) -> float:
        """-2 log of the density."""
        e = self.error(driving, shown)
        return -2 * float(multivariate_normal(np.zeros(len(e)), self.covariance).logpdf(e))

    def states(self, driving, shown):
        """Conditional mean of the states given the measurements."""
        seen = self.H @ self.z_by_noise
        weights = np.linalg.solve(self.covariance, self.error(driving, shown))
        return (self.z_by_driving @ driving.ravel() + self.z_by_noise @ seen.T @ weights).reshape(self.shape)
