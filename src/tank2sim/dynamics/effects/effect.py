"""What an effect is: a function from model to model, with what it needs to know."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import casadi as ca

from tank2sim.cards.card import ManoeuvringCard
from tank2sim.dynamics.model import Input, Model, Parameter

_UNITS = {"mps": "m/s", "radps": "rad/s", "rad": "rad", "m": "m", "s": "s", "prime": "1"}
"""Suffix of a parameter's name to its unit; a name without one of these has unit 1."""

_SHOWN = {"rad": "deg", "radps": "deg/s", "mps": "knots"}

STEPS_PER_TIME_CONSTANT = 5
"""Integration steps in a time constant, as for the steering gear: classical Runge-Kutta then errs by less than 1e-5 of
the change, (1/5)^5/120, in each step."""


@dataclass(frozen=True)
class EffectParameter:
    """A parameter of an effect.

    Parameters
    ----------
    name : str
        Name with its unit in SI (``direction_rad``; a card may give ``direction_deg``).
    description : str
        What it is, with its sign; small first letter.
    minimum, maximum : float
        Physical bounds, SI.
    default : float or callable, optional
        Value where a card gives none, or what tells it from the card; without one the parameter is required.
    input_name : str, optional
        The parameter is an input of the model under this name (``current.speed``), which starts at the card's value.
        All others become tunable parameters of the model.
    """

    name: str
    description: str
    minimum: float
    maximum: float
    default: float | Callable[[ManoeuvringCard], float] | None = None
    input_name: str | None = None

    @property
    def stem(self) -> str:
        """The name without its unit."""
        stem, _, suffix = self.name.rpartition("_")
        return stem if stem and suffix in _UNITS else self.name

    def value(self, values: Mapping[str, float], card: ManoeuvringCard) -> float:
        """Its value, SI: as given, or the default. Raises KeyError if there is neither."""
        if self.name in values or self.default is None:
            return values[self.name]
        return self.default(card) if callable(self.default) else self.default

    def variable(self, effect: str, value: float) -> Parameter | Input:
        """The model's variable that holds it, ``<effect>.<name without its unit>`` if it is no input."""
        suffix = self.name.removeprefix(self.stem).lstrip("_")
        unit, description = _UNITS.get(suffix, "1"), self.description[0].upper() + self.description[1:]
        if self.input_name:
            return Input(
                name=self.input_name,
                unit=unit,
                description=description,
                display_unit=_SHOWN.get(suffix),
                # A direction that goes round and round is one; nothing is known of the largest wind.
                minimum=None if unit == "rad" else self.minimum,
                start=value,
            )
        return Parameter(
            name=f"{effect}.{self.stem}",
            unit=unit,
            description=description,
            display_unit=_SHOWN.get(suffix),
            nominal=0.1 * (self.maximum - self.minimum),
            minimum=self.minimum,
            maximum=self.maximum,
            start=value,
        )


Symbols = Mapping[str, ca.SX]
"""The symbols of an effect's parameters and inputs, by name without unit (:attr:`EffectParameter.stem`)."""

Equations = Callable[[Model, Symbols, ManoeuvringCard], Model]


@dataclass(frozen=True)
class Effect:
    """A physical effect on top of the polynomial.

    Parameters
    ----------
    name : str
        Name in cards.
    acts_on : str
        ``force``, ``mass``, ``force and mass``, ``actuator``, ``propulsion`` or ``kinematics``.
    description : str
        A sentence for people.
    source : str
        Where the equation comes from.
    parameters : tuple
        What a card gives; those without a default are required.
    equations : callable
        ``equations(model, symbols, card) -> model``: changes a model that has the parameters already.
    """

    name: str
    acts_on: str
    description: str
    source: str
    parameters: tuple[EffectParameter, ...]
    equations: Equations

    def model_names(self) -> dict[str, str]:
        """Name of each parameter (in SI) to the name of the model's variable that holds it."""
        return {one.name: one.input_name or f"{self.name}.{one.stem}" for one in self.parameters}

    def apply(self, model: Model, values: Mapping[str, float], card: ManoeuvringCard) -> Model:
        """The model with this effect.

        Parameters
        ----------
        model : Model
            Of the ship, with or without other effects.
        values : mapping
            SI, by the names of the parameters; those with a default may be absent.
        card : ManoeuvringCard
            Of the ship, for what the effect needs to know of it.

        Raises
        ------
        InputError
            The card lacks something that the effect needs.
        KeyError
            A required value is missing.
        """
        variables = {one.stem: one.variable(self.name, one.value(values, card)) for one in self.parameters}
        symbols = {stem: variable.symbol for stem, variable in variables.items()}
        return self.equations(model.extend(*variables.values()), symbols, card)


def with_steps_for(model: Model, name: str, share: float = 1.0) -> Model:
    """The model with a step, halved as often as needed, that resolves `share` of the parameter `name` (a time, s)."""
    parameter = model[name]
    assert isinstance(parameter, Parameter)
    step = model.step_s
    while step * STEPS_PER_TIME_CONSTANT > share * parameter.start * (1 + 1e-9):
        step /= 2
    return replace(model, step_s=step)


def particular(card: ManoeuvringCard, key: str, remedy: str) -> float:
    """A number of the card's ``[ship]``; raises InputError that names the key if the card has none."""
    value = getattr(card.ship, key)
    if value is None:
        raise card.fault(f"ship.{key}", "is missing", remedy)
    return float(value)
