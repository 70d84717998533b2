"""The card of a small craft, read from its form, checked and brought to SI."""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping

from tank2sim.cards.card import CraftCard, SteeredCard
from tank2sim.cards.craft_terms import CRAFT_TERMS, body_scales, craft_scale
from tank2sim.cards.form import CraftForm, ThrusterSection
from tank2sim.cards.scaling import Scales
from tank2sim.errors import InputError
from tank2sim.units import from_si

UNCERTAIN_OF_THRUSTER = (
    "ahead_Ns2",
    "astern_Ns2",
    "speed_loss_kg",
    "dead_band_radps",
    "order_exponent",
    "time_constant_s",
)
"""Keys of ``[[thrusters]]`` that may have a standard error."""


def craft_card(form: CraftForm, text: str, source: str, spelt: Mapping[str, str]) -> CraftCard:
    """The card of a form, in SI.

    `form`: sections as in the file, angles and rates in SI. `text`, `source`: text of the file and its name, for
    messages. `spelt`: place of an angle or a rate in SI to its place in the file. Raises InputError: a term is unknown,
    mass or place is implausible, a thruster is given twice or states what it cannot, or the thrusters cannot hold the
    cruising speed.
    """
    _check_names(form, source)
    length, body = form.ship.length_m, form.rigid_body
    scales = Scales(form.environment.water_density_kgpm3, length, form.model.speed_mps)
    prime = form.model.scaling == "prime"

    def si(name: str, value: float) -> float:
        return value * craft_scale(name, scales) if prime else value

    if prime:
        units = body_scales(scales)
        body = body.model_copy(update={key: getattr(body, key) * unit for key, unit in units.items()})
    if body.mass > 2.0 * scales.mass:
        problem, remedy = f"is {body.mass:g} kg on {length:g} m", "it is in kg, and in the prime system about 0.01"
        raise InputError(source, "rigid_body.mass", problem, remedy)
    if abs(body.x_G) > 0.5 * length:
        remedy = "x_G is measured from the origin, positive forward, in m unless scaling is prime"
        raise InputError(source, "rigid_body.x_G", f"is {body.x_G:g} m on a craft of {length:g} m", remedy)
    _check_thrusters(form, source, spelt)
    card = CraftCard(
        source=source,
        text=text,
        ship=form.ship,
        environment=form.environment,
        model=form.model,
        rigid_body=body,
        derivatives={name: si(name, value) for name, value in form.derivatives.items()},
        uncertainty={name: si(name, error) for name, error in form.uncertainty.items()},
        thrusters=tuple(form.thrusters),
        effects=tuple(form.effects),
        spelt=spelt,
    )
    _check_signs(card)
    cruising_revolutions(card)
    return card


def _check_names(form: CraftForm, source: str) -> None:
    for section, names in (("derivatives", form.derivatives), ("uncertainty", form.uncertainty)):
        for name in names:
            if name not in CRAFT_TERMS:
                close = difflib.get_close_matches(name, CRAFT_TERMS, n=1)
                hint = f"did you mean {close[0]}? " if close else ""
                remedy = f"{hint}a small craft has {' '.join(CRAFT_TERMS)}"
                raise InputError(source, f"{section}.{name}", "is not a term of a small craft", remedy)


def _check_thrusters(form: CraftForm, source: str, spelt: Mapping[str, str]) -> None:
    names: list[str] = []
    for number, thruster in enumerate(form.thrusters):
        place = f"thrusters.{number}"
        if thruster.name in names:
            raise InputError(source, f"{place}.name", f"{thruster.name} is given twice", "give each a name of its own")
        names.append(thruster.name)
        if key := next((key for key in thruster.uncertainty if key not in UNCERTAIN_OF_THRUSTER), ""):
            remedy = f"errors are of {', '.join(UNCERTAIN_OF_THRUSTER)}"
            raise InputError(source, f"{place}.uncertainty.{key}", "has no standard error", remedy)
        if thruster.dead_band_radps >= thruster.max_radps:
            spelling = spelt.get(f"{place}.dead_band_radps", f"{place}.dead_band_radps")
            raise InputError(source, spelling, "is not below the largest revolutions", "check both, and their units")
        if max(abs(thruster.x_m), abs(thruster.y_m)) > form.ship.length_m:
            problem = f"is at {thruster.x_m:g}, {thruster.y_m:g} m on a craft of {form.ship.length_m:g} m"
            raise InputError(source, f"{place}.x_m", problem, "places are m from the origin")
        _check_turn(thruster, place, source)


