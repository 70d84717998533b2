"""The energy method on records of the yaw rig: two intervals, (1) and (2), and several subintervals.

Over any stretch of time the work of the motor is that against each term of (3):

    k_t int w I dt = (J + lambda661) D(w^2)/2 + f_c int |w| dt + f_1 int w^2 dt + f_662 int |w|^3 dt

The least squares over subintervals need no mirror images. The two-interval formulas assume the same dissipation in both
intervals; a control loop with a lag makes them differ, which biases the formulas.

The rate of the body is not measured: the encoder counts pulses. A spline is fitted to the changes of the count, where
the angle is known to the time of a sample, and not to the counts between, whose error is up to a pulse.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, NamedTuple

import casadi as ca
import numpy as np
from scipy.interpolate import BSpline, make_lsq_spline

from tank2sim.apps.rigs.yaw.card import YawRig
from tank2sim.apps.rigs.yaw.model import wall_terms
from tank2sim.apps.rigs.yaw.programme import dissipation_from_work, inertia_from_work
from tank2sim.apps.rigs.yaw.records import YawRecord
from tank2sim.arrays import Array
from tank2sim.identification.conditioning import column_norms, scaled_condition

Speeds = Literal["actual", "reference"]

KNOTS_S = (0.5, 0.35, 0.25, 0.17, 0.1)
"""Candidate distances of the spline's knots: the shortest follows the swings of a closed loop of some 0.1 s, the
longest smooths more of an encoder's noise. Each interval uses the one of least generalised cross-validation (Craven &
Wahba 1979), the longest of equals."""
_CORRELATION = 3.0
"""Sum of the correlations of an encoder's errors. Neighbouring points share a sample, and where the body passes about a
whole count in a sample the errors drift from one side to the other, which looks like motion. Project choice: with 1 a
rate from 50 or 100 rows a second has four times the variance."""
_MARGIN_S = 0.35
"""Extension of the spline beyond an interval, while the body moves: its errors are largest at its ends."""
_DEGREE = 5
STEPS_PER_COEFFICIENT = 2
"""Least number of encoder steps for each coefficient of the spline."""

PARTS = 6
"""Subintervals of an interval: with six, each of some 0.3 s in the paper's programme, the four terms of (3) are well
distinguished; more subintervals are too short for the spline of the rate."""

_HOPELESS = 1e7


@dataclass(frozen=True, eq=False, kw_only=True)
class Interval:
    """Motion in one interval of the pair `number`, at rising times; arrays (n,)."""

    time_s: Array
    angle_rad: Array
    rate_radps: Array
    acceleration_radps2: Array
    current_A: Array
    braking: bool
    number: int

    def integral(self, values: Array) -> float:
        """Integral over the interval by the trapezoidal rule."""
        return float(np.trapezoid(values, self.time_s))

    def part(self, place: int) -> Interval:
        """One of :data:`PARTS` equal parts in time; a braking interval's are counted from its end, as mirror images."""
        if self.braking:
            place = PARTS - 1 - place
        length = (self.time_s[-1] - self.time_s[0]) / PARTS
        low = self.time_s[0] + place * length
        inside = (self.time_s > low + 1e-9) & (self.time_s < low + length - 1e-9)
        time = np.concatenate([[low], self.time_s[inside], [low + length]])
        signals = ("angle_rad", "rate_radps", "acceleration_radps2", "current_A")
        return replace(
            self, time_s=time, **{name: np.interp(time, self.time_s, getattr(self, name)) for name in signals}
        )


IntervalPair = tuple[Interval, Interval]
Work = Callable[[Interval], float]


def _swept(power: int) -> Work:
    return lambda interval: interval.integral(np.abs(interval.rate_radps) ** power)


