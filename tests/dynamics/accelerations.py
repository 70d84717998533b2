"""Accelerations of a model at a state: what tests of small craft share."""

from __future__ import annotations

import casadi as ca
import numpy as np

from tank2sim.dynamics.model import Model


def accelerations(model: Model, motion: dict[str, float], inputs: dict[str, float]) -> np.ndarray:
    """udot, vdot, rdot at a state; propellers turn as ordered unless `motion` says otherwise."""
    names = ("motion.udot", "motion.vdot", "motion.rdot")
    function = ca.Function("f", [model.x, model.u, model.p], [model.expand(ca.vcat([model.symbol(n) for n in names]))])
    p = model.parameter_values()
    x = np.array(model.initial(p)).ravel()
    for name, value in motion.items():
        x[model.state_names.index(name)] = value
    return np.array(function(x, model.input_values(inputs), p)).ravel()
