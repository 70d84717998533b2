"""Influence coefficients: how much each number on a card moves a manoeuvring figure."""
