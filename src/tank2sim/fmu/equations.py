"""The mathematics of an FMU: the CasADi functions from which its C code is generated."""

from __future__ import annotations

import casadi as ca

from tank2sim.dynamics.event_indicators import kinks
from tank2sim.dynamics.model import Model
from tank2sim.fmu.interface import other_outputs
from tank2sim.simulation.scheme import step_and_constants


def fmu_equations(model: Model) -> tuple[ca.Function, ...]:
    """The functions that the C template calls, each on whole vectors x, u, p.

    ``model_constants(p) -> c`` and with them ``model_step(x, u, p, c, h) -> x``, ``model_rates(x, u, p) -> xdot``,
    ``model_outputs(x, u, p) -> y`` (of :func:`other_values`), ``model_initial(p) -> x``,
    ``model_trim_step(x, u, p) -> x`` (the identity if the model cannot be trimmed), and their derivatives:
    ``model_forward`` (tangents of x, u, p to those of xdot, y), ``model_reverse`` (adjoints of xdot, y to those of x,
    u, p), ``model_initial_forward``, ``model_trim_forward``.
    """
    x, u, p = model.x, model.u, model.p
    dx, du, dp = (ca.SX.sym(f"d{name}", vector.numel()) for name, vector in (("x", x), ("u", u), ("p", p)))
    outputs = other_values(model)
    results, points = ca.vertcat(model.rates, outputs), ca.vertcat(x, u, p)
    tangents = ca.vertcat(dx, du, dp)
    seeds = [ca.SX.sym("xdot_bar", x.numel()), ca.SX.sym("y_bar", outputs.numel())]
    pushed = ca.vertsplit(ca.jtimes(results, points, tangents), [0, x.numel(), results.numel()])
    places = [0, x.numel(), x.numel() + u.numel(), points.numel()]
    pulled = ca.vertsplit(ca.jtimes(results, points, ca.vertcat(*seeds), True), places)
    start = model.initial(p)
    trimmed = model.trim_step(x, u, p) if model.trim_step is not None else x
    step, constants = step_and_constants(model)
    c, h = ca.SX.sym("c", constants.numel_out(0)), ca.SX.sym("h")
    return (
        _function("model_step", [x, u, p, c, h], [step(x, u, p, c, h)]),
        _function("model_constants", [p], [constants(p)]),
        _function("model_rates", [x, u, p], [model.rates]),
        _function("model_outputs", [x, u, p], [outputs]),
        _function("model_initial", [p], [start]),
        _function("model_trim_step", [x, u, p], [trimmed]),
        _function("model_forward", [x, u, p, dx, du, dp], pushed),
        _function("model_reverse", [x, u, p, *seeds], pulled),
        _function("model_initial_forward", [p, dp], [ca.jtimes(start, p, dp)]),
        _function("model_trim_forward", [x, u, p, dx, du, dp], [ca.jtimes(trimmed, points, tangents)]),
    )


def other_values(model: Model) -> ca.SX:
    """Outputs that are neither states nor their rates, then the event indicators, as expressions of x, u, p."""
    outputs = [model.symbol(name) for name in other_outputs(model)]
    return ca.vertcat(model.expand(ca.vcat(outputs)), *(kink.value for kink in kinks(model)))


def _function(name: str, arguments: list[ca.SX], results: list[ca.SX]) -> ca.Function:
    # Dense results: the C template reads whole vectors, and an entry that is always zero must be written as such.
    return ca.Function(name, arguments, [ca.densify(result) for result in results], {"cse": True})
