"""Forces on the hull and the motion that follows: (3.5) or (3.8) with (3.7) of paper 2, as quantities of a model."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import casadi as ca

from tank2sim.cards.card import SteeredCard
from tank2sim.cards.scaling import Scales
from tank2sim.cards.terms import known_term
from tank2sim.dynamics.abkowitz import ABKOWITZ_TERMS, ACCELERATION_TERMS, LINEAR_TERMS, polynomial
from tank2sim.dynamics.geographic import GEOGRAPHIC_OUTPUTS
from tank2sim.dynamics.low_speed import (
    STILL_SPEED,
    Forces,
    RudderAtU0,
    hull_forces,
    lowest_speed,
    regular_speed,
    rudder_factors,
    share_of_low_speed,
    share_out_of_range,
)
from tank2sim.dynamics.model import Parameter, Quantity
from tank2sim.dynamics.propulsion import propeller_force
from tank2sim.dynamics.rigid_body import Inertia, inertia, inertial_forces, rigid_body_accelerations

VALIDITY_MARGIN = 0.2
"""Above the card's range of speeds ``validity`` falls from 1 to 0 over this share of the speed of expansion.

Project choice: forces grow with the square of speed, so 20 % of speed is 44 % of force."""

DRIFT_MARGIN, YAW_RATE_MARGIN, RUDDER_MARGIN = 0.5, 1.0, 0.35
"""Beyond the largest abs(v'), abs(r') and abs(delta) (rad) of the card ``validity`` falls from 1 to 0 over these: those
of v' and r' are what captive tests usually reach, and 20 deg of rudder. Project choice."""


VALIDITY_FACTOR = "validity_by."
"""First part of the names of the factors of ``validity``, one for each cause (``validity_by.drift``)."""


@dataclass(frozen=True)
class Hull:
    """The hull's symbols, and the conventions in which its coefficients are given.

    Parameters
    ----------
    linear : bool
        (3.5) instead of (3.8).
    nominal_scale : bool
        The speed V of the scaling is u0, not U. In the linear model it always is: V = U would not be linear.
    inertial_terms : bool
        ``yaw_rate_terms = "hydrodynamic"``: the equations add m x_G, m, -m u and -m x_G u.
    symbols : mapping
        States, inputs, parameters and the quantities ``rudder.effective`` and ``propeller.speed_actual``, by name.
    """

    linear: bool
    nominal_scale: bool
    inertial_terms: bool
    symbols: Mapping[str, ca.SX]

    def __getitem__(self, name: str) -> ca.SX:
        return self.symbols[name]

    def coefficient(self, name: str) -> ca.SX:
        """Symbol of a derivative (prime)."""
        return self.symbols[f"derivatives.{name}"]

    @cached_property
    def speed(self) -> ca.SX:
        """U, m/s, with a slope at rest (:func:`tank2sim.dynamics.low_speed.regular_speed`)."""
        return regular_speed(self.symbols)

    @cached_property
    def low_share(self) -> ca.SX:
        """Share of the forces at low speed (:func:`tank2sim.dynamics.low_speed.share_of_low_speed`)."""
        return share_of_low_speed(self.symbols)

    @cached_property
    def X_bound(self) -> ca.SX:
        """The card's X straight ahead at the lowest speed of the polynomial, N."""
        return _ahead(self, "X", lowest_speed(self.symbols))

    def scales(self, speed: ca.SX) -> Scales:
        """Scales at a speed, as expressions."""
        return Scales(self["ship.water_density"], self["ship.length"], speed)


MOTION_OUTPUTS = (
    *("motion.x", "motion.y", "motion.psi", "motion.u", "motion.v", "motion.r", "motion.speed", "motion.beta"),
    *("motion.sog", "motion.cog", *GEOGRAPHIC_OUTPUTS),
    *("motion.udot", "motion.vdot", "motion.rdot"),
)
"""Outputs of every vessel that is steered."""


