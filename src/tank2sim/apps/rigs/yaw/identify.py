"""Added yaw inertia and dissipation of a body from records of the yaw rig (paper 3, Alyshev 2019), method by method."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple, get_args

import numpy as np
from scipy.stats import f as f_test

from tank2sim.apps.rigs.yaw import YawMethod
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
    ENERGY_TERMS,
    PARTS,
    EnergyFit,
    Interval,
    IntervalPair,
    Speeds,
    YawMethodEstimate,
    as_many_equations,
    energy_balance,
    estimate_from,
    fit_energy,
    intervals,
    mirror_difference,
    two_intervals,
)
from tank2sim.apps.rigs.yaw.model import TORQUE_CONSTANT_NMPA, UNKNOWN_RIG
from tank2sim.apps.rigs.yaw.output_error import AngleFit, fit_angle
from tank2sim.apps.rigs.yaw.records import YawRecord, refuse_copied_records
from tank2sim.apps.rigs.yaw.theory import TheoryValue
from tank2sim.arguments import chosen_names
from tank2sim.arrays import Array, Columns
from tank2sim.errors import ArgumentError, InputError
from tank2sim.notices import Notice
from tank2sim.records.thinning import drawn_columns

YAW_METHODS: tuple[str, ...] = get_args(YawMethod)
"""The first gives the numbers of a card; ``_reference`` uses the programme's speeds instead of the body's."""

AIR_TERMS = ("inertia", "coulomb", "viscous")
WATER_TERMS = (*AIR_TERMS, "quadratic")
GRAVITY = ("gravity_sine", "gravity_cosine")
_RARE = 1e-3
_SLIGHT = 0.01


@dataclass(frozen=True, kw_only=True)
class YawOptions:
    """Known values in addition to the records, and options of their evaluation.

    J_zz and its standard error are by default from records in air or from the file, k_t (with its relative standard
    error) from the file. `known` has walls, gravity, and differences between accelerating and braking. Terms are by
    default the ones of (3) for the medium. `mirror_limit` is the largest accepted difference of the rates of two mirror
    images, over the largest rate.
    """

    inertia_kgm2: float | None = None
    inertia_error_kgm2: float | None = None
    torque_constant_NmpA: float | None = None
    torque_constant_error: float = 0.0
    known: YawRig | None = None
    terms: tuple[str, ...] | None = None
    mirror_limit: float = 0.25


class _BodyInertia(NamedTuple):
    """J_zz in kg m2, its standard error, its source (None if unknown), and True if it depends on the records' k_t."""

    value_kgm2: float | None = None
    error_kgm2: float | None = None
    source: str | None = None
    by_torque_constant: bool = False


def identify_yaw(records: Sequence[YawRecord], options: YawOptions | None = None) -> YawStudy:
    """Estimate the added yaw inertia and the dissipation of one body.

    Records in air give J_zz for records in water; alone, they are evaluated themselves.

    Raises
    ------
    InputError
        The intervals of a record are not mirror images, the motor saturates in one, the encoder steps too rarely, two
        records are one, or the records do not separate the terms.
    """
    options = options or YawOptions()
    if not records:
        raise ArgumentError("records", "", "is empty", "give one or more CSV files")
    alike = refuse_copied_records(records)
    wet, dry = (tuple(record for record in records if record.medium == medium) for medium in ("water", "air"))
    air = _estimates(dry, replace(options, terms=None), None) if wet and dry else None
    estimates = _estimates(wet or dry, options, air)
    return YawStudy(**vars(replace(estimates, notices=(*alike, *estimates.notices))), air=air, theory=())


