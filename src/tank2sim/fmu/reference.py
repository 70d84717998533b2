"""What an FMU should answer, from the CasADi model alone: by the same scheme, and as exactly as can be."""

from __future__ import annotations

import math

import casadi as ca
import numpy as np
from scipy.integrate import solve_ivp

from tank2sim.dynamics.model import Model, Vector
from tank2sim.fmu.manoeuvre import Manoeuvre
from tank2sim.simulation.scheme import runge_kutta_step

_TOLERANCE = 1e-11
_STEP_COUNT_ROUNDING = 1e-9


def by_scheme(model: Model, run: Manoeuvre) -> Vector:
    """Outputs (K + 1, ny) at the communication points, by the internal steps that Co-Simulation takes.

    A communication step H is divided into the fewest equal classical Runge-Kutta steps no longer than ``model.step_s``.
    The whole run is one CasADi evaluation. Outputs go with the inputs of the step before the point.
    """
    lengths = np.diff(run.times)
    counts = [max(1, math.ceil(length / model.step_s * (1 - _STEP_COUNT_ROUNDING))) for length in lengths]
    start = np.array(model.initial(model.parameter_values())).ravel()
    if not model.states:
        return _outputs(model, run, np.empty((0, len(run.times))))
    steps = runge_kutta_step(model).mapaccum(sum(counts))
    inputs = np.repeat(run.inputs, counts, axis=0).T
    parameters = np.tile(model.parameter_values()[:, None], sum(counts))
    path = np.array(steps(start, inputs, parameters, np.repeat(lengths / counts, counts)[None, :]))
    return _outputs(model, run, np.column_stack([start, path[:, np.cumsum(counts) - 1]]))


def exactly(model: Model, run: Manoeuvre) -> Vector:
    """Outputs (K + 1, ny) at the communication points, integrated adaptively between changes of input.

    Small enough steps are found where the right-hand side has a kink (limits of rate and angle), which a fixed step,
    however short, would straddle. scipy's LSODA, relative tolerance 1e-11 of each state's nominal value.
    """
    nominal = np.array([abs(state.nominal) or 1.0 for state in model.states])
    parameters = model.parameter_values()
    path = np.empty((len(model.states), len(run.times)))
    path[:, 0] = np.array(model.initial(parameters)).ravel()
    for first, behind in run.pieces() if model.states else []:

        def rate(_: float, scaled: Vector, held: Vector = run.inputs[first]) -> Vector:
            rates: Vector = np.array(model.rhs(scaled * nominal, held, parameters)).ravel() / nominal
            return rates

        times = run.times[first : behind + 1]
        tolerances = {"rtol": _TOLERANCE, "atol": _TOLERANCE}
        solution = solve_ivp(
            rate, (times[0], times[-1]), path[:, first] / nominal, "LSODA", t_eval=times[1:], **tolerances
        )
        if not solution.success:
            raise RuntimeError(f"the reference cannot be integrated: {solution.message}")
        path[:, first + 1 : behind + 1] = solution.y * nominal[:, None]
    return _outputs(model, run, path)


def _outputs(model: Model, run: Manoeuvre, states: Vector) -> Vector:
    inputs = np.vstack([run.inputs[:1], run.inputs]).T
    parameters = np.tile(model.parameter_values()[:, None], len(run.times))
    outputs: Vector = np.array(model.output.map(len(run.times))(ca.DM(states), ca.DM(inputs), ca.DM(parameters))).T
    return outputs
