"""What an FMU says of its ship next to the equations: drawn from the card."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from tank2sim.cards.card import Card, CraftCard, ManoeuvringCard
from tank2sim.fmu.provenance import ValueOrigin, origins


@dataclass(frozen=True, kw_only=True)
class Documents:
    """What an FMU says of its ship next to the equations.

    Parameters
    ----------
    card_text : str, optional
        The ship card, kept in the FMU as ``resources/ship.toml``.
    source : str
        Where the data come from, in a sentence.
    validity : str
        Where the model holds, in a sentence.
    speed_range_mps : pair of float, optional
        Speeds through the water at which the model holds.
    origins : mapping
        Parameter or input of the model to where its value comes from.
    """

    card_text: str | None = None
    source: str = ""
    validity: str = ""
    speed_range_mps: tuple[float, float] | None = None
    origins: Mapping[str, ValueOrigin] = field(default_factory=dict)


def documents_without_card(card: Card) -> Documents:
    """Validity alone: neither the card, nor where its numbers come from."""
    documents = documents_of(card)
    return Documents(validity=documents.validity, speed_range_mps=documents.speed_range_mps)


def documents_of(card: Card) -> Documents:
    """Source, validity, the origin of every coefficient and the card itself, to lie in the FMU."""
    speeds = card.model.speed_range_mps if isinstance(card, ManoeuvringCard | CraftCard) else card.model.valid_speed_mps
    validity = f"The card holds for speeds through the water of {speeds[0]:g} to {speeds[1]:g} m/s." if speeds else ""
    if isinstance(card, ManoeuvringCard) and card.propulsion is None:
        validity += (
            " It states no propulsion: the ship holds its revolutions at every speed, so that it leaves rest by "
            "itself and cannot be stopped."
        )
    return Documents(
        card_text=card.text,
        source=card.ship.source,
        validity=validity,
        speed_range_mps=speeds,
        origins=origins(card),
    )
