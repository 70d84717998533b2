"""The one object from which everything is derived: a model with its variables, named and with units.

A :class:`Model` says what its states, inputs and parameters are, and defines named *quantities* (angles, forces,
accelerations) by CasADi expressions of these and of each other. Simulation, linearisation, sensitivities, the C code
and the XML of the FMU all read this object; none of them types an equation or a list of variables again.

Quantities are what makes an effect possible: an effect redefines one (``force.Y`` becomes ``force.Y`` plus something)
and returns a new model. They may be given in any order; the model sorts them by what they use.
"""

from __future__ import annotations

import graphlib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import KW_ONLY, dataclass, field, replace
from functools import cached_property
from typing import TypeVar

import casadi as ca
import numpy as np

from tank2sim.arrays import Array
from tank2sim.errors import InputError
from tank2sim.notices import Notice
from tank2sim.units import UNITS

Kind = TypeVar("Kind", bound="Variable")


@dataclass(frozen=True, eq=False)
class Variable:
    """A named scalar of a model.

    Parameters
    ----------
    name : str
        Structured name as in the FMU, ``motion.u``.
    unit : str
        Key of :data:`tank2sim.units.UNITS`; angles are in rad.
    description : str
        What it is, with its sign convention.
    nominal : float
        A typical magnitude, in `unit`, for solvers that scale.
    minimum, maximum : float, optional
        Bounds, in `unit`.
    display_unit : str, optional
        One of the unit's ``displays``.
    boolean : bool
        A truth value; its symbol holds 0 or 1.
    symbol : casadi.SX
        The scalar that denotes it in expressions; by default a new one. What :func:`dataclasses.replace` makes of a
        variable has the same, so that it fits equations that use it.
    """

    name: str
    unit: str
    description: str
    _: KW_ONLY
    nominal: float = 1.0
    minimum: float | None = None
    maximum: float | None = None
    display_unit: str | None = None
    boolean: bool = False
    symbol: ca.SX = field(default=None, repr=False)  # type: ignore[assignment]

    def __post_init__(self) -> None:
        if self.symbol is None:
            object.__setattr__(self, "symbol", ca.SX.sym(self.name))


@dataclass(frozen=True, eq=False, kw_only=True)
class Parameter(Variable):
    """A constant of the model; `tunable` ones may be changed while a simulation runs."""

    start: float
    tunable: bool = True


@dataclass(frozen=True, eq=False, kw_only=True)
class Input(Variable):
    """Actions on the model from outside.

    `accepted` is the largest magnitude of an order that the model itself holds within its bounds, such as a rudder's at
    its stops; None: a value beyond the bounds is refused.
    """

    start: float = 0.0
    accepted: float | None = None

    @property
    def accepted_range(self) -> tuple[float, float]:
        """Lowest and highest value that may be set."""
        if self.accepted is not None:
            return -self.accepted, self.accepted
        extent = UNITS[self.unit].extent
        low, high = self.minimum, self.maximum
        return -extent if low is None else low, extent if high is None else high


@dataclass(frozen=True, eq=False, kw_only=True)
class State(Variable):
    """A continuous state.

    Parameters
    ----------
    derivative : str
        Name of the quantity that is its time derivative.
    start : casadi.SX or float
        Value at the beginning, an expression of parameters.
    steady : bool
        True if its derivative vanishes in steady motion and trimming solves for it.
    trim : casadi.SX, optional
        Value in steady motion as an expression of inputs and parameters (a rudder at its order).
    """

    derivative: str
    start: ca.SX | float = 0.0
    steady: bool = False
    trim: ca.SX | None = None


@dataclass(frozen=True, eq=False)
class Quantity(Variable):
    """A value defined by an expression of states, inputs, parameters and other quantities."""

    value: ca.SX

    @cached_property
    def uses(self) -> dict[int, str]:
        """Names of the symbols in its expression, by their hash."""
        return {symbol.element_hash(): symbol.name() for symbol in ca.symvar(self.value)}


TRIM_STRIDE = 0.2
"""Longest Newton step towards steady motion, over the nominal size of a state: longer ones leap over the steady motion
near the start, above all near rest, where forces have little slope. Project choice."""


