"""A card with the effects that were found: keys where an effect changes stated values, else ``[[effects]]``.

A quantity is stated once. Both forms give the same model.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby

import casadi as ca
import numpy as np
import tomlkit
from numpy.typing import NDArray

from tank2sim.cards.card import OPPOSITE, SteeredCard
from tank2sim.cards.reading import changed_text, parse_card
from tank2sim.cards.terms import known_term
from tank2sim.dynamics import build
from tank2sim.dynamics.abkowitz import ALL_TERMS
from tank2sim.dynamics.effects import EFFECTS, EffectParameter
from tank2sim.dynamics.effects.particulars import ESTIMABLE, estimate_notice, estimated_from, model_particular
from tank2sim.dynamics.model import Model, Quantity
from tank2sim.escaping import one_line
from tank2sim.files import BYTE_ORDER_MARK
from tank2sim.identification.trials.problem.problem_from_card import rounded
from tank2sim.units import from_si, in_words, to_si

Found = tuple[str, Mapping[str, float], Mapping[str, float]]
"""Name of an effect, its parameters by name, and the standard errors of those that were estimated; SI."""

_IN_FILE = {"rad": "deg", "radps": "degps"}

_DIGITS = 10
"""Significant digits of numbers without a standard error: a particular that is estimated must give the force that was
fitted."""


def in_file_units(name: str, value: float) -> tuple[str, float]:
    """Name and value of an effect's parameter in the units of a card, from SI: degrees in place of radians."""
    stem, _, suffix = name.rpartition("_")
    key = f"{stem}_{_IN_FILE[suffix]}" if stem and suffix in _IN_FILE else name
    return key, from_si(key, value)


def estimate_in_file(name: str, value: float) -> tuple[str, float]:
    """As :func:`in_file_units`, a direction from 0 to 360 deg."""
    return in_file_units(name, value % (2 * math.pi) if name == "direction_rad" else value)


def add_effects_to_card(card: SteeredCard, found: Sequence[Found]) -> SteeredCard:
    """The card with effects added; the given card where none of them is of the ship (faults of sensors).

    Parameters
    ----------
    card : SteeredCard
    found : sequence of Found
        In the order in which their model was built. None of them may be on the card already.

    Notes
    -----
    Changed keys have their old value as a comment, and derivatives a combined standard error: that of the card and
    that of the effect, each by its slope, as if they were independent. Trials determine the sum of the two better
    than either, so that this is too large rather than too small. Particulars that an effect estimated because the card
    states none are written into ``[ship]`` as estimated.

    Raises
    ------
    InputError
        The card lacks something that an effect needs.
    ValueError
        The card has one of the effects already.
    """
    ship = [effect for effect in found if EFFECTS[effect[0]].acts_on != "sensor"]
    for name in {entry.name for entry in card.effects} & {name for name, *_ in ship}:
        raise ValueError(f"the card has {name} already")
    for place, (name, found_values, errors) in enumerate(ship):
        values = {**at_rest(name), **found_values}
        read_later = any(EFFECTS[later].reads_derivatives for later, *_ in ship[place + 1 :])
        if EFFECTS[name].in_place_of:
            card = _changed(card, _stated(card, name, values, errors))
        elif EFFECTS[name].changes_on(card) and not read_later:
            card = _changed(card, _derivatives(card, name, values, errors))
        else:
            card = _with_entry(_with_particulars(card, name, values), name, values, errors)
    return card


def at_rest(name: str) -> dict[str, float]:
    """Speed and direction of a wind or current, zero: what a card states where that is a matter of each trial.

    Empty for other effects.
    """
    return dict.fromkeys(EFFECTS[name].measured_as, 0.0) if EFFECTS[name].surroundings else {}


def card_with_effects_text(
    card: SteeredCard, found: Sequence[Found], trials: Sequence[str], rivals: Sequence[str] = (), refitted: int = 0
) -> str:
    """Text of a card with effects added by :func:`add_effects_to_card`, headed by their names and the trials used.

    A card to which nothing was added is returned unchanged. `rivals` are the explanations that these trials cannot
    distinguish from the effects; `refitted` is the number of coefficients that were fitted to the trials.
    """
    names = [name for name, *_ in found if EFFECTS[name].acts_on != "sensor"]
    changes = [f"{' and '.join(names)} added"] if names else []
    changes += [f"{refitted} coefficients refitted"] if refitted else []
    if not changes:
        return card.text
    how = f"{', '.join(changes)} by tank2sim gap from {', '.join(trials)}"
    text = changed_text(card.text, card.source, {"ship.source": f"{card.ship.source}; {how}"})
    messages = [f"{name}: {in_short(name, values, errors)}" for name, values, errors in found if name in names]
    lines = [how, *messages]
    if refitted or any(EFFECTS[name].in_place_of or EFFECTS[name].changes_on(card) for name in names):
        lines.append("Keys that were changed for this have their old values in comments.")
    if rivals:
        lines.append(f"These trials cannot distinguish this from: {'; '.join(rivals)}.")
    mark = BYTE_ORDER_MARK if text.startswith(BYTE_ORDER_MARK) else ""
    return mark + "".join(f"# {one_line(line)}\n" for line in lines) + text.removeprefix(mark)


