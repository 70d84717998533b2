"""Validation of a card, comparison with other cards, and data for the bridge."""
