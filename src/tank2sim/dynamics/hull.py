"""Forces on the hull and the motion that follows: (3.5) or (3.8) with (3.7) of paper 2, as quantities of a model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca

from tank2sim.cards.scaling import Scales
from tank2sim.cards.terms import known_term
from tank2sim.dynamics.abkowitz import ACCELERATION_TERMS, LINEAR_TERMS, TERMS, polynomial
from tank2sim.dynamics.model import Quantity
from tank2sim.dynamics.propulsion import propeller_force
from tank2sim.dynamics.rigid_body import Inertia, accelerations, inertia, inertial_forces

VALIDITY_MARGIN = 0.2
"""Outside the card's range of speeds ``validity`` falls from 1 to 0 over this share of the speed of expansion.

A choice of ours: forces grow with the square of speed, so 20 % of speed is 44 % of force."""


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

    @property
    def speed(self) -> ca.SX:
        """U, m/s."""
        return ca.sqrt(self["motion.u"] ** 2 + self["motion.v"] ** 2)

    def scales(self, speed: ca.SX) -> Scales:
        """Scales at a speed, as expressions."""
        return Scales(self["ship.water_density"], self["ship.length"], speed)


def motion_quantities(hull: Hull) -> tuple[Quantity, ...]:
    """Forces ``rudder.*`` and ``force.*``, ``inertia.*``, accelerations, speed and drift, and ``validity``."""
    forces = _force_quantities(hull)
    X, Y, N = forces[-3:]
    masses = _inertia_quantities(hull)
    matrix = Inertia(*(mass.symbol for mass in masses))
    motion = accelerations(matrix, X.symbol, Y.symbol, N.symbol)
    return (*forces, *masses, *_acceleration_quantities(motion), *_water_speed_quantities(hull))


def _scales_of_forces(hull: Hull) -> tuple[ca.SX, Scales]:
    """V of the scaling, and the scales with it."""
    speed = hull["ship.speed"] if hull.linear or hull.nominal_scale else hull.speed
    return speed, hull.scales(speed)


def _polynomials(hull: Hull, with_rudder: bool) -> tuple[ca.SX, ca.SX, ca.SX]:
    """X, Y, N of the terms of (3.5) or (3.8) that hold the rudder's angle, or of those that do not; N, N and N m."""
    speed, scales = _scales_of_forces(hull)
    u, v, r = hull["motion.u"], hull["motion.v"], hull["motion.r"]
    primes = (v / speed, r * scales.length / speed, hull["rudder.effective"], (u - hull["ship.speed"]) / speed)
    sums = []
    for force in "XYN":
        every = (LINEAR_TERMS if hull.linear else TERMS)[force]
        names = [name for name in every if (known_term(name).d > 0) == with_rudder]
        sums.append(polynomial(names, {name: hull.coefficient(name) for name in names}, *primes))
    return scales.force * sums[0], scales.force * sums[1], scales.force * scales.length * sums[2]


def _rudder_quantities(hull: Hull) -> tuple[Quantity, Quantity, Quantity]:
    X, Y, N = _polynomials(hull, with_rudder=True)
    return (
        Quantity(name="rudder.X", unit="N", description="Surge force by the rudder, positive forward", value=X),
        Quantity(name="rudder.Y", unit="N", description="Sway force by the rudder, positive to starboard", value=Y),
        Quantity(name="rudder.N", unit="N.m", description="Yaw moment by the rudder, positive to starboard", value=N),
    )


def _right_hand_sides(hull: Hull, rudder: tuple[Quantity, Quantity, Quantity]) -> tuple[ca.SX, ca.SX, ca.SX]:
    """f1, f2, f3 of (3.8), or the right-hand sides of (3.5); N and N m."""
    u, v, r, u0 = hull["motion.u"], hull["motion.v"], hull["motion.r"], hull["ship.speed"]
    bare = _polynomials(hull, with_rudder=False)
    X, Y, N = (force + by_rudder.symbol for force, by_rudder in zip(bare, rudder, strict=True))
    if "propeller.speed" in hull.symbols:
        revolutions = hull["propeller.speed_actual"], hull["propulsion.nominal_speed"], hull["propulsion.Xnn"]
        X = X + hull.scales(u0).force * propeller_force(*revolutions)
    if hull.inertial_terms:
        surge, sway, yaw = inertial_forces(hull["ship.mass"], hull["ship.x_G"], u0 if hull.linear else u, v, r)
        # (3.5a) has no m v r: a product of two small quantities.
        X, Y, N = X + (0 if hull.linear else surge), Y + sway, N + yaw
    return X, Y, N


