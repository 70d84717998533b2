"""Estimators of free-running trials."""
