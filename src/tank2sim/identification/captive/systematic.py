"""Systematic errors that a campaign shows: forces that lag the motion, a gauge in error in one kind of run.

Both are extra unknowns of the same regression. A delay tau turns every harmonic k of a force by k omega tau: with the
known inertia of the body the damping then seems to change with omega^2, and the added mass by a constant. What
distinguishes it from memory of the flow is that its phase grows linearly with the frequency and is common to all
channels: to Y and N, to sway and yaw, and to the share of the force that is the body's known inertia, which has no
memory. A delay that sway and yaw both show is taken out, and its standard error goes into the derivatives. A gauge that
reads more in one kind of run gives derivatives that differ from all other kinds of run. Other errors are not
corrected: they are reported first, and the effect of their correction is added to the standard errors.

Errors that the campaign states (Type B, ITTC 7.5-02-06-04) are common to all its runs, whose scatter does not show
them. Each is propagated by applying it and solving again: the change of the derivatives is their uncertainty. Different
errors are independent and add in squares.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from tank2sim.arrays import Array
from tank2sim.identification.captive.equations import CampaignEquations, campaign_equations
from tank2sim.identification.captive.harmonics import ReducedRun
from tank2sim.identification.captive.motion import CaptiveMotion
from tank2sim.identification.captive.oscillation import distinct
from tank2sim.identification.captive.regression import Solution, Spread, fitted_spread, moved_terms, solve
from tank2sim.identification.conditioning import SINGULAR_CONDITION
from tank2sim.records.campaign_form import OSCILLATING
from tank2sim.records.campaigns import Campaign

_SHOWN = 4.0
"""Standard errors of a reported error: with some 20 possible errors, chance exceeds it in one of 800 campaigns."""
LEAST_PHASE_RAD = 0.003
"""Least reported phase of a delay at the fastest oscillation. A project choice: 0.003 of the damping
force is then in the added mass, a third of a percent."""
_LEAST_GAIN = 0.02
"""Least reported relative error of a gauge in one kind of run. A project choice: gauges are calibrated to 0.1 to 1 %,
and the misfit of (3.8) is of that size."""
VISIBLE_GAIN = 0.1
"""Relative error of a gauge that the runs of a kind must be able to show, or a finding states that they cannot. A
project choice: poor gauges err by some percent."""
_SUSPECT = 2.0
"""Standard errors from which a gain is estimated again with its own scatter."""
_AS_WELL = 2.0
"""Difference of two ratios to the standard error within which either kind of run may be in error."""
_ALIKE = 1e-3
"""Probability of the scatter of delays below which they are not a common delay but memory of the flow."""
_NEARLY = 0.2
"""Relative difference of delays in different runs that still count as a common delay: the accuracy of (3.8)."""
_SUPPORT = 2.0
"""Standard errors of the delay in the motion that shows it less well, from which it is not a memory of the other
motion alone: by chance once in 20 campaigns with such a memory."""
USUAL_DELAY_S = 0.03
"""Standard deviation, s, of an unknown delay: the delay of a second-order low-pass filter of 10 Hz, as
gauges of tanks have, is 0.02 to 0.03 s. Project choice; it bounds the uncertainty where the runs hardly show it."""
_ITERATIONS = 4
_MOTIONS = {"sway": ("pure_sway",), "yaw": ("pure_yaw", "yaw_with_drift")}


@dataclass(frozen=True, kw_only=True)
class SystematicError:
    """An error common to many runs."""

    source: str  # ``force_delay``, or ``gain of Y in static_drift``
    force: str  # The gauges concerned: ``Y``, ``N``, or ``XYN``
    runs: str  # Type of the runs concerned; empty for all oscillating runs
    # `size`, `standard_error`: Delay in s, positive if the forces lag the motion; relative gain, positive if the gauge
    # reads too much
    size: float
    standard_error: float
    or_runs: tuple[str, ...] = ()  # Other types of run whose error would explain the data nearly as well
    corrected: bool = False  # It is taken out of the results, and only its standard error is left in theirs

    @property
    def message(self) -> str:
        """The error, its effect and its remedy, in a sentence."""
        if self.corrected:
            return (
                f"The forces lag the motion by {self.size:.4g} ± {self.standard_error:.2g} s, alike in sway and yaw: "
                "CORRECTED in these results, and its standard error is in theirs. Check filters and clocks; [test] "
                f"force_delay_s = {self.size:.4g} with [uncertainty] force_delay_s states it."
            )
        if self.source == "force_delay":
            gauges = "The forces lag" if self.force == "XYN" else f"The {self.force} gauge lags"
            remedy = (
                f"give [test] force_delay_s = {self.size:.4g} and [uncertainty] force_delay_s = "
                f"{self.standard_error:.2g} to correct it"
                if self.force == "XYN"
                else "shift its column in time"
            )
            return (
                f"{gauges} the motion by {self.size:.4g} ± {self.standard_error:.2g} s: added masses and inertias are "
                f"wrong by the damping times that. Check filters and clocks, and {remedy}; until then the standard "
                "errors include its effect."
            )
        direction = "more" if self.size > 0 else "less"
        alternatives = f" (or the runs of {', '.join(self.or_runs)} err)" if self.or_runs else ""
        return (
            f"The {self.force} gauge reads {100 * abs(self.size):.2g} ± {100 * self.standard_error:.1g} % {direction} "
            f"in runs of {self.runs} than all other kinds of run imply{alternatives}: check its calibration there; "
            "until then the standard errors include its effect."
        )

    def shifts(self, equations: CampaignEquations, solution: Solution) -> dict[str, float]:
        """Change of each term of a force (prime) by a correction of the error."""
        if equations.force not in self.force:
            return {}
        size = self.standard_error if self.corrected else self.size
        corrected = _correct_gain(equations, self.runs, size) if self.runs else correct_delay(equations, size)
        return moved_terms(corrected, solution)


@dataclass(frozen=True, kw_only=True)
class ChannelDelay:
    """The delay of one gauge behind one motion, s: ``force`` is ``Y`` or ``N``, ``motion`` ``sway`` or ``yaw``."""

    force: str
    motion: str
    size: float
    standard_error: float


@dataclass(frozen=True, kw_only=True)
class DelayEstimate:
    """The delay of the forces behind the motion by all channels that show it."""

    # `size`, `standard_error`: Weighted mean of the channels, s, positive if the forces lag
    size: float
    standard_error: float
    channels: tuple[ChannelDelay, ...]  # Gauges and motions
    chance: float  # Probability of so large a scatter of the channels about one common delay
    alike: bool  # The channels have one delay; if not, they differ as memory of the flow does
    supported: bool  # Sway and yaw show it each by itself: it is not the memory of one of the motions
    corrected: bool = False  # It is taken out of the results

    @property
    def possible_s(self) -> float:
        """Root mean square of the delay that may be left, s, if it is not corrected, and is as delays usually are."""
        weight = USUAL_DELAY_S**2 / (USUAL_DELAY_S**2 + self.standard_error**2)
        return math.hypot(weight * self.size, math.sqrt(weight) * self.standard_error)


def delay_estimate(forces: Mapping[str, CampaignEquations]) -> DelayEstimate | None:
    """The common delay by oscillations at several frequencies; None if there are none.

    `forces`: ``Y`` and ``N`` to their equations, without trends with frequency, which would absorb the delay.
    """
    channels = tuple(
        ChannelDelay(force=force, motion=motion, size=size, standard_error=error)
        for force, used in forces.items()
        if force in "YN"
        for motion, (size, error) in _delays(used).items()
    )
    if not channels:
        return None
    mean = _mean_delay(channels)
    by_motion = [_mean_delay(group) for group in _grouped(channels, "motion").values()]
    sign = math.copysign(1.0, mean.size)
    return DelayEstimate(
        size=mean.size,
        standard_error=mean.standard_error,
        channels=channels,
        chance=mean.chance,
        alike=mean.alike,
        supported=len(by_motion) > 1 and all(sign * one.size > _SUPPORT * one.standard_error for one in by_motion),
    )


def force_delays(
    forces: Mapping[str, CampaignEquations], estimate: DelayEstimate | None
) -> tuple[SystematicError, ...]:
    """The delay of all gauges behind the motion, or of one, that oscillations at several frequencies show.

    `forces`: As :func:`delay_estimate` has them; `estimate`: The common delay.
    """
    if estimate is None:
        return ()
    fastest = max((run.motion.frequency_radps for used in forces.values() for run in used.runs), default=0.0)
    least_s, found = LEAST_PHASE_RAD / max(fastest, 1e-12), _grouped(estimate.channels, "force")
    shown = {force: mean for force, delays in found.items() if (mean := _mean_delay(delays)).significant(least_s)}
    of_all = _mean_delay(estimate.channels)
    if not of_all.significant(least_s) and len(shown) > 1:
        of_all = _mean_delay([*shown.values()])
    if of_all.significant(least_s) and len(found) > 1:
        return (_force_delay("XYN", of_all, corrected=estimate.supported),)
    return tuple(_force_delay(force, mean) for force, mean in shown.items() if len(found[force]) > 1)


def _force_delay(force: str, mean: _MeanDelay, *, corrected: bool = False) -> SystematicError:
    return SystematicError(
        source="force_delay",
        force=force,
        runs="",
        size=mean.size,
        standard_error=mean.standard_error,
        corrected=corrected,
    )


def _grouped(channels: Sequence[ChannelDelay], by: Literal["force", "motion"]) -> dict[str, list[ChannelDelay]]:
    groups: dict[str, list[ChannelDelay]] = {}
    for channel in channels:
        groups.setdefault(getattr(channel, by), []).append(channel)
    return groups


def can_show_delay(runs: Sequence[ReducedRun]) -> bool:
    """True if a kind of oscillation was made at two frequencies."""
    return any(_several_frequencies(runs, kinds) for kinds in _MOTIONS.values())


def gauge_gains(
    equations: CampaignEquations, spread: Spread, rival: float
) -> tuple[tuple[SystematicError, ...], tuple[str, ...]]:
    """The kind of run in which a gauge departs most from the prediction of all other kinds, if any; and the kinds that
    cannot be checked, because no other kind gives their derivatives.

    `equations`: Without trends with frequency; `spread`: Spread of the runs within each kind; `rival`: Largest ratio of
    a trend with frequency to its standard error: a gain must explain the runs better.
    """
    # The gauge's coefficients as predicted by the derivatives, without noise.
    predicted = equations.gauge - (equations.values - equations.design @ solve(equations, spread).values)
    kinds = _kind_of_row(equations)
    gains: dict[str, tuple[float, float]] = {}
    unknown = []
    for kind in dict.fromkeys(kinds.tolist()):
        solution = _with_gain(equations, np.where(kinds == kind, predicted, 0.0), spread)
        size, error = solution.value("gain"), solution.error("gain")
        if solution.condition > SINGULAR_CONDITION or _SHOWN * error > VISIBLE_GAIN:
            unknown.append(kind)
        elif abs(size) > max(_SHOWN * error, rival * error, _LEAST_GAIN):
            gains[kind] = size, error
    if not gains:
        return (), tuple(unknown)
    ratios = {kind: abs(size) / error for kind, (size, error) in gains.items()}  # in standard errors
    worst = max(ratios, key=lambda kind: ratios[kind])
    found = SystematicError(
        source=f"gain of {equations.force} in {worst}",
        force=equations.force,
        runs=worst,
        size=gains[worst][0],
        standard_error=gains[worst][1],
        or_runs=tuple(kind for kind in gains if kind != worst and ratios[worst] - ratios[kind] < _AS_WELL),
    )
    return (found,), tuple(unknown)


def _with_gain(equations: CampaignEquations, predicted: Array, spread: Spread) -> Solution:
    """The solution with an unknown gain of the forces (rows,) that are predicted for a kind of run."""
    joined = _with_unknowns(equations, {"gain": predicted})
    solution = solve(joined, spread)
    suspect = abs(solution.value("gain")) > max(_LEAST_GAIN, _SUSPECT * solution.error("gain"))
    # The scatter within kinds still includes the effect of the gauge: estimate it together with the gain.
    again = suspect and solution.condition < SINGULAR_CONDITION
    return solve(joined, fitted_spread(joined, by_type=False)) if again else solution


def correct_delay(
    equations: CampaignEquations, delay_s: float, kinds: Sequence[str] = OSCILLATING
) -> CampaignEquations:
    """The equations with the forces of the oscillating runs of some `kinds` corrected for a delay."""
    change = np.zeros_like(equations.gauge)
    for rows, run, root in _runs_of(equations, kinds):
        turn = _phase_shift(len(root), run.motion.frequency_radps * delay_s)
        change[rows] = np.linalg.solve(root, turn @ root @ equations.gauge[rows]) - equations.gauge[rows]
    return replace(equations, values=equations.values + change, gauge=equations.gauge + change)


def _correct_gain(equations: CampaignEquations, kind: str, gain: float) -> CampaignEquations:
    """The equations with the gauge's gain corrected in one kind of run."""
    change = np.where(_kind_of_row(equations) == kind, -gain / (1.0 + gain) * equations.gauge, 0.0)
    return replace(equations, values=equations.values + change, gauge=equations.gauge + change)


