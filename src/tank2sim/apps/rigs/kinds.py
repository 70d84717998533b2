"""Kinds of cards of rigs: towed bodies, underwater gliders, bodies on the yaw rig."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tank2sim.apps.rigs.glider.card import GliderCard, GliderForm
from tank2sim.apps.rigs.tow.card import SurgeBodyCard, SurgeForm
from tank2sim.apps.rigs.yaw.card import YawRigCard, YawRigForm
from tank2sim.cards.kinds import CardKind, si_card

if TYPE_CHECKING:
    from tank2sim.dynamics.model import Model


def _tow_model(card: SurgeBodyCard) -> Model:
    """Surge under the force of the card."""
    from tank2sim.apps.rigs.tow.surge import SurgeCoefficients, surge_model

    surge = card.surge
    coefficients = SurgeCoefficients(
        total_mass_kg=surge.total_mass_kg,
        B1_kgs2pm3=surge.B1_kgs2pm3,
        B2_kgspm2=surge.B2_kgspm2,
        B3_kgpm=surge.B3_kgpm,
    )
    return surge_model(card.ship.name, coefficients, surge.force_N, valid_speed_mps=card.model.valid_speed_mps)


SURGE = CardKind(
    "surge", "a body that only surges, from accelerating tows", SurgeForm, si_card(SurgeBodyCard, "surge"), _tow_model
)


def _glider_model(card: GliderCard) -> Model:
    """Gliding in three dimensions."""
    from tank2sim.apps.rigs.glider.model import glider_model

    return glider_model(card)


GLIDER = CardKind("glider", "an underwater glider", GliderForm, si_card(GliderCard, "glider"), _glider_model)


def _yaw_model(card: YawRigCard) -> Model:
    """A body that a motor turns in a tank."""
    from tank2sim.apps.rigs.yaw.model import yaw_rig_model

    return yaw_rig_model(card.ship.name, card.yaw_rig)


YAW_RIG = CardKind(
    "yaw_rig",
    "a body that a motor turns in a tank",
    YawRigForm,
    si_card(YawRigCard, "yaw_rig"),
    _yaw_model,
    angles=("yaw_rig", "programme"),
)
