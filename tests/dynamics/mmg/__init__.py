"""Tests of the MMG method."""
