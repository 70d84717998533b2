"""The Mariner's coefficients read with the instantaneous and with the nominal speed: rudder moment, turns, zigzag.

Needs nothing but the program.
"""

from __future__ import annotations

import math

import casadi as ca
import numpy as np

import tank2sim as t2s

SHIPS = ("mariner", "mariner-nominal")
SHARES = (1.0, 0.85, 0.7)


def moments_over_square(name: str, shares: tuple[float, ...] = SHARES, rudder_deg: float = 10.0) -> np.ndarray:
    """Yaw moment (N m) of a rudder angle over u^2 (m^2/s^2) straight ahead, at shares of u0."""
    ship = t2s.load(name)
    model, u0 = ship.model, ship.manoeuvring().model.speed_mps
    moment = ca.Function("moment", [model.x, model.u, model.p], [model.expand(model.symbol("rudder.N"))])
    found = []
    for share in shares:
        x = np.zeros(len(model.states))
        x[model.state_names.index("motion.u")] = share * u0
        x[model.state_names.index("rudder.angle")] = math.radians(rudder_deg)
        found.append(float(moment(x, model.input_values(), model.parameter_values())) / (share * u0) ** 2)
    return np.array(found)


def main() -> None:
    """Print the figures of the page of bundled ships."""
    for name in SHIPS:
        moments = moments_over_square(name)
        ship = t2s.load(name)
        starboard, port, zigzag = ship.turn(35).figures, ship.turn(-35).figures, ship.zigzag(10, 10).figures
        print(name)
        parts = ", ".join(f"{value:.2f}" for value in moments / moments[0])
        print(f"  yaw moment of 10 deg of rudder over u^2 at 1, 0.85, 0.7 u0, over that at u0: {parts}")
        diameters = [turn["tactical_diameter_lengths"] for turn in (starboard, port)]
        print(f"  35 deg turn: tactical diameter {diameters[0]:.1f}, {diameters[1]:.1f} L")
        print(f"  35 deg turn to starboard: advance {starboard['advance_lengths']:.1f} L")
        print(f"  10/10 zigzag: overshoots {zigzag['overshoot_1_deg']:.1f}, {zigzag['overshoot_2_deg']:.1f} deg")


if __name__ == "__main__":
    main()
