"""Comparison of cards by coefficient, in a common convention and speed, in units of standard errors.

A polynomial in v', r', delta and Du' depends on the speed of its expansion, on the speed of its primes, and on whether
it includes the inertial terms of (3.8). With V the speed of the scaling of the reference, in the units of the card's
own u0 and of the length (k is the ratio of the Froude numbers),

    V = k                            (nominal)
    V = k/(sqrt(1 - v'^2) - Du')     (instantaneous, from V^2 = (k + Du' V)^2 + (v' V)^2)

give u = k + Du' V, v = v' V, r = r' V, and so the card's forces. Their Taylor series about 0 in the reference's primes
has the card's coefficients in the reference's convention, to the third order. They are linear in the card's own, and so
the standard errors follow.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from tank2sim.cards.card import ManoeuvringCard, MmgCard, SteeredBy, SteeredCard
from tank2sim.cards.craft_terms import CRAFT_TERMS
from tank2sim.cards.scaling import file_factor
from tank2sim.cards.terms import known_term
from tank2sim.dynamics import build
from tank2sim.dynamics.abkowitz import ABKOWITZ_TERMS, ACCELERATION_TERMS, ALL_TERMS, LINEAR_TERMS, polynomial
from tank2sim.dynamics.card_parameters import CardParameter, card_parameters
from tank2sim.dynamics.mmg.equivalent import linear_form
from tank2sim.dynamics.model import Model
from tank2sim.dynamics.rigid_body import inertial_forces
from tank2sim.notices import Notice

_SAME_SPEED = 1e-3
"""Froude numbers that differ by less than this share count as equal."""

BEYOND_STANDARD_ERRORS = 2.0
"""Standard errors from which a difference is reported: chance alone exceeds it in 5 % of the cases."""

_ABSENT = 1e-12
_OF_MMG_ALONE = ("Xvvvv",)
_RIGID_BODY = ("mass", "yaw_inertia", "x_G")


@dataclass(frozen=True)
class CardCoefficient:
    """A coefficient of a card in the reference's convention, prime; in rows with the rudder's sign of the reference.

    `value` is None if the card's model lacks the term, `standard_error` if it is unknown; `stated` is False for a
    standard error by the default share of the value.
    """

    value: float | None
    standard_error: float | None = None
    stated: bool = False


SAME = "the reference's own number"
"""Reason for a missing difference of identical numbers: one card copied it from the other, or both from a third. Their
errors are identical, and 0 standard errors would look like an independent agreement."""


@dataclass(frozen=True)
class Difference:
    """A card less the reference: in standard errors, in per cent of the reference, or the reason without either."""

    standard_errors: float | None = None
    percent: float | None = None
    why: str = ""


@dataclass(frozen=True)
class CoefficientRow:
    """A coefficient of all cards, the reference first, and the differences from the reference."""

    name: str
    cards: tuple[CardCoefficient, ...]
    differences: tuple[Difference, ...]


@dataclass(frozen=True)
class Expansion:
    """A card's coefficients in the convention of another."""

    coefficients: Mapping[str, CardCoefficient]  # Name to coefficient; terms that the model lacks are absent
    refused: Mapping[str, str]  # Name to the reason that prevents a comparison
    notes: tuple[Notice, ...]  # What was converted


def compare_coefficients(cards: Sequence[SteeredCard]) -> tuple[tuple[CoefficientRow, ...], tuple[Notice, ...]]:
    """All coefficients of the cards of ships (the first is the reference), with notes on conversions.

    Between an MMG card and a polynomial the linear terms are compared: those of the straight course with propeller and
    rudder, the mean of both sides of the flow to the rudder. Craft are compared in SI.
    """
    if cards[0].steered_by is SteeredBy.THRUSTERS:
        return _compare_craft(cards), ()
    return _compare_ships([card.manoeuvring() for card in cards])


def _compare_ships(cards: Sequence[ManoeuvringCard]) -> tuple[tuple[CoefficientRow, ...], tuple[Notice, ...]]:
    mixed = len({card.model.kind == "mmg" for card in cards}) > 1
    linear = [linear_form(card, build(card)) if mixed and isinstance(card, MmgCard) else card for card in cards]
    reference = linear[0]
    expansions = [expanded_as(card, reference) for card in linear]
    for place, (one, card) in enumerate(zip(linear, cards, strict=True)):
        if one is not card:  # the errors of an MMG card's linear terms are not known
            expansions[place] = _without_errors(expansions[place])
    present = set().union(*(expansion.coefficients for expansion in expansions))
    names = [name for name in (*_RIGID_BODY, *ALL_TERMS, *_OF_MMG_ALONE) if name in present]
    notes = [note for expansion in expansions[1:] for note in expansion.notes]
    if mixed:
        notes.append(
            Notice(
                "MMG cards are compared by their linear terms on a straight course, with propeller and rudder and the "
                "mean of both sides of gamma_R; their standard errors are not known"
            )
        )
    return tuple(_row(reference, name, expansions) for name in names), tuple(notes)


