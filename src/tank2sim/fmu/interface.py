"""Interface of an FMU: its variables with value references, and their dependencies."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from tank2sim.dynamics.event_indicators import kinks
from tank2sim.dynamics.hull import VALIDITY_FACTOR
from tank2sim.dynamics.model import Input, Model, Parameter, Variable
from tank2sim.units import UNITS

TRIM_SWITCH = "initial.trim"
"""Boolean parameter that asks for a start in steady motion."""

MAX_STEP = "solver.max_step"

CLAMP_SWITCH = "solver.clamp_inputs"
"""Boolean parameter that asks for inputs to be held within their bounds instead of refused."""

# The structured names of FMI 2.0 (2.2.9), except for quoted parts, which C and file names do not allow.
_STRUCTURED_NAME = re.compile(r"[A-Za-z_]\w*(\[\d+(,\d+)*\])?(\.[A-Za-z_]\w*(\[\d+(,\d+)*\])?)*", re.ASCII)


@dataclass(frozen=True, kw_only=True)
class FmuVariable:
    """A variable of the FMU."""

    name: str
    reference: int  # Value reference, which is also its place in the list of all variables
    description: str
    # `causality`, `variability`, `initial`: As FMI defines them; `initial` empty where FMI wants none.
    causality: str
    variability: str
    initial: str = ""
    unit: str = "1"
    display_unit: str | None = None
    nominal: float = 1.0
    minimum: float | None = None
    maximum: float | None = None
    start: float | None = None  # Start value in `unit`; None where it is calculated
    boolean: bool = False
    derivative_of: int | None = None  # Value reference of the state whose time derivative this is
    # Lowest and highest value that an input may be set to; None: minimum and maximum.
    accepted: tuple[float, float] | None = None

    @property
    def tunable(self) -> bool:
        """A parameter that may be changed while a simulation runs."""
        return self.variability == "tunable"


@dataclass(frozen=True)
class Block:
    """Variables with consecutive value references, ``begin`` to ``end - 1``."""

    name: str
    begin: int
    end: int

    @property
    def references(self) -> range:
        """Value references of its variables."""
        return range(self.begin, self.end)

    def __len__(self) -> int:
        return self.end - self.begin

    def __contains__(self, reference: int) -> bool:
        return self.begin <= reference < self.end


@dataclass(frozen=True)
class Interface:
    """All variables of an FMU, in blocks: time, states, inputs, parameters, two of the solver, rates, other outputs.

    The event indicators (:func:`tank2sim.dynamics.event_indicators.kinks`) are the last of the other outputs.
    A state or its rate that is an output of the model is in its own block, with causality output. Boolean inputs
    and parameters are Boolean variables; a Boolean state or quantity is a real one with value 0 or 1, because in
    Model Exchange FMI lets discrete variables change at events only.
    """

    variables: tuple[FmuVariable, ...]
    states: Block
    inputs: Block
    parameters: Block
    rates: Block
    outputs: Block
    indicators: Block
    trim_switch: int
    """Value reference of ``initial.trim``; 0 if the model has none or cannot be trimmed."""

    @property
    def blocks(self) -> tuple[Block, ...]:
        """The blocks of the model's own variables."""
        return self.states, self.inputs, self.parameters, self.rates, self.outputs, self.indicators

    @property
    def max_step(self) -> int:
        """Value reference of the largest internal step of Co-Simulation."""
        return self.parameters.end

    @property
    def clamp_switch(self) -> int:
        """Value reference of ``solver.clamp_inputs``."""
        return self.parameters.end + 1

    @cached_property
    def validity_factors(self) -> tuple[int, ...]:
        """Value references of the factors of ``validity``, one for each cause."""
        return tuple(variable.reference for variable in self.variables if variable.name.startswith(VALIDITY_FACTOR))

    @cached_property
    def by_name(self) -> dict[str, FmuVariable]:
        """The variables by name."""
        return {variable.name: variable for variable in self.variables}

    def with_causality(self, causality: str) -> tuple[FmuVariable, ...]:
        """The variables of one causality, in the order of value references."""
        return tuple(variable for variable in self.variables if variable.causality == causality)


def interface(model: Model) -> Interface:
    """The interface of a model.

    Raises ValueError: a name is not a structured name of FMI or is one that the FMU gives itself, or a start value is
    not finite.
    """
    rate_names = _rate_names(model)
    others = [name for name in dict.fromkeys(model.outputs) if name not in model.state_names and name not in rate_names]
    counts = (len(model.states), len(model.inputs), len(model.parameters))
    states = Block("STATES", 1, 1 + counts[0])
    inputs = Block("INPUTS", states.end, states.end + counts[1])
    parameters = Block("PARAMETERS", inputs.end, inputs.end + counts[2])
    rates = Block("RATES", parameters.end + 2, parameters.end + 2 + counts[0])
    indicated = kinks(model)
    outputs = Block("OUTPUTS", rates.end, rates.end + len(others) + len(indicated))
    indicators = Block("INDICATORS", outputs.end - len(indicated), outputs.end)
    variables = (
        FmuVariable(
            name="time", reference=0, unit="s", description="Time", causality="independent", variability="continuous"
        ),
        *(_calculated(model, state, states.begin + place) for place, state in enumerate(model.states)),
        *(_input(variable, inputs.begin + place) for place, variable in enumerate(model.inputs)),
        *(_parameter(variable, parameters.begin + place) for place, variable in enumerate(model.parameters)),
        _max_step(model, parameters.end),
        _clamp_switch(parameters.end + 1),
        *(_rate(model, name, place, (states, rates)) for place, name in enumerate(rate_names)),
        *(_calculated(model, model[name], outputs.begin + place) for place, name in enumerate(others)),
        *(_calculated(model, kink, indicators.begin + place) for place, kink in enumerate(indicated)),
    )
    _refuse(variables)
    switch = _trim_switch(model, parameters)
    return Interface(variables, states, inputs, parameters, rates, outputs, indicators, switch)


