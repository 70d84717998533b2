"""The page of measured signals."""
