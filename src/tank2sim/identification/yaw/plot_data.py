"""Chart data of records of the yaw rig: histories with the programme, the energy balance of the parts, residuals.

For JSON: plain lists, thinned for a chart.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from tank2sim.arrays import Columns
from tank2sim.identification.yaw.energy import EnergyFit
from tank2sim.identification.yaw.output_error import AngleFit
from tank2sim.records.thinning import drawn_columns
from tank2sim.records.yaw import YawRecord

_HISTORY_SAMPLES = 900
"""Samples of a record, enough to show each peak of its signals."""

STAGES = ("accelerating", "braking")


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


def balance_as_json(fit: EnergyFit) -> dict[str, Any]:
    """Work of the motor and of each term in each part of the intervals, J: means over all pairs, in order of time."""
    balance = fit.balance
    shape = (len(balance.pairs), 2, balance.parts)
    # Braking parts are numbered as mirror images.
    order = (slice(None), slice(None, None, -1))

    def stages(values: np.ndarray) -> dict[str, list[float]]:
        mean = values.reshape(shape).mean(axis=0)
        return {name: mean[place][order[place]].tolist() for place, name in enumerate(STAGES)}

    spent = balance.rows * fit.coefficients
    return {
        "motor_J": stages(balance.work_J),
        "spent_J": {term: stages(spent[:, column]) for column, term in enumerate(balance.terms)},
    }


def residuals_as_json(fit: EnergyFit) -> list[dict[str, Any]]:
    """Residual work of each subinterval, J, with its mean rate, deg/s."""
    balance, residuals = fit.balance, iter(fit.residuals_J.tolist())
    return [
        {
            "stage": STAGES[interval.braking],
            "hump": interval.number + 1,
            "rate_degps": float(np.degrees(np.mean(interval.part(part, balance.parts).rate_radps))),
            "left_J": next(residuals),
        }
        for pair in balance.pairs
        for interval in pair
        for part in range(balance.parts)
    ]


def angle_residual_as_json(angle: AngleFit | None) -> Columns | None:
    """Residual angle of the integrated equation, with a gap (nan) between fitted parts."""
    if angle is None:
        return None
    time, residual = angle.time_s, angle.residual_rad
    breaks = np.flatnonzero(np.abs(np.diff(time)) > 1.0) + 1
    time = np.insert(time, breaks, time[breaks - 1] + 0.01)
    return drawn_columns({"t_s": time, "residual_rad": np.insert(residual, breaks, np.nan)}, peaks=True)
