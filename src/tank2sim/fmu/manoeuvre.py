"""Inputs that drive an FMU when it is checked: steps of every input over its range."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tank2sim.arrays import Array

if TYPE_CHECKING:  # the processes that drive an FMU import this module, and would wait for CasADi
    from tank2sim.dynamics.model import Input, Model

_STEP_PATTERN = (4.0, 2.5, 1.0)
"""Communication steps in internal steps, again and again: several, a number that is not whole, and one."""

_REPETITIONS = 400

_REAL_SCHEDULE = ((0.05, 1.0, 0.0), (0.35, 0.0, 1.0), (0.70, 0.5, 0.0))
"""From which share of the run, how much of the way up, how much of the way down."""

_BOOLEAN_SCHEDULE = (0.85, 0.95)
_STAGGER = 0.02


@dataclass(frozen=True)
class InputSequence:
    """Inputs at communication points."""

    times: Array  # (K + 1,): Communication points from 0, s
    inputs: Array  # (K, nu): Inputs held from each point to the next

    def pieces(self) -> list[tuple[int, int]]:
        """Stretches of communication steps, first and behind last, over which no input changes."""
        changes = np.flatnonzero((np.diff(self.inputs, axis=0) != 0).any(axis=1)) + 1
        edges = [0, *(int(change) for change in changes), len(self.inputs)]
        return list(itertools.pairwise(edges))


def manoeuvre(model: Model) -> InputSequence:
    """A run of 3000 internal steps in which each real input goes one way, the other way and half-way back.

    A way is the input's nominal value or half of what its bound leaves, whichever is less (a rudder of 40 deg at most,
    20 deg). Boolean inputs are true for a while near the end. The inputs take turns.
    """
    steps = np.tile(np.array(_STEP_PATTERN) * model.step_s, _REPETITIONS)
    shares = np.arange(len(steps)) / len(steps)
    columns = [_course(variable, shares - _STAGGER * place) for place, variable in enumerate(model.inputs)]
    inputs = np.column_stack(columns) if columns else np.empty((len(steps), 0))
    return InputSequence(np.concatenate([[0.0], np.cumsum(steps)]), inputs)


def _course(variable: Input, shares: Array) -> Array:
    values = np.full(len(shares), float(variable.start))
    if variable.boolean:
        on, off = _BOOLEAN_SCHEDULE
        values[(shares >= on) & (shares < off)] = 1.0 - float(variable.start)
        return values
    up, down = _reach(variable, variable.maximum), _reach(variable, variable.minimum)
    for begin, share_up, share_down in _REAL_SCHEDULE:
        values[shares >= begin] = variable.start + share_up * up - share_down * down
    return values


def _reach(variable: Input, bound: float | None) -> float:
    if bound is None:
        return abs(variable.nominal) / 2
    return min(abs(variable.nominal), abs(bound - variable.start) / 2)
