"""A kind of card: a body that drifts under a force, M dv/dt = F - B v |v|."""

from dataclasses import dataclass
from typing import Annotated, Literal

import casadi as ca
from pydantic import Field

from tank2sim.cards.card import Card
from tank2sim.cards.form import BodyModel, BodySection, CardSection, Environment
from tank2sim.cards.kinds import CardKind, si_card
from tank2sim.dynamics.model import Input, Model, Parameter, Quantity, State


class DriftModel(BodyModel):
    """``[model]``."""

    kind: Literal["drifter"]


class Drift(CardSection):
    """``[drifter]``: mass with added mass (kg) and drag coefficient (kg/m)."""

    mass_kg: Annotated[float, Field(gt=0)]
    drag_kgpm: Annotated[float, Field(gt=0)]


class DriftForm(CardSection):
    """The card as in its file: sections, keys, bounds."""

    format: Literal["tank2sim-ship/1"]
    ship: BodySection
    environment: Environment = Environment()
    model: DriftModel
    drifter: Drift


@dataclass(frozen=True)
class DriftCard(Card):
    """The card: fields are called as the sections."""

    model: DriftModel
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


DRIFTER = CardKind("drifter", "a body that drifts under a force", DriftForm, si_card(DriftCard, "drifter"), drift_model)
