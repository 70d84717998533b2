"""The page of a glider."""
