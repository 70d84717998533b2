"""What a card of a small craft states, checked and brought to SI; its coefficients in the prime system.

Terms are named by what they multiply: ``Xuabsu`` is the coefficient of u|u| in X, ``Nrabsv`` that of r|v| in N. All are
zero at rest, so that a craft may stop, spin and go astern; a coefficient that damps is negative. Fossen (2021),
Handbook of Marine Craft Hydrodynamics and Motion Control, 2nd ed., 6.4 and 6.5 (there X_|u|u, N_|v|r).
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping
from typing import NamedTuple

from tank2sim.cards.card import CraftCard
from tank2sim.cards.form import CraftForm
from tank2sim.cards.scaling import Scales
from tank2sim.errors import InputError
from tank2sim.units import from_si


class CraftTerm(NamedTuple):
    """A velocity term of a small craft.

    Parameters
    ----------
    name : str
    force : str
        ``X``, ``Y`` or ``N``.
    factor : str
        ``u``, ``v`` or ``r``.
    size : str
        The velocity whose size it has as a second factor; empty for a linear term.
    """

    name: str
    force: str
    factor: str
    size: str

    @property
    def lengths(self) -> int:
        """Lengths that it has more than a term of a force by linear velocities: an arm, and one for each yaw rate."""
        return (self.force == "N") + (self.factor == "r") + (self.size == "r")


def _terms() -> tuple[CraftTerm, ...]:
    surge = [("X", "u", ""), ("X", "u", "u")]
    others = [(force, factor, size) for force in "YN" for factor in "vr" for size in ("", "v", "r", "u")]
    return tuple(
        CraftTerm(f"{force}{factor}{'abs' * bool(size)}{size}", force, factor, size)
        for force, factor, size in (*surge, *others)
    )


VELOCITY_TERMS: tuple[CraftTerm, ...] = _terms()
"""Damping of a small craft: linear terms, and products of a velocity with the size of one."""

CRAFT_ADDED_MASSES = ("Xudot", "Yvdot", "Yrdot", "Nvdot", "Nrdot")
"""Acceleration derivatives of a small craft, negative for added masses."""

CRAFT_TERMS: tuple[str, ...] = (*CRAFT_ADDED_MASSES, *(term.name for term in VELOCITY_TERMS))
"""Names in ``[derivatives]`` of a small craft."""

UNCERTAIN_OF_THRUSTER = ("ahead_Ns2", "astern_Ns2", "speed_loss_kg", "dead_band_radps", "time_constant_s")
"""Keys of ``[[thrusters]]`` that may have a standard error."""


def craft_scale(name: str, scales: Scales) -> float:
    """SI value of a term of a small craft that is 1 in the prime system: with 1/2 rho L^2 V^2, L and V.

    Parameters
    ----------
    name : str
        One of :data:`CRAFT_TERMS`.
    scales : Scales
        Density (kg/m3), length (m) and speed V (m/s).

    Examples
    --------
    >>> from tank2sim.cards.scaling import Scales
    >>> craft_scale("Xuabsu", Scales(1000.0, 2.0, 3.0))  # 1/2 rho L^2
    2000.0
    """
    length, speed = float(scales.length), float(scales.speed)
    if name in CRAFT_ADDED_MASSES:
        return float(scales.mass) * length ** ((name[0] == "N") + (name[1] == "r"))
    term = next(term for term in VELOCITY_TERMS if term.name == name)
    return float(scales.force) * length**term.lengths / speed ** (2 if term.size else 1)


def craft_scales(card: CraftCard) -> Scales:
    """Density, length and cruising speed, which make the numbers of a craft non-dimensional."""
    return Scales(card.environment.water_density_kgpm3, card.ship.length_m, card.model.speed_mps)


def body_scales(scales: Scales) -> dict[str, float]:
    """SI values of ``mass``, ``yaw_inertia`` and ``x_G`` that are 1 in the prime system."""
    return {"mass": float(scales.mass), "yaw_inertia": float(scales.inertia), "x_G": float(scales.length)}


def craft_card(form: CraftForm, text: str, source: str, spelt: Mapping[str, str]) -> CraftCard:
    """The card of a form, in SI.

    Parameters
    ----------
    form : CraftForm
        Sections as in the file, angles and rates in SI.
    text, source : str
        Text of the file and its name, for messages.
    spelt : mapping
        Place of an angle or a rate in SI to its place in the file.

    Raises
    ------
    InputError
        A term is unknown, mass or place is implausible, a thruster is given twice or states what it cannot, or the
        thrusters cannot hold the cruising speed.
    """
    for section, names in (("derivatives", form.derivatives), ("uncertainty", form.uncertainty)):
        for name in names:
            if name not in CRAFT_TERMS:
                close = difflib.get_close_matches(name, CRAFT_TERMS, n=1)
                hint = f"did you mean {close[0]}? " if close else ""
                remedy = f"{hint}a small craft has {' '.join(CRAFT_TERMS)}"
                raise InputError(source, f"{section}.{name}", "is not a term of a small craft", remedy)
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


def _check_thrusters(form: CraftForm, source: str, spelt: Mapping[str, str]) -> None:
    names = [thruster.name for thruster in form.thrusters]
    for number, thruster in enumerate(form.thrusters):
        place = f"thrusters.{number}"
        if thruster.name in names[:number]:
            raise InputError(source, f"{place}.name", f"{thruster.name} is given twice", "give each a name of its own")
        for key in thruster.uncertainty:
            if key not in UNCERTAIN_OF_THRUSTER:
                remedy = f"errors are of {', '.join(UNCERTAIN_OF_THRUSTER)}"
                raise InputError(source, f"{place}.uncertainty.{key}", "has no standard error", remedy)
        if thruster.dead_band_radps >= thruster.max_radps:
            spelling = spelt.get(f"{place}.dead_band_radps", f"{place}.dead_band_radps")
            raise InputError(source, spelling, "is not below the largest revolutions", "check both, and their units")
        if max(abs(thruster.x_m), abs(thruster.y_m)) > form.ship.length_m:
            problem = f"is at {thruster.x_m:g}, {thruster.y_m:g} m on a craft of {form.ship.length_m:g} m"
            raise InputError(source, f"{place}.x_m", problem, "places are m from the origin")
        if thruster.max_azimuth_rad is not None and thruster.azimuth_time_constant_s is None:
            remedy = "a thruster that turns needs the time constant of its turn"
            raise InputError(source, f"{place}.azimuth_time_constant_s", "is missing", remedy)
        if thruster.max_azimuth_rad is None and thruster.azimuth_time_constant_s is not None:
            remedy = "give it, or leave out the time constant of a thruster that does not turn"
            raise InputError(source, f"{place}.max_azimuth_rad", "is missing", remedy)


def _check_signs(card: CraftCard) -> None:
    """Raise InputError if the craft would not be damped at its cruising speed in surge, or in yaw at rest."""
    known, speed = card.derivatives, card.model.speed_mps
    if known.get("Xu", 0.0) + known.get("Xuabsu", 0.0) * speed >= 0:
        problem = f"with Xuabsu drives the craft on at {speed:g} m/s"
        raise card.fault("derivatives.Xu", problem, "coefficients that damp are negative")
    if known.get("Nr", 0.0) > 0:
        raise card.fault("derivatives.Nr", "is positive", "coefficients that damp are negative")


def cruising_revolutions(card: CraftCard) -> float:
    """Revolutions (rad/s) at which the thrusters that push ahead together hold the cruising speed, all with the same.

    (sum k cos a) n^2 - (sum l cos^2 a) u n = -(Xu u + Xuabsu u^2), a their azimuths.

    Raises
    ------
    InputError
        No thruster pushes ahead, or the speed is beyond the largest revolutions.
    """
    ahead = [thruster for thruster, holds in zip(card.thrusters, pushes_ahead(card), strict=True) if holds]
    speed = card.model.speed_mps
    if not ahead:
        raise card.fault("thrusters.0.azimuth_rad", "leaves no thruster that pushes ahead", "give one within 90 deg")
    thrust = sum(thruster.ahead_Ns2 * math.cos(thruster.azimuth_rad) for thruster in ahead)
    loss = sum(thruster.speed_loss_kg * math.cos(thruster.azimuth_rad) ** 2 for thruster in ahead) * speed
    resistance = -(card.derivatives.get("Xu", 0.0) + card.derivatives.get("Xuabsu", 0.0) * speed) * speed
    n = (loss + math.sqrt(loss**2 + 4 * thrust * resistance)) / (2 * thrust)
    least = min(thruster.max_radps for thruster in ahead)
    if n > least * (1 + 1e-9):
        needed, reached = (from_si("n_rpm", value) for value in (n, least))
        problem = f"needs {needed:.4g} rpm, and the thrusters reach {reached:.4g} rpm"
        raise card.fault("model.speed_mps", problem, "give a speed that they hold, or check thrust and resistance")
    return n


def pushes_ahead(card: CraftCard) -> tuple[bool, ...]:
    """For each thruster, whether it is one of those that hold the cruising speed."""
    return tuple(math.cos(thruster.azimuth_rad) > 1e-6 for thruster in card.thrusters)
