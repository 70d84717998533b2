"""A ship that rolls as a body of xdyn with six free motions, whose pitch and heave keep the ship level.

The card's ship (:mod:`tank2sim.dynamics.roll`) heels about the axis of x alone: psi' = r cos(phi), v along the heeled
axis of y, no pitch and no heave. A body of xdyn that turns with a blocked pitch rate q does not stay level, for theta'
= q cos(phi) - r sin(phi). So w and q follow the heel, v and r of xdyn are

    v = V cos^2(phi),  w = -V sin(phi) cos(phi),  r = R cos^2(phi),  q = R sin(phi) cos(phi)

with V and R of the card, and X to N are the written mass times the accelerations that follow. Rounding is held off by a
spring and a damper in Z and M.
"""

from __future__ import annotations

import casadi as ca
import numpy as np

from tank2sim.arrays import Array
from tank2sim.dynamics.model import Model

LEVELLING = 0.5
"""Natural frequency (rad/s) of depth and pitch of a body that is not level: project choice, slow against the step."""

ROLLED_STATES = {name: f"{name}(t)" for name in ("v", "w", "q", "r", "theta", "z")}
"""States of xdyn that the card's ship has not, or has in other axes, to their spelling."""


def rolled_motion(s: dict[str, ca.SX], phi: ca.SX) -> tuple[ca.SX, ca.SX]:
    """V and R of the card from xdyn's v, w, q, r and the heel."""
    upright, heeled = ca.cos(phi), ca.sin(phi)
    return s["v"] - s["w"] * heeled / upright, s["r"] + s["q"] * heeled / upright


def level_motion(V: ca.SX, R: ca.SX, phi: ca.SX) -> dict[str, ca.SX]:
    """xdyn's states of a level ship from V and R of the card and the heel."""
    upright, heeled = ca.cos(phi), ca.sin(phi)
    found = {"v": V * upright**2, "w": -V * heeled * upright, "r": R * upright**2, "q": R * heeled * upright}
    return found | {"theta": ca.SX(0), "z": ca.SX(0)}


def rolled_forces(model: Model, s: dict[str, ca.SX], rigid: Array, total: Array) -> dict[str, ca.SX]:
    """X, Y, Z (N), K, M, N (N m) of xdyn's `s` for diagonal matrices `rigid` and `total` (6,)."""
    names = ("motion.u", "motion.v", "motion.r", "motion.phi", "motion.p")
    u, V, R, phi, p = (model.symbol(name) for name in names)
    udot, Vdot, Rdot, pdot = (model.symbol(f"motion.{name}dot") for name in "uvrp")
    level = level_motion(V, R, phi)
    changes = ca.vertcat(V, R, phi), ca.vertcat(Vdot, Rdot, p)
    rate = {name: ca.jtimes(level[name], *changes) for name in "vwrq"}
    sinking = s["v"] * ca.sin(phi) + s["w"] * ca.cos(phi)
    pitching = s["q"] * ca.cos(phi) - s["r"] * ca.sin(phi)
    rate["w"] -= 2 * LEVELLING * sinking + LEVELLING**2 * s["z"]
    rate["q"] -= 2 * LEVELLING * pitching + LEVELLING**2 * s["theta"]
    rates = [udot, rate["v"], rate["w"], pdot, rate["q"], rate["r"]]
    moved = ca.vertcat(*(float(mass) * value for mass, value in zip(total, rates, strict=True)))
    forces = moved - by_xdyn(rigid, u, p, s)
    return dict(zip("XYZKMN", ca.vertsplit(forces), strict=True))


def by_xdyn(rigid: Array, u: ca.SX, p: ca.SX, s: dict[str, ca.SX]) -> ca.SX:
    """-C_RB nu (6,) of a diagonal matrix `rigid` (6,) with one mass: what xdyn adds."""
    mass, (x, y, z) = float(rigid[0]), (float(value) for value in rigid[3:])
    v, w, q, r = (s[name] for name in "vwqr")
    return ca.vertcat(
        mass * (v * r - w * q),
        mass * (w * p - u * r),
        mass * (u * q - v * p),
        (y - z) * q * r,
        (z - x) * r * p,
        (x - y) * p * q,
    )


def rolled_rates(model: Model, forces: ca.SX, rigid: Array, total: Array) -> dict[str, ca.SX]:
    """``udot``, ``vdot``, ``pdot``, ``rdot`` of a model's level ship by xdyn's `forces` (6,)."""
    names = ("motion.u", "motion.v", "motion.r", "motion.phi", "motion.p")
    u, V, R, phi, p = (model.symbol(name) for name in names)
    level = level_motion(V, R, phi)
    rates = ca.SX(ca.DM(1 / np.asarray(total))) * (forces + by_xdyn(rigid, u, p, level))
    found = {"udot": rates[0], "pdot": rates[3]}
    for name, row, value in (("v", 1, V), ("r", 5, R)):
        slope = ca.jacobian(level[name], value)
        found[f"{name}dot"] = (rates[row] - ca.jacobian(level[name], phi) * p) / slope
    return found
