"""The effect of propeller revolutions on surge."""

from __future__ import annotations

import casadi as ca

from tank2sim.cards.form import Propulsion
from tank2sim.dynamics.model import Input, Parameter, Quantity, Variable

LARGEST_REVOLUTIONS = 3.0
"""Largest revolutions over the nominal ones: no engine reaches it, and an order in rpm where rad/s belong (9.5 times)
lies beyond it. Project choice."""


def revolutions(section: Propulsion) -> tuple[Variable, Variable]:
    """Input ``propeller.speed`` (rad/s) and quantity ``propeller.speed_actual``."""
    order = Input(
        "propeller.speed",
        "rad/s",
        "Propeller revolutions, positive ahead",
        display_unit="rpm",
        nominal=section.nominal_radps,
        minimum=-LARGEST_REVOLUTIONS * section.nominal_radps,
        maximum=LARGEST_REVOLUTIONS * section.nominal_radps,
        start=section.nominal_radps,
    )
    return (
        order,
        Quantity(
            "propeller.speed_actual",
            "rad/s",
            "Revolutions at which the propeller turns, positive ahead",
            order.symbol,
            display_unit="rpm",
            nominal=section.nominal_radps,
        ),
    )


def propulsion(section: Propulsion) -> tuple[Variable, ...]:
    """The :func:`revolutions`, and parameters ``propulsion.*``."""
    return (
        *revolutions(section),
        Parameter(
            "propulsion.nominal_speed",
            "rad/s",
            "Revolutions that hold the speed of expansion",
            display_unit="rpm",
            nominal=section.nominal_radps,
            minimum=section.nominal_radps / LARGEST_REVOLUTIONS,
            maximum=LARGEST_REVOLUTIONS * section.nominal_radps,
            start=section.nominal_radps,
        ),
        Parameter(
            "propulsion.Xnn",
            "1",
            "Surge force by revolutions, prime system at the speed of expansion",
            nominal=1e-3,
            start=section.Xnn,
        ),
    )


def propeller_force(n: ca.SX, nominal: ca.SX, Xnn: ca.SX) -> ca.SX:
    """X' of the propeller at the speed of expansion: Xnn (n|n|/n0^2 - 1); zero at nominal revolutions n0 (rad/s).

    A card states the thrust ahead, by the revolutions about u0. In all four quadrants the same is assumed here: it goes
    with n|n|, whichever way the ship moves; its slope at n = 0 is zero from both sides. A real propeller pushes less
    astern than ahead at the same revolutions, and one that does not move drags.
    """
    return Xnn * (n * ca.fabs(n) / nominal**2 - 1)