def torque_constant(reference: YawEstimates, known_inertia_kgm2: float) -> tuple[float, float]:
    """k_t (N m/A) and its relative standard error, from records in air of a body whose inertia is known.

    All terms of (3) are proportional to k_t: the records give J/k_t, independent of the k_t of the evaluation.
    InputError for records of water, where the added inertia is unknown, too.
    """
    if reference.medium != "air":
        remedy = "give a record in air ('# medium: air')"
        raise InputError(reference.records[0], "", "is of a body in water", remedy)
    best = reference.methods[YAW_METHODS[0]]
    error = (best.total_inertia_standard_error_kgm2 or 0.0) / best.total_inertia_kgm2
    return reference.torque_constant_NmpA * known_inertia_kgm2 / best.total_inertia_kgm2, error


def parse_yaw_terms(given: str | Sequence[str]) -> tuple[str, ...] | None:
    """Terms from names (``"coulomb,viscous,quadratic"``), with the inertia; None without a name.

    InputError if a term is unknown or repeated.
    """
    chosen = chosen_names("terms", given, ENERGY_TERMS)
    return tuple(term for term in ENERGY_TERMS if term in ("inertia", *chosen)) if given else None


Fits = tuple[EnergyFit, EnergyFit]


def _estimates(records: tuple[YawRecord, ...], options: YawOptions, air: YawEstimates | None) -> YawEstimates:
    """Estimates from records of one medium; `air` has the ones of the body in air, if there are any."""
    first = records[0]
    constant, unknown = _torque_constant(records, options)
    current = tuple(check_current(records))
    for record in records:
        check_turn(record)
    pairs = _pairs(records, "actual")
    mirror = tuple(map(mirror_difference, pairs))
    unlike = tuple(check_mirror(records, mirror, options.mirror_limit))
    fits, gravity = _energy_fits(records, pairs, constant, options)
    fit = fits[0]
    check_sign(first, fit)
    ideal = fits[1].balance.pairs[0][0]
    methods = _energy_estimates(fits, ideal)
    driven = (options.known or UNKNOWN_RIG).model_copy(update={"torque_constant_NmpA": constant})
    angle, omissions = _angle(records, driven, fit, ideal)
    methods |= {"output_error": angle.estimate} if angle else {}
    body, remarks = _body(records, options, air)
    methods = {
        name: _added(methods[name], body, options.torque_constant_error) for name in YAW_METHODS if name in methods
    }
    doubts = check_added_inertia(first, body.value_kgm2, methods)
    return YawEstimates(
        records=tuple(str(record.path) for record in records),
        medium=first.medium,
        torque_constant_NmpA=constant,
        body_inertia_kgm2=body.value_kgm2,
        body_inertia_standard_error_kgm2=body.error_kgm2,
        body_inertia_source=body.source,
        added_inertia_kgm2={name: found.added_inertia_kgm2 for name, found in methods.items()},
        dissipation_J={name: found.dissipation_J for name, found in methods.items()},
        methods=methods,
        mirror_difference=mirror,
        histories=record_histories(records, fit),
        energy_balance=energy_balance_means(fit),
        energy_residuals=energy_residuals(fit),
        angle_residual=angle_residual(angle),
        notices=(
            *(*doubts, *unknown, *current, *unlike, *gravity, *omissions),
            *(*check_explained(records, angle), *remarks, *estimate_notes(methods)),
        ),
    )


def _pairs(records: Sequence[YawRecord], speeds: Speeds) -> list[IntervalPair]:
    """Mirror pairs of all records."""
    return [pair for record in records for pair in intervals(record, speeds)]


def _energy_fits(
    records: tuple[YawRecord, ...], pairs: Sequence[IntervalPair], constant: float, options: YawOptions
) -> tuple[Fits, tuple[Notice, ...]]:
    """Least squares of the energy with measured speeds and with the programme's; a note on a moment of gravity."""
    first, rig = records[0], options.known
    programmed = _pairs(records, "reference")

    def fitted(terms: tuple[str, ...]) -> Fits:
        expected = energy_balance(programmed, terms, constant, rig)
        return fit_energy(energy_balance(pairs, terms, constant, rig), first, expected), fit_energy(expected, first)

    if options.terms:
        return fitted(options.terms), ()
    return _with_gravity(fitted(AIR_TERMS if first.medium == "air" else WATER_TERMS), fitted)


