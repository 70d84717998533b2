"""Numbers of a ship's card with influence: parameters of the model, with their errors and keys in the file.

These are the derivatives, the rigid body, the steering gear, the effect of revolutions or the thrusters, and the
parameters of the card's effects. Particulars (length, speed of expansion, density) only scale them, and sensors do not
move the ship.
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tank2sim.arrays import Array
from tank2sim.cards.card import DEFAULT_RELATIVE_ERROR, MmgCard, SteeredCard
from tank2sim.cards.covariance_reading import read_covariance
from tank2sim.dynamics import build
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.dynamics.model import Model
from tank2sim.dynamics.small_craft import THRUSTER_PARAMETERS
from tank2sim.errors import ArgumentError
from tank2sim.notices import Notice, caution
from tank2sim.units import from_si


@dataclass(frozen=True)
class CardParameter:
    """A number of a card.

    `name`: name of the model's parameter, ``derivatives.Yv``. `value`: in the model's unit: prime or SI, rudder
    positive to starboard. `standard_error`: in the same unit; 0 for an exact number. `assumed`: the card states no
    standard error: :data:`DEFAULT_RELATIVE_ERROR` of the value is taken. `key`: dotted key in the card's file.
    `factor`: factor from the value to the number in the file. `bounds`: bounds of the number, in the unit of `value`;
    None without a bound.
    """

    name: str
    value: float
    standard_error: float
    assumed: bool
    key: str
    factor: float
    bounds: tuple[float | None, float | None] = (None, None)

    @property
    def short(self) -> str:
        """The name in the card: ``Yv``, ``mass``, ``current.speed``."""
        for section in ("derivatives.", "ship.", "mmg.", "thrusters."):
            if self.name.startswith(section):
                return self.name.removeprefix(section)
        return self.name


def study_model(card: SteeredCard) -> Model:
    """The model of a card with the inputs of its effects (a current) as constants, which can be varied."""
    model = build(card)
    names = [name for entry in card.effects for name in EFFECTS[entry.name].model_names().values()]
    return model.with_constant_inputs(names)


def card_parameters(card: SteeredCard, model: Model) -> tuple[CardParameter, ...]:
    """Parameters of a card that are in its model, except for those that are zero without a standard error."""
    found = (
        *_derivatives(card, model),
        *_interaction(card),
        *_rigid_body(card),
        *_gear(card),
        *_propulsion(card),
        *_thrusters(card),
        *_effects(card, model),
    )
    known = set(model.parameter_names)
    return tuple(
        parameter
        for parameter in found
        if parameter.name in known and (parameter.value != 0 or parameter.standard_error > 0)
    )


def find_parameter(parameters: Sequence[CardParameter], name: str, argument: str) -> CardParameter:
    """The parameter of a user's name, either its full name or that in the card; `argument` has it, for messages.

    Raises InputError: the parameter does not exist on the card, or is exactly zero.
    """
    by_name = {key: parameter for parameter in parameters for key in (parameter.key, parameter.short, parameter.name)}
    if name in by_name:
        return by_name[name]
    close = difflib.get_close_matches(name, by_name, n=1)
    remedy = (
        f"did you mean {close[0]}?" if close else f"there are: {', '.join(parameter.short for parameter in parameters)}"
    )
    raise ArgumentError(argument, name, "is not a non-zero parameter of this card", remedy)


def _derivatives(card: SteeredCard, model: Model) -> list[CardParameter]:
    stated = {*card.derivatives, *card.uncertainty}
    return [
        CardParameter(
            name=f"derivatives.{name}",
            value=card.derivatives.get(name, 0.0),
            standard_error=card.standard_error(name),
            assumed=name not in card.uncertainty,
            key=f"derivatives.{card.places.get(name, name)}",
            factor=card.file_factor(name),
        )
        for name in (name.removeprefix("derivatives.") for name in model.parameter_names)
        if name in stated
    ]


def _interaction(card: SteeredCard) -> list[CardParameter]:
    """Coefficients ``mmg.*`` of propeller and rudder."""
    if not isinstance(card, MmgCard):
        return []
    return [
        CardParameter(
            name=f"mmg.{key}",
            value=card.interaction(key),
            standard_error=card.interaction_error(key),
            assumed=key not in card.interaction_errors,
            key=place,
            factor=1.0,
        )
        for key, place in card.interaction_places().items()
    ]


def _rigid_body(card: SteeredCard) -> list[CardParameter]:
    factors = card.body_file_factors
    return [
        CardParameter(f"ship.{key}", value, 0.0, False, f"rigid_body.{key}", factors[key])
        for key, value in card.body_si.items()
    ]


def _gear(card: SteeredCard) -> list[CardParameter]:
    gear = card.steering_gear
    if gear is None:
        return []
    described = (
        ("steering.time_constant", "time_constant_s", gear.time_constant_s),
        ("steering.max_rate", "max_rate_radps", gear.max_rate_radps),
        ("steering.max_angle", "max_angle_rad", gear.max_angle_rad),
    )
    return [_exact(card, name, f"steering_gear.{key}", value) for name, key, value in described if value is not None]


def _exact(card: SteeredCard, name: str, place: str, value: float) -> CardParameter:
    key, factor = card.in_file(place, 1.0)
    return CardParameter(name, value, 0.0, False, key, factor)


def _propulsion(card: SteeredCard) -> list[CardParameter]:
    """Xnn; at the nominal revolutions ordered, Xnn has no influence."""
    if card.propulsion is None:
        return []
    factor = float(card.file_scales.force) if card.file_scales else 1.0
    value = card.propulsion.Xnn
    error = DEFAULT_RELATIVE_ERROR * abs(value)
    return [CardParameter("propulsion.Xnn", value, error, True, "propulsion.Xnn", factor)]


def _thrusters(card: SteeredCard) -> list[CardParameter]:
    found = []
    for number, thruster in enumerate(card.thrusters):
        for key, part in THRUSTER_PARAMETERS.items():
            value, place = getattr(thruster, key) or 0.0, f"thrusters.{number}.{key}"
            certain = key in ("x_m", "y_m")
            error = thruster.uncertainty.get(key, 0.0 if certain else DEFAULT_RELATIVE_ERROR * abs(value))
            assumed = not certain and key not in thruster.uncertainty
            spelling, factor = card.in_file(place, 1.0)
            bounds = (None if certain else 0.0, None)
            name = f"thrusters.{thruster.name}.{part}"
            found.append(CardParameter(name, value, error, assumed, spelling, factor, bounds))
    return found


def _effects(card: SteeredCard, model: Model) -> list[CardParameter]:
    values = model.defaults
    found = []
    for number, entry in enumerate(card.effects):
        effect = EFFECTS[entry.name]
        if effect.acts_on == "sensor":
            continue
        places = effect.model_names()
        for parameter in effect.parameters:
            name = places[parameter.name]
            if name not in values:
                continue
            key = card.spelt.get(f"effects.{number}.parameters.{parameter.name}")
            key = key or f"effects.{number}.parameters.{parameter.name}"
            stated = parameter.name in entry.uncertainty
            error = entry.uncertainty.get(parameter.name, DEFAULT_RELATIVE_ERROR * abs(values[name]))
            bounds = (parameter.lowest(card), parameter.maximum)
            found.append(CardParameter(name, values[name], error, not stated, key, from_si(key, 1.0), bounds))
    return found


def agreed_by_name(agreed: Mapping[str, float], parameters: Sequence[CardParameter]) -> dict[str, float]:
    """An agreed variation (Kc %, by names as a user writes them) by the names of parameters.

    Raises InputError: a name is not on the card, or is repeated.
    """
    found: dict[str, float] = {}
    for name, percent in agreed.items():
        parameter = find_parameter(parameters, name, "joint_variation").name
        if parameter in found:
            raise ArgumentError("joint_variation", name, "is given twice", "give each parameter once")
        found[parameter] = percent
    return found


@dataclass(frozen=True, eq=False)
class JointErrors:
    """Errors of parameters.

    `covariance` (k, k): in the units of the parameters' values. `together`: keys of the parameters in the card's
    covariance; all others are independent. Empty without a covariance. `samples` (n, m): samples of the joint
    distribution of m parameters, in the units of their values. `sampled`: places of these parameters.
    """

    parameters: tuple[CardParameter, ...]
    covariance: Array
    together: frozenset[str]
    samples: Array | None = None
    sampled: tuple[int, ...] = ()

    @property
    def in_words(self) -> list[Notice]:
        """Notices on the standard errors."""
        words = self._assumed_in_words()
        return [Notice(self.together_in_words), *words] if self.together else words

    @property
    def assumed(self) -> bool:
        """Whether every standard error is assumed, because the card states none."""
        uncertain = [parameter for parameter in self.parameters if parameter.standard_error > 0]
        return not self.together and bool(uncertain) and all(parameter.assumed for parameter in uncertain)

    def _assumed_in_words(self) -> list[Notice]:
        """Notices on assumed standard errors of the parameters that are not in the covariance."""
        remaining = [parameter for parameter in self.parameters if parameter.key not in self.together]
        assumed = [unlisted.short for unlisted in remaining if unlisted.assumed and unlisted.standard_error > 0]
        exact = [unlisted.short for unlisted in remaining if unlisted.standard_error == 0]
        messages = []
        if assumed:
            subject = "any number" if self.assumed else ", ".join(assumed)
            share = f"{100 * DEFAULT_RELATIVE_ERROR:g} % of the value is taken"
            text = f"the card states no standard error of {subject}: {share}"
            messages.append(caution(f"standard errors are ASSUMED: {text}") if self.assumed else Notice(text))
        if exact:
            messages.append(
                Notice(f"taken as exact, because a card states no standard error of them: {', '.join(exact)}")
            )
        return messages

    @property
    def together_in_words(self) -> str:
        """Text on the correlated parameters."""
        if self.samples is not None:
            count = f"{len(self.samples)} samples of the posterior next to the card"
            return f"{len(self.together)} numbers are drawn together from the {count}"
        return f"errors of {len(self.together)} numbers go together, as the covariance next to the card says"


def joint_errors(card: SteeredCard, parameters: Sequence[CardParameter]) -> JointErrors:
    """The errors of parameters of a card: correlated if in its covariance, else independent.

    Raises InputError: the covariance to which the card refers has an error.
    """
    known = read_covariance(card)
    standard_errors = np.array([parameter.standard_error for parameter in parameters])
    covariance = np.diag(standard_errors**2)
    if known is None:
        return JointErrors(tuple(parameters), covariance, frozenset())
    places = {parameter.key: place for place, parameter in enumerate(parameters)}
    names = [name for name in known.names if name in places]
    rows = [places[name] for name in names]
    columns = [known.names.index(name) for name in names]
    factors = np.array([parameters[row].factor for row in rows])
    covariance[np.ix_(rows, rows)] = known.matrix[np.ix_(columns, columns)] / np.outer(factors, factors)
    samples = None if known.samples is None else known.samples[:, columns] / factors
    return JointErrors(
        tuple(parameters), covariance, frozenset(names), samples, tuple(rows) if known.samples is not None else ()
    )
