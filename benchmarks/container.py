"""The container ship of Son and Nomoto, with roll, against MSS: 600 s of turns and zigzags, at every recorded instant.

The references are runs of container.m of MSS (MIT licence) in GNU Octave with the same coefficients, at 80 rpm from
8 m/s. Figures of the same runs, and of the polynomial that ``tank2sim convert`` fits to the ship, are next to them.
"""

from __future__ import annotations

import csv
import math
import os
import sys
from pathlib import Path

import numpy as np

import tank2sim as t2s
from tank2sim.dynamics import build
from tank2sim.simulation.manoeuvres import Manoeuvre, Turn, Zigzag
from tank2sim.simulation.run import simulate

REFERENCE = Path(os.environ.get("TANK2SIM_DATA", Path(__file__).resolve().parents[2] / "shared")) / "reference"

RUNS: dict[str, Manoeuvre] = {
    "turn_35_stbd": Turn(math.radians(35)),
    "turn_35_port": Turn(-math.radians(35)),
    "zigzag_10_10": Zigzag(math.radians(10), math.radians(10)),
    "zigzag_20_20": Zigzag(math.radians(20), math.radians(20)),
}
DURATION_S = 600.0
SHAFT_RADPS = 80 * 2 * math.pi / 60


def main() -> None:
    """Print the largest differences of each run, and its figures."""
    if not REFERENCE.is_dir():
        sys.exit(f"{REFERENCE} is missing; TANK2SIM_DATA names its parent")
    ship = t2s.load("container")
    fitted = t2s.convert(ship).ship
    models = {"tank2sim": build(ship.manoeuvring()), "polynomial": build(fitted.manoeuvring())}
    begin = {"initial.u": 8.0, "initial.trim": 0.0}
    worst = {"phi": 0.0, "psi": 0.0, "x": 0.0, "y": 0.0}
    print(f"{'run':14s} {'heel (deg)':>12s} {'heading (deg)':>14s} {'x (m)':>9s} {'y (m)':>9s}")
    largest_heel = {}
    for name, manoeuvre in RUNS.items():
        lines = (REFERENCE / f"container_{name}.csv").read_text(encoding="utf-8").splitlines()
        rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
        measured = {key: np.array([float(row[key]) for row in rows]) for key in rows[0]}
        t = measured["t_s"][measured["t_s"] <= DURATION_S]
        heels = [float(np.abs(measured["phi_deg"][: len(t)]).max())]
        for label, model in models.items():
            run = simulate(
                model, manoeuvre, duration_s=DURATION_S, inputs={"propeller.speed": SHAFT_RADPS}, parameters=begin
            ).trajectory
            heels.append(math.degrees(float(np.abs(run["motion.phi"]).max())))
            if label == "polynomial":
                continue
            found = {}
            for state, unit in (("phi", "deg"), ("psi", "deg"), ("x", "m"), ("y", "m")):
                values = np.array([run.at(f"motion.{state}", time) for time in t])
                values = np.degrees(values) if unit == "deg" else values
                found[state] = float(np.abs(values - measured[f"{state}_{unit}"][: len(t)]).max())
                worst[state] = max(worst[state], found[state])
            print(f"{name:14s} {found['phi']:12.5f} {found['psi']:14.5f} {found['x']:9.4f} {found['y']:9.4f}")
        largest_heel[name] = heels
    print("largest heel (deg): MSS, tank2sim, polynomial")
    for name, heels in largest_heel.items():
        print(f"{name:14s} {heels[0]:8.3f} {heels[1]:8.3f} {heels[2]:8.3f}")
    distance = math.hypot(worst["x"], worst["y"])
    print(f"largest: heel {worst['phi']:.4f} deg, heading {worst['psi']:.4f} deg, position {distance:.4f} m")


if __name__ == "__main__":
    main()
