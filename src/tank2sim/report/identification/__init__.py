"""The page of an identification."""
