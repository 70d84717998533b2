"""Type B uncertainty: errors common to the whole campaign, which the scatter of its runs does not show (ITTC
7.5-02-06-04).

Each error is propagated by applying it and solving again: the change of the derivatives is their uncertainty.
Different errors are independent and add in squares.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtrc

from tank2sim.identification.captive.equations import CampaignEquations, campaign_equations
from tank2sim.identification.captive.harmonics import ReducedRun
from tank2sim.identification.captive.motion import CaptiveMotion
from tank2sim.identification.captive.regression import Solution, moved_terms
from tank2sim.identification.captive.systematic import correct_delay
from tank2sim.records.campaigns import Campaign

_SHOWN = 4.0
"""Standard errors of an angle that is shown: by chance once in 16 000 campaigns."""
_SMALL_RAD = 1e-4
"""Turn by which the slope is found: far below any angle that matters, far above rounding."""
_ALIKE = 0.01
"""Probability of the difference of the two angles below which they are not one angle. Project choice."""


def type_b_shifts(campaign: Campaign, used: CampaignEquations, solution: Solution) -> dict[str, dict[str, float]]:
    """Change of each term of a force (prime), with its sign, by each stated error of one standard deviation.

    `solution` is the solution of the equations `used`.
    """
    return {
        source: moved_terms(with_common_error(campaign, used, source, size), solution)
        for source, size in campaign.uncertainty.model_dump().items()
        if size
    }


def with_common_error(campaign: Campaign, used: CampaignEquations, source: str, size: float) -> CampaignEquations:
    """The equations with an error common to the campaign.

    `source`: A key of ``[uncertainty]``; `size`: In the unit of the key.
    """
    if source == "force_delay_s":
        return correct_delay(used, size)
    runs: Sequence[ReducedRun] = used.runs
    key = {"mass_relative": "mass_kg", "yaw_inertia_relative": "yaw_inertia_kgm2"}.get(source)
    if key and (value := getattr(campaign.model, key)) is not None:
        campaign = replace(campaign, model=campaign.model.model_copy(update={key: value * (1 + size)}))
    elif source == "calibration_relative":
        runs = [_scaled(run, 1 + size) for run in runs]
    elif not key:
        runs = [replace(run, motion=_erring(run.motion, source, size)) for run in runs]
    return campaign_equations(campaign, runs, used.force, used.names).held(used.prior)


def _erring(motion: CaptiveMotion, source: str, size: float) -> CaptiveMotion:
    """A motion with an error of the recorded drift, rudder or speed."""
    if source == "alignment_rad":
        changed = replace(motion, v_mps=motion.v_mps - motion.speed_mps * np.sin(size))
    elif source == "rudder_rad":
        changed = replace(motion, delta_rad=motion.delta_rad + size)
    else:
        assert source in ("speed_relative", "blockage_relative")
        changed = replace(motion, speed_mps=motion.speed_mps * (1 + size))
    return motion.with_error(source, size, changed)


def _scaled(run: ReducedRun, factor: float) -> ReducedRun:
    fits = {force: replace(fit, coefficients=fit.coefficients * factor) for force, fit in run.fits.items()}
    return replace(run, fits=fits)


@dataclass(frozen=True, kw_only=True)
class AlignmentEstimate:
    """The angle by which the true drift exceeds the recorded one, rad."""

    # `angle_rad`, `standard_error_rad`: Weighted mean of that by Y0 and that by N0
    angle_rad: float
    standard_error_rad: float
    by_force: Mapping[str, tuple[float, float]]  # ``Y`` and ``N`` to angle and standard error
    chance: float  # Probability of so large a difference of the two
    shown: bool  # The angle is not zero, and Y0 and N0 agree on it


def alignment_estimate(
    campaign: Campaign, equations: Mapping[str, CampaignEquations], solutions: Mapping[str, Solution]
) -> AlignmentEstimate | None:
    """The zero of the drift angle by the side force and moment at zero drift; None without Y0, Yv, N0 or Nv.

    A symmetric model that is turned by a small angle eps against the recorded drift has Y0 = -Yv eps and N0 = -Nv eps,
    and terms such as Yvrr eps r^2 that the regression takes for more of both: their size is found by turning the
    recorded drift and solving again. Y0 and N0 then give the same angle. A single screw or a bent hull has another
    ratio of Y0 and N0, except by chance.

    `equations`, `solutions`: ``Y`` and ``N`` to the equations of that force and their solution.
    """
    found: dict[str, tuple[float, float]] = {}
    for force in "YN":
        solution, zero = solutions[force], f"{force}0"
        if not {zero, f"{force}v"} <= set(solution.names):
            return None
        turned = with_common_error(campaign, equations[force], "alignment_rad", _SMALL_RAD)
        slope = moved_terms(turned, solution)[zero] / _SMALL_RAD
        if not slope:
            return None
        found[force] = (-solution.value(zero) / slope, solution.error(zero) / abs(slope))
    weights = {force: error**-2.0 for force, (_, error) in found.items()}
    total = sum(weights.values())
    mean = sum(weights[force] * angle for force, (angle, _) in found.items()) / total
    scatter = sum(weights[force] * (angle - mean) ** 2 for force, (angle, _) in found.items())
    chance, error = float(chdtrc(1, scatter)), total**-0.5
    return AlignmentEstimate(
        angle_rad=mean,
        standard_error_rad=error,
        by_force=found,
        chance=chance,
        shown=bool(abs(mean) > _SHOWN * error and chance > _ALIKE),
    )
