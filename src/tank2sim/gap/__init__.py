"""Differences of simulation and measurement: the missing physical effect named, added, and checked."""
