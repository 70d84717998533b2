"""Reduction of a run to mean, trend and harmonics of X, Y, N, with a covariance that includes coloured noise.

Least squares over whole periods, with zero offset, linear drift of the zero and higher harmonics fitted, so that none
of them biases the first harmonic. A record sampled at 20 Hz is not 20 independent readings a second: the covariance
uses the spectral density of the residuals near each harmonic's frequency (for a harmonic regressor the
autocorrelation enters by that density alone; Grenander & Rosenblatt 1957). The zero error that is common to a
whole run cannot be seen inside it; :mod:`tank2sim.identification.captive.regression` finds it from run to run.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import digamma, polygamma

from tank2sim.arrays import Array
from tank2sim.identification.captive.motion import CaptiveMotion, harmonic_basis, run_motion
from tank2sim.records.captive_record import FORCE_COLUMNS, CaptiveRun

FORCE_HARMONICS = 5
"""Harmonics of the forces that are fitted."""
REGRESSED_HARMONICS = 3
"""Harmonics that go into the derivatives: products of third order reach the third."""
_WINDOW = 10
"""Lines of the periodogram on each side of a frequency over which its density is averaged."""
_FLOOR = 1e-6
"""Least standard deviation of a record relative to its largest value: a computed record has no noise."""


@dataclass(frozen=True, eq=False, kw_only=True)
class HarmonicFit:
    """Harmonics of one force in one run."""

    # (columns,): In the order of :attr:`ReducedRun.labels`, N or N m, hydrodynamic sense, as measured
    coefficients: Array
    covariance: Array  # (columns, columns): Covariance of noise within the run, without the zero error of the run
    density: Array  # (columns,): Variance of white noise that would disturb each coefficient as much
    freedom: Array  # (columns,): Degrees of freedom of each density


@dataclass(frozen=True, eq=False, kw_only=True)
class ReducedRun:
    """A run reduced to harmonics."""

    run: CaptiveRun  # The record
    motion: CaptiveMotion  # Smooth motion of the run
    # ``mean``, ``cos 1``, ``sin 1``, ..., and last ``trend`` (by the time over half the record's length)
    labels: tuple[str, ...]
    fits: Mapping[str, HarmonicFit]  # ``X``, ``Y``, ``N`` to its fit

    @property
    def regressed(self) -> int:
        """Number of coefficients, from the first, that determine the derivatives."""
        return 1 + 2 * REGRESSED_HARMONICS if self.run.oscillates else 1

    @property
    def basis(self) -> Array:
        """Basis of the fit of the forces, (rows, columns): computed, not kept, for it is larger than the record."""
        return force_basis(self.motion)

    def fitted(self, force: str) -> Array:
        """Mean, harmonics and trend of a force as a history, (rows,), N or N m."""
        history: Array = self.basis @ self.fits[force].coefficients
        return history

    def residual(self, force: str) -> Array:
        """Record less fit, (rows,), N or N m."""
        return self.run.force(force)[self.motion.kept] - self.fitted(force)

    def with_density(self, force: str, density: Array) -> ReducedRun:
        """The run with another density of the noise of a force, (columns,)."""
        fit = self.fits[force]
        ratio = np.sqrt(density / fit.density)
        changed = replace(fit, density=density, covariance=fit.covariance * np.outer(ratio, ratio))
        return replace(self, fits={**self.fits, force: changed})

    def projected(self, histories: Array) -> Array:
        """Coefficients (regressed, n) of the given histories (rows, n); exactly linear."""
        if not self.run.oscillates:
            means: Array = histories.mean(axis=0)[None]  # to which the trend is orthogonal
            return means
        basis = self.basis
        coefficients = np.linalg.solve(basis.T @ basis, basis.T @ histories)[: self.regressed]
        return np.asarray(coefficients, dtype=np.float64)


def force_basis(motion: CaptiveMotion) -> Array:
    """Mean, harmonics and, except over a single period, where it is nearly a sine, trend; (rows, columns)."""
    rows = len(motion.time_s)
    basis = harmonic_basis(motion.time_s, motion.frequency_radps, FORCE_HARMONICS if motion.periods else 0)
    if rows <= 2 or motion.periods == 1:
        return basis
    return np.vstack([basis.T, np.linspace(-1.0, 1.0, rows)]).T


def reduced_run(run: CaptiveRun) -> ReducedRun:
    """Reduce a run to mean, harmonics and trend of its forces.

    Raises InputError: As :func:`tank2sim.identification.captive.motion.run_motion`.
    """
    motion = run_motion(run)
    basis = force_basis(motion)
    harmonics = FORCE_HARMONICS if run.oscillates else 0
    labels = ["mean", *(f"{wave} {order}" for order in range(1, harmonics + 1) for wave in ("cos", "sin"))]
    labels += ["trend"] * (basis.shape[1] - len(labels))
    inverse = np.asarray(np.linalg.inv(basis.T @ basis), dtype=np.float64)
    fits = {name: _fit(run.force(name)[motion.kept], basis, inverse, motion) for name in FORCE_COLUMNS}
    return ReducedRun(run=run, motion=motion, labels=tuple(labels), fits=fits)


def _fit(values: Array, basis: Array, inverse: Array, motion: CaptiveMotion) -> HarmonicFit:
    coefficients = inverse @ (basis.T @ values)
    residual = values - basis @ coefficients
    floor = (_FLOOR * float(np.max(np.abs(values))) + 1e-30) ** 2
    density, freedom = _densities(residual, basis.shape[1], motion.periods)
    density = np.maximum(density, floor)
    root = np.sqrt(density)
    return HarmonicFit(
        coefficients=coefficients,
        covariance=inverse * np.outer(root, root),
        density=density,
        freedom=freedom,
    )


def moderated(runs: Sequence[ReducedRun]) -> tuple[ReducedRun, ...]:
    """The runs with densities moderated by all runs.

    A density averaged over a few lines has an uncertainty of a quarter. Each is drawn towards the campaign's usual
    density as far as the runs differ only by chance (Smyth 2004, Statistical Applications in Genetics and Molecular
    Biology 3); densities that differ significantly do not change.
    """
    result = list(runs)
    records = [place for place, run in enumerate(runs) if not run.run.is_average]
    if len(records) < 3:
        return tuple(runs)
    for force in FORCE_COLUMNS:
        fits = [runs[place].fits[force] for place in records]
        usual, weight = _usual_density(
            np.concatenate([f.density for f in fits]), np.concatenate([f.freedom for f in fits])
        )
        for place, fit in zip(records, fits, strict=True):
            if math.isinf(weight):
                density = np.full(len(fit.density), usual)
            else:
                density = (weight * usual + fit.freedom * fit.density) / (weight + fit.freedom)
            result[place] = result[place].with_density(force, density)
    return tuple(result)


def _usual_density(density: Array, freedom: Array) -> tuple[float, float]:
    """The campaign's usual density and its weight in degrees of freedom, from the scatter of the logarithms."""
    half = freedom / 2
    logs = np.log(density) - digamma(half) + np.log(half)
    usual = float(np.mean(logs))
    excess = float(np.var(logs, ddof=1) - np.mean(polygamma(1, half)))
    if excess <= 0:
        return math.exp(usual), math.inf
    weight = _inverse_trigamma(excess)
    return math.exp(usual + float(digamma(weight) - math.log(weight))), 2 * weight