def _energy_estimates(fits: Fits, ideal: Interval) -> dict[str, YawMethodEstimate]:
    """Estimates by the energy, with measured speeds and with the programme's."""
    fit, reference = fits
    plain, programmed = (estimate_from(each.balance.terms, each.coefficients, each.covariance, ideal) for each in fits)
    return {
        "energy_least_squares": plain,
        "as_many_equations": as_many_equations(fit, ideal),
        "two_intervals": two_intervals(fit.balance, fit),
        "energy_least_squares_reference": programmed,
        "two_intervals_reference": two_intervals(reference.balance, fit),
    }


def _added(found: YawMethodEstimate, body: _BodyInertia, constant_error: float) -> YawMethodEstimate:
    """An estimate with lambda661, where J_zz is known; its error is by the errors of the total, J_zz and k_t together.

    The last is proportional to the total, or to the difference where J_zz was found in air with the same k_t.
    """
    if body.value_kgm2 is None:
        return found
    added, error = found.total_inertia_kgm2 - body.value_kgm2, found.total_inertia_standard_error_kgm2
    scaled = added if body.by_torque_constant else found.total_inertia_kgm2
    parts = (error, body.error_kgm2, constant_error * scaled)
    spread = None if error is None else math.hypot(*(part for part in parts if part is not None))
    return replace(found, added_inertia_kgm2=added, added_inertia_standard_error_kgm2=spread)


def _with_gravity(fits: Fits, fitted: Callable[[tuple[str, ...]], Fits]) -> tuple[Fits, tuple[Notice, ...]]:
    """The fits with a moment of gravity, with a note, if the residual work varies with the angle; else as they are.

    By the F test of the two terms at a thousandth, for a moment of at least a hundredth of the motor's mean: the test
    alone would find the rounding of a record without noise.
    """
    fit = fits[0]
    try:
        extended, reference = fitted((*fit.balance.terms, *GRAVITY))
    except InputError:  # the angles do not separate it
        return fits, ()
    freedom = len(extended.residuals_J) - len(extended.coefficients)
    after, before = float(extended.residuals_J @ extended.residuals_J), float(fit.residuals_J @ fit.residuals_J)
    moment = float(np.hypot(*extended.coefficients[-2:]))
    turned = sum(abs(each.angle_rad[-1] - each.angle_rad[0]) for pair in extended.balance.pairs for each in pair)
    mean = float(np.abs(extended.balance.work_J).sum()) / turned
    if moment < _SLIGHT * mean or f_test.sf((before - after) / 2 / (after / freedom), 2, freedom) > _RARE:
        return fits, ()
    note = (
        f"The residual of (3) varies with the angle: a moment of gravity of {moment:.3g} N m is among the terms "
        f'(terms="{",".join(fit.balance.terms[1:])}" omits it). The two-interval formulas neglect it.'
    )
    return (extended, reference), (Notice(note),)


def _angle(
    records: tuple[YawRecord, ...], rig: YawRig, fit: EnergyFit, ideal: Interval
) -> tuple[AngleFit | None, list[Notice]]:
    """The nonlinear least squares, or None with the reason."""
    beyond = [term for term in fit.balance.terms if term not in (*WATER_TERMS, *GRAVITY)]
    if beyond:
        problem = f"fits the terms of (3) and gravity and is left out, because {', '.join(beyond)} was requested."
        return None, [Notice(f"output_error {problem}")]
    angle = fit_angle(records, rig, fit, ideal)
    return angle, [] if angle else [Notice("output_error: the fit of the angle did not converge and is left out.")]


