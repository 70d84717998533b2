"""Reduction of a captive campaign to hydrodynamic derivatives with uncertainty.

Every run is reduced to mean and harmonics. Two methods then give the derivatives of (3.8): a weighted regression over
the whole campaign, which is the result, and for comparison the paper's order, from the simplest tests to the more
complex. The numbers are prime, instantaneous, "hydrodynamic", starboard-positive, expanded at the test speed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from threadpoolctl import threadpool_limits

from tank2sim.arrays import Array
from tank2sim.errors import InputError
from tank2sim.identification.captive.consistency import Asymmetry, asymmetry, contradicted
from tank2sim.identification.captive.equations import HEEL_TERMS, SPEED_RANGE
from tank2sim.identification.captive.harmonics import ReducedRun, moderated, reduced_run
from tank2sim.identification.captive.oscillation import (
    CubicByTwoWays,
    OscillationDerivatives,
    cubics,
    oscillations,
    run_frequency_parameter,
)
from tank2sim.identification.captive.regression import LeftOut, Solution, efficient_solution, leave_one_out, moved_terms
from tank2sim.identification.captive.run_faults import record_faults, reduced_faults
from tank2sim.identification.captive.selection import Selection, Trend, select, trends
from tank2sim.identification.captive.stepwise import (
    Disagreement,
    Stepwise,
    disagreements,
    scatter_within_tests,
    stepwise,
)
from tank2sim.identification.captive.systematic import (
    AlignmentEstimate,
    DelayEstimate,
    SystematicError,
    alignment_estimate,
    correct_delay,
    delay_estimate,
    force_delays,
    gauge_gains,
    type_b_shifts,
    with_common_error,
)
from tank2sim.identification.captive.tank_conditions import LARGEST_FREQUENCY_PARAMETER, impossible_body
from tank2sim.records.campaigns import Campaign, together
from tank2sim.records.captive_record import FORCE_COLUMNS

DISAGREEMENT_LIMIT = 3.5
"""Standard errors from which a difference between the methods is reported."""
THRUST_LIMIT = 4.0
"""Standard errors by which a resistance must be negative to be refused: by chance once in 30 000 campaigns."""
ESSENTIAL = ("Xudot", "Yvdot", "Yrdot", "Nvdot", "Nrdot", "Yv", "Nv", "Yr", "Nr", "Yd", "Nd")
"""Derivatives that every simulation of a manoeuvre needs."""


@dataclass(frozen=True, kw_only=True)
class ReductionOptions:
    """Options of a reduction."""

    keep_going: bool = False  # Omit runs with faults instead of refusing the campaign
    keep_fast: bool = False  # Use runs with omega U/g of 0.1 and more, too
    # Use runs away from the test speed, and at other revolutions of the propeller, too, and find terms in Du
    off_speed: bool = False
    all_terms: bool = False  # Keep terms that the tests do not determine
    test_symmetry: bool = False  # Test terms of the opposite parity, which (3.8) lacks


@dataclass(frozen=True, kw_only=True)
class Derivative:
    """A derivative (prime)."""

    # `value`, `standard_error`: ``standard_error`` combines both types
    value: float
    standard_error: float
    type_a: float  # Standard error from the scatter of the campaign
    # Source to standard error, of stated uncertainties and of systematic errors that the campaign shows
    type_b: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, eq=False, kw_only=True)
class ForceResult:
    """Result of a campaign for one force."""

    selection: Selection  # Chosen terms and equations; its ``choices`` state the decision on every candidate
    solution: Solution  # The weighted regression over the whole campaign (Type A errors)
    stepwise: Stepwise  # The paper's order
    disagreements: tuple[Disagreement, ...]  # Terms on which the two differ
    trends: tuple[Trend, ...]  # Trends with frequency, and values extrapolated to zero frequency
    left_out: tuple[LeftOut, ...]  # Each run predicted from all other runs
    asymmetry: Asymmetry | None = None  # The test of the opposite parity, on request
    systematic: tuple[SystematicError, ...] = ()  # Errors common to many runs that the campaign shows in this force
    # Types of run whose derivatives no other type gives: an error of the gauge in them alone would not show
    unchecked: tuple[str, ...] = ()
    # Error common to many runs to the change of each term (prime), with its sign, that it makes: stated errors (Type B)
    # of one standard deviation, the delay of the forces that may be left, and the full errors (delays, gains, the zero
    # of the drift angle) that the campaign shows and that are not corrected
    shifts: Mapping[str, Mapping[str, float]] = field(default_factory=dict)


@dataclass(frozen=True, eq=False, kw_only=True)
class Reduction:
    """Result of a reduction."""

    campaign: Campaign  # As read
    options: ReductionOptions  # The options used
    runs: tuple[ReducedRun, ...]  # The runs used
    not_used: Mapping[str, str]  # Name of an omitted run to the reason
    faults: tuple[InputError, ...]  # Faults of runs omitted with `keep_going`
    forces: Mapping[str, ForceResult]  # ``X``, ``Y``, ``N`` to its result
    oscillations: tuple[OscillationDerivatives, ...]
    cubics: tuple[CubicByTwoWays, ...]
    # Delay of the forces as recorded, less ``[test] force_delay_s``; None without oscillations at two frequencies
    delay: DelayEstimate | None = None
    # The zero of the drift angle by Y0 and N0; None if the campaign does not give them
    alignment: AlignmentEstimate | None = None

    @cached_property
    def derivatives(self) -> dict[str, Derivative]:
        """Derivatives by name."""
        return {name: found for result in self.forces.values() for name, found in _derivatives(result).items()}

    @property
    def missing(self) -> tuple[str, ...]:
        """Names in :data:`ESSENTIAL` that the campaign does not give."""
        return tuple(name for name in ESSENTIAL if name not in self.derivatives)

    @property
    def systematic(self) -> tuple[SystematicError, ...]:
        """Errors common to many runs that the campaign shows, each once."""
        return tuple(dict.fromkeys(error for result in self.forces.values() for error in result.systematic))


def reduce_campaign(campaign: Campaign, options: ReductionOptions | None = None) -> Reduction:
    """Derivatives from a campaign.

    Raises InputError: Runs have faults without `keep_going` (all are reported), no run remains, a necessary key is
    missing, or a number of ``[model]`` or the sign of the resistance is impossible.
    """
    with threadpool_limits(limits=1, user_api="blas"):  # several threads take four times as long
        return _reduction(campaign, options or ReductionOptions())


def _reduction(campaign: Campaign, options: ReductionOptions) -> Reduction:
    """Derivatives from a campaign, on one thread."""
    _refuse_impossible_body(campaign)
    runs, faults = _credible_runs(campaign, options)
    used, not_used, selections = _selections(campaign, runs, faults, options)
    equations = {force: selection.equations for force, selection in selections.items()}
    delay = delay_estimate(equations)
    delays = force_delays(equations, delay)
    if any(error.corrected for error in delays):  # the forces of oscillating runs are taken a time earlier
        runs = [_with_later_forces(run, delays[0].size) for run in runs]
        used, not_used, selections = _selections(campaign, runs, faults, options)
    forces = {force: _force_result(campaign, selection, delays, options) for force, selection in selections.items()}
    solved = {force: (result.selection.equations, result.solution) for force, result in forces.items()}
    alignment = alignment_estimate(campaign, solved)
    forces = _with_common_shifts(campaign, forces, None if delays else delay, alignment)
    alone = oscillations(campaign, runs)
    reduction = Reduction(
        campaign=campaign,
        options=options,
        runs=tuple(used),
        not_used=not_used,
        faults=(*campaign.faults, *faults),
        forces=forces,
        oscillations=alone,
        cubics=cubics([row for row in alone if row.run not in not_used]),
        delay=delay,
        alignment=alignment,
    )
    _refuse_thrust(reduction)
    return reduction


def _with_common_shifts(
    campaign: Campaign,
    forces: Mapping[str, ForceResult],
    delay: DelayEstimate | None,
    alignment: AlignmentEstimate | None,
) -> dict[str, ForceResult]:
    """The results with the shifts by a delay and a misalignment whose errors the campaign does not state."""
    stated = campaign.uncertainty.model_fields_set
    delay_s = delay.possible_s if delay and delay.alike and "force_delay_s" not in stated else 0.0
    angle_rad = alignment.angle_rad if alignment and alignment.shown and "alignment_rad" not in stated else 0.0
    return {
        force: replace(result, shifts=_common_shifts(campaign, result, delay_s, angle_rad))
        for force, result in forces.items()
    }


def _with_later_forces(run: ReducedRun, later_s: float) -> ReducedRun:
    """An oscillating run reduced again with its forces delayed by `later_s` more; any other run as it is."""
    if not run.run.oscillates:
        return run
    return reduced_run(replace(run.run, force_delay_s=run.run.force_delay_s + later_s))


def _selections(
    campaign: Campaign, runs: Sequence[ReducedRun], faults: Sequence[InputError], options: ReductionOptions
) -> tuple[list[ReducedRun], dict[str, str], dict[str, Selection]]:
    """The runs used, the reasons of the others, and the selection of each force; refused without a run."""
    used, not_used = _used_runs(campaign, moderated(runs), options)
    if not used:
        left_out = [*map(str, faults), *(f"{name}, for {why}" for name, why in not_used.items())]
        remedy = f"the first was left out: {left_out[0]}" if left_out else "give it runs"
        raise InputError(campaign.path, "runs", "no run can be used", remedy)
    all_terms = options.all_terms
    return used, not_used, {force: select(campaign, used, force, all_terms=all_terms) for force in FORCE_COLUMNS}


def _refuse_impossible_body(campaign: Campaign) -> None:
    for key, problem in impossible_body(campaign.model, campaign.test.water_density_kgpm3):
        raise InputError(campaign.path, f"model.{key}", problem, "correct the unit of one of these numbers")


def _refuse_thrust(reduction: Reduction) -> None:
    """Refuse a towed model that the water pushes ahead: its X gauge is reversed."""
    campaign, derivatives = reduction.campaign, reduction.derivatives
    found = derivatives.get("X0")
    reversed_forces = "Yvdot" in derivatives and derivatives["Yvdot"].value > 0
    if found is None or not is_resistance(campaign) or reversed_forces:
        return
    if found.value > THRUST_LIMIT * found.standard_error:
        problem = (
            f"shows X0 = {found.value:+.3g} ± {found.standard_error:.2g}: the water would push the model ahead, and no "
            "propeller works"
        )
        remedy = "change the sign of the X columns; if its propeller worked, give [test] propeller_rps"
        raise InputError(campaign.path, "gauge X", problem, remedy)


def _credible_runs(campaign: Campaign, options: ReductionOptions) -> tuple[list[ReducedRun], list[InputError]]:
    """Runs without faults that do not contradict the others, and the faults; raised without `keep_going`."""
    runs, faults = _sound_runs(campaign)
    if faults and not options.keep_going:
        raise together(faults)
    odd = contradicted(campaign, _used_runs(campaign, runs, options)[0])
    faults += odd.values()
    if odd and not options.keep_going:
        raise together(faults)
    return [run for run in runs if run.run.name not in odd], faults


def _sound_runs(campaign: Campaign) -> tuple[list[ReducedRun], list[InputError]]:
    runs: list[ReducedRun] = []
    faults: list[InputError] = []
    for run in campaign.runs:
        found = list(record_faults(campaign, run))
        if not found:
            try:
                reduced = reduced_run(run)
                found = list(reduced_faults(reduced))
            except InputError as fault:
                found = [fault]
        if found:
            faults.append(found[0])
        else:
            runs.append(reduced)
    return runs, faults


def _used_runs(
    campaign: Campaign, runs: Sequence[ReducedRun], options: ReductionOptions
) -> tuple[list[ReducedRun], dict[str, str]]:
    # Most runs have these revolutions: the polynomial has no term in them, and load-variation tests have others.
    usual = float(np.median([run.propeller_radps or 0.0 for run in campaign.runs]))
    reasons = {run.run.name: _why_not_used(campaign, run, usual, options) for run in runs}
    not_used = {name: reason for name, reason in reasons.items() if reason}
    return [run for run in runs if run.run.name not in not_used], not_used


def _why_not_used(campaign: Campaign, run: ReducedRun, usual_radps: float, options: ReductionOptions) -> str:
    """Why a run is of another kind than the campaign; empty if it is used."""
    turning = run.run.propeller_radps or 0.0
    speed, fast = run.motion.mean_speed_mps, run_frequency_parameter(campaign, run)
    if fast >= LARGEST_FREQUENCY_PARAMETER and not options.keep_fast:
        return f"omega U/g is {fast:.3g}, and coefficients fall steeply from {LARGEST_FREQUENCY_PARAMETER:g} on"
    if abs(speed / campaign.test.speed_mps - 1) > SPEED_RANGE and not options.off_speed:
        return f"its speed is {speed:.4g} m/s, and the test speed {campaign.test.speed_mps:.4g}"
    if abs(turning - usual_radps) > SPEED_RANGE * usual_radps and not options.off_speed:
        found, nominal = (f"{radps * 60 / (2 * np.pi):.4g}" for radps in (turning, usual_radps))
        return f"its rate of revolution is {found} rpm, and most others have {nominal} rpm"
    return ""


def _force_result(
    campaign: Campaign, selected: Selection, delays: Sequence[SystematicError], options: ReductionOptions
) -> ForceResult:
    selection, found = trends(campaign, selected)
    solution = selection.solution
    unchecked: tuple[str, ...] = ()
    systematic = tuple(delay for delay in delays if selection.equations.force in delay.force)
    if all(error.corrected for error in systematic):
        rival = max((abs(trend.slope) / trend.standard_error for trend in found), default=0.0)
        gains, unchecked = gauge_gains(selected.equations, scatter_within_tests(selected.equations), rival)
        systematic = (*systematic, *gains)
    within = scatter_within_tests(selection.equations)
    steps = stepwise(selection.equations, within, campaign.test.speed_mps)
    together = efficient_solution(selection.equations, within)
    return ForceResult(
        selection=selection,
        solution=solution,
        stepwise=steps,
        # With terms in Du the steps at the test speed, which lack them, do not estimate the same numbers: Du acts by
        # u = U cos(beta) in their drift tests, too.
        disagreements=()
        if options.off_speed
        else disagreements(steps, together, selection.reported, DISAGREEMENT_LIMIT),
        trends=found,
        left_out=leave_one_out(selection.equations, selection.spread),
        asymmetry=asymmetry(campaign, selection) if options.test_symmetry else None,
        systematic=systematic,
        unchecked=unchecked,
    )


def _derivatives(result: ForceResult) -> dict[str, Derivative]:
    """Reported derivatives; a trend with frequency is none."""
    solution, found = result.solution, {}
    for name, value, error in zip(solution.names, solution.values, solution.standard_errors, strict=True):
        if name not in result.selection.reported or " " in name:
            continue
        type_b = {source: abs(shifts.get(name, 0.0)) for source, shifts in result.shifts.items()}
        found[name] = Derivative(
            value=float(value),
            standard_error=float(np.sqrt(error**2 + sum(size**2 for size in type_b.values()))),
            type_a=float(error),
            type_b=type_b,
        )
    return found


def _common_shifts(
    campaign: Campaign, result: ForceResult, delay_s: float, alignment_rad: float
) -> dict[str, dict[str, float]]:
    """As :attr:`ForceResult.shifts`; the delay and the angle are 0 where they are stated, corrected or unknown."""
    used, solution = result.selection.equations, result.solution
    shown = {error.source: error.shifts(used, solution) for error in result.systematic}
    if delay_s:
        shown["force_delay"] = moved_terms(correct_delay(used, delay_s), solution)
    if alignment_rad:
        turned = with_common_error(campaign, used, "alignment_rad", alignment_rad)
        shown["alignment"] = moved_terms(turned, solution)
    return type_b_shifts(campaign, used, solution) | shown


def terms_of_heel(reduction: Reduction) -> list[str]:
    """Names of the derivatives of the heel that were found."""
    names = [name for terms in HEEL_TERMS.values() for name in terms]
    return [name for name in names if name in reduction.derivatives]


def is_resistance(campaign: Campaign) -> bool:
    """True if X0 is the resistance of a model without a working propeller, which is not in the card of a ship."""
    return not any(run.propeller_radps for run in campaign.runs)


def reduction_covariance(reduction: Reduction, names: Sequence[str]) -> Array:
    """Covariance (k, k), prime, of the derivatives `names` of a campaign.

    Type A comes from the regressions of the forces, whose errors are independent. An error common to many runs (Type B,
    or shown by the campaign itself) moves the derivatives of all three forces together: the outer product of what they
    move by.
    """
    places = {name: place for place, name in enumerate(names)}
    covariance = np.zeros((len(names), len(names)))
    shifts: dict[str, Array] = {}
    for result in reduction.forces.values():
        solution = result.solution
        columns = [place for place, name in enumerate(solution.names) if name in places]
        rows = [places[solution.names[place]] for place in columns]
        covariance[np.ix_(rows, rows)] += solution.covariance[np.ix_(columns, columns)]
        for source, moved in result.shifts.items():
            shift = shifts.setdefault(source, np.zeros(len(names)))
            for name, by in moved.items():
                if name in places:
                    shift[places[name]] = by
    for shift in shifts.values():
        covariance += np.outer(shift, shift)
    return (covariance + covariance.T) / 2