def _row(reference: ManoeuvringCard, name: str, expansions: Sequence[Expansion]) -> CoefficientRow:
    first, *others = (_in_sign_of(reference, name, expansion.coefficients.get(name)) for expansion in expansions)
    refusals = [expansion.refused.get(name) for expansion in expansions[1:]]
    differences = [
        Difference(why=why) if why else _difference(first, other) for why, other in zip(refusals, others, strict=True)
    ]
    return CoefficientRow(name, (first, *others), tuple(differences))


def _compare_craft(cards: Sequence[SteeredCard]) -> tuple[CoefficientRow, ...]:
    """Rigid body and hull of craft of one size (the first is the reference), SI."""
    rows = {name: [CardCoefficient(getattr(card.rigid_body, name)) for card in cards] for name in _RIGID_BODY}
    present = [name for name in CRAFT_TERMS if any(card.derivatives.get(name) for card in cards)]
    rows |= {name: [_own(card, name) for card in cards] for name in present}
    return tuple(
        CoefficientRow(name, tuple(found), tuple(_difference(found[0], other) for other in found[1:]))
        for name, found in rows.items()
    )


def _without_errors(found: Expansion) -> Expansion:
    """The same without standard errors of the velocity and rudder terms."""
    coefficients = {
        name: coefficient if name in (*_RIGID_BODY, *ACCELERATION_TERMS) else CardCoefficient(coefficient.value)
        for name, coefficient in found.coefficients.items()
    }
    return replace(found, coefficients=coefficients)


def _in_sign_of(reference: ManoeuvringCard, name: str, found: CardCoefficient | None) -> CardCoefficient:
    """A coefficient (rudder positive to starboard) with the rudder's sign of the reference's card."""
    if found is None or found.value is None:
        return CardCoefficient(None)
    if name in _RIGID_BODY:
        return found
    factor = file_factor(known_term(name), None, rudder_to_port=reference.model.rudder_sign == "port")
    return replace(found, value=factor * found.value)


def _difference(first: CardCoefficient, second: CardCoefficient) -> Difference:
    if first.value is None or second.value is None:
        return Difference(why="not in the reference's model" if first.value is None else "not in this model")
    apart, errors = second.value - first.value, (first.standard_error, second.standard_error)
    percent = 100 * apart / abs(first.value) if first.value else None
    same = math.isclose(first.value, second.value, rel_tol=1e-9, abs_tol=1e-15)  # apart from rounding
    if errors[0] is None or errors[1] is None:
        return Difference(None, percent, "no standard error" if apart else "")
    if same and all(errors):
        return Difference(None, percent, SAME)
    if both := math.hypot(errors[0], errors[1]):
        return Difference(apart / both, percent)
    return Difference(None, percent, "both are stated as certain") if apart else Difference(0.0, percent)


def compare_effects(cards: Sequence[SteeredCard], models: Sequence[Model]) -> tuple[CoefficientRow, ...]:
    """All parameters of effects of the cards, in SI, in the units of their models; `models` are the cards'.

    Values with a unit (a wind speed, a time) are compared only between ships of the same size.
    """
    found = [_of_effects(card, model) for card, model in zip(cards, models, strict=True)]
    one_size = [math.isclose(card.ship.length_m, cards[0].ship.length_m, rel_tol=1e-6) for card in cards]

    def difference(name: str, place: int) -> Difference:
        of_size = name in models[place] and models[place][name].unit not in ("1", "rad")
        if of_size and not one_size[place]:
            return Difference(why="of a ship of another size")
        first, other = (found[number].get(name, CardCoefficient(None)) for number in (0, place))
        return _difference(first, other)

    return tuple(
        CoefficientRow(
            name,
            tuple(effects.get(name, CardCoefficient(None)) for effects in found),
            tuple(difference(name, place) for place in range(1, len(cards))),
        )
        for name in dict.fromkeys(name for effects in found for name in effects)
    )


