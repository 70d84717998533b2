"""What the integration step costs in accuracy: the Mariner at its own step against an eighth of it, and the reference.

The reference trajectories were computed by an independent program (MSS in GNU Octave); their place is ../shared or the
environment variable TANK2SIM_DATA.
"""

from __future__ import annotations

import math
import os
from dataclasses import replace
from pathlib import Path

import numpy as np

from tank2sim.cards import read_card
from tank2sim.dynamics import build
from tank2sim.simulation.manoeuvres import Turn, Zigzag
from tank2sim.simulation.run import simulate

DATA = Path(os.environ.get("TANK2SIM_DATA", Path(__file__).resolve().parents[2] / "shared"))


def main() -> None:
    model = build(read_card("mariner"))
    fine = replace(model, step_s=model.step_s / 8)
    turn, zigzag = Turn(math.radians(35.0)), Zigzag(math.radians(10.0), math.radians(10.0))
    own, finer = (simulate(one, turn, duration_s=600.0).trajectory for one in (model, fine))
    moved = np.hypot(own["motion.x"] - finer["motion.x"][::8], own["motion.y"] - finer["motion.y"][::8])
    print(f"35 deg turn, 600 s: step {model.step_s:g} s against {fine.step_s:g} s: {moved.max():.2e} m apart at most")
    overshoots = [np.array(simulate(one, zigzag, duration_s=600.0).figures["overshoots_deg"]) for one in (model, fine)]
    print(f"10/10 zigzag: overshoots {np.abs(overshoots[0] - overshoots[1]).max():.2e} deg apart at most")
    if not (DATA / "reference").is_dir():
        print(f"no reference trajectories in {DATA}: set TANK2SIM_DATA")
        return
    reference = np.genfromtxt(DATA / "reference" / "mariner_turn_35.csv", delimiter=",", names=True)
    at = np.searchsorted(own.t, reference["t_s"] - 1e-6)
    apart = np.hypot(own["motion.x"][at] - reference["x_m"], own["motion.y"][at] - reference["y_m"])
    print(f"35 deg turn against the reference: {apart.max():.2e} m apart at most (aim: 0.05 m)")
    reference = np.genfromtxt(DATA / "reference" / "mariner_zigzag_10_10.csv", delimiter=",", names=True)
    heading = np.abs(np.degrees(reference["psi_rad"]))
    peak = (heading[1:-1] >= heading[:-2]) & (heading[1:-1] > heading[2:]) & (heading[1:-1] > 10)
    expected = heading[1:-1][peak] - 10
    worst = np.abs(overshoots[0][: len(expected)] - expected).max()
    print(
        f"10/10 zigzag against the reference: {len(expected)} overshoots, {worst:.2e} deg apart at most (aim: 0.02 deg)"
    )


if __name__ == "__main__":
    main()
