"""The page of tows."""
