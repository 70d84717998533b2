"""A Kalman filter about the measured motion: likelihood of the measurements, whatever effect is missing.

The error of the measured motion, the slow unmodelled forces (process noise) and the slow errors of the
sensors are the states; the filter is linear, so that the contribution of an effect passes through it as a separate
column, and every explanation with the same noise is one small least-squares problem.

    state      z = (dx of 6 states, 3 accelerations, ny sensor errors)
    dx[k+1]    = Phi dx[k] + Gamma (g a[k] + w[k] + d[k]),   d = the model's rates less the measured change
    a, e       first-order Gauss-Markov processes (white noise through a lag)
    z_w        in waves: 3 accelerations in a narrow band and their quadratures (:mod:`.wave_band`), added to a
    y - h(x)   = H dx + e + white noise

Durbin and Koopman (2012), Time Series Analysis by State Space Methods, 2nd ed., chapters 4 and 7: likelihood by
innovations, its slope in the parameters of the noise by the backward (disturbance) smoother.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tank2sim.arrays import Array
from tank2sim.gap.inference import kalman_kernels
from tank2sim.gap.inference.wave_band import WaveBand

_Truths = NDArray[np.bool_]

DOUBLINGS = 3
"""Doublings of an eighth of a block, over which even a hull in very shallow water moves little."""

FORCE_STATES = 3
"""Accelerations of surge, sway and yaw."""


@dataclass(frozen=True, eq=False)
class NoiseLevels:
    """Levels and times of the noise."""

    # `white`, `slow`, `slow_s` (ny,), for each sensor: Standard deviation of a block's mean by white noise, standard
    # deviation of the slow error, and its time constant.
    white: Array
    slow: Array
    slow_s: Array
    # `force`, `force_s` (3,): Standard deviation (m/s2, m/s2, rad/s2) and time constant of the unmodelled
    # accelerations.
    force: Array
    force_s: Array

    @property
    def logs(self) -> Array:
        """Logarithms of all in one vector (3 ny + 6,)."""
        logs: Array = np.log(np.concatenate([self.white, self.slow, self.slow_s, self.force, self.force_s]))
        return logs

    @staticmethod
    def of(logs: Array) -> NoiseLevels:
        """From :attr:`logs`."""
        ny = (len(logs) - 2 * FORCE_STATES) // 3
        values = np.exp(logs)
        white, slow, slow_s = (values[part * ny : (part + 1) * ny] for part in range(3))
        return NoiseLevels(white, slow, slow_s, values[3 * ny : 3 * ny + FORCE_STATES], values[3 * ny + FORCE_STATES :])


@dataclass(frozen=True, eq=False)
class Linear:
    """The motion about which the filter is linear."""

    transition: Array  # (R, T - 1, 6, 6): From the middle of each block to the middle of the next
    # (R, T - 1, 6, 6): Change of the states at the end of that time by rates added during it, relative to a motion
    # with zero slopes.
    spreading: Array
    reading: Array  # (R, T, ny, 6): Readings by states
    known: _Truths  # (R, T, ny): Where something was measured
    block_s: float  # Length of a block, s
    wide: Array  # (6,): Standard deviation of the error of the smoothed motion at the beginning: generous
    noise_shares: Array  # (R,): Variance of the white noise of each run over the variance in :class:`NoiseLevels`

    @property
    def arrays(self) -> kalman_kernels.MotionArrays:
        """For the loops over time."""
        return self.transition, self.spreading, self.reading, self.known


def linear_filter(
    by_state: Array, reading: Array, known: _Truths, block_s: float, wide: Array, noise_shares: Array
) -> Linear:
    """From the rates by states (R, T - 1, 6, 6): exp(A h), and its mean over the time to the end of the block.

    By Taylor's series over h/8 and three doublings (scaling and squaring: Moler and Van Loan 2003, SIAM Review 45).
    """
    A = by_state * block_s / 2**DOUBLINGS
    eye = np.eye(6)
    with np.errstate(over="ignore", invalid="ignore"):  # forces without bounds are refused by the likelihood
        square = A @ A
        transition = eye + A + square / 2 + square @ A / 6
        spreading = eye + A / 2 + square / 6
        for _ in range(DOUBLINGS):
            spreading = 0.5 * (spreading + transition @ spreading)
            transition = transition @ transition
    return Linear(
        np.ascontiguousarray(transition),
        np.ascontiguousarray(spreading),
        np.ascontiguousarray(reading),
        np.ascontiguousarray(known),
        block_s,
        wide,
        noise_shares,
    )


@dataclass(frozen=True, eq=False)
class Observer:
    """The filter for one noise: gains, and the covariances of the backward pass."""

    linear: Linear
    noise: NoiseLevels
    # What accelerations and sensor errors do over a block (:data:`.kalman_kernels.ProcessArrays`).
    process: kalman_kernels.ProcessArrays
    gain: Array  # (R, T, nz, ny): Gains of the filter
    white: Array  # (R, T, ny, ny): Inverse of the lower Cholesky factor of the innovations' covariance
    filtered: Array  # (R, T, nz, nz): Covariance after each measurement
    log_det: float  # Sum of log det of the innovations' covariance, over the measurements

    def whiten(self, driving: Array, shown: Array) -> Array:
        """Innovations in units of their standard deviation, of several columns at once.

        Parameters
        ----------
        driving : array (R, T - 1, 6, C)
            Change of the states from block to block by the rates.
        shown : array (R, T, ny, S)
            Readings of the sensors of the first S columns, zero in the others; nan where nothing was measured.

        Returns
        -------
        array (R, T, ny, C)
            0 where nothing was measured.
        """
        return kalman_kernels.whiten(*self._loops, driving, shown)

    def smooth(self, driving: Array, shown: Array) -> Array:
        """States given all measurements (R, T, nz), of one column; arguments as in :meth:`whiten` without C."""
        return kalman_kernels.smooth(*self._loops, driving[..., None], shown[..., None])

    @property
    def _loops(self) -> tuple[kalman_kernels.MotionArrays, kalman_kernels.ProcessArrays, kalman_kernels.FilterArrays]:
        return self.linear.arrays, self.process, (self.gain, self.white, self.filtered)


@dataclass(frozen=True, eq=False)
class _Pushed:
    """An acceleration of first order over a block (3,): the change of speed that its value at the beginning makes
    (`gain`), and the variances of the random part: of that change, of it with the acceleration at the end
    (`both`), and the slopes of all three in the logarithm of the time constant. Singer (1970), IEEE Trans. AES 6(4)."""

    gain: Array
    way: Array
    both: Array
    gain_slope: Array
    way_slope: Array
    both_slope: Array


def _pushed(noise: NoiseLevels, block_s: float) -> _Pushed:
    time, level = noise.force_s, noise.force
    x = block_s / time
    f = np.exp(-x)
    gain = time * (1 - f)
    way = (level * time) ** 2 * (2 * x - 3 + 4 * f - f**2)
    both = level**2 * time * (1 - f) ** 2
    return _Pushed(
        gain,
        way,
        both,
        gain - time * f * x,
        2 * way + (level * time) ** 2 * (-2 * x + 4 * f * x - 2 * f**2 * x),
        both - 2 * level**2 * time * (1 - f) * f * x,
    )


def observer(linear: Linear, noise: NoiseLevels, waves: WaveBand | None = None) -> Observer:
    """The filter of a noise, and of forces of waves if any: the covariance recursion, once for all columns."""
    fading = np.exp(-linear.block_s / np.concatenate([noise.force_s, noise.slow_s]))
    levels = np.concatenate([noise.force, noise.slow])
    start = np.concatenate([linear.wide**2, levels**2])
    pushed = _pushed(noise, linear.block_s)
    process = fading, pushed.gain, pushed.way, pushed.both, levels**2 * (1 - fading**2)
    if waves is not None:
        block = waves.over(linear.block_s)
        pairs = np.tile([block.gain.real, -block.gain.imag], FORCE_STATES)
        with_band = np.stack([block.with_value, block.with_quadrature], axis=-1).ravel()
        start = np.concatenate([start, np.repeat(waves.level**2, 2)])
        process = (
            np.concatenate([fading, [block.fading.real, block.fading.imag]]),
            np.concatenate([pushed.gain, pairs]),
            pushed.way + block.way,
            np.concatenate([pushed.both, with_band]),
            np.concatenate([process[-1], np.repeat(block.end, 2)]),
        )
    white_noise = noise.white**2 * linear.noise_shares[:, None]
    gain, white, filtered = kalman_kernels.covariances(linear.arrays, process, start, white_noise)
    # rows without a measurement have S = 1 on their diagonal and count nothing
    log_det = float(-2 * np.sum(np.log(np.diagonal(white, axis1=-2, axis2=-1))))
    return Observer(linear, noise, process, gain, white, filtered, log_det)


def slopes(seen: Observer, driving: Array, shown: Array) -> Array:
    """Slope of ``sum(log det S) + |whitened|^2`` in the logarithms of the noise (:attr:`NoiseLevels.logs`).

    The columns (:meth:`Observer.whiten`) are the residual and the uncertain coefficients, each times the root of its
    covariance.

    d(log det V + e'V^-1 e) = tr(V^-1 dV) - e'V^-1 dV V^-1 e, which the backward recursion gives for every noise at
    once: r carries V^-1 e back to the states, N its covariance under the model (Durbin and Koopman, 7.3.3).
    """
    noise, block_s = seen.noise, seen.linear.block_s
    variance, start, fading_slope, way, both, gain, white = kalman_kernels.slope_sums(*seen._loops, driving, shown)
    levels = np.concatenate([noise.force, noise.slow])
    times = np.concatenate([noise.force_s, noise.slow_s])
    fading = seen.process[0][: len(levels)]
    by_level = 2 * levels**2 * ((1 - fading**2) * variance + start)
    # d fading/d log time = fading h/time; the driving variance is level^2 (1 - fading^2)
    by_time = (fading_slope - 2 * fading * levels**2 * variance) * fading * block_s / times
    pushed = _pushed(noise, block_s)
    by_level[:FORCE_STATES] += 2 * (way * pushed.way + both * pushed.both)
    by_time[:FORCE_STATES] += way * pushed.way_slope + both * pushed.both_slope + gain * pushed.gain_slope
    by_white = 2 * noise.white**2 * (seen.linear.noise_shares @ white)
    return np.concatenate(
        [by_white, by_level[FORCE_STATES:], by_time[FORCE_STATES:], by_level[:FORCE_STATES], by_time[:FORCE_STATES]]
    )
