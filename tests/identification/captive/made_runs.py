"""Single captive runs whose forces have known Fourier coefficients; nothing of tank2sim is used."""

from __future__ import annotations

import zlib
from pathlib import Path

import numpy as np

FREQUENCY, RATE, SPEED = 0.7, 0.12, 1.3
COEFFICIENTS = {
    "X_N": {0: (-9.0, 0.0), 1: (0.2, -0.1), 2: (1.5, 0.3)},
    "Y_N": {0: (0.4, 0.0), 1: (25.0, -7.0), 3: (-2.0, 0.5)},
    "N_Nm": {0: (-0.3, 0.0), 1: (-40.0, 22.0), 3: (1.0, 3.0), 5: (0.4, -0.2)},
}
"""Column to order to coefficients of cos(n omega t) and sin(n omega t), where r = RATE cos(omega t)."""


def oscillation(
    folder: Path, name: str = "yaw.csv", noise: float = 0.05, change: float = 0.0, periods: float = 4.3
) -> Path:
    """Write a run of pure yaw; `change` is added to the first cosine of Y. It begins at a phase of 1.1 rad."""
    rng = np.random.default_rng(zlib.crc32(name.encode()))
    t = np.arange(0, periods * 2 * np.pi / FREQUENCY, 0.1)
    phase = FREQUENCY * t + 1.1
    columns = {
        "t_s": t,
        "psi_rad": RATE / FREQUENCY * np.sin(phase),
        "r_radps": RATE * np.cos(phase),
        "speed_mps": np.full(len(t), SPEED),
    }
    for column, orders in COEFFICIENTS.items():
        columns[column] = noise * rng.standard_normal(len(t))
        for order, (cosine, sine) in orders.items():
            more = change if (column, order) == ("Y_N", 1) else 0.0
            columns[column] = columns[column] + (cosine + more) * np.cos(order * phase) + sine * np.sin(order * phase)
    path = folder / name
    rows = np.column_stack(list(columns.values()))
    np.savetxt(path, rows, delimiter=",", header=",".join(columns), comments="", fmt="%.9g")
    return path