ENERGY_TERMS: dict[str, tuple[Work, str]] = {
    "inertia": (lambda part: float(part.rate_radps[-1] ** 2 - part.rate_radps[0] ** 2) / 2, "kgm2"),
    "coulomb": (_swept(1), "Nm"),
    "viscous": (_swept(2), "Nms"),
    "quadratic": (_swept(3), "Nms2"),
    "braking_quadratic": (lambda part: _swept(3)(part) if part.braking else 0.0, "Nms2"),
    "gravity_sine": (lambda part: float(np.cos(part.angle_rad[0]) - np.cos(part.angle_rad[-1])), "Nm"),
    "gravity_cosine": (lambda part: float(np.sin(part.angle_rad[-1]) - np.sin(part.angle_rad[0])), "Nm"),
}
"""Term to the work (per unit of its coefficient) that the motor does against it over an interval, and its unit:
inertia is J + lambda661, braking_quadratic f_662d - f_662a; the moment of gravity is -sine sin(psi) - cosine cos(psi).
"""


@dataclass(frozen=True, kw_only=True)
class YawMethodEstimate:
    """Estimates by one method, SI.

    Parameters
    ----------
    added_inertia_kgm2, added_inertia_standard_error_kgm2 : float, optional
        lambda661; None where J_zz is not known.
    total_inertia_kgm2, total_inertia_standard_error_kgm2 : float
        J_zz + lambda661 (in air J_zz); no error where the data do not determine it.
    dissipation_J, dissipation_standard_error_J : float
        B + D over one interval.
    friction, friction_standard_errors : dict
        Term of friction and water with its unit (``coulomb_Nm``) to its value and standard error; empty for a method
        that does not estimate them.
    bias_against_least_squares_kgm2 : float, optional
        Difference of a two-interval formula from the energy least squares of the same records.
    bias_from_kgm2 : dict
        Parts of the bias: ``dissipation`` (different in both intervals) and ``speeds`` (w1, w2 differ from w6, w5).
    total_inertia_by_hump_kgm2 : tuple of float
        J_zz + lambda661 of each pair of intervals by a two-interval formula; the estimate is their mean.
    """

    added_inertia_kgm2: float | None = None
    added_inertia_standard_error_kgm2: float | None = None
    total_inertia_kgm2: float
    total_inertia_standard_error_kgm2: float | None
    dissipation_J: float
    dissipation_standard_error_J: float | None
    friction: dict[str, float] = field(default_factory=dict)
    friction_standard_errors: dict[str, float | None] = field(default_factory=dict)
    bias_against_least_squares_kgm2: float | None = None
    bias_from_kgm2: dict[str, float] = field(default_factory=dict)
    total_inertia_by_hump_kgm2: tuple[float, ...] = ()

    @property
    def inertia(self) -> tuple[str, float, float | None]:
        """``added`` or, where J_zz is not known, ``total``; that inertia and its standard error, kg m2."""
        if self.added_inertia_kgm2 is None:
            return "total", self.total_inertia_kgm2, self.total_inertia_standard_error_kgm2
        return "added", self.added_inertia_kgm2, self.added_inertia_standard_error_kgm2


def intervals(record: YawRecord, speeds: Speeds = "actual") -> tuple[IntervalPair, ...]:
    """Accelerating and braking interval of each pair, with the speeds as measured, or of the programme.

    InputError if an interval has too few steps of the encoder.
    """
    return tuple(
        (
            _interval(record, pair.accelerating_s, speeds, braking=False, number=number),
            _interval(record, pair.braking_s, speeds, braking=True, number=number),
        )
        for number, pair in enumerate(record.programme.pairs())
    )


def _interval(record: YawRecord, ends: tuple[float, float], speeds: Speeds, *, braking: bool, number: int) -> Interval:
    begin, end = ends
    time = record.time_s
    inside = (time > begin + 1e-9) & (time < end - 1e-9)
    times = np.concatenate([[begin], time[inside], [end]])
    if speeds == "reference":
        angle, rate, acceleration = record.programme.at(times)
        angle = angle + np.interp(record.programme.start_s, time, record.angle_rad)
    else:
        spline = smooth_angle(record, ends)
        angle, rate, acceleration = (spline(times, nu) for nu in (0, 1, 2))
    return Interval(
        time_s=times,
        angle_rad=angle,
        rate_radps=rate,
        acceleration_radps2=acceleration,
        current_A=np.interp(times, time, record.current_A),
        braking=braking,
        number=number,
    )


