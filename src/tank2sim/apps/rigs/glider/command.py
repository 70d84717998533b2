"""Steady glides, paths and ranges of an underwater glider."""

from __future__ import annotations

from tank2sim.apps.rigs.glider.card import GliderCard
from tank2sim.apps.rigs.glider.result import GlideResult
from tank2sim.apps.rigs.glider.study import GlideQuestion, study_glider
from tank2sim.dynamics.vessel import Vessel

BUNDLED_GLIDER = "kulikovsky-velikanov"
"""Name of the bundled glider."""


def glide_with(ship: Vessel, question: GlideQuestion) -> GlideResult:
    """Steady glides, paths and ranges. Raises as :meth:`.Ship.glide`."""
    card = ship.card
    if not isinstance(card, GliderCard):
        remedy = f"a card of kind glider is needed, such as {BUNDLED_GLIDER}"
        raise card.fault("model.kind", f"is {card.model.kind}", remedy)
    return GlideResult(study_glider(card, question))
