"""From the order to the rudder in the water: telemotor, dead band, servo, play and bias."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gap_truth.lane import Lane
from gap_truth.ship import GEAR_ANGLE_DEG, Array


def _of(lanes: Sequence[Lane], effect: str, parameter: str, otherwise: float) -> Array:
    return np.array([lane.value(effect, parameter, otherwise) for lane in lanes])


class Gear:
    """The steering gears of all lanes; the ship feels the stock, turned by the gear through the play.

    A healthy gear runs at (order - angle)/T within a rate. A rate limit is a pump that bends over to its largest
    flow (tanh), a lag has a second stage of a twentieth of it in front, a telemotor likewise in front of all.
    """

    def __init__(self, lanes: Sequence[Lane]) -> None:
        n = len(lanes)
        hull = lanes[0].setting.hull
        self.angle, self.stock = np.zeros(n), np.zeros(n)
        self.stages = [np.zeros(n) for _ in range(3)]
        telemotor = _of(lanes, "telemotor_lag", "time_constant_s", 0.0)
        lag = _of(lanes, "rudder_lag", "time_constant_s", 0.0)
        self.stage_times = (0.95 * telemotor, 0.05 * telemotor, 0.05 * lag)
        self.time = np.where(lag > 0.0, 0.95 * lag, hull.gear_time_s)
        limit = np.radians(_of(lanes, "rudder_rate_limit", "max_rate_degps", 0.0))
        self.soft = limit > 0.0
        self.rate = np.where(self.soft, limit, np.radians(hull.gear_rate_degps))
        self.band = np.radians(_of(lanes, "rudder_dead_band", "half_width_deg", 0.0))
        self.play = 0.5 * np.radians(_of(lanes, "rudder_backlash", "width_deg", 0.0))
        self.bias = np.radians(_of(lanes, "rudder_bias", "angle_deg", 0.0))
        self.stuck_from = _of(lanes, "out_rudder_stuck", "t0", np.inf)
        self.stuck_until = self.stuck_from + _of(lanes, "out_rudder_stuck", "dur", 0.0)

    def advance(self, order: Array, t: float, step_s: float) -> tuple[Array, Array]:
        """Rudder (rad, starboard) in the water at `t` and a step later, under an order held meanwhile."""
        before = self.stock + self.bias
        signal = order
        for number, time in enumerate(self.stage_times):  # exact for a held input
            there = time > 0.0
            if not there.any():
                continue
            share = np.where(there, 1.0 - np.exp(-step_s / np.where(there, time, 1.0)), 1.0)
            self.stages[number] = np.where(there, self.stages[number] + share * (signal - self.stages[number]), signal)
            signal = self.stages[number]
        middle = self.angle + 0.5 * step_s * self._rate(signal, self.angle)
        new = self.angle + step_s * self._rate(signal, middle)
        stuck = (t >= self.stuck_from) & (t < self.stuck_until)
        end = np.radians(GEAR_ANGLE_DEG)
        self.angle = np.where(stuck, self.angle, _within(new, -end, end))
        self.stock = _within(self.stock, self.angle - self.play, self.angle + self.play)
        return before, self.stock + self.bias

    def _rate(self, signal: Array, angle: Array) -> Array:
        off = signal - angle
        off = np.sign(off) * np.maximum(np.abs(off) - self.band, 0.0)
        wanted = off / self.time
        rate = _within(wanted, -self.rate, self.rate)
        if self.soft.any():
            rate = np.where(self.soft, self.rate * np.tanh(wanted / self.rate), rate)
        return rate


def _within(values: Array, low: Array | float, high: Array | float) -> Array:
    """As numpy's clip, which takes several times as long with few lanes."""
    held: Array = np.minimum(np.maximum(values, low), high)
    return held
