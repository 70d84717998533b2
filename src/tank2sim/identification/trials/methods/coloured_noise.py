"""Residuals as white noise plus first-order autoregressive noise, and the filter that whitens them.

A sum of white noise and an AR(1) process is an ARMA(1,1) process (Granger and Morris 1976, J. R. Stat. Soc. A 139):
``e[k] - phi e[k-1] = w[k] - psi w[k-1]`` with w white. The filter is that equation solved for w.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tank2sim.arrays import Array

LARGEST_PHI = 0.995
"""Above it a residual would count as drift, and only its steps from sample to sample would count (project choice)."""


@dataclass(frozen=True)
class ColouredNoise:
    """Noise of one signal: autoregressive factor `phi`, moving-average factor `psi`, standard deviation of w."""

    sigma: float
    phi: float = 0.0
    psi: float = 0.0

    @property
    def deviation(self) -> float:
        """Standard deviation of the coloured residual."""
        colour = (1 - 2 * self.phi * self.psi + self.psi**2) / (1 - self.phi**2)
        return self.sigma * float(np.sqrt(colour))

    @property
    def correlated_samples(self) -> float:
        """Samples after which the autocorrelation of the residual has fallen to 1/e of that at a lag of one."""
        return float(-1 / np.log(self.phi)) if self.phi > 0 else 0.0

    def whitened(self, residuals: Array) -> Array:
        """``w / sigma`` of residuals or their derivatives, along axis -2 if 3-D (pieces, n, columns), else axis 1.

        The first sample of a piece represents the stationary past: it is divided by the deviation of the residual.
        """
        from scipy.signal import lfilter  # slow to import

        if not self.phi and not self.psi:
            return residuals / self.sigma
        white: Array = lfilter([1.0, -self.phi], [1.0, -self.psi], residuals, axis=1) / self.sigma
        white[:, 0] = residuals[:, 0] / self.deviation  # unit variance, as if the previous residual had been zero
        return white

    def whitened_transposed(self, white: Array) -> Array:
        """The transpose of :meth:`whitened` applied to `white` (pieces, n)."""
        from scipy.signal import lfilter  # slow to import

        later = white.copy()
        later[:, 0] = 0.0
        result: Array = lfilter([1.0, -self.phi], [1.0, -self.psi], later[:, ::-1], axis=1)[:, ::-1] / self.sigma
        result[:, 0] += white[:, 0] / self.deviation
        return result


def white(deviation: float) -> ColouredNoise:
    """Noise without colour."""
    return ColouredNoise(deviation)


def estimate_coloured_noise(pieces: Sequence[Array], smallest: float) -> ColouredNoise:
    """Noise of one signal from its residuals.

    `pieces` each (n,): Residuals of continuous pieces, nan where not measured. `smallest`: Least plausible deviation,
    in the signal's unit (rounding of the record).

    The AR(1) part follows from the autocovariances at lags 1 and 2, the white part from the excess at lag 0; psi is the
    root within the unit circle of the spectral factorisation.
    """
    g0, g1, g2 = (_autocovariance(pieces, lag) for lag in (0, 1, 2))
    g0 = max(g0, smallest**2)
    if g1 <= 0.05 * g0:
        return ColouredNoise(float(np.sqrt(g0)))
    phi = float(np.clip(g2 / g1, 0.0, LARGEST_PHI))
    if phi < 0.05:
        return ColouredNoise(float(np.sqrt(g0)))
    coloured = min(g1 / phi, g0)
    uncoloured = max(g0 - coloured, 0.0)
    if uncoloured < 1e-9 * g0:
        return ColouredNoise(float(np.sqrt(coloured * (1 - phi**2))), phi)
    # (1 - phi q) white + shock: autocovariances c0 and c1 of the MA(1) side
    c0 = coloured * (1 - phi**2) + uncoloured * (1 + phi**2)
    c1 = -phi * uncoloured
    half = c0 / (2 * c1)
    psi = float(-half - np.sqrt(half**2 - 1)) if half < 0 else float(-half + np.sqrt(half**2 - 1))
    psi = psi if abs(psi) < 1 else 1 / psi
    return ColouredNoise(float(np.sqrt(c0 / (1 + psi**2))), phi, psi)


def _autocovariance(pieces: Sequence[Array], lag: int) -> float:
    products = [piece[lag:] * piece[: len(piece) - lag] for piece in pieces if len(piece) > lag]
    every = np.concatenate(products) if products else np.zeros(1)
    every = every[~np.isnan(every)]
    return float(every.mean()) if len(every) else 0.0
