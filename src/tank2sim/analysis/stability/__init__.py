"""Straight-line stability, manoeuvrability and the IMO criteria of a ship."""
