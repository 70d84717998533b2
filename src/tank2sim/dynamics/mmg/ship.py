"""A ship by the MMG method: parameters ``mmg.*``, and its forces as quantities of a model.

    (m + m_x) u' - (m + m_y) v r - x_G m r^2                = X_H + X_P + X_R
    (m + m_y) v' + (m + m_x) u r + x_G m r'                 = Y_H + Y_R
    (I_zG + x_G^2 m + J_z) r' + x_G m (v' + u r)            = N_H + N_P + N_R

about midships; N_P is of two propellers. With two propellers and rudders the right one has the numbers of the card, and
the left one their mirror image: what is beta_P > 0 for one is beta_P < 0 for the other. Each meets the surge velocity
u - y r of its own place y.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import casadi as ca

from tank2sim.cards.card import MmgCard
from tank2sim.dynamics.hull import Hull, force_quantities, prime_motion, rudder_quantities
from tank2sim.dynamics.low_speed import STILL_SPEED
from tank2sim.dynamics.mmg.hull import bare_hull_forces, inertial_forces_with_water
from tank2sim.dynamics.mmg.propeller import (
    propeller_inflow,
    thrust_over_density,
    torque_over_density,
    wake_by_polynomial,
    wake_ratio,
)
from tank2sim.dynamics.mmg.rudder import (
    cross_flow_by_polynomial,
    normal_force,
    rudder_cross_flow,
    rudder_forces_of,
    rudder_inflow,
)
from tank2sim.dynamics.model import Parameter, Quantity

DESCRIPTIONS: dict[str, str] = {
    "k_0": "K_T at J = 0",
    "k_1": "Coefficient of J in K_T",
    "k_2": "Coefficient of J^2 in K_T",
    "t_P": "Thrust deduction",
    "w_P0": "Wake fraction at the propeller straight ahead",
    "x_P": "Place of the propeller over L, positive forward of midships",
    "C_1": "Change of the wake by drift, per rad",
    "C_2_plus": "Limit of (1 - w_P)/(1 - w_P0) at large beta_P > 0 (water from port)",
    "C_2_minus": "Limit of (1 - w_P)/(1 - w_P0) at large beta_P < 0 (water from starboard)",
    "tau": "Change of 1 - w_P by the square of v' + x_P' r'",
    "C_Pv": "Coefficient of v' in that change, over tau",
    "C_Pr": "Coefficient of r' in that change, over tau",
    "astern": "Thrust at rest with reversed revolutions over that ahead",
    "q_0": "K_Q at J = 0",
    "q_1": "Coefficient of J in K_Q",
    "q_2": "Coefficient of J^2 in K_Q",
    "eta_R": "Relative rotative efficiency: torque in open water over that behind the hull",
    "f_alpha": "Slope of the rudder's normal force by angle, on 1/2 rho A_R U_R^2",
    "t_R": "Steering resistance deduction",
    "a_H": "Force on the hull by the rudder over the force of the rudder",
    "x_H": "Where that force acts, over L, positive forward of midships",
    "x_R": "Place of the rudder over L, positive forward of midships",
    "eta": "Share of the rudder in the race of the propeller",
    "eps": "Ratio of wake at rudder and propeller, (1 - w_R)/(1 - w_P)",
    "kappa": "Share of the propeller's acceleration that reaches the rudder",
    "l_R": "Effective place of the rudder in yaw over L, positive forward of midships",
    "gamma_R_plus": "Flow straightening for beta_R > 0 (water from port at the rudder)",
    "gamma_R_minus": "Flow straightening for beta_R < 0 (water from starboard at the rudder)",
    "C_Rv": "Cross flow at the rudder by v', positive v_R from starboard",
    "C_Rr": "Cross flow at the rudder by r', positive v_R from starboard",
    "C_Rrrr": "Cross flow at the rudder by r'^3, positive v_R from starboard",
    "C_Rrrv": "Cross flow at the rudder by r'^2 v', positive v_R from starboard",
}
"""Coefficient of ``[propeller]`` and ``[rudder]`` to what it is."""

_BOUNDS = {"t_P": (-1.0, 0.99), "w_P0": (-1.0, 0.99), "t_R": (-1.0, 0.99)}
_NOT_NEGATIVE = ("C_1", "C_2_plus", "C_2_minus", "astern", "f_alpha", "eps", "kappa")


def mmg_parameters(card: MmgCard) -> tuple[Parameter, ...]:
    """Parameters ``mmg.*`` of propeller and rudder, and the sizes that they go with."""

    def size(name: str, unit: str, description: str, value: float) -> Parameter:
        return Parameter(name, unit, description, nominal=value, minimum=1e-9, start=value, tunable=False)

    coefficients = []
    for key in card.interaction_places():
        value = card.interaction(key)
        low, high = _BOUNDS.get(key, (0.0 if key in _NOT_NEGATIVE else None, None))
        coefficients.append(
            Parameter(
                f"mmg.{key}", "1", DESCRIPTIONS[key], nominal=abs(value) or 0.1, minimum=low, maximum=high, start=value
            )
        )
    nominal = card.propulsion.nominal_radps if card.propulsion else 1.0
    return (
        *coefficients,
        size("ship.rudder_area", "m2", "Area of one rudder", card.ship.rudder_area_m2),
        size("ship.rudder_height", "m", "Height of the rudder", card.rudder.height_m),
        Parameter(
            "propulsion.nominal_speed",
            "rad/s",
            "Revolutions that hold the speed of approach",
            display_unit="rpm",
            nominal=nominal,
            minimum=1e-6 * nominal,
            start=nominal,
        ),
    )


def is_symmetric(card: MmgCard) -> bool:
    """True if the ship is alike to both sides: neither wake nor rudder flow depend on the side, and no Y0, N0."""
    if card.derivatives.get("Y0") or card.derivatives.get("N0"):
        return False
    if card.propeller.number == 2:
        return True
    propeller, rudder = card.propeller, card.rudder
    if propeller.C_Pv or propeller.C_Pr:
        return False
    return propeller.C_2_plus == propeller.C_2_minus and rudder.gamma_R_plus == rudder.gamma_R_minus


@dataclass(frozen=True)
class Side:
    """One propeller with its rudder."""

    suffix: str  # Ending of its quantities: empty, or ``_right`` and ``_left`` if there are two
    mirror: float  # 1, or -1 for the left one
    # `y_P`, `y_R`: Places of propeller and rudder over L, positive to starboard.
    y_P: float
    y_R: float


def sides(card: MmgCard) -> tuple[Side, ...]:
    """The propellers of a ship with their rudders."""
    if card.propeller.number == 1:
        return (Side("", 1.0, 0.0, 0.0),)
    y_P, y_R = card.propeller.y_P or 0.0, card.rudder.y_R or 0.0
    return Side("_right", 1.0, y_P, y_R), Side("_left", -1.0, -y_P, -y_R)


@dataclass(frozen=True)
class MmgShip:
    """The symbols of a ship by the method."""

    hull: Hull  # Symbols of all variables, scales and speed
    sides: tuple[Side, ...]

    @cached_property
    def p(self) -> Mapping[str, ca.SX]:
        """Symbols of the coefficients of propeller and rudder."""
        coefficients = {key: self.hull[f"mmg.{key}"] for key in DESCRIPTIONS if f"mmg.{key}" in self.hull.symbols}
        return {**coefficients, "rudder_astern": self.hull["low_speed.rudder_astern"]}

    @cached_property
    def still(self) -> ca.SX:
        """Speed (m/s) that counts as none."""
        return STILL_SPEED * self.hull["ship.speed"]

    @cached_property
    def drift(self) -> ca.SX:
        """beta, rad, within a quarter turn: of the mirror image while going astern."""
        u, v = self.hull["motion.u"], self.hull["motion.v"]
        return -ca.atan2(v, ca.sqrt(u**2 + self.still**2))


def mmg_forces(ship: MmgShip) -> tuple[Quantity, ...]:
    """Quantities of each side (flow, thrust, normal force, and torque of a card with K_Q), ``propeller.power``,
    ``rudder.*``, ``propeller.X``, ``propeller.N`` and ``force.*``."""
    hull = ship.hull
    found: list[Quantity] = []
    power = ca.SX(0)
    X_P, N_P = ca.SX(0), ca.SX(0)
    X_R, Y_R, N_R = ca.SX(0), ca.SX(0), ca.SX(0)
    for side in ship.sides:
        quantities, thrust, F_N = _side_quantities(ship, side)
        found += quantities
        turning, angle = _orders_reached(hull, quantities)
        for torque in (quantity for quantity in quantities if quantity.name.startswith("propeller.torque")):
            power = power + turning * torque.symbol
        push = (1 - ship.p["t_P"]) * thrust
        X, Y, N = rudder_forces_of(ship.p, hull["ship.length"], F_N, angle)
        X_P, N_P = X_P + push, N_P - side.y_P * hull["ship.length"] * push
        X_R, Y_R, N_R = X_R + X, Y_R + Y, N_R + N - side.y_R * hull["ship.length"] * X
    by_rudder = rudder_quantities((X_R, Y_R, N_R))
    by_propeller = (
        Quantity("propeller.X", "N", "Surge force by propellers, positive forward", X_P),
        Quantity("propeller.N", "N.m", "Yaw moment by propellers, + to starboard", N_P),
    )
    if "q_0" in ship.p:
        description = "Power delivered to the propellers"
        found.append(Quantity("propeller.power", "W", description, power, nominal=1e6))
    bare, inertial = bare_hull_forces(hull), inertial_forces_with_water(hull)
    X, Y, N = (a + b + c.symbol for a, b, c in zip(bare, inertial, by_rudder, strict=True))
    forces = X + by_propeller[0].symbol, Y, N + by_propeller[1].symbol
    return (*found, *by_rudder, *by_propeller, *force_quantities(forces, "the MMG method's with its inertial terms"))


def _orders_reached(hull: Hull, quantities: list[Quantity]) -> tuple[ca.SX, ca.SX]:
    """Revolutions (rad/s) and rudder angle (rad) of a side: its own where it is one of two, among its `quantities`."""
    own = {quantity.name.rpartition("_")[0]: quantity.symbol for quantity in quantities}
    turning = own.get("propeller.speed_actual", hull["propeller.speed_actual"])
    return turning, own.get("rudder.effective", hull["rudder.effective"])


def _side_quantities(ship: MmgShip, side: Side) -> tuple[list[Quantity], ca.SX, ca.SX]:
    """Quantities of a side, with the symbols of its thrust and normal force (N)."""
    hull, p = ship.hull, ship.p
    density, length, diameter = hull["ship.water_density"], hull["ship.length"], hull["ship.propeller_diameter"]
    r = hull["motion.r"]
    beta_P = ship.drift - p["x_P"] * r * length / hull.speed

    speed, mirrored = hull.speed, side.mirror
    v_prime, r_prime, _ = prime_motion(hull, speed)
    by_polynomial = mirrored * v_prime, mirrored * r_prime
    kept = wake_by_polynomial(p, *by_polynomial) if "tau" in p else (1 - p["w_P0"]) * wake_ratio(p, mirrored * beta_P)
    drift_speed, swing = mirrored * speed * ship.drift, mirrored * length * r
    if "C_Rr" in p:
        across = cross_flow_by_polynomial(p, speed, *by_polynomial)
    else:
        across = rudder_cross_flow(p, drift_speed, swing)
    in_race = p["eta"] if "eta" in p else diameter / hull["ship.rudder_height"]

    def quantity(name: str, unit: str, description: str, value: ca.SX) -> Quantity:
        return Quantity(f"{name}{side.suffix}", unit, description, value)

    own: list[Quantity] = []
    if side.suffix:  # what an effect with separate orders changes
        turns, angle = "Revolutions of the propeller, positive ahead", "Angle of the rudder, positive to starboard"
        own = [
            quantity("propeller.speed_actual", "rad/s", turns, hull["propeller.speed_actual"]),
            quantity("rudder.effective", "rad", angle, hull["rudder.effective"]),
        ]
    turning, delta = _orders_reached(hull, own)
    n = turning / (2 * ca.pi)
    u_P = quantity(
        "propeller.inflow",
        "m/s",
        "Flow to the propeller u_P, positive from ahead",
        propeller_inflow(hull["motion.u"] - side.y_P * length * r, kept),
    )
    thrust = quantity(
        "propeller.thrust",
        "N",
        "Thrust of the propeller, positive forward",
        density * thrust_over_density(p, diameter, n, u_P.symbol),
    )
    race = 8 * thrust.symbol / (density * ca.pi * diameter**2)
    u_R = quantity(
        "rudder.inflow",
        "m/s",
        "Flow to the rudder u_R, positive from ahead",
        rudder_inflow(p, in_race, u_P.symbol, race, ship.still),
    )
    v_R = quantity(
        "rudder.cross_flow",
        "m/s",
        "Cross flow to the rudder v_R, positive from port",
        mirrored * across,
    )
    F_N = quantity(
        "rudder.normal_force",
        "N",
        "Normal force of the rudder, positive to port",
        normal_force(
            p,
            0.5 * density * hull["ship.rudder_area"],
            (u_R.symbol, v_R.symbol),
            delta,
            ship.still,
        ),
    )
    flow = [*own, u_P, thrust, u_R, v_R, F_N]
    if "q_0" in p:
        value = density * torque_over_density(p, diameter, n, u_P.symbol)
        flow.append(quantity("propeller.torque", "N.m", "Torque that turns the propeller, positive ahead", value))
    return flow, thrust.symbol, F_N.symbol
