"""Signs that derivatives have on every known ship, and why.

Prime system, rudder positive to starboard, without inertia terms. Held against the Mariner (Chislett and Strom-Tejsen
1965) and the KVLCC2 (Yasukawa and Yoshimura 2015, converted); derivatives whose sign differs between ships, as Y_r,
Y_rdot and N_vdot, are not here.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ExpectedSign:
    """The sign, +1 or -1, and the reason for it, to follow a colon."""

    sign: int
    reason: str


EXPECTED_SIGNS: dict[str, ExpectedSign] = {
    "Yv": ExpectedSign(-1, "the water resists sideways motion"),
    "Nv": ExpectedSign(-1, "the force of a drift angle acts forward of midships (Munk moment)"),
    "Nr": ExpectedSign(-1, "the water damps yawing"),
    "Yd": ExpectedSign(-1, "a rudder that turns to starboard pushes the stern to port"),
    "Nd": ExpectedSign(+1, "a rudder that turns to starboard, at the stern, pushes the bow to starboard"),
    "Yvdot": ExpectedSign(-1, "accelerating sideways takes water along (added mass)"),
    "Nrdot": ExpectedSign(-1, "accelerating in yaw takes water along (added inertia)"),
    "Xudot": ExpectedSign(-1, "accelerating ahead takes water along (added mass)"),
    "Xdd": ExpectedSign(-1, "a rudder at an angle has more drag"),
}