@dataclass(frozen=True, eq=False)
class Model:
    """States, inputs, parameters and the quantities between them.

    Parameters
    ----------
    name, description : str
        The ship (or body), and one sentence on what the model is.
    states, inputs, parameters, quantities : tuples
        The variables.
    outputs : tuple of str
        Names of the states and quantities that are outputs.
    step_s : float
        Step for fixed-step integration (classical Runge-Kutta) at which it is accurate, s.
    notices : tuple of Notice
        What a user of this model should know (assumptions taken, keys not used).
    source : str
        The file that it was built from, for messages; empty if it is of none.

    Raises
    ------
    ValueError
        Two variables have one name, a name or unit is unknown, an expression uses a symbol that is not a variable of
        the model, or quantities define each other in a circle.
    """

    name: str
    description: str
    states: tuple[State, ...] = ()
    inputs: tuple[Input, ...] = ()
    parameters: tuple[Parameter, ...] = ()
    quantities: tuple[Quantity, ...] = ()
    outputs: tuple[str, ...] = ()
    step_s: float = field(kw_only=True)
    notices: tuple[Notice, ...] = ()
    source: str = ""

    def __post_init__(self) -> None:
        names = [variable.name for variable in self.variables]
        if len(set(names)) != len(names):
            raise ValueError(f"doubled variable: {sorted({name for name in names if names.count(name) > 1})}")
        for variable in self.variables:
            unit = UNITS.get(variable.unit)
            if unit is None or variable.display_unit not in (None, *unit.displays):
                raise ValueError(f"{variable.name}: unknown unit {variable.unit} or {variable.display_unit}")
        known = {variable.name for variable in (*self.states, *self.quantities)}
        unknown = [name for name in (*self.outputs, *(state.derivative for state in self.states)) if name not in known]
        if unknown:
            raise ValueError(f"{unknown[0]} is not a state or quantity")
        _ = self._sorted_quantities

    # -- looking things up -------------------------------------------------------------------------------------------

    @property
    def origin(self) -> str:
        """Name of the model with the file it was built from, as messages begin: ``card.toml (Mariner class)``."""
        return f"{self.source} ({self.name})" if self.source else self.name

    def fault(self, place: str, problem: str, remedy: str) -> InputError:
        """An error about this model, to be raised: its place, the problem, and the remedy."""
        return InputError(self.origin, place, problem, remedy)

    @property
    def variables(self) -> tuple[Variable, ...]:
        """All variables: states, inputs, parameters, quantities."""
        return (*self.states, *self.inputs, *self.parameters, *self.quantities)

    def __getitem__(self, name: str) -> Variable:
        return self._by_name[name]

    def __contains__(self, name: str) -> bool:
        return name in self._by_name

    def symbol(self, name: str) -> ca.SX:
        """The symbol of a variable, to write expressions with."""
        return self._by_name[name].symbol

    def symbols(self, names: Iterable[str]) -> ca.SX:
        """The symbols (n, 1) of variables."""
        return ca.vcat([self.symbol(name) for name in names])

    def derivatives_of(self, states: Iterable[str]) -> list[str]:
        """Names of the time derivatives of states."""
        known = {state.name: state.derivative for state in self.states}
        return [known[name] for name in states]

    @cached_property
    def defaults(self) -> Mapping[str, float]:
        """Start values of the parameters by name."""
        return self.parameters_by_name(self.parameter_values())

    @cached_property
    def _by_name(self) -> dict[str, Variable]:
        return {variable.name: variable for variable in self.variables}

    @cached_property
    def state_names(self) -> tuple[str, ...]:
        """Names of the states in the order of the vector x."""
        return tuple(variable.name for variable in self.states)

    @cached_property
    def input_names(self) -> tuple[str, ...]:
        """Names of the inputs in the order of the vector u."""
        return tuple(variable.name for variable in self.inputs)

    @cached_property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of the parameters in the order of the vector p."""
        return tuple(variable.name for variable in self.parameters)

    def input_values(self, changed: Mapping[str, float] | None = None) -> Array:
        """The input vector u: start values, with the values of `changed` (by name) in place.

        Raises
        ------
        InputError
            A value is beyond the bounds of its input.
        """
        self.check_inputs(changed or {})
        return _values(self.inputs, changed or {})

    def check_inputs(self, values: Mapping[str, float]) -> None:
        """Refuse values of inputs, by name, that are beyond their bounds.

        Raises
        ------
        InputError
            One of them is.
        """
        for variable in self.inputs:
            value = values.get(variable.name, variable.start)
            low, high = variable.accepted_range
            if not low <= value <= high:
                remedy = f"it lies between {low:g} and {high:g} {variable.unit}: {variable.description}"
                raise self.fault(variable.name, f"cannot be {value:g} {variable.unit}", remedy)

    def parameter_values(self, changed: Mapping[str, float] | None = None) -> Array:
        """The parameter vector p: start values, with the values of `changed` (by name) in place."""
        return _values(self.parameters, changed or {})

    def parameters_by_name(self, p: Array) -> dict[str, float]:
        """The values of a parameter vector `p` by name."""
        return dict(zip(self.parameter_names, p.tolist(), strict=True))

    def with_values(self, changed: Mapping[str, float]) -> Model:
        """The model with parameters that start at the values of `changed` (by name) in place of their own."""
        parameters = (replace(one, start=changed[one.name]) if one.name in changed else one for one in self.parameters)
        return replace(self, parameters=tuple(parameters))

    # -- making another model of it (what effects do) ----------------------------------------------------------------

    def redefine(self, name: str, value: Callable[[ca.SX], ca.SX]) -> Model:
        """A model in which the quantity `name` has the value ``value(old expression)``."""
        if name not in {quantity.name for quantity in self.quantities}:
            raise ValueError(f"{name} is not a quantity of {self.name}")
        changed = (replace(one, value=ca.SX(value(one.value))) if one.name == name else one for one in self.quantities)
        return replace(self, quantities=tuple(changed))

    def substitute(self, name: str, value: ca.SX) -> Model:
        """A model in which `value` replaces the variable `name`: in quantities, starts and trims.

        `value` may hold the old symbol. A parameter that it does not hold acts on nothing any more, and is dropped.
        """
        return self.substitute_all({name: value})

    def substitute_all(self, values: Mapping[str, ca.SX]) -> Model:
        """As :meth:`substitute`, of several variables at once: symbols in `values` are those from before."""
        old = {name: self.symbol(name) for name in values}
        dropped = {name for name, value in values.items() if not ca.depends_on(value, old[name])}
        kept = tuple(parameter for parameter in self.parameters if parameter.name not in dropped)
        return self._substituted(ca.vcat(list(old.values())), ca.vcat(list(values.values())), kept)

    def with_constants(self, names: Iterable[str]) -> Model:
        """A model without the parameters of these names: their start values are numbers in its equations."""
        given = set(names)
        constants = [parameter for parameter in self.parameters if parameter.name in given]
        if not constants:
            return self
        symbols, starts = ([getattr(one, key) for one in constants] for key in ("symbol", "start"))
        kept = tuple(parameter for parameter in self.parameters if parameter.name not in given)
        return self._substituted(ca.vcat(symbols), ca.SX(ca.vcat(starts)), kept)

    def _substituted(self, old: ca.SX, value: ca.SX, parameters: tuple[Parameter, ...]) -> Model:
        """The model with `value` in place of the symbols `old`, and with `parameters`."""
        gone = {symbol.element_hash() for symbol in ca.symvar(old)}

        def changed(expression: ca.SX | float) -> ca.SX:
            return ca.substitute(ca.SX(expression), old, value)

        quantities = (
            one if gone.isdisjoint(one.uses) else replace(one, value=changed(one.value)) for one in self.quantities
        )
        states = (
            replace(one, start=changed(one.start), trim=None if one.trim is None else changed(one.trim))
            for one in self.states
        )
        return replace(self, quantities=tuple(quantities), states=tuple(states), parameters=parameters)

    def extend(self, *variables: Variable, outputs: Iterable[str] = (), notices: Iterable[Notice] = ()) -> Model:
        """A model with more variables (each put with its own kind), outputs and notices."""

        def of_kind(kind: type[Kind]) -> tuple[Kind, ...]:
            return tuple(variable for variable in variables if isinstance(variable, kind))

        return replace(
            self,
            states=(*self.states, *of_kind(State)),
            inputs=(*self.inputs, *of_kind(Input)),
            parameters=(*self.parameters, *of_kind(Parameter)),
            quantities=(*self.quantities, *of_kind(Quantity)),
            outputs=(*self.outputs, *outputs),
            notices=(*self.notices, *notices),
        )

    def with_constant_inputs(self, names: Iterable[str]) -> Model:
        """A model in which the inputs of these names are parameters, constant at what they start at."""
        given = set(names)
        shared = ("nominal", "minimum", "maximum", "display_unit", "start", "symbol")
        constants = (
            Parameter(one.name, one.unit, one.description, **{key: getattr(one, key) for key in shared})
            for one in self.inputs
            if one.name in given
        )
        remaining = tuple(variable for variable in self.inputs if variable.name not in given)
        return replace(self, inputs=remaining, parameters=(*self.parameters, *constants))

    # -- what is derived ---------------------------------------------------------------------------------------------

    @cached_property
    def x(self) -> ca.SX:
        """State vector (nx, 1) of symbols."""
        return ca.vcat([variable.symbol for variable in self.states])

    @cached_property
    def u(self) -> ca.SX:
        """Input vector (nu, 1) of symbols."""
        return ca.vcat([variable.symbol for variable in self.inputs])

    @cached_property
    def p(self) -> ca.SX:
        """Parameter vector (np, 1) of symbols."""
        return ca.vcat([variable.symbol for variable in self.parameters])

    def expand(self, expression: ca.SX) -> ca.SX:
        """The expression in states, inputs and parameters alone: every quantity is replaced by its definition."""
        ordered = self._sorted_quantities
        definitions = [quantity.value for quantity in ordered]
        expanded: list[ca.SX] = ca.substitute_inplace([q.symbol for q in ordered], definitions, [expression])[1]
        return expanded[0]

    @cached_property
    def rates(self) -> ca.SX:
        """Right-hand side dx/dt (nx, 1) as an expression of x, u, p."""
        return self.expand(ca.vcat([self.symbol(state.derivative) for state in self.states]))

    @cached_property
    def output_values(self) -> ca.SX:
        """Outputs (ny, 1) as an expression of x, u, p."""
        return self.expand(ca.vcat([self.symbol(name) for name in self.outputs]))

    @cached_property
    def rhs(self) -> ca.Function:
        """``rhs(x, u, p) -> xdot``."""
        return ca.Function("rhs", [self.x, self.u, self.p], [self.rates], ["x", "u", "p"], ["xdot"], {"cse": True})

    @cached_property
    def output(self) -> ca.Function:
        """``output(x, u, p) -> y``, in the order of :attr:`outputs`."""
        arguments = [self.x, self.u, self.p]
        return ca.Function("output", arguments, [self.output_values], ["x", "u", "p"], ["y"], {"cse": True})

    @cached_property
    def initial(self) -> ca.Function:
        """``initial(p) -> x``: the states at the beginning."""
        start = ca.vcat([ca.SX(state.start) for state in self.states])
        return ca.Function("initial", [self.p], [start], ["p"], ["x"])

    @cached_property
    def trim_step(self) -> ca.Function | None:
        """``trim_step(x, u, p) -> x``: one Newton step towards steady motion; None if the model has no steady states.

        States with a ``trim`` expression take its value; those marked ``steady`` move by ``-J^-1 f``, f their
        derivatives, shortened to :data:`TRIM_STRIDE`; the others stay.
        """
        places = [place for place, state in enumerate(self.states) if state.steady]
        if not places:
            return None
        fixed = [state.symbol if state.trim is None else state.trim for state in self.states]
        unknown = self.x[places]
        residual = ca.substitute(self.rates[places], self.x, ca.vcat(fixed))
        change = ca.solve(ca.jacobian(residual, unknown), residual)
        # Each state by itself, so that none comes to depend on another that it has nothing to do with.
        stride = TRIM_STRIDE * ca.DM([self.states[place].nominal for place in places])
        change = ca.fmax(-stride, ca.fmin(stride, change))
        for row, place in enumerate(places):
            fixed[place] = self.states[place].symbol - change[row]
        return ca.Function(
            "trim_step", [self.x, self.u, self.p], [ca.vcat(fixed)], ["x", "u", "p"], ["x_next"], {"cse": True}
        )

    @cached_property
    def _sorted_quantities(self) -> tuple[Quantity, ...]:
        by_symbol = {quantity.symbol.element_hash(): quantity for quantity in self.quantities}
        known = {variable.symbol.element_hash() for variable in self.variables}
        uses: dict[Quantity, list[Quantity]] = {}
        for quantity in self.quantities:
            if unknown := [name for key, name in quantity.uses.items() if key not in known]:
                raise ValueError(f"{quantity.name} uses {unknown}, which are not variables of the model")
            uses[quantity] = [by_symbol[key] for key in quantity.uses if key in by_symbol]
        try:
            return tuple(graphlib.TopologicalSorter(uses).static_order())
        except graphlib.CycleError as error:
            circle = [quantity.name for quantity in error.args[1]]
            raise ValueError(f"quantities define each other in a circle: {circle}") from None


def _values(variables: tuple[Parameter, ...] | tuple[Input, ...], changed: Mapping[str, float]) -> Array:
    unknown = set(changed) - {variable.name for variable in variables}
    if unknown:
        raise KeyError(f"unknown variable: {', '.join(sorted(unknown))}")
    return np.array([changed.get(variable.name, variable.start) for variable in variables], dtype=float)


def same_symbol(old: Variable, new: Kind) -> Kind:
    """The variable `new` with the symbol of `old`, which the equations of a model already use."""
    return replace(new, symbol=old.symbol)
