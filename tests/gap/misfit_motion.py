"""A motion with a misfit in a known place."""

from __future__ import annotations

import numpy as np

from tank2sim.gap.result import Passed

TIME = np.arange(0.0, 400.0, 0.5)


NOISE = {"motion.u": 0.03, "motion.v": 0.03, "motion.r": 3e-4, "motion.psi": 2e-3, "motion.x": 0.6, "motion.y": 0.6}


def motion(*, bias: float = 0.0, current: float = 0.0, seed: int = 1, name: str = "turn") -> Passed:
    """A steady turn with drift and what sensors make of it; the model has it without faults."""
    r, u, v = 0.025, 5.0, -0.8
    psi = r * TIME
    true = {
        **{"motion.u": np.full_like(TIME, u), "motion.v": np.full_like(TIME, v), "motion.r": np.full_like(TIME, r)},
        "motion.psi": psi,
        "motion.x": (u * np.sin(psi) + v * np.cos(psi)) / r,
        "motion.y": (v * np.sin(psi) - u * np.cos(psi)) / r,
    }
    rng = np.random.default_rng(seed)
    measured = {key: values + NOISE[key] * rng.standard_normal(len(TIME)) for key, values in true.items()}
    measured["motion.r"] += bias
    measured["motion.x"] += current * TIME
    return Passed(name, False, TIME, NOISE, measured, true, true)
