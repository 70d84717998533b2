"""Which variables of an FMU depend on which others, from the sparsity of CasADi's Jacobians."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from tank2sim.dynamics.model import Model
from tank2sim.fmu.interface import Interface
from tank2sim.fmu.sources import other_values

Pattern = NDArray[np.bool_]
"""Rows are unknowns, columns are knowns; True where a row may depend on a column."""


@dataclass(frozen=True)
class Unknown:
    """A variable and those it depends on."""

    reference: int  # Value reference of the variable
    dependencies: tuple[int, ...]  # Value references of what it depends on, ascending
    # For each, FMI's dependenciesKind: ``constant`` (a constant factor), ``fixed`` and ``tunable`` (a factor that only
    # parameters determine), else ``dependent``.
    kinds: tuple[str, ...]


@dataclass(frozen=True)
class FmuStructure:
    """FMI's ModelStructure."""

    outputs: tuple[Unknown, ...]
    rates: tuple[Unknown, ...]
    initial_unknowns: tuple[Unknown, ...]
    indicators: tuple[Unknown, ...]


def fmu_structure(model: Model, interface: Interface) -> FmuStructure:
    """Dependencies of outputs and rates on states and inputs, and of initial values on parameters and inputs."""
    knowns = [*interface.states.references, *interface.inputs.references]
    while_running = {
        unknown.reference: unknown
        for unknown in (
            *_unknowns(model, interface, knowns, model.rates, interface.rates.begin),
            *_unknowns(model, interface, knowns, other_values(model), interface.outputs.begin),
            # An output that is a state depends on itself alone.
            *(Unknown(place, (place,), ("constant",)) for place in interface.states.references),
        )
    }
    outputs = [variable.reference for variable in interface.with_causality("output")]
    return FmuStructure(
        outputs=tuple(while_running[reference] for reference in outputs),
        rates=tuple(while_running[reference] for reference in interface.rates.references),
        initial_unknowns=_initial_unknowns(model, interface),
        indicators=tuple(while_running[reference] for reference in interface.indicators.references),
    )


def _unknowns(model: Model, interface: Interface, knowns: list[int], results: ca.SX, begin: int) -> list[Unknown]:
    jacobian = ca.SX(ca.jacobian(ca.SX(results), ca.vertcat(ca.SX(model.x), ca.SX(model.u))))
    parameters = {variable.symbol.element_hash(): variable.tunable for variable in model.parameters}
    rows: list[list[tuple[int, str]]] = [[] for _ in range(jacobian.shape[0])]
    for row, column, factor in zip(*jacobian.sparsity().get_triplet(), jacobian.nonzeros(), strict=True):
        known = interface.variables[knowns[column]]
        rows[row].append((known.reference, "dependent" if known.boolean else _kind(factor, parameters)))
    return [
        Unknown(begin + place, tuple(reference for reference, _ in row), tuple(kind for _, kind in row))
        for place, row in enumerate(sorted(row) for row in rows)
    ]


def _kind(factor: Any, parameters: dict[int, bool]) -> str:
    symbols = [symbol.element_hash() for symbol in ca.symvar(factor)]
    # A factor of zero that is there nevertheless: a piecewise constant function, such as a sign.
    if factor.is_zero() or not all(symbol in parameters for symbol in symbols):
        return "dependent"
    if not symbols:
        return "constant"
    return "tunable" if any(parameters[symbol] for symbol in symbols) else "fixed"


def _initial_unknowns(model: Model, interface: Interface) -> tuple[Unknown, ...]:
    """All that is calculated at the start, through the initial states, from inputs and parameters."""
    x, knowns = ca.SX(model.x), ca.vertcat(ca.SX(model.u), ca.SX(model.p))
    states = _initial_states(model, interface)
    results = ca.vertcat(ca.SX(model.rates), ca.SX(other_values(model)))
    direct, through_states = _pattern(results, knowns), _pattern(results, x)
    pattern = np.vstack([states, direct | _product(through_states, states)])
    references = [*interface.states.references, *range(interface.rates.begin, interface.outputs.end)]
    columns = [*interface.inputs.references, *interface.parameters.references]
    listed = [*interface.with_causality("output"), *interface.variables[interface.rates.begin : interface.rates.end]]
    listed += interface.variables[interface.states.begin : interface.states.end]
    wanted = {variable.reference for variable in listed}
    found = {
        reference: tuple(columns[place] for place in np.flatnonzero(row))
        for reference, row in zip(references, pattern, strict=True)
        if reference in wanted
    }
    return tuple(Unknown(reference, known, ("dependent",) * len(known)) for reference, known in found.items())


def _initial_states(model: Model, interface: Interface) -> Pattern:
    """States at the start (rows) against inputs and parameters (columns), also if the start is in steady motion."""
    x, knowns = ca.SX(model.x), ca.vertcat(ca.SX(model.u), ca.SX(model.p))
    start = ca.SX(model.initial(model.p)) if len(model.states) else ca.SX(0, 1)
    pattern = _pattern(start, knowns)
    if not interface.trim_switch or model.trim_step is None:
        return pattern
    trimmed = model.trim_step(model.x, model.u, model.p)
    through_states, direct = _pattern(trimmed, x), _pattern(trimmed, knowns)
    moved = direct.any(axis=1) | (through_states != np.eye(len(x.nonzeros()), dtype=bool)).any(axis=1)
    direct[moved, len(model.inputs) + model.parameter_names.index(interface.variables[interface.trim_switch].name)] = (
        True
    )
    while True:
        wider = pattern | direct | _product(through_states, pattern)
        if (wider == pattern).all():
            return pattern
        pattern = wider


def _pattern(results: ca.SX, variables: ca.SX) -> Pattern:
    pattern = np.zeros((results.numel(), variables.numel()), dtype=bool)
    rows, columns = ca.jacobian_sparsity(ca.densify(results), variables).get_triplet()
    pattern[rows, columns] = True
    return pattern


def _product(first: Pattern, second: Pattern) -> Pattern:
    product: Pattern = (first.astype(int) @ second.astype(int)) > 0
    return product
