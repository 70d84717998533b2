"""Steady speeds straight ahead: two stable ones at the same revolutions are a fault of a card."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from tank2sim.dynamics.effects import EFFECTS, undisturbed_inputs
from tank2sim.dynamics.model import Model

SLOWEST, FASTEST, SPEEDS = 0.01, 2.0, 400
"""Speeds at which a search looks, over the speed of expansion, and how many: two steady speeds that differ by less than
0.5 % of it are taken for none. Ships do not go at twice the speed about which they were tested. Project choice."""


@dataclass(frozen=True)
class SteadySpeed:
    """A surge speed (m/s) that the engine holds, and whether the ship returns to it after a small change of speed."""

    speed_mps: float
    stable: bool


def steady_speeds(model: Model) -> tuple[SteadySpeed, ...]:
    """All speeds straight ahead at which the surge force vanishes, slowest first.

    v = r = 0, rudder midships, calm water, the revolutions at which the model starts; states of effects at rest, those
    behind an order at the order. A speed is stable where the surge force falls as the speed rises. A ship
    with two stable ones goes at one or the other as it comes from below or above: no ship with a fixed propeller does,
    but a polynomial may, beyond the speeds at which it was measured.

    Parameters
    ----------
    model : Model
        A ship.

    Returns
    -------
    tuple of SteadySpeed
        Empty if the surge force does not vanish between 0.01 and 2 times the speed of expansion.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> [found.stable for found in steady_speeds(t2s.load("mariner").model)]
    [True]
    """
    from scipy.optimize import brentq  # slow to import

    inputs, parameters = model.input_values(undisturbed_inputs(model)), model.parameter_values()
    start = np.array(model.initial(parameters)).ravel()
    u0 = float(parameters[model.parameter_names.index("ship.speed")])
    place = model.state_names.index("motion.u")
    start[[row for row, state in enumerate(model.states) if state.steady]] = 0.0
    for name, order in (pair for effect in EFFECTS.values() for pair in effect.states_behind.items()):
        if name in model.state_names and order in model.input_names:
            start[model.state_names.index(name)] = inputs[model.input_names.index(order)]
    acceleration = ca.Function(
        "acceleration", [model.x, model.u, model.p], [model.expand(model.symbol("motion.udot"))], {"cse": True}
    )

    def surge(speed: float) -> float:
        state = start.copy()
        state[place] = speed
        return float(acceleration(state, inputs, parameters))

    speeds = np.linspace(SLOWEST, FASTEST, SPEEDS) * u0
    signs = np.sign([surge(float(speed)) for speed in speeds])
    found = []
    for row in np.flatnonzero(signs[1:] != signs[:-1]):
        if signs[row] == 0:
            continue
        speed = brentq(surge, float(speeds[row]), float(speeds[row + 1]))
        found.append(SteadySpeed(float(speed), bool(signs[row] > 0)))
    return tuple(found)
