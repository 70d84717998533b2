"""The one check of a card's sizes and signs: impossible ones are refused, implausible ones are said with every result.

:func:`refuse_impossible` is called when a card is read, :func:`doubts` when its model is built or its numbers are
written elsewhere, so that no command has a check of its own.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from tank2sim.cards.card import Card, ManoeuvringCard, MmgCard, SteeredBy, SteeredCard
from tank2sim.cards.form import BodySection, SteeringGear
from tank2sim.cards.plausibility import (
    EXPECTED_SIGNS,
    added_masses,
    levers,
    unusual_signs,
    yaw_damping,
    yaw_force,
)
from tank2sim.notices import Notice, caution

FULLEST_BLOCK = 1.15
"""Largest volume over L B d. Nothing is fuller than a box; the rest is for a length between perpendiculars that is
shorter than the waterline. Project choice."""

LEAST_BLOCK = 0.02
"""Smallest volume over L B d, a tenth of the finest hulls: less is a mass in another unit. Project choice."""

LARGEST_GYRADIUS = 0.5
"""Largest radius of gyration over L: all mass at the ends of the hull."""

LEAST_ANGLE_RAD = math.radians(2.0)
"""Largest rudder angle below which a gear steers nothing, and pi/2 in degrees or less is an angle in radians."""

LEAST_RATE_RADPS = math.radians(0.2)
"""Slowest rudder that is taken for one: a tenth of the 2.3 deg/s of SOLAS II-1/29, and more than that in rad/s for
degrees. Project choice."""

USUAL_OF_SHIPS = {
    "length over beam": (1.5, 20.0),
    "beam over draught": (1.0, 12.0),
    "block coefficient": (0.2, 1.0),
    "block coefficient by mass over the stated one": (0.75, 1.33),
    "added mass ahead over mass": (0.01, 0.4),
    "Froude number": (0.03, 0.7),
    "radius of gyration over length": (0.15, 0.4),
    "place of the centre of gravity over length": (-0.1, 0.1),
    "rudder area over L d": (1 / 150, 1 / 12),
    "propeller diameter over draught": (0.1, 1.2),
    "metacentric height over beam": (-0.1, 0.5),
    "Y_v' over -pi (d/L)^2": (0.5, 6.0),
    "N_delta'": (1e-4, 0.02),
    "length (m)": (0.3, 460.0),
}
"""Ranges of proportions beyond which no displacement vessel with a rudder is known. Merchant ships have L/B 5 to 8,
B/d 2 to 4, C_B 0.5 to 0.87, an added mass ahead of 0.03 to 0.15 m, a Froude number of 0.1 to 0.35, a radius of
gyration of 0.22 to 0.28 L, x_G within 0.04 L, a rudder of L d/70 to L d/30 and Y_v' 1.5 to 2.5 times -pi (d/L)^2
(Clarke, Gedling and Hine 1983). The bounds leave room for tugs, ferries and narrow hulls, and none for a length in
feet, beam and draught exchanged, a speed or an area of another scale, or one prime system taken for another. Project
choice."""

USUAL_OF_MMG = {
    "K_T at rest (k_0)": (0.05, 1.2),
    "slope of K_T (k_1)": (-1.5, 0.0),
    "thrust deduction t_P": (-0.1, 0.5),
    "wake fraction w_P0": (-0.1, 0.7),
    "slope of the rudder's force (f_alpha)": (1.0, 5.0),
    "t_R": (-0.1, 0.7),
    "a_H": (-0.05, 1.0),
    "eps": (0.4, 2.0),
    "kappa": (0.0, 1.5),
    "gamma_R_plus": (0.05, 1.5),
    "gamma_R_minus": (0.05, 1.5),
    "rudder height over draught": (0.2, 1.1),
    "rudder height over its mean chord": (0.5, 4.0),
}
"""Ranges of the coefficients of propeller and rudder. Published ones (Yasukawa and Yoshimura 2015 and the papers of
the method for tankers, container and car carriers): t_P 0.1 to 0.3, w_P0 0.2 to 0.5, f_alpha 2.2 to 3.3 for aspect
ratios of 1.3 to 2.5, a_H 0.1 to 0.5, eps 0.8 to 1.3, kappa 0.4 to 0.7, gamma_R 0.2 to 0.8. Project choice: twice as
wide and more."""

USUAL_OF_CRAFT = {
    "length over beam": (0.5, 30.0),
    "Froude number": (0.01, 3.0),
    "thrust over weight": (0.001, 1.0),
    "radius of gyration over length": (0.1, 0.5),
    "place of the centre of gravity over length": (-0.25, 0.25),
}

_DEEP_DRAUGHTS = 4.0
"""Depth over draught from which the water counts as deep for added masses and damping (Vantorre: h/d > 3)."""

_LARGEST_PRIME_MASS = 0.1
"""m' = 2 C_B (B/L) (d/L) of ships is 0.003 to 0.04; mass over 1/2 rho L^2 d is 0.2 to 0.3. Project choice."""


