"""The page of influence coefficients."""
