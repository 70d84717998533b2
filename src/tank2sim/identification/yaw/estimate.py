"""Estimates from records of the yaw rig by one method: inertia, dissipation and friction with their errors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from tank2sim.identification.yaw.intervals import ENERGY_TERMS


@dataclass(frozen=True, kw_only=True)
class YawEstimate:
    """Estimates by one method, SI.

    Parameters
    ----------
    method : str
    total_inertia_kgm2, inertia_error_kgm2 : float
        J_zz + lambda661 (in air J_zz) and its standard error; None where the data do not determine it.
    dissipation_J, dissipation_error_J : float
        B + D over one interval.
    friction : mapping
        Other terms of :data:`tank2sim.identification.yaw.intervals.ENERGY_TERMS` to (value, standard error), in SI.
    misfit : float or None
        Root mean square of the residuals: J for methods of energy, rad for those of the angle.
    bias_kgm2 : float or None
        Difference of a two-interval formula from the energy least squares of the same records.
    bias_from : mapping
        Parts of the bias: ``dissipation`` (different in both intervals) and ``speeds`` (w1, w2 differ from w6, w5).
    by_hump_kgm2 : tuple of float
        J_zz + lambda661 of each pair of intervals by a two-interval formula, of which the estimate is the mean.
    """

    method: str
    total_inertia_kgm2: float
    inertia_error_kgm2: float | None
    dissipation_J: float
    dissipation_error_J: float | None
    friction: Mapping[str, tuple[float, float | None]] = field(default_factory=dict)
    misfit: float | None = None
    bias_kgm2: float | None = None
    bias_from: Mapping[str, float] = field(default_factory=dict)
    by_hump_kgm2: tuple[float, ...] = ()

    def as_json(self) -> dict[str, Any]:
        """The estimate as plain data; the unit of a number is in its key."""
        result: dict[str, Any] = {
            "total_inertia_kgm2": self.total_inertia_kgm2,
            "total_inertia_standard_error_kgm2": self.inertia_error_kgm2,
            "dissipation_J": self.dissipation_J,
            "dissipation_standard_error_J": self.dissipation_error_J,
        }
        for term, (value, error) in self.friction.items():
            unit = ENERGY_TERMS[term][1]
            result[f"{term}_{unit}"], result[f"{term}_standard_error_{unit}"] = value, error
        if self.bias_kgm2 is not None:
            result["bias_against_least_squares_kgm2"] = self.bias_kgm2
            result["bias_from_kgm2"] = dict(self.bias_from)
            result["total_inertia_by_hump_kgm2"] = list(self.by_hump_kgm2)
        return result
