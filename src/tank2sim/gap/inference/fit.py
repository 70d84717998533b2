"""Input and output of a fit: priors, columns of the least squares, and the fitted hypothesis."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tank2sim.arrays import Array
from tank2sim.gap.inference.hypothesis import Hypothesis
from tank2sim.gap.inference.kalman_filter import NoiseLevels
from tank2sim.gap.inference.wave_band import WaveBand

NARROWER = 2.0
"""Factor on the standard deviation of the logarithm of the coefficients' width where it is below 1 (project choice):
the standard errors of a card, 2 % where it states none, are oftener far too large than as far too small."""


@dataclass(frozen=True, eq=False)
class NuisanceParameters:
    """Parameters that may be in error next to the effects: the card's coefficients, the clock of the record."""

    names: tuple[str, ...]  # The n parameters of the model, and :data:`.hypothesis.CLOCK`
    # (n, nc): Change of each by one standard deviation of each of nc independent causes: its individual error, and
    # errors that it shares with other parameters.
    mixing: Array
    # Number of the first causes, whose standard errors the trials may widen or narrow by a common factor: those of the
    # coefficients. What is known of gear and clock does not depend on how well the hull is known.
    scaled: int

    def spread(self, width: float) -> Array:
        """The mixing (n, nc) with the scaled causes `width` times as large."""
        return self.mixing * np.where(np.arange(self.mixing.shape[1]) < self.scaled, width, 1.0)

    @property
    def errors(self) -> Array:
        """Standard error of each (n,)."""
        errors: Array = np.sqrt(np.sum(self.mixing**2, axis=1))
        return errors


@dataclass(frozen=True, eq=False)
class CoefficientEstimates:
    """Coefficients of the card as trials determine them together with an explanation."""

    names: tuple[str, ...]  # Names of n parameters, as in :class:`NuisanceParameters`
    change: Array  # (n,): Most probable value less the card's
    covariance: Array  # (n, n): Covariance of the changes


@dataclass(frozen=True, eq=False)
class Belief:
    """Prior of the noise, and of the first state of a run."""

    # `logs`, `spread`: Mean and standard deviation of each logarithm (:attr:`.kalman_filter.NoiseLevels.logs`, and the
    # width's, for which the deviation below the mean is :data:`NARROWER` times as large).
    logs: Array
    spread: Array
    # (6,): Standard deviation of each state at the beginning of a run about the measured one: wide, for a sensor may
    # be at fault; by default :data:`.likelihood.WIDE_PRIOR` times its noise.
    wide: Array | None = None
    waves: WaveBand | None = None  # Unmodelled accelerations by waves, the same for every explanation

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Three standard deviations either way: a level further away is not noise of this kind."""
        return self.logs - 3 * self.spread, self.logs + 3 * self.spread

    def cost(self, logs: Array) -> tuple[float, Array]:
        """Cost of a noise (-2 log of its prior density, without the constant) and its slope."""
        spread = self.spread.copy()
        if logs[-1] < self.logs[-1]:
            spread[-1] *= NARROWER
        away = (logs - self.logs) / spread
        return float(away @ away), 2 * away / spread


@dataclass(frozen=True, eq=False)
class FilterColumns:
    """Columns of the filter: the residual, the effects' parameters, the coefficients (per standard error)."""

    driving: Array  # (R, T - 1, 6, 1 + k + nc)
    shown: Array  # (R, T, ny, 1 + k): No sensor shows a coefficient itself
    parameter_count: int  # Number k of parameters of the effects
    # Number of the causes whose errors are scaled; the columns after them are of other causes and of the effects' form.
    coefficient_count: int

    def factors(self, width: float) -> Array:
        """Factor on each column (1 + k + nc,) if the coefficients' standard errors are multiplied by `width`."""
        factors = np.ones(self.driving.shape[-1])
        factors[1 + self.parameter_count : 1 + self.parameter_count + self.coefficient_count] = width
        return factors

    def scaled(self, width: float) -> FilterColumns:
        """Return the columns with the coefficients' standard errors multiplied by `width`."""
        return replace(self, driving=self.driving * self.factors(width))


@dataclass(frozen=True, eq=False)
class ExplanationFit:
    """A hypothesis with its most probable parameters."""

    hypothesis: Hypothesis
    theta: Array  # (k,): Its parameters, SI
    covariance: Array  # (k, k): Their covariance
    # Logarithms of the noise (:attr:`.kalman_filter.NoiseLevels.logs`); the last one is of the width of the
    # coefficients' prior.
    logs: Array
    score: float  # T
    change: Array  # (nc,): Most probable change of the coefficients, in their standard errors beforehand

    @property
    def noise(self) -> NoiseLevels:
        """Levels and times of the noise."""
        return NoiseLevels.of(self.logs[:-1])

    @property
    def width(self) -> float:
        """Factor on the standard errors of the card's coefficients."""
        return float(np.exp(self.logs[-1]))
