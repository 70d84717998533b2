"""Consistency of a campaign: runs that contradict all others, repeated runs, and the symmetry of the hull."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc

from tank2sim.cards.terms import known_term
from tank2sim.errors import InputError
from tank2sim.identification.captive.equations import campaign_equations, excited
from tank2sim.identification.captive.harmonics import ReducedRun
from tank2sim.identification.captive.regression import LeftOut, Spread, leave_one_out, solve
from tank2sim.identification.captive.selection import Selection, distinguishable_equations, usual_zero, with_prior
from tank2sim.identification.conditioning import COLLINEAR
from tank2sim.records.campaign_form import OSCILLATING
from tank2sim.records.campaigns import Campaign
from tank2sim.records.captive_record import FORCE_COLUMNS

_TIMES_USUAL = 8.0
"""Least misfit of a contradicted run, in those usual in the campaign. Sound runs of synthetic campaigns reach 6 with
noise; a gauge in kN or of the wrong sign gives 20 and more."""
_SHARE = 0.5
"""Least misfit of a contradicted run as a share of its force. Noise-free campaigns, in which 8 times the usual
misfit is negligible, stay far below, and gauges coarse by 8 times the noise below 0.4; a wrong sign gives 2 (0.8 with
the inertia of the body), a dead gauge or kN 1 (0.6)."""
_SMALL = 0.05
"""Share of the largest force in runs of its type below which the force of a run does not serve as a scale."""
_FEWEST = 8
"""Least number of runs that define the usual misfit."""

_EVEN = "vv rr dd vr vd rd".split()
_OPPOSITE_PARITY = {"X": "v r d vvv rrr ddd".split(), "Y": _EVEN, "N": _EVEN}


def contradicted(campaign: Campaign, runs: Sequence[ReducedRun]) -> dict[str, InputError]:
    """Name to fault of the runs that grossly contradict the others in some force.

    A dead gauge with noise, or a wrong unit or sign in a single run, distorts the least squares of the whole campaign,
    and its small scatter may even give it the greatest weight. Therefore each run is compared with the others at equal
    weights, and the worst is removed before the next comparison.
    """
    found: dict[str, InputError] = {}
    for force in FORCE_COLUMNS:
        remaining = list(runs)
        while (worst := _worst(campaign, remaining, force)) is not None:
            row, times, share = worst
            remaining = [run for run in remaining if run.run.name != row.run]
            difference = "harmonics differ" if row.type in OSCILLATING else "mean differs"
            problem = (
                f"contradicts the other runs: its {difference} from their prediction by {100 * share:.0f} % of the "
                f"force, {times:.0f} times the usual difference"
            )
            remedy = "check for a dead gauge, or for a unit or sign that differs from the other runs"
            found.setdefault(row.run, InputError(row.run, f"gauge {force}", problem, remedy))
    return found


def _worst(campaign: Campaign, runs: Sequence[ReducedRun], force: str) -> tuple[LeftOut, float, float] | None:
    """The run that contradicts the others most, its misfit over the usual one, and its misfit over its force."""
    if len(runs) < _FEWEST:
        return None
    full = distinguishable_equations(campaign, _levelled(runs, force), force, {})
    spread = Spread(1.0, usual_zero(full))
    rows = leave_one_out(with_prior(full, spread), spread)
    if len(rows) < _FEWEST:
        return None
    usual = max(float(np.median([row.misfit for row in rows])), 1e-300)
    largest: dict[str, float] = {}
    for row in rows:
        largest[row.type] = max(row.size, largest.get(row.type, 0.0))
    judged = [(row, row.misfit / usual, row.gap / max(row.size, _SMALL * largest[row.type], 1e-300)) for row in rows]
    gross = [found for found in judged if found[1] > _TIMES_USUAL and found[2] > _SHARE]
    return max(gross, key=lambda found: found[1], default=None)


def _levelled(runs: Sequence[ReducedRun], force: str) -> list[ReducedRun]:
    """The runs with the campaign's median noise, because small scatter does not make a run more credible."""
    usual = float(np.median(np.concatenate([run.fits[force].density for run in runs])))
    return [run.with_density(force, np.full_like(run.fits[force].density, usual)) for run in runs]


