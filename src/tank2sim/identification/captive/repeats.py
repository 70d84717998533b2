"""Repeated runs: the direct measure of the scatter of a run."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from tank2sim.cards.scaling import Scales
from tank2sim.identification.captive.harmonics import ReducedRun
from tank2sim.records.campaigns import FORCE_COLUMNS, Campaign

_ANGLE_RAD = math.radians(0.2)
_RELATIVE = 0.02


@dataclass(frozen=True, kw_only=True)
class Repeats:
    """Repeats of one campaign.

    Parameters
    ----------
    groups : tuple of tuple of str
        Names of the runs of the same test.
    deviation : mapping
        Force to the standard deviation of a run's mean within the groups, prime.
    freedom : int
        Degrees of freedom of the deviations.
    """

    groups: tuple[tuple[str, ...], ...]
    deviation: Mapping[str, float]
    freedom: int


def repeats(campaign: Campaign, runs: Sequence[ReducedRun]) -> Repeats | None:
    """The repeats of a campaign; None without a repeated test."""
    together: dict[tuple[object, ...], list[ReducedRun]] = defaultdict(list)
    for run in runs:
        together[_test(campaign, run)].append(run)
    groups = [group for group in together.values() if len(group) > 1]
    if not groups:
        return None
    freedom = sum(len(group) - 1 for group in groups)
    deviation = {}
    for force in FORCE_COLUMNS:
        total = 0.0
        for group in groups:
            means = [_mean(campaign, run, force) for run in group]
            centre = sum(means) / len(means)
            total += sum((mean - centre) ** 2 for mean in means)
        deviation[force] = math.sqrt(total / freedom)
    return Repeats(
        groups=tuple(tuple(run.run.name for run in group) for group in groups), deviation=deviation, freedom=freedom
    )


def _test(campaign: Campaign, run: ReducedRun) -> tuple[object, ...]:
    """Key of a test: measured steady angles, yaw rate, heel and speed, or frequency and amplitude."""
    motion, length = run.motion, campaign.model.length_m
    speed = motion.mean_speed_mps
    drift = round(math.asin(max(-1.0, min(1.0, -float(motion.v_mps.mean()) / speed))) / _ANGLE_RAD)
    rudder = round(float(motion.delta_rad.mean()) / _ANGLE_RAD)
    turn = round(float(motion.r_radps.mean()) * length / speed / _RELATIVE)
    steps = [speed / campaign.test.speed_mps]
    if run.run.oscillates:
        swing = motion.amplitude(motion.v_mps if run.run.type == "pure_sway" else motion.r_radps * length) / speed
        steps += [motion.frequency_radps * length / speed, swing]
    heel = round(motion.heel_rad / _ANGLE_RAD)
    return (
        run.run.oscillates,
        drift,
        rudder,
        turn,
        heel,
        *(round(math.log(step) / _RELATIVE) for step in steps if step > 0),
    )


def _mean(campaign: Campaign, run: ReducedRun, force: str) -> float:
    scales = Scales(campaign.test.water_density_kgpm3, campaign.model.length_m, run.motion.mean_speed_mps)
    unit = scales.force * (scales.length if force == "N" else 1.0)
    return float(run.fits[force].coefficients[0] / unit)