def hull_particulars(card: SteeredCard, speed: str, inertia: str) -> tuple[Parameter, ...]:
    """``ship.length`` to ``ship.fastest`` of a ship or craft; `speed` says what u0 is, `inertia` what J_z is called."""
    body, (slowest, fastest) = card.body_si, card.model.speed_range_mps
    # Above zero: a ship without length, speed, mass or water has no equations. A craft may hold down to rest.
    may_vanish = ("ship.x_G", "ship.slowest") if card.thrusters else ("ship.x_G",)
    described = (
        ("ship.length", "m", "Length between perpendiculars", card.ship.length_m),
        ("ship.speed", "m/s", speed, card.model.speed_mps),
        ("ship.mass", "kg", "Mass", body["mass"]),
        ("ship.x_G", "m", "Centre of gravity forward of midships", body["x_G"]),
        ("ship.yaw_inertia", "kg.m2", f"Yaw inertia {inertia} about midships", body["yaw_inertia"]),
        ("ship.water_density", "kg/m3", "Density of the water", card.environment.water_density_kgpm3),
        ("ship.slowest", "m/s", "Lowest speed at which the card holds", slowest),
        ("ship.fastest", "m/s", "Highest speed at which the card holds", fastest),
    )
    return tuple(
        Parameter(
            *words,
            start=start,
            tunable=False,
            nominal=abs(start) or 1.0,
            minimum=None if words[0] in may_vanish else 1e-6,
            display_unit="knots" if words[1] == "m/s" else None,
        )
        for *words, start in described
    )


def motion_quantities(hull: Hull, forces: tuple[Quantity, ...]) -> tuple[Quantity, ...]:
    """The `forces`, ``inertia.*``, accelerations, speed and drift, and ``validity``.

    Parameters
    ----------
    hull : Hull
        The ship.
    forces : tuple of Quantity
        Whatever the forces are made of; the last three are ``force.X``, ``force.Y``, ``force.N``.
    """
    X, Y, N = forces[-3:]
    masses = _inertia_quantities(hull)
    matrix = Inertia(*(mass.symbol for mass in masses))
    motion = rigid_body_accelerations(matrix, X.symbol, Y.symbol, N.symbol)
    return (*forces, *masses, *acceleration_quantities(motion), *_water_speed_quantities(hull))


def _scales_of_forces(hull: Hull) -> tuple[ca.SX, Scales]:
    """V of the scaling, and the scales with it."""
    speed = hull["ship.speed"] if hull.linear or hull.nominal_scale else hull.speed
    return speed, hull.scales(speed)


def _terms(hull: Hull, force: str, with_rudder: bool) -> list[str]:
    """Terms of (3.5) or (3.8) in X, Y or N that hold the rudder's angle, or that do not."""
    every = (LINEAR_TERMS if hull.linear else ABKOWITZ_TERMS)[force]
    return [name for name in every if (known_term(name).d > 0) == with_rudder]


def _polynomials(hull: Hull, with_rudder: bool) -> Forces:
    """X, Y, N (N, N m) of the terms of (3.5) or (3.8) with the rudder's angle, or without; faded out at low speed."""
    speed, scales = _scales_of_forces(hull)
    v, r, du = prime_motion(hull, speed)
    primes = {"v": v, "r": r, "d": hull["rudder.effective"], "u": du}
    sums = []
    for force in "XYN":
        names = _terms(hull, force, with_rudder)
        sums.append(polynomial(names, {name: hull.coefficient(name) for name in names}, **primes))
    force = (1 - hull.low_share) * scales.force
    return force * sums[0], force * sums[1], force * scales.length * sums[2]


def prime_motion(hull: Hull, speed: ca.SX) -> Forces:
    """v', r' and Du' by a speed of the scaling (m/s)."""
    u, v, r = hull["motion.u"], hull["motion.v"], hull["motion.r"]
    slowness = speed / speed**2  # one division in the code that CasADi makes of it, where 1/V would be three
    return v * slowness, r * hull["ship.length"] * slowness, (u - hull["ship.speed"]) * slowness


