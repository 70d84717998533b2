"""Forces of the bare hull by the MMG method: a polynomial in v' = v/U and r' = r L/U without rudder and speed change.

    X_H' = -R_0' + X_vv' v'^2 + X_vr' v' r' + X_rr' r'^2 + X_vvvv' v'^4
    Y_H' = Y_v' v' + Y_r' r' + Y_vvv' v'^3 + Y_vvr' v'^2 r' + Y_vrr' v' r'^2 + Y_rrr' r'^3,   N_H' alike

Y_r' and X_vr' are without the added masses, which are with the inertia: (m + m_y) v r in X, -(m + m_x) u r in Y. The
moment of Munk is in N_v'. Y_0' and N_0', of a hull that is not alike to both sides, are not of the method; they are
zero unless a card states them.
"""

from __future__ import annotations

import casadi as ca

from tank2sim.dynamics.abkowitz import ACCELERATION_TERMS, polynomial
from tank2sim.dynamics.hull import Hull, hydrodynamic_linear, prime_motion, with_share
from tank2sim.dynamics.low_speed import Forces, slow_resistance, slow_sway_and_yaw
from tank2sim.dynamics.rigid_body import inertial_forces

HULL_TERMS: dict[str, tuple[str, ...]] = {
    "X": tuple("X0 Xvv Xvr Xrr Xvvvv".split()),
    "Y": tuple("Y0 Yv Yr Yvvv Yvvr Yvrr Yrrr".split()),
    "N": tuple("N0 Nv Nr Nvvv Nvvr Nvrr Nrrr".split()),
}
"""Terms of the bare hull in X, Y and N."""

MMG_TERMS: tuple[str, ...] = (*HULL_TERMS["X"], *HULL_TERMS["Y"], *HULL_TERMS["N"], *ACCELERATION_TERMS)
"""The derivatives of an MMG model: X0 = -R_0', Xudot = -m_x', Yvdot = -m_y', Nrdot = -J_z'; Yrdot and Nvdot
are 0 unless the ship rolls."""


def hull_polynomials(hull: Hull) -> Forces:
    """X_H, Y_H, N_H of the bare hull by its polynomial, N, N and N m."""
    v, r, _ = prime_motion(hull, hull.speed)
    scales = hull.scales(hull.speed)
    X, Y, N = (
        polynomial(names, {name: hull.coefficient(name) for name in names}, v=v, r=r) for names in HULL_TERMS.values()
    )
    return scales.force * X, scales.force * Y, scales.force * scales.length * N


def bare_hull_forces(hull: Hull) -> Forces:
    """X_H, Y_H, N_H at any speed, N, N and N m: below ``low_speed.bound`` the polynomial passes into cross-flow drag.

    There its own linear terms, resistance and the drag of :mod:`tank2sim.dynamics.low_speed` take its place, which are
    regular at rest and astern.
    """
    share = hull.low_share
    X, Y, N = hull_polynomials(hull)
    unit = hull.scales(ca.SX(1))
    slow_Y, slow_N = slow_sway_and_yaw(hull.symbols, hull.speed, hydrodynamic_linear(hull))
    slow_X = slow_resistance(hull.symbols, hull.speed, -unit.force * hull.coefficient("X0"))
    kept = 1 - share
    return with_share((share, share, share), (slow_X, slow_Y, slow_N), (kept * X, kept * Y, kept * N))


def inertial_forces_with_water(hull: Hull) -> Forces:
    """(m + m_y) v r + x_G m r^2, -(m + m_x) u r, -x_G m u r: inertia of ship and water on the right."""
    u, v, r = hull["motion.u"], hull["motion.v"], hull["motion.r"]
    X, Y, N = inertial_forces(hull["ship.mass"], hull["ship.x_G"], u, v, r)
    mass = hull.scales(ca.SX(1)).mass
    return X - mass * hull.coefficient("Yvdot") * v * r, Y + mass * hull.coefficient("Xudot") * u * r, N
