"""Made-up free-running trials whose truth is known: a zigzag and two turns as instruments would record them.

``python docs/examples/make_trials.py trials damping`` writes ``zigzag.csv``, ``turn.csv`` and, to be held out,
``held_out.csv`` of a Mariner whose yaw damping is 5 % larger than on the bundled card; with ``current`` the card is
right and a current of 0.5 m/s towards east acts. Nothing here was measured.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import tank2sim as t2s
from tank2sim.cards import parse_card

NOISE = {"u_mps": 0.03, "v_mps": 0.03, "r_degps": 0.01, "psi_deg": 0.1, "x_m": 0.5, "y_m": 0.5}  # standard deviations
ROWS = 5  # every fifth step of 0.1 s is recorded
DURATION_S = 300.0
HARD_OVER = {"t_s": [0.0, 60.0], "delta_order_deg": [0.0, 35.0]}
CURRENT = '\n[[effects]]\nname = "current"\nparameters = { speed_mps = 0.5, direction_deg = 90.0 }\n'


def real_ship(truth: str) -> tuple[t2s.Ship, int, tuple[float, float]]:
    """The ship behind the trials, the seed of the noise, and the zigzag that is held out (rudder and heading, deg)."""
    ship = t2s.load("mariner")
    if truth == "damping":
        return ship.replace({"derivatives.Nr": -174e-5}), 7, (-15.0, 15.0)
    return t2s.Ship(parse_card(ship.card.text + CURRENT, "made up")), 8, (-20.0, 20.0)


def record(text: str, chance: np.random.Generator) -> str:
    """The CSV that instruments with noise would write, from the CSV of a simulation."""
    head, *lines = [line for line in text.splitlines() if not line.startswith("#")]
    rows = np.loadtxt(lines, delimiter=",")[::ROWS]
    rows += chance.normal(size=rows.shape) * [NOISE.get(column, 0.0) for column in head.split(",")]
    return "\n".join([head, *(",".join(f"{value:.6g}" for value in row) for row in rows)]) + "\n"


def write(folder: Path, truth: str) -> None:
    """Write the three trials into a folder."""
    ship, seed, (rudder, heading) = real_ship(truth)
    runs = {
        "zigzag": ship.zigzag(20, 20, duration_s=DURATION_S),
        "turn": ship.steer(HARD_OVER, duration_s=DURATION_S),
        "held_out": ship.zigzag(rudder, heading, duration_s=DURATION_S),
    }
    folder.mkdir(parents=True, exist_ok=True)
    chance = np.random.default_rng(seed)
    for name, run in runs.items():
        (folder / f"{name}.csv").write_text(record(run.to_csv(), chance), encoding="utf-8")


if __name__ == "__main__":
    target, hidden = Path(sys.argv[1]), sys.argv[2]
    if hidden not in ("damping", "current"):
        sys.exit(f"make_trials.py: {hidden!r} is not a truth; give damping or current")
    write(target, hidden)
    print(f"{target}: zigzag.csv, turn.csv and held_out.csv, made up ({hidden})")
