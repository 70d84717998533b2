"""What is known of a ship: its card, read with precise errors, converted once, written back without loss."""

from tank2sim.cards.card import Card, CraftCard, GliderCard, ManoeuvringCard, SteeredCard, SurgeBodyCard, YawRigCard
from tank2sim.cards.reading import find_card, linear_card, parse_card, read_card, revised

__all__ = [
    "Card",
    "CraftCard",
    "GliderCard",
    "ManoeuvringCard",
    "SteeredCard",
    "SurgeBodyCard",
    "YawRigCard",
    "find_card",
    "linear_card",
    "parse_card",
    "read_card",
    "revised",
]