def _check_turn(thruster: ThrusterSection, place: str, source: str) -> None:
    turns = {
        "max_azimuth_rad": "give it, or leave out the time constant of a thruster that does not turn",
        "azimuth_time_constant_s": "a thruster that turns needs the time constant of its turn",
    }
    missing = [key for key in turns if getattr(thruster, key) is None]
    if len(missing) == 1:
        raise InputError(source, f"{place}.{missing[0]}", "is missing", turns[missing[0]])


def _check_signs(card: CraftCard) -> None:
    """Raise InputError if the craft would not be damped at its cruising speed in surge, or in yaw at rest."""
    known, speed = card.derivatives, card.model.speed_mps
    if known.get("Xu", 0.0) + known.get("Xuabsu", 0.0) * speed >= 0:
        problem = f"with Xuabsu drives the craft on at {speed:g} m/s"
        raise card.fault("derivatives.Xu", problem, "coefficients that damp are negative")
    if known.get("Nr", 0.0) > 0:
        raise card.fault("derivatives.Nr", "is positive", "coefficients that damp are negative")


def cruising_revolutions(card: SteeredCard) -> float:
    """Revolutions (rad/s) at which the thrusters that push ahead together hold the cruising speed, all with the same.

    (sum k cos a) n^2 - (sum l cos^2 a) u n = -(Xu u + Xuabsu u^2), a their azimuths.

    Raises InputError: no thruster pushes ahead, or the speed is beyond the largest revolutions.
    """
    speed = card.model.speed_mps
    thrust, loss, least = _thrust_ahead(card)
    loss *= speed
    resistance = -(card.derivatives.get("Xu", 0.0) + card.derivatives.get("Xuabsu", 0.0) * speed) * speed
    n = (loss + math.sqrt(loss**2 + 4 * thrust * resistance)) / (2 * thrust)
    if n > least * (1 + 1e-9):
        needed, reached = (from_si("n_rpm", value) for value in (n, least))
        problem = f"needs {needed:.4g} rpm, and the thrusters reach {reached:.4g} rpm"
        raise card.fault("model.speed_mps", problem, "give a speed that they hold, or check thrust and resistance")
    return n


def _thrust_ahead(card: SteeredCard) -> tuple[float, float, float]:
    """Sums of k cos a and of l cos^2 a over thrusters that push ahead, and the least of their largest revolutions."""
    ahead = [thruster for thruster, holds in zip(card.thrusters, pushes_ahead(card), strict=True) if holds]
    if not ahead:
        raise card.fault("thrusters.0.azimuth_rad", "leaves no thruster that pushes ahead", "give one within 90 deg")
    thrust = sum(thruster.ahead_Ns2 * math.cos(thruster.azimuth_rad) for thruster in ahead)
    loss = sum(thruster.speed_loss_kg * math.cos(thruster.azimuth_rad) ** 2 for thruster in ahead)
    return thrust, loss, min(thruster.max_radps for thruster in ahead)


def speed_held(card: SteeredCard) -> float:
    """The cruising speed (m/s), or the largest that the thrusters hold if that is less."""
    thrust, loss, n = _thrust_ahead(card)
    linear = loss * n - card.derivatives.get("Xu", 0.0)
    root = math.sqrt(max(0.0, linear**2 - 4 * card.derivatives.get("Xuabsu", 0.0) * thrust * n**2))
    return min(card.model.speed_mps, 2 * thrust * n**2 / (linear + root)) if thrust > 0 else 0.0


def pushes_ahead(card: SteeredCard) -> tuple[bool, ...]:
    """For each thruster, whether it is one of those that hold the cruising speed."""
    return tuple(math.cos(thruster.azimuth_rad) > 1e-6 for thruster in card.thrusters)
