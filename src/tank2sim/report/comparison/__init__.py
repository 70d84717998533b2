"""The page of cards compared."""
