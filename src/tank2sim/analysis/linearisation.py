"""A model about an operating point: matrices exact from CasADi, handed to python-control with named signals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import control
import numpy as np
from scipy.optimize import root

from tank2sim.dynamics.model import Model, Vector
from tank2sim.errors import InputError


@dataclass(frozen=True)
class OperatingPoint:
    """Where a model is linearised.

    Parameters
    ----------
    x, u, p : arrays (nx,), (nu,), (np,)
        States, inputs and parameters of the model.
    """

    x: Vector
    u: Vector
    p: Vector


def straight_course(model: Model, speed_mps: float | None = None) -> OperatingPoint:
    """Straight course of a ship at a speed: the sway velocity and the rudder at which Y and N vanish with r = 0.

    On an asymmetric ship (Y0, N0) neither is zero. The speed is held: what the engine must give for it is not asked.

    Raises
    ------
    InputError
        The model is no ship, or there is no such course.
    """
    if "rudder.angle" not in model:
        raise InputError(model.name, "", "has no rudder", "this needs the card of a ship (kind linear or abkowitz)")
    p, u = model.parameter_values(), model.input_values()
    x = np.array(model.initial(p)).ravel()
    names = model.state_names
    if speed_mps is not None:
        x[names.index("motion.u")] = speed_mps
    unknown = [names.index("motion.v"), names.index("rudder.angle")]
    accelerations = ca.vcat([model.expand(model.symbol(name)) for name in ("motion.vdot", "motion.rdot")])
    arguments = [model.x, model.u, model.p]
    residual = ca.Function("residual", arguments, [accelerations])
    slope = ca.Function("slope", arguments, [ca.jacobian(accelerations, model.x)])

    def with_unknown(values: Vector) -> Vector:
        full = x.copy()
        full[unknown] = values
        return full

    solution = root(
        lambda values: np.array(residual(with_unknown(values), u, p)).ravel(),
        x[unknown],
        jac=lambda values: np.array(slope(with_unknown(values), u, p))[:, unknown],
        tol=1e-14,
    )
    left = np.abs(np.array(residual(with_unknown(solution.x), u, p)).ravel())
    if not np.all(left < 1e-9) or abs(solution.x[1]) > np.pi / 4:
        problem = "no rudder angle below 45 deg holds a straight course"
        raise InputError(model.name, "", problem, _cause(np.array(slope(x, u, p))[:, unknown]))
    x = with_unknown(solution.x)
    u[model.input_names.index("rudder.command")] = solution.x[1]
    return OperatingPoint(x, u, p)


def _cause(slopes: Vector) -> str:
    """Why there is no straight course, from the slopes (2, 2) of sway and yaw acceleration by v and by the rudder."""
    by_sway, by_rudder = np.abs(slopes).max(axis=0)
    if not by_sway:
        return "sway moves neither Y nor N: check Yv and Nv of the card"
    if not by_rudder:
        return "the rudder moves neither Y nor N: check Yd and Nd of the card"
    return "check Yd, Nd, Y0 and N0 of the card"


def jacobians(
    model: Model,
    point: OperatingPoint,
    values: Sequence[str],
    states: Sequence[str],
    inputs: Sequence[str],
    *,
    settled: Sequence[str] = (),
) -> tuple[Vector, Vector]:
    """Derivatives (nv, ns) and (nv, ni) of named quantities or states by named states and by named inputs.

    States in `settled` are eliminated: they follow the others at once, as if at rest (the Schur complement of their
    own rates). Other states that are not named stay where they are.
    """
    if settled:
        derivative = {state.name: state.derivative for state in model.states}
        rates = [derivative[name] for name in settled]
        whole, inputs_whole = jacobians(model, point, [*values, *rates], [*states, *settled], inputs)
        n, m = len(values), len(states)
        # pinv: a state that nothing drives back (a play) has no place of rest, and moves nothing then
        follow = whole[:n, m:] @ np.linalg.pinv(whole[n:, m:])
        return whole[:n, :m] - follow @ whole[n:, :m], inputs_whole[:n] - follow @ inputs_whole[n:]
    expressions = model.expand(ca.vcat([model.symbol(name) for name in values]))
    by_state = ca.jacobian(expressions, ca.vcat([model.symbol(name) for name in states]))
    by_input = ca.jacobian(expressions, ca.vcat([ca.SX(0, 1), *(model.symbol(name) for name in inputs)]))
    both = ca.Function("jacobians", [model.x, model.u, model.p], [by_state, by_input])(point.x, point.u, point.p)
    return np.array(both[0]), np.array(both[1])


def state_space(
    model: Model,
    point: OperatingPoint,
    *,
    states: Sequence[str] | None = None,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
    settled: Sequence[str] = (),
) -> control.StateSpace:
    """The linearised model as a ``control.StateSpace`` whose signals bear the model's names (:func:`signal_name`).

    Parameters
    ----------
    model, point
        What, and about which point.
    states, inputs, outputs : sequences of str, optional
        Names to keep; by default all that are real. States left out are held at the point. A state may be an input: the
        rudder angle without its gear.
    settled : sequence of str
        States left out that follow the others at once (:func:`jacobians`).
    """
    states = list(model.state_names if states is None else states)
    inputs = [v.name for v in model.inputs if not v.boolean] if inputs is None else list(inputs)
    outputs = list(model.outputs if outputs is None else outputs)
    derivative = {state.name: state.derivative for state in model.states}
    A, B = jacobians(model, point, [derivative[name] for name in states], states, inputs, settled=settled)
    C, D = jacobians(model, point, outputs, states, inputs, settled=settled)
    return control.StateSpace(
        A,
        B,
        C,
        D,
        states=[signal_name(name) for name in states],
        inputs=[signal_name(name) for name in inputs],
        outputs=[signal_name(name) for name in outputs],
        name=signal_name(model.name),
    )


def signal_name(name: str) -> str:
    """A model's name as python-control takes it: ``rudder.command`` is ``rudder_command``.

    It keeps the dot for itself, between system and signal.
    """
    return name.replace(".", "_")