@dataclass(frozen=True, kw_only=True)
class Asymmetry:
    """Test of the symmetry of (3.8) for one force."""

    names: tuple[str, ...]  # Terms of the opposite parity that the campaign excites
    # `values`, `standard_errors`: Prime, with all of them in addition to the terms of the result
    values: tuple[float, ...]
    standard_errors: tuple[float, ...]
    # Probability of values as large as these together if the symmetry holds (Wald's test); 1 without terms
    chance: float


def asymmetry(campaign: Campaign, selection: Selection) -> Asymmetry:
    """Terms of the opposite parity in addition to the result's.

    By the symmetry of a hull to port and starboard X has even terms and Y, N odd ones, except for Y0, N0 and their
    change with speed, which (3.8) has for a single screw. Terms of the opposite parity are not part of a card; the test
    shows that they are small.
    """
    force, runs = selection.equations.force, selection.equations.runs
    kept, prior = selection.equations.names, selection.equations.prior
    excited_terms: list[str] = []
    for powers in _OPPOSITE_PARITY[force]:
        term = known_term(force + powers)
        if not excited(campaign, runs, term):
            continue
        trial = campaign_equations(campaign, runs, force, [*kept, *excited_terms, term.name]).held(prior)
        if solve(trial, selection.spread).condition <= COLLINEAR:
            excited_terms.append(term.name)
    if not excited_terms:
        return Asymmetry(names=(), values=(), standard_errors=(), chance=1.0)
    solution = solve(campaign_equations(campaign, runs, force, [*kept, *excited_terms]).held(prior), selection.spread)
    values, covariance = solution.values[len(kept) :], solution.covariance[len(kept) :, len(kept) :]
    return Asymmetry(
        names=tuple(excited_terms),
        values=tuple(float(value) for value in values),
        standard_errors=tuple(float(error) for error in np.sqrt(np.diag(covariance))),
        chance=float(chdtrc(len(excited_terms), values @ np.linalg.solve(covariance, values))),
    )


_ANGLE_RAD = math.radians(0.2)
_RELATIVE = 0.02


@dataclass(frozen=True, kw_only=True)
class Repeats:
    """Repeats of one campaign."""

    groups: tuple[tuple[str, ...], ...]  # Names of the runs of the same test
    deviation: Mapping[str, float]  # Force to the standard deviation of a run's mean within the groups, prime
    freedom: int  # Degrees of freedom of the deviations


def repeats(campaign: Campaign, runs: Sequence[ReducedRun]) -> Repeats | None:
    """The repeats of a campaign; None without a repeated test."""
    together: dict[tuple[object, ...], list[ReducedRun]] = defaultdict(list)
    for run in runs:
        together[_test(campaign, run)].append(run)
    groups = [group for group in together.values() if len(group) > 1]
    if not groups:
        return None
    freedom = sum(map(len, groups)) - len(groups)
    squares = {force: sum(_squares(campaign, group, force) for group in groups) for force in FORCE_COLUMNS}
    return Repeats(
        groups=tuple(tuple(run.run.name for run in group) for group in groups),
        deviation={force: math.sqrt(total / freedom) for force, total in squares.items()},
        freedom=freedom,
    )


def _squares(campaign: Campaign, group: Sequence[ReducedRun], force: str) -> float:
    """Sum of squares of the runs' mean forces about their common mean, prime."""
    units = [campaign.scales_at(run.motion.mean_speed_mps).unit(force) for run in group]
    means = [float(run.fits[force].coefficients[0] / unit) for run, unit in zip(group, units, strict=True)]
    return sum((mean - sum(means) / len(means)) ** 2 for mean in means)


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