def in_short(name: str, values: Mapping[str, float], errors: Mapping[str, float]) -> str:
    """Parameters of an effect with their standard errors, in words: ``speed 0.45 m/s (standard error 0.02)``."""
    messages = []
    for parameter in EFFECTS[name].parameters:
        if parameter.name not in values:
            continue
        key, value, error = _written(parameter, values, errors)
        words, unit = in_words(key)
        spread = f" (standard error {error:.2g})" if error else ""
        messages.append(f"{words} {value:.6g}{f' {unit}' if unit else ''}{spread}")
    return ", ".join(messages)


Change = tuple[object, str]
"""New value of a key as the file has it, and the comment next to it."""


def _changed(card: SteeredCard, changes: Mapping[str, Change]) -> SteeredCard:
    text = card.text
    for comment, group in groupby(sorted(changes.items(), key=_comment), key=_comment):
        text = changed_text(text, card.source, {key: value for key, (value, _) in group}, comment=comment)
    return parse_card(text, card.source).steered()


def _comment(change: tuple[str, Change]) -> str:
    return change[1][1]


def _document(card: SteeredCard) -> tomlkit.TOMLDocument:
    return tomlkit.parse(card.text.removeprefix(BYTE_ORDER_MARK))


def _was(document: tomlkit.TOMLDocument, key: str, name: str) -> str:
    """Comment of a key that an effect changes: its old value as written in the file."""
    section, _, leaf = key.partition(".")
    content = document.get(section, {})
    return f"was {content[leaf].as_string()} before {name}" if leaf in content else f"not stated before {name}"


# -- data of the steering gear -------------------------------------------------------------------------------------


def _stated(
    card: SteeredCard, name: str, values: Mapping[str, float], errors: Mapping[str, float]
) -> dict[str, Change]:
    """Keys of ``[steering_gear]`` that an effect changes."""
    changes: dict[str, Change] = {}
    for parameter in EFFECTS[name].in_place_of:
        spelling = f"steering_gear.{in_file_units(parameter, 0.0)[0]}"
        key = card.spelt.get(f"steering_gear.{parameter}", spelling)
        value, error = (from_si(key, each.get(parameter, 0.0)) for each in (values, errors))
        spread = f"; standard error {error:.2g}" if error else ""
        changes[key] = _rounded(value, error), f"{_was(_document(card), key, name)}{spread}"
    return changes


# -- derivatives ---------------------------------------------------------------------------------------------------


def _derivatives(
    card: SteeredCard, name: str, values: Mapping[str, float], errors: Mapping[str, float]
) -> dict[str, Change]:
    """Keys of ``[derivatives]`` and ``[uncertainty]`` that an effect changes."""
    document, changes = _document(card), dict[str, Change]()
    spelt = {
        known_term(OPPOSITE.get(key, (key, 1.0))[0]).name: key for key in document.get("uncertainty", {})
    }  # it may differ from [derivatives]
    for derivative, value, effect_error, total in changed_derivatives(card, name, values, errors):
        factor = card.file_factor(derivative)
        stated = card.places.get(derivative, derivative)
        key, error = f"derivatives.{stated}", f"uncertainty.{spelt.get(derivative, stated)}"
        # Rounded to a thousandth of the effect's standard error; the card's error would remove digits that it states.
        changes[key] = _rounded(value * factor, effect_error * abs(factor)), _was(document, key, name)
        if total > 0:
            changes[error] = float(f"{total * abs(factor):.3g}"), f"the card's combined with {name}'s"
    return changes


