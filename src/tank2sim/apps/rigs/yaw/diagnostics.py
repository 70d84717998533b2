"""Checks before and after an estimate from records of the yaw rig, with notes for the user."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import numpy as np

from tank2sim.apps.rigs.yaw.energy import EnergyFit, YawMethodEstimate
from tank2sim.apps.rigs.yaw.output_error import AngleFit
from tank2sim.apps.rigs.yaw.records import YawRecord
from tank2sim.notices import Notice, caution
from tank2sim.units import in_words

_NOT_QUITE_MIRRORED = 0.03
_FULL = 0.995
"""Share of the largest current from which the motor counts as saturated."""
_ANOTHER_UNIT = 20.0
_STRONG_A = 20.0
"""More current than a motor of such a rig takes; the paper's has 1 A."""
_LEAST_A = 1e-9
"""A current that stays below it turns no body. Project choice: a billionth of what the paper's motor takes (1 A)."""
_NOT_THE_PROGRAMME = 1.5
"""A turn that differs from the programme by this factor is an error of units, not of tracking."""
_PULSE_RAD = 2 * math.pi / 3000
"""Pulse of the paper's encoder; where (3) holds, the residual is about a quarter of it."""
_LEAST_ADDED, _MOST_ADDED = 0.02, 10.0
"""Added inertia over J_zz of bodies on the rig. Project choice: near a round body, and five times the most of ships in
deep water, for walls, a shallow tank and light models."""
_APART = 3.0
_SHARPER = 3.0


def check_current(records: tuple[YawRecord, ...]) -> Iterator[Notice]:
    """Notes on the files and their currents; InputError for a motor that is saturated or idle."""
    for record in records:
        name, largest = record.path.name, float(np.abs(record.current_A).max())
        yield from (note.of(name) for note in record.notes)
        if largest < _LEAST_A:
            problem = f"stays below {_LEAST_A:g} A: the motor did not turn the body"
            raise record.fault("column current_A", problem, "give the current in A")
        if largest > _STRONG_A:
            yield Notice(f"the current reaches {largest:.3g} A; if the column is in mA, divide it by 1000.").of(name)
        yield from _saturation(record, largest)


def _saturation(record: YawRecord, largest: float) -> Iterator[Notice]:
    """Note on a motor that is saturated; InputError within the intervals that are evaluated."""
    limit = record.constants.get("max_current_A", math.inf)
    times = record.time_s[np.abs(record.current_A) >= _FULL * limit]
    for begin, end in (ends for pair in record.programme.pairs() for ends in pair):
        bad = times[(times >= begin) & (times <= end)]
        if bad.size:
            problem = f"reaches the motor's {limit:g} A at {bad[0]:.3f} s, where it is evaluated"
            remedy = "run a slower programme, or lower gains"
            if largest > _ANOTHER_UNIT * limit:
                remedy = f"its largest is {largest:.3g} A: if the column is in mA, divide it by 1000"
            raise record.fault("column current_A", problem, remedy)
    if times.size:
        yield Notice(
            f"{record.path.name}: the motor is saturated at {times[0]:.3f} s, outside the intervals that are evaluated."
        )


def check_turn(record: YawRecord) -> None:
    """Raise InputError if the turn of the body differs grossly from the programme: its units are then wrong.

    Checked while the rate is constant, where a wrong start_s has little effect.
    """
    turn = record.programme
    for number in range(turn.humps):
        ends = turn.start_s + number * turn.period_s + turn.rise_s * np.array([1.0, 2.0])
        programmed = float(abs(np.diff(turn.at(ends).angle_rad)[0]))
        measured = float(abs(np.diff(np.interp(ends, record.time_s, record.angle_rad))[0]))
        if not programmed / _NOT_THE_PROGRAMME < measured < programmed * _NOT_THE_PROGRAMME:
            problem = (
                f"turns by {measured:.3g} rad from {ends[0]:.2f} to {ends[1]:.2f} s (hump {number + 1}), where the "
                f"programme turns by {programmed:.3g} rad"
            )
            remedy = "check the unit of the angle (phi_rad or phi_deg), max_rate_degps, rise_s and start_s"
            raise record.fault("column phi_rad", problem, remedy)


def check_sign(record: YawRecord, fit: EnergyFit) -> None:
    """Raise InputError if the motor works against the motion throughout: angle and current have opposite signs."""
    if fit.coefficients[0] < 0 and float(fit.balance.work_J.sum()) < 0:
        problem = "drives the body against its motion throughout, which makes inertia and friction negative"
        raise record.fault("column current_A", problem, "give current and angle the same positive sense")


def check_mirror(records: tuple[YawRecord, ...], mirror: tuple[float, ...], limit: float) -> Iterator[Notice]:
    """Note on intervals that are not quite mirror images; InputError beyond the limit."""
    pairs = [(record, pair) for record in records for pair in record.programme.pairs()]
    for (record, pair), share in zip(pairs, mirror, strict=True):
        if share > limit:
            speeding, braking = (f"{begin:.2f}-{end:.2f} s" for begin, end in pair)
            problem = (
                f"the intervals {speeding} and {braking} are not mirror images: their rates differ by up to "
                f"{100 * share:.1f} % of the largest, and {100 * limit:g} % is allowed"
            )
            remedy = "check start_s and rise_s, tune the controller, leave the hump out, or raise mirror_percent"
            raise record.fault("", problem, remedy)
    if max(mirror) > _NOT_QUITE_MIRRORED:
        yield Notice(
            f"The accelerating and braking intervals are mirror images to {100 * max(mirror):.1f} % of the largest "
            "rate: the two-interval formulas are biased by the difference in dissipation."
        )