def smooth_angle(record: YawRecord, ends: tuple[float, float]) -> BSpline:
    """Spline of the angle over an interval, whose derivatives are rate and acceleration.

    InputError if the encoder steps too rarely there.
    """
    begin, end = ends[0] - _MARGIN_S, ends[1] + _MARGIN_S
    within = (record.time_s >= begin) & (record.time_s <= end)
    time, angle = record.time_s[within], record.angle_rad[within]
    changed = np.diff(angle) != 0
    # Between two samples of different counts the angle passed their middle, at about the middle of the two times.
    middle, value = (time[1:] + time[:-1])[changed] / 2, (angle[1:] + angle[:-1])[changed] / 2
    needed = STEPS_PER_COEFFICIENT * (max(1, round((end - begin) / KNOTS_S[0])) + _DEGREE)
    if len(middle) < needed:
        problem = f"has {len(middle)} steps of the encoder from {begin:.3g} to {end:.3g} s, and {needed} are needed"
        remedy = "take an encoder with more pulses, a faster programme, or sample more often"
        raise record.fault("column phi_rad", problem, remedy)
    splines = [spline for knot in KNOTS_S if (spline := _spline(middle, value, knot)) is not None]
    if not splines:
        problem = f"does not move for a while between {begin:.3g} and {end:.3g} s, where the programme moves"
        raise record.fault("column phi_rad", problem, "check start_s, rise_s and the encoder")
    return min(splines, key=lambda spline: _cross_validation(spline, middle, value))


def _spline(time: Array, angle: Array, knot_s: float) -> BSpline | None:
    """Least-squares spline with knots at that distance; None if the points are too few, or a piece has none."""
    pieces = max(1, round((time[-1] - time[0]) / knot_s))
    if len(time) < STEPS_PER_COEFFICIENT * (pieces + _DEGREE):
        return None
    inner = np.linspace(time[0], time[-1], pieces + 1)[1:-1]
    knots = np.concatenate([np.full(_DEGREE + 1, time[0]), inner, np.full(_DEGREE + 1, time[-1])])
    try:
        return make_lsq_spline(time, angle, knots, k=_DEGREE)
    except (ValueError, np.linalg.LinAlgError):
        return None


def _cross_validation(spline: BSpline, time: Array, angle: Array) -> float:
    """n RSS / (n - c m)^2, c the sum of the correlations of an error with all others (Altman 1990)."""
    residual = angle - spline(time)
    free = len(time) - _CORRELATION * len(spline.c)
    return float(len(time) * (residual @ residual) / free**2) if free > 0 else math.inf


def known_work(interval: Interval, rig: YawRig) -> float:
    """Work (J) against known effects beyond (3): walls, gravity, and differences between accelerating and braking.

    Of the pair f_662a, f_662d the difference counts when braking; lambda_662 |w|^1.5 and the walls' added inertia
    multiply the acceleration.
    """
    rate, acceleration = interval.rate_radps, interval.acceleration_radps2
    inertia, damping = np.zeros_like(rate), np.zeros_like(rate)
    if rig.walls:
        heading = ca.SX.sym("psi")
        walls = ca.Function("walls", [heading], list(wall_terms(heading, rig.walls)))
        inertia, damping = (np.asarray(value).ravel() for value in walls(interval.angle_rad[None, :]))
    extra = rig.inertia_braking_kgm2 if interval.braking else rig.inertia_accelerating_kgm2
    inertia = inertia + extra * np.abs(rate) ** 1.5
    rougher = rig.quadratic_braking - rig.quadratic_Nms2 if interval.braking else 0.0
    gravity = rig.gravity_Nm * np.sin(interval.angle_rad - rig.gravity_angle_rad)
    return interval.integral(
        inertia * rate * acceleration + damping * rate**2 + rougher * np.abs(rate) ** 3 + gravity * rate
    )


