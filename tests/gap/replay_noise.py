"""Noise of the replayed trials."""

from __future__ import annotations

import numpy as np

NOISE = {
    **{"motion.u": 0.01, "motion.v": 0.01, "motion.r": np.radians(0.02), "motion.psi": np.radians(0.05)},
    **{"motion.x": 0.3, "motion.y": 0.3},
}