def check_added_inertia(
    record: YawRecord, inertia_kgm2: float | None, methods: Mapping[str, YawMethodEstimate]
) -> Iterator[Notice]:
    """Note, marked, on an added inertia (kg m2, of the first method) that is uncertain or that few bodies have;
    InputError where all methods make it negative by more than its error: no body has that."""
    if inertia_kgm2 is None:
        return
    added = [(found.inertia[1], 2 * (found.inertia[2] or 0.0)) for found in methods.values()]
    value, doubt = added[0]
    ratio = value / inertia_kgm2
    if all(each + other < 0 for each, other in added):
        problem = (
            f"the added inertia is {value:.3g} kg m2, and no body has a negative one: J_zz is {inertia_kgm2:.4g} "
            f"kg m2, body and water together have {value + inertia_kgm2:.4g}"
        )
        remedy = "check J_zz, the torque constant, the unit of the current (A), and that the body in air was the same"
        raise record.fault("", problem, remedy)
    if value < doubt:
        yield caution(
            f"the added inertia does not differ from zero: {1e4 * value:.3g}e-4 ± {1e4 * doubt / 2:.2g}e-4 "
            "kg m2; run a faster programme, more humps, or a body that carries more water."
        )
    elif not _LEAST_ADDED - doubt / inertia_kgm2 <= ratio <= _MOST_ADDED + doubt / inertia_kgm2:
        yield caution(
            f"the added inertia is {ratio:.3g} times J_zz ({inertia_kgm2:.4g} kg m2), and ships have 0.25 to 2 "
            "in deep water; check the units of J_zz (kg m2), torque constant (N m/A), current (A) and time (s)."
        )


def check_explained(records: tuple[YawRecord, ...], angle: AngleFit | None) -> Iterator[Notice]:
    """Notes if (3) does not explain the record's motion, or a single hump cannot show it."""
    misfit_rad = float(np.sqrt(np.mean(angle.residual_rad**2))) if angle else 0.0
    if misfit_rad > _PULSE_RAD:
        yield Notice(
            f"(3) leaves {misfit_rad:.2g} rad of the angle (rms), more than an encoder's pulse: gravity, walls or "
            "another effect is missing in the terms, and no standard error includes it."
        )
    programme = records[0].programme
    if len(records) == programme.humps == 1 and programme.turn_per_interval_rad < 2 * math.pi:
        yield Notice(
            "One hump of part of a turn does not distinguish a moment of gravity from inertia: give two humps or more "
            "that begin at other angles."
        )


def estimate_notes(methods: Mapping[str, YawMethodEstimate]) -> Iterator[Notice]:
    """Notes on the estimates: bias, scatter of the humps, terms near zero, and the nonlinear least squares."""
    best, two = methods["energy_least_squares"], methods["two_intervals"]
    bias, parts = two.bias_against_least_squares_kgm2 or 0.0, two.bias_from_kgm2
    yield Notice(
        f"The two-interval formula (1) lies {1e4 * bias:+.3g}e-4 kg m2 "
        f"({100 * bias / best.total_inertia_kgm2:+.2g} % of the total) from "
        f"the least squares: {1e4 * parts['dissipation']:+.3g}e-4 because the intervals differ in dissipation, "
        f"{1e4 * parts['speeds']:+.3g}e-4 because their end speeds differ. Its standard error does not "
        "include this bias."
    )
    if len(two.total_inertia_by_hump_kgm2) > 1:
        humps = ", ".join(f"{1e4 * value:.4g}" for value in two.total_inertia_by_hump_kgm2)
        yield Notice(
            f"It is the mean of {humps} e-4 kg m2 (total), hump by hump; while the controller's gains are still being "
            "tuned, a hump differs."
        )
    for name, value in best.friction.items():
        error, (term, unit) = best.friction_standard_errors[name], in_words(name)
        if error is not None and abs(value) < 2 * error:
            yield Notice(f"{term} does not differ from zero: {value:.3g} ± {error:.2g} {unit}.")
    yield from _methods_apart(methods)


def _methods_apart(methods: Mapping[str, YawMethodEstimate]) -> Iterator[Notice]:
    """Note if the nonlinear least squares differ from the energy's by more than their errors, or are sharper."""
    nonlinear, best = methods.get("output_error"), methods["energy_least_squares"]
    error = best.total_inertia_standard_error_kgm2
    if nonlinear is None or not error or not nonlinear.total_inertia_standard_error_kgm2:
        return
    sharper = nonlinear.total_inertia_standard_error_kgm2
    difference, both = abs(best.total_inertia_kgm2 - nonlinear.total_inertia_kgm2), math.hypot(error, sharper)
    if difference > _APART * both:
        yield Notice(
            f"energy_least_squares and output_error differ by {1e4 * difference:.3g}e-4 kg m2, "
            f"{difference / both:.2g} times their errors: an effect in the record is missing in the equations of "
            "both, and in both errors."
        )
    elif sharper < error / _SHARPER:
        yield Notice(
            f"output_error is more accurate, ± {1e4 * sharper:.2g}e-4 against "
            f"± {1e4 * error:.2g}e-4 kg m2; a card gets it with output_error as method."
        )
