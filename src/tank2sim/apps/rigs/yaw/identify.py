"""Added yaw inertia and dissipation of a body from records of the yaw rig (paper 3, Alyshev 2019), method by method."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.stats import f as f_test

from tank2sim.apps.rigs.yaw.card import YawRig
from tank2sim.apps.rigs.yaw.diagnostics import (
    check_added_inertia,
    check_current,
    check_explained,
    check_mirror,
    check_sign,
    check_turn,
    estimate_notes,
)
from tank2sim.apps.rigs.yaw.energy import (
    EnergyFit,
    YawEstimate,
    as_many_equations,
    energy_balance,
    fit_energy,
    least_squares_estimate,
    two_intervals,
)
from tank2sim.apps.rigs.yaw.intervals import ENERGY_TERMS, Interval, intervals, mirror_difference
from tank2sim.apps.rigs.yaw.model import UNKNOWN_RIG
from tank2sim.apps.rigs.yaw.output_error import AngleFit, fit_angle
from tank2sim.apps.rigs.yaw.records import Medium, YawRecord, refuse_copied_records
from tank2sim.errors import ArgumentError, InputError
from tank2sim.notices import Notice

YAW_METHODS = (
    "energy_least_squares",
    "as_many_equations",
    "two_intervals",
    "output_error",
    "energy_least_squares_reference",
    "two_intervals_reference",
)
"""The first gives the numbers of a card; ``_reference`` uses the programme's speeds instead of the body's."""

AIR_TERMS = ("inertia", "coulomb", "viscous")
WATER_TERMS = ("inertia", "coulomb", "viscous", "quadratic")
GRAVITY = ("gravity_sine", "gravity_cosine")
_RARE = 1e-3
_SLIGHT = 0.01
TORQUE_CONSTANT_NMPA = 0.051
"""k_t of the paper's motor."""


@dataclass(frozen=True, kw_only=True)
class YawOptions:
    """Known values in addition to the records, and options of their evaluation.

    Parameters
    ----------
    inertia_kgm2, inertia_error_kgm2 : float, optional
        J_zz, and its standard error; by default from records in air or from the file.
    torque_constant_NmpA, torque_constant_error : float, optional
        k_t, and its relative standard error.
    known : YawRig, optional
        Known walls, gravity, and differences between accelerating and braking.
    terms : tuple of str, optional
        Terms to estimate, by default those of (3) for the medium.
    mirror_limit : float
        Largest accepted difference of the rates of two mirror images, over the largest rate.
    """

    inertia_kgm2: float | None = None
    inertia_error_kgm2: float | None = None
    torque_constant_NmpA: float | None = None
    torque_constant_error: float = 0.0
    known: YawRig | None = None
    terms: tuple[str, ...] | None = None
    mirror_limit: float = 0.25


@dataclass(frozen=True, kw_only=True)
class BodyInertia:
    """J_zz in kg m2, its standard error (None if unknown), its source, and True if it depends on the records' k_t."""

    value_kgm2: float
    error_kgm2: float | None
    source: str
    by_torque_constant: bool = False


@dataclass(frozen=True, eq=False, kw_only=True)
class YawIdentification:
    """Estimates of a body on the rig.

    Parameters
    ----------
    records : tuple of YawRecord
        Records of the medium.
    medium : str
        ``water``, or ``air`` if no record is of water.
    torque_constant_NmpA, torque_constant_error : float
        k_t and its relative standard error.
    body : BodyInertia or None
        J_zz; None in air, where it is estimated, and where it is unknown.
    estimates : dict
        Method to estimate.
    fit : EnergyFit
        The energy least squares with actual speeds.
    ideal : Interval
        The programme's accelerating interval.
    angle : AngleFit or None
        The nonlinear least squares, where they converged.
    mirror : tuple of float
        Difference of the rates of each pair, over the largest.
    notices : tuple of Notice
        Messages for the user, in sentences.
    """

    records: tuple[YawRecord, ...]
    medium: Medium
    torque_constant_NmpA: float
    torque_constant_error: float
    body: BodyInertia | None
    estimates: dict[str, YawEstimate]
    fit: EnergyFit
    ideal: Interval
    angle: AngleFit | None
    mirror: tuple[float, ...]
    notices: tuple[Notice, ...]
    air: YawIdentification | None = field(default=None)

    def added_inertia(self, method: str) -> tuple[float, float | None] | None:
        """lambda661 by a method and its standard error, kg m2; None where J_zz is not known.

        Combines the errors of the total, of J_zz and of k_t. The last is proportional to the total, or to the
        difference where J_zz was found in air with the same k_t.
        """
        if self.body is None:
            return None
        estimate = self.estimates[method]
        added = estimate.total_inertia_kgm2 - self.body.value_kgm2
        scaled = added if self.body.by_torque_constant else estimate.total_inertia_kgm2
        parts = [estimate.inertia_error_kgm2, self.body.error_kgm2, self.torque_constant_error * scaled]
        known = [part for part in parts if part is not None]
        return added, math.hypot(*known) if estimate.inertia_error_kgm2 is not None else None