def mirror_difference(pair: IntervalPair) -> float:
    """Largest difference of the rates of a pair, one of them mirrored, over their largest rate."""
    share = np.linspace(0, 1, 101)
    speeding, braking = (
        np.abs(np.interp(each.time_s[0] + at * (each.time_s[-1] - each.time_s[0]), each.time_s, each.rate_radps))
        for each, at in zip(pair, (share, 1 - share), strict=True)
    )
    return float(np.max(np.abs(speeding - braking)) / max(speeding.max(), braking.max()))


@dataclass(frozen=True, eq=False, kw_only=True)
class Balance:
    """The energy balance of every subinterval: work per unit of each term, (n, terms), and of the motor less known
    work, J.

    Row ``((pair * 2 + braking) * PARTS + part)`` belongs to a part of an interval.
    """

    terms: tuple[str, ...]
    rows: Array
    work_J: Array
    pairs: tuple[IntervalPair, ...]

    def whole(self, values: Array) -> Array:
        """Sums over the parts of each interval of a number for each subinterval, (pairs, 2)."""
        sums: Array = values.reshape(len(self.pairs), 2, PARTS).sum(axis=2)
        return sums


class EnergyFit(NamedTuple):
    """Coefficients of the terms with their covariance, residuals (J, (n,)), and their balance."""

    coefficients: Array
    covariance: Array
    residuals_J: Array
    balance: Balance


def energy_balance(
    pairs: Sequence[IntervalPair],
    terms: tuple[str, ...],
    torque_constant_NmpA: float,
    rig: YawRig | None,
) -> Balance:
    """The balance of every subinterval of mirror pairs; `rig` has the known effects beyond (3)."""
    rows, work = [], []
    for interval in (interval for pair in pairs for interval in pair):
        for part in (interval.part(place) for place in range(PARTS)):
            rows.append([ENERGY_TERMS[term][0](part) for term in terms])
            motor = torque_constant_NmpA * part.integral(part.rate_radps * part.current_A)
            work.append(motor - known_work(part, rig) if rig else motor)
    return Balance(terms=terms, rows=np.array(rows), work_J=np.array(work), pairs=tuple(pairs))


def fit_energy(balance: Balance, record: YawRecord, programmed: Balance | None = None) -> EnergyFit:
    """Least squares over all subintervals, with the `programmed` motion for instruments.

    Errors of the encoder's rate bias plain least squares: the inertia is too small, by several per cent with a coarse
    encoder or few rows. The programme has no errors of this kind and correlates with the motion, so that Z'(y - X b) =
    0, Z the rows of the programme, is unbiased (instrumental variables, Reiersol 1945).

    Raises
    ------
    InputError
        The subintervals do not distinguish the terms.
    """
    rows, work = balance.rows, balance.work_J
    freedom = len(rows) - len(balance.terms)
    if freedom < 1 or not scaled_condition(rows) < _HOPELESS:
        problem = f"does not distinguish {', '.join(balance.terms)}"
        raise record.fault("", problem, "give more records, or take fewer terms")
    instruments = rows if programmed is None else programmed.rows
    norms, scaled = column_norms(rows), (instruments / column_norms(instruments)).T
    inverse = np.linalg.solve(scaled @ (rows / norms), scaled) / norms[:, None]  # (Z'X)^-1 Z'
    coefficients = inverse @ work
    residuals = work - rows @ coefficients
    covariance = float(residuals @ residuals) / freedom * inverse @ inverse.T
    # Errors of neighbouring parts are correlated: they share the speed at their common end. Where it is larger, the
    # covariance follows from the scatter of whole intervals, each taken as one draw (Liang & Zeger 1986).
    count = 2 * len(balance.pairs)
    draws = (inverse * residuals).reshape(len(balance.terms), count, PARTS).sum(axis=2)
    clustered = count / max(1, count - 1) * draws @ draws.T
    scale = np.maximum(1.0, np.sqrt(np.diag(clustered) / np.diag(covariance)))
    return EnergyFit(coefficients, covariance * np.outer(scale, scale), residuals, balance)


