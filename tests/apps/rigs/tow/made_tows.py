"""Tows that are made up."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tank2sim.apps.rigs.tow.records import Tows


def tows_of(times: np.ndarray, speeds: np.ndarray, name: str = "made.csv") -> Tows:
    """Tows with these speeds (times,) or (times, tows)."""
    table = np.asarray(speeds, dtype=float).reshape(len(times), -1)
    names = tuple(f"speed_{number}_mps" for number in range(1, table.shape[1] + 1))
    return Tows(Path(name), names, np.asarray(times, dtype=float), table)
