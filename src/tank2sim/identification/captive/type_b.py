"""Type B uncertainty: errors common to the whole campaign, which the scatter of its runs does not show (ITTC
7.5-02-06-04).

Each error is propagated by applying it and solving again: the change of the derivatives is their uncertainty.
Different errors are independent and add in squares.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tank2sim.identification.captive.equations import CampaignEquations, campaign_equations
from tank2sim.identification.captive.harmonics import ReducedRun
from tank2sim.identification.captive.motion import CaptiveMotion
from tank2sim.identification.captive.regression import Solution, solve
from tank2sim.identification.captive.systematic import correct_delay
from tank2sim.records.campaigns import Campaign


def type_b_shifts(campaign: Campaign, used: CampaignEquations, solution: Solution) -> dict[str, dict[str, float]]:
    """Change of each term of a force (prime), with its sign, by each stated error of one standard deviation.

    `solution` is the solution of the equations `used`.
    """
    stated = campaign.uncertainty.model_dump()
    found = {}
    for source, size in stated.items():
        if not size:
            continue
        erring = with_common_error(campaign, used, source, size)
        moved = solve(erring, solution.spread).values - solution.values
        found[source] = {name: float(shift) for name, shift in zip(used.names, moved, strict=True)}
    return found


def with_common_error(campaign: Campaign, used: CampaignEquations, source: str, size: float) -> CampaignEquations:
    """The equations with an error common to the campaign.

    Parameters
    ----------
    campaign : Campaign
    used : CampaignEquations
    source : str
        A key of ``[uncertainty]``.
    size : float
        In the unit of the key.
    """
    if source == "force_delay_s":
        return correct_delay(used, size)
    changed, altered = _with_altered_data(campaign, used.runs, source, size)
    return campaign_equations(changed, altered, used.force, used.names).held(used.prior)


def _with_altered_data(
    campaign: Campaign, runs: Sequence[ReducedRun], source: str, size: float
) -> tuple[Campaign, list[ReducedRun]]:
    """Campaign and runs with an error of one standard deviation."""
    if source == "mass_relative":
        return _model(campaign, "mass_kg", 1 + size), list(runs)
    if source == "yaw_inertia_relative":
        return _model(campaign, "yaw_inertia_kgm2", 1 + size), list(runs)
    if source == "calibration_relative":
        return campaign, [_scaled(run, 1 + size) for run in runs]
    return campaign, [replace(run, motion=_erring(run.motion, source, size)) for run in runs]


def _erring(motion: CaptiveMotion, source: str, size: float) -> CaptiveMotion:
    if source == "alignment_rad":
        return motion.with_error(source, size, v_mps=motion.v_mps - motion.speed_mps * np.sin(size))
    if source == "rudder_rad":
        return motion.with_error(source, size, delta_rad=motion.delta_rad + size)
    assert source in ("speed_relative", "blockage_relative")
    return motion.with_error(source, size, speed_mps=motion.speed_mps * (1 + size))


def _model(campaign: Campaign, key: str, factor: float) -> Campaign:
    value = getattr(campaign.model, key)
    if value is None:
        return campaign
    return replace(campaign, model=campaign.model.model_copy(update={key: value * factor}))


def _scaled(run: ReducedRun, factor: float) -> ReducedRun:
    fits = {force: replace(fit, coefficients=fit.coefficients * factor) for force, fit in run.fits.items()}
    return replace(run, fits=fits)
