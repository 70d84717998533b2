"""What a simulation gives: time, states, inputs and outputs, by the names of the model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tank2sim.arrays import Array
from tank2sim.dynamics.model import Model
from tank2sim.simulation.bracketed_root import bracketed_root
from tank2sim.units import UNITS

TIMES_BEYOND = 10.0
"""A state this many times beyond the extent of its unit has left all that the equations can mean. Project choice:
no manoeuvre comes near a single time. FMUs are written with the same number."""


@dataclass(frozen=True)
class Trajectory:
    """A simulated motion, sampled at every integration step and at every event.

    Parameters
    ----------
    model : Model
        What was simulated.
    t : array (n,)
        Time, s, rising.
    x : array (n, nx)
        States.
    u : array (n, nu)
        Inputs; a row holds from its time until the next.
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
        # Of one name an output comes before a state, and that before an input.
        parts = (model.input_names, self.u), (model.state_names, self.x), (model.outputs, self.y)
        return {name: values[:, place] for names, values in parts for place, name in enumerate(names)}

    def at(self, name: str, time: float) -> float:
        """A signal at a time between samples: a cubic through the four around it."""
        after = int(np.searchsorted(self.t, time))
        near = slice(max(after - 2, 0), min(after, len(self.t) - 2) + 2)
        return _through(self.t[near].tolist(), self[name][near].tolist(), time)

    def crossings(self, name: str, rate: str, level: float) -> Array:
        """Times at which a signal crosses a level, from its values and those of its time derivative `rate`.

        Between samples it is the cubic through both (Hermite), whose error is of the fourth order in their distance.
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
        rest = tuple(name for name in self.model.state_names if name not in names)
        return {"time": self.t, **{name: self[name] for name in (*names, *rest)}}

    def is_finite(self) -> bool:
        """True if every output is a number and every state one that a ship can have (:data:`TIMES_BEYOND`)."""
        largest = TIMES_BEYOND * np.array([UNITS[state.unit].extent for state in self.model.states])
        return bool(np.all(np.abs(self.x) <= largest) and np.isfinite(self.y).all())


def _through(times: list[float], values: list[float], time: float) -> float:
    """The polynomial through a few points, at a time (Neville)."""
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
        # Exact at the far end, too: what is sought lies between values of different signs.
        return values[1] if time == times[1] else values[0] + s * (slopes[0] + s * (square + s * cube))

    return cubic
