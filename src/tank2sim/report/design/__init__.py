"""The page of a designed campaign or sea trial."""
