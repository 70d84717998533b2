"""The page of a guessed ship."""