def identify_yaw(records: Sequence[YawRecord], options: YawOptions | None = None) -> YawIdentification:
    """Estimate the added yaw inertia and the dissipation of one body.

    Records in air give J_zz for records in water; alone, they are evaluated themselves.

    Raises
    ------
    InputError
        The intervals of a record are not mirror images, the motor saturates in one, the encoder steps too rarely, two
        records are one, or the records do not separate the terms.
    """
    options = options or YawOptions()
    wet = tuple(record for record in records if record.medium == "water")
    dry = tuple(record for record in records if record.medium == "air")
    if not records:
        raise ArgumentError("records", "", "is empty", "give one or more CSV files")
    alike = refuse_copied_records(records)
    if not wet:
        found = _result(dry, "air", options, None)
        return replace(found, notices=(*alike, *found.notices))
    air = _result(dry, "air", replace(options, terms=None), None) if dry else None
    found = _result(wet, "water", options, air)
    return replace(found, notices=(*alike, *found.notices))


def torque_constant(reference: YawIdentification, known_inertia_kgm2: float) -> tuple[float, float]:
    """k_t (N m/A) and its relative standard error, from records in air of a body whose inertia is known.

    All terms of (3) are proportional to k_t: the records give J/k_t, independent of the k_t of the evaluation.

    Raises
    ------
    InputError
        The records are of water, where the added inertia is unknown, too.
    """
    if reference.medium != "air":
        path = reference.records[0].path
        raise InputError(path, "", "is of a body in water", "give a record in air ('# medium: air')")
    best = reference.estimates[YAW_METHODS[0]]
    error = (best.inertia_error_kgm2 or 0.0) / best.total_inertia_kgm2
    return reference.torque_constant_NmpA * known_inertia_kgm2 / best.total_inertia_kgm2, error


def parse_yaw_terms(text: str) -> tuple[str, ...]:
    """Terms from an option's text, ``"coulomb,viscous,quadratic"``; the inertia is always among them.

    Raises
    ------
    InputError
        A term is unknown or repeated.
    """
    words = [word.strip() for word in text.split(",") if word.strip() not in ("", "inertia")]
    for word in words:
        if word not in ENERGY_TERMS or words.count(word) > 1:
            known = ", ".join(term for term in ENERGY_TERMS if term != "inertia")
            raise ArgumentError(
                "terms", "", f"{word!r} is not a term, or is repeated", f"take any of {known}, once each"
            )
    return ("inertia", *(term for term in ENERGY_TERMS if term in words))


def _result(
    records: tuple[YawRecord, ...], medium: Medium, options: YawOptions, air: YawIdentification | None
) -> YawIdentification:
    constant, notes = _torque_constant(records, options)
    notes += check_current(records)
    for record in records:
        check_turn(record)
    pairs = [pair for record in records for pair in intervals(record)]
    mirror = tuple(mirror_difference(pair) for pair in pairs)
    notes += check_mirror(records, mirror, options.mirror_limit)
    rig = options.known
    programmed = [pair for record in records for pair in intervals(record, "reference")]

    def fitted(terms: tuple[str, ...]) -> tuple[EnergyFit, EnergyFit]:
        expected = energy_balance(programmed, terms, constant, rig)
        measured = fit_energy(energy_balance(pairs, terms, constant, rig), records[0], expected)
        return measured, fit_energy(expected, records[0])

    terms = options.terms or (AIR_TERMS if medium == "air" else WATER_TERMS)
    fit, reference = fitted(terms)
    if options.terms is None and (found := _with_gravity(fit, fitted)):
        (fit, reference), gravity_notes = found
        notes += gravity_notes
    check_sign(records[0], fit)
    ideal = programmed[0][0]
    estimates = {
        "energy_least_squares": least_squares_estimate("energy_least_squares", fit, ideal),
        "as_many_equations": as_many_equations("as_many_equations", fit, ideal),
        "two_intervals": two_intervals("two_intervals", fit.balance, fit),
        "energy_least_squares_reference": least_squares_estimate("energy_least_squares_reference", reference, ideal),
        "two_intervals_reference": two_intervals("two_intervals_reference", reference.balance, fit),
    }
    angle, omissions = _angle(records, _rig(constant, rig), estimates["energy_least_squares"], ideal)
    notes += [*omissions, *check_explained(records, angle.estimate.misfit if angle else None)]
    if angle:
        estimates["output_error"] = angle.estimate
    body, remarks = _body(records, medium, options, air)
    identified = YawIdentification(
        records=records,
        medium=medium,
        torque_constant_NmpA=constant,
        torque_constant_error=options.torque_constant_error,
        body=body,
        estimates={name: estimates[name] for name in YAW_METHODS if name in estimates},
        fit=fit,
        ideal=ideal,
        angle=angle,
        mirror=mirror,
        notices=(*notes, *remarks, *estimate_notes(fit, estimates)),
        air=air,
    )
    added = {name: value for name in estimates if (value := identified.added_inertia(name)) is not None}
    first = check_added_inertia(records[0], body.value_kgm2 if body else 0.0, added)
    return replace(identified, notices=(*first, *identified.notices))