def _torque_constant(records: tuple[YawRecord, ...], options: YawOptions) -> tuple[float, list[Notice]]:
    if options.torque_constant_NmpA is not None:
        return options.torque_constant_NmpA, []
    constants = {record.constants.get("torque_constant_NmpA") for record in records}
    if len(constants) > 1:
        place, problem = "comment torque_constant_NmpA", "is not the same in all records"
        raise records[0].fault(place, problem, "give torque_constant_NmpA")
    (stated,) = constants
    if stated is not None:
        return stated, []
    taken = f"the published rig's {TORQUE_CONSTANT_NMPA:g} N m/A is taken."
    return TORQUE_CONSTANT_NMPA, [Notice(f"No record states the torque constant: {taken}")]


def _body(
    records: tuple[YawRecord, ...], options: YawOptions, air: YawEstimates | None
) -> tuple[_BodyInertia, list[Notice]]:
    """J_zz of a body in water, as given, from air or from a file; and what is missing of it."""
    stated = next((record for record in records if "inertia_kgm2" in record.constants), None)
    if records[0].medium == "air":
        return _BodyInertia(), []
    if options.inertia_kgm2 is not None:
        body = _BodyInertia(options.inertia_kgm2, options.inertia_error_kgm2, "as given")
    elif air is not None:
        best, names = air.methods[YAW_METHODS[0]], ", ".join(Path(record).name for record in air.records)
        error = best.total_inertia_standard_error_kgm2
        return _BodyInertia(best.total_inertia_kgm2, error, f"in air, {names}", by_torque_constant=True), []
    elif stated is not None:
        error = stated.constants.get("inertia_error_kgm2")
        body = _BodyInertia(stated.constants["inertia_kgm2"], error, f"comment of {stated.path.name}")
    else:
        problem = "J_zz is unknown, so that the added inertia cannot be separated from the total"
        return _BodyInertia(), [Notice(f"{problem}: give a record in air as well, or inertia_kgm2.")]
    problem = "J_zz has no standard error, and the error of the added inertia does not include one"
    remedy = "give inertia_error_kgm2, or a line '# inertia_error_kgm2: 0.0002'."
    return body, [] if body.error_kgm2 is not None else [Notice(f"{problem}: {remedy}")]


_HISTORY_SAMPLES = 900
"""Samples of a record, enough to show each peak of its signals."""

STAGES = ("accelerating", "braking")


@dataclass(frozen=True, eq=False, kw_only=True)
class EnergyBalance:
    """Work in the parts of the intervals, J: means over all pairs, in order of time.

    Parameters
    ----------
    motor_J : dict
        Stage (:data:`STAGES`) to the work of the motor (parts,).
    spent_J : dict
        Term to stage to the work that it takes (parts,).
    """

    motor_J: dict[str, Array]
    spent_J: dict[str, dict[str, Array]]


@dataclass(frozen=True, kw_only=True)
class EnergyResidual:
    """Residual work of a subinterval, J, with its stage, hump and mean rate."""

    stage: str
    hump: int
    rate_degps: float
    left_J: float


@dataclass(frozen=True, eq=False, kw_only=True)
class YawEstimates:
    """Estimates of a body from records of one medium.

    Parameters
    ----------
    records : tuple of str
        Files.
    medium : str
        ``water`` or ``air``.
    body_inertia_kgm2, body_inertia_standard_error_kgm2, body_inertia_source
        J_zz, its standard error and its source; None where it is not known, and in air, where it is estimated.
    added_inertia_kgm2, dissipation_J : dict
        Method to lambda661 (None where J_zz is not known), and to B + D.
    methods : dict
        Method to all its estimates.
    mirror_difference : tuple of float
        Difference of the rates of each pair of mirror images, over the largest.
    histories : dict
        Record to its columns, to draw.
    angle_residual : dict, optional
        ``t_s`` and ``residual_rad`` of the nonlinear least squares, where they converged.
    """

    records: tuple[str, ...]
    medium: str
    torque_constant_NmpA: float
    body_inertia_kgm2: float | None
    body_inertia_standard_error_kgm2: float | None
    body_inertia_source: str | None
    added_inertia_kgm2: dict[str, float | None]
    dissipation_J: dict[str, float]
    methods: dict[str, YawMethodEstimate]
    mirror_difference: tuple[float, ...]
    histories: dict[str, Columns]
    energy_balance: EnergyBalance
    energy_residuals: tuple[EnergyResidual, ...]
    angle_residual: Columns | None
    notices: tuple[Notice, ...]


