"""A polynomial card, or the hull of an MMG card, written in another scaling, rudder sign or about another origin."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import comb

import numpy as np

from tank2sim.arrays import Array
from tank2sim.cards.card import OPPOSITE, ManoeuvringCard, scales_of_file
from tank2sim.cards.covariance import Covariance, not_referring
from tank2sim.cards.covariance_reading import read_covariance
from tank2sim.cards.form import RigidBody, Roll
from tank2sim.cards.reading import changed_text, parse_card
from tank2sim.cards.scaling import FileScales, file_factor
from tank2sim.cards.terms import Term, known_term

_IN_SWAY = {("Y", "v"): "Yrdot", ("N", "v"): "Nrdot", ("K", "v"): "Krdot"}


@dataclass(frozen=True)
class Conventions:
    """Conventions of a card's text; None for those that it has."""

    scaling: str | None = None  # ``prime``, ``prime_ii``, ``bis`` or ``dimensional``
    rudder_sign: str | None = None  # ``port`` or ``starboard``
    origin_m: float = 0.0  # The new origin forward of the old one, m

    @property
    def stated(self) -> dict[str, str]:
        """Keys of ``[model]`` that are asked for."""
        keys = {"scaling": self.scaling, "rudder_sign": self.rudder_sign}
        return {key: value for key, value in keys.items() if value is not None}

    @property
    def unchanged(self) -> bool:
        """True if nothing is asked for."""
        return not self.stated and not self.origin_m


def in_conventions(card: ManoeuvringCard, wanted: Conventions) -> ManoeuvringCard:
    """The same ship with its numbers in other conventions; the covariance of the card is carried along.

    Raises InputError: The scaling needs a particular that the card lacks, an MMG card cannot have what is asked for, or
    effects are about midships and the origin is to be moved.
    """
    if wanted.unchanged:
        return card
    mmg = card.model.kind == "mmg"
    if mmg and (wanted.origin_m or wanted.rudder_sign == "port"):
        remedy = 'convert it with to="abkowitz", with the same options'
        raise card.fault("model.kind", "is mmg, which is about midships with the rudder to starboard", remedy)
    if wanted.origin_m and card.effects:
        names = ", ".join(entry.name for entry in card.effects)
        raise card.fault("effects", f"are about midships ({names})", "leave the origin, or the effects out")
    model = card.model.model_copy(update=wanted.stated)
    try:
        scales = scales_of_file(card.ship, card.environment, model)
    except KeyError as error:
        remedy = f'scaling "{model.scaling}" needs it: add it to the card'
        raise card.fault(f"ship.{error.args[0]}", "is missing", remedy) from None
    return _rewritten(card, wanted, scales, to_port=model.rudder_sign == "port")


def _rewritten(
    card: ManoeuvringCard, wanted: Conventions, scales: FileScales | None, *, to_port: bool
) -> ManoeuvringCard:
    ahead = wanted.origin_m / card.ship.length_m
    stated = tuple(dict.fromkeys([*card.derivatives, *card.uncertainty]))
    names, matrix = shift_matrix(stated, ahead)
    values = matrix @ np.array([card.derivatives.get(name, 0.0) for name in stated])
    places = {name: f"derivatives.{card.places.get(name, name)}" for name in names}
    known = read_covariance(card)
    covariance = matrix @ _covariance_of(card, stated, known, places) @ matrix.T

    def factor(name: str) -> float:
        sign = OPPOSITE.get(card.places.get(name, name), (name, 1.0))[1]
        return sign * file_factor(known_term(name), scales, rudder_to_port=to_port)

    changes: dict[str, object] = {f"model.{key}": value for key, value in wanted.stated.items()}
    changes |= _body_in_file(card, scales, ahead)
    errors = np.sqrt(np.diag(covariance))
    for name, value, error in zip(names, values, errors, strict=True):
        if name in card.derivatives or value:
            changes[places[name]] = _written(value * factor(name))
        # Where no standard error is stated, the sum's is unknown too: 2 % is taken, as before.
        if error > 0:
            changes[places[name].replace("derivatives", "uncertainty", 1)] = _written(error * abs(factor(name)))
    text = _without_other_spellings(card, changed_text(not_referring(card.text), card.source, changes))
    new = parse_card(text, card.source)
    assert isinstance(new, ManoeuvringCard)
    if known is None:
        return new
    kept = [row for row, name in enumerate(names) if errors[row] > 0 and places[name] in changes]
    sizes = np.array([factor(names[row]) for row in kept])
    matrix_in_file = covariance[np.ix_(kept, kept)] * np.outer(sizes, sizes)
    return replace(new, covariance=Covariance(tuple(places[names[row]] for row in kept), matrix_in_file))


