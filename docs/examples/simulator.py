"""The tutorial of the simulator: a ship as an FMU, checked, driven by FMPy, and packed with an autopilot.

``python docs/examples/simulator.py`` writes into the current folder.
"""

import math

import numpy as np
from commands import tank2sim
from fmpy import simulate_fmu

import tank2sim as t2s


def main() -> None:
    """Go through the tutorial."""
    ship = t2s.load("mariner")
    made = ship.to_fmu("mariner.fmu", fmi=3)
    check = t2s.check_fmu(made.path)
    print(check)
    if not check.passed:
        raise SystemExit("the FMU differs from the ship on the card")

    # The rudder is put over to 20 deg to starboard within ten seconds: FMPy draws a straight line between rows.
    orders = np.array([(0.0, 0.0), (10.0, math.radians(20.0))], dtype=[("time", float), ("rudder.command", float)])
    motion = simulate_fmu(
        str(made.path),
        stop_time=300.0,
        output_interval=60.0,
        input=orders,
        output=["motion.psi", "motion.speed", "validity"],
    )
    for t, psi, speed, validity in motion:
        print(f"{t:5.0f} s  heading {math.degrees(psi):6.1f} deg  speed {speed:5.2f} m/s  validity {validity:.2f}")

    tank2sim("export", "mariner", "-o", "ship.fmu", "--ssp", "mariner.ssp")  # with a heading autopilot


if __name__ == "__main__":  # processes that compute an ensemble read this file, too
    main()
