"""Estimates from tows by one method, with their uncertainty and conditioning."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tank2sim.apps.rigs.tow.surge import DRAG_POWERS, SurgeCoefficients, drag
from tank2sim.arrays import Array, Unbounded
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
"""Unknown that (1.5) does not have: time from t = 0 to the start of the body, s."""


@dataclass(frozen=True, eq=False, kw_only=True)
class TowFit:
    """Estimates of M, the chosen drag terms of (1.5) and the start delay by one method.

    Parameters
    ----------
    method : str
        ``paper``, ``qr`` or ``output_error``.
    unknowns : tuple of str
        M, the drag terms in the order of (1.5), and ``delay`` if it was estimated.
    estimated : tuple of str
        Unknowns that are estimated: all, or all but a given M.
    estimates : dict
        Name with unit (:data:`TOW_PARAMETERS`, ``added_mass_kg``) to value, SI.
    standard_errors : dict
        Name with unit to standard error (one standard deviation); empty if the method gives none. A given mass has 0.
    correlation : array (unknowns, unknowns), optional
        Correlations of the unknowns.
    condition, condition_scaled : float
        Condition number of the normal matrix, of (b_ij) in (1.12); and of that matrix with a diagonal of ones, which
        is free of the units.
    J : float
        J of (1.6), N s^(1/2), with the polynomial speed of the tows.
    largest_speed_error_mps : float
        Largest absolute difference of the integrated speed from the mean of the tows; infinite where it overflows.
    """

    method: str
    unknowns: tuple[str, ...]
    estimated: tuple[str, ...]
    estimates: dict[str, float]
    standard_errors: dict[str, float]
    correlation: Array | None
    condition: Unbounded
    condition_scaled: Unbounded
    J: float
    largest_speed_error_mps: Unbounded

    @property
    def values(self) -> Array:
        """Estimates (unknowns,), SI."""
        return np.array([self.estimates[TOW_PARAMETERS[name]] for name in self.unknowns])

    @property
    def errors(self) -> Array | None:
        """Standard errors (unknowns,), SI; None where the method gives none."""
        if not self.standard_errors:
            return None
        return np.array([self.standard_errors[TOW_PARAMETERS[name]] for name in self.unknowns])

    @property
    def drag_terms(self) -> dict[str, float]:
        """Drag term of (1.5) to its coefficient, SI."""
        return {name: self.estimates[TOW_PARAMETERS[name]] for name in self.unknowns if name in DRAG_POWERS}

    @property
    def start_delay_s(self) -> float:
        """Time from t = 0 to the start of the body, s; 0 if it was not estimated."""
        return self.estimates.get(TOW_PARAMETERS[DELAY], 0.0)

    @property
    def coefficients(self) -> SurgeCoefficients:
        """The values for :func:`tank2sim.apps.rigs.tow.surge.surge_model`; terms that were not estimated are 0."""
        return surge_coefficients(self.unknowns, self.values)

    @property
    def added_mass_kg(self) -> float:
        """lambda11 = M - m."""
        return self.estimates["added_mass_kg"]

    def drag_N(self, speed_mps: Array) -> Array:
        """Drag in N at speeds in m/s."""
        c = self.coefficients
        force: Array = drag(speed_mps, c.B1_kgs2pm3, c.B2_kgspm2, c.B3_kgpm)
        return force


def surge_coefficients(unknowns: tuple[str, ...], values: Array) -> SurgeCoefficients:
    """Mass and drag from the values (unknowns,) of unknowns, SI; a delay among them is left out."""
    named = zip(unknowns, values.tolist(), strict=True)
    return SurgeCoefficients(**{TOW_PARAMETERS[name]: value for name, value in named if name != DELAY})


@dataclass(frozen=True, eq=False)
class TowSolution:
    """TowSolution of a least-squares problem of tows.

    Parameters
    ----------
    values : array (unknowns,)
        M, the coefficients of the drag terms, and the start delay if it is estimated; SI.
    design : array (rows, free unknowns)
        Design matrix; without a column for M if it was given.
    covariance : array (unknowns, unknowns), optional
        Covariance of the values; None where the method gives none.
    """

    values: Array
    design: Array
    covariance: Array | None = None

    def fit(self, method: str, terms: tuple[str, ...], mass_kg: float, J: float) -> TowFit:
        """The solution with the names of its unknowns; its largest speed error is not known yet.

        Parameters
        ----------
        method, J
            As of :class:`TowFit`.
        terms : tuple of str
            Drag terms in the order of (1.5).
        mass_kg : float
            m, taken as exact.
        """
        unknowns = ("M", *terms, DELAY)[: len(self.values)]
        names = [TOW_PARAMETERS[name] for name in unknowns]
        errors: dict[str, float] = {}
        if self.covariance is not None:
            errors = dict(zip(names, np.sqrt(np.maximum(np.diag(self.covariance), 0.0)).tolist(), strict=True))
            errors["added_mass_kg"] = errors["total_mass_kg"]
        estimates = dict(zip(names, self.values.tolist(), strict=True))
        return TowFit(
            method=method,
            unknowns=unknowns,
            estimated=unknowns[len(unknowns) - self.design.shape[1] :],
            estimates={**estimates, "added_mass_kg": estimates["total_mass_kg"] - mass_kg},
            standard_errors=errors,
            correlation=None if self.covariance is None else correlation_matrix(self.covariance),
            condition=float(np.linalg.cond(self.design) ** 2),
            condition_scaled=scaled_condition(self.design) ** 2,
            J=J,
            largest_speed_error_mps=math.inf,
        )