def _kind_of_row(equations: CampaignEquations) -> NDArray[np.str_]:
    return np.array([run.run.type for run in equations.runs])[equations.run_of_row]


class _MeanDelay(NamedTuple):
    """Weighted mean of delays, s, the probability of their scatter, and whether they are one delay."""

    size: float
    standard_error: float
    chance: float
    alike: bool

    def significant(self, least_s: float) -> bool:
        """Whether it is one delay, not zero, and of `least_s` at least."""
        return self.alike and abs(self.size) >= max(_SHOWN * self.standard_error, least_s)


def _mean_delay(delays: Sequence[ChannelDelay] | Sequence[_MeanDelay]) -> _MeanDelay:
    values, errors = (np.array([getattr(delay, key) for delay in delays]) for key in ("size", "standard_error"))
    weights = np.array([error**-2.0 for error in errors.tolist()])
    mean, error = float(weights @ values / weights.sum()), float(weights.sum() ** -0.5)
    chance = float(chdtrc(len(values) - 1, weights @ (values - mean) ** 2)) if len(values) > 1 else 1.0
    apart = np.abs(values - mean) > np.maximum(_SHOWN * errors, _NEARLY * abs(mean))
    return _MeanDelay(mean, error, chance, chance >= _ALIKE or not apart.any())


