"""Cards from TOML: found by file or by the name of a bundled ship, checked for form, converted once."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import tomlkit
from pydantic import ValidationError
from tomlkit.exceptions import TOMLKitError

from tank2sim.bundled import bundled, bundled_cards
from tank2sim.cards.card import Card, ManoeuvringCard, MmgCard, SteeredCard
from tank2sim.cards.craft_terms import body_scales, craft_scale
from tank2sim.cards.examination import refuse_impossible
from tank2sim.cards.form_faults import form_fault, short
from tank2sim.cards.kinds import CARD_KINDS
from tank2sim.errors import InputError, close_name
from tank2sim.escaping import one_line
from tank2sim.files import BYTE_ORDER_MARK, read_exact_text, refuse_deep, refuse_folder
from tank2sim.units import to_si

_SHIP_CARD = "give a ship card (kind linear, abkowitz or mmg); tank2sim influence shows steering cards"


def find_card(name: str) -> Path:
    """Path of a card given on the command line: a file, or a bundled ship's name in any case.

    Raises
    ------
    InputError
        It is neither.
    """
    path = Path(name)
    try:
        if path.is_file():
            return path
    except OSError as error:
        raise InputError(name, "", f"cannot be read ({error.strerror})", "check the name") from None
    ships = bundled_cards()
    if name.lower() in ships:
        return ships[name.lower()]
    if name and (others := sorted(file.name for file in (bundled("models") / name.lower()).glob("*.toml"))):
        raise InputError(name, "", f"is bundled as {', '.join(others)}, not as a ship card", _SHIP_CARD)
    refuse_folder(path)
    raise InputError(name, "", "is neither a file nor a bundled ship", close_name(name.lower(), ships))


def read_card(name: str | Path, changes: Mapping[str, object] | None = None) -> Card:
    """Read a card.

    Parameters
    ----------
    name : str or path
        A file, or the name of a bundled ship.
    changes : mapping, optional
        Values to put in place of the file's, by dotted key, in the file's conventions: ``{"derivatives.Yv": -0.0117}``.

    Raises
    ------
    InputError
        The card does not exist, or something in it is wrong; the message names file, key and what was expected.
    """
    path = find_card(str(name))
    text = read_exact_text(path)
    return parse_card(changed_text(text, str(path), changes) if changes else text, str(path))


def parse_card(text: str, source: str) -> Card:
    """The card that a TOML text describes; `source` names it in messages. Raises as :func:`read_card`."""
    card = _parsed(text, source)
    refuse_impossible(card)
    return card


def _parsed(text: str, source: str) -> Card:
    content = parsed_toml(text, source)
    form_name = str(content.get("format", ""))
    if form_name.startswith("tank2sim-") and not form_name.startswith("tank2sim-ship/"):
        raise InputError(source, "format", f"is {form_name}, not a ship card", _SHIP_CARD)
    if not isinstance(content.get("model"), dict):
        raise InputError(source, "model", "this section is missing", "a card needs [model] with its kind")
    name = content["model"].get("kind")
    kind = CARD_KINDS.get(name) if isinstance(name, str) else None
    if kind is None:
        raise InputError(source, "model.kind", f"is {short(name)}", f"one of {', '.join(CARD_KINDS)} was expected")
    spelt: dict[str, str] = {}
    _angles_to_radians(content, source, ("model", *kind.angles), spelt)
    try:
        form = kind.form.model_validate(content)
    except ValidationError as error:
        raise form_fault(error, source, spelt, form=kind.form, what="a card") from None
    return kind.card(form, text, source, spelt)


def changed_text(text: str, source: str, changes: Mapping[str, object], *, comment: str | None = None) -> str:
    """A card's text with values at dotted keys replaced or added; everything else stays as it is, comments included.

    With a `comment` it replaces the comments of the changed keys, which described the old values.

    Raises
    ------
    InputError
        A key leads through something that is not a section.
    """
    document = _document(text, source)
    for key, value in changes.items():
        *sections, last = key.split(".")
        table = _section_of(document, sections, source, key)
        if isinstance(table, list):
            raise InputError(source, key, "cannot be set: it is a section", f"give {key}.key=value")
        try:
            table[last] = value.item() if isinstance(value, np.generic) else value
        except (TypeError, ValueError):
            problem = f"cannot be a value of the type {type(value).__name__}"
            raise InputError(source, key, problem, "give a number, a text or a list of numbers") from None
        if comment is not None and not isinstance(table, tomlkit.items.InlineTable):  # {...} cannot hold comments
            table[last].comment(one_line(comment))
    mark = BYTE_ORDER_MARK if text.startswith(BYTE_ORDER_MARK) else ""
    return mark + tomlkit.dumps(document)


def _section_of(document: Any, sections: Sequence[str], source: str, key: str) -> Any:
    """The table of a document that `sections` lead to, made where it is absent."""
    table = document
    for section in sections:
        if isinstance(table, list) and section.isdigit() and int(section) < len(table):
            table = table[int(section)]
            continue
        if isinstance(table, list):
            places = [f"{place} ({entry.get('name', '')})" for place, entry in enumerate(table)]
            raise InputError(
                source, key, f"cannot be set: {section} is not the number of a section", f"give {', '.join(places)}"
            )
        if section not in table:
            table[section] = tomlkit.table()
        table = table[section]
        if not isinstance(table, dict | list):
            raise InputError(source, key, f"cannot be set: {section} is not a section", "give section.key=value")
    return table


_Steered = TypeVar("_Steered", bound=SteeredCard)


def revised(
    card: _Steered,
    derivatives: Mapping[str, tuple[float, float]],
    others: Mapping[str, object] | None = None,
    *,
    comment: str | None = None,
) -> _Steered:
    """A card with other derivatives: canonical name to (value, standard error), in the card's scaling, rudder positive
    to starboard.

    They are written in the conventions of the card's own text; `others` are further values at dotted keys of the text;
    `comment` takes the place of the comments of all that is changed.
    """
    changes: dict[str, object] = dict(others or {})
    for name, (value, error) in derivatives.items():
        factor = card.file_factor(name)
        key = card.places.get(name, name)
        changes[f"derivatives.{key}"] = value * factor
        changes[f"uncertainty.{key}"] = error * abs(factor)
    new = parse_card(changed_text(card.text, card.source, changes, comment=comment), card.source)
    assert isinstance(new, type(card))
    return new


def linear_card(card: Card) -> ManoeuvringCard:
    """The same ship with the linear equations (3.5); derivatives that these have not stay in the text.

    Raises
    ------
    InputError
        It is an MMG card, whose rudder is not a polynomial.
    """
    if isinstance(card, MmgCard):
        raise card.fault("model.kind", "is mmg, which has no linear form of its own", "convert it to abkowitz first")
    return parse_card(changed_text(card.text, card.source, {"model.kind": "linear"}), card.source).manoeuvring()


def craft_in_scaling(card: SteeredCard, scaling: str) -> SteeredCard:
    """The card of a small craft with its numbers in another scaling, ``dimensional`` or ``prime``: the same craft."""
    to_prime, was_prime = scaling == "prime", card.model.scaling == "prime"
    if to_prime == was_prime:
        return card
    scales, body = card.scales, card.rigid_body
    changes: dict[str, object] = {"model.scaling": scaling}
    for key, unit in body_scales(scales).items():
        changes[f"rigid_body.{key}"] = getattr(body, key) / (unit if to_prime else 1.0)
    for section, values in (("derivatives", card.derivatives), ("uncertainty", card.uncertainty)):
        for name, value in values.items():
            changes[f"{section}.{name}"] = value / (craft_scale(name, scales) if to_prime else 1.0)
    return parse_card(changed_text(card.text, card.source, changes), card.source).steered()


def _document(text: str, source: str) -> tomlkit.TOMLDocument:
    parsed_toml(text, source)  # unlike tomlkit, tomllib reports the place of every fault, a doubled key's too
    with faults_of_toml(source):
        document = tomlkit.parse(text.removeprefix(BYTE_ORDER_MARK))
    return document


def parsed_toml(text: str, source: Path | str) -> dict[str, Any]:
    """The content of a TOML text that a user gave; raises InputError, which names the place, if it is none."""
    with faults_of_toml(str(source)):
        content = tomllib.loads(text.removeprefix(BYTE_ORDER_MARK))
    refuse_deep(content, source)
    return content


@contextmanager
def faults_of_toml(source: str) -> Iterator[None]:
    """Turn what a TOML parser raises on the text of the file `source` into an InputError that names the place."""
    try:
        yield
    except RecursionError:
        raise InputError(source, "", "is nested too deeply", "write sections and their keys") from None
    except (ValueError, TOMLKitError) as error:  # a ValueError also when an integer has thousands of digits
        problem, _, place = str(error).partition(" (at ")
        remedy = "give each key once" if "overwrite" in problem or "twice" in problem else "correct the TOML there"
        if "integer string conversion" in problem:
            problem, remedy = "an integer has thousands of digits", "give a number of a plausible size"
        raise InputError(source, place.rstrip(")"), problem, remedy) from None


def _angles_to_radians(content: dict[str, Any], source: str, sections: Sequence[str], spelt: dict[str, str]) -> None:
    """Convert degrees in place; `spelt` learns what a converted key is called in the file."""
    for place, section in _with_angles(content, sections):
        if not isinstance(section, dict):
            continue  # the form will refuse it
        for key, value in list(section.items()):
            if isinstance(value, bool) or not isinstance(value, int | float):
                continue
            try:
                si_key, si_value = to_si(key, float(value))
            except OverflowError:
                raise InputError(source, f"{place}.{key}", f"is {short(value)}", "no number is so large") from None
            other = spelt.get(f"{place}.{si_key}", si_key).rpartition(".")[2]
            spelt[f"{place}.{si_key}"] = f"{place}.{key}"
            if si_key != key:
                if si_key in section:
                    raise InputError(source, f"{place}.{key}", f"is given twice, also as {other}", "give it once")
                del section[key]
                section[si_key] = si_value


def _with_angles(content: dict[str, Any], sections: Sequence[str]) -> Iterator[tuple[str, Any]]:
    """Places and tables whose keys may be in degrees: `sections`, and what is in effects and thrusters."""
    yield from ((name, content[name]) for name in sections if name in content)
    for name, parts in (("effects", ("parameters", "uncertainty")), ("thrusters", ("", "uncertainty"))):
        entries = content.get(name)
        for number, entry in enumerate(entries if isinstance(entries, list) else []):
            place = f"{name}.{number}"
            for part in parts if isinstance(entry, dict) else ():
                yield (f"{place}.{part}", entry.get(part)) if part else (place, entry)