def _of_effects(card: SteeredCard, model: Model) -> dict[str, CardCoefficient]:
    """Parameters of effects, of the propeller and rudder of an MMG card, and of thrusters."""
    return {
        parameter.name: CardCoefficient(parameter.value, _error_of(parameter), not parameter.assumed)
        for parameter in card_parameters(card, model)
        if parameter.key.startswith("effects.") or parameter.name.startswith(("mmg.", "thrusters."))
    }


def _error_of(parameter: CardParameter) -> float | None:
    """Standard error; None of the place of a thruster, which is not uncertain and does not agree by chance."""
    exact = parameter.name.startswith("thrusters.") and not parameter.standard_error
    return None if exact else parameter.standard_error


def expanded_as(card: ManoeuvringCard, reference: ManoeuvringCard) -> Expansion:
    """The coefficients of a card in the speed, scaling and inertial convention of another."""
    linear = "linear" in (card.model.kind, reference.model.kind)
    ratio = 1.0 if linear else _speed_ratio(card, reference)
    names, matrix, constant = _conversion(card, reference, ratio)
    refused = _refused(card, reference, ratio, linear)
    slowest, fastest = card.model.speed_range_mps
    outside = not slowest <= ratio * card.model.speed_mps <= fastest
    found = {name: CardCoefficient(getattr(card.rigid_body, name)) for name in _RIGID_BODY}
    for name, weights, remainder in zip(names, matrix.tolist(), constant.tolist(), strict=True):
        own = dict(zip(names, weights, strict=True))
        converted = None if linear and name not in _linear_names() else _converted(card, own, remainder)
        if converted is None:
            continue
        found[name] = converted
        if outside and not _kept(card, name, own, converted):
            refused.setdefault(name, "the reference's speed is outside the range in which this card holds")
    found |= {name: _own(card, name) for name in (*ACCELERATION_TERMS, *_OF_MMG_ALONE) if name in card.derivatives}
    return Expansion(found, refused, _notes(card, reference, ratio))


def _own(card: SteeredCard, name: str) -> CardCoefficient:
    if name not in card.derivatives:
        return CardCoefficient(None)
    return CardCoefficient(card.derivatives[name], card.standard_error(name), name in card.uncertainty)


def _converted(card: ManoeuvringCard, weights: Mapping[str, float], remainder: float) -> CardCoefficient | None:
    """A term as the sum of the card's own, each with its weight, and a remainder; None where all are absent."""
    own = {name: weight for name, weight in weights.items() if abs(weight) > _ABSENT and name in card.derivatives}
    if not own and abs(remainder) < _ABSENT:
        return None
    value = sum(weight * card.derivatives[name] for name, weight in own.items()) + remainder
    if not own:
        return CardCoefficient(value)
    error = math.hypot(*(weight * card.standard_error(name) for name, weight in own.items()))
    return CardCoefficient(value, error, own.keys() <= card.uncertainty.keys())


def _speed_ratio(card: ManoeuvringCard, reference: ManoeuvringCard) -> float:
    """Froude number of the reference over the card's; 1 where they are the same, and for an MMG card, whose hull has no
    terms in the speed."""
    ratio = _froude(reference) / _froude(card)
    return 1.0 if card.model.kind == "mmg" or abs(ratio - 1) < _SAME_SPEED else ratio


def _kept(card: ManoeuvringCard, name: str, weights: Mapping[str, float], converted: CardCoefficient) -> bool:
    """Whether a converted term is the card's own, unchanged."""
    known = {source for source, weight in weights.items() if source in card.derivatives and abs(weight) > _ABSENT}
    return known == {name} and abs((converted.value or 0.0) - card.derivatives[name]) <= _ABSENT


def _froude(card: ManoeuvringCard) -> float:
    return card.model.speed_mps / math.sqrt(card.environment.gravity_mps2 * card.ship.length_m)


def _linear_names() -> tuple[str, ...]:
    return (*LINEAR_TERMS["X"], *LINEAR_TERMS["Y"], *LINEAR_TERMS["N"], *ACCELERATION_TERMS)


def _refused(card: ManoeuvringCard, reference: ManoeuvringCard, ratio: float, linear: bool) -> dict[str, str]:
    found = {name: "not in the linear model" for name in ALL_TERMS if linear and name not in _linear_names()}
    if ratio == 1 or (card.propulsion and reference.propulsion):
        return found
    straight = [term.name for term in map(known_term, ABKOWITZ_TERMS["X"]) if not any((term.v, term.r, term.d))]
    return found | dict.fromkeys(straight, "another speed, and the revolutions are not known")