Fits = tuple[EnergyFit, EnergyFit]


def _with_gravity(fit: EnergyFit, fitted: Callable[[tuple[str, ...]], Fits]) -> tuple[Fits, list[Notice]] | None:
    """The fits with a moment of gravity, with a note, if the residual work varies with the angle.

    By the F test of the two terms at a thousandth, for a moment of at least a hundredth of the motor's mean: the test
    alone would find the rounding of a record without noise.
    """
    try:
        extended, reference = fitted((*fit.balance.terms, *GRAVITY))
    except InputError:  # the angles do not separate it
        return None
    freedom = len(extended.residuals_J) - len(extended.coefficients)
    after, before = float(extended.residuals_J @ extended.residuals_J), float(fit.residuals_J @ fit.residuals_J)
    moment = float(np.hypot(*extended.coefficients[-2:]))
    turned = sum(
        abs(interval.angle_rad[-1] - interval.angle_rad[0]) for pair in extended.balance.pairs for interval in pair
    )
    mean = float(np.abs(extended.balance.work_J).sum()) / turned
    if moment < _SLIGHT * mean or f_test.sf((before - after) / 2 / (after / freedom), 2, freedom) > _RARE:
        return None
    note = (
        f"The residual of (3) varies with the angle: a moment of gravity of {moment:.3g} N m is among the terms "
        f"(--terms {','.join(fit.balance.terms[1:])} omits it). The two-interval formulas neglect it."
    )
    return (extended, reference), [Notice(note)]


def _angle(
    records: tuple[YawRecord, ...], rig: YawRig, first: YawEstimate, ideal: Interval
) -> tuple[AngleFit | None, list[Notice]]:
    """The nonlinear least squares, or None with the reason."""
    beyond = [term for term in first.friction if term not in (*WATER_TERMS, *GRAVITY)]
    if beyond:
        return None, [
            Notice(
                f"output_error fits the terms of (3) and gravity and is left out, because {', '.join(beyond)} was "
                "requested."
            )
        ]
    angle = fit_angle(records, rig, first, ideal)
    return angle, [] if angle else [Notice("output_error: the fit of the angle did not converge and is left out.")]


def _rig(constant: float, known: YawRig | None) -> YawRig:
    """The rig of the nonlinear least squares, with the known terms."""
    return (known or UNKNOWN_RIG).model_copy(update={"torque_constant_NmpA": constant})


def _torque_constant(records: tuple[YawRecord, ...], options: YawOptions) -> tuple[float, list[Notice]]:
    constants = {record.constants.get("torque_constant_NmpA") for record in records}
    if options.torque_constant_NmpA is not None:
        return options.torque_constant_NmpA, []
    if len(constants) > 1:
        raise InputError(
            records[0].path,
            "comment torque_constant_NmpA",
            "is not the same in all records",
            "give torque_constant_NmpA",
        )
    (stated,) = constants
    if stated is not None:
        return stated, []
    taken = f"the published rig's {TORQUE_CONSTANT_NMPA:g} N m/A is taken."
    note = f"No record states the torque constant: {taken}"
    return TORQUE_CONSTANT_NMPA, [Notice(note)]


def _body(
    records: tuple[YawRecord, ...], medium: Medium, options: YawOptions, air: YawIdentification | None
) -> tuple[BodyInertia | None, list[Notice]]:
    if medium == "air":
        return None, []
    if options.inertia_kgm2 is not None:
        given = BodyInertia(value_kgm2=options.inertia_kgm2, error_kgm2=options.inertia_error_kgm2, source="as given")
        return given, _lacking(given)
    if air is not None:
        best = air.estimates[YAW_METHODS[0]]
        names = ", ".join(record.path.name for record in air.records)
        return BodyInertia(
            value_kgm2=best.total_inertia_kgm2,
            error_kgm2=best.inertia_error_kgm2,
            source=f"in air, {names}",
            by_torque_constant=True,
        ), []
    for record in records:
        if (stated := record.constants.get("inertia_kgm2")) is not None:
            error = record.constants.get("inertia_error_kgm2")
            inertia = BodyInertia(value_kgm2=stated, error_kgm2=error, source=f"comment of {record.path.name}")
            return inertia, _lacking(inertia)
    return None, [
        Notice(
            "J_zz is unknown, so that the added inertia cannot be separated from the total: give a record in air as "
            "well, or inertia_kgm2."
        )
    ]


def _lacking(body: BodyInertia) -> list[Notice]:
    if body.error_kgm2 is not None:
        return []
    return [
        Notice(
            "J_zz has no standard error, and the error of the added inertia does not include one: give "
            "inertia_error_kgm2, or a line '# inertia_error_kgm2: 0.0002'."
        )
    ]
