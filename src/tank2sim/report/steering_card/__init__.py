"""The page of a steering card."""