def _trim_switch(model: Model, parameters: Block) -> int:
    """Value reference of the parameter that asks for a start in steady motion; 0 if there is none."""
    if TRIM_SWITCH in model.parameter_names and model.trim_step is not None and model[TRIM_SWITCH].boolean:
        return parameters.begin + model.parameter_names.index(TRIM_SWITCH)
    return 0


def other_outputs(model: Model) -> tuple[str, ...]:
    """Outputs that are neither states nor rates of states: those that the FMU evaluates as outputs."""
    described = interface(model)
    return tuple(
        variable.name for variable in described.variables[described.outputs.begin : described.indicators.begin]
    )


def _rate_names(model: Model) -> list[str]:
    """Name of the variable that is the rate of each state: its quantity, or ``der(state)`` if that is taken."""
    names: list[str] = []
    for state in model.states:
        taken = state.derivative in names or state.derivative in model.state_names
        names.append(f"der({state.name})" if taken else state.derivative)
    return names


def _shown(variable: Variable, reference: int, **as_fmi: Any) -> FmuVariable:
    """Attributes of a variable, from the model and from FMI."""
    return FmuVariable(
        name=variable.name,
        reference=reference,
        description=variable.description,
        unit=variable.unit,
        display_unit=variable.display_unit,
        nominal=abs(variable.nominal) or 1.0,
        minimum=-UNITS[variable.unit].extent if variable.minimum is None else variable.minimum,
        maximum=UNITS[variable.unit].extent if variable.maximum is None else variable.maximum,
        **as_fmi,
    )


def _calculated(model: Model, variable: Variable, reference: int, derivative_of: int | None = None) -> FmuVariable:
    return _shown(
        variable,
        reference,
        causality="output" if variable.name in model.outputs else "local",
        variability="continuous",
        initial="calculated",
        derivative_of=derivative_of,
    )


def _rate(model: Model, name: str, place: int, blocks: tuple[Block, Block]) -> FmuVariable:
    states, rates = blocks
    state = model.states[place]
    if name == state.derivative:
        return _calculated(model, model[name], rates.begin + place, states.begin + place)
    return FmuVariable(
        name=name,
        reference=rates.begin + place,
        description=f"Time derivative of {state.name}",
        causality="local",
        variability="continuous",
        initial="calculated",
        unit=model[state.derivative].unit,
        derivative_of=states.begin + place,
    )


def _input(variable: Input, reference: int) -> FmuVariable:
    return _shown(
        variable,
        reference,
        causality="input",
        variability="discrete" if variable.boolean else "continuous",
        start=float(variable.start),
        boolean=variable.boolean,
        accepted=None if variable.boolean else variable.accepted_range,
    )


def _parameter(variable: Parameter, reference: int) -> FmuVariable:
    return _shown(
        variable,
        reference,
        causality="parameter",
        variability="tunable" if variable.tunable else "fixed",
        initial="exact",
        start=float(variable.start),
        boolean=variable.boolean,
    )


def _max_step(model: Model, reference: int) -> FmuVariable:
    return FmuVariable(
        name=MAX_STEP,
        reference=reference,
        description="Co-Simulation: largest step of the internal Runge-Kutta integration. Each communication step is "
        "divided into the fewest equal steps that are no longer",
        causality="parameter",
        variability="fixed",
        initial="exact",
        unit="s",
        nominal=model.step_s,
        minimum=0.0,
        start=model.step_s,
    )


def _clamp_switch(reference: int) -> FmuVariable:
    return FmuVariable(
        name=CLAMP_SWITCH,
        reference=reference,
        description="True: an input beyond its bounds is held at the nearer bound, with a warning in the log once for "
        "each input. False: it is refused",
        causality="parameter",
        variability="fixed",
        initial="exact",
        start=0.0,
        boolean=True,
    )


def _refuse(variables: tuple[FmuVariable, ...]) -> None:
    seen: set[str] = set()
    for variable in variables:
        plain = variable.name.removeprefix("der(").removesuffix(")")
        if not _STRUCTURED_NAME.fullmatch(plain):
            raise ValueError(f"{variable.name} is not a structured name of FMI")
        if variable.name in seen:
            raise ValueError(f"{variable.name} is a name that the FMU gives itself")
        seen.add(variable.name)
        if variable.start is not None and not math.isfinite(variable.start):
            raise ValueError(f"{variable.name} starts at {variable.start}")
