"""A made-up sea trial whose truth is known: turns and zigzags to both sides of a Mariner in ballast, in a current.

``python docs/examples/make_sea_trial.py trial`` writes six records and the notes of the master. The yaw damping of
the ship is 5 % larger than on the bundled card. Nothing here was measured.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from make_trials import record

import tank2sim as t2s
from tank2sim.cards import parse_card

DRAUGHT_M, TRIM_M = 5.5, 0.8
EFFECTS = f"""
[[effects]]
name = "loading"
parameters = {{ mean_draught_m = {DRAUGHT_M}, trim_m = {TRIM_M} }}

[[effects]]
name = "current"
parameters = {{ speed_mps = 0.5, direction_deg = 60.0 }}
"""
NOTES = f"""\
format = "tank2sim-trials/1"
place = "off a made-up coast"
date = "2026-05-04"
draught_fore_m = {DRAUGHT_M - TRIM_M / 2}
draught_aft_m = {DRAUGHT_M + TRIM_M / 2}
depth_m = 80.0
sea_state = 2
speed_85_mcr_mps = 7.9
engine_untouched = true

[form]
ship_type = "dry cargo"
"""
APPROACH_S, REVERSALS = 150.0, 5


def orders(kind: str, side: float, ship: t2s.Ship, neutral_deg: float) -> tuple[dict[str, list[float]], float]:
    """Orders of the rudder over time, and the duration: the approach, then a turn, or a zigzag of five reversals."""
    angle = 35.0 if kind == "turn" else float(kind)
    given = {"t_s": [0.0, APPROACH_S], "delta_order_deg": [neutral_deg, angle * side]}
    if kind == "turn":
        return given, APPROACH_S + 1000.0
    for _ in range(REVERSALS):
        run = ship.steer(given, duration_s=given["t_s"][-1] + 100.0).df
        course_deg = np.interp(APPROACH_S, run["t_s"], run["psi_deg"])
        swung = np.sign(given["delta_order_deg"][-1]) * (run["psi_deg"] - course_deg)
        reached = run["t_s"][(run["t_s"] > given["t_s"][-1]) & (swung >= angle)]
        given["t_s"].append(float(reached.iloc[0]))
        given["delta_order_deg"].append(-given["delta_order_deg"][-1])
    return given, given["t_s"][-1] + 60.0


def main(folder: Path) -> None:
    """Write the six records and the notes."""
    card = t2s.load("mariner").replace({"derivatives.Nr": -174e-5}).card
    ship = t2s.Ship(parse_card(card.text + EFFECTS, "made up"))
    neutral_deg = ship.stability(spirals=False).study.operating_point.rudder_deg
    folder.mkdir(parents=True, exist_ok=True)
    chance = np.random.default_rng(3)
    for kind in ("turn", "10", "20"):
        for name, side in (("starboard", 1.0), ("port", -1.0)):
            given, duration_s = orders(kind, side, ship, neutral_deg)
            text = record(ship.steer(given, duration_s=duration_s).to_csv(), chance)
            stem = kind if kind == "turn" else f"zigzag{kind}"
            (folder / f"{stem}_{name}.csv").write_text(text, encoding="utf-8")
    (folder / "notes.toml").write_text(NOTES, encoding="utf-8")
    print(f"{folder}: six records and notes.toml, made up")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
