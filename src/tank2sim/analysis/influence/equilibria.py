"""Figures of straight courses and steady turns with their exact slopes by the parameters of a model.

An equilibrium z solves f(z, p) = 0, and a figure is g(z, p). By the implicit function theorem

    dg/dp = g_p - g_z f_z^-1 f_p

which CasADi derives through its ``rootfinder``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from tank2sim.analysis.linearisation import straight_course
from tank2sim.analysis.stability.straight_line import settled_states, steering_constants
from tank2sim.analysis.turning.diagram import hull_states
from tank2sim.arrays import Array
from tank2sim.dynamics.model import Model

_ACCURACY = 1e-9
"""Residuals, scaled to about one, of an accepted equilibrium; Newton's last step is far below it."""


@dataclass(frozen=True)
class _Problem:
    """f(z, p) = 0 in scaled unknowns z (nz, 1), and the values there."""

    unknown: ca.SX
    residual: ca.SX
    shown: ca.SX


class EquilibriumFigures:
    """An equilibrium of a model and its values.

    Parameters
    ----------
    model : Model
    problem : _Problem
        Expressions in its unknowns, the inputs and the parameters of the model.
    names : sequence of str
        What is shown.
    """

    def __init__(self, model: Model, problem: _Problem, names: Sequence[str]):
        self.names = tuple(names)
        self._model = model
        given = ca.vertcat(model.u, model.p)
        equations = {"x": problem.unknown, "p": given, "g": problem.residual}
        options = {"abstol": 1e-13, "error_on_fail": False, "max_iter": 30}
        root = ca.rootfinder("rest", "newton", equations, options)
        arguments = [problem.unknown, model.u, model.p]
        self._residual = ca.Function("residual", arguments, [problem.residual])
        shown = ca.Function("shown", arguments, [problem.shown], {"cse": True})
        z, u, p = (ca.MX.sym(name, len_) for name, len_ in zip("zup", (s.numel() for s in arguments), strict=True))
        found = root(z, ca.vertcat(u, p))
        values = shown(found, u, p)
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


def turning_states(model: Model) -> tuple[str, ...]:
    """States that are constant in a steady turn: those of the hull, and those of the steering gear."""
    return tuple(dict.fromkeys((*hull_states(model), *(state.name for state in model.states if state.steady))))


def steady_turns(model: Model) -> EquilibriumFigures:
    """Steady turns of a ship: unknowns are its :func:`turning_states` over their nominal sizes.

    Shown are ``u``, ``v`` and ``r`` as functions of rudder order (the input) and parameters, and ``place``, the effect
    of position and heading on the turn: zero in calm and open water.
    """
    names = turning_states(model)
    scale = np.array([model[name].nominal for name in names])
    unknown = ca.SX.sym("z", len(names))
    fixed = {
        state.name: (ca.SX(state.trim) if state.trim is not None else ca.SX(state.start)) for state in model.states
    }
    fixed |= {name: unknown[row] * scale[row] for row, name in enumerate(names)}
    x = ca.vcat([fixed[name] for name in model.state_names])
    while ca.depends_on(x, model.x):  # a rudder follows a telemotor, which follows the order
        x = ca.substitute(x, model.x, x)
    derivative = {state.name: state.derivative for state in model.states}
    rates = model.expand(ca.vcat([model.symbol(derivative[name]) for name in names]))
    time = model.symbol("ship.length") / model.symbol("ship.speed")
    scaled = rates * time / scale
    place = ca.vcat([model.symbol(name) for name in ("motion.psi", "motion.x", "motion.y")])
    felt = ca.sumsqr(ca.jacobian(scaled, place))
    residual, felt = ca.substitute([scaled, felt], [model.x], [x])
    u, v, r = (fixed[name] for name in ("motion.u", "motion.v", "motion.r"))
    problem = _Problem(unknown, residual, ca.vertcat(u, v, r, felt))
    return EquilibriumFigures(model, problem, ("u", "v", "r", "place"))


