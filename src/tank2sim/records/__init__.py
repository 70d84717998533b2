"""Measurements: trials, captive campaigns, tows."""
