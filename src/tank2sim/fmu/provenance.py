"""Documents of an FMU by the text of its card: source, validity, origin and uncertainty of every coefficient."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import tomlkit

from tank2sim.cards.card import DEFAULT_RELATIVE_ERROR, Card, SteeredBy, SteeredCard
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.dynamics.effects.particulars import estimated_from
from tank2sim.dynamics.low_speed import SOURCES
from tank2sim.dynamics.small_craft import THRUSTER_PARAMETERS
from tank2sim.units import to_si

NOT_STATED = "not stated"
ASSUMED_ERROR = f"assumed: {100 * DEFAULT_RELATIVE_ERROR:g} % of the value (the card states none)"
STATED_ERROR = "stated in the card"
ABSENT = "not in the card: the program's default"
"""Source of a coefficient that the card does not give: a derivative is then zero."""


@dataclass(frozen=True)
class ValueOrigin:
    """Where a coefficient comes from.

    Parameters
    ----------
    source : str
        The card's source, with the equation's source for an effect.
    remark : str
        What the card says next to the value (``# ESTIMATED: ...``); may be empty.
    standard_error : float, optional
        In the unit of the coefficient; None if nothing is known.
    error_from : str
        Where the standard error is from: :data:`STATED_ERROR`, :data:`ASSUMED_ERROR` or :data:`NOT_STATED`.
    """

    source: str
    remark: str = ""
    standard_error: float | None = None
    error_from: str = NOT_STATED


# Parameter of the model -> section and key (SI) of the card.
_PLACES = {
    "ship.length": ("ship", "length_m"),
    "ship.speed": ("model", "speed_mps"),
    "ship.mass": ("rigid_body", "mass"),
    "ship.x_G": ("rigid_body", "x_G"),
    "ship.yaw_inertia": ("rigid_body", "yaw_inertia"),
    "ship.water_density": ("environment", "water_density_kgpm3"),
    "ship.slowest": ("model", "valid_speed_mps"),
    "ship.fastest": ("model", "valid_speed_mps"),
    "low_speed.bound": ("model", "low_speed_below_mps"),
    "ship.largest_drift": ("model", "valid_drift_rad"),
    "ship.largest_yaw_rate": ("model", "valid_yaw_rate_prime"),
    "ship.largest_rudder": ("model", "valid_rudder_rad"),
    "steering.time_constant": ("steering_gear", "time_constant_s"),
    "steering.max_rate": ("steering_gear", "max_rate_radps"),
    "steering.max_angle": ("steering_gear", "max_angle_rad"),
    "propulsion.nominal_speed": ("propulsion", "nominal_radps"),
    "propulsion.Xnn": ("propulsion", "Xnn"),
    "surge.total_mass": ("surge", "total_mass_kg"),
    "surge.B1": ("surge", "B1_kgs2pm3"),
    "surge.B2": ("surge", "B2_kgspm2"),
    "surge.B3": ("surge", "B3_kgpm"),
    "glider.mass": ("glider", "mass_kg"),
    "glider.added_mass_axial": ("glider", "added_mass_axial_kg"),
    "glider.added_mass_normal": ("glider", "added_mass_normal_kg"),
    "glider.reference_area": ("glider", "reference_area_m2"),
    "glider.lift_slope": ("glider", "lift_slope"),
    "glider.lift_quadratic": ("glider", "lift_quadratic"),
    "glider.drag_zero": ("glider", "drag_zero"),
    "glider.drag_quadratic": ("glider", "drag_quadratic"),
    "glider.water_density": ("environment", "water_density_kgpm3"),
    "glider.gravity": ("environment", "gravity_mps2"),
    "buoyancy.command": ("glider", "buoyancy_kg"),
    "buoyancy.time_constant": ("glider", "buoyancy_time_constant_s"),
    "pitch.time_constant": ("glider", "pitch_time_constant_s"),
    "roll.time_constant": ("glider", "roll_time_constant_s"),
}


def origins(card: Card) -> dict[str, ValueOrigin]:
    """Name of a parameter or input of the model to its origin; what the card does not give is left out."""
    document: Mapping[str, Any] = tomlkit.parse(card.text)
    particulars = {f"ship.{_stem(key)}": ("ship", key) for key in document["ship"] if _stem(key) != "length"}
    found = {}
    for variable, (section, key) in (_PLACES | particulars).items():
        comment = _line_comment(document.get(section), key)
        if comment is not None:
            error, whence = _stated_error(card, key)
            found[variable] = ValueOrigin(card.ship.source, comment, error, whence)
    if not isinstance(card, SteeredCard):
        return found
    if card.steered_by is SteeredBy.RUDDER:
        found = _of_low_speed() | found
    for name in card.derivatives:
        comment = _line_comment(document.get("derivatives"), card.places.get(name, name))
        whence = STATED_ERROR if name in card.uncertainty else ASSUMED_ERROR
        found[f"derivatives.{name}"] = ValueOrigin(card.ship.source, comment or "", card.standard_error(name), whence)
    return found | dict(_of_thrusters(card, document)) | dict(_of_effects(card, document))


def _of_thrusters(card: SteeredCard, document: Mapping[str, Any]) -> Iterator[tuple[str, ValueOrigin]]:
    """Thrust curves."""
    for thruster, table in zip(card.thrusters, document.get("thrusters", ()), strict=True):
        for key, name in THRUSTER_PARAMETERS.items():
            comment = _line_comment(table, key)
            if comment is not None:
                error = thruster.uncertainty.get(key)
                whence = NOT_STATED if error is None else STATED_ERROR
                yield f"thrusters.{thruster.name}.{name}", ValueOrigin(card.ship.source, comment, error, whence)


def _of_low_speed() -> dict[str, ValueOrigin]:
    """Low-speed data that a card need not state: estimates and choices of the program."""
    estimates = {f"ship.{_stem(key)}": estimated_from(key) for key in ("draught_m", "propeller_diameter_m")}
    return {name: ValueOrigin(f"not in the card: {source}") for name, source in (estimates | SOURCES).items()}


def _stem(key: str) -> str:
    """The name of a particular without its unit: ``draught`` of ``draught_m``."""
    stem, _, unit = key.rpartition("_")
    return stem if stem and unit in ("m", "m2", "kg", "mps") else key


def _stated_error(card: Card, key: str) -> tuple[float | None, str]:
    stated = getattr(card, "uncertainty", {}).get(key)
    return stated, NOT_STATED if stated is None else STATED_ERROR


def _of_effects(card: SteeredCard, document: Mapping[str, Any]) -> Iterator[tuple[str, ValueOrigin]]:
    for entry, table in zip(card.effects, document.get("effects", ()), strict=True):
        effect = EFFECTS[entry.name]
        for name, variable in effect.model_names().items():
            comment = _line_comment(table.get("parameters"), name)
            error = entry.uncertainty.get(name)
            value = "default of the effect" if comment is None else card.ship.source
            whence = NOT_STATED if error is None else STATED_ERROR
            package = f" ({origin.distribution})" if (origin := EFFECTS.origin(entry.name)) else ""
            source = f"equation of the effect {entry.name}{package}: {effect.source}; value: {value}"
            yield variable, ValueOrigin(source, comment or "", error, whence)


def _line_comment(section: Any, key: str) -> str | None:
    """The comment next to a key, which the file may spell in another unit; None if it does not have it."""
    if section is None:
        return None
    for name in section:
        if key in (name, to_si(name, 1.0)[0]):
            # What is an inline table has no comments on its keys.
            trivia = getattr(section.item(name) if hasattr(section, "item") else None, "trivia", None)
            return str(trivia.comment).lstrip("# ").strip() if trivia is not None else ""
    return None


@dataclass(frozen=True, kw_only=True)
class Documents:
    """Data on the ship in an FMU, next to the equations.

    Parameters
    ----------
    card_text : str, optional
        The ship card, kept in the FMU as ``resources/ship.toml``.
    source : str
        Where the data come from, in a sentence.
    validity : str
        Where the model holds, in a sentence.
    speed_range_mps : pair of float, optional
        Speeds through the water at which the model holds.
    origins : mapping
        Parameter or input of the model to where its value comes from.
    identifier : str
        modelName and modelIdentifier of the FMU; where it is empty, the model's name as an identifier.
    """

    card_text: str | None = None
    source: str = ""
    validity: str = ""
    speed_range_mps: tuple[float, float] | None = None
    origins: Mapping[str, ValueOrigin] = field(default_factory=dict)
    identifier: str = ""


def documents_without_card(card: Card) -> Documents:
    """Validity alone: neither the card, nor where its numbers come from."""
    documents = documents_of(card)
    return Documents(validity=documents.validity, speed_range_mps=documents.speed_range_mps)


def documents_of(card: Card) -> Documents:
    """Source, validity, the origin of every coefficient and the card itself, to lie in the FMU."""
    speeds = card.speed_range_mps
    validity = f"The card holds for speeds through the water of {speeds[0]:g} to {speeds[1]:g} m/s." if speeds else ""
    if isinstance(card, SteeredCard) and card.steered_by is SteeredBy.RUDDER and card.propulsion is None:
        validity += (
            " It states no propulsion: the ship holds its revolutions at every speed, so that it leaves rest by "
            "itself and cannot be stopped."
        )
    return Documents(
        card_text=card.text,
        source=card.ship.source,
        validity=validity,
        speed_range_mps=speeds,
        origins=origins(card),
    )
