"""The mesh of a Wigley hull, y = B/2 (1 - (2x/L)^2) (1 - (z/T)^2), as a file in the format of WAMIT."""

from __future__ import annotations

from pathlib import Path

import numpy as np


def write_wigley_gdf(path: Path, length: float, beam: float, draught: float, panels: tuple[int, int]) -> None:
    """Write the wetted hull, y to port, normals into the water; `panels` along and down each side."""
    x = -length / 2 * np.cos(np.linspace(0, np.pi, panels[0] + 1))
    z = -draught * np.cos(np.linspace(0, np.pi / 2, panels[1] + 1))
    points = [
        [(one, beam / 2 * (1 - (2 * one / length) ** 2) * (1 - (deep / draught) ** 2), deep) for deep in z] for one in x
    ]
    lines = ["Wigley", "1.0 9.80665", "0 0", str(2 * panels[0] * panels[1])]
    for side in (1, -1):
        for i in range(panels[0]):
            for j in range(panels[1]):
                corners = [points[i][j], points[i + 1][j], points[i + 1][j + 1], points[i][j + 1]]
                # The same diagonal on both sides, seen from the water in the sense that the format asks for.
                ordered = [corners[0], *corners[:0:-1]] if side == 1 else corners
                lines += [
                    f"{a!r} {side * b!r} {c!r}".replace("np.float64(", "").replace(")", "") for a, b, c in ordered
                ]
    path.write_text("\n".join(lines) + "\n")
