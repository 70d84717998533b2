"""A filter of random slopes and levels, and random columns for it."""

from __future__ import annotations

import numpy as np

from tank2sim.gap.inference.kalman_filter import Linear, NoiseLevels, linear_filter

RUNS, BLOCKS, NY, BLOCK_S = 2, 6, 4, 2.0


def problem(seed: int, *, gaps: bool = True) -> tuple[Linear, NoiseLevels, np.random.Generator]:
    """Random slopes and levels of order one, a fifth of the measurements missing, one instant without any."""
    rng = np.random.default_rng(seed)
    known = rng.random((RUNS, BLOCKS, NY)) > 0.2 if gaps else np.ones((RUNS, BLOCKS, NY), dtype=bool)
    if gaps:
        known[0, 3] = False
        known[1, BLOCKS - 2 :] = False  # a run that is shorter
    by_state = 0.2 * rng.standard_normal((RUNS, BLOCKS - 1, 6, 6))
    reading = rng.standard_normal((RUNS, BLOCKS, NY, 6))
    what = linear_filter(by_state, reading, known, BLOCK_S, rng.uniform(0.5, 2.0, 6), np.array([0.4, 2.5]))
    sizes = [rng.uniform(0.3, 1.5, count) for count in (NY, NY, 3)]
    times = [rng.uniform(1.0, 20.0, count) for count in (NY, 3)]
    return what, NoiseLevels(sizes[0], sizes[1], times[0], sizes[2], times[1]), rng


def columns(what: Linear, rng: np.random.Generator, count: int = 1) -> tuple[np.ndarray, np.ndarray]:
    driving = rng.standard_normal((RUNS, BLOCKS - 1, 6, count))
    shown = 3 * rng.standard_normal((RUNS, BLOCKS, NY, count))
    return driving, np.where(what.known[..., None], shown, np.nan)