def changed_derivatives(
    card: SteeredCard, name: str, values: Mapping[str, float], errors: Mapping[str, float]
) -> Iterator[tuple[str, float, float, float]]:
    """Derivatives that an effect changes: name, new value (prime), standard error by the effect alone, and in total.

    The effect is applied to a model that has each derivative as a quantity.
    """
    model = build(card)
    names = [term for term in ALL_TERMS if f"derivatives.{term}" in model]
    asked = [
        Quantity(name=f"changed.{name}", unit="1", description=name, value=model.symbol(f"derivatives.{name}"))
        for name in names
    ]
    effect = EFFECTS[name]
    changed = effect.apply(model.extend(*asked), values, card)
    found = {name: changed.symbol(f"changed.{name}") for name in names}
    if effect.magnified_by:  # of forces that are sums of terms, each in proportion to its derivative
        factor = 1 + changed.symbol(effect.model_names()[effect.magnified_by])
        found |= {term: factor * found[term] for term in names if term in effect.changes}
    after, slopes = _values_and_slopes(changed, ca.vcat(list(found.values())))
    effect_error = np.zeros(len(changed.parameters))
    card_error = np.zeros(len(changed.parameters))
    for parameter, place in effect.model_names().items():
        effect_error[changed.parameter_names.index(place)] = errors.get(parameter, 0.0)
    for term in names:
        card_error[changed.parameter_names.index(f"derivatives.{term}")] = card.standard_error(term)
    by_effect, by_card = (np.sqrt(slopes**2 @ each**2) for each in (effect_error, card_error))
    for row, term in enumerate(names):
        if after[row] != card.derivatives.get(term, 0.0) or by_effect[row] > 0:
            yield term, float(after[row]), float(by_effect[row]), math.hypot(by_effect[row], by_card[row])


def _values_and_slopes(model: Model, wanted: ca.SX) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Values of expressions that hold parameters alone (n,), and their slopes by all parameters (n, np)."""
    expression = model.expand(wanted)
    evaluate = ca.Function("changed", [model.p], [expression, ca.densify(ca.jacobian(expression, model.p))])
    values, slopes = evaluate(model.parameter_values())
    return np.array(values).ravel(), np.array(slopes)


# -- [[effects]] and [ship] ----------------------------------------------------------------------------------------


def _with_entry(card: SteeredCard, name: str, values: Mapping[str, float], errors: Mapping[str, float]) -> SteeredCard:
    """The card with an effect appended to its ``[[effects]]``."""
    parameters, uncertainty = tomlkit.table(), tomlkit.table()
    for parameter in EFFECTS[name].parameters:
        if parameter.name not in values:
            continue
        key, value, error = _written(parameter, values, errors)
        parameters[key] = value
        if error:
            uncertainty[key] = error
    document = _document(card)
    if "effects" not in document:
        document["effects"] = tomlkit.aot()
    entry = tomlkit.table()
    entry["name"], entry["parameters"] = name, parameters
    if uncertainty:
        entry["uncertainty"] = uncertainty
    if isinstance(document["effects"], tomlkit.items.AoT):
        entry.trivia.indent = "\n"  # an empty line before this entry
        document["effects"].append(entry)
    else:  # effects = [{...}]
        document["effects"].append(entry.unwrap())
    mark = BYTE_ORDER_MARK if card.text.startswith(BYTE_ORDER_MARK) else ""
    return parse_card(mark + tomlkit.dumps(document), card.source).steered()


def _with_particulars(card: SteeredCard, name: str, values: Mapping[str, float]) -> SteeredCard:
    """The card with the particulars that an effect estimated because the card states none."""
    model = build(card)
    notices = [notice for notice in EFFECTS[name].apply(model, values, card).notices if notice not in model.notices]
    changes: dict[str, Change] = {}
    for key in ESTIMABLE:
        if estimate_notice(card, key) in notices:
            value = float(f"{model_particular(card, key):.{_DIGITS}g}")
            changes[f"ship.{key}"] = value, f"estimated for {name}: {estimated_from(key)}"
    return _changed(card, changes) if changes else card


# -- numbers -------------------------------------------------------------------------------------------------------


def _written(
    parameter: EffectParameter, values: Mapping[str, float], errors: Mapping[str, float]
) -> tuple[str, float, float]:
    """Name, value and standard error (0 if there is none) of a parameter in a card's units, rounded, within bounds."""
    key, value = estimate_in_file(parameter.name, values[parameter.name])
    error = in_file_units(parameter.name, errors.get(parameter.name, 0.0))[1]
    error = float(f"{error:.3g}") if math.isfinite(error) else 0.0
    # At a bound it may be rounded past it, in another unit even by the last bit of a float.
    tried = (_rounded(value, error), value, value * (1 - 1e-12), value * (1 + 1e-12))
    lowest = -math.inf if callable(parameter.minimum) else parameter.minimum
    shown = next((candidate for candidate in tried if lowest <= to_si(key, candidate)[1] <= parameter.maximum), value)
    return key, shown, error


def _rounded(value: float, error: float) -> float:
    return rounded(value, error) + 0.0 if error > 0 else float(f"{value:.{_DIGITS}g}") + 0.0
