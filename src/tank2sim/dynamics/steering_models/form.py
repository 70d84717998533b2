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
    """A coefficient of a steering model, without unit."""

    name: str  # As in a card: ``C_y_b`` for the paper's C_y^beta
    description: str  # What it multiplies, and with which sign
    default: float | None = None  # Its value where a card gives none; without one the card must give it


@dataclass(frozen=True, kw_only=True)
class SteeringForm:
    """The equations of one steering model, and what of it is not published."""

    # `name`, `title`: Key in the catalogue; words for a reader.
    name: str
    title: str
    source: str  # The source of the equations
    coefficients: tuple[SteeringCoefficient, ...]  # In the order of the paper's tables, Y first
    rates: Rates  # The equations (:data:`Rates`)
    # `static_moment`, `damping`: Coefficients of the hull's linear static yaw moment and of its linear yaw damping.
    static_moment: tuple[str, ...] = ("C_m_b",)
    damping: tuple[str, ...] = ("C_m_w",)
    rudder: tuple[str, ...] = ("C_y_d", "C_m_d")  # Coefficients that are proportional to the force of the rudder
    missing: tuple[str, ...] = ()  # What the paper does not print of it; empty if nothing
