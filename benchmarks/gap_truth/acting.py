"""Forces that the hidden effects add: of the true ship less of the card's, at the true motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gap_truth.gear import Gear
from gap_truth.integrate import TICK_S, Batch, R, Tick, U, V, integrate
from gap_truth.lane import Lane, Setting, lanes_of
from gap_truth.ship import WATER_KGPM3, Array, perturbed


class _Watched:
    """Forces (ticks, 3, n) that a batch has and the same ships without effects, with healthy gears, have not."""

    def __init__(self, lanes: list[Lane]) -> None:
        setting = lanes[0].setting
        coefficients = perturbed(setting.hull, setting.coefficients, setting.generator("coefficients"))
        healthy = [replace(lane, effects={}, coefficients=coefficients) for lane in lanes]
        self._batch, self._gear = Batch(healthy), Gear(healthy)
        self.forces: list[Array] = []

    def __call__(self, true: Batch, tick: Tick) -> None:
        """Store the forces of a tick, and turn the healthy rudders."""
        b, t, states, step_s = self._batch, tick.t, tick.states, TICK_S / tick.steps
        healthy, *_ = [self._gear.advance(tick.order, t + step * step_s, step_s)[0] for step in range(tick.steps)]
        with_effects, *_ = true.rates(t, states, tick.rpm_ratio, tick.rudder)
        without, *_ = b.rates(t, states[:1], tick.rpm_ratio, healthy)
        more = with_effects - without
        prime = [b.m11 * more[U], b.m22 * more[V] + b.m23 * self._length * more[R]]
        prime.append((b.m32 * more[V] + b.m33 * self._length * more[R]) * self._length)
        self.forces.append(0.5 * WATER_KGPM3 * self._length**3 * np.array(prime))

    @property
    def _length(self) -> float:
        return self._batch.hull.length_m


def added_forces(setting: Setting) -> dict[str, Array]:
    """X, Y (N) and N (N m) that the effects of a set add to the ship of the card: trial to (ticks, 3) at 10 Hz."""
    lanes = lanes_of(setting)
    watched = _Watched(lanes)
    integrate(lanes, watched)
    every = np.array(watched.forces)
    counts = {lane.trial: round(lane.manoeuvre.duration_s / TICK_S) + 1 for lane in lanes}
    return {name: every[:count, :, place] for place, (name, count) in enumerate(counts.items())}
