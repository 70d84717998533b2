"""What an FMU says of its ship beside the equations: drawn from the card."""

from __future__ import annotations

from tank2sim.cards.card import Card, ManoeuvringCard
from tank2sim.fmu.export import Documents


def documents_of(card: Card) -> Documents:
    """Source, validity and the card itself, to lie in the FMU."""
    speeds = card.model.speed_range_mps if isinstance(card, ManoeuvringCard) else card.model.valid_speed_mps
    validity = f"The card holds for speeds through the water of {speeds[0]:g} to {speeds[1]:g} m/s." if speeds else ""
    return Documents(card_text=card.text, source=card.ship.source, validity=validity)
