"""Linearisation about an operating point: exact matrices from CasADi, for python-control with named signals."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np

from tank2sim.arrays import Array
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tank2sim.simulation.straight_course import OperatingPoint, straight_course

if TYPE_CHECKING:
    import control

__all__ = [
    "OperatingPoint",
    "following_states",
    "jacobians",
    "signal_name",
    "slow_slopes",
    "state_space",
    "straight_course",
]


def jacobians(
    model: Model,
    point: OperatingPoint,
    values: Sequence[str],
    states: Sequence[str],
    inputs: Sequence[str],
    *,
    settled: Sequence[str] = (),
) -> tuple[Array, Array]:
    """Derivatives (nv, ns) and (nv, ni) of named quantities or states by named states and by named inputs.

    States in `settled` are eliminated: their rates are zero at any time (the Schur complement). Other states that are
    not named are constant.
    """
    if settled:
        rates = model.derivatives_of(settled)
        whole, inputs_whole = jacobians(model, point, [*values, *rates], [*states, *settled], inputs)
        n, m = len(values), len(states)
        # pinv: a state that nothing drives back (a play) has no place of rest, and moves nothing then
        follow = whole[:n, m:] @ np.linalg.pinv(whole[n:, m:])
        return whole[:n, :m] - follow @ whole[n:, :m], inputs_whole[:n] - follow @ inputs_whole[n:]
    expressions = model.expand(model.symbols(values))
    by_state, by_input = (ca.jacobian(expressions, model.symbols(names)) for names in (states, inputs))
    both = ca.Function("jacobians", [model.x, model.u, model.p], [by_state, by_input])(point.x, point.u, point.p)
    return np.array(both[0]), np.array(both[1])


def slow_slopes(model: Model, values: Sequence[str], by: Sequence[str], settled: Sequence[str]) -> ca.SX:
    """Slopes (nv, nb) of named quantities by named states, of x, u and p, where the states `settled` follow at once."""
    rows = model.expand(model.symbols([*values, *model.derivatives_of(settled)]))
    whole = ca.densify(ca.jacobian(rows, model.symbols([*by, *settled])))
    n, m = len(values), len(by)
    if not settled:
        return whole
    return whole[:n, :m] - whole[:n, m:] @ ca.solve(whole[n:, m:], whole[n:, :m])


def state_space(
    model: Model,
    point: OperatingPoint,
    *,
    states: Sequence[str] | None = None,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
    settled: Sequence[str] = (),
) -> control.StateSpace:
    """The linearised model as a ``control.StateSpace`` whose signals have the model's names (:func:`signal_name`).

    Parameters
    ----------
    model, point
        The model, and its operating point.
    states, inputs, outputs : sequences of str, optional
        Names to keep; by default all real ones. Omitted states are constant. A state may be an input: the
        rudder angle without its gear.
    settled : sequence of str
        Omitted states that follow the others at once (:func:`jacobians`).
    """
    import control  # slow to load

    states = list(model.state_names if states is None else states)
    inputs = [v.name for v in model.inputs if not v.boolean] if inputs is None else list(inputs)
    outputs = list(model.outputs if outputs is None else outputs)
    A, B = jacobians(model, point, model.derivatives_of(states), states, inputs, settled=settled)
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


def following_states(
    model: Model, point: OperatingPoint, states: Sequence[str], inputs: Sequence[str]
) -> tuple[str, ...]:
    """Return the states left out of `states` and `inputs` that the rates of `states` depend on, directly or not.

    These follow the others at once (the `settled` of :func:`state_space`); those that nothing depends on, such as the
    position in calm water, stay where they are.

    Raises
    ------
    InputError
        A state is not one of the model, or those left out come to no rest by themselves.
    """
    names = list(model.state_names)
    if unknown := next((name for name in states if name not in names), ""):
        raise InputError("states", unknown, "is not a state of the model", f"there are: {', '.join(names)}")
    rates, _ = jacobians(model, point, model.derivatives_of(names), names, [])
    felt = np.isin(names, states)
    free = ~felt & ~np.isin(names, inputs)
    while (added := free & ~felt & rates[felt].any(axis=0)).any():
        felt |= added
    found = np.flatnonzero(felt & free)
    if len(found) and np.linalg.eigvals(rates[np.ix_(found, found)]).real.max() >= 0:
        missing = ", ".join(names[place] for place in found)
        problem = f"leave out {missing}: the others depend on what is left out, and it does not settle by itself"
        raise InputError("states", "", problem, f"add {missing} to the states")
    return tuple(names[place] for place in found)


def signal_name(name: str) -> str:
    """A model's name in the form of python-control: ``rudder.command`` is ``rudder_command``.

    Its dot separates system and signal.
    """
    return name.replace(".", "_")