def _covariance_of(
    card: ManoeuvringCard, stated: Sequence[str], known: Covariance | None, places: Mapping[str, str]
) -> Array:
    """Covariance (prime) of the derivatives `stated`: the card's `known` one, else by their standard errors alone."""
    covariance: Array = np.diag([card.uncertainty.get(name, 0.0) ** 2 for name in stated])
    if known is not None:
        rows = [row for row, name in enumerate(stated) if places[name] in known.names]
        columns = [known.names.index(places[stated[row]]) for row in rows]
        old = np.array([card.file_factor(stated[row]) for row in rows])
        covariance[np.ix_(rows, rows)] = known.matrix[np.ix_(columns, columns)] / np.outer(old, old)
    return covariance


def _body_in_file(card: ManoeuvringCard, scales: FileScales | None, ahead: float) -> dict[str, float]:
    """Rigid body, roll and propulsion by dotted key, about an origin `ahead` lengths forward."""
    body = shifted_body(card.rigid_body, ahead)
    force, mass, inertia, length = (
        (scales.force, scales.mass, scales.inertia, scales.length) if scales else (1.0, 1.0, 1.0, 1.0)
    )
    written = {
        "rigid_body.mass": _written(body.mass * mass),
        "rigid_body.yaw_inertia": _written(body.yaw_inertia * inertia),
        "rigid_body.x_G": _written(body.x_G * length),
    }
    if card.roll is not None:
        written |= roll_in_file(card.roll, inertia, length)
    if card.propulsion is not None and card.model.kind != "mmg":
        written["propulsion.Xnn"] = _written(card.propulsion.Xnn * force)
    return written


def roll_in_file(roll: Roll, inertia: float, length: float) -> dict[str, float]:
    """``[roll]`` by dotted key, as a file has it.

    `roll`: In the prime system; `inertia`, `length`: A number of the file over the same in the prime system: of
    inertias and of lengths.
    """
    heights = {key: getattr(roll, key) for key in ("z_G", "z_R", "l_x")}
    written = {f"roll.{key}": _written(value * length) for key, value in heights.items() if value}
    return {"roll.roll_inertia": _written(roll.roll_inertia * inertia), **written}


def _without_other_spellings(card: ManoeuvringCard, text: str) -> str:
    """The text without a key of ``[uncertainty]`` that spells a term otherwise than ``[derivatives]`` does."""
    import tomlkit

    document = tomlkit.parse(text)
    section = document.get("uncertainty", {})
    spelt = set(card.places.values())
    for key in list(section):
        name = OPPOSITE.get(key, (key, 1.0))[0]
        if key not in spelt and name.isalnum() and _canonical(name) in card.places:
            del section[key]
    return tomlkit.dumps(document)


def _canonical(name: str) -> str:
    try:
        return known_term(name).name
    except ValueError:
        return name


def _written(value: float) -> float:
    """Fourteen figures: more than any table prints, and without the noise of the last bits."""
    return float(f"{value:.14g}")


def shifted_terms(name: str, ahead: float) -> dict[str, float]:
    """Derivatives from one of value 1 (prime) for an origin `ahead` lengths forward: names to values."""
    found: dict[str, float] = {}
    for shifted, value in _in_other_velocities(known_term(name), ahead).items():
        found[shifted] = found.get(shifted, 0.0) + value
        if shifted.startswith("Y"):  # N - a Y
            moment = f"N{shifted[1:]}"
            found[moment] = found.get(moment, 0.0) - ahead * value
    return found


def _in_other_velocities(term: Term, ahead: float) -> dict[str, float]:
    """The same force by v and r of the new origin."""
    if term.acceleration:
        other = _IN_SWAY.get((term.force, term.acceleration))
        return {term.name: 1.0, other: -ahead} if other else {term.name: 1.0}
    return {
        replace(term, v=term.v - count, r=term.r + count).name: comb(term.v, count) * (-ahead) ** count
        for count in range(term.v + 1)
    }


def shift_matrix(names: Sequence[str], ahead: float) -> tuple[tuple[str, ...], Array]:
    """Names of the derivatives about a new origin, and the matrix that computes them from the derivatives `names`.

    For a point P at a' L forward of the old origin O, v_O' = v_P' - a' r' and N_P' = N_O' - a' Y'. Every term in v
    becomes terms in v and r by the binomial theorem; accelerations alike. Both ways of stating terms in r ("total" and
    "hydrodynamic") change by the same rule, as the inertia of the body does. U, by which cards are scaled, is the speed
    of the new origin afterwards: a difference of second order in a' r', which is not in the rule.

    `names`: The k derivatives about the old origin; `ahead`: The new origin forward of it, in lengths.

    Returns the n names, the card's first, and the matrix (n, k).
    """
    columns = [shifted_terms(name, ahead) for name in names]
    every = tuple(dict.fromkeys([*names, *(name for column in columns for name in column)]))
    matrix = np.array([[column.get(name, 0.0) for column in columns] for name in every]).reshape(len(every), len(names))
    return every, matrix


def shifted_body(body: RigidBody, ahead: float) -> RigidBody:
    """m', J_z', x_G' about an origin `ahead` lengths forward."""
    inertia = body.yaw_inertia - 2 * ahead * body.mass * body.x_G + ahead**2 * body.mass
    return RigidBody(mass=body.mass, yaw_inertia=inertia, x_G=body.x_G - ahead)
