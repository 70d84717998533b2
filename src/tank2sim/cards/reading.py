"""Cards from TOML: found by file or by the name of a bundled ship, checked for form, converted once."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit
from pydantic import ValidationError
from tomlkit.exceptions import TOMLKitError

from tank2sim.bundled import bundled_cards
from tank2sim.cards.card import (
    OPPOSITE,
    Card,
    CraftCard,
    GliderCard,
    ManoeuvringCard,
    MmgCard,
    SurgeBodyCard,
    YawRigCard,
    scales_of_file,
)
from tank2sim.cards.examination import refuse_impossible
from tank2sim.cards.form import (
    CARD_FORMS,
    CraftForm,
    EffectEntry,
    GliderForm,
    MmgForm,
    Propulsion,
    RigidBody,
    Roll,
    ShipCard,
    SurgeCard,
    YawRigForm,
)
from tank2sim.cards.form_faults import form_fault, short, suggestion
from tank2sim.cards.mmg import mmg_fields, nominal_revolutions, refuse_other_scaling
from tank2sim.cards.scaling import LARGEST_PRIME, FileScales, file_factor
from tank2sim.cards.small_craft import body_scales, craft_card, craft_scale, craft_scales
from tank2sim.cards.terms import known_term, parse_term
from tank2sim.errors import InputError, close_name
from tank2sim.escaping import one_line
from tank2sim.files import BYTE_ORDER_MARK, read_exact_text, refuse_deep
from tank2sim.units import to_si

# Sections whose keys may give an angle in degrees or radians.
_SECTIONS_WITH_ANGLES = ("model", "steering_gear", "propulsion", "yaw_rig", "programme")
# Kind of model, which is also the name of its section of coefficients, to the card that is all in SI.
_SI_CARDS: dict[str, type[SurgeBodyCard | GliderCard | YawRigCard]] = {
    "surge": SurgeBodyCard,
    "glider": GliderCard,
    "yaw_rig": YawRigCard,
}


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
    content = _content(text, source)
    if not isinstance(content.get("model"), dict):
        raise InputError(source, "model", "this section is missing", "a card needs [model] with its kind")
    kind = content["model"].get("kind")
    if not isinstance(kind, str) or kind not in CARD_FORMS:
        raise InputError(source, "model.kind", f"is {short(kind)}", f"one of {', '.join(CARD_FORMS)} was expected")
    spelt: dict[str, str] = {}
    _angles_to_radians(content, source, spelt)
    try:
        form = CARD_FORMS[kind].model_validate(content)
    except ValidationError as error:
        raise form_fault(error, source, spelt, form=CARD_FORMS[kind], what="a card") from None
    if isinstance(form, MmgForm):
        own, others = mmg_fields(form, source)
        card = MmgCard(**vars(replace(_manoeuvring_card(others, text, source), spelt=spelt)), **own)
        refuse_other_scaling(card)
        nominal = nominal_revolutions(card, form.propulsion.nominal_radps if form.propulsion else None)
        # X_nn, the effect of revolutions on surge, is that of the propeller's own equations.
        return replace(card, propulsion=Propulsion(nominal_radps=nominal, Xnn=0.0))
    if isinstance(form, CraftForm):
        _refuse_doubled_effects(form.effects, source)
        return craft_card(form, text, source, spelt)
    if isinstance(form, ShipCard):
        return replace(_manoeuvring_card(form, text, source), spelt=spelt)
    return _si_card(form, kind, text, source)


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
        table: Any = document
        for section in sections:
            if isinstance(table, list) and section.isdigit() and int(section) < len(table):
                table = table[int(section)]
                continue
            if section not in table:
                table[section] = tomlkit.table()
            table = table[section]
            if not isinstance(table, dict | list):
                raise InputError(source, key, f"cannot be set: {section} is not a section", "give section.key=value")
        try:
            table[last] = value.item() if isinstance(value, np.generic) else value
        except (TypeError, ValueError):
            problem = f"cannot be a value of the type {type(value).__name__}"
            raise InputError(source, key, problem, "give a number, a text or a list of numbers") from None
        if comment is not None and not isinstance(table, tomlkit.items.InlineTable):  # {...} cannot hold comments
            table[last].comment(one_line(comment))
    mark = BYTE_ORDER_MARK if text.startswith(BYTE_ORDER_MARK) else ""
    return mark + tomlkit.dumps(document)


def revised(
    card: ManoeuvringCard,
    derivatives: Mapping[str, tuple[float, float]],
    others: Mapping[str, object] | None = None,
    *,
    comment: str | None = None,
) -> ManoeuvringCard:
    """A card with other derivatives: canonical name to (value, standard error), prime and starboard-positive.

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
    assert isinstance(new, ManoeuvringCard)
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
    new = parse_card(changed_text(card.text, card.source, {"model.kind": "linear"}), card.source)
    assert isinstance(new, ManoeuvringCard)
    return new


