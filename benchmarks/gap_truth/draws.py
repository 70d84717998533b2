"""How large each effect is on the Mariner: random parameters in the units of files, at a strength.

Other ships get the same in the prime system (Hull.scaled).

Strength 1 is an effect a naval architect would call real and noticeable; the ranges are a choice of ours, of the size
of the worked cases where there is one (current 0.3-0.6 m/s, wind 8-14 m/s, rate limit 1.2-2 deg/s). Strength s means
s times the change of the response, not of the parameter: forces, angles and shares are multiplied; a rate k becomes
1/k' = 1/k0 + s (1/k - 1/k0), since the delay of a step goes with 1/k (k0, T0 the healthy gear's); a time constant
T' = T0 + s^0.7 (T - T0), since the gear's rate hides a short lag behind a large order (T0 = 0 for a telemotor). By
their forces wave height goes with sqrt(s), a water depth with s^(-1/2.5), and wind speed with s^0.8: on a moving ship
part of the wind's force goes with the speed and part with its square.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gap_truth.ship import MARINER

Draw = Callable[[np.random.Generator, float], dict[str, float]]
_Range = tuple[float, float]


def _scaled(scaled: dict[str, _Range], fixed: dict[str, _Range] | None = None, signed: bool = False) -> Draw:
    """Uniform within ranges; the `scaled` go with strength and share one random sign if `signed`."""

    def draw(generator: np.random.Generator, strength: float) -> dict[str, float]:
        sign = (1.0 if generator.random() < 0.5 else -1.0) if signed else 1.0
        values = {name: sign * strength * generator.uniform(*limits) for name, limits in scaled.items()}
        return values | {name: generator.uniform(*limits) for name, limits in (fixed or {}).items()}

    return draw


def _power(name: str, limits: _Range, power: float, direction: bool) -> Draw:
    def draw(generator: np.random.Generator, strength: float) -> dict[str, float]:
        values = {name: strength**power * generator.uniform(*limits)}
        return values | ({"direction_deg": generator.uniform(0.0, 360.0)} if direction else {})

    return draw


def _rate_limit(generator: np.random.Generator, strength: float) -> dict[str, float]:
    healthy = 1.0 / MARINER.gear_rate_degps
    return {"max_rate_degps": 1.0 / (healthy + strength * (1.0 / generator.uniform(1.2, 2.0) - healthy))}


def _lag(generator: np.random.Generator, strength: float) -> dict[str, float]:
    return {
        "time_constant_s": MARINER.gear_time_s + strength**0.7 * (generator.uniform(4.0, 7.0) - MARINER.gear_time_s)
    }


def _lever_arm(generator: np.random.Generator, strength: float) -> dict[str, float]:
    bearing, arm = generator.uniform(0.0, 2.0 * np.pi), strength * generator.uniform(8.0, 25.0)
    return {"forward_m": arm * float(np.cos(bearing)), "starboard_m": 0.4 * arm * float(np.sin(bearing))}


DRAWS: dict[str, Draw] = {
    "current": _scaled({"speed_mps": (0.3, 0.6)}, {"direction_deg": (0.0, 360.0)}),
    "wind": _power("speed_mps", (8.0, 14.0), 0.8, direction=True),
    "wave_drift": _power("height_m", (1.0, 1.8), 0.5, direction=True),
    "bank_suction": _scaled({"Y_prime": (7e-5, 1.4e-4), "N_prime": (-3e-5, -1.5e-5)}, signed=True),
    "propeller_side_force": _scaled({"Y_prime": (3e-5, 6e-5), "N_prime": (-3e-5, -1.5e-5)}, signed=True),
    "loading_side_force": _scaled({"Y_prime": (4e-5, 9e-5), "N_prime": (-4.5e-5, -2.5e-5)}, signed=True),
    "engine_droop": _scaled({"droop": (0.15, 0.3)}),
    "rudder_bias": _scaled({"angle_deg": (1.0, 2.0)}, signed=True),
    "rudder_effectiveness": _scaled({"factor": (-0.2, -0.1)}),
    "rudder_slipstream": _scaled({"gain": (0.3, 0.6)}),
    "rudder_stall": _scaled({"loss": (0.25, 0.45)}, {"angle_deg": (20.0, 26.0)}),
    "loaded_rudder": _scaled({"loading": (0.4, 0.8)}, {"straightening": (0.4, 0.7), "lever": (-1.0, -0.7)}),
    "rudder_rate_limit": _rate_limit,
    "rudder_lag": _lag,
    "rudder_backlash": _scaled({"width_deg": (1.5, 3.0)}),
    "rudder_dead_band": _scaled({"half_width_deg": (0.8, 1.6)}),
    "telemotor_lag": _power("time_constant_s", (2.5, 5.0), 0.7, direction=False),
    "cross_flow_drag": _scaled({"drag_coefficient": (0.3, 0.6)}),
    "hull_fouling": _scaled({"X_prime": (-1.4e-4, -0.7e-4)}),
    "hump_resistance": _scaled({"X_prime": (-3e-4, -1.5e-4)}, {"speed_mps": (5.5, 6.8), "width_mps": (0.4, 0.8)}),
    "asymmetric_turning": _scaled({"Yrr": (-8e-4, -3e-4), "Nrr": (1.5e-4, 3e-4)}, signed=True),
    "cubic_yaw_damping": _scaled({"Yrrr": (5e-4, 1.5e-3), "Nrrr": (-2e-3, -1e-3)}),
    "sway_yaw_coupling": _scaled({"Yvrr": (-1.2e-2, -6e-3), "Nvrr": (-3.5e-3, -2e-3)}),
    "turning_drag": _scaled({"Xvr": (1.5e-3, 3e-3)}),
    "added_yaw_inertia": _scaled({"factor": (0.3, 0.6)}),
    "added_sway_mass": _scaled({"factor": (0.25, 0.5)}),
    "linear_yaw_damping": _scaled({"factor": (0.1, 0.2)}, signed=True),
    "linear_sway_damping": _scaled({"factor": (0.1, 0.2)}, signed=True),
    "shallow_water": _scaled({"magnification": (0.15, 0.3)}),
    "water_depth": _power("depth_m", (14.0, 20.0), -1.0 / 2.5, direction=False),
    "trim": _scaled({"by_stern_m": (0.7, 1.4)}, signed=True),
    "roll_coupling": _scaled(
        {"Yphi": (1e-3, 2e-3), "Nphi": (-2e-3, -1e-3)},
        {"roll_period_s": (12.0, 18.0), "damping": (0.05, 0.15), "heel_ratio": (3.0, 5.0)},
    ),
    "flow_memory": _scaled({"share": (0.3, 0.5)}, {"time_constant_s": (8.0, 16.0)}),
    "gyro_bias": _scaled({"rate_degps": (0.02, 0.04)}, signed=True),
    "gyro_scale": _scaled({"factor": (0.03, 0.06)}, signed=True),
    "heading_offset": _scaled({"angle_deg": (1.0, 2.5)}, signed=True),
    "antenna_lever_arm": _lever_arm,
    "rudder_time_offset": _scaled({"delay_s": (1.0, 2.5)}),
    "log_scale": _scaled({"factor": (0.03, 0.06)}, signed=True),
    "log_misalignment": _scaled({"angle_deg": (1.0, 2.5)}, signed=True),
    "log_lever_arm": _scaled({"forward_m": (15.0, 40.0)}, signed=True),
    "out_tug": _scaled({"F": (1.8e-4, 3e-4)}, {"lever": (-0.4, 0.4), "t0": (50.0, 120.0), "dur": (50.0, 90.0)}, True),
    "out_oscillation": _scaled(
        {"Y": (1e-4, 2e-4), "N": (5e-5, 1e-4)}, {"period_s": (18.0, 45.0), "phase_rad": (0.0, 2.0 * np.pi)}
    ),
    "out_drag_step": _scaled({"X": (-4e-4, -2e-4)}, {"t0": (130.0, 220.0)}),
    "out_gps_jump": _scaled({"north_m": (15.0, 40.0), "east_m": (-40.0, -15.0)}, {"t0": (80.0, 250.0)}, True),
    "out_clock_freeze": _scaled({"freeze_s": (4.0, 8.0)}, {"t0": (60.0, 200.0)}),
    "out_flooding": _scaled({"Y": (1e-4, 2e-4), "N": (4e-5, 8e-5)}, signed=True),
    "out_rudder_stuck": _scaled({"dur": (20.0, 20.0)}, {"t0": (20.5, 21.5)}),
}
"""Every effect by name; `out_` outside the library. A walk of a propeller turning astern has no trial to show in."""

EFFECTS = tuple(name for name in DRAWS if not name.startswith("out_"))
SENSORS = (
    *("gyro_bias", "gyro_scale", "heading_offset", "antenna_lever_arm", "rudder_time_offset"),
    *("log_scale", "log_misalignment", "log_lever_arm"),
)
OUTSIDERS = tuple(name for name in DRAWS if name.startswith("out_"))
TRIALS_STRUCK = {
    "out_tug": 2,
    "out_drag_step": 1,
    "out_gps_jump": 1,
    "out_clock_freeze": 1,
    "out_flooding": 2,
    "out_rudder_stuck": 1,
}
"""In how many of the trials an outsider happens; those not named here are in all."""
