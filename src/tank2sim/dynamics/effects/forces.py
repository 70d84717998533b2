"""Adding forces of effects: the scales of the prime system, and the sum."""

from __future__ import annotations

from collections.abc import Mapping

import casadi as ca

from tank2sim.cards.card import SteeredCard
from tank2sim.cards.scaling import Scales
from tank2sim.dynamics.hull import validity_factor
from tank2sim.dynamics.model import Model


def scales(model: Model, speed: ca.SX) -> Scales:
    """Scales of the model's ship at a speed (m/s), as expressions."""
    return Scales(model.symbol("ship.water_density"), model.symbol("ship.length"), speed)


def speed_of_scaling(model: Model, card: SteeredCard) -> ca.SX:
    """V with which the card's own coefficients are scaled, m/s: U, or u0 where the card or the linear model says so."""
    fixed = card.model.kind == "linear" or card.manoeuvring().model.speed_scale == "nominal"
    return model.symbol("ship.speed" if fixed else "motion.speed")


def with_forces(model: Model, *, X: ca.SX | float = 0.0, Y: ca.SX | float = 0.0, N: ca.SX | float = 0.0) -> Model:
    """The model with X, Y (N) and N (N m) more in ``force.X``, ``force.Y``, ``force.N``."""
    return (
        model.redefine("force.X", lambda force: force + X)
        .redefine("force.Y", lambda force: force + Y)
        .redefine("force.N", lambda moment: moment + N)
    )


def with_validity(model: Model, name: str, cause: str, value: ca.SX) -> Model:
    """The model with one more factor of ``validity``, the output of :func:`.validity_factor`."""
    factor = validity_factor(name, cause, value)
    extended = model.extend(factor, outputs=[factor.name])
    return extended.redefine("validity", lambda validity: validity * factor.symbol)


def with_side_force(model: Model, given: Mapping[str, ca.SX], force: ca.SX) -> Model:
    """The model with Y' = ``given["Y"]`` and N' = ``given["N"]`` (prime) times `force` (N), and L for the moment."""
    return with_forces(model, Y=force * given["Y"], N=force * model.symbol("ship.length") * given["N"])
