"""Tuning a card to measured figures or to a standard."""