def _inverse_trigamma(value: float) -> float:
    """x with trigamma(x) = value, by Newton's method on 1/trigamma, which is nearly straight (Smyth 2004)."""
    x = 0.5 + 1.0 / value
    for _ in range(20):
        step = float(polygamma(1, x) * (1 - polygamma(1, x) / value) / polygamma(2, x))
        x += step
        if abs(step) < 1e-8 * x:
            break
    return x


def _densities(residual: Array, columns: int, periods: int) -> tuple[Array, Array]:
    """Spectral density of the residual at each column's frequency, (columns,), as a variance; degrees of freedom."""
    count = len(residual)
    if count <= columns + 2:
        freedom = max(1, count - columns)
        return np.full(columns, float(residual @ residual) / freedom), np.full(columns, float(freedom))
    power = np.abs(np.fft.rfft(residual)) ** 2 / count
    # The fit removes the power at its harmonics, which over whole periods are lines of the periodogram.
    fitted = np.zeros(len(power), dtype=bool)
    fitted[0] = True
    if periods:
        fitted[periods : FORCE_HARMONICS * periods + 1 : periods] = True
    lines = np.zeros(columns, dtype=int)
    if periods:
        harmonics = np.repeat(np.arange(1, FORCE_HARMONICS + 1), 2) * periods
        lines[1 : 1 + len(harmonics)] = np.minimum(harmonics, len(power) - 1)
    densities, freedoms = np.empty(columns), np.empty(columns)
    for line in np.unique(lines):
        window = slice(max(0, line - _WINDOW), max(line, _WINDOW) + _WINDOW + 1)
        near = power[window][~fitted[window]]
        near = near if near.size else power[~fitted]
        densities[lines == line], freedoms[lines == line] = near.mean(), 2 * near.size
    return densities, freedoms