def _force_quantities(hull: Hull) -> tuple[Quantity, ...]:
    by_rudder = _rudder_quantities(hull)
    f1, f2, f3 = _right_hand_sides(hull, by_rudder)
    equations = "right-hand side of (3.5)" if hull.linear else "right-hand side of (3.8)"
    return (
        *by_rudder,
        Quantity(
            name="force.X",
            unit="N",
            description=f"Surge force but for that of acceleration, {equations}, positive forward",
            nominal=1e5,
            value=f1,
        ),
        Quantity(
            name="force.Y",
            unit="N",
            description=f"Sway force but for that of acceleration, {equations}, positive to starboard",
            nominal=1e5,
            value=f2,
        ),
        Quantity(
            name="force.N",
            unit="N.m",
            description=f"Yaw moment about midships but for that of acceleration, {equations}, positive to starboard",
            nominal=1e7,
            value=f3,
        ),
    )


def _inertia_quantities(hull: Hull) -> tuple[Quantity, ...]:
    """Mass matrix in SI, in the order of :class:`Inertia`."""
    scales = hull.scales(hull["ship.speed"])
    added = {}
    for name in ACCELERATION_TERMS:
        added[name] = scales.derivative(known_term(name)) * hull.coefficient(name)
    matrix = inertia(hull["ship.mass"], hull["ship.x_G"], hull["ship.yaw_inertia"], added)
    described = (
        ("inertia.surge", "kg", "Mass with added mass in surge, m - Xudot", matrix.surge),
        ("inertia.sway", "kg", "Mass with added mass in sway, m - Yvdot", matrix.sway),
        ("inertia.sway_yaw", "kg.m", "Sway force by yaw acceleration, m x_G - Yrdot", matrix.sway_yaw),
        ("inertia.yaw_sway", "kg.m", "Yaw moment by sway acceleration, m x_G - Nvdot", matrix.yaw_sway),
        ("inertia.yaw", "kg.m2", "Yaw inertia with added inertia, J_z - Nrdot", matrix.yaw),
    )
    return tuple(
        Quantity(name=name, unit=unit, description=description, value=value)
        for name, unit, description, value in described
    )


def _acceleration_quantities(motion: tuple[ca.SX, ca.SX, ca.SX]) -> tuple[Quantity, ...]:
    described = (
        ("motion.udot", "m/s2", "Rate of change of the surge velocity", None, 1e-2),
        ("motion.vdot", "m/s2", "Rate of change of the sway velocity", None, 1e-2),
        ("motion.rdot", "rad/s2", "Yaw acceleration, positive to starboard", "deg/s2", 1e-3),
    )
    return tuple(
        Quantity(name=name, unit=unit, description=description, display_unit=shown, nominal=nominal, value=value)
        for (name, unit, description, shown, nominal), value in zip(described, motion, strict=True)
    )


def _water_speed_quantities(hull: Hull) -> tuple[Quantity, Quantity, Quantity]:
    speed = Quantity(
        name="motion.speed",
        unit="m/s",
        description="Speed U through the water",
        display_unit="knots",
        nominal=5.0,
        value=hull.speed,
    )
    drift = Quantity(
        name="motion.beta",
        unit="rad",
        description="Drift angle -asin(v/U), positive when the water comes from port",
        display_unit="deg",
        nominal=0.1,
        # asin(v/U) without its division by zero at rest
        value=-ca.atan2(hull["motion.v"], ca.fabs(hull["motion.u"])),
    )
    margin = VALIDITY_MARGIN * hull["ship.speed"]
    inside = ca.fmin(speed.symbol - hull["ship.slowest"], hull["ship.fastest"] - speed.symbol)
    validity = Quantity(
        name="validity",
        unit="1",
        description="1 in the range of speeds in which the card holds, falling to 0 outside it",
        minimum=0.0,
        maximum=1.0,
        value=ca.fmax(0, ca.fmin(1, 1 + inside / margin)),
    )
    return speed, drift, validity
