"""Result of a simulation: time, states, inputs and outputs, by the names of the model."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tank2sim.arrays import Array
from tank2sim.dynamics.model import Model
from tank2sim.units import UNITS

TIMES_BEYOND = 10.0
"""Factor on the extent of a unit beyond which a state is meaningless. Project choice: no manoeuvre reaches the extent
itself. FMUs use the same number."""

_TRIES, _ROUNDED = 60, 1e-14
"""Most tries in the search of a crossing, by Newton's method or by halving where that leaves the step; and the change,
in steps, below which it ends, less than the rounding of times (project choices)."""

_MOST_STEPS = 200
"""Each step at least halves the interval; 200 steps exceed the number of bits of a double. Project choice."""


@dataclass(frozen=True, eq=False)
class EventSamples:
    """EventSamples about events, two before and two after each: their times (..., 4), s, and any signal (..., 4) then.

    A sample before the start or after the end of a run is nan.
    """

    t: Array
    signal: Callable[[str], Array]

    def crossing(self, name: str, rate: str, level: float | Array) -> Array:
        """Times (...) at which a signal crosses a level (...) between the middle two samples.

        There it is the Hermite cubic by its values and its time derivative `rate`.
        """
        times, slope = self.t, self.signal(rate)
        offset = self.signal(name) - np.asarray(level)[..., None]
        begin, step = times[..., 1], times[..., 2] - times[..., 1]
        low, high = offset[..., 1], offset[..., 2]
        below, near = low < 0, _ROUNDED * step
        before, after = np.zeros_like(step), step.copy()
        with np.errstate(invalid="ignore", divide="ignore"):
            rise = (high - low) / step
            square = (3 * rise - 2 * slope[..., 1] - slope[..., 2]) / step
            cube = (slope[..., 1] + slope[..., 2] - 2 * rise) / step**2
            root = low * step / (low - high)
            for _ in range(_TRIES):
                value = low + root * (slope[..., 1] + root * (square + root * cube))
                same = (value < 0) == below
                before, after = np.where(same, root, before), np.where(same, after, root)
                moved = root - value / (slope[..., 1] + root * (2 * square + 3 * root * cube))
                moved = np.where((moved > before) & (moved < after) | (value == 0), moved, (before + after) / 2)
                change, root = np.abs(moved - root), moved
                if not (change > near).any():
                    break
        found: Array = begin + root
        return found

    def at(self, name: str, times: Array) -> Array:
        """A signal (...) at `times` (...): the polynomial through the samples that are not nan."""
        values, known = self.signal(name), np.isfinite(self.t)
        found = np.zeros(times.shape)
        for k in range(self.t.shape[-1]):
            weight = np.ones(times.shape)
            for other in range(self.t.shape[-1]):
                if other != k:
                    with np.errstate(invalid="ignore", divide="ignore"):
                        factor = (times - self.t[..., other]) / (self.t[..., k] - self.t[..., other])
                    weight = weight * np.where(known[..., other], factor, 1.0)
            with np.errstate(invalid="ignore"):
                found += np.where(known[..., k], weight * values[..., k], 0.0)
        return np.where(np.isfinite(times), found, np.nan)


@dataclass(frozen=True)
class Trajectory:
    """A simulated motion, sampled at every integration step and at every event."""

    model: Model  # The simulated model
    t: Array  # (n,): Time, s, rising
    x: Array  # (n, nx): States
    u: Array  # (n, nu): Inputs; a row is valid from its time until the next
    y: Array  # (n, ny): Outputs

    def __getitem__(self, name: str) -> Array:
        """A state, output or input (n,), by its name."""
        return self._columns[name]

    @cached_property
    def _columns(self) -> dict[str, Array]:
        model = self.model
        # For equal names an output has precedence over a state, and a state over an input.
        parts = (model.input_names, self.u), (model.state_names, self.x), (model.outputs, self.y)
        return {name: values[:, place] for names, values in parts for place, name in enumerate(names)}

    def samples(self, rows: NDArray[np.intp]) -> EventSamples:
        """The samples about k gaps, each between a row and the next."""
        places = rows[:, None] + np.arange(-1, 3)
        known, held = (places >= 0) & (places < len(self.t)), np.clip(places, 0, len(self.t) - 1)
        return EventSamples(
            np.where(known, self.t[held], np.nan), lambda name: np.where(known, self[name][held], np.nan)
        )

    def gap(self, times: Array) -> NDArray[np.intp]:
        """Rows (k,) of the samples before times (k,), s."""
        return np.searchsorted(self.t, times) - 1

    def at(self, name: str, time: float) -> float:
        """A signal at a time between samples: a cubic through the four around it."""
        times = np.array([time])
        return float(self.samples(self.gap(times)).at(name, times)[0])

    def crossings(self, name: str, rate: str, level: float) -> Array:
        """Times at which a signal crosses a level, from its values and its time derivative `rate`.

        Between samples it is the Hermite cubic, whose error is of fourth order in their distance.
        """
        return self.samples(self.rows_before(name, level)).crossing(name, rate, level)

    def rows_before(self, name: str, level: float) -> NDArray[np.intp]:
        """Rows (k,) after which a signal crosses a level."""
        below = self[name] - level < 0
        return np.flatnonzero(below[:-1] != below[1:])

    def columns(self) -> dict[str, Array]:
        """All signals by name, inputs first; time as ``time``."""
        names = (*self.model.input_names, *self.model.outputs)
        states = tuple(name for name in self.model.state_names if name not in names)
        return {"time": self.t, **{name: self[name] for name in (*names, *states)}}

    def is_finite(self) -> bool:
        """True if every output is finite and every state is within its limit (:data:`TIMES_BEYOND`)."""
        largest = TIMES_BEYOND * np.array([UNITS[state.unit].extent for state in self.model.states])
        return bool(np.all(np.abs(self.x) <= largest) and np.isfinite(self.y).all())


def bracketed_root(function: Callable[[float], float], low: float, high: float, tolerance: float = 1e-13) -> float:
    """The x between `low` and `high` at which a continuous function is zero, to `tolerance` in x.

    Method of Ridders (1979, IEEE Trans. Circuits Syst. 26, 979). ``scipy.optimize.ridder`` is equivalent, but its
    import takes a third of a second, half of a short simulation.

    Raises ValueError: The function has the same sign at both ends.
    """
    at_low, at_high = function(low), function(high)
    if at_low == 0 or at_high == 0:
        return low if at_low == 0 else high
    if at_low * at_high > 0:
        raise ValueError(f"no change of sign between {low:g} and {high:g}")
    best = math.inf
    for _ in range(_MOST_STEPS):
        middle = (low + high) / 2
        at_middle = function(middle)
        root = math.sqrt(at_middle * at_middle - at_low * at_high)
        if root == 0:
            return middle
        before, best = best, middle + (middle - low) * math.copysign(1.0, at_low - at_high) * at_middle / root
        value = function(best)
        if value == 0 or abs(best - before) <= tolerance:
            return best
        ends = sorted([(low, at_low), (middle, at_middle), (best, value), (high, at_high)])
        (low, at_low), (high, at_high) = _around_zero(ends)
        if abs(high - low) <= tolerance:
            return (low + high) / 2
    return best


def _around_zero(points: Sequence[tuple[float, float]]) -> tuple[tuple[float, float], tuple[float, float]]:
    """The first two points (x, value) in sequence between which the sign changes."""
    return next(pair for pair in pairwise(points) if pair[0][1] * pair[1][1] <= 0)
