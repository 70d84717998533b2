"""The energy method on records of the yaw rig: two intervals, (1) and (2), and several subintervals.

Over any stretch of time the work of the motor is that against each term of (3):

    k_t int w I dt = (J + lambda661) D(w^2)/2 + f_c int |w| dt + f_1 int w^2 dt + f_662 int |w|^3 dt

The least squares over subintervals need no mirror images. The two-interval formulas assume the same dissipation in both
intervals; a control loop with a lag makes them differ, which biases the formulas.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from tank2sim.apps.rigs.yaw.card import YawRig
from tank2sim.apps.rigs.yaw.intervals import Interval, motor_work, work_rows
from tank2sim.apps.rigs.yaw.programme import dissipation_from_work, inertia_from_work
from tank2sim.apps.rigs.yaw.records import YawRecord
from tank2sim.arrays import Array
from tank2sim.errors import InputError
from tank2sim.identification.conditioning import column_norms, scaled_condition


@dataclass(frozen=True, kw_only=True)
class YawEstimate:
    """Estimates by one method, SI.

    Parameters
    ----------
    method : str
    total_inertia_kgm2, inertia_error_kgm2 : float
        J_zz + lambda661 (in air J_zz) and its standard error; None where the data do not determine it.
    dissipation_J, dissipation_error_J : float
        B + D over one interval.
    friction : mapping
        Other terms of :data:`tank2sim.apps.rigs.yaw.intervals.ENERGY_TERMS` to (value, standard error), in SI.
    misfit : float or None
        Root mean square of the residuals: J for methods of energy, rad for those of the angle.
    bias_kgm2 : float or None
        Difference of a two-interval formula from the energy least squares of the same records.
    bias_from : mapping
        Parts of the bias: ``dissipation`` (different in both intervals) and ``speeds`` (w1, w2 differ from w6, w5).
    by_hump_kgm2 : tuple of float
        J_zz + lambda661 of each pair of intervals by a two-interval formula, of which the estimate is the mean.
    """

    method: str
    total_inertia_kgm2: float
    inertia_error_kgm2: float | None
    dissipation_J: float
    dissipation_error_J: float | None
    friction: Mapping[str, tuple[float, float | None]] = field(default_factory=dict)
    misfit: float | None = None
    bias_kgm2: float | None = None
    bias_from: Mapping[str, float] = field(default_factory=dict)
    by_hump_kgm2: tuple[float, ...] = ()


IntervalPair = tuple[Interval, Interval]

PARTS = 6
"""Subintervals of an interval: with six, each of some 0.3 s in the paper's programme, the four terms of (3) are well
distinguished; more subintervals are too short for the spline of the rate."""

_HOPELESS = 1e7


@dataclass(frozen=True, eq=False, kw_only=True)
class Balance:
    """The energy balance of every subinterval.

    Parameters
    ----------
    terms : tuple of str
    rows : array, (n, terms)
        Work per unit of each term.
    work_J : array, (n,)
        Work of the motor, less known work.
    pairs : tuple
        The intervals; row ``((pair * 2 + braking) * parts + part)``.
    parts : int
    """

    terms: tuple[str, ...]
    rows: Array
    work_J: Array
    pairs: tuple[IntervalPair, ...]
    parts: int

    def whole(self, values: Array) -> Array:
        """Sums over the parts of each interval of a number for each subinterval, (pairs, 2)."""
        sums: Array = values.reshape(len(self.pairs), 2, self.parts).sum(axis=2)
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
    parts: int = PARTS,
) -> Balance:
    """The balance of every subinterval of mirror pairs; `rig` has the known effects beyond (3)."""
    rows, work = [], []
    for pair in pairs:
        for interval in pair:
            rows += work_rows(interval, terms, parts)
            work += [motor_work(interval.part(place, parts), torque_constant_NmpA, rig) for place in range(parts)]
    return Balance(terms=terms, rows=np.array(rows), work_J=np.array(work), pairs=tuple(pairs), parts=parts)


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
        unknowns = ", ".join(balance.terms)
        raise InputError(
            record.path, "", f"does not distinguish {unknowns}", "give more records, or take fewer --terms"
        )
    inverse = _inverse(rows, rows if programmed is None else programmed.rows)
    coefficients = inverse @ work
    residuals = work - rows @ coefficients
    # Errors of neighbouring parts are correlated: they share the speed at their common end. The covariance is therefore
    # that of the residuals of whole intervals, where it is larger.
    variance = float(residuals @ residuals) / freedom
    spread = np.diag(np.full(len(rows), variance))
    covariance = inverse @ spread @ inverse.T
    clustered = _clustered(inverse, residuals, balance)
    scale = np.maximum(1.0, np.sqrt(np.diag(clustered) / np.diag(covariance)))
    return EnergyFit(coefficients, covariance * np.outer(scale, scale), residuals, balance)


def _inverse(rows: Array, instruments: Array) -> Array:
    """(Z'X)^-1 Z'; with Z = X that of least squares."""
    norms, instrument_norms = column_norms(rows), column_norms(instruments)
    scaled = (instruments / instrument_norms).T
    return np.linalg.solve(scaled @ (rows / norms), scaled) / norms[:, None]


def _clustered(inverse: Array, residuals: Array, balance: Balance) -> Array:
    """Covariance from the scatter of whole intervals, each taken as one draw (Liang & Zeger 1986)."""
    count = 2 * len(balance.pairs)
    each = (inverse * residuals).reshape(len(balance.terms), count, balance.parts).sum(axis=2)
    correction = count / max(1, count - 1)
    covariance: Array = correction * each @ each.T
    return covariance


def least_squares_estimate(method: str, fit: EnergyFit, ideal: Interval) -> YawEstimate:
    """The estimate of a fit; the dissipation is that of the `ideal` interval of the programme."""
    return estimate_from(
        method,
        fit.balance.terms,
        fit.coefficients,
        fit.covariance,
        ideal,
        math.sqrt(float(np.mean(fit.residuals_J**2))),
    )


def estimate_from(
    method: str,
    terms: tuple[str, ...],
    values: Array,
    covariance: Array,
    ideal: Interval,
    misfit: float | None = None,
) -> YawEstimate:
    """An estimate from coefficients of terms, the first of them the inertia, and their covariance."""
    errors = np.sqrt(np.diag(covariance))
    conserved = np.array([term == "inertia" or term.startswith("gravity") for term in terms])
    against = np.where(conserved, 0.0, work_rows(ideal, terms, 1)[0])
    return YawEstimate(
        method=method,
        total_inertia_kgm2=float(values[0]),
        inertia_error_kgm2=float(errors[0]),
        dissipation_J=float(against @ values),
        dissipation_error_J=float(math.sqrt(against @ covariance @ against)),
        friction={term: (float(values[n]), float(errors[n])) for n, term in enumerate(terms) if n},
        misfit=misfit,
    )


def as_many_equations(method: str, fit: EnergyFit, ideal: Interval) -> YawEstimate:
    """The paper's method: as many equations as unknowns.

    The first is the difference (1) of the whole intervals, the others are sums (2) of mirrored parts, one for each term
    of friction; each is the mean over the pairs. The standard errors propagate the scatter of the least squares.
    """
    balance = fit.balance
    unknowns, pairs, parts = len(balance.terms), len(balance.pairs), balance.parts
    sign = np.array([1.0, -1.0])
    combine = np.zeros((unknowns, pairs, 2, parts))
    combine[0] = sign[:, None] / pairs
    for equation, chosen in enumerate(np.array_split(np.arange(parts), unknowns - 1), start=1):
        for part in chosen:
            combine[equation, :, :, part] = 1.0 / pairs
    flat = combine.reshape(unknowns, -1)
    solved = np.linalg.solve(flat @ balance.rows, flat)
    variance = float(fit.residuals_J @ fit.residuals_J) / (len(balance.rows) - unknowns)
    return estimate_from(method, balance.terms, solved @ balance.work_J, variance * solved @ solved.T, ideal)


def two_intervals(method: str, balance: Balance, fit: EnergyFit) -> YawEstimate:
    """(1) and (2), the mean over the pairs, with its bias against the least squares `fit` of actual speeds.

    The standard error is the scatter of the pairs, without their common bias.
    """
    work = balance.whole(balance.work_J)
    inertia, lost = [], []
    for pair, (accelerating, braking) in zip(balance.pairs, work, strict=True):
        w1, w2 = float(pair[0].rate_radps[0]), float(pair[0].rate_radps[-1])
        inertia.append(inertia_from_work(float(accelerating), float(braking), w1, w2))
        lost.append(dissipation_from_work(float(accelerating), float(braking)))
    total = float(np.mean(inertia))
    return YawEstimate(
        method=method,
        total_inertia_kgm2=total,
        inertia_error_kgm2=_mean_error(inertia),
        dissipation_J=float(np.mean(lost)),
        dissipation_error_J=_mean_error(lost),
        bias_kgm2=total - float(fit.coefficients[0]),
        bias_from=_bias_parts(fit),
        by_hump_kgm2=tuple(inertia),
    )


def _mean_error(values: list[float]) -> float | None:
    return float(np.std(values, ddof=1) / math.sqrt(len(values))) if len(values) > 1 else None


def _bias_parts(fit: EnergyFit) -> dict[str, float]:
    """Parts of the bias of (1) with actual speeds: with D the work against friction and S the change of w^2 in an
    interval, (D12 - D56)/S12 and (J + lambda)(-S56 - S12)/(2 S12), each the mean over the pairs."""
    balance = fit.balance
    square = balance.whole(2 * balance.rows[:, 0])
    lost = balance.whole(balance.rows[:, 1:] @ fit.coefficients[1:])
    speeding, braking = square[:, 0], -square[:, 1]
    return {
        "dissipation": float(np.mean((lost[:, 0] - lost[:, 1]) / speeding)),
        "speeds": float(np.mean(fit.coefficients[0] * (braking - speeding) / (2 * speeding))),
    }
