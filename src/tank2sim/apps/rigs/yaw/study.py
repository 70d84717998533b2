"""Study of records of the yaw rig: estimates by method, theory, and the data of the charts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tank2sim.apps.rigs.yaw.energy import EnergyFit, YawMethodEstimate
from tank2sim.apps.rigs.yaw.records import YawRecord
from tank2sim.apps.rigs.yaw.theory import TheoryValue
from tank2sim.arrays import Array, Columns
from tank2sim.notices import Notice
from tank2sim.records.thinning import drawn_columns

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
    shape = (len(balance.pairs), 2, balance.parts)
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
            rate_degps=float(np.degrees(np.mean(interval.part(part, balance.parts).rate_radps))),
            left_J=next(residuals),
        )
        for pair in balance.pairs
        for interval in pair
        for part in range(balance.parts)
    )


def angle_residual(time_s: Array, residual_rad: Array) -> Columns:
    """Residual angle of the integrated equation, with a gap (nan) between fitted parts."""
    breaks = np.flatnonzero(np.abs(np.diff(time_s)) > 1.0) + 1
    time = np.insert(time_s, breaks, time_s[breaks - 1] + 0.01)
    return drawn_columns({"t_s": time, "residual_rad": np.insert(residual_rad, breaks, np.nan)}, peaks=True)
