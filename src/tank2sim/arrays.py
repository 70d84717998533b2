"""Aliases of array types: the docstring of what takes or returns them states the shape."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""Real numbers, of any shape."""

Mask = NDArray[np.bool_]
"""Truth values, of any shape."""
