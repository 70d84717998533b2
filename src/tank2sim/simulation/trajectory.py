"""What a simulation gives: time, states, inputs and outputs, by the names of the model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicHermiteSpline, krogh_interpolate
from scipy.optimize import brentq

from tank2sim.dynamics.model import Model, Vector


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
    t: Vector
    x: Vector
    u: Vector
    y: Vector

    def __getitem__(self, name: str) -> Vector:
        """A state, output or input (n,), by its name."""
        for names, values in (
            (self.model.outputs, self.y),
            (self.model.state_names, self.x),
            (self.model.input_names, self.u),
        ):
            if name in names:
                column: Vector = values[:, names.index(name)]
                return column
        raise KeyError(name)

    def at(self, name: str, time: float) -> float:
        """A signal at a time between samples: a cubic through the four around it."""
        near = np.unique(np.clip(np.searchsorted(self.t, time) + np.arange(-2, 2), 0, len(self.t) - 1))
        return float(krogh_interpolate(self.t[near], self[name][near], time))

    def crossings(self, name: str, rate: str, level: float) -> Vector:
        """Times at which a signal crosses a level, from its values and those of its time derivative `rate`.

        Between samples it is the cubic through both (Hermite), whose error is of the fourth order in their distance.
        """
        offset, slope = self[name] - level, self[rate]
        before = np.flatnonzero((offset[:-1] < 0) != (offset[1:] < 0))
        times = [
            brentq(CubicHermiteSpline(self.t[k : k + 2], offset[k : k + 2], slope[k : k + 2]), *self.t[k : k + 2])
            for k in before
        ]
        return np.array(times)

    def columns(self) -> dict[str, Vector]:
        """All signals by name, inputs first; time as ``time``."""
        names = (*self.model.input_names, *self.model.outputs)
        rest = tuple(name for name in self.model.state_names if name not in names)
        return {"time": self.t, **{name: self[name] for name in (*names, *rest)}}

    def is_finite(self) -> bool:
        """True if no state or output is infinite or not a number."""
        return bool(np.isfinite(self.x).all() and np.isfinite(self.y).all())
