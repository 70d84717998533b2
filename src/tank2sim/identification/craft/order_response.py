"""Dead band and lag of thrusters from trials that hold their orders and their revolutions.

    n' = (g o - n)/T,    o the order, 0 within the dead band; g ahead and astern

by least squares of the revolutions, simulated from the first reading of each trial with orders that hold until the next
(output error; Ljung 1999, System Identification, 2nd ed., 10.2). The dead band lies between the largest order that left
the propeller at rest and the least one that turned it: without an order of either kind near it, it is not determined.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from tank2sim.arrays import Array
from tank2sim.cards.card import SteeredCard
from tank2sim.identification.craft.problem import twins
from tank2sim.records.trials import Trial, sampling_step

LARGEST_BAND = 0.3
"""Largest dead band that is looked for, over the largest order (project choice: thrusters have up to a tenth)."""

LONGEST_LAG_S = 5.0
"""Longest lag that is looked for, s (project choice: electric thrusters of small craft have less than 1 s)."""

SURELY_WORSE = 9.0
"""By how much the sum of squares over the variance of a sample rises at a dead band that is excluded: three standard
deviations, with as many independent samples as :data:`INDEPENDENT_S` apart (project choice)."""

INDEPENDENT_S = 1.0
"""Time after which errors of the revolutions count as independent, s (project choice: of speed controllers)."""

_LEVEL = 1e-3
"""Orders that differ by less of the largest are one level: rounding of pulse widths (project choice)."""


@dataclass(frozen=True)
class OrderResponse:
    """How a thruster follows its orders."""

    # `lag_s`, `lag_error_s`: T and its standard error
    lag_s: float
    lag_error_s: float
    # `rest_radps`, `turning_radps`: Largest order at which the propeller rested, 0 without any, and least one at which
    # it turned, rad/s
    rest_radps: float
    turning_radps: float

    @property
    def dead_band(self) -> tuple[float, float] | None:
        """Dead band and its standard error, rad/s: the middle of its bounds, and the deviation of a value anywhere
        between them.

        None where no order left the propeller at rest.
        """
        if self.rest_radps == 0:
            return None
        width = self.turning_radps - self.rest_radps
        return self.rest_radps + width / 2, width / np.sqrt(12)


def order_responses(card: SteeredCard, trials: Sequence[Trial]) -> dict[str, OrderResponse]:
    """The response of each thruster whose orders and revolutions are in the trials; those that share numbers have one.

    `trials`: By :func:`tank2sim.records.craft_trials.read_craft_trial`.
    """
    first, shared = card.thrusters[0].name, twins(card)
    found: dict[str, OrderResponse] = {}
    for thruster in card.thrusters:
        if thruster.name in shared:
            if first in found:
                found[thruster.name] = found[first]
            continue
        names = [thruster.name, *(shared if thruster.name == first else ())]
        runs = [run for trial in trials for name in names if (run := _run(trial, name)) is not None]
        response = _response(runs, max(thruster.max_radps, -thruster.lowest_radps)) if runs else None
        if response is not None:
            found[thruster.name] = response
    return found


_Run = tuple[float, Array, Array]
"""Step (s), orders and revolutions (n,), rad/s."""


def _run(trial: Trial, name: str) -> _Run | None:
    order, speed = (trial.signals.get(f"{what}_{name}_radps") for what in ("order", "n"))
    if order is None or speed is None:
        return None
    known = np.isfinite(order)
    if not known.any() or not np.isfinite(speed).all():
        return None
    place = np.maximum.accumulate(np.where(known, np.arange(len(order)), np.flatnonzero(known)[0]))
    return sampling_step(trial), order[place], speed


def _response(runs: Sequence[_Run], largest: float) -> OrderResponse | None:
    levels = np.unique(np.round(np.concatenate([np.abs(order) for _, order, _ in runs]) / largest / _LEVEL)) * _LEVEL
    levels = levels[levels > 0] * largest
    if not len(levels):
        return None
    edges = [0.0, *(level for level in levels if level <= LARGEST_BAND * largest)]
    bands = [edge + _LEVEL * largest / 2 for edge in edges]
    count = sum(len(speed) for _, _, speed in runs)
    lag = _best_lag(runs, bands[0])
    costs = np.array([_cost(runs, lag, band) for band in bands])
    best = int(np.argmin(costs))
    lag = _best_lag(runs, bands[best])
    costs = np.array([_cost(runs, lag, band) for band in bands])
    variance = costs.min() / count
    step = float(np.median([each for each, _, _ in runs]))
    independent = min(1.0, step / INDEPENDENT_S)
    possible = np.flatnonzero(independent * (costs - costs.min()) < SURELY_WORSE * max(variance, 1e-12))
    above = levels[levels > edges[possible[-1]] + _LEVEL * largest / 2]
    if not len(above):
        return None
    low, middle, high = (_cost(runs, factor * lag, bands[best]) for factor in (0.95, 1.0, 1.05))
    curvature = (low - 2 * middle + high) / (0.05 * lag) ** 2
    error = np.sqrt(2 * variance / max(curvature, 1e-12) / independent)
    # A change of order is known to a part of a step.
    return OrderResponse(lag, float(np.hypot(error, step / np.sqrt(12))), float(edges[possible[0]]), float(above[0]))


def _best_lag(runs: Sequence[_Run], band: float) -> float:
    step = min(each for each, _, _ in runs)
    bounds = np.log(0.1 * step), np.log(LONGEST_LAG_S)
    return float(np.exp(minimize_scalar(lambda z: _cost(runs, float(np.exp(z)), band), bounds=bounds).x))


def _cost(runs: Sequence[_Run], lag: float, band: float) -> float:
    """Sum of squared errors of the revolutions (rad2/s2) with the gains ahead and astern that fit best."""
    from scipy.signal import lfilter  # slow to import

    columns, wanted = [], []
    for step, order, speed in runs:
        kept = np.exp(-step / lag)
        turning = np.where(np.abs(order) > band, order, 0.0)
        turning = np.append((turning[:-1] + turning[1:]) / 2, turning[-1])  # it changed half a step before, on average
        parts = [np.maximum(turning, 0.0), np.minimum(turning, 0.0)]
        columns.append([np.concatenate([[0.0], lfilter([1 - kept], [1, -kept], part)[:-1]]) for part in parts])
        wanted.append(speed - speed[0] * kept ** np.arange(len(speed)))
    A, b = np.concatenate(columns, axis=1).T, np.concatenate(wanted)
    gains = np.linalg.lstsq(A, b, rcond=None)[0]
    return float(((A @ gains - b) ** 2).sum())
