"""Further printed numbers of paper 1 (Wilinski & Zellman 1984), for the benchmark and the tests."""

from __future__ import annotations

import numpy as np
from numpy.polynomial import Polynomial

from tank2sim.apps.rigs.tow.paper import TABLE_2

SPEED = Polynomial(TABLE_2[2][0])
"""(2.1), whose first coefficient has lost its minus sign in print."""
FORCE_N = 11.63

INNER_PRODUCTS = np.array(
    [
        [0.0006072, 0.0000264, 0.0001971, 0.0015685],
        [0.0000264, 0.0000041, 0.0000276, 0.0001867],
        [0.0001971, 0.0000276, 0.0001867, 0.0012860],
        [0.0015685, 0.0001867, 0.0012860, 0.0090830],
    ]
)
"""b_ij before (2.3)."""
FORCE_PRODUCTS = np.array([2.00615, 0.10564, 0.77341, 5.99223])
"""b_i0 before (2.3)."""

LARGEST_DEVIATION_MPS = 0.014
MASS_BY_THEORY_KG = 2489.0
"""M_s of (2.5)."""