_SIGNIFICANT = 2.0
"""Standard errors from which a value counts as certain: an interval of 95 %."""

_LARGE_M, _FASTEST_RADPS = 20.0, math.radians(30.0)
"""Length (m) from which a rudder that moves faster than this (rad/s) is one in deg/min. Project choice."""

_LEVER_ROOM = 0.15
"""Room (over L) around the levers of measured ships: effects on a card share the force of rudder and drift with the
polynomial, and 0.63 L abaft was measured so (HMRI's KVLCC2). Project choice."""


def refuse_impossible(card: Card) -> None:
    """Raise InputError if a card states what no body can have.

    Parameters
    ----------
    card : Card
        As read: SI or prime, starboard positive.

    Raises
    ------
    InputError
        The hull is fuller than a box, its mass lies outside it, it is aground, or an angle or a rate of the steering
        gear is far too small (radians for degrees).
    """
    if isinstance(card, SteeredCard):
        _refuse_body(card)
    ship = card.ship
    if ship.water_depth_m is not None and ship.draught_m is not None and ship.water_depth_m <= ship.draught_m:
        problem = f"is {ship.water_depth_m:g} m, and the draught {ship.draught_m:g} m: the ship is aground"
        raise card.fault("ship.water_depth_m", problem, "check both")
    if isinstance(card, SteeredCard) and card.steering_gear:
        _refuse_gear(card, card.steering_gear)


def _refuse_gear(card: SteeredCard, gear: SteeringGear) -> None:
    for key, least, unit in (("max_angle_rad", LEAST_ANGLE_RAD, "deg"), ("max_rate_radps", LEAST_RATE_RADPS, "deg/s")):
        value = getattr(gear, key)
        if value is not None and value < least:
            place, shown = card.in_file(f"steering_gear.{key}", value)
            problem = f"is {shown:.3g}, less than any steering gear has"
            if not place.endswith(("_rad", "_radps")):
                problem += f"; {shown:.3g} in radians would be {math.degrees(shown):.3g} {unit}"
            raise card.fault(place, problem, f"give it in {unit} (_deg, _degps) or radians (_rad, _radps)")


def doubts(card: Card) -> tuple[Notice, ...]:
    """Sizes and signs of a card that no known ship has, as one caution; empty if there are none.

    Examples
    --------
    >>> from tank2sim.cards import read_card
    >>> doubts(read_card("mariner"))
    ()
    >>> doubts(read_card("mariner", {"model.rudder_sign": "starboard"}))[0][:50]
    'Mariner class: the rudder turns the ship the wrong'
    """
    if isinstance(card, ManoeuvringCard):
        facts = [*_of_ship(card), *(_of_mmg(card) if isinstance(card, MmgCard) else ())]
    elif isinstance(card, SteeredCard):
        facts = list(_of_craft(card))
    else:
        return ()
    if not facts:
        return ()
    name = " ".join(card.ship.name.split())
    return (caution(f"{name}: {'; '.join(facts)}. Correct the card, or confirm that this ship is so."),)


def _refuse_body(card: SteeredCard) -> None:
    mass, gyradius_2 = card.body_si["mass"], _gyradius_2(card)
    block = _block(card.ship, mass, card.environment.water_density_kgpm3)
    if block is not None and not LEAST_BLOCK < block < FULLEST_BLOCK:
        problem = f"is {mass:.4g} kg, {block:.3g} times the water that a box of length, beam and draught displaces"
        remedy = "check mass, scaling, length_m, beam_m and draught_m (all in m)"
        raise card.fault("rigid_body.mass", problem, remedy)
    stated = card.ship.displacement_kg
    if card.steered_by is SteeredBy.THRUSTERS and stated is not None and not 0.5 < mass / stated < 2.0:
        problem = f"is {mass:.4g} kg, and ship.displacement_kg is {stated:.4g}"
        raise card.fault("rigid_body.mass", problem, "give both in kg (or the mass in the card's scaling)")
    centre = card.body_si["x_G"] / card.ship.length_m
    if not centre**2 <= gyradius_2 <= LARGEST_GYRADIUS**2:
        problem = (
            f"gives a radius of gyration of {math.sqrt(gyradius_2):.3g} L about midships with x_G at {centre:.3g} L"
        )
        remedy = "it is about midships, in the scaling of the mass; 0.25 L is usual"
        raise card.fault("rigid_body.yaw_inertia", problem, remedy)


