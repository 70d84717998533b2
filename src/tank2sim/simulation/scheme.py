"""The integration scheme: a classical Runge-Kutta step as a single expression.

Simulation, FMU and the reference of the FMU's check use the same function, so that the ship in the simulator takes
exactly the steps of the simulated ship.
"""

from __future__ import annotations

import casadi as ca

from tank2sim.dynamics.model import Model


def runge_kutta_step(model: Model) -> ca.Function:
    """``step(x, u, p, h) -> x_next``: classical fourth-order Runge-Kutta over `h` seconds with constant inputs.

    A single SX expression: common parts of the four evaluations are computed once, which makes generated code as fast
    as hand-written code.
    """
    h = ca.SX.sym("h")
    names = ["x", "u", "p", "h"], ["x_next"]
    return ca.Function("step", [model.x, model.u, model.p, h], [model.x + _increment(model, h)], *names, {"cse": True})


def _increment(model: Model, h: ca.SX) -> ca.SX:
    """Change of the states over a step of `h` seconds."""

    def rate(x: ca.SX) -> ca.SX:
        return ca.substitute(model.rates, model.x, x)

    k1 = model.rates
    k2 = rate(model.x + h / 2 * k1)
    k3 = rate(model.x + h / 2 * k2)
    k4 = rate(model.x + h * k3)
    return h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)


def step_and_constants(model: Model, *, change: bool = False) -> tuple[ca.Function, ca.Function]:
    """``step(x, u, p, c, h) -> x_next`` and ``constants(p) -> c``: :func:`runge_kutta_step` to the last bit.

    Terms that depend on p alone (masses and their determinant, scales) are computed when a parameter is set and not in
    every step, by the same operations. With `change` the step's result is ``x_next - x``, before it is added to x.
    """
    arguments = [model.x, model.u, model.p, ca.SX.sym("h")]
    wanted = _increment(model, arguments[3]) if change else runge_kutta_step(model)(*arguments)
    shorter, symbols, values = ca.extract_parametric(wanted, model.p)
    none = ca.SX(0, 1)
    x, u, p, h = arguments
    inputs = [x, u, p, ca.vertcat(none, *symbols), h]
    # Dense results: loops in C read whole vectors, including entries that are always zero.
    step = ca.Function("step", inputs, [ca.densify(shorter)], {"cse": True})
    return step, ca.Function("constants", [p], [ca.densify(ca.vertcat(none, *values))], {"cse": True})
