"""Forces that the hidden effects add: of the true ship less of the card's, at the true motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gap_truth.gear import Gear
from gap_truth.integrate import TICK_S, R, U, V, Batch, integrate
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

    def __call__(
        self, true: Batch, t: float, steps: int, states: list[Array], order: Array, rudder: Array, rpm_ratio: Array
    ) -> None:
        """Store the forces of a tick, and turn the healthy rudders."""
        healthy = [self._gear.advance(order, t + step * TICK_S / steps, TICK_S / steps)[0] for step in range(steps)][0]
        more = true.rates(t, states, rpm_ratio, rudder)[0] - self._batch.rates(t, states[:1], rpm_ratio, healthy)[0]
        b = self._batch
        prime = [b.m11 * more[U], b.m22 * more[V] + b.m23 * self._length * more[R]]
        prime.append((b.m32 * more[V] + b.m33 * self._length * more[R]) * self._length)
        self.forces.append(0.5 * WATER_KGPM3 * self._length**3 * np.array(prime))

    @property
    def _length(self) -> float:
        return self._batch.hull.length_m


def added_forces(setting: Setting) -> dict[str, Array]:
    """X, Y (N) and N (N m) (ticks, 3) at 10 Hz by trial that the effects of a set add to the ship as the card has it."""
    lanes = lanes_of(setting)
    watched = _Watched(lanes)
    integrate(lanes, watched)
    every = np.array(watched.forces)
    counts = {lane.trial: round(lane.manoeuvre.duration_s / TICK_S) + 1 for lane in lanes}
    return {name: every[:count, :, place] for place, (name, count) in enumerate(counts.items())}
