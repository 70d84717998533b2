"""Expected answers of an FMU, from the CasADi model alone: by the same scheme, and as exactly as can be."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping

import casadi as ca
import numpy as np

from tank2sim.arrays import Array
from tank2sim.dynamics.model import Model
from tank2sim.fmu.manoeuvre import InputSequence
from tank2sim.simulation.scheme import runge_kutta_step

_TOLERANCE = 1e-11
_STEP_COUNT_ROUNDING = 1e-9

DIRECTIONS = {
    "motion.beta": "motion.speed",
    "motion.cog": "motion.sog",
    "wind.relative_direction": "wind.relative_speed",
}
"""Output that is the direction of a velocity to the one that is its size: as that vanishes, any rounding turns it."""


def by_scheme(model: Model, run: InputSequence) -> Array:
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


def exactly(model: Model, run: InputSequence) -> Array:
    """Outputs (K + 1, ny) at the communication points, integrated adaptively between changes of input.

    Small enough steps are found where the right-hand side has a kink (limits of rate and angle), which a fixed step,
    however short, would straddle. scipy's LSODA, relative tolerance 1e-11 of each state's nominal value.
    """
    from scipy.integrate import solve_ivp  # takes half a second to load, which an export does not need

    nominal = np.array([abs(state.nominal) or 1.0 for state in model.states])
    parameters = model.parameter_values()
    path = np.empty((len(model.states), len(run.times)))
    path[:, 0] = np.array(model.initial(parameters)).ravel()
    for first, behind in run.pieces() if model.states else []:

        def rate(_: float, scaled: Array, held: Array = run.inputs[first]) -> Array:
            rates: Array = np.array(model.rhs(scaled * nominal, held, parameters)).ravel() / nominal
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


def reference_errors(model: Model, expected: Array, found: Mapping[str, Array]) -> dict[str, float]:
    """:func:`relative_errors` of a model's outputs, `expected` (K + 1, ny) in their order.

    Errors of :data:`DIRECTIONS` count by the size of their velocity over its nominal value, 1 at most.
    """
    columns = dict(zip(model.outputs, expected.T, strict=True))
    angles = {name for name in model.outputs if model[name].unit == "rad" and name not in model.state_names}
    sizes = {
        name: columns[size] / model[size].nominal for name, size in DIRECTIONS.items() if {name, size} <= {*columns}
    }
    weights = {name: np.minimum(np.abs(share), 1.0) for name, share in sizes.items()}
    return relative_errors(columns, found, {name: model[name].nominal for name in model.outputs}, angles, weights)


def relative_errors(
    expected: Mapping[str, Array],
    found: Mapping[str, Array],
    nominals: Mapping[str, float],
    angles: Collection[str],
    weights: Mapping[str, Array] | None = None,
) -> dict[str, float]:
    """Name to the largest error, relative to the larger of the signal's range in the run and its nominal value.

    `expected`, `found`: signals (K + 1,) by name. `nominals`: their nominal values; 0 counts as 1. `angles`: those
    (rad) that are calculated again at each point: they may jump by a full turn, a moment sooner or later. `weights`:
    name to the weight of each error (K + 1,), by default 1.
    """
    errors = {}
    for name, signal in expected.items():
        difference = np.abs(found[name] - signal)
        if name in angles:
            difference = np.minimum(difference, np.abs(difference - 2 * np.pi))
        if weights and name in weights:
            difference = difference * weights[name]
        errors[name] = float(np.max(difference)) / max(float(np.ptp(signal)), abs(nominals[name]) or 1.0)
    return errors


def _outputs(model: Model, run: InputSequence, states: Array) -> Array:
    inputs = np.vstack([run.inputs[:1], run.inputs]).T
    parameters = np.tile(model.parameter_values()[:, None], len(run.times))
    outputs: Array = np.array(model.output.map(len(run.times))(ca.DM(states), ca.DM(inputs), ca.DM(parameters))).T
    return outputs