def _ahead(hull: Hull, force: str, u: ca.SX, rudder: int = 0) -> ca.SX:
    """The card's X, Y or N/L straight ahead at a speed u, N: of the terms with that power of the rudder, at 1 rad."""
    u0 = hull["ship.speed"]
    speed = u0 if hull.linear or hull.nominal_scale else u
    terms = {name: known_term(name) for name in _terms(hull, force, with_rudder=rudder > 0)}
    names = [name for name, term in terms.items() if (term.v, term.r, term.d) == (0, 0, rudder)]
    coefficients = {name: hull.coefficient(name) for name in names}
    value: ca.SX = hull.scales(speed).force * polynomial(names, coefficients, d=1, u=(u - u0) / speed)
    return value


def with_share(share: Forces, forces: Forces, others: Forces) -> Forces:
    """`others` and a share of `forces`; where the share is none, a compiler leaves out what they alone need."""
    every = zip(share, forces, others, strict=True)
    X, Y, N = (other + ca.if_else(part, part * force, 0) for part, force, other in every)
    return X, Y, N


def _of_rudder_alone(name: str) -> bool:
    term = known_term(name)
    return (term.v, term.r, term.u) == (0, 0, 0)


def _rudder_forces(hull: Hull) -> Forces:
    """X, Y, N by the rudder; at low speed its terms in delta alone, as at u0, in the flow that meets it there."""
    u0 = hull["ship.speed"]
    at_u0 = hull.scales(u0)
    yaw = _ahead(hull, "N", u0, rudder=1)
    at_bound = _ahead(hull, "N", lowest_speed(hull.symbols), rudder=1)
    # A card whose rudder gives no moment has no ratio: the least is taken.
    ratio = at_bound * yaw / (yaw**2 + (STILL_SPEED**2 * at_u0.force) ** 2)
    linear = RudderAtU0(_ahead(hull, "Y", u0, rudder=1), ratio)
    straight, swinging = rudder_factors(hull.symbols, hull.X_bound, linear)
    low = []
    for name in "XYN":
        names = [name for name in _terms(hull, name, with_rudder=True) if _of_rudder_alone(name)]
        coefficients = {name: hull.coefficient(name) for name in names}
        by_angle = polynomial(names, coefficients, d=hull["rudder.effective"])
        by_swing = 0 if name == "X" else hull.coefficient(f"{name}d") * swinging
        low.append(at_u0.force * (straight * by_angle + by_swing))
    share = hull.low_share
    slow = low[0], low[1], at_u0.length * low[2]
    return with_share((share, share, share), slow, _polynomials(hull, with_rudder=True))


def rudder_quantities(forces: Forces) -> tuple[Quantity, Quantity, Quantity]:
    """``rudder.X``, ``rudder.Y``, ``rudder.N`` of the `forces` by the rudder alone: N, N and N m."""
    X, Y, N = forces
    return (
        Quantity("rudder.X", "N", "Surge force by the rudder, positive forward", X),
        Quantity("rudder.Y", "N", "Sway force by the rudder, positive to starboard", Y),
        Quantity("rudder.N", "N.m", "Yaw moment by the rudder, positive to starboard", N),
    )


def hydrodynamic_linear(hull: Hull) -> dict[str, ca.SX]:
    """Yv, Yr, Nv, Nr without the inertia that "total" cards put into them; SI at a speed of 1 m/s."""
    unit_scales = hull.scales(ca.SX(1))
    names = ("Yv", "Yr", "Nv", "Nr")
    found = {name: unit_scales.derivative(known_term(name)) * hull.coefficient(name) for name in names}
    if not hull.inertial_terms:
        found["Yr"] += hull["ship.mass"]
        found["Nr"] += hull["ship.mass"] * hull["ship.x_G"]
    return found


def _hull_forces(hull: Hull) -> Forces:
    """X, Y, N of the hull at nominal revolutions, with the inertial terms of (3.1)."""
    u, v, r = hull["motion.u"], hull["motion.v"], hull["motion.r"]
    X, Y, N = _polynomials(hull, with_rudder=False)
    low = hull.low_share
    kept = 1 - low
    if hull.inertial_terms:
        forward = hull["ship.speed"] if hull.linear else u
        surge, sway, yaw = inertial_forces(hull["ship.mass"], hull["ship.x_G"], forward, v, r)
        # (3.5a) has no m v r: a product of two small quantities.
        X, Y, N = X + (0 if hull.linear else kept * surge), Y + kept * sway, N + kept * yaw
    X_u0 = _ahead(hull, "X", hull["ship.speed"])
    slow = hull_forces(hull.symbols, hull.speed, hull.X_bound, X_u0, hydrodynamic_linear(hull))
    # In surge sooner, by the cube: the polynomial of a slow ship soon gives thrust for resistance.
    return with_share((1 - kept**3, low, low), slow, (X * kept**2, Y, N))


