"""Findings of a reduction for its user, each of a sentence or two."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator, Sequence

import numpy as np

from tank2sim.identification.captive.consistency import repeats
from tank2sim.identification.captive.harmonics import ReducedRun
from tank2sim.identification.captive.oscillation import cubic_findings
from tank2sim.identification.captive.reduction import ForceResult, Reduction, is_resistance
from tank2sim.identification.captive.regression import moved_terms
from tank2sim.identification.captive.systematic import DelayEstimate, SystematicError, can_show_delay, correct_delay
from tank2sim.identification.captive.tank_conditions import tank_resonance, tank_size
from tank2sim.identification.captive.warnings import OscillationMotion, cautions_of_result, cautions_of_test
from tank2sim.notices import Notice, caution
from tank2sim.records.captive_record import FORCE_COLUMNS, FORCE_UNITS_SI

_SHEET = 0.05
_DRIFT = 0.02
"""Drift of a zero over half a run, as a share of the mean force of the runs, from which derivatives hold it. Project
choice: the accuracy that calibrations of gauges have."""
_UNEXPLAINED = 2.0
_ASYMMETRIC = 0.01
_REPEATED_ENOUGH = 3
_DRIFTS_ENOUGH, _SURE = 4, 4.0
"""Runs, and standard errors of their mean drift, from which a common drift is not chance (project choice)."""


def reduction_findings(reduction: Reduction) -> tuple[Notice, ...]:
    """All findings of a reduction, the gravest first."""
    found = [
        *implausible(reduction),
        *(Notice(f"left out because of a fault: {fault}") for fault in reduction.faults),
        *_omitted_runs(reduction),
        *reduction.campaign.remarks,
        *_missing(reduction),
        *(
            Notice(f"{doubt.message}{f' Runs: {_listed(doubt.runs)}.' if doubt.runs else ''}")
            for doubt in cautions_of_test(reduction.campaign, _oscillating(reduction))
        ),
        *_conventions(reduction),
        *_alignment(reduction),
        *_unchecked(reduction),
    ]
    for force, result in reduction.forces.items():
        found += [*_of_terms(result), *_of_runs(force, result)]
    found += cubic_findings(reduction.cubics)
    found += _sheet(reduction)
    found += _repeated(reduction)
    return tuple(found)


def implausible(reduction: Reduction) -> tuple[Notice, ...]:
    """Findings that question all derivatives: systematic errors of the records, values that no ship has."""
    values = {name: derivative.value for name, derivative in reduction.derivatives.items()}
    errors = {name: derivative.standard_error for name, derivative in reduction.derivatives.items()}
    cautions = cautions_of_result(values, errors, reduction.campaign)
    found = [error.message for error in reduction.systematic] + [each.message for each in cautions]
    found += [*drifting_zeros(reduction.runs)]
    campaign = reduction.campaign
    resonances = tank_resonance(_oscillating(reduction), campaign.tank, campaign.test.gravity_mps2)
    resonant = [run for each in resonances for run in each.runs]
    if reduction.systematic and resonant:
        found.append(f"standing waves of the tank would do the same to {_listed(resonant)}: compare without them.")
    found += [each.message for each in tank_size(campaign.tank)]
    return tuple(map(caution, found))


def drifting_zeros(runs: Sequence[ReducedRun]) -> Iterator[str]:
    """Gauges whose zero drifts within the runs: half of it is in each mean, if the zero was taken before the run."""
    runs = [run for run in runs if "trend" in run.labels]
    for force in FORCE_COLUMNS if len(runs) >= _DRIFTS_ENOUGH else ():
        drifts, means = [], []
        for run in runs:
            trend = run.basis[:, run.labels.index("trend")] * run.fits[force].coefficients[run.labels.index("trend")]
            drifts.append(float(trend[-1] - trend[0]))
            means.append(float(run.fits[force].coefficients[0]))
        middle, size = float(np.median(drifts)), float(np.sqrt(np.mean(np.square(means))))
        scatter = float(np.std(drifts)) / math.sqrt(len(drifts))
        if abs(middle) > max(2 * _DRIFT * size, _SURE * scatter):
            yield (
                f"the zero of the {force} gauge drifts by {abs(middle):.3g} {FORCE_UNITS_SI[force]} within a run "
                f"(median of {len(runs)}), {100 * abs(middle) / size:.2g} % of the mean force: take the zeros before "
                "and after each run and correct the records; standard errors do not hold it."
            )


def _omitted_runs(reduction: Reduction) -> Iterator[Notice]:
    reasons: dict[str, list[str]] = defaultdict(list)
    for name, reason in reduction.not_used.items():
        reasons[reason.partition(" is ")[0]].append(name)
    for cause, names in reasons.items():
        first = reduction.not_used[names[0]]
        yield Notice(f"{len(names)} run{'s' * (len(names) > 1)} left out ({_listed(names)}): {first}.")
        if cause == "its speed" and _constant_revolutions(reduction, names):
            yield Notice(
                "The runs away from the test speed keep its revolutions, so that speed and propeller load change "
                "together: they give no term in Du of hull or rudder alone. off_speed=True uses them, and its "
                "terms in Du then hold at constant revolutions."
            )
    if reduction.options.off_speed:
        revolutions = {run.run.propeller_radps for run in reduction.runs}
        if len(revolutions) == 1 and None not in revolutions:
            yield Notice(
                "Runs at other speeds keep the revolutions of the test speed: speed and propeller load change "
                "together, and the terms in Du hold at constant revolutions."
            )


def _constant_revolutions(reduction: Reduction, names: list[str]) -> bool:
    revolutions = {run.propeller_radps for run in reduction.campaign.runs if run.name in names}
    return len(revolutions) == 1 and None not in revolutions and 0.0 not in revolutions


def _missing(reduction: Reduction) -> Iterator[Notice]:
    if reduction.missing:
        yield Notice(f"The campaign does not give {', '.join(reduction.missing)}.")
    if reduction.campaign.model.yaw_inertia_kgm2 is None:
        yield Notice("[model] yaw_inertia_kgm2 is missing: the card has an estimate by a radius of gyration of 0.25 L.")


def _oscillating(reduction: Reduction) -> tuple[OscillationMotion, ...]:
    return tuple(
        OscillationMotion(row.run, "sway" if row.letter == "v" else "yaw", row.frequency_radps)
        for row in reduction.oscillations
    )


def _conventions(reduction: Reduction) -> Iterator[Notice]:
    campaign = reduction.campaign
    if "X0" in reduction.derivatives and is_resistance(campaign):
        found = reduction.derivatives["X0"]
        yield Notice(
            f"X0 = {found.value:.4g} ± {found.standard_error:.2g} is the resistance at the test speed, of a model "
            "towed without a propeller (no [test] propeller_rps). It is left out of the card, where the thrust at the "
            "nominal revolutions balances it."
        )
    turning = any(run.run.type == "yaw_with_drift" for run in reduction.runs)
    if turning and not campaign.inertia_removed and campaign.test.inertia_speed == "test":
        prime = campaign.model.mass_kg / float(campaign.scales.mass)
        yield Notice(
            "The carried body's m u r was taken with u = U, as Krezelewski and Misiag take it. With u = U cos(beta) in "
            f"the runs that yaw with drift Yvvr would come out lower by m'/2 = {prime / 2:.3g} and Nvvr by "
            f'{prime * campaign.model.x_G_m / campaign.model.length_m / 2:.2g}: [test] inertia_speed = "axial".'
        )


def _unchecked(reduction: Reduction) -> Iterator[Notice]:
    """Systematic errors that this campaign could not show."""
    kinds = dict.fromkeys(kind for force in "YN" for kind in reduction.forces[force].unchecked)
    if kinds:
        yield Notice(
            f"It is not known whether the gauges read the same in runs of {', '.join(kinds)} as in other runs: "
            "no other kind of run gives the same derivatives."
        )
    if any(run.run.oscillates for run in reduction.runs) and not can_show_delay(reduction.runs):
        effect = _effect_of_delay(reduction)
        yield Notice(
            "It is not known whether the forces lag the motion, and the standard errors do not include it: that needs "
            f"oscillations at two frequencies or more{effect}."
        )
    if reduction.delay is not None:
        yield from _doubts_of_delay(reduction.delay, reduction.systematic)


def _doubts_of_delay(delay: DelayEstimate, systematic: Sequence[SystematicError]) -> Iterator[Notice]:
    if not delay.alike:
        channels = ", ".join(
            f"{channel.force} in {channel.motion} {channel.size:.3g} ± {channel.standard_error:.2g} s"
            for channel in delay.channels
        )
        yield Notice(
            f"The forces lag the motion by times that differ ({channels}): memory of the flow, or a fault of one "
            "channel, not a delay of all; nothing is corrected for it."
        )
    elif not delay.supported and any(error.source == "force_delay" for error in systematic):
        yield Notice("Sway and yaw do not both show the delay: memory of the flow in one of them would look the same.")


def _alignment(reduction: Reduction) -> Iterator[Notice]:
    """A zero of the drift angle that Y0 and N0 agree on."""
    found = reduction.alignment
    if found is None or not found.shown or "alignment_rad" in reduction.campaign.uncertainty.model_fields_set:
        return
    angle, error = math.degrees(found.angle_rad), math.degrees(found.standard_error_rad)
    yield Notice(
        f"Y0 and N0 are as if the model were turned by {angle:.3g} ± {error:.1g} deg against the recorded drift (or "
        "the hull were as asymmetric): check its alignment. Nothing is corrected; the standard errors of Y0 and N0 "
        "include it. [uncertainty] alignment_deg states how well it is known."
    )


def _effect_of_delay(reduction: Reduction) -> str:
    """Error of accelerations by an unknown delay of 10 ms, in %."""
    moved = []
    for name in ("Yvdot", "Nrdot"):
        result = reduction.forces[name[0]]
        if name in reduction.derivatives and name in result.solution.names:
            shift = moved_terms(correct_delay(result.selection.equations, 0.01), result.solution)[name]
            moved.append(f"{name} by {abs(100 * shift / reduction.derivatives[name].value):.2g} %")
    return f"; 10 ms would change {', '.join(moved)}" if moved else ""


def _of_terms(result: ForceResult) -> Iterator[Notice]:
    for difference in result.disagreements:
        yield Notice(
            f"{difference.name} is {difference.together:.4g} by the regression over the whole campaign and "
            f"{difference.stepwise:.4g} test by test, {abs(difference.ratio):.1f} standard errors apart: the "
            "tests do not agree with each other within the equations of the model."
        )
    for trend in result.trends:
        if trend.used:
            yield Notice(
                f"{trend.name} changes with the frequency, by {trend.slope:.3g} ± {trend.standard_error:.2g} times "
                "(omega L/U)^2; its value is that extrapolated to zero frequency."
            )
    collinear = [choice.name for choice in result.selection.choices if choice.reason == "collinear"]
    if collinear:
        yield Notice(f"The campaign cannot distinguish {', '.join(collinear)} from other terms: they are left out.")


def _of_runs(force: str, result: ForceResult) -> Iterator[Notice]:
    for row in result.left_out:
        if row.unlikely:
            yield Notice(
                f"{row.run}: {force} does not fit the other runs (chance {row.chance:.1g}); without it {row.moved} "
                f"would move by {row.influence:.1f} standard errors."
            )
    noise = result.selection.spread.noise
    if noise > _UNEXPLAINED**2:
        yield Notice(
            f"The harmonics of {force} scatter from run to run {np.sqrt(noise):.1f} times as much as the noise within "
            "the runs explains, and the standard errors are as much wider: (3.8) does not follow them fully, or the "
            "recorded motion is wrong."
        )
    test = result.asymmetry
    if test is not None and test.names:
        text = "does not hold" if test.chance < _ASYMMETRIC else "holds"
        yield Notice(
            f"Symmetry of {force} to port and starboard {text} (chance {test.chance:.2g}; tested: "
            f"{', '.join(test.names)})."
        )


def _sheet(reduction: Reduction) -> Iterator[Notice]:
    """Frequencies and amplitudes of the sheet that differ from the measured ones."""
    for run in reduction.runs:
        sheet, motion = run.run.sheet, run.motion
        measured = (
            ("frequency", "rad/s", sheet.frequency_radps, motion.frequency_radps),
            (
                "amplitude",
                "m",
                sheet.amplitude_m if run.run.type == "pure_sway" else None,
                motion.amplitude(motion.v_mps) / (motion.frequency_radps or 1.0),
            ),
            ("yaw rate amplitude", "rad/s", sheet.yaw_rate_amplitude_radps, motion.amplitude(motion.r_radps)),
        )
        for quantity, unit, stated, found in measured:
            if stated is not None and run.run.oscillates and abs(found / stated - 1) > _SHEET:
                yield Notice(
                    f"{run.run.name}: its {quantity} is {found:.4g} {unit}, and {stated:.4g} by the sheet; the "
                    "measured value is used."
                )


def _repeated(reduction: Reduction) -> Iterator[Notice]:
    found = repeats(reduction.campaign, reduction.runs)
    if found is None or found.freedom < _REPEATED_ENOUGH:
        return
    for force, deviation in found.deviation.items():
        zero = float(np.sqrt(reduction.forces[force].selection.spread.zero_variance))
        if zero and not 1 / 3 < deviation / zero < 3:
            yield Notice(
                f"Repeated runs differ in {force}' by {deviation:.2g}, and runs altogether from the fit by {zero:.2g}: "
                "the standard errors use the latter."
            )


def _listed(names: list[str] | tuple[str, ...]) -> str:
    few = 4
    return ", ".join(names[:few]) + (f" and {len(names) - few} more" if len(names) > few else "")
