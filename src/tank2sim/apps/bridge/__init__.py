"""Sheets for the bridge: wheelhouse poster and pilot card."""
