"""The KVLCC2 in the MMG standard method: figures next to the same equations integrated elsewhere, shipmmg, and MARIN.

The references are trajectories of an integration of the method's equations elsewhere (SciPy DOP853, rtol 1e-10) and of
shipmmg 0.0.11, which has another wake law; measured figures are those of MARIN's free-running model (1:45.714). Next to
them are the third-order polynomial that ``tank2sim convert`` fits to the ship, and the ship at full scale.
"""

from __future__ import annotations

import csv
import os
import time
from pathlib import Path

import numpy as np

import tank2sim as t2s

REFERENCE = Path(os.environ.get("TANK2SIM_DATA", Path(__file__).resolve().parents[2] / "shared")) / "reference"

MARIN = {
    "35 deg to starboard": {"advance": 3.08, "tactical diameter": 3.34},
    "35 deg to port": {"advance": 3.01, "tactical diameter": 3.07},
    "10/10 to starboard": {"overshoot 1": 8.2, "overshoot 2": 21.9},
    "10/10 to port": {"overshoot 1": 9.5, "overshoot 2": 15.0},
    "20/20 to starboard": {"overshoot 1": 13.7, "overshoot 2": 14.9},
    "20/20 to port": {"overshoot 1": 15.1, "overshoot 2": 13.3},
}
"""Measured at MARIN, evaluated from the records of SIMMAN 2008: lengths, the advance from the rudder's first movement,
and deg."""

_FILES = {
    "35 deg to starboard": "turn_35_stbd",
    "35 deg to port": "turn_35_port",
    "10/10 to starboard": "zigzag_10_10_stbd",
    "10/10 to port": "zigzag_10_10_port",
    "20/20 to starboard": "zigzag_20_20_stbd",
    "20/20 to port": "zigzag_20_20_port",
}


def reference_figures(program: str, manoeuvre: str, length: float) -> dict[str, float]:
    """Figures of a reference trajectory: lengths and deg; empty where the file is missing."""
    path = REFERENCE / f"kvlcc2_l7_{program}_{_FILES[manoeuvre]}.csv"
    if not path.is_file():
        return {}
    lines = path.read_text(encoding="utf-8").splitlines()
    if "/" in manoeuvre:
        stated = next(line for line in lines if "overshoots_deg in order:" in line).partition("order:")[2].split(",")
        return {f"overshoot {number}": float(stated[number - 1]) for number in (1, 2)}
    rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    psi, x, y = (np.abs([float(row[key]) for row in rows]) for key in ("psi_deg", "x_m", "y_m"))
    return {
        "advance": float(np.interp(90, psi, x)) / length,
        "tactical diameter": float(np.interp(180, psi, y)) / length,
    }


def simulated_figures(ship: t2s.Ship, manoeuvre: str) -> dict[str, float]:
    """The same figures of a ship."""
    side = -1 if "port" in manoeuvre else 1
    if "/" in manoeuvre:
        angle = float(manoeuvre.partition("/")[0])
        found = ship.zigzag(side * angle, angle).figures
        return {f"overshoot {number}": float(found[f"overshoot_{number}_deg"]) for number in (1, 2)}  # type: ignore[arg-type]
    found = ship.turn(35 * side).figures
    return {
        "advance": float(found["advance_lengths"]),  # type: ignore[arg-type]
        "tactical diameter": float(found["tactical_diameter_lengths"]),  # type: ignore[arg-type]
    }


def main() -> None:
    """Print a row for each figure."""
    model, ship = t2s.load("kvlcc2-l7-mmg"), t2s.load("kvlcc2-mmg")
    began = time.perf_counter()
    fitted = t2s.convert(model).ship
    seconds = time.perf_counter() - began
    print(
        f"{'manoeuvre':20s} {'figure':18s} {'tank2sim':>9s} {'elsewhere':>9s} {'shipmmg':>9s} {'polynomial':>10s} "
        f"{'full scale':>10s} {'measured':>9s}"
    )
    worst = {"lengths": 0.0, "deg": 0.0}
    for manoeuvre, measured in MARIN.items():
        columns = [
            simulated_figures(model, manoeuvre),
            reference_figures("paper", manoeuvre, 7.0),
            reference_figures("shipmmg", manoeuvre, 7.0),
            simulated_figures(fitted, manoeuvre),
            simulated_figures(ship, manoeuvre),
            measured,
        ]
        for figure in measured:
            values = [column.get(figure, float("nan")) for column in columns]
            widths = (9, 9, 9, 10, 10, 9)
            texts = " ".join(f"{value:{width}.3f}" for value, width in zip(values, widths, strict=True))
            print(f"{manoeuvre:20s} {figure:18s} {texts}")
            unit = "deg" if figure.startswith("overshoot") else "lengths"
            error = abs(values[0] - values[1]) / (1.0 if unit == "deg" else values[1])
            worst[unit] = max(worst[unit], error)
    print(
        f"largest difference from the same equations elsewhere: {100 * worst['lengths']:.4f} %, {worst['deg']:.4f} deg"
    )
    print(f"fit of the polynomial with its manoeuvres: {seconds:.1f} s")


if __name__ == "__main__":
    main()
