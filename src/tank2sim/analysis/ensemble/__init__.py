"""Ensembles of ships drawn within the errors of a card: their figures, tracks and verdicts."""
