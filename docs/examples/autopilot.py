"""The tutorial of the autopilot: margins, a controller on the nonlinear ship, and what moves a figure.

``python docs/examples/autopilot.py`` writes into the current folder.
"""

from pathlib import Path

import control
from commands import tank2sim

import tank2sim as t2s


def main() -> None:
    """Go through the tutorial."""
    ship = t2s.load("mariner")
    found = ship.stability(spirals=False)
    print(found)
    found.to_html("stability.html")

    # From the rudder order to the heading: a control.StateSpace, SI and radians.
    states = ["motion.v", "motion.r", "motion.psi", "rudder.angle"]
    yaw = ship.state_space(inputs=["rudder.command"], outputs=["motion.psi"], states=states)
    gain_margin, phase_margin, *_ = control.margin(yaw)
    print(f"gain margin {gain_margin:.2f}, phase margin {phase_margin:.1f} deg")

    Path("track.csv").write_text("x_m,y_m\n0,0\n3000,0\n6000,1500\n", encoding="utf-8")
    tank2sim("autopilot", "mariner", "--design", "pid", "--wave-filter", "0.6", "--track", "track.csv", "-o", "ap.html")
    tank2sim("autopilot", "mariner", "--design", "pid", "--export", "ap.fmu", "--verify")

    tank2sim("influence", "mariner", "--figures", "K_per_s", "T_s", "overshoot_1_deg@20/20")
    tank2sim("influence", "mariner", "--tune", "steady_radius_m=640@20", "--by", "fewest", "-o", "tuned.toml")

    # The KVLCC2 is unstable on a straight course.
    print("KVLCC2 stable:", t2s.load("kvlcc2").stability(spirals=False).stable)


if __name__ == "__main__":  # processes that compute an ensemble read this file, too
    main()
