"""Printed numbers of paper 1 (Wilinski & Zellman 1984), for comparison with its data."""

from __future__ import annotations

import numpy as np

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

SOLUTION = SurgeCoefficients(total_mass_kg=2550.0, B1_kgs2pm3=92418.0, B2_kgspm2=-26096.0, B3_kgpm=2015.0)
"""(2.4), which is not the solution of (1.12) with the printed products; (2.3) has lost the minus sign of B2."""


def are_of_the_paper(tows: Tows) -> bool:
    """True if these are the tows of Table 1."""
    same_times = len(tows.time_s) == len(TIMES_S) and np.allclose(tows.time_s, TIMES_S)
    # All means but the misprinted one, which Table 1 rounds to four digits.
    return bool(same_times and np.allclose(np.delete(tows.mean_speed_mps - MEANS_MPS, 1), 0, atol=6e-5))
