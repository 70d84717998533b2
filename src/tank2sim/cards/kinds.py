"""Kinds of cards, named by ``[model] kind``: form of the file, card and model. Packages can add kinds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, TypeVar

from pydantic import BaseModel

from tank2sim.cards.card import Card, CraftCard, ManoeuvringCard, MmgCard
from tank2sim.cards.form import CardSection, CraftForm, MmgForm, Propulsion, ShipCard
from tank2sim.cards.form_faults import suggestion
from tank2sim.cards.manoeuvring import refuse_doubled_effects, ship_card_of
from tank2sim.cards.mmg import mmg_fields, nominal_revolutions, refuse_other_scaling
from tank2sim.cards.small_craft import craft_card
from tank2sim.errors import InputError
from tank2sim.plugins import Registry

_C = TypeVar("_C", bound=Card)


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


def si_card(kind: type[_C], section: str) -> Callable[[BaseModel, str, str, Mapping[str, str]], _C]:
    """Return the `card` of a kind whose numbers stay as the form has them, in SI.

    Parameters
    ----------
    kind : type of Card
        Its fields are called as those of the form.
    section : str
        The section of coefficients; ``[uncertainty]`` may name them.
    """

    def card(form: BaseModel, text: str, source: str, spelt: Mapping[str, str]) -> _C:
        fields = {name: value for name, value in form if name != "format"}
        known = list(type(fields[section]).model_fields)
        for key in fields.get("uncertainty", {}):
            if key not in known:
                problem = f"is not a coefficient of [{section}]"
                raise InputError(source, f"uncertainty.{key}", problem, suggestion(key, known))
        return kind(source=source, text=text, **fields)

    return card


def _ship(form: ShipCard, text: str, source: str, spelt: Mapping[str, str]) -> ManoeuvringCard:
    return replace(ship_card_of(form, text, source), spelt=spelt)


def _mmg(form: MmgForm, text: str, source: str, spelt: Mapping[str, str]) -> MmgCard:
    own, others = mmg_fields(form, source)
    card = MmgCard(**vars(_ship(others, text, source, spelt)), **own)
    refuse_other_scaling(card)
    nominal = nominal_revolutions(card, form.propulsion.nominal_radps if form.propulsion else None)
    # X_nn, the effect of revolutions on surge, comes from the propeller's own equations.
    return replace(card, propulsion=Propulsion(nominal_radps=nominal, Xnn=0.0))


def _craft(form: CraftForm, text: str, source: str, spelt: Mapping[str, str]) -> CraftCard:
    refuse_doubled_effects(form.effects, source)
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
"""Built-in kinds and those of installed packages."""
