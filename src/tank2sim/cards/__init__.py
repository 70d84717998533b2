"""The ship's card: read with precise errors, converted once, written back without loss."""

from tank2sim.cards.card import Card, CraftCard, ManoeuvringCard, SteeredBy, SteeredCard
from tank2sim.cards.reading import find_card, linear_card, parse_card, read_card, revised

__all__ = [
    "Card",
    "CraftCard",
    "ManoeuvringCard",
    "SteeredBy",
    "SteeredCard",
    "find_card",
    "linear_card",
    "parse_card",
    "read_card",
    "revised",
]