@dataclass(frozen=True, eq=False, kw_only=True)
class YawStudy(YawEstimates):
    """Estimates of a body; :class:`YawEstimates` has the other parameters.

    Parameters
    ----------
    air : YawEstimates, optional
        Estimates from records in air, if there are records in water as well.
    theory : tuple of TheoryValue
        Added inertia from the form of the body.
    """

    air: YawEstimates | None
    theory: tuple[TheoryValue, ...]


def record_histories(records: Sequence[YawRecord], fit: EnergyFit) -> dict[str, Columns]:
    """Record name to histories: evaluated rate, rate of the programme, tracking error and current."""
    found, before = {}, 0
    for record in records:
        programme, time = record.programme, record.time_s
        reference = programme.at(time)
        rate = np.full(len(time), np.nan)
        for pair in fit.balance.pairs[before : before + programme.humps]:
            for interval in pair:
                inside = (time >= interval.time_s[0]) & (time <= interval.time_s[-1])
                rate[inside] = np.interp(time[inside], interval.time_s, interval.rate_radps)
        before += programme.humps
        offset = record.angle_rad[0] - float(programme.at(time[:1]).angle_rad[0])
        columns = {
            "t_s": time,
            "rate_radps": rate,
            "programme_rate_radps": reference.rate_radps,
            "tracking_error_rad": reference.angle_rad + offset - record.angle_rad,
            "current_A": record.current_A,
        }
        found[record.path.name] = drawn_columns(columns, _HISTORY_SAMPLES, peaks=True)
    return found


def energy_balance_means(fit: EnergyFit) -> EnergyBalance:
    """Work of the motor and of each term in each part of the intervals, means over all pairs."""
    balance = fit.balance
    shape = (len(balance.pairs), 2, PARTS)
    # Braking parts are numbered as mirror images.
    order = (slice(None), slice(None, None, -1))

    def stages(values: Array) -> dict[str, Array]:
        mean = values.reshape(shape).mean(axis=0)
        return {name: mean[place][order[place]] for place, name in enumerate(STAGES)}

    spent = balance.rows * fit.coefficients
    return EnergyBalance(
        motor_J=stages(balance.work_J),
        spent_J={term: stages(spent[:, column]) for column, term in enumerate(balance.terms)},
    )


def energy_residuals(fit: EnergyFit) -> tuple[EnergyResidual, ...]:
    """Residual work of each subinterval."""
    balance, residuals = fit.balance, iter(fit.residuals_J.tolist())
    return tuple(
        EnergyResidual(
            stage=STAGES[interval.braking],
            hump=interval.number + 1,
            rate_degps=float(np.degrees(np.mean(interval.part(part).rate_radps))),
            left_J=next(residuals),
        )
        for pair in balance.pairs
        for interval in pair
        for part in range(PARTS)
    )


def angle_residual(fit: AngleFit | None) -> Columns | None:
    """Residual angle of the integrated equation, with a gap (nan) between fitted parts; None without a fit."""
    if fit is None:
        return None
    breaks = np.flatnonzero(np.abs(np.diff(fit.time_s)) > 1.0) + 1
    time = np.insert(fit.time_s, breaks, fit.time_s[breaks - 1] + 0.01)
    return drawn_columns({"t_s": time, "residual_rad": np.insert(fit.residual_rad, breaks, np.nan)}, peaks=True)
