"""Printed numbers of paper 1 (Wilinski & Zellman 1984), for comparison with its data."""

from __future__ import annotations

import numpy as np
from numpy.polynomial import Polynomial

from tank2sim.apps.rigs.tow.records import Tows
from tank2sim.apps.rigs.tow.surge import SurgeCoefficients

TIMES_S = np.arange(0, 51, 5.0)
MEANS_MPS = np.array([0, 0.0148, 0.0282, 0.0536, 0.074, 0.095, 0.11, 0.1224, 0.1408, 0.1524, 0.169])
"""Mean speeds of Table 1 as printed; that at 5 s is a misprint, the five readings give 0.0142."""

TABLE_2: tuple[tuple[tuple[float, ...], float], ...] = (
    ((0.0878,), 0.0549),
    ((0.00134, 0.0035), 0.0050),
    ((-0.00493, 0.0043, -0.000017), 0.0034),
    ((-0.0021, 0.0034, 0.00003, -0.000001), 0.0028),
)
"""Coefficients in rising powers of t and error of the speed polynomials, by degree."""

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

SOLUTION = SurgeCoefficients(total_mass_kg=2550.0, B1_kgs2pm3=92418.0, B2_kgspm2=-26096.0, B3_kgpm=2015.0)
"""(2.4), which is not the solution of (1.12) with the printed products; (2.3) has lost the minus sign of B2."""
LARGEST_DEVIATION_MPS = 0.014
MASS_BY_THEORY_KG = 2489.0
"""M_s of (2.5)."""


def are_of_the_paper(tows: Tows) -> bool:
    """True if these are the tows of Table 1."""
    same_times = len(tows.time_s) == len(TIMES_S) and np.allclose(tows.time_s, TIMES_S)
    # All means but the misprinted one, which Table 1 rounds to four digits.
    return bool(same_times and np.allclose(np.delete(tows.mean_speed_mps - MEANS_MPS, 1), 0, atol=6e-5))