def turn_figures(u: float, v: float, r: float, side: float, approach: float) -> tuple[dict[str, float], Array]:
    """Figures of a steady turn by name, and their slopes (n, 3) by u, v and r.

    `side` is 1 with the rudder to starboard and -1 to port; `approach` the speed at the execute, m/s.
    """
    U2 = u * u + v * v
    U = math.sqrt(U2)
    radius, drift = U / (side * r), -math.degrees(math.asin(v / U))
    by_radius = np.array([u / (U * side * r), v / (U * side * r), -radius / r])
    by_drift = -math.degrees(1.0) * np.array([-v / U2, u / U2, 0.0])
    by_speed = np.array([u / U, v / U, 0.0])
    figures = {
        "steady_radius_m": radius,
        "steady_diameter_m": 2 * radius,
        "steady_rate_degps": math.degrees(r),
        "steady_drift_deg": drift,
        "steady_speed_mps": U,
        "speed_loss_percent": 100 * (1 - U / approach),
    }
    by_rate = np.array([0.0, 0.0, math.degrees(1.0)])
    return figures, np.array([by_radius, 2 * by_radius, by_rate, by_drift, by_speed, -100 / approach * by_speed])


def straight_courses(model: Model) -> tuple[EquilibriumFigures, Array]:
    """The straight course at the speed of expansion with Nomoto's coefficients, the criterion and its state.

    Unknowns are v/u0 and the rudder angle. The values have the names of
    :mod:`tank2sim.analysis.stability.straight_line`.
    """
    unknown = ca.SX.sym("z", 2)
    speed0 = model.symbol("ship.speed")
    nominal = {"motion.v": unknown[0] * speed0, "rudder.angle": unknown[1]}
    x = ca.vcat([nominal.get(state.name, ca.SX(state.start)) for state in model.states])
    time = model.symbol("ship.length") / speed0
    motion = model.expand(ca.vcat([model.symbol("motion.vdot") * time / speed0, model.symbol("motion.rdot") * time**2]))
    shown = _linear_figures(model)
    residual, values = ca.substitute([motion, ca.vcat(list(shown.values()))], [model.x], [x])
    point = straight_course(model)
    at = dict(zip(model.state_names, point.x.tolist(), strict=True))
    speed = model.parameter_values()[model.parameter_names.index("ship.speed")]
    near = np.array([at["motion.v"] / speed, at["rudder.angle"]])
    return EquilibriumFigures(model, _Problem(unknown, residual, values), tuple(shown)), near


def _linear_figures(model: Model) -> dict[str, ca.SX]:
    """Figures of the linearised ship, of x, u and p."""
    A, B = _reduced(model, ["motion.vdot", "motion.rdot"])
    K, total, product, T3 = steering_constants(A, B, ca.DM([[0, 1]]))
    discriminant = total**2 - 4 * product
    T1 = 0.5 * (total + ca.sign(total) * ca.sqrt(discriminant))  # nan where the modes oscillate
    slopes, _ = _reduced(model, ["force.Y", "force.N"])
    length, density = model.symbol("ship.length"), model.symbol("ship.water_density")
    speed2 = model.symbol("motion.u") ** 2 + model.symbol("motion.v") ** 2
    time = length / ca.sqrt(speed2)
    determinant = slopes[0, 0] * slopes[1, 1] - slopes[0, 1] * slopes[1, 0]
    return {
        "K_per_s": K,
        "T_s": total - T3,
        "T1_s": T1,
        "T2_s": product / T1,
        "T3_s": T3,
        "K_prime": K * time,
        "T_prime": (total - T3) / time,
        "criterion_C": determinant / (0.25 * density**2 * length**6 * speed2),
    }


def _reduced(model: Model, values: Sequence[str]) -> tuple[ca.SX, ca.SX]:
    """Slopes (n, 2) by v and r and (n, 1) by the rudder, with :func:`settled_states` eliminated."""
    settled = settled_states(model)
    derivative = {state.name: state.derivative for state in model.states}
    rows = model.expand(
        ca.vcat([model.symbol(name) for name in (*values, *(derivative[settled_state] for settled_state in settled))])
    )
    columns = ca.vcat([model.symbol(name) for name in ("motion.v", "motion.r", *settled, "rudder.angle")])
    whole = ca.jacobian(rows, columns)
    n = len(values)
    kept = [0, 1, columns.numel() - 1]
    reduced = whole[:n, kept]
    if settled:
        inner = list(range(2, columns.numel() - 1))
        reduced = reduced - whole[:n, inner] @ ca.solve(whole[n:, inner], whole[n:, kept])
    return reduced[:, :2], reduced[:, 2]
