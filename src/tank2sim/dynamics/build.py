"""The model of a card: the equations its kind asks for, with its effects on top."""

from __future__ import annotations

import pickle
from dataclasses import dataclass, field, replace
from functools import lru_cache

from tank2sim.cards.card import Card, SteeredBy, SteeredCard
from tank2sim.cards.examination import doubts
from tank2sim.cards.form import EffectEntry
from tank2sim.cards.kinds import CARD_KINDS
from tank2sim.dynamics.effects import EFFECTS, Effect
from tank2sim.dynamics.effects.effect import EffectParameter
from tank2sim.dynamics.model import Model
from tank2sim.dynamics.ship import ship_model
from tank2sim.dynamics.simulator_interface import force_shares
from tank2sim.dynamics.small_craft import craft_model
from tank2sim.units import from_si

KEPT_MODELS = 16
"""Models of cards, and functions made of models, that are kept for when they are asked for again, the last ones of each
kind: a command works with one to five cards (project choice)."""


def build(card: Card) -> Model:
    """Build the model that a card describes; its messages name the card's file.

    Equal cards have the same model, with all that it has worked out.

    Raises InputError: the card names a derivative, an effect or a parameter that the model does not know, or its mass
    matrix is singular; the message names the key.
    """
    entries = card.effects if isinstance(card, SteeredCard) else ()
    effects = tuple(EFFECTS.get(entry.name) for entry in entries)
    return _built(_described(card, effects))


@dataclass(frozen=True)
class _Described:
    """A card by its content, with the effects it names: held and compared by identity, for they have no hash."""

    content: bytes
    identities: tuple[int, ...]
    card: Card = field(compare=False)
    effects: tuple[Effect | None, ...] = field(compare=False)


def _described(card: Card, effects: tuple[Effect | None, ...] = ()) -> _Described:
    return _Described(pickle.dumps(replace(card, covariance=None)), tuple(map(id, effects)), card, effects)


@lru_cache(maxsize=KEPT_MODELS)
def _built(described: _Described) -> Model:
    model = _model(described.card)
    return replace(model, source=described.card.source, notices=(*doubts(described.card), *model.notices))


def _model(card: Card) -> Model:
    if not isinstance(card, SteeredCard):
        kind = CARD_KINDS[card.model.kind]
        if kind.model is None:
            raise TypeError(f"no model for {type(card).__name__}")
        model: Model = kind.model(card)
        return model
    for number, entry in enumerate(card.effects):
        _check_effect(card, entry, f"effects.{number}")
    spelt = {place: key for place, key in card.spelt.items() if not place.startswith("effects.")}
    model = _without_effects(_described(replace(card, text="", effects=(), spelt=spelt)))
    for entry in sorted(card.effects, key=_comes_last):
        model = _with_effect(model, card, entry)
    return model


@lru_cache(maxsize=KEPT_MODELS)
def _without_effects(described: _Described) -> Model:
    """The model on which the effects of a card go: the same whatever they are, and most of the work."""
    card = described.card.steered()
    return craft_model(card) if card.steered_by is SteeredBy.THRUSTERS else ship_model(card.manoeuvring())


def _comes_last(entry: EffectEntry) -> bool:
    return EFFECTS[entry.name].last


def _check_effect(card: SteeredCard, entry: EffectEntry, place: str) -> None:
    """Refuse an effect that is not known, not for this kind of ship, or whose parameters are not as it has them."""
    effect = EFFECTS.get(entry.name)
    if effect is None:
        raise card.fault(f"{place}.name", f"{entry.name!r} is not an effect", EFFECTS.remedy(entry.name))
    if card.steered_by is SteeredBy.THRUSTERS and not effect.fits_craft:
        fitting = ", ".join(name for name, other in EFFECTS.items() if other.fits_craft)
        raise card.fault(f"{place}.name", f"{entry.name} is not for a small craft", f"it can have {fitting}")
    _check_values(card, entry, place, {parameter.name: parameter for parameter in effect.parameters})


def _check_values(card: SteeredCard, entry: EffectEntry, place: str, known: dict[str, EffectParameter]) -> None:
    for section, given in (("parameters", entry.parameters), ("uncertainty", entry.uncertainty)):
        if name := next((name for name in given if name not in known), ""):
            remedy = f"{entry.name} has {', '.join(known)} (angles also in deg)"
            raise card.fault(f"{place}.{section}.{name}", f"is not a parameter of {entry.name}", remedy)
    for name, parameter in known.items():
        if name not in entry.parameters:
            if parameter.default is not None:
                continue
            raise card.fault(f"{place}.parameters.{name}", "is missing", f"give the {parameter.description}")
        lowest, highest = parameter.lowest(card), parameter.maximum
        if not lowest <= entry.parameters[name] <= highest:
            key, shown = card.in_file(f"{place}.parameters.{name}", entry.parameters[name])
            remedy = f"{from_si(key, lowest):g} to {from_si(key, highest):g} was expected"
            raise card.fault(key, f"is {shown:g}", remedy)


def _with_effect(model: Model, card: SteeredCard, entry: EffectEntry) -> Model:
    effect = EFFECTS[entry.name]
    changed = effect.apply(model, entry.parameters, card)
    # One that changes derivatives has no force of its own.
    if effect.acts_on != "force" or effect.reads_derivatives or effect.changes:
        return changed
    return changed.extend(*force_shares(model, changed, entry.name))