def _notes(card: ManoeuvringCard, reference: ManoeuvringCard, ratio: float) -> tuple[Notice, ...]:
    messages = []
    if ratio != 1:
        messages.append(f"re-expanded about {ratio:.4g} times its form Froude number, to the third order")
    form, target = card.model, reference.model
    if form.speed_scale != target.speed_scale:
        messages.append(f"primes by the {form.speed_scale} speed converted to the {target.speed_scale} one")
    if form.yaw_rate_terms != target.yaw_rate_terms:
        messages.append(f"yaw rate terms converted from {form.yaw_rate_terms} to {target.yaw_rate_terms}")
    return tuple(Notice(f"{card.ship.name} ({card.source}): {message}") for message in messages)


def _conversion(
    card: ManoeuvringCard, reference: ManoeuvringCard, ratio: float
) -> tuple[list[str], np.ndarray, np.ndarray]:
    """Names of the velocity and rudder terms, matrix from the card's to the reference's, and constant term."""
    names = [*ABKOWITZ_TERMS["X"], *ABKOWITZ_TERMS["Y"], *ABKOWITZ_TERMS["N"]]
    coefficients = ca.SX.sym("own", len(names))
    at = ca.SX.sym("v"), ca.SX.sym("r"), ca.SX.sym("d"), ca.SX.sym("du")
    forces = _forces_in_primes(card, reference, ratio, dict(zip(names, ca.vertsplit(coefficients), strict=True)), at)
    series = _taylor(forces, at, names)
    both = ca.Function("conversion", [*at, coefficients], [ca.jacobian(series, coefficients), series])
    matrix, constant = both(0, 0, 0, 0, np.zeros(len(names)))
    return names, np.array(matrix), np.array(constant).ravel()


def _forces_in_primes(
    card: ManoeuvringCard,
    reference: ManoeuvringCard,
    ratio: float,
    coefficients: Mapping[str, ca.SX],
    at: tuple[ca.SX, ca.SX, ca.SX, ca.SX],
) -> ca.SX:
    """X', Y', N' of the card's model in the reference's convention, at a motion in the reference's primes."""
    v, r, d, du = at
    nominal = _nominal(reference)
    scale = ca.SX(ratio) if nominal else ratio / (ca.sqrt(1 - v**2) - du)
    u, sway, yaw = ratio + du * scale, v * scale, r * scale
    card_scale = ca.SX(1) if _nominal(card) else ca.sqrt(u**2 + sway**2)
    primes = {"v": sway / card_scale, "r": yaw / card_scale, "d": d, "u": (u - 1) / card_scale}
    X, Y, N = (card_scale**2 * polynomial(ABKOWITZ_TERMS[name], coefficients, **primes) for name in "XYN")
    # Terms that each convention leaves to the equations: (3.8) with u, or none, because the coefficients include V.
    for each_card, sign in ((card, 1), (reference, -1)):
        if each_card.model.yaw_rate_terms == "hydrodynamic":
            inertia = inertial_forces(card.rigid_body.mass, card.rigid_body.x_G, u, sway, yaw)
            X, Y, N = X + sign * inertia[0], Y + sign * inertia[1], N + sign * inertia[2]
    if ratio != 1 and card.propulsion and reference.propulsion:
        by_length = math.sqrt(reference.ship.length_m / card.ship.length_m)
        revolutions = reference.propulsion.nominal_radps * by_length / card.propulsion.nominal_radps
        X = X + card.propulsion.Xnn * (revolutions**2 - 1)
    primes_of_forces: ca.SX = ca.vertcat(X, Y, N) / scale**2
    return primes_of_forces


def _nominal(card: ManoeuvringCard) -> bool:
    return card.model.speed_scale == "nominal"


def _taylor(forces: ca.SX, at: tuple[ca.SX, ...], names: Sequence[str]) -> ca.SX:
    """Coefficients of the Taylor series before evaluation at 0: each derivative over its factorials."""
    known: dict[tuple[int, ...], ca.SX] = {(0, 0, 0, 0): forces}

    def derivative(powers: tuple[int, ...]) -> ca.SX:
        if powers not in known:
            place = next(number for number, power in enumerate(powers) if power)
            lower = tuple(power - (number == place) for number, power in enumerate(powers))
            known[powers] = ca.jacobian(derivative(lower), at[place])
        return known[powers]

    rows = []
    for term in map(known_term, names):
        powers = (term.v, term.r, term.d, term.u)
        rows.append(derivative(powers)["XYN".index(term.force)] / math.prod(map(math.factorial, powers)))
    return ca.vertcat(*rows)
