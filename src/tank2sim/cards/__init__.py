"""What is known of a ship: its card, read with precise errors, converted once, written back without loss."""

from tank2sim.cards.card import Card, ManoeuvringCard, SurgeBodyCard
from tank2sim.cards.reading import find_card, linear, parse_card, read_card, revised

__all__ = ["Card", "ManoeuvringCard", "SurgeBodyCard", "find_card", "linear", "parse_card", "read_card", "revised"]
