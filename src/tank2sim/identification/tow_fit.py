"""What one method makes of the tows: estimates, their uncertainty, and how well they are determined."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from tank2sim.dynamics.surge import SurgeCoefficients, drag
from tank2sim.identification.conditioning import Matrix, Vector, correlation, scaled_condition

KEYS = {"M": "total_mass_kg", "B1": "B1_kgs2pm3", "B2": "B2_kgspm2", "B3": "B3_kgpm"}
"""Unknown of (1.5) to its name with unit, as in :class:`SurgeCoefficients`, the card and the JSON."""


@dataclass(frozen=True, eq=False, kw_only=True)
class TowFit:
    """Estimates of M and the chosen drag terms of (1.5) by one method.

    Parameters
    ----------
    method : str
        ``paper``, ``qr`` or ``output_error``.
    terms : tuple of str
        Drag terms, in the order of (1.5).
    values : array, (1 + terms,)
        M and the coefficients of the terms, SI.
    covariance : array, (1 + terms, 1 + terms), or None
        Of the values; None where the method gives none.
    mass_kg : float
        m, taken as exact.
    design : array, (rows, 1 + terms)
        What the method solves in the least-squares sense.
    J : float
        Of (1.6), N s^(1/2), with the polynomial speed of the tows.
    largest_speed_error_mps : float
        Largest absolute difference of the integrated speed from the mean of the tows; infinite where it overflows.
    """

    method: str
    terms: tuple[str, ...]
    values: Vector
    covariance: Matrix | None
    mass_kg: float
    design: Matrix
    J: float
    largest_speed_error_mps: float

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Names in (1.5) of the values: M and the terms."""
        return ("M", *self.terms)

    @property
    def coefficients(self) -> SurgeCoefficients:
        """The values for :func:`tank2sim.dynamics.surge.surge_model`; terms that were not estimated are 0."""
        return SurgeCoefficients(**{KEYS[name]: float(v) for name, v in zip(self.unknowns, self.values, strict=True)})

    @property
    def added_mass_kg(self) -> float:
        """lambda11 = M - m."""
        return float(self.values[0]) - self.mass_kg

    @property
    def estimates(self) -> dict[str, float]:
        """Name with unit to estimate, the added mass among them."""
        named = {KEYS[name]: float(value) for name, value in zip(self.unknowns, self.values, strict=True)}
        return {**named, "added_mass_kg": self.added_mass_kg}

    @property
    def standard_errors(self) -> dict[str, float]:
        """Name with unit to standard error (one standard deviation); empty where the method gives none."""
        if self.covariance is None:
            return {}
        errors = np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
        named = {KEYS[name]: float(error) for name, error in zip(self.unknowns, errors, strict=True)}
        return {**named, "added_mass_kg": float(errors[0])}

    @property
    def correlation(self) -> Matrix | None:
        """Correlations of the values, (1 + terms, 1 + terms)."""
        return None if self.covariance is None else correlation(self.covariance)

    @property
    def condition(self) -> float:
        """Condition number of the normal matrix, of (b_ij) in (1.12); QR works with its root."""
        return float(np.linalg.cond(self.design) ** 2)

    @property
    def condition_scaled(self) -> float:
        """Condition number of the normal matrix with a diagonal of ones: free of the units."""
        return scaled_condition(self.design) ** 2

    def drag_N(self, speed_mps: Vector) -> Vector:
        """Drag in N at speeds in m/s."""
        c = self.coefficients
        force: Vector = drag(speed_mps, c.B1_kgs2pm3, c.B2_kgspm2, c.B3_kgpm)
        return force

    def as_json(self) -> dict[str, Any]:
        """The fit as plain data."""
        matrix = self.correlation
        return {
            "estimates": self.estimates,
            "standard_errors": self.standard_errors,
            "correlation": None if matrix is None else {"of": list(self.unknowns), "matrix": matrix.tolist()},
            "condition": self.condition,
            "condition_scaled": self.condition_scaled,
            "J": self.J,
            "largest_speed_error_mps": error if np.isfinite(error := self.largest_speed_error_mps) else None,
        }
