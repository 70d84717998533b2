"""The integration scheme: one classical Runge-Kutta step, written out as one expression.

The same function is integrated here, put into the FMU, and used as the reference of its check, so that the ship in the
simulator takes the very steps of the ship on the desk.
"""

from __future__ import annotations

import casadi as ca

from tank2sim.dynamics.model import Model


def runge_kutta_step(model: Model) -> ca.Function:
    """``step(x, u, p, h) -> x_next``: classical fourth-order Runge-Kutta over `h` seconds, inputs held.

    Written in SX as a whole: common parts of the four evaluations are then computed once, which makes generated code as
    fast as code written by hand.
    """
    h = ca.SX.sym("h")

    def rate(x: ca.SX) -> ca.SX:
        return ca.substitute(model.rates, model.x, x)

    k1 = model.rates
    k2 = rate(model.x + h / 2 * k1)
    k3 = rate(model.x + h / 2 * k2)
    k4 = rate(model.x + h * k3)
    following = model.x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    names = ["x", "u", "p", "h"], ["x_next"]
    return ca.Function("step", [model.x, model.u, model.p, h], [following], *names, {"cse": True})


def step_and_constants(model: Model) -> tuple[ca.Function, ca.Function]:
    """``step(x, u, p, c, h) -> x_next`` and ``constants(p) -> c``: :func:`runge_kutta_step` to the last bit.

    Masses and their determinant, scales and the like, which depend on p alone, are then calculated when a parameter is
    set and not in every step, by the same operations.
    """
    arguments = [model.x, model.u, model.p, ca.SX.sym("h")]
    shorter, symbols, values = ca.extract_parametric(runge_kutta_step(model)(*arguments), model.p)
    none = ca.SX(0, 1)
    x, u, p, h = arguments
    inputs = [x, u, p, ca.vertcat(none, *symbols), h]
    # Dense results: loops in C read whole vectors, and an entry that is always zero must be written as such.
    step = ca.Function("step", inputs, [ca.densify(shorter)], {"cse": True})
    return step, ca.Function("constants", [p], [ca.densify(ca.vertcat(none, *values))], {"cse": True})
