"""A ship without asymmetry."""

from __future__ import annotations

SYMMETRIC = dict.fromkeys(("derivatives.Y0", "derivatives.Y0u", "derivatives.Y0uu"), 0.0) | dict.fromkeys(
    ("derivatives.N0", "derivatives.N0u", "derivatives.N0uu"), 0.0
)
