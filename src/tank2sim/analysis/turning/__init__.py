"""Steady turns of a ship: the steering diagram through its folds, spirals, steering characteristics."""
