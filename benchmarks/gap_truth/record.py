"""From the true motion to what the instruments write down."""

from __future__ import annotations

import numpy as np

from gap_truth.disturbances import sensor_noise
from gap_truth.integrate import TICK_S
from gap_truth.lane import Lane
from gap_truth.ship import Array

COLUMNS = ("t_s", "delta_order_deg", "n_rpm", "u_mps", "v_mps", "r_degps", "psi_deg", "x_m", "y_m")


def recorded(lane: Lane, history: dict[str, Array], column: int) -> dict[str, Array]:
    """The trial of one lane as in its file: noise and faults of the sensors included, nothing rounded."""
    count = round(lane.manoeuvre.duration_s / TICK_S) + 1
    t = TICK_S * np.arange(count)
    tick = np.arange(count)
    if "out_clock_freeze" in lane.effects:  # the clock stands while the ship moves on
        fault = lane.effects["out_clock_freeze"]
        tick = tick + np.where(t >= fault["t0"], round(fault["freeze_s"] / TICK_S), 0)
    true = {name: values[:, column] for name, values in history.items()}
    early = lane.value("rudder_time_offset", "delay_s", 0.0)  # the column shows what the gear gets this much later
    order = true["order"][np.floor(tick + early / TICK_S + 1e-9).astype(int)]
    u, v, r, psi, x, y = (true[name][tick] for name in ("u", "v", "r", "psi", "x", "y"))
    forward, starboard = (lane.value("antenna_lever_arm", key, 0.0) for key in ("forward_m", "starboard_m"))
    angle = np.radians(lane.value("log_misalignment", "angle_deg", 0.0))
    across = v + r * lane.value("log_lever_arm", "forward_m", 0.0)
    scale = 1.0 + lane.value("log_scale", "factor", 0.0)
    jump = lane.effects.get("out_gps_jump", {"t0": np.inf, "north_m": 0.0, "east_m": 0.0})
    jumped = t >= jump["t0"]
    noise = sensor_noise(lane, count)
    signals = {
        "u_mps": scale * (u * np.cos(angle) + across * np.sin(angle)),
        "v_mps": scale * (across * np.cos(angle) - u * np.sin(angle)),
        "r_degps": (1.0 + lane.value("gyro_scale", "factor", 0.0)) * np.degrees(r)
        + lane.value("gyro_bias", "rate_degps", 0.0),
        "psi_deg": np.degrees(psi) + lane.value("heading_offset", "angle_deg", 0.0),
        "x_m": x + forward * np.cos(psi) - starboard * np.sin(psi) + jump["north_m"] * jumped,
        "y_m": y + forward * np.sin(psi) + starboard * np.cos(psi) + jump["east_m"] * jumped,
    }
    trial = {"t_s": t, "delta_order_deg": order, "n_rpm": true["rpm"][tick]}
    return trial | {name: values + noise[name] for name, values in signals.items()}
