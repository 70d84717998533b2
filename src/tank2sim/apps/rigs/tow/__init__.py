"""Surge mass and drag from accelerating tows (Wilinski and Zellman 1984)."""