def _of_ship(card: ManoeuvringCard) -> Iterator[str]:
    """Unusual features of a ship with a rudder; most serious first."""
    hull, errors = _hydrodynamic(card), card.uncertainty
    signs = {caution.fact.split()[0]: caution.fact for caution in unusual_signs(hull, errors)}
    if "Nd" in signs:
        turned = [name for name in ("Yd", "Nd") if signs.pop(name, "")]
        values = " and ".join(f"{name}' = {hull[name]:.3g}" for name in turned)
        yield f"the rudder turns the ship the wrong way ({values}, starboard positive): check model.rudder_sign"
    yield from signs.values()
    if (surge := hull.get("Xu", 0.0)) > _SIGNIFICANT * errors.get("Xu", 0.0):
        yield f"Xu is {surge:+.3g}, and it is negative for every known ship: resistance grows with speed"
    yield from _proportions(card, USUAL_OF_SHIPS)
    if (turning := hull.get("Nd", 0.0)) > 0:
        yield from _beyond("N_delta'", turning, USUAL_OF_SHIPS, _SIGNIFICANT * errors.get("Nd", 0.0))
    yield from _of_gear(card)
    yield from _of_hull(card, hull, set(signs))
    if not (card.ship.beam_m and card.ship.draught_m) and card.rigid_body.mass > _LARGEST_PRIME_MASS:
        yield f"m' is {card.rigid_body.mass:.3g}, and ships have 0.003 to 0.04: check model.scaling"
    yield from _of_angles(card)


def _of_angles(card: ManoeuvringCard) -> Iterator[str]:
    for key in ("valid_rudder_rad", "valid_drift_rad"):
        value = getattr(card.model, key)
        if value is not None and 0 < value < LEAST_ANGLE_RAD:
            place, shown = card.in_file(f"model.{key}", value)
            yield f"{place} is {shown:.3g}, and nearly every motion is beyond it: check its unit"


def _of_gear(card: ManoeuvringCard) -> Iterator[str]:
    rate = card.steering_gear.max_rate_radps if card.steering_gear else None
    if rate and rate > _FASTEST_RADPS and card.ship.length_m > _LARGE_M:
        place, shown = card.in_file("steering_gear.max_rate_radps", rate)
        yield f"{place} is {shown:.3g}, and the gear of a ship makes 2 to 7 deg/s: check its unit"


def _of_hull(card: ManoeuvringCard, hull: dict[str, float], doubted: set[str]) -> Iterator[str]:
    """Sizes of linear terms and added masses; points of attack of the terms whose sign is not `doubted`."""
    ship, body, errors = card.ship, card.rigid_body, card.uncertainty
    cautions = [*yaw_force(hull, body.mass)]
    draught = ship.draught_m / ship.length_m if ship.draught_m else None
    if not (ship.water_depth_m and ship.draught_m) or ship.water_depth_m >= _DEEP_DRAUGHTS * ship.draught_m:
        cautions += added_masses(hull, errors, body.mass, body.yaw_inertia)
        cautions += yaw_damping(hull, errors, draught)
        if draught and (value := hull.get("Yv", 0.0)) < 0:
            slender = math.pi * draught**2
            doubt = _SIGNIFICANT * errors.get("Yv", 0.0) / slender
            yield from _beyond("Y_v' over -pi (d/L)^2", -value / slender, USUAL_OF_SHIPS, doubt)
    cautions += levers({name: value for name, value in hull.items() if name not in doubted}, errors, _LEVER_ROOM)
    yield from (caution.fact for caution in cautions)


def _of_mmg(card: MmgCard) -> Iterator[str]:
    rudder, propeller, ship = card.rudder, card.propeller, card.ship
    for name, value in (("x_R", rudder.x_R), ("x_H", rudder.x_H), ("x_P", propeller.x_P), ("l_R", rudder.l_R)):
        if value is not None and value > 0:
            yield f"{name} is {value:+.3g}, forward of midships, and it is negative for every known ship"
    found = {
        "K_T at rest (k_0)": propeller.k_0,
        "slope of K_T (k_1)": propeller.k_1,
        "thrust deduction t_P": propeller.t_P,
        "wake fraction w_P0": propeller.w_P0,
        "slope of the rudder's force (f_alpha)": rudder.f_alpha,
        "rudder height over draught": rudder.height_m / ship.draught_m,
        "rudder height over its mean chord": rudder.height_m**2 / ship.rudder_area_m2,
        **{key: getattr(rudder, key) for key in ("t_R", "a_H", "eps", "kappa", "gamma_R_plus", "gamma_R_minus")},
    }
    for name, value in found.items():
        if value is not None:
            yield from _beyond(name, value, USUAL_OF_MMG, _SIGNIFICANT * card.interaction_errors.get(name, 0.0))
    area = rudder.number * ship.rudder_area_m2
    yield from _beyond("rudder area over L d", area / (ship.length_m * ship.draught_m), USUAL_OF_SHIPS)
    yield from _of_advance(card)


