"""The page of an autopilot."""
