"""The page of a vessel's log."""
