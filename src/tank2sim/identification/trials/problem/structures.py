"""Structures of the model that trials can be fitted with: each turns a card into the start card.

A structure sets the terms and effects of the model, with a value and a standard error before the trials for each. The
result is a card, so that simulation, linearisation and FMU accept it unchanged.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass

import tomlkit

from tank2sim.cards import parse_card
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.cards.reading import linear_card, revised
from tank2sim.cards.terms import known_term
from tank2sim.dynamics.abkowitz import ABKOWITZ_TERMS, LINEAR_TERMS
from tank2sim.dynamics.effects import hull, loaded_rudder
from tank2sim.errors import InputError
from tank2sim.files import BYTE_ORDER_MARK
from tank2sim.identification.trials.options import AUTO, AVERAGE, BY_EVIDENCE, STRUCTURE_WORDS
from tank2sim.plugins import Registry

TYPICAL = {"v": 0.3, "r": 0.7, "d": 0.6, "u": 0.4}
"""Primes of a hard turn (v', r', rudder in rad, Du'): sizes at which terms are compared (KVLCC2, 35 deg turn)."""

SHARE_OF_LINEAR = 0.3
"""Standard error before the trials of a term that the card lacks: this share of the linear force in a hard turn."""

SHARE_WITH_DRAG = 0.1
"""The same for cubic terms of the yaw moment next to cross-flow drag, which takes one coefficient for bow and stern.
Project choice: of 0, 0.1 and 0.3, 0.1 is closest to KVLCC2's 35 deg turn at MARIN (tactical diameter -12, -3 and +8 %)
after fits of HSVA's zigzags, which do not distinguish the three."""

SHARE_OF_ASYMMETRY = 0.02
"""The same for asymmetry (Y0, N0, Y0u, N0u): the lateral force of a single screw is a few percent (project choice)."""

CUBIC_HULL = {force: tuple(f"{force}{powers}" for powers in ("vvv", "vvr", "vrr", "rrr")) for force in "YN"}
ASYMMETRY = ("Y0", "N0", "Y0u", "N0u")
TURNING = ("Xvv", "Xvr", "Xrr", "Xdd")
_LINEAR = tuple(name for force in "XYN" for name in LINEAR_TERMS[force])
_THIRD_ORDER = (*CUBIC_HULL["Y"], *CUBIC_HULL["N"], *ASYMMETRY, *TURNING)

_LOADED_RUDDER = {"loading": (0.6, 0.15), "straightening": (0.55, 0.2), "lever": (-0.71, 0.3)}
"""Value and standard error before the trials. Values: the KVLCC2 of Yasukawa and Yoshimura (2015): its rudder's inflow
speed rises by 0.62 to 0.65 of the loading, whose straightening is 0.395 to port and 0.640 to starboard over a rudder
inflow of 0.92 U, and whose lever is -0.710; standard errors are a project choice, wide enough for another single-screw
ship."""

CROSS_FLOW = (0.6, 0.3)
"""Cross-flow drag coefficient before the trials: 0.4 to 0.9 for full hulls (Faltinsen 1990, Sea Loads, 6.4)."""

Terms = Mapping[str, tuple[float, float]]


@dataclass(frozen=True)
class ModelStructure:
    """A structure of the model.

    Parameters
    ----------
    name : str
        Value of the argument `structure`.
    description : str
        A sentence for the help text.
    start : callable
        ``start(card) -> card``: with value and standard error of all that is to be estimated.
    """

    name: str
    description: str
    start: Callable[[ManoeuvringCard], ManoeuvringCard]


def _cross_flow(card: ManoeuvringCard) -> ManoeuvringCard:
    """Linear hull with cross-flow drag in place of its cubic terms, and the rudder in the slipstream."""
    replaced = {
        name
        for force in "YN"
        for name in ABKOWITZ_TERMS[force]
        if (term := known_term(name)).d + term.v + term.r > 1 or (term.d and term.u)
    }
    replaced |= {name for name in ABKOWITZ_TERMS["X"] if known_term(name).d and name != "Xdd"}
    bare = _without(card, replaced)
    bare = with_terms(bare, [*ASYMMETRY, *TURNING, "Yd", "Nd"])
    bare = with_terms(bare, ["Nvvr", "Nvrr", "Nrrr"], SHARE_WITH_DRAG)
    bare = with_effect(bare, hull.CROSS_FLOW_DRAG.name, {"drag_coefficient": CROSS_FLOW})
    return with_effect(bare, loaded_rudder.LOADED_RUDDER.name, _LOADED_RUDDER)


STRUCTURES: Registry[ModelStructure] = Registry(
    "tank2sim.structures",
    (
        ModelStructure("linear", STRUCTURE_WORDS["linear"], lambda card: linear_card(with_terms(card, _LINEAR))),
        ModelStructure("card", STRUCTURE_WORDS["card"], lambda card: card),
        ModelStructure("cross_flow", STRUCTURE_WORDS["cross_flow"], _cross_flow),
        ModelStructure("third_order", STRUCTURE_WORDS["third_order"], lambda card: with_terms(card, _THIRD_ORDER)),
    ),
    ModelStructure,
    reserved=(AUTO, AVERAGE, BY_EVIDENCE),
)
"""By rising number of parameters, then structures from installed packages: the first of equal predictions is taken."""


def structure_that_adds(card: ManoeuvringCard, effects: Collection[str]) -> str | None:
    """Name of the first structure that adds just these effects to a card; None without one, or for an MMG card.

    Examples
    --------
    >>> from tank2sim.cards import read_card
    >>> structure_that_adds(read_card("kvlcc2-captive"), {"cross_flow_drag", "loaded_rudder"})
    'cross_flow'
    """
    if card.model.kind == "mmg":
        return None  # its structure is its own
    present = {entry.name for entry in card.effects}
    for name, structure in STRUCTURES.items():
        try:
            added = {entry.name for entry in structure.start(card).effects} - present
        except InputError:  # a structure of an installed package that does not take this card
            continue
        if added and added == set(effects):
            return name
    return None


def prior_of_absent(card: ManoeuvringCard, name: str, share: float = SHARE_OF_LINEAR) -> tuple[float, float]:
    """Value and standard error (prime) before the trials of a term that the card lacks.

    X_vr is -Yvdot: in ideal fluid the force of the added mass in sway, m_y v r (the MMG model's (m + m_y) v r); where
    the card's terms in r are "total", it holds m v r as well. All other terms are 0 within `share` of the linear force
    of a hard turn, asymmetry within :data:`SHARE_OF_ASYMMETRY` of it.
    """
    known = card.derivatives
    term = known_term(name)
    if name == "Xvr":
        value = -known.get("Yvdot", 0.0)
        if card.model.yaw_rate_terms == "total":
            value += card.rigid_body.mass
        return value, max(0.3 * abs(value), 1e-4)
    sizes = {
        "X": max(abs(known.get("Xu", 0.0)) * TYPICAL["u"], 5e-4),
        "Y": max(abs(known.get("Yv", 0.0)) * TYPICAL["v"], 1e-3),
        "N": max(abs(known.get("Nr", 0.0)) * TYPICAL["r"], 3e-4),
    }
    size = 1.0
    for letter, power in (("v", term.v), ("r", term.r), ("d", term.d), ("u", term.u)):
        size *= TYPICAL[letter] ** power
    return 0.0, (SHARE_OF_ASYMMETRY if name in ASYMMETRY else share) * sizes[term.force] / size


def with_terms(card: ManoeuvringCard, names: Sequence[str], share: float = SHARE_OF_LINEAR) -> ManoeuvringCard:
    """The card with terms: a missing one gets its value before the trials, one of asymmetry at least that error.

    `names`: Derivatives, as ``Nvvr``. `share`: Standard error of a term that the card lacks, as a share of the linear
    force in a hard turn.
    """
    new: dict[str, tuple[float, float]] = {}
    for name in names:
        value, error = prior_of_absent(card, name, share)
        if name in ASYMMETRY:
            new[name] = card.derivatives.get(name, 0.0), max(card.standard_error(name), error)
        elif not card.derivatives.get(name):
            new[name] = value, error
    return revised(card, new) if new else card


def _without(card: ManoeuvringCard, names: set[str]) -> ManoeuvringCard:
    document = tomlkit.parse(card.text.removeprefix(BYTE_ORDER_MARK))
    for name in names & set(card.derivatives):
        key = card.places.get(name, name)
        for section in ("derivatives", "uncertainty"):
            if section in document and key in document[section]:
                del document[section][key]
    return _parsed(card, document)


def with_effect(card: ManoeuvringCard, name: str, parameters: Terms) -> ManoeuvringCard:
    """The card with an effect; an effect that it already has does not change.

    `name`: Name of the effect. `parameters`: Parameter, as spelt in a card, to value and standard error before the
    trials.
    """
    if any(entry.name == name for entry in card.effects):
        return card
    document = tomlkit.parse(card.text.removeprefix(BYTE_ORDER_MARK))
    effect = tomlkit.table()
    effect["name"] = name
    values, errors = tomlkit.table(), tomlkit.table()
    for key, (value, error) in parameters.items():
        values[key], errors[key] = value, error
    effect["parameters"], effect["uncertainty"] = values, errors
    if "effects" not in document:
        document["effects"] = tomlkit.aot()
    document["effects"].append(effect)
    return _parsed(card, document)


def _parsed(card: ManoeuvringCard, document: tomlkit.TOMLDocument) -> ManoeuvringCard:
    new = parse_card(tomlkit.dumps(document), card.source)
    assert isinstance(new, ManoeuvringCard)
    return new
