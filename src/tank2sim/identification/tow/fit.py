"""Estimates from tows by one method, with their uncertainty and conditioning."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from tank2sim.arrays import Array
from tank2sim.dynamics.surge import SurgeCoefficients, drag
from tank2sim.identification.conditioning import correlation_matrix, scaled_condition

TOW_PARAMETERS = {
    "M": "total_mass_kg",
    "B1": "B1_kgs2pm3",
    "B2": "B2_kgspm2",
    "B3": "B3_kgpm",
    "delay": "start_delay_s",
}
"""Unknown of (1.5) to its name with unit, as in :class:`SurgeCoefficients`, the card and the JSON."""

DELAY = "delay"
"""Unknown in addition to those of (1.5): time from t = 0 to the start of the body, s."""


@dataclass(frozen=True, eq=False, kw_only=True)
class TowFit:
    """Estimates of M, the chosen drag terms of (1.5) and the start delay by one method.

    Parameters
    ----------
    method : str
        ``paper``, ``qr`` or ``output_error``.
    terms : tuple of str
        Drag terms, in the order of (1.5).
    values : array, (unknowns,)
        M, the coefficients of the terms, and the start delay if it is estimated; SI.
    covariance : array, (unknowns, unknowns), or None
        Covariance of the values; None where the method gives none. A given mass has no variance.
    mass_kg : float
        m, taken as exact.
    design : array, (rows, free unknowns)
        Design matrix of the method's least squares.
    J : float
        Integral J of (1.6), N s^(1/2), with the polynomial speed of the tows.
    largest_speed_error_mps : float
        Largest absolute difference of the integrated speed from the mean of the tows; infinite where it overflows.
    """

    method: str
    terms: tuple[str, ...]
    values: Array
    covariance: Array | None
    mass_kg: float
    design: Array
    J: float
    largest_speed_error_mps: float

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Names of the values: M, the terms, and ``delay`` where it was estimated."""
        return ("M", *self.terms, DELAY)[: len(self.values)]

    @property
    def free(self) -> tuple[str, ...]:
        """Names of the estimated values: without M if it was given."""
        return self.unknowns[len(self.unknowns) - self.design.shape[1] :]

    @property
    def drag_terms(self) -> dict[str, float]:
        """Drag term of (1.5) to its coefficient, SI."""
        return {
            name: float(value) for name, value in zip(self.unknowns, self.values, strict=True) if name in self.terms
        }

    @property
    def start_delay_s(self) -> float:
        """Time from t = 0 to the start of the body, s; 0 if it was not estimated."""
        return float(self.values[-1]) if DELAY in self.unknowns else 0.0

    @property
    def coefficients(self) -> SurgeCoefficients:
        """The values for :func:`tank2sim.dynamics.surge.surge_model`; terms that were not estimated are 0."""
        drags = {TOW_PARAMETERS[name]: value for name, value in self.drag_terms.items()}
        return SurgeCoefficients(total_mass_kg=float(self.values[0]), **drags)

    @property
    def added_mass_kg(self) -> float:
        """lambda11 = M - m."""
        return float(self.values[0]) - self.mass_kg

    @property
    def estimates(self) -> dict[str, float]:
        """Name with unit to estimate, the added mass among them."""
        named = {TOW_PARAMETERS[name]: float(value) for name, value in zip(self.unknowns, self.values, strict=True)}
        return {**named, "added_mass_kg": self.added_mass_kg}

    @property
    def standard_errors(self) -> dict[str, float]:
        """Name with unit to standard error (one standard deviation); empty where the method gives none."""
        if self.covariance is None:
            return {}
        errors = np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
        named = {TOW_PARAMETERS[name]: float(error) for name, error in zip(self.unknowns, errors, strict=True)}
        return {**named, "added_mass_kg": float(errors[0])}

    @property
    def correlation(self) -> Array | None:
        """Correlations of the values, (unknowns, unknowns)."""
        return None if self.covariance is None else correlation_matrix(self.covariance)

    @property
    def condition(self) -> float:
        """Condition number of the normal matrix, of (b_ij) in (1.12); QR works with its root."""
        return float(np.linalg.cond(self.design) ** 2)

    @property
    def condition_scaled(self) -> float:
        """Condition number of the normal matrix with a diagonal of ones: free of the units."""
        return scaled_condition(self.design) ** 2

    def drag_N(self, speed_mps: Array) -> Array:
        """Drag in N at speeds in m/s."""
        c = self.coefficients
        force: Array = drag(speed_mps, c.B1_kgs2pm3, c.B2_kgspm2, c.B3_kgpm)
        return force

    def as_json(self) -> dict[str, Any]:
        """The fit as plain data."""
        matrix = self.correlation
        return {
            "estimated": list(self.free),
            "estimates": self.estimates,
            "standard_errors": self.standard_errors,
            "correlation": None if matrix is None else {"of": list(self.unknowns), "matrix": matrix.tolist()},
            "condition": self.condition,
            "condition_scaled": self.condition_scaled,
            "J": self.J,
            "largest_speed_error_mps": error if np.isfinite(error := self.largest_speed_error_mps) else None,
        }
