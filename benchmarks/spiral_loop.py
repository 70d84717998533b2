"""Width of the loop of an unstable ship: by spirals of ever finer rudder steps, and by the folds of its steady turns.

``python benchmarks/spiral_loop.py`` prints the widths of the bundled ``kvlcc2``.
"""

from __future__ import annotations

import numpy as np

import tank2sim as t2s
from tank2sim.simulation.manoeuvres import SpiralManoeuvre
from tank2sim.simulation.run import simulate

STEPS_DEG = (1.0, 0.5, 0.25, 0.1)
SPAN_DEG = 5.0


def main() -> None:
    """Print the widths."""
    ship = t2s.load("kvlcc2")
    loop = ship.stability(spirals=False).study.steady_turning.loop
    print(f"folds of the steady turns       {loop.width_deg:.3f} deg")
    run = ship.simulate("spiral:20")
    print(f"simulate --manoeuvre spiral:20  {run.figures['loop_width_deg']:.3f} deg")
    for step in STEPS_DEG:
        print(f"spiral in steps of {step:4.2f} deg      {spiral_width_deg(ship, step):.3f} deg")


def spiral_width_deg(ship: t2s.Ship, step_deg: float) -> float:
    """Width (deg) of the loop of a spiral between 5 deg to either side in even steps."""
    out = np.arange(SPAN_DEG, -SPAN_DEG - step_deg / 2, -step_deg)
    rudders = np.radians([*out, *out[-2::-1]])
    run = simulate(ship.model, SpiralManoeuvre(tuple(rudders)))
    return float(run.figures["loop_width_deg"])


if __name__ == "__main__":
    main()