def _right_hand_sides(hull: Hull, rudder: tuple[Quantity, Quantity, Quantity]) -> Forces:
    """f1, f2, f3 of (3.8), or the right-hand sides of (3.5); N and N m."""
    bare = _hull_forces(hull)
    X, Y, N = (force + by_rudder.symbol for force, by_rudder in zip(bare, rudder, strict=True))
    if "propeller.speed" in hull.symbols:
        revolutions = hull["propeller.speed_actual"], hull["propulsion.nominal_speed"], hull["propulsion.Xnn"]
        X = X + hull.scales(hull["ship.speed"]).force * propeller_force(*revolutions)
    return X, Y, N


def polynomial_forces(hull: Hull) -> tuple[Quantity, ...]:
    """``rudder.*`` and ``force.*`` of (3.5) or (3.8)."""
    by_rudder = rudder_quantities(_rudder_forces(hull))
    equations = "right-hand side of (3.5)" if hull.linear else "right-hand side of (3.8)"
    return (*by_rudder, *force_quantities(_right_hand_sides(hull, by_rudder), equations))


def force_quantities(
    forces: Forces, equations: str, nominal: tuple[float, float] = (1e5, 1e7)
) -> tuple[Quantity, Quantity, Quantity]:
    """``force.X``, ``force.Y``, ``force.N``: the right-hand sides f1, f2, f3 of the `equations` named.

    Parameters
    ----------
    forces : tuple of casadi.SX
        Their values: N, N, N m.
    equations : str
        What they are called, for the descriptions.
    nominal : pair of float
        Typical force (N) and moment (N m).
    """
    f1, f2, f3 = forces
    return (
        Quantity(
            "force.X",
            "N",
            f"Surge force without the part by acceleration, {equations}, positive forward",
            f1,
            nominal=nominal[0],
        ),
        Quantity(
            "force.Y",
            "N",
            f"Sway force without the part by acceleration, {equations}, positive to starboard",
            f2,
            nominal=nominal[0],
        ),
        Quantity(
            "force.N",
            "N.m",
            f"Yaw moment about midships without the part by acceleration, {equations}, positive to starboard",
            f3,
            nominal=nominal[1],
        ),
    )


def _inertia_quantities(hull: Hull) -> tuple[Quantity, ...]:
    """Mass matrix in SI, in the order of :class:`Inertia`."""
    scales = hull.scales(hull["ship.speed"])
    added = {}
    for name in ACCELERATION_TERMS:
        added[name] = scales.derivative(known_term(name)) * hull.coefficient(name)
    return inertia_quantities(inertia(hull["ship.mass"], hull["ship.x_G"], hull["ship.yaw_inertia"], added))


def inertia_quantities(matrix: Inertia) -> tuple[Quantity, ...]:
    """``inertia.*`` of a mass matrix (kg, kg m, kg m2), in the order of :class:`Inertia`."""
    described = (
        ("inertia.surge", "kg", "Mass with added mass in surge, m - Xudot", matrix.surge),
        ("inertia.sway", "kg", "Mass with added mass in sway, m - Yvdot", matrix.sway),
        ("inertia.sway_yaw", "kg.m", "Sway force by yaw acceleration, m x_G - Yrdot", matrix.sway_yaw),
        ("inertia.yaw_sway", "kg.m", "Yaw moment by sway acceleration, m x_G - Nvdot", matrix.yaw_sway),
        ("inertia.yaw", "kg.m2", "Yaw inertia with added inertia, J_z - Nrdot", matrix.yaw),
    )
    return tuple(Quantity(*one) for one in described)


