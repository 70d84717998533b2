"""Comparison of a signal with the rate of another without differentiating noise: the weak form, and its regression."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from tank2sim.arrays import Array
from tank2sim.records.trials import Trial, sampling_step, usual_step

Complex = NDArray[np.complex128]
AuditNumber = TypeVar("AuditNumber", np.float64, np.complex128)

FALSE_ALARM = 1e-5
"""Probability with which a comparison of a right record may alarm: some ten comparisons of a hundred records then give
one false alarm in a hundred audits. Project choice."""
SHARE = 0.01
"""The noise that a rate may keep, as a share of the motion: below most of the differences that matter."""
FEWEST_WINDOWS = 12
"""Independent windows below which nothing is judged."""
_FINEST = 20
"""Steps of a uniform time base for one row: bounds what uneven times may take. Project choice."""
ORDERS = ("delta_order_rad", "n_radps")
"""Signals that hold until the next reading."""


@dataclass(frozen=True, eq=False)
class AuditWindows:
    """Windows of one width, half a width apart, over a uniform time base.

    For a smooth bump g that vanishes at both ends, dy/dt weighted with g has the same mean as y weighted with the
    derivative of g (integration by parts): a signal and the rate of another are compared exactly, at any width.
    g is the square of a Hann window, so that second derivatives are smooth as well.

    - `step_s`: Step of the time base.
    - `samples`: Width, odd.
    - `hop`: Samples from one window to the next; 0: half a width.
    """

    step_s: float
    samples: int
    hop: int = 0

    @property
    def width_s(self) -> float:
        """Width, s."""
        return self.step_s * (self.samples + 1)

    def noise_of_mean(self, noise: float) -> float:
        """Standard deviation that white noise in a signal leaves in :meth:`mean`."""
        return noise * float(np.sqrt(35 / 18 * self.step_s / self.width_s))

    def noise_of_rate(self, noise: float) -> float:
        """Standard deviation, per s, that white noise in a signal leaves in :meth:`rate`."""
        return noise * float(np.sqrt(10 / 9 * (2 * np.pi) ** 2 * self.step_s / self.width_s**3))

    def mean(self, values: NDArray[AuditNumber]) -> NDArray[AuditNumber]:
        """Weighted mean in each window, (windows,); nan where a value is missing."""
        return self._convolved(values, 0)

    def rate(self, values: NDArray[AuditNumber]) -> NDArray[AuditNumber]:
        """Weighted mean of the first derivative in each window, (windows,), per s."""
        return self._convolved(values, 1)

    def acceleration(self, values: NDArray[AuditNumber]) -> NDArray[AuditNumber]:
        """Weighted mean of the second derivative in each window, (windows,), per s2."""
        return self._convolved(values, 2)

    def _convolved(self, values: NDArray[AuditNumber], order: int) -> NDArray[AuditNumber]:
        from scipy.signal import oaconvolve  # slow to import

        if len(values) < self.samples:
            return np.empty(0, dtype=values.dtype)
        missing = ~np.isfinite(values)
        kernel = self._kernel(order)
        filled = np.where(missing, 0, values)
        offset = np.mean(filled)  # the kernels of derivatives sum to zero: less rounding
        inside = oaconvolve(filled - (offset if order else 0), kernel, mode="valid")
        if missing.any():
            holes = oaconvolve(missing.astype(float), np.ones(self.samples), mode="valid") > 0.5
            inside = np.where(holes, np.nan, inside)
        return np.asarray(inside[:: self.hop or (self.samples + 1) // 2])

    def _kernel(self, order: int) -> Array:
        width = self.width_s
        phase = 2 * np.pi * np.arange(1, self.samples + 1) / (self.samples + 1)
        # (1 - cos p)^2 = 3/2 - 2 cos p + cos(2 p)/2, of mean 3/2; p = 2 pi t/width
        turn = 2 * np.pi / width
        shapes = (
            1.5 - 2 * np.cos(phase) + 0.5 * np.cos(2 * phase),
            turn * (2 * np.sin(phase) - np.sin(2 * phase)),
            turn**2 * (2 * np.cos(phase) - 2 * np.cos(2 * phase)),
        )
        return np.asarray(shapes[order] / (1.5 * width) * self.step_s)


def windows_for(noise: float, motion: float, step_s: float, count: int) -> AuditWindows:
    """Windows in which the rate of a signal with this noise is known to a hundredth of the rate of the motion.

    White noise s in the signal leaves s sqrt(10/9 (2 pi)^2 step/width^3) in its rate. At least eight samples wide,
    and at most a twentieth of the record.

    `noise`: Standard deviation of the signal; `motion`: Root mean square of its rate, per s; `step_s`, `count`: Time
    base.
    """
    motion = motion if np.isfinite(motion) else 0.0
    wanted = (10 / 9 * (2 * np.pi) ** 2 * step_s * (noise / max(SHARE * motion, 1e-9 * noise, 1e-300)) ** 2) ** (
        1 / 3
    ) / step_s
    samples = int(np.clip(wanted, 8, max(8, count / 20)))
    return AuditWindows(step_s, samples + 1 - samples % 2)


def windows_of(values: NDArray[AuditNumber], noise: float, step_s: float) -> AuditWindows:
    """Windows fit for the rate of a signal (n,) with this noise, by :func:`windows_for` and its own motion."""
    windows = AuditWindows(step_s, 9)
    for _ in range(2):  # narrow windows still hold noise, which the second pass does not
        windows = windows_for(noise, known_rms(np.abs(windows.rate(values))), step_s, len(values))
    return windows


def known_rms(values: Array) -> float:
    """Root mean square of a signal (n,), nan left out; 0 where nothing is known."""
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(np.square(known)))) if known.size else 0.0


@dataclass(frozen=True, eq=False)
class WeakFit:
    """Least-squares coefficients (k,), their standard errors (k,), and the root mean square of the residual."""

    values: Array
    errors: Array
    residual: float
    freedom: float

    def differs(self, place: int, expected: float = 0.0) -> bool:
        """Whether a coefficient is not the expected one, at the false-alarm probability of the audit."""
        limit = -float(stdtrit(self.freedom, FALSE_ALARM / 2))
        return bool(abs(self.values[place] - expected) > limit * self.errors[place])


def fit(target: Array | Complex, regressors: Sequence[Array | Complex]) -> WeakFit | None:
    """Regression of a target (windows,) on regressors, real or complex.

    None if there are too few windows, or the regressors cannot be distinguished.

    Complex ones give two coefficients each, real and imaginary part. Standard errors follow Newey & West (1987)
    with residuals correlated over four half-overlapping windows, so that they hold for coloured noise, or the
    ordinary ones where these are larger: where few windows decide (the entry of a turn), the former are too small.
    """
    table = np.column_stack(regressors)
    whole = np.isfinite(target) & np.isfinite(table).all(axis=1)
    if np.count_nonzero(whole) < 2 * FEWEST_WINDOWS:
        return None
    table, wanted = table[whole], target[whole]
    if np.iscomplexobj(target) or np.iscomplexobj(table):
        both = np.stack([table, 1j * table], axis=2).reshape(len(table), -1)
        design = np.stack([both.real, both.imag], axis=1).reshape(-1, both.shape[1])
        wanted = np.stack([wanted.real, wanted.imag], axis=1).ravel()
    else:
        design, wanted = table.real, np.real(wanted)
    independent = int(np.count_nonzero(whole)) / 2
    freedom = independent - design.shape[1]
    size = np.sqrt(np.mean(design**2, axis=0)) if len(design) else np.zeros(1)
    if independent < FEWEST_WINDOWS or freedom < FEWEST_WINDOWS / 2 or not np.all(size > 0):
        return None
    design = design / size
    if np.linalg.matrix_rank(design) < design.shape[1]:
        return None
    lags = 4 * (len(wanted) // int(np.count_nonzero(whole)))
    values = np.linalg.lstsq(design, wanted, rcond=None)[0]
    residual = wanted - design @ values
    inverse = np.linalg.inv(design.T @ design)
    rows, terms = design.shape
    plain = inverse * (residual @ residual) / (rows - terms)
    robust = inverse @ newey_west(design * residual[:, None], lags) @ inverse * rows / (rows - terms)
    errors = np.sqrt(np.maximum(np.diag(plain), np.diag(robust)))
    return WeakFit(values / size, errors / size, float(np.sqrt(np.mean(residual**2))), freedom)


def newey_west(scores: Array, lags: int) -> Array:
    """Covariance (k, k) of the sum of `scores` (n, k) that correlate over up to `lags` rows (Newey & West 1987)."""
    found = scores.T @ scores
    for lag in range(1, min(lags, len(scores) - 1) + 1):
        product = scores[lag:].T @ scores[:-lag]
        found += (1 - lag / (lags + 1)) * (product + product.T)
    return np.asarray(found)


def on_uniform_time(trial: Trial) -> tuple[float, dict[str, Array]]:
    """Step (s) and signals on a uniform time base: as they are if theirs is uniform, else interpolated linearly.

    A signal recorded less often than the rows, regularly, is taken as straight between its readings, orders as held.
    What lies in a longer gap of its signal or of the rows is nan. The time base has at most `FINEST` steps a row.
    """
    time = trial.time_s
    step = max(sampling_step(trial), float(time[-1] - time[0]) / (_FINEST * (len(time) - 1)))
    even = time[0] + step * np.arange(len(time))
    uniform = bool(np.max(np.abs(time - even)) < 0.5 * step)
    grid = time if uniform else np.arange(time[0], time[-1] + step / 2, step)
    return step, {
        name: values if uniform and np.isfinite(values).all() else _on_grid(name, trial, grid, step)
        for name, values in trial.signals.items()
    }


def _on_grid(name: str, trial: Trial, grid: Array, step: float) -> Array:
    known = np.isfinite(trial.signals[name])
    time, values = trial.time_s[known], trial.signals[name][known]
    if len(time) < 2:
        return np.full(len(grid), np.nan)
    after = np.clip(np.searchsorted(time, grid), 1, len(time) - 1)
    missing = (time[after] - time[after - 1]) > max(2 * step, 1.5 * usual_step(time))
    missing |= (grid < time[0] - step / 2) | (grid > time[-1] + step / 2)
    if name in ORDERS:
        return np.where(missing, np.nan, values[np.clip(np.searchsorted(time, grid, side="right") - 1, 0, None)])
    return np.where(missing, np.nan, np.interp(grid, time, values))
