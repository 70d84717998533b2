"""An effect: a function from model to model, with its declarations."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import casadi as ca

from tank2sim.cards.card import SteeredBy, SteeredCard
from tank2sim.cards.terms import known_term
from tank2sim.dynamics.abkowitz import ALL_TERMS
from tank2sim.dynamics.model import Input, Model, Parameter, Quantity

_UNITS = {"mps": "m/s", "radps": "rad/s", "rad": "rad", "m": "m", "s": "s", "N": "N", "prime": "1"}
"""Suffix of a parameter's name to its unit; a name without one of these has unit 1."""

_SHOWN = {"rad": "deg", "radps": "deg/s", "mps": "knots"}

STEPS_PER_TIME_CONSTANT = 5
"""Integration steps in a time constant, as for the steering gear: classical Runge-Kutta then errs by less than 1e-5 of
the change, (1/5)^5/120, in each step."""


BEYOND_CARD = 2.0
"""Largest speed or length that an input takes over the largest that a card may give: a hurricane and a depth of the
ocean are within, an order in a wrong unit seldom is. Project choice."""

Values = tuple[float, ...]


@dataclass(frozen=True)
class EffectParameter:
    """A parameter of an effect.

    Parameters
    ----------
    name : str
        Name with its unit in SI (``direction_rad``; a card may give ``direction_deg``).
    description : str
        What it is, with its sign; small first letter.
    minimum : float or callable
        Physical lower bound, SI, or what determines it from the card (:meth:`lowest`).
    maximum : float
        Physical upper bound, SI.
    default : float or callable, optional
        Value where a card gives none, or what takes it from the card; without one the parameter is required.
    input_name : str, optional
        The parameter is an input of the model under this name (``current.speed``), which starts at the card's value.
        All others become tunable parameters of the model.
    absent : float, optional
        Value, SI, at which the effect vanishes; if several parameters have one, when all of them are at it. None for
        what only shapes an effect (directions, times), and for what replaces something that the ship has
        anyway (the gear).
    typical : tuple or callable, optional
        Values, SI, from which a search begins, or a function of the card that gives them: one for an amplitude, of the
        size in which the effect is common; a short grid over what is plausible for a shape, the likeliest first. An
        effect with a required parameter without typical values is not tried on trials.
    spread : float or callable, optional
        Standard deviation, SI, of what is known beforehand of a parameter with a default, if a search shall estimate
        it with the others; None: it stays at its default.
    worse : int
        1 if the fault is a larger value than the ship's own, -1 if a smaller one (the rate of a gear), 0 if either.
    optional : bool
        True if an identification leaves it at its default where the card does not state it.
    """

    name: str
    description: str
    minimum: float | Callable[[SteeredCard], float]
    maximum: float
    default: float | Callable[[SteeredCard], float] | None = None
    input_name: str | None = None
    absent: float | None = field(default=None, kw_only=True)
    typical: Values | Callable[[SteeredCard], Values] = field(default=(), kw_only=True)
    spread: float | Callable[[SteeredCard], float] | None = field(default=None, kw_only=True)
    worse: int = field(default=0, kw_only=True)
    optional: bool = field(default=False, kw_only=True)

    @property
    def stem(self) -> str:
        """The name without its unit."""
        stem, _, suffix = self.name.rpartition("_")
        return stem if stem and suffix in _UNITS else self.name

    def value(self, values: Mapping[str, float], card: SteeredCard) -> float:
        """Its value, SI: as given, or the default. Raises KeyError if there is neither."""
        if self.name in values or self.default is None:
            return values[self.name]
        return self.default(card) if callable(self.default) else self.default

    def lowest(self, card: SteeredCard) -> float:
        """The lower bound on this ship, SI."""
        return self.minimum(card) if callable(self.minimum) else self.minimum

    def typical_values(self, card: SteeredCard) -> Values:
        """Values from which a search begins on this ship, SI; none if it is not to be tried."""
        return self.typical(card) if callable(self.typical) else self.typical

    def spread_value(self, card: SteeredCard) -> float | None:
        """Standard deviation beforehand on this ship, SI; None if the parameter stays at its default."""
        return self.spread(card) if callable(self.spread) else self.spread

    def variable(self, effect: str, value: float, card: SteeredCard) -> Parameter | Input:
        """The model's variable that holds it, ``<effect>.<name without its unit>`` if it is not an input."""
        suffix = self.name.removeprefix(self.stem).lstrip("_")
        unit, description = _UNITS.get(suffix, "1"), self.description[0].upper() + self.description[1:]
        if self.input_name:
            return Input(
                self.input_name,
                unit,
                description,
                display_unit=_SHOWN.get(suffix),
                # A direction may go round and round, and a negative speed is one the other way.
                minimum={
                    "rad": None,
                    "m/s": -BEYOND_CARD * self.maximum,
                    "m": min(self.lowest(card), BEYOND_CARD * self.lowest(card)),
                }.get(unit, self.lowest(card)),
                maximum={"rad": None, "m/s": BEYOND_CARD * self.maximum, "m": BEYOND_CARD * self.maximum}.get(
                    unit, self.maximum
                ),
                start=value,
            )
        return Parameter(
            f"{effect}.{self.stem}",
            unit,
            description,
            display_unit=_SHOWN.get(suffix),
            nominal=0.1 * (self.maximum - self.lowest(card)),
            minimum=self.lowest(card),
            maximum=self.maximum,
            start=value,
        )