def estimate_from(terms: tuple[str, ...], values: Array, covariance: Array, ideal: Interval) -> YawMethodEstimate:
    """An estimate from coefficients of terms, the first of them the inertia, and their covariance.

    The dissipation is taken over the `ideal` interval of the programme.
    """
    names = [f"{term}_{ENERGY_TERMS[term][1]}" for term in terms]
    errors = np.sqrt(np.diag(covariance)).tolist()
    conserved = [term == "inertia" or term.startswith("gravity") for term in terms]
    against = np.where(conserved, 0.0, [ENERGY_TERMS[term][0](ideal) for term in terms])
    return YawMethodEstimate(
        total_inertia_kgm2=float(values[0]),
        total_inertia_standard_error_kgm2=errors[0],
        dissipation_J=float(against @ values),
        dissipation_standard_error_J=float(math.sqrt(against @ covariance @ against)),
        friction=dict(zip(names[1:], values[1:].tolist(), strict=True)),
        friction_standard_errors=dict(zip(names[1:], errors[1:], strict=True)),
    )


def as_many_equations(fit: EnergyFit, ideal: Interval) -> YawMethodEstimate:
    """The paper's method: as many equations as unknowns.

    The first is the difference (1) of the whole intervals, the others are sums (2) of mirrored parts, one for each term
    of friction; each is the mean over the pairs. The standard errors propagate the scatter of the least squares.
    """
    balance = fit.balance
    unknowns, pairs = len(balance.terms), len(balance.pairs)
    combine = np.zeros((unknowns, pairs, 2, PARTS))
    combine[0] = np.array([1.0, -1.0])[:, None] / pairs
    for equation, chosen in enumerate(np.array_split(np.arange(PARTS), unknowns - 1), start=1):
        combine[equation, :, :, chosen] = 1.0 / pairs
    flat = combine.reshape(unknowns, -1)
    solved = np.linalg.solve(flat @ balance.rows, flat)
    variance = float(fit.residuals_J @ fit.residuals_J) / (len(balance.rows) - unknowns)
    return estimate_from(balance.terms, solved @ balance.work_J, variance * solved @ solved.T, ideal)


def two_intervals(balance: Balance, fit: EnergyFit) -> YawMethodEstimate:
    """(1) and (2), the mean over the pairs, with its bias against the least squares `fit` of actual speeds.

    The standard error is the scatter of the pairs, without their common bias. With D the work against friction and S
    the change of w^2 in an interval, the parts of the bias are (D12 - D56)/S12 and (J + lambda)(-S56 - S12)/(2 S12).
    """
    works: list[tuple[float, float]] = balance.whole(balance.work_J).tolist()
    speeds: list[tuple[float, float]] = [pair[0].rate_radps[[0, -1]].tolist() for pair in balance.pairs]
    inertia = [inertia_from_work(*work, *ends) for work, ends in zip(works, speeds, strict=True)]
    lost = [dissipation_from_work(*work) for work in works]
    few = len(works) < 2
    errors = [None if few else float(np.std(each, ddof=1) / math.sqrt(len(works))) for each in (inertia, lost)]
    measured = fit.balance
    square = measured.whole(2 * measured.rows[:, 0])
    friction = measured.whole(measured.rows[:, 1:] @ fit.coefficients[1:])
    speeding, braking = square[:, 0], -square[:, 1]
    total = float(np.mean(inertia))
    return YawMethodEstimate(
        total_inertia_kgm2=total,
        total_inertia_standard_error_kgm2=errors[0],
        dissipation_J=float(np.mean(lost)),
        dissipation_standard_error_J=errors[1],
        bias_against_least_squares_kgm2=total - float(fit.coefficients[0]),
        bias_from_kgm2={
            "dissipation": float(np.mean((friction[:, 0] - friction[:, 1]) / speeding)),
            "speeds": float(np.mean(fit.coefficients[0] * (braking - speeding) / (2 * speeding))),
        },
        total_inertia_by_hump_kgm2=tuple(inertia),
    )