def _delays(equations: CampaignEquations) -> dict[str, tuple[float, float]]:
    """The delay of one gauge in runs of sway alone and in runs of yaw alone, where they determine it."""
    motions = {motion: kinds for motion, kinds in _MOTIONS.items() if _several_frequencies(equations.runs, kinds)}
    if not motions:
        return {}
    # Without the prior: it scales with the linear terms, which a long delay reduces to zero.
    free = equations.held({})
    found, errors = _iterated_delays(free, motions, dict.fromkeys(motions, 0.0))
    if any(abs(delay) > _SHOWN * errors[motion] for motion, delay in found.items()):
        # The spread of the uncorrected forces includes the delay.
        found, errors = _iterated_delays(free, motions, found)
    return {motion: (found[motion], errors[motion]) for motion in motions}


def _iterated_delays(
    free: CampaignEquations, motions: Mapping[str, Sequence[str]], found: Mapping[str, float]
) -> tuple[dict[str, float], dict[str, float]]:
    """Delays of motions and their standard errors, s, from first ones, with the spread that these leave."""
    found, spread = dict(found), None
    for _ in range(_ITERATIONS):
        joined = _with_slopes(free, motions, found)
        spread = spread or fitted_spread(joined, by_type=False)
        solution = solve(joined, spread)
        steps = {motion: solution.value(motion) for motion in motions}
        found = {motion: delay + steps[motion] for motion, delay in found.items()}
        if all(abs(step) < 0.1 * solution.error(motion) for motion, step in steps.items()):
            break
    return found, {motion: solution.error(motion) for motion in motions}


