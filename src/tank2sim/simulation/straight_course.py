"""Steady motions: the one that inputs lead to, and the straight course of a ship with its neutral rudder angle."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from tank2sim.arrays import Array
from tank2sim.dynamics.model import Model

_TRIM_STEPS = 50
_TRIM_ACCURACY = 1e-13  # of the change in a Newton step, relative to the nominal size of a state


@dataclass(frozen=True)
class OperatingPoint:
    """Operating point of a linearisation."""

    # `x`, `u`, `p` (nx,), (nu,), (np,): States, inputs and parameters of the model.
    x: Array
    u: Array
    p: Array


def steady_motion(model: Model, x: Array, u: Array, p: Array) -> Array:
    """States (nx,) of the steady motion with inputs (nu,) and parameters (np,), by Newton's method from states near it.

    A model without steady states keeps its states.

    Raises InputError: No steady motion exists near the start.
    """
    step = model.trim_step
    if step is None:
        return x
    nominal = np.array([state.nominal for state in model.states])
    for _ in range(_TRIM_STEPS):
        following = np.array(step(x, u, p)).ravel()
        change = np.max(np.abs(following - x) / nominal)
        x = following
        if not np.isfinite(change) or change < _TRIM_ACCURACY:
            break
    if not change < 1e-9:
        raise model.fault("initial.trim", "no steady motion exists near the start", "start without it")
    return x


def straight_course(
    model: Model, speed_mps: float | None = None, *, inputs: Array | None = None, parameters: Array | None = None
) -> OperatingPoint:
    """Straight course of a ship at a speed: the sway velocity and the rudder at which Y and N vanish with r = 0.

    For an asymmetric ship (Y0, N0) neither is zero: the rudder angle is the neutral one. The speed is constant,
    independent of the engine.

    `model`: A ship. `speed_mps`, optional: Surge velocity; by default that at the start. `inputs`, `parameters` (nu,),
    (np,), optional: Values that replace the model's.

    Raises InputError: The model is not a ship, or the course does not exist.
    """
    if "rudder.angle" not in model:
        raise model.fault("", "has no rudder", "this needs the card of a ship (kind linear, abkowitz or mmg)")
    p = model.parameter_values() if parameters is None else parameters
    u = model.input_values() if inputs is None else inputs.copy()
    x = np.array(model.initial(p)).ravel()
    names = model.state_names
    if speed_mps is not None:
        x[names.index("motion.u")] = speed_mps
    unknown = [names.index("motion.v"), names.index("rudder.angle")]
    accelerations = ca.vcat([model.expand(model.symbol(name)) for name in ("motion.vdot", "motion.rdot")])
    arguments = [model.x, model.u, model.p]
    residual = ca.Function("residual", arguments, [accelerations])
    slope = ca.Function("slope", arguments, [ca.jacobian(accelerations, model.x)])

    def with_unknown(values: Array) -> Array:
        full = x.copy()
        full[unknown] = values
        return full

    from scipy.optimize import root  # slow to import, and not needed in most simulations

    solution = root(
        lambda values: np.array(residual(with_unknown(values), u, p)).ravel(),
        x[unknown],
        jac=lambda values: np.array(slope(with_unknown(values), u, p))[:, unknown],
        tol=1e-14,
    )
    residuals = np.abs(np.array(residual(with_unknown(solution.x), u, p)).ravel())
    if not np.all(residuals < 1e-9) or abs(solution.x[1]) > np.pi / 4:
        problem = "no rudder angle below 45 deg holds a straight course"
        raise model.fault("", problem, _cause(np.array(slope(x, u, p))[:, unknown]))
    x = with_unknown(solution.x)
    u[model.input_names.index("rudder.command")] = solution.x[1]
    return OperatingPoint(x, u, p)


def _cause(slopes: Array) -> str:
    """Remedy for a missing straight course, by the slopes (2, 2) of sway and yaw acceleration by v and rudder."""
    by_sway, by_rudder = np.abs(slopes).max(axis=0)
    if not by_sway:
        return "sway moves neither Y nor N: check Yv and Nv of the card"
    if not by_rudder:
        return "the rudder moves neither Y nor N: check Yd and Nd of the card"
    return "check Yd, Nd, Y0 and N0 of the card"
