"""The zero of the drift angle, as a campaign shows it by the side force and moment that are left at zero drift.

A symmetric model that is turned by a small angle eps against the recorded drift has Y0 = -Yv eps and N0 = -Nv eps, and
terms such as Yvrr eps r^2 that the regression takes for more of both: how much is found by turning the recorded drift
and solving again. Y0 and N0 then give the same angle. A single screw or a bent hull does not, but by chance: its Y0 and
N0 have another ratio.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from scipy.special import chdtrc

from tank2sim.identification.captive.equations import CampaignEquations
from tank2sim.identification.captive.regression import Solution, solve
from tank2sim.identification.captive.type_b import with_common_error
from tank2sim.records.campaigns import Campaign

_SHOWN = 4.0
"""Standard errors of an angle that is shown: by chance once in 16 000 campaigns."""
_SMALL_RAD = 1e-4
"""Turn by which the slope is found: far below any angle that matters, far above rounding."""
_ALIKE = 0.01
"""Probability of the difference of the two angles below which they are not one angle. Project choice."""


@dataclass(frozen=True, kw_only=True)
class AlignmentEstimate:
    """The angle by which the true drift exceeds the recorded one, rad.

    Parameters
    ----------
    angle_rad, standard_error_rad : float
        Weighted mean of that by Y0 and that by N0.
    by_force : mapping
        ``Y`` and ``N`` to angle and standard error.
    chance : float
        Probability of so large a difference of the two.
    """

    angle_rad: float
    standard_error_rad: float
    by_force: Mapping[str, tuple[float, float]]
    chance: float

    @property
    def shown(self) -> bool:
        """The angle is not zero, and Y0 and N0 agree on it."""
        return abs(self.angle_rad) > _SHOWN * self.standard_error_rad and self.chance > _ALIKE


def alignment_estimate(
    campaign: Campaign, equations: Mapping[str, CampaignEquations], solutions: Mapping[str, Solution]
) -> AlignmentEstimate | None:
    """The zero of the drift angle; None if the campaign does not give Y0, Yv, N0 and Nv.

    Parameters
    ----------
    campaign : Campaign
    equations, solutions : mapping
        ``Y`` and ``N`` to the equations of that force and their solution.
    """
    found: dict[str, tuple[float, float]] = {}
    for force in "YN":
        solution, zero = solutions[force], f"{force}0"
        if not {zero, f"{force}v"} <= set(solution.names):
            return None
        turned = with_common_error(campaign, equations[force], "alignment_rad", _SMALL_RAD)
        slope = (solve(turned, solution.spread).value(zero) - solution.value(zero)) / _SMALL_RAD
        if not slope:
            return None
        found[force] = (-solution.value(zero) / slope, solution.error(zero) / abs(slope))
    weights = {force: error**-2.0 for force, (_, error) in found.items()}
    total = sum(weights.values())
    mean = sum(weights[force] * angle for force, (angle, _) in found.items()) / total
    scatter = sum(weights[force] * (angle - mean) ** 2 for force, (angle, _) in found.items())
    return AlignmentEstimate(
        angle_rad=mean, standard_error_rad=total**-0.5, by_force=found, chance=float(chdtrc(1, scatter))
    )