def side_force(cause: str, Y: float, N: float) -> tuple[EffectParameter, ...]:
    """Parameters ``Y_prime`` and ``N_prime`` of a side force by a `cause`, with their typical values (prime)."""
    return tuple(
        EffectParameter(
            f"{axis}_prime", f"{what} {cause}, positive to starboard", -0.01, 0.01, absent=0.0, typical=(size,)
        )
        for axis, what, size in (("Y", "sway force", Y), ("N", "yaw moment", N))
    )


EffectSymbols = Mapping[str, ca.SX]
"""The symbols of an effect's parameters and inputs, by name without unit (:attr:`EffectParameter.stem`)."""

EffectEquations = Callable[[Model, EffectSymbols, SteeredCard], Model]

Readings = Callable[[EffectSymbols, EffectSymbols], Mapping[str, ca.SX]]
"""``readings(motion, given)``: what sensors show, by the name of the variable that they measure; `motion` holds the
symbols of :data:`MEASURED_BEFOREHAND`, `given` has the effect's parameters."""

MEASURED_BEFOREHAND = ("motion.u", "motion.v", "motion.r", "motion.psi", "motion.x", "motion.y")
"""Variables that a sensor may show wrongly."""


def unchanged(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """The equations of an effect that does not reach the ship."""
    return model


ACTIONS = ("force", "mass", "force and mass", "actuator", "propulsion", "kinematics", "sensor")
"""Things that an effect may act on."""


@dataclass(frozen=True)
class Effect:
    """A physical effect on top of the polynomial.

    Parameters
    ----------
    name : str
        Name in cards.
    acts_on : str
        One of :data:`ACTIONS`.
    description : str
        A sentence for people.
    source : str
        Where the equation comes from.
    parameters : tuple
        What a card gives; those without a default are required.
    equations : callable
        ``equations(model, symbols, card) -> model``: changes a model that has the parameters already; by default not.
    readings : callable, optional
        What faulty sensors show: see :data:`Readings`. The expressions must be affine in the variables that they are
        of, so that a record can be corrected.
    delays : mapping
        Name of an input to the parameter (a time, s) by which the ship answers late to the record of that input: it
        acts at t on the recorded value at t - delay.
    changes : tuple of str
        Derivatives, where the effect is nothing but other values of these: once found, it is written into
        ``[derivatives]`` of a card. Empty for all other effects.
    magnified_by : str
        Name of the parameter f, where the effect multiplies the forces of all terms in `changes` by 1 + f in place of
        the derivatives themselves.
    reads_derivatives : bool
        True if its forces are made from ``derivatives.*`` of the model. Such an effect does not see what an earlier one
        changed, and would if that were written into the card: both then stay ``[[effects]]`` in their order.
    in_place_of : mapping
        Parameter to the model's variable of the steering gear in whose place it acts (``steering.max_rate``), where it
        states what ``[steering_gear]`` of the card may state under the name of the parameter: once found, it is written
        there.
    states_behind : mapping
        State of its own that nothing but an order drives to the input of that order (``rudder.command``).
    behind_indicator : bool
        True if an effect of an actuator acts between the measured angle of the rudder and the rudder itself.
    measured_as : mapping
        Parameter to the signal of a trial that measures it (``wind_speed_mps``).
    in_mmg : bool
        True if the equations of the MMG method have it already: it is not for such a card.
    in_roll : bool
        True if a card with ``[roll]`` has it already: it is not for such a card.
    includes : tuple of str
        Effects that are a simpler form of this one: they are not sought together with it.
    nearly_like : str
        Effect that shows nearly in the same way (where the rudder is put over and held): where one explains trials
        best, the other is tried in its place.
    sought : bool
        False if it is not to be tried on trials: what it describes is given, not found, or another effect is sought in
        its place.
    of_craft : bool
        True if a small craft with thrusters can have it: it reads nothing of a card but ``ship`` and ``environment``,
        and nothing of a model that only a hull in the prime system or a rudder has.
    resonant : bool
        True if it swings at a frequency of its own near the waves' frequency, so that waves hide it.
    last : bool
        True if a card's model gets it after all other effects: it changes the mass and draught in their forces.
    terminal : str
        What its inputs are together, a few words for the FMI terminal that joins them.
    """

    name: str
    acts_on: str
    description: str
    source: str
    parameters: tuple[EffectParameter, ...]
    equations: EffectEquations = unchanged
    readings: Readings | None = None
    delays: Mapping[str, str] = field(default_factory=dict)
    changes: tuple[str, ...] = ()
    magnified_by: str = ""
    reads_derivatives: bool = False
    in_place_of: Mapping[str, str] = field(default_factory=dict)
    states_behind: Mapping[str, str] = field(default_factory=dict)
    behind_indicator: bool = False
    measured_as: Mapping[str, str] = field(default_factory=dict)
    terminal: str = ""
    of_craft: bool = False
    in_mmg: bool = False
    in_roll: bool = False
    includes: tuple[str, ...] = ()
    nearly_like: str = ""
    sought: bool = True
    last: bool = False
    resonant: bool = False

    @property
    def inside_gear(self) -> bool:
        """True if all of it is between the rudder order and a measured angle of the rudder."""
        return self.acts_on == "actuator" and not self.behind_indicator

    @property
    def surroundings(self) -> bool:
        """True for a wind or a current: its speed and direction are inputs of the model, and each trial has its own."""
        inputs = {parameter.name for parameter in self.parameters if parameter.input_name}
        return inputs == set(self.measured_as) == {"speed_mps", "direction_rad"}

    @property
    def fits_craft(self) -> bool:
        """True if a small craft with thrusters can have it: it says so, or only a sensor is at fault."""
        return self.of_craft or self.readings is not None

    def required(self) -> tuple[str, ...]:
        """Names of the parameters without a default."""
        return tuple(parameter.name for parameter in self.parameters if parameter.default is None)

    def free(self, card: SteeredCard) -> tuple[str, ...]:
        """Names of the parameters that a search estimates: the required ones, and those with a spread."""
        required = self.required()
        return tuple(
            parameter.name
            for parameter in self.parameters
            if parameter.name in required or parameter.spread_value(card) is not None
        )

    def tried(self, card: SteeredCard) -> bool:
        """True if a search can begin: this ship's model can have it, and required parameters have typical values."""
        if card.steered_by is SteeredBy.THRUSTERS and not self.fits_craft:
            return False
        if not self.sought or (self.in_mmg and card.model.kind == "mmg") or (self.in_roll and card.roll):
            return False
        required = self.required()
        return all(parameter.typical_values(card) for parameter in self.parameters if parameter.name in required)

    @property
    def input_names(self) -> frozenset[str]:
        """Names of the inputs that it adds to a model."""
        return frozenset(parameter.input_name for parameter in self.parameters if parameter.input_name)

    def changes_on(self, card: SteeredCard) -> tuple[str, ...]:
        """Derivatives as in `changes`; none where they are the rudder's and the card has an MMG rudder instead."""
        by_rudder = bool(self.changes) and all(known_term(name).d for name in self.changes)
        return () if by_rudder and card.model.kind == "mmg" else self.changes

    def model_names(self) -> dict[str, str]:
        """Name of each parameter (in SI) to the name of the model's variable that holds it."""
        return {
            parameter.name: parameter.input_name or f"{self.name}.{parameter.stem}" for parameter in self.parameters
        }

    def apply(self, model: Model, values: Mapping[str, float], card: SteeredCard) -> Model:
        """The model with this effect.

        `model`: model of the ship, with or without other effects. `values`: SI, by the names of the parameters; those
        with a default may be absent. `card`: card of the ship, for what the effect needs to know of it. Raises
        InputError: the card lacks something that the effect needs, or the model has one of its variables already.
        Raises KeyError: a required value is missing.
        """
        if self.in_mmg and card.model.kind == "mmg":
            raise card.fault("effects", f"{self.name} is part of the MMG method already", "leave it out")
        if self.in_roll and card.roll:
            raise card.fault("effects", f"{self.name} is part of the card's own [roll]", "leave one of the two out")
        variables = {
            parameter.stem: parameter.variable(self.name, parameter.value(values, card), card)
            for parameter in self.parameters
        }
        taken = [variable.name for variable in variables.values() if variable.name in model]
        if taken:
            remedy = "leave one of the two out, or rename the variable of the effect"
            raise card.fault("effects", f"{self.name} adds {taken[0]}, which the model has already", remedy)
        symbols = {stem: variable.symbol for stem, variable in variables.items()}
        changed = self.equations(model.extend(*variables.values()), symbols, card)
        if self.readings is None:
            return changed
        return with_readings(
            changed, self.readings({name: model.symbol(name) for name in MEASURED_BEFOREHAND}, symbols)
        )


def sensor_fault_of(effect: Effect) -> str:
    """First fault in the declarations of an effect, "" if none: for effects from other packages."""
    parameters = {parameter.name for parameter in effect.parameters}
    if effect.acts_on not in ACTIONS:
        return f"acts_on is {effect.acts_on!r}; give one of {', '.join(ACTIONS)}"
    if not effect.description or not effect.source:
        return "description or source is empty"
    named = {*effect.delays.values(), *effect.in_place_of, *effect.measured_as}
    if wrong := [name for name in [*named, effect.magnified_by] if name and name not in parameters]:
        return f"it names {wrong[0]}, which is not among its parameters"
    if wrong := [name for name in effect.changes if name not in ALL_TERMS]:
        return f"changes names {wrong[0]}, which is not a derivative"
    return ""


def with_readings(model: Model, shown: Mapping[str, ca.SX]) -> Model:
    """The model with quantities ``sensor.*`` of what its sensors show: ``sensor.psi`` for ``motion.psi``.

    `model`: where it has such a quantity already, the new fault acts on what the earlier one shows. `shown`: name of
    the variable measured to the expression shown, of the model's symbols.
    """
    names = {name: name.replace("motion.", "sensor.") for name in shown}
    faulty = [name for name in shown if names[name] in model]
    earlier = {quantity.name: quantity.value for quantity in model.quantities if quantity.name.startswith("sensor.")}
    symbols, values = [model.symbol(name) for name in faulty], [earlier[names[name]] for name in faulty]
    for name, expression in shown.items():
        true = model[name]
        value = ca.substitute(expression, ca.vcat(symbols), ca.vcat(values)) if faulty else expression
        if name in faulty:
            model = model.redefine(names[name], lambda _, value=value: value)  # type: ignore[misc]
            continue
        description = f"What the sensor shows: {true.description[0].lower()}{true.description[1:]}"
        model = model.extend(
            Quantity(
                names[name], true.unit, description, ca.SX(value), display_unit=true.display_unit, nominal=true.nominal
            )
        )
    return model


def with_steps_for(model: Model, name: str, share: float = 1.0) -> Model:
    """The model with a step, halved as often as needed, that resolves `share` of the parameter `name` (a time, s)."""
    parameter = model[name]
    assert isinstance(parameter, Parameter)
    return with_steps_for_time(model, share * parameter.start)


def with_steps_for_time(model: Model, time_s: float) -> Model:
    """The model with a step, halved as often as needed, that resolves a time constant (s)."""
    step = model.step_s
    while step * STEPS_PER_TIME_CONSTANT > time_s * (1 + 1e-9):
        step /= 2
    return replace(model, step_s=step)


def refuse_given(card: SteeredCard, effect: str, parameter: str, remedy: str) -> None:
    """Raise InputError if the card gives a parameter (its name in SI) of an effect that would act on nothing."""
    for number, entry in enumerate(card.effects):
        if entry.name == effect and parameter in entry.parameters:
            raise card.fault(f"effects.{number}.parameters.{parameter}", "acts on nothing on this card", remedy)


def card_particular(card: SteeredCard, key: str, remedy: str) -> float:
    """A number of the card's ``[ship]``; raises InputError that names the key if the card has none."""
    value = getattr(card.ship, key)
    if value is None:
        raise card.fault(f"ship.{key}", "is missing", remedy)
    return float(value)