def _several_frequencies(runs: Sequence[ReducedRun], kinds: Sequence[str]) -> bool:
    return distinct([run.motion.frequency_radps for run in runs if run.run.type in kinds]) > 1


def _with_slopes(
    equations: CampaignEquations, motions: Mapping[str, Sequence[str]], delays: Mapping[str, float]
) -> CampaignEquations:
    """The equations corrected for a delay of each motion, with a small further delay of each as unknown."""
    for motion, kinds in motions.items():
        equations = correct_delay(equations, delays[motion], kinds)
    return _with_unknowns(equations, {motion: _slope(equations, kinds) for motion, kinds in motions.items()})


def _slope(equations: CampaignEquations, kinds: Sequence[str]) -> Array:
    """Effect on the equations of a gauge delay of 1 s in some kinds of run: minus the rate of change, (rows,)."""
    column = np.zeros_like(equations.gauge)
    for rows, run, root in _runs_of(equations, kinds):
        rate = _rate(len(root), run.motion.frequency_radps)
        column[rows] = -np.linalg.solve(root, rate @ root @ equations.gauge[rows])
    return column


def _runs_of(equations: CampaignEquations, kinds: Sequence[str]) -> Iterator[tuple[slice, ReducedRun, Array]]:
    for rows, run, root in zip(equations.rows, equations.runs, equations.roots, strict=True):
        if run.run.type in kinds:
            yield rows, run, root


