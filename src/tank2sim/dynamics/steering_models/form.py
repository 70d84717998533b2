"""A steering model: two equations in drift angle and yaw rate at a constant speed, and its coefficients.

All models of paper 4 (Poznyakov & Yudin 2007) have one form:

    beta' = Y(beta, r, delta) v/L,    omega' = N(beta, r, delta) (v/L)^2,    r = omega L/v = L/R

with the drift angle beta (rad, positive when the bow points into the turn, as in a turn to starboard), the yaw rate
omega (rad/s, positive to starboard), the rudder delta (rad, positive to starboard) and a speed v that does not fall.
They differ in the terms of Y and N, which each model of this package writes out.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import casadi as ca

Rates = Callable[[Mapping[str, ca.SX], ca.SX, ca.SX, ca.SX], tuple[ca.SX, ca.SX]]
"""``rates(coefficients, beta, r, delta) -> (Y, N)``, all without units except for the angles in rad."""


@dataclass(frozen=True, kw_only=True)
class SteeringCoefficient:
    """A coefficient of a steering model, without unit.

    `name`: as in a card: ``C_y_b`` for the paper's C_y^beta. `description`: what it multiplies, and with which sign.
    `default`: its value where a card gives none; without one the card must give it.
    """

    name: str
    description: str
    default: float | None = None


@dataclass(frozen=True, kw_only=True)
class SteeringForm:
    """The equations of one steering model, and what of it is not published.

    `name`, `title`: key in the catalogue; words for a reader. `source`: the source of the equations. `coefficients`: in
    the order of the paper's tables, Y first. `rates`: the equations (:data:`Rates`). `static_moment`,
    `damping`: coefficients of the hull's linear static yaw moment and of its linear yaw damping. `rudder`: coefficients
    that are proportional to the force of the rudder. `missing`: what the paper does not print of it; empty if nothing.
    """

    name: str
    title: str
    source: str
    coefficients: tuple[SteeringCoefficient, ...]
    rates: Rates
    static_moment: tuple[str, ...] = ("C_m_b",)
    damping: tuple[str, ...] = ("C_m_w",)
    rudder: tuple[str, ...] = ("C_y_d", "C_m_d")
    missing: tuple[str, ...] = ()
