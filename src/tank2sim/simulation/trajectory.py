"""Result of a simulation: time, states, inputs and outputs, by the names of the model."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from tank2sim.arrays import Array
from tank2sim.dynamics.model import Model
from tank2sim.units import UNITS

TIMES_BEYOND = 10.0
"""Factor on the extent of a unit beyond which a state is meaningless. Project choice: no manoeuvre reaches the extent
itself. FMUs use the same number."""

_MOST_STEPS = 200
"""Each step at least halves the interval; 200 steps exceed the number of bits of a double. Project choice."""


@dataclass(frozen=True)
class Trajectory:
    """A simulated motion, sampled at every integration step and at every event.

    Parameters
    ----------
    model : Model
        The simulated model.
    t : array (n,)
        Time, s, rising.
    x : array (n, nx)
        States.
    u : array (n, nu)
        Inputs; a row is valid from its time until the next.
    y : array (n, ny)
        Outputs.
    """

    model: Model
    t: Array
    x: Array
    u: Array
    y: Array

    def __getitem__(self, name: str) -> Array:
        """A state, output or input (n,), by its name."""
        return self._columns[name]

    @cached_property
    def _columns(self) -> dict[str, Array]:
        model = self.model
        # For equal names an output has precedence over a state, and a state over an input.
        parts = (model.input_names, self.u), (model.state_names, self.x), (model.outputs, self.y)
        return {name: values[:, place] for names, values in parts for place, name in enumerate(names)}

    def at(self, name: str, time: float) -> float:
        """A signal at a time between samples: a cubic through the four around it."""
        after = int(np.searchsorted(self.t, time))
        near = slice(max(after - 2, 0), min(after, len(self.t) - 2) + 2)
        return _through(self.t[near].tolist(), self[name][near].tolist(), time)

    def crossings(self, name: str, rate: str, level: float) -> Array:
        """Times at which a signal crosses a level, from its values and those of its time derivative `rate`.

        Between samples it is the Hermite cubic, whose error is of fourth order in their distance.
        """
        offset, slope = self[name] - level, self[rate]
        before = np.flatnonzero((offset[:-1] < 0) != (offset[1:] < 0))
        times = [
            bracketed_root(
                _hermite(*(p[k : k + 2].tolist() for p in (self.t, offset, slope))), self.t[k], self.t[k + 1]
            )
            for k in before
        ]
        return np.array(times)

    def columns(self) -> dict[str, Array]:
        """All signals by name, inputs first; time as ``time``."""
        names = (*self.model.input_names, *self.model.outputs)
        states = tuple(name for name in self.model.state_names if name not in names)
        return {"time": self.t, **{name: self[name] for name in (*names, *states)}}

    def is_finite(self) -> bool:
        """True if every output is finite and every state is within its limit (:data:`TIMES_BEYOND`)."""
        largest = TIMES_BEYOND * np.array([UNITS[state.unit].extent for state in self.model.states])
        return bool(np.all(np.abs(self.x) <= largest) and np.isfinite(self.y).all())


def _through(times: list[float], values: list[float], time: float) -> float:
    """Value at a time of the polynomial through a few points (Neville)."""
    for order in range(1, len(times)):
        for k in range(len(times) - order):
            before, after = time - times[k], times[k + order] - time
            values[k] = (after * values[k] + before * values[k + 1]) / (before + after)
    return values[0]


def _hermite(times: list[float], values: list[float], slopes: list[float]) -> Callable[[float], float]:
    """The cubic with these values and slopes at two times."""
    length = times[1] - times[0]
    rise = (values[1] - values[0]) / length
    square = (3 * rise - 2 * slopes[0] - slopes[1]) / length
    cube = (slopes[0] + slopes[1] - 2 * rise) / length**2

    def cubic(time: float) -> float:
        s = time - times[0]
        # Exact at the far end, too: a root lies between values of different signs.
        return values[1] if time == times[1] else values[0] + s * (slopes[0] + s * (square + s * cube))

    return cubic


def bracketed_root(function: Callable[[float], float], low: float, high: float, tolerance: float = 1e-13) -> float:
    """The x between `low` and `high` at which a continuous function is zero, to `tolerance` in x.

    Method of Ridders (1979, IEEE Trans. Circuits Syst. 26, 979). ``scipy.optimize.ridder`` is equivalent, but its
    import takes a third of a second, half of a short simulation.

    Raises
    ------
    ValueError
        The function has the same sign at both ends.
    """
    at_low, at_high = function(low), function(high)
    for x, value in ((low, at_low), (high, at_high)):
        if value == 0:
            return x
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
        (low, at_low), (high, at_high) = next(pair for pair in pairwise(ends) if pair[0][1] * pair[1][1] <= 0)
        if abs(high - low) <= tolerance:
            return (low + high) / 2
    return best
