"""Squat of an 8000 TEU container ship's model in mid-tank: measured, by ICORELS and by Barrass.

Needs the data folder (Lataire, Vantorre and Eloot 2009). Its tables give no length between perpendiculars: 0.945 of the
length over all is taken, as of container ships of that size.
"""

from __future__ import annotations

import csv
import os
import sys
from pathlib import Path

import casadi as ca
import numpy as np

import tank2sim as t2s

DATA = Path(os.environ.get("TANK2SIM_DATA", Path(__file__).resolve().parents[1] / ".." / "shared")) / "data"
LENGTH_M, BEAM_M, DRAUGHT_M, DEPTH_M, BLOCK = 0.945 * 4.332, 0.530, 0.180, 0.243, 0.66


def squats(speeds_mps: list[float]) -> np.ndarray:
    """Largest sinkage (n, 2) by ICORELS and by Barrass, m, from the effect of a card with the model's sizes."""
    ship = t2s.load("mariner").replace(
        {
            "ship.length_m": LENGTH_M,
            "ship.beam_m": BEAM_M,
            "ship.draught_m": DRAUGHT_M,
            "ship.block_coefficient": BLOCK,
            "effects": [{"name": "finite_depth", "parameters": {"depth_m": DEPTH_M}}],
        }
    )
    model = ship.model
    names = ("squat.icorels", "squat.barrass")
    values = ca.Function(
        "squats", [model.x, model.u, model.p], [model.expand(ca.vcat([model.symbol(name) for name in names]))]
    )
    found = []
    for speed in speeds_mps:
        x = np.zeros(len(model.states))
        x[model.state_names.index("motion.u")] = speed
        found.append(np.array(values(x, model.input_values(), model.parameter_values())).ravel())
    return np.array(found)


def main() -> None:
    """Print measured and calculated squat at each speed."""
    path = DATA / "bank_effects" / "subset1_squat.csv"
    if not path.is_file():
        sys.exit(f"needs {path} (set TANK2SIM_DATA)")
    with path.open() as file:
        rows = [row for row in csv.DictReader(file) if float(row["y0_m"]) == 0.0]
    for row, (icorels, barrass) in zip(rows, squats([float(row["u_mps"]) for row in rows]), strict=True):
        measured = max(float(row["sinkage_fore_mm"]), float(row["sinkage_aft_mm"])) / 1000
        froude = float(row["u_mps"]) / np.sqrt(9.80665 * DEPTH_M)
        print(
            f"{float(row['u_mps']):.3f} m/s (Fr_h {froude:.2f}): measured {1e3 * measured:.1f} mm, ICORELS "
            f"{100 * (icorels / measured - 1):+.0f} %, Barrass {100 * (barrass / measured - 1):+.0f} %"
        )


if __name__ == "__main__":
    main()