def _of_advance(card: MmgCard) -> Iterator[str]:
    """An advance ratio at the speed of the card that no propeller has."""
    propeller = card.propeller
    if card.propulsion is None or propeller.k_0 is None:
        return
    speed = (1 - propeller.w_P0) * card.model.speed_mps
    advance = speed / (card.propulsion.nominal_radps / (2 * math.pi) * card.ship.propeller_diameter_m)
    thrust = propeller.k_0 + (propeller.k_1 or 0.0) * advance + (propeller.k_2 or 0.0) * advance**2
    if not 0 < advance < 2 or thrust <= 0:
        yield (
            f"the propeller's advance ratio is {advance:.3g} at model.speed_mps and the nominal revolutions, with "
            f"K_T = {thrust:.3g}: check propulsion.nominal_rpm, the speed and propeller_diameter_m"
        )


def _of_craft(card: SteeredCard) -> Iterator[str]:
    known = {name: value for name, value in card.derivatives.items() if name in EXPECTED_SIGNS and value}
    yield from (caution.fact for caution in unusual_signs(known, card.uncertainty) if "Nv" not in caution.fact)
    yield from _proportions(card, USUAL_OF_CRAFT)
    thrust = sum(thruster.largest_thrust_N for thruster in card.thrusters)
    weight = card.body_si["mass"] * card.environment.gravity_mps2
    yield from _beyond("thrust over weight", thrust / weight, USUAL_OF_CRAFT)
    wrong = {"port": 1.0, "starboard": -1.0}
    for thruster in card.thrusters:
        if any(side in thruster.name and thruster.y_m * sign > 0 for side, sign in wrong.items()):
            yield f"thruster {thruster.name} is at y_m = {thruster.y_m:g}: y is positive to starboard"


def _proportions(card: SteeredCard, usual: dict[str, tuple[float, float]]) -> Iterator[str]:
    ship, length = card.ship, card.ship.length_m
    block = _block(ship, card.body_si["mass"], card.environment.water_density_kgpm3)
    found = {
        "length (m)": length,
        "length over beam": _over(length, ship.beam_m),
        "beam over draught": _over(ship.beam_m, ship.draught_m),
        "block coefficient": block,
        "block coefficient by mass over the stated one": _over(block, ship.block_coefficient),
        "added mass ahead over mass": -card.derivatives.get("Xudot", 0.0) / card.rigid_body.mass or None,
        "Froude number": card.model.speed_mps / math.sqrt(card.environment.gravity_mps2 * length),
        "radius of gyration over length": math.sqrt(_gyradius_2(card)),
        "place of the centre of gravity over length": card.body_si["x_G"] / length,
        "propeller diameter over draught": _over(ship.propeller_diameter_m, ship.draught_m),
        "metacentric height over beam": _over(ship.metacentric_height_m, ship.beam_m),
    }
    for name, value in found.items():
        if value is not None and name in usual:
            yield from _beyond(name, value, usual)


def _beyond(name: str, value: float, usual: dict[str, tuple[float, float]], doubt: float = 0.0) -> Iterator[str]:
    low, high = usual[name]
    if not low - doubt <= value <= high + doubt:
        yield f"{name} is {value:.3g}, and known ships have {low:.3g} to {high:.3g}"


def _over(value: float | None, by: float | None) -> float | None:
    return value / by if value is not None and by else None


def _hydrodynamic(card: ManoeuvringCard) -> dict[str, float]:
    """The derivatives (prime) without the terms of inertia that a card with "total" terms has in them."""
    hull = {name: value for name, value in card.derivatives.items() if value}
    body = card.rigid_body
    if card.model.yaw_rate_terms == "total":
        for name, inertia in (("Yr", body.mass), ("Nr", body.mass * body.x_G)):
            if name in hull:
                hull[name] += inertia
    return hull


def _gyradius_2(card: SteeredCard) -> float:
    body = card.body_si
    return body["yaw_inertia"] / body["mass"] / card.ship.length_m**2


def _block(ship: BodySection, mass: float, density: float) -> float | None:
    if not (ship.length_m and ship.beam_m and ship.draught_m):
        return None
    return mass / (density * ship.length_m * ship.beam_m * ship.draught_m)
