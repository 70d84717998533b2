"""Positions that nobody measured, from the velocities."""

from __future__ import annotations

import numpy as np
import pytest

from tank2sim.identification.trials.methods.weak_form import _complete_positions

T = np.arange(0.0, 20.0, 0.1)
KNOWN = 1000.0 + 0 * T


def columns() -> dict[str, np.ndarray]:
    """5 m/s ahead and 1 m/s to port on a course of 30 deg."""
    return {
        "motion.u": 5.0 + 0 * T,
        "motion.v": -1.0 + 0 * T,
        "motion.psi": np.radians(30) + 0 * T,
        "motion.x": KNOWN,
        "motion.y": KNOWN,
    }


@pytest.mark.parametrize("missing", [set(), {"motion.x"}, {"motion.y"}, {"motion.x", "motion.y"}])
def test_a_position_that_was_measured_stays_and_one_that_was_not_is_reckoned(missing: set[str]) -> None:
    found = columns()
    _complete_positions(found, missing, 0.1)
    north, east = (5 * np.sqrt(3) / 2 + 1 * 0.5) * T, (5 * 0.5 - 1 * np.sqrt(3) / 2) * T
    for name, reckoned in (("motion.x", north), ("motion.y", east)):
        np.testing.assert_allclose(found[name], reckoned if name in missing else KNOWN, atol=1e-9)
