"""The hydrodynamic polynomials of paper 2: third order (3.8), Abkowitz, and linear (3.5).

The lists of terms are defined here alone; a name states its powers (:mod:`tank2sim.cards.terms`), so that list and
equation are one. Taylor factors (1/2, 1/6) are absorbed in the coefficients.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

from tank2sim.cards.terms import known_term

_EVEN_AND_ODD = (
    "0 0u 0uu v vvv vrr vdd vu vuu r rrr vvr rdd ru ruu d ddd vvd rrd du duu vrd".split()  # order of (3.8b)
)

ABKOWITZ_TERMS: dict[str, tuple[str, ...]] = {
    "X": tuple("X0 Xu Xuu Xuuu Xvv Xrr Xdd Xvvu Xrru Xddu Xvr Xvd Xrd Xvru Xvdu Xrdu".split()),
    "Y": tuple(f"Y{powers}" for powers in _EVEN_AND_ODD),
    "N": tuple(f"N{powers}" for powers in _EVEN_AND_ODD),
}
"""Velocity and rudder terms of (3.8a), (3.8b), (3.8c): 16, 22 and 22."""

ACCELERATION_TERMS: tuple[str, ...] = ("Xudot", "Yvdot", "Yrdot", "Nvdot", "Nrdot")
"""Acceleration derivatives kept in (3.7)."""

ALL_TERMS: tuple[str, ...] = (*ABKOWITZ_TERMS["X"], *ABKOWITZ_TERMS["Y"], *ABKOWITZ_TERMS["N"], *ACCELERATION_TERMS)
"""The 65 derivatives of the third-order model."""

LINEAR_TERMS: dict[str, tuple[str, ...]] = {
    "X": ("Xu",),
    "Y": ("Yv", "Yr", "Yd"),
    "N": ("Nv", "Nr", "Nd"),
}
"""Velocity and rudder terms of (3.5). Its X_delta is zero by symmetry (paper 2) and not among the names of a card."""


def polynomial(names: Iterable[str], coefficients: Mapping[str, Any], **motion: Any) -> Any:
    """Sum of the named terms of (3.8): each coefficient times the powers that its name states.

    Parameters
    ----------
    names : iterable of str
        Names of terms (:mod:`tank2sim.cards.terms`).
    coefficients : mapping
        Name to coefficient.
    **motion
        ``v``, ``r``, rudder ``d``, speed change ``u``, and the rate of roll ``p`` and heel ``phi`` of a ship that
        rolls, in one scaling (the prime system in the models); numbers, arrays or CasADi expressions; 0 if absent.
    """
    total: Any = 0
    for name in names:
        powers = known_term(name).powers
        # The powers by themselves, not one after the other onto the coefficient: Y and N then share them.
        total += coefficients[name] * math.prod(motion.get(letter, 0) ** power for letter, power in powers.items())
    return total
