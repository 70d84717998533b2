"""Steady captive tests with thrust and rudder normal force, reduced to a ship by the MMG method."""
