"""The intervals of a yaw record for the energy method: rate, work of the motor, and work of each term of (3).

The rate of the body is not measured: the encoder counts pulses. A spline is fitted to the changes of the count, where
the angle is known to the time of a sample, and not to the counts between, whose error is up to a pulse.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Literal

import casadi as ca
import numpy as np
from scipy.interpolate import BSpline, make_lsq_spline

from tank2sim.apps.rigs.yaw.card import YawRig
from tank2sim.apps.rigs.yaw.model import wall_terms
from tank2sim.apps.rigs.yaw.records import YawRecord
from tank2sim.arrays import Array
from tank2sim.errors import InputError

Speeds = Literal["actual", "reference"]

KNOTS_S = (0.5, 0.35, 0.25, 0.17, 0.1)
"""Candidate distances of the spline's knots: the shortest follows the swings of a closed loop of some 0.1 s, the
longest smooths more of an encoder's noise. Each interval uses that of least generalised cross-validation (Craven &
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


@dataclass(frozen=True, eq=False, kw_only=True)
class Interval:
    """Motion in one interval, at rising times; arrays (n,).

    Parameters
    ----------
    time_s, angle_rad, rate_radps, acceleration_radps2, current_A : array
    braking : bool
    number : int
        Number of its pair.
    """

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

    def part(self, place: int, parts: int) -> Interval:
        """One of `parts` equal parts in time; a braking interval's are counted from its end, as mirror images."""
        if self.braking:
            place = parts - 1 - place
        length = (self.time_s[-1] - self.time_s[0]) / parts
        low = self.time_s[0] + place * length
        inside = (self.time_s > low + 1e-9) & (self.time_s < low + length - 1e-9)
        time = np.concatenate([[low], self.time_s[inside], [low + length]])

        def cut(values: Array) -> Array:
            at_times: Array = np.interp(time, self.time_s, values)
            return at_times

        return replace(
            self,
            time_s=time,
            angle_rad=cut(self.angle_rad),
            rate_radps=cut(self.rate_radps),
            acceleration_radps2=cut(self.acceleration_radps2),
            current_A=cut(self.current_A),
        )


Work = Callable[[Interval], float]


def _change_of_square(interval: Interval) -> float:
    return float(interval.rate_radps[-1] ** 2 - interval.rate_radps[0] ** 2) / 2


def _swept(power: int) -> Work:
    return lambda interval: interval.integral(np.abs(interval.rate_radps) ** power)


ENERGY_TERMS: dict[str, tuple[Work, str]] = {
    "inertia": (_change_of_square, "kgm2"),
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


def intervals(record: YawRecord, speeds: Speeds = "actual") -> tuple[tuple[Interval, Interval], ...]:
    """Accelerating and braking interval of each pair of a record's programme.

    Parameters
    ----------
    speeds : str
        ``actual``, as measured, or ``reference``, of the programme.

    Raises
    ------
    InputError
        An interval has too few steps of the encoder.
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

    Raises
    ------
    InputError
        The encoder steps too rarely there.
    """
    begin, end = ends[0] - _MARGIN_S, ends[1] + _MARGIN_S
    time, angle = record.time_s, record.angle_rad
    within = (time >= begin) & (time <= end)
    time, angle = time[within], angle[within]
    changed = np.diff(angle) != 0
    # Between two samples of different counts the angle passed their middle, at about the middle of the two times.
    middle, value = (time[1:] + time[:-1])[changed] / 2, (angle[1:] + angle[:-1])[changed] / 2
    fewest = max(1, round((end - begin) / KNOTS_S[0])) + _DEGREE
    if len(middle) < STEPS_PER_COEFFICIENT * fewest:
        problem = (
            f"has {len(middle)} steps of the encoder from {begin:.3g} to {end:.3g} s, and "
            f"{STEPS_PER_COEFFICIENT * fewest} are needed"
        )
        remedy = "take an encoder with more pulses, a faster programme, or sample more often"
        raise InputError(record.path, "column phi_rad", problem, remedy)
    splines = [spline for knot in KNOTS_S if (spline := _spline(middle, value, knot)) is not None]
    if not splines:
        problem = f"does not move for a while between {begin:.3g} and {end:.3g} s, where the programme moves"
        raise InputError(record.path, "column phi_rad", problem, "check start_s, rise_s and the encoder")
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


def motor_work(interval: Interval, torque_constant_NmpA: float, rig: YawRig | None = None) -> float:
    """k_t int w I dt less the work against known effects, J."""
    work = torque_constant_NmpA * interval.integral(interval.rate_radps * interval.current_A)
    return work - known_work(interval, rig) if rig else work


def mirror_difference(pair: tuple[Interval, Interval]) -> float:
    """Largest difference of the rates of two mirrored intervals, over their largest rate."""
    speeding, braking = pair
    x = np.linspace(0, 1, 101)

    def at(interval: Interval, share: Array) -> Array:
        time = interval.time_s[0] + share * (interval.time_s[-1] - interval.time_s[0])
        rate: Array = np.abs(np.interp(time, interval.time_s, interval.rate_radps))
        return rate

    speeding_rates, braking_rates = at(speeding, x), at(braking, 1 - x)
    return float(np.max(np.abs(speeding_rates - braking_rates)) / max(speeding_rates.max(), braking_rates.max()))


def work_rows(interval: Interval, terms: Mapping[str, float] | tuple[str, ...], parts: int) -> list[list[float]]:
    """Work per unit of each term in each part of an interval."""
    return [[ENERGY_TERMS[term][0](interval.part(place, parts)) for term in terms] for place in range(parts)]
