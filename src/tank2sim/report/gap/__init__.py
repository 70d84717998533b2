"""The page of a gap, and of a fleet."""