def _rate(count: int, frequency_radps: float) -> Array:
    """Matrix from mean and harmonics (count,) of a force to its rate of change."""
    matrix = np.zeros((count, count))
    for place in range(1, count, 2):
        order = (place + 1) // 2
        matrix[place, place + 1], matrix[place + 1, place] = order * frequency_radps, -order * frequency_radps
    return matrix


def _phase_shift(count: int, phase_rad: float) -> Array:
    """Matrix from mean and harmonics (count,) of a force to those a phase later; harmonic k turns by k phases."""
    matrix = np.eye(count)
    for place in range(1, count, 2):
        angle = (place + 1) // 2 * phase_rad
        both = slice(place, place + 2)
        matrix[both, both] = [[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]]
    return matrix


def _with_unknowns(equations: CampaignEquations, columns: Mapping[str, Array]) -> CampaignEquations:
    """The equations with further unknowns."""
    return replace(
        equations,
        names=(*equations.names, *columns),
        design=np.column_stack([equations.design, *columns.values()]),
    )


_SMALL_RAD = 1e-4
"""Turn by which the slope is found: far below any angle that matters, far above rounding."""
_SAME_ANGLE = 0.01
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
    campaign: Campaign, solved: Mapping[str, tuple[CampaignEquations, Solution]]
) -> AlignmentEstimate | None:
    """The zero of the drift angle by the side force and moment at zero drift; None without Y0, Yv, N0 or Nv.

    A symmetric model that is turned by a small angle eps against the recorded drift has Y0 = -Yv eps and N0 = -Nv eps,
    and terms such as Yvrr eps r^2 that the regression takes for more of both: their size is found by turning the
    recorded drift and solving again. Y0 and N0 then give the same angle. A single screw or a bent hull has another
    ratio of Y0 and N0, except by chance.

    `solved`: ``Y`` and ``N`` to the equations of that force and their solution.
    """
    found: dict[str, tuple[float, float]] = {}
    for force in "YN":
        (equations, solution), zero = solved[force], f"{force}0"
        if not {zero, f"{force}v"} <= set(solution.names):
            return None
        turned = with_common_error(campaign, equations, "alignment_rad", _SMALL_RAD)
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
        shown=bool(abs(mean) > _SHOWN * error and chance > _SAME_ANGLE),
    )
