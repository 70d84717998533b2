"""What effects add forces with: the scales of the prime system, and the sum."""

from __future__ import annotations

import casadi as ca

from tank2sim.cards.card import ManoeuvringCard
from tank2sim.cards.scaling import Scales
from tank2sim.dynamics.model import Model


def scales(model: Model, speed: ca.SX) -> Scales:
    """Scales of the model's ship at a speed (m/s), as expressions."""
    return Scales(model.symbol("ship.water_density"), model.symbol("ship.length"), speed)


def speed_of_scaling(model: Model, card: ManoeuvringCard) -> ca.SX:
    """V with which the card's own coefficients are scaled, m/s: U, or u0 where the card or the linear model says so."""
    fixed = card.model.kind == "linear" or card.model.speed_scale == "nominal"
    return model.symbol("ship.speed" if fixed else "motion.speed")


def with_forces(model: Model, *, X: ca.SX | float = 0.0, Y: ca.SX | float = 0.0, N: ca.SX | float = 0.0) -> Model:
    """The model with X, Y (N) and N (N m) more in ``force.X``, ``force.Y``, ``force.N``."""
    return (
        model.redefine("force.X", lambda force: force + X)
        .redefine("force.Y", lambda force: force + Y)
        .redefine("force.N", lambda moment: moment + N)
    )
