"""A kind of card: a body that drifts under a force, M dv/dt = F - B v |v|."""

from dataclasses import dataclass
from typing import Annotated

import casadi as ca
from pydantic import Field

from tank2sim.cards.card import Card
from tank2sim.cards.form import CardSection
from tank2sim.cards.kinds import body_kind
from tank2sim.dynamics.model import Input, Model, Parameter, Quantity, State


class Drift(CardSection):
    """``[drifter]``: mass with added mass (kg) and drag coefficient (kg/m)."""

    mass_kg: Annotated[float, Field(gt=0)]
    drag_kgpm: Annotated[float, Field(gt=0)]


@dataclass(frozen=True)
class DriftCard(Card):
    """The card: its fields are sections of the file."""

    drifter: Drift


def drift_model(card):
    """The equation of motion, SI: state v, input F, parameters M and B."""
    mass = Parameter(name="drifter.mass", unit="kg", start=card.drifter.mass_kg, description="Mass and added mass")
    drag = Parameter(name="drifter.drag", unit="kg/m", start=card.drifter.drag_kgpm, description="Drag coefficient")
    force = Input(name="drift.force", unit="N", start=0.0, description="Force, + forward")
    speed = State(
        name="motion.u", unit="m/s", derivative="motion.udot", start=0.0, description="Speed through the water"
    )
    drag_force = drag.symbol * speed.symbol * ca.fabs(speed.symbol)
    acceleration = Quantity(
        name="motion.udot",
        unit="m/s2",
        description="Acceleration, + forward",
        value=(force.symbol - drag_force) / mass.symbol,
    )
    return Model(
        name=card.ship.name,
        description="A body that drifts under a force",
        states=(speed,),
        inputs=(force,),
        parameters=(mass, drag),
        quantities=(acceleration,),
        outputs=(speed.name, acceleration.name),
        step_s=0.1,
    )


DRIFTER = body_kind("drifter", "a body that drifts under a force", DriftCard, drift_model)
