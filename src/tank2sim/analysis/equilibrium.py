"""Equilibria of a model at any values of its parameters, with exact slopes of what they show: the straight course."""

from __future__ import annotations

from collections.abc import Mapping

import casadi as ca
import numpy as np

from tank2sim.analysis.linearisation import straight_course
from tank2sim.arrays import Array
from tank2sim.dynamics.model import Model

_ACCURACY = 1e-9
"""Residuals, scaled to about one, of an accepted equilibrium; Newton's last step is far below it."""


class EquilibriumFigures:
    """An equilibrium of a model, f(z, p) = 0, and its values g(z, p) with their exact slopes by the parameters.

    By the implicit function theorem dg/dp = g_p - g_z f_z^-1 f_p, which CasADi derives through its ``rootfinder``.

    Parameters
    ----------
    unknown, residual : SX (nz, 1)
        f(z, p) = 0 in scaled unknowns z, of these, the inputs and the parameters of the model.
    shown : mapping
        Name of each value to its expression.
    """

    def __init__(self, model: Model, unknown: ca.SX, residual: ca.SX, shown: Mapping[str, ca.SX]):
        self.names, self._model = tuple(shown), model
        given = ca.vertcat(model.u, model.p)
        equations = {"x": unknown, "p": given, "g": residual}
        options = {"abstol": 1e-13, "error_on_fail": False, "max_iter": 30}
        root = ca.rootfinder("rest", "newton", equations, options)
        arguments = [unknown, model.u, model.p]
        self._residual = ca.Function("residual", arguments, [residual])
        show = ca.Function("shown", arguments, [ca.vcat(list(shown.values()))], {"cse": True})
        z, u, p = (ca.MX.sym(name, len_) for name, len_ in zip("zup", (s.numel() for s in arguments), strict=True))
        found = root(z, ca.vertcat(u, p))
        values = show(found, u, p)
        self._values = ca.Function("values", [z, u, p], [found, values])
        self._slopes = ca.Function("slopes", [z, u, p], [ca.jacobian(values, p)])

    def at(self, near: Array, inputs: Mapping[str, float], p: Array) -> tuple[Array, Array] | None:
        """Unknowns (nz,) and values (n,) at the equilibrium near `near`; None if there is none."""
        u = self._model.input_values(inputs)
        z, values = (np.array(value).ravel() for value in self._values(near, u, p))
        residual = np.array(self._residual(z, u, p))
        return (z, values) if np.all(np.abs(residual) < _ACCURACY) and np.isfinite(values).all() else None

    def slopes(self, z: Array, inputs: Mapping[str, float], p: Array) -> Array:
        """Slopes (n, np) of the values by all parameters, at an equilibrium."""
        return np.array(self._slopes(z, self._model.input_values(inputs), p))


def straight_courses(
    model: Model, shown: Mapping[str, ca.SX], speed_mps: float | None = None
) -> tuple[EquilibriumFigures, Array]:
    """The straight course at the speed of the start (``initial.u``), and its unknowns: v/u0 and the rudder angle.

    Parameters
    ----------
    shown : mapping
        Name of each value to its expression of states, inputs and parameters.
    speed_mps : float, optional
        Surge velocity of the course whose unknowns are returned; by default the speed of the model's start.

    Raises
    ------
    InputError
        The model is not a ship, or has no straight course at that speed.
    """
    unknown = ca.SX.sym("z", 2)
    speed0 = model.symbol("ship.speed")
    nominal = {"motion.v": unknown[0] * speed0, "rudder.angle": unknown[1]}
    x = ca.vcat([nominal.get(state.name, ca.SX(state.start)) for state in model.states])
    time = model.symbol("ship.length") / speed0
    motion = model.expand(
        ca.vertcat(model.symbol("motion.vdot") * time / speed0, model.symbol("motion.rdot") * time**2)
    )
    residual, values = ca.substitute([motion, ca.vcat(list(shown.values()))], [model.x], [x])
    at = dict(zip(model.state_names, straight_course(model, speed_mps).x.tolist(), strict=True))
    near = np.array([at["motion.v"] / model.defaults["ship.speed"], at["rudder.angle"]])
    return EquilibriumFigures(model, unknown, residual, dict(zip(shown, ca.vertsplit(values), strict=True))), near
