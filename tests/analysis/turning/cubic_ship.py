"""A ship whose steady turns are known in closed form: yaw moment N_r r' + N_rrr r'^3 + N_d delta alone.

With the speed of the scaling held (nominal) and no forces in surge but X_u, u is u0 and r' = r L/u0, so that

    delta = -(N_r r' + N_rrr r'^3)/N_d,   folds at r'^2 = -N_r/(3 N_rrr)
"""

from __future__ import annotations

import math

from tank2sim.cards import read_card
from tank2sim.dynamics import Model, build

N_RRR, N_D = -0.02, 0.0014
LENGTH_M, SPEED_MPS = 160.93, 7.7175
UNSTABLE, STABLE = 2e-4, -2e-3


def cubic_ship(N_r: float) -> Model:
    """The ship with a linear yaw damping (prime): positive is unstable."""
    mariner = read_card("mariner").manoeuvring()
    kept = ("Xudot", "Yvdot", "Nrdot", "Xu", "Yv")
    nothing = {f"derivatives.{name}": 0.0 for name in mariner.derivatives if name not in kept}
    own = {"derivatives.Nr": N_r, "derivatives.Nrrr": N_RRR, "derivatives.Nd": N_D, "derivatives.Yr": -0.005}
    form = {"model.speed_scale": "nominal", "model.rudder_sign": "starboard"}
    return build(read_card("mariner", {**nothing, **own, **form}))


def rudder_rad(N_r: float, rate_radps: float) -> float:
    """Rudder that holds a steady yaw rate."""
    prime = rate_radps * LENGTH_M / SPEED_MPS
    return -(N_r * prime + N_RRR * prime**3) / N_D


def fold(N_r: float) -> tuple[float, float]:
    """Rudder (rad) and yaw rate (rad/s) of the fold to starboard (yaw positive)."""
    prime = math.sqrt(-N_r / (3 * N_RRR))
    rate = prime * SPEED_MPS / LENGTH_M
    return rudder_rad(N_r, rate), rate
