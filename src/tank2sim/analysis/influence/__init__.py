"""Influence coefficients: effect of each number on a card on a manoeuvring figure."""