def craft_in_scaling(card: CraftCard, scaling: str) -> CraftCard:
    """The card of a small craft with its numbers in another scaling, ``dimensional`` or ``prime``: the same craft."""
    to_prime, was_prime = scaling == "prime", card.model.scaling == "prime"
    if to_prime == was_prime:
        return card
    scales, body = craft_scales(card), card.rigid_body
    changes: dict[str, object] = {"model.scaling": scaling}
    for key, unit in body_scales(scales).items():
        changes[f"rigid_body.{key}"] = getattr(body, key) / (unit if to_prime else 1.0)
    for section, values in (("derivatives", card.derivatives), ("uncertainty", card.uncertainty)):
        for name, value in values.items():
            changes[f"{section}.{name}"] = value / (craft_scale(name, scales) if to_prime else 1.0)
    made = parse_card(changed_text(card.text, card.source, changes), card.source)
    assert isinstance(made, CraftCard)
    return made


def _content(text: str, source: str) -> dict[str, Any]:
    return parsed_toml(text, source)


def _document(text: str, source: str) -> tomlkit.TOMLDocument:
    _content(text, source)  # unlike tomlkit, tomllib reports the place of every fault, a doubled key's too
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


def _angles_to_radians(content: dict[str, Any], source: str, spelt: dict[str, str]) -> None:
    """Convert degrees in place; `spelt` learns what a converted key is called in the file."""
    places = [(name, content[name]) for name in _SECTIONS_WITH_ANGLES if name in content]
    entries = content.get("effects")
    for number, entry in enumerate(entries if isinstance(entries, list) else []):
        if isinstance(entry, dict):
            places += [
                (f"effects.{number}.{part}", entry[part]) for part in ("parameters", "uncertainty") if part in entry
            ]
    thrusters = content.get("thrusters")
    for number, entry in enumerate(thrusters if isinstance(thrusters, list) else []):
        if isinstance(entry, dict):
            places.append((f"thrusters.{number}", entry))
            places.append((f"thrusters.{number}.uncertainty", entry.get("uncertainty")))
    for place, section in places:
        if not isinstance(section, dict):
            continue  # the form will refuse it
        for key in list(section):
            value = section[key]
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


def _manoeuvring_card(form: ShipCard, text: str, source: str) -> ManoeuvringCard:
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


def _si_card(form: SurgeCard | GliderForm | YawRigForm, section: str, text: str, source: str) -> Card:
    """A card whose numbers stay as the form has them, SI; ``[uncertainty]`` may name the coefficients of `section`."""
    fields = {name: value for name, value in form if name != "format"}
    known = list(type(fields[section]).model_fields)
    for key in fields.get("uncertainty", {}):
        if key not in known:
            raise InputError(
                source, f"uncertainty.{key}", f"is not a coefficient of [{section}]", suggestion(key, known)
            )
    return _SI_CARDS[section](source=source, text=text, **fields)


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
    """Raise InputError if the mass is not that of the displacement, where the card states one."""
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
    names = [entry.name for entry in effects]
    for number, name in enumerate(names):
        if name in names[:number]:
            raise InputError(source, f"effects.{number}.name", f"{name} is given twice", "give each effect once")