def acceleration_quantities(motion: Forces) -> tuple[Quantity, ...]:
    """``motion.udot``, ``motion.vdot`` (m/s2), ``motion.rdot`` (rad/s2) of their values."""
    described = (
        ("motion.udot", "m/s2", "Rate of change of the surge velocity", None, 1e-2),
        ("motion.vdot", "m/s2", "Rate of change of the sway velocity", None, 1e-2),
        ("motion.rdot", "rad/s2", "Yaw acceleration, positive to starboard", "deg/s2", 1e-3),
    )
    return tuple(
        Quantity(name, unit, description, value, display_unit=shown, nominal=nominal)
        for (name, unit, description, shown, nominal), value in zip(described, motion, strict=True)
    )


def inside_range(excess: ca.SX, margin: ca.SX | float) -> ca.SX:
    """1 without excess, falling smoothly to 0 where it is the margin."""
    beyond = ca.fmax(0, ca.fmin(1, excess / margin))
    return 1 - beyond * beyond * (3 - 2 * beyond)


def speed_and_drift(s: Mapping[str, ca.SX], speed: ca.SX, nominal: float) -> tuple[Quantity, Quantity]:
    """``motion.speed`` (m/s) and ``motion.beta`` (rad), with `speed` by :func:`.regular_speed`, typically `nominal`."""
    return (
        Quantity("motion.speed", "m/s", "Speed U through the water", speed, display_unit="knots", nominal=nominal),
        Quantity(
            "motion.beta",
            "rad",
            "Drift angle -asin(v/U), positive when the water comes from port",
            display_unit="deg",
            nominal=0.1,
            # asin(v/U) without its division by zero at rest
            value=-ca.atan2(s["motion.v"], ca.sqrt(s["motion.u"] ** 2 + (STILL_SPEED * s["ship.speed"]) ** 2)),
        ),
    )


def _water_speed_quantities(hull: Hull) -> tuple[Quantity, ...]:
    v = hull["motion.v"]
    speed, drift = speed_and_drift(hull.symbols, hull.speed, 5.0)
    u0 = hull["ship.speed"]
    yaw_rate = hull["motion.r"] * hull["ship.length"] / speed.symbol
    excess = {
        ("drift", "drift angle"): (ca.fabs(v) / speed.symbol - ca.sin(hull["ship.largest_drift"]), DRIFT_MARGIN),
        ("yaw_rate", "yaw rate r L/U"): (ca.fabs(yaw_rate) - hull["ship.largest_yaw_rate"], YAW_RATE_MARGIN),
        ("rudder", "rudder angle"): (
            ca.fabs(hull["rudder.effective"]) - hull["ship.largest_rudder"],
            RUDDER_MARGIN,
        ),
    }
    fast = inside_range(speed.symbol - hull["ship.fastest"], VALIDITY_MARGIN * u0)
    factors = (
        validity_factor("low_speed", "low speed and motion astern", 1 - share_out_of_range(hull.symbols)),
        validity_factor("high_speed", "speed above ship.fastest", fast),
        *(validity_factor(*words, inside_range(*beyond)) for words, beyond in excess.items()),
    )
    low = Quantity(
        "low_speed.share",
        "1",
        "Share of the forces at low speed: 0 from low_speed.bound upwards, 1 at rest and astern",
        hull.low_share,
        minimum=0.0,
        maximum=1.0,
    )
    validity = Quantity(
        "validity",
        "1",
        (
            "1 in the range of speed, drift angle, yaw rate and rudder angle in which the card holds; below that "
            "speed falling to 0 at low speed and astern, and never above the share of the card's polynomial in the "
            "forces; falling to 0 beyond the others"
        ),
        math.prod((factor.symbol for factor in factors), start=ca.SX(1)),
        minimum=0.0,
        maximum=1.0,
    )
    return speed, drift, low, *factors, validity


def validity_factor(name: str, cause: str, value: ca.SX) -> Quantity:
    """Factor ``validity_by.<name>`` of ``validity``: 1 where the model holds for that `cause`, falling to 0 beyond."""
    return Quantity(
        f"{VALIDITY_FACTOR}{name}",
        "1",
        f"Factor of validity by {cause}: 1 where the model holds, falling to 0 beyond",
        value,
        minimum=0.0,
        maximum=1.0,
    )
