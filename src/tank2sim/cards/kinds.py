"""Kinds of cards, named by ``[model] kind``: form of the file, card and model. Packages can add kinds."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import MISSING, dataclass, fields, replace
from typing import Any, get_type_hints

from pydantic import BaseModel, Field, create_model

from tank2sim.cards.card import OPPOSITE, Card, CraftCard, ManoeuvringCard, MmgCard, scales_of_file
from tank2sim.cards.form import (
    BodyForm,
    CardSection,
    CraftForm,
    EffectEntry,
    MmgForm,
    Propulsion,
    RigidBody,
    Roll,
    ShipCard,
)
from tank2sim.cards.form_faults import suggestion
from tank2sim.cards.mmg import mmg_fields, nominal_revolutions, refuse_other_scaling
from tank2sim.cards.scaling import LARGEST_PRIME, FileScales, file_factor
from tank2sim.cards.small_craft import craft_card
from tank2sim.cards.terms import known_term, parse_term
from tank2sim.errors import InputError
from tank2sim.plugins import Registry


@dataclass(frozen=True)
class CardKind:
    """A kind of card.

    Parameters
    ----------
    name : str
        The word that ``[model] kind`` has in the file.
    description : str
    form : type of CardSection
        Pydantic model of the file with ``format``, ``ship``, ``environment``, ``model`` and sections of its own: keys,
        types and bounds, in SI and rad.
    card : callable
        ``card(form, text, source, spelt) -> Card``: the card of a form that was read; `text` is the TOML, `source` its
        file for messages, `spelt` the place of a converted angle in SI to its place in the file.
    model : callable, optional
        ``model(card) -> Model``: its equations of motion (:class:`tank2sim.dynamics.model.Model`). The kinds of ships
        and craft have none: :mod:`tank2sim.dynamics` has their equations.
    angles : tuple of str
        Sections in addition to ``model`` whose keys may be in degrees, rpm or knots.
    """

    name: str
    description: str
    form: type[CardSection]
    card: Callable[[Any, str, str, Mapping[str, str]], Card]
    model: Callable[[Any], Any] | None = None
    angles: tuple[str, ...] = ()


def body_kind(
    name: str, description: str, card: type[Card], model: Callable[[Any], Any], *, angles: tuple[str, ...] = ()
) -> CardKind:
    """Return the kind of a card that holds the sections of its file under their names, in SI and rad.

    Parameters
    ----------
    name, description : str
        As of :class:`CardKind`.
    card : type of Card
        A dataclass. Its fields beyond :class:`tank2sim.cards.card.Card` are the sections of the file; the one called
        `name` has the coefficients, and ``uncertainty`` may name them.
    model, angles
        As of :class:`CardKind`.
    """
    common, hints = {each.name for each in fields(Card)}, get_type_hints(card, include_extras=True)
    sections: dict[str, Any] = {
        each.name: (hints[each.name], Field(**_default(each))) for each in fields(card) if each.name not in common
    }
    form = create_model(f"{card.__name__}Form", __base__=BodyForm, **sections)

    def read(form: BaseModel, text: str, source: str, spelt: Mapping[str, str]) -> Card:
        values = {key: value for key, value in form if key != "format"}
        known = list(type(values[name]).model_fields)
        for key in values.get("uncertainty", {}):
            if key not in known:
                problem = f"is not a coefficient of [{name}]"
                raise InputError(source, f"uncertainty.{key}", problem, suggestion(key, known))
        return card(source=source, text=text, **values)

    return CardKind(name, description, form, read, model, angles)


def _default(each: dataclasses.Field[Any]) -> dict[str, Any]:
    """Default of the field of a dataclass, as pydantic takes it; empty if it is required."""
    given = {"default": each.default, "default_factory": each.default_factory}
    return {name: value for name, value in given.items() if value is not MISSING}


def _ship(form: ShipCard, text: str, source: str, spelt: Mapping[str, str]) -> ManoeuvringCard:
    return replace(_ship_card(form, text, source), spelt=spelt)


def _mmg(form: MmgForm, text: str, source: str, spelt: Mapping[str, str]) -> MmgCard:
    own, others = mmg_fields(form, source)
    card = MmgCard(**vars(_ship(others, text, source, spelt)), **own)
    refuse_other_scaling(card)
    nominal = nominal_revolutions(card, form.propulsion.nominal_radps if form.propulsion else None)
    # X_nn, the effect of revolutions on surge, comes from the propeller's own equations.
    return replace(card, propulsion=Propulsion(nominal_radps=nominal, Xnn=0.0))


def _craft(form: CraftForm, text: str, source: str, spelt: Mapping[str, str]) -> CraftCard:
    _refuse_doubled_effects(form.effects, source)
    return craft_card(form, text, source, spelt)


_GEAR = ("steering_gear", "propulsion")

CARD_KINDS: Registry[CardKind] = Registry(
    "tank2sim.cards",
    (
        CardKind("linear", "a ship with linear derivatives", ShipCard, _ship, angles=_GEAR),
        CardKind("abkowitz", "a ship with derivatives up to the third order", ShipCard, _ship, angles=_GEAR),
        CardKind("mmg", "a ship by the MMG method: hull, propeller, rudder", MmgForm, _mmg, angles=_GEAR),
        CardKind("small_craft", "a small craft with thrusters", CraftForm, _craft),
    ),
    CardKind,
)
"""Built-in kinds, and kinds from installed packages."""


def _ship_card(form: ShipCard, text: str, source: str) -> ManoeuvringCard:
    """Return the card of a form, in the prime system and with the rudder positive to starboard.

    `form`: sections as in the file, angles and rates in SI. `text`, `source`: text of the file and its name, for
    messages. Raises InputError: a derivative is unknown or given twice, or a value is implausible.
    """
    scales = _file_scales(form, source)
    to_port = form.model.rudder_sign == "port"
    body = _prime_rigid_body(form.rigid_body, scales, source)
    aliases = OPPOSITE if form.model.kind == "mmg" else {}
    places = _canonical_names(form.derivatives, "derivatives", source, aliases)
    stated = _canonical_names(form.uncertainty, "uncertainty", source, aliases)

    def inside(name: str, key: str, value: float) -> float:
        sign = aliases.get(key, (name, 1.0))[1]
        return sign * value / file_factor(known_term(name), scales, rudder_to_port=to_port)

    def bounded(section: str, keys: Mapping[str, str], given: Mapping[str, float]) -> dict[str, float]:
        prime = {name: inside(name, key, given[key]) for name, key in keys.items()}
        for name, value in prime.items():
            if abs(value) > LARGEST_PRIME:
                problem = f"is {value:.4g} in the prime system"
                raise InputError(source, f"{section}.{keys[name]}", problem, f"at most {LARGEST_PRIME:g} was expected")
        return prime

    _refuse_other_mass(form, body, source)
    _refuse_doubled_effects(form.effects, source)
    _refuse_half_of_roll(form, [*places.items(), *stated.items()], source)
    return ManoeuvringCard(
        source=source,
        text=text,
        ship=form.ship,
        environment=form.environment,
        model=form.model,
        rigid_body=body,
        derivatives=bounded("derivatives", places, form.derivatives),
        uncertainty={name: abs(error) for name, error in bounded("uncertainty", stated, form.uncertainty).items()},
        places=places,
        roll=_prime_roll(form.roll, scales, source),
        steering_gear=form.steering_gear,
        propulsion=_prime_propulsion(form.propulsion, scales),
        waves=form.waves,
        effects=tuple(form.effects),
        fitted_trials=tuple(form.fitted_trials),
    )


def _file_scales(form: ShipCard, source: str) -> FileScales | None:
    try:
        return scales_of_file(form.ship, form.environment, form.model)
    except KeyError as error:
        key = error.args[0]
        problem = f'is missing, and scaling = "{form.model.scaling}" needs it'
        raise InputError(source, f"ship.{key}", problem, "add it") from None


def _prime_rigid_body(body: RigidBody, scales: FileScales | None, source: str) -> RigidBody:
    if scales is not None:
        body = RigidBody(
            mass=body.mass / scales.mass, yaw_inertia=body.yaw_inertia / scales.inertia, x_G=body.x_G / scales.length
        )
    # No ship's m' exceeds 2 (m' = 2 C_B B T / L^2, each ratio below 1), and its centre of gravity lies inside the hull.
    if body.mass > 2.0:
        remedy = 'a prime mass is about 0.01; is the card in SI (scaling = "dimensional")?'
        raise InputError(source, "rigid_body.mass", f"is {body.mass:g} in the prime system", remedy)
    if abs(body.x_G) > 0.5:
        remedy = "x_G is measured from midships, positive forward, in lengths if scaling is prime"
        raise InputError(source, "rigid_body.x_G", f"puts the centre of gravity {body.x_G:g} L from midships", remedy)
    return body


_MASS_RATIO = 2.0
"""Ratio of a card's mass to its displacement beyond which one of them is of another scaling or size. Project choice:
mass in prime for prime II is off by the ratio of length to draught, 10 to 25."""


def _refuse_other_mass(form: ShipCard, body: RigidBody, source: str) -> None:
    """Raise InputError if mass and displacement differ, where the card states both."""
    stated = form.ship.displacement_kg
    if stated is None:
        return
    mass = body.mass * 0.5 * form.environment.water_density_kgpm3 * form.ship.length_m**3
    if not 1 / _MASS_RATIO < mass / stated < _MASS_RATIO:
        problem = f'is {mass:.4g} kg by scaling = "{form.model.scaling}", and ship.displacement_kg is {stated:.4g}'
        raise InputError(source, "rigid_body.mass", problem, "check scaling, length_m, draught_m and displacement_kg")


def _prime_roll(roll: Roll | None, scales: FileScales | None, source: str) -> Roll | None:
    if roll is None:
        return None
    heights = {key: getattr(roll, key) / (scales.length if scales else 1.0) for key in ("z_G", "z_R", "l_x")}
    for key, value in heights.items():
        if abs(value) > 0.5:
            remedy = "heights are measured from the origin, positive downwards, in lengths if scaling is prime"
            raise InputError(source, f"roll.{key}", f"is {value:g} L from the origin", remedy)
    inertia = roll.roll_inertia / (scales.inertia if scales else 1.0)
    return roll.model_copy(update={"roll_inertia": inertia, **heights})


def _refuse_half_of_roll(form: ShipCard, places: list[tuple[str, str]], source: str) -> None:
    """Raise InputError if terms of roll have no ``[roll]``, or ``[roll]`` has no metacentric height or damping."""
    if form.roll is None:
        for name, key in places:
            if known_term(name).of_roll:
                remedy = "give [roll] with roll_inertia, and ship.metacentric_height_m"
                raise InputError(source, f"derivatives.{key}", "is a term of a ship that rolls", remedy)
        return
    height = form.ship.metacentric_height_m
    if height is None or height <= 0:
        problem = "is missing" if height is None else f"is {height:g} m: the ship has no stable upright position"
        raise InputError(source, "ship.metacentric_height_m", problem, "[roll] needs it, above zero")
    if "Kp" not in dict(places):
        raise InputError(source, "derivatives.Kp", "is missing", "[roll] needs the damping of roll (negative)")


def _prime_propulsion(propulsion: Propulsion | None, scales: FileScales | None) -> Propulsion | None:
    if propulsion is None or scales is None:
        return propulsion
    return propulsion.model_copy(update={"Xnn": propulsion.Xnn / scales.force})


def _canonical_names(
    values: Mapping[str, float], section: str, source: str, aliases: Mapping[str, tuple[str, float]]
) -> dict[str, str]:
    """Canonical name to the key in the file; `aliases` are further keys, to the name that they mean."""
    places: dict[str, str] = {}
    for key in values:
        term = parse_term(aliases.get(key, (key, 1.0))[0])
        if term is None:
            remedy = "a name is X, Y or N and then v, r, d, u as often as they occur (Yvvr), 0 or udot, vdot, rdot"
            remedy += "; with [roll] also K, p, phi and pdot"
            raise InputError(source, f"{section}.{key}", "is not a name of a derivative", remedy)
        if term.name in places:
            problem = f"is the same term as {places[term.name]}"
            raise InputError(source, f"{section}.{key}", problem, f"give it once, as {term.name}")
        places[term.name] = key
    return places


def _refuse_doubled_effects(effects: list[EffectEntry], source: str) -> None:
    """Raise InputError if an effect is given twice."""
    names = [entry.name for entry in effects]
    for number, name in enumerate(names):
        if name in names[:number]:
            raise InputError(source, f"effects.{number}.name", f"{name} is given twice", "give each effect once")
