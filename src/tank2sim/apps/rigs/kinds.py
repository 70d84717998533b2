"""Kinds of cards of rigs: towed bodies, underwater gliders, bodies on the yaw rig."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from tank2sim.apps.rigs.glider.card import GliderCard
from tank2sim.apps.rigs.yaw.card import YawRigCard
from tank2sim.cards.card import Card
from tank2sim.cards.form import CardSection, Uncertainty
from tank2sim.cards.kinds import body_kind
from tank2sim.quantities import Mass

if TYPE_CHECKING:
    from tank2sim.dynamics.model import Model


class Surge(CardSection):
    """``[surge]``: coefficients of (1.5), M dv/dt + B1 v^4 + B2 v^3 + B3 v^2 = T."""

    total_mass_kg: Mass
    B1_kgs2pm3: float = 0.0
    B2_kgspm2: float = 0.0
    B3_kgpm: float
    force_N: float = 0.0
    dry_mass_kg: Mass | None = None


@dataclass(frozen=True)
class SurgeBodyCard(Card):
    """Card of a body that only surges: (1.5) of paper 1, SI."""

    surge: Surge
    uncertainty: Uncertainty = field(default_factory=dict)


def _tow_model(card: SurgeBodyCard) -> Model:
    """Surge under the force of the card."""
    from tank2sim.apps.rigs.tow.surge import SurgeCoefficients, surge_model

    coefficients = SurgeCoefficients(**card.surge.model_dump(exclude={"force_N", "dry_mass_kg"}))
    return surge_model(card.ship.name, coefficients, card.surge.force_N, valid_speed_mps=card.model.valid_speed_mps)


SURGE = body_kind("surge", "a body that only surges, from accelerating tows", SurgeBodyCard, _tow_model)


def _glider_model(card: GliderCard) -> Model:
    """Gliding in three dimensions."""
    from tank2sim.apps.rigs.glider.model import glider_model

    return glider_model(card)


GLIDER = body_kind("glider", "an underwater glider", GliderCard, _glider_model)


def _yaw_model(card: YawRigCard) -> Model:
    """A body that a motor turns in a tank."""
    from tank2sim.apps.rigs.yaw.model import yaw_rig_model

    return yaw_rig_model(card.ship.name, card.yaw_rig)


YAW_RIG = body_kind(
    "yaw_rig", "a body that a motor turns in a tank", YawRigCard, _yaw_model, angles=("yaw_rig", "programme")
)
