"""One trial, replayed in winds and currents that are constant over it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import OptimizeResult, least_squares

from tank2sim.arrays import Array
from tank2sim.cards.card import SteeredCard
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.dynamics.effects.effect import EffectParameter
from tank2sim.gap.proof.open_loop import InputRecord, Replayer, difference_slopes, input_record
from tank2sim.gap.result import Surroundings
from tank2sim.records.trials import Trial

ByTrial = Mapping[str, Mapping[str, Surroundings]]
"""Effect to the name of a trial to its wind or current."""

_DIRECTIONS, _SHARES = 8, (0.5, 1.0, 1.5)
"""Directions, and shares of the typical speed, at which a search for the surroundings of a trial begins, in addition to
none at all (project choice)."""

_FIRST_PART = 1 / 3
"""Share of a record that the surroundings are fitted to first (project choice): over its whole length a motion in the
wrong wind may turn the other way, and a search is then lost."""

STEP_SHARE = 1e-3
"""Differences are taken over this share of the typical speed, and of the spread of a coefficient (project choice:
rounding and curvature are both far below the noise)."""

_FAR = 1e4
"""Noise units in place of a motion out of bounds: further than any that is within."""


def with_columns(trial: Trial, found: ByTrial) -> Trial:
    """A trial with its winds and currents as if they had been recorded."""
    signals = dict(trial.signals)
    for effect, by_trial in found.items():
        if trial.name in by_trial:
            names = EFFECTS[effect].measured_as
            signals[names["speed_mps"]] = np.full(len(trial.time_s), by_trial[trial.name].speed_mps)
            signals[names["direction_rad"]] = np.full(len(trial.time_s), by_trial[trial.name].direction_rad)
    return replace(trial, signals=signals)


def typical_speed(card: SteeredCard, name: str) -> float:
    """Size of a usual wind or current, m/s."""
    return max(map(abs, _speed_of(name).typical_values(card)))


def largest_speed(name: str) -> float:
    """The strongest wind or current that is possible, m/s."""
    return _speed_of(name).maximum


def _speed_of(name: str) -> EffectParameter:
    (speed,) = (parameter for parameter in EFFECTS[name].parameters if parameter.name == "speed_mps")
    return speed


class SurroundedTrial:
    """One trial, replayed in winds and currents: parts (2 m,) along north and east, m/s, of m effects."""

    def __init__(
        self,
        card: SteeredCard,
        driven_by: str,
        trial: Trial,
        effects: Sequence[str],
        noise: Mapping[str, float],
    ):
        self.name, self._effects = trial.name, effects
        self.replayer = Replayer(card, driven_by, noise)
        self.typical = np.repeat([typical_speed(card, name) for name in effects], 2)
        names = self.replayer.model.input_names
        self._places = [
            tuple(names.index(EFFECTS[name].model_names()[key]) for key in ("speed_mps", "direction_rad"))
            for name in effects
        ]
        still = self.still = input_record(
            self.replayer, with_columns(trial, self._in_trial(np.zeros(len(self.typical))))
        )
        self._known = still.known
        self.passage = self.replayer.passage_s / float(np.median(np.diff(still.times)))
        self._state = self.replayer.guess_initial_state(still, self.replayer.model.parameter_values())
        self.compare(1.0)

    def compare(self, begin: float, end: float | None = None) -> None:
        """Compare readings up to a share `begin` of the record, or from there to `end`."""
        share = np.arange(len(self._known)) / len(self._known)
        inside = share < begin if end is None else (share >= begin) & (share < end)
        inside[0] |= not inside.any()
        self._compared = self._known & inside[:, None]
        self.count = int(self._compared.sum())

    def surroundings(self, parts: Array) -> dict[str, Surroundings]:
        """Each effect's wind or current."""
        pairs = zip(self._effects, np.reshape(parts, (-1, 2)), strict=True)
        return {name: Surroundings.of_parts(pair, np.zeros(2)) for name, pair in pairs}

    def _in_trial(self, parts: Array) -> ByTrial:
        return {name: {self.name: at} for name, at in self.surroundings(parts).items()}

    def _record(self, parts: Array) -> InputRecord:
        inputs = self.still.inputs.copy()
        for places, pair in zip(self._places, np.reshape(parts, (-1, 2)), strict=True):
            inputs[:, places] = np.hypot(*pair), np.arctan2(pair[1], pair[0])
        return replace(self.still, inputs=inputs)

    def away(self, parts: Array, p: Array) -> Array:
        """Simulated less measured (count,), noise units."""
        record = self._record(parts)
        away = (self.replayer.motion(record, self._state, p) - record.readings) / self.replayer.sigma
        bounded: Array = np.nan_to_num(away[self._compared], nan=_FAR)
        return bounded

    def slopes(self, parts: Array, p: Array, now: Array) -> Array:
        """Derivatives (count, 2 m) of ``away(parts, p) = now`` in the parts."""
        return difference_slopes(lambda moved: self.away(moved, p), parts, now, STEP_SHARE * self.typical)

    def begin(self, parts: Array, p: Array) -> None:
        """Find the initial state again, in these surroundings."""
        self._state = self.replayer.fit_initial_state(self._record(parts), p, self._state)

    def parts(self, p: Array) -> Array:
        """The parts that fit the compared readings best, from a search over directions and speeds: first over the
        beginning of the record."""
        self.compare(_FIRST_PART)
        angles = 2 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
        ring = [
            share * np.tile([np.cos(angle), np.sin(angle)], len(self._effects)) * self.typical
            for angle in angles
            for share in _SHARES
        ]
        at = min([np.zeros(len(self.typical)), *ring], key=lambda parts: float(np.sum(self._pulled(parts, p) ** 2)))
        nearest: Array = self.nearest(at, p).x
        self.compare(1.0)
        return nearest

    def nearest(self, at: Array, p: Array) -> OptimizeResult:
        """Least squares from `at`, the parts normal beforehand about zero."""

        def slopes(parts: Array) -> Array:
            return np.concatenate([self.slopes(parts, p, self.away(parts, p)), np.diag(1 / self.typical)])

        return least_squares(lambda parts: self._pulled(parts, p), at, slopes, x_scale=self.typical)

    def _pulled(self, parts: Array, p: Array) -> Array:
        return np.concatenate([self.away(parts, p), parts / self.typical])

    def weight(self, parts: Array, p: Array) -> float:
        """Weight of a reading: the errors of its trial are of one size, and independent once in a passage of L/u0."""
        size = max(float(np.sqrt(np.mean(self.away(parts, p) ** 2))), 1.0)
        independent = max(len(self._known) / self.passage, 1.0)
        return math.sqrt(min(independent / self.count, 1.0)) / size

    def predicted(self, parts: Array, p: Array, absent: Array) -> float:
        """Root mean square of :meth:`away` over the second half of the record with the surroundings of the first half,
        over that in none, where the model has the parameters `absent`."""
        self.compare(0.5)
        first = self.nearest(parts, p).x
        self.compare(0.5, 1.0)
        with_first_half = float(np.sum(self.away(first, p) ** 2))
        none, kept = np.zeros(len(self.typical)), self._state
        self.begin(none, absent)
        without = float(np.sum(self.away(none, absent) ** 2))
        self._state = kept
        self.compare(1.0)
        return math.sqrt(with_first_half / without) if without > 0 else 1.0
