"""The page of stability."""
