"""A made-up log of a bridge, as CSV: a Mariner leaves straight, steers a zigzag and a turn; nothing was measured.

``python docs/examples/make_log.py voyage.csv`` writes date and local time, position, speed and course over ground,
heading, rate of turn, the rudder (positive to port) and revolutions, with semicolons, decimal commas and the noise of
instruments, each second.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pandas as pd

import tank2sim as t2s

ORDERS = {"t_s": [0, 60, 95, 175, 255, 330, 450, 750], "delta_order_deg": [0, 20, -20, 20, -20, 0, 35, 0]}
BEGIN = pd.Timestamp("2024-05-06 23:55:00")  # of local time, two hours before UTC
LATITUDE, LONGITUDE, METRES = 54.4, 10.3, 111_200.0


def main(path: Path) -> None:
    """Simulate the voyage and write what the bridge would have recorded of it."""
    run = t2s.load("mariner").steer(ORDERS, duration_s=840.0).df.iloc[::10]
    chance = np.random.default_rng(4)

    def noisy(values: pd.Series, sigma: float, digits: int) -> list[str]:
        return [f"{value:.{digits}f}".replace(".", ",") for value in values + chance.normal(0, sigma, len(values))]

    psi = np.radians(run["psi_deg"])
    north = run["u_mps"] * np.cos(psi) - run["v_mps"] * np.sin(psi)
    east = run["u_mps"] * np.sin(psi) + run["v_mps"] * np.cos(psi)
    moments = [BEGIN + pd.Timedelta(seconds=t) for t in run["t_s"]]
    table = pd.DataFrame(
        {
            "Datum": [moment.strftime("%d.%m.%Y") for moment in moments],
            "Uhrzeit (MESZ)": [moment.strftime("%H:%M:%S") for moment in moments],
            "Breite": noisy(LATITUDE + run["x_m"] / METRES, 5e-6, 6),
            "Länge": noisy(LONGITUDE + run["y_m"] / METRES / np.cos(np.radians(LATITUDE)), 5e-6, 6),
            "Fahrt ü. Grund [kn]": noisy(np.hypot(north, east) * 3600 / 1852, 0.05, 2),
            "Kurs ü. Grund": noisy(np.degrees(np.arctan2(east, north)) % 360, 0.5, 1),
            "Steuerkurs": noisy(run["psi_deg"] % 360, 0.1, 1),
            "Drehgeschw. [°/min]": noisy(run["r_degps"] * 60, 1.0, 1),
            "Ruderlage (Bb +)": noisy(-run["delta_deg"], 0.2, 1),
            "Wellendrehzahl": noisy(0 * run["t_s"] + 84, 0.3, 1),
        }
    )
    path.write_text(table.to_csv(index=False, sep=";"), encoding="cp1252")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
