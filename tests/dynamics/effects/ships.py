"""Ships with effects, and their quantities at a state: what the tests of effects share."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from pathlib import Path

import casadi as ca
import numpy as np

from tank2sim.cards import ManoeuvringCard, parse_card, read_card
from tank2sim.dynamics import Model, build

L, B, T, CB, U0, RHO, RHO_AIR, G = 160.93, 23.17, 7.468, 0.6, 7.7175, 1025.0, 1.225, 9.80665
FRONT, SIDE, N0, MASS, X_G = 400.0, 1500.0, 84.0 * 2 * np.pi / 60, 798e-5, -0.023

TYPICAL: dict[str, dict[str, float]] = {
    "current": {"speed_mps": 0.4, "direction_deg": 30.0},
    "wind": {"speed_mps": 10.0, "direction_deg": 40.0},
    "current_field": {"speed_mps": 0.4, "direction_deg": 30.0},
    "wind_field": {"speed_mps": 10.0, "direction_deg": 40.0},
    "wave_drift": {"height_m": 2.0, "direction_deg": 40.0},
    "waves": {"height_m": 2.0, "period_s": 8.0, "direction_deg": 40.0},
    "bank_suction": {"Y_prime": 1e-4, "N_prime": -3e-5},
    "bank": {"port_distance_m": 1e4, "starboard_distance_m": 150.0},
    "other_ship": {"forward_m": 60.0, "starboard_m": 70.0, "heading_deg": 180.0, "speed_mps": 7.0},
    "propeller_side_force": {"Y_prime": -1e-4, "N_prime": 5e-5},
    "propeller_walk": {"Y_prime": -1e-4, "N_prime": 5e-5},
    "loading_side_force": {"Y_prime": -1e-4, "N_prime": 5e-5},
    "engine_droop": {"droop": 0.2},
    "engine_lag": {"time_constant_s": 15.0},
    "engine_telegraph": {"time_constant_s": 8.0, "start_s": 6.0, "reversal_s": 25.0},
    "astern_thrust": {"factor": 0.6},
    "propeller_astern": {"side_force": 1.0},
    "controllable_pitch": {"pitch": 0.6, "design_pitch": 0.8},
    "twin_orders": {"propeller_starboard_rpm": -30.0, "propeller_port_rpm": 20.0},
    "bow_tunnel_thruster": {"command": 0.5},
    "stern_tunnel_thruster": {"command": -0.5},
    "tugs": {"force_1_N": 2e5, "direction_1_deg": 90.0},
    "azimuths": {"revolutions_1_rpm": 100.0, "angle_1_deg": 30.0, "force_N": 4e5, "nominal_rpm": 150.0},
    "rudder_bias": {"angle_deg": 1.0},
    "rudder_effectiveness": {"factor": 0.1},
    "rudder_slipstream": {"gain": 0.5},
    "rudder_stall": {"angle_deg": 20.0, "loss": 0.3},
    "loaded_rudder": {"loading": 0.6, "straightening": 0.5, "lever": -0.8},
    "rudder_rate_limit": {"max_rate_degps": 2.0},
    "rudder_lag": {"time_constant_s": 3.0},
    "rudder_backlash": {"width_deg": 2.0},
    "rudder_dead_band": {"half_width_deg": 1.0},
    "telemotor_lag": {"time_constant_s": 0.4},
    "cross_flow_drag": {"drag_coefficient": 0.3},
    "hull_fouling": {"X_prime": -1e-4},
    "hump_resistance": {"X_prime": -1e-4, "speed_mps": 6.0},
    "asymmetric_turning": {"Yrr": 1e-4, "Nrr": -2e-4},
    "cubic_yaw_damping": {"Yrrr": 1e-3, "Nrrr": -2e-3},
    "sway_yaw_coupling": {"Yvrr": 1e-3, "Nvrr": -5e-3},
    "turning_drag": {"Xvr": 1e-3},
    "added_yaw_inertia": {"factor": 0.2},
    "added_sway_mass": {"factor": 0.2},
    "linear_yaw_damping": {"factor": 0.1},
    "linear_sway_damping": {"factor": 0.1},
    "shallow_water": {"magnification": 0.2},
    "water_depth": {"depth_m": 12.0},
    "finite_depth": {"depth_m": 12.0},
    "trim": {"by_stern_m": 1.0},
    "loading": {"mean_draught_m": 6.5},
    "roll_coupling": {"Yphi": 1e-4, "Nphi": -5e-5},
    "flow_memory": {"share": 0.3, "time_constant_s": 8.0},
    "gyro_bias": {"rate_degps": 0.05},
    "gyro_scale": {"factor": 0.05},
    "heading_offset": {"angle_deg": 2.0},
    "antenna_lever_arm": {"forward_m": -40.0, "starboard_m": 5.0},
    "log_scale": {"factor": 0.05},
    "log_misalignment": {"angle_deg": 2.0},
    "log_lever_arm": {"forward_m": 30.0},
    "rudder_time_offset": {"delay_s": 1.0},
}
"""Each effect with parameters of a usual size, as cards give them."""


WAVES = """
[waves]
source = "made up"
columns = [
  "frequency_radps", "direction_deg", "heave_amplitude", "heave_phase_deg", "roll_amplitude_radpm", "roll_phase_deg",
  "X_drift_Npm2", "Y_drift_Npm2", "N_drift_Npm",
]
rows = [
  [0.3, 0.0, 0.9, 180.0, 0.0, -90.0, -1e3, 0.0, 0.0],
  [0.3, 90.0, 1.0, 180.0, 0.01, -90.0, 0.0, -5e3, 0.0],
  [0.3, 180.0, 0.9, 180.0, 0.0, -90.0, 1e3, 0.0, 0.0],
  [1.5, 0.0, 0.01, 0.0, 0.0, -90.0, -2e4, 0.0, 0.0],
  [1.5, 90.0, 0.5, 120.0, 0.02, 150.0, 0.0, -5e5, 2e6],
  [1.5, 180.0, 0.01, 0.0, 0.0, -90.0, 2e4, 0.0, 0.0],
]
"""


@functools.cache
def mariner_text(**replaced: str) -> str:
    """The Mariner's card with every particular that an effect may ask for, and propulsion; lines replaced by key.

    It holds down to 3.9 m/s, where her polynomial has no rudder left: it asks most of the low-speed form.
    """
    replaced = {"valid_speed_mps": "valid_speed_mps = [3.9, 9.3]", **replaced}
    text = Path(read_card("mariner").source).read_text()
    more = f"projected_area_front_m2 = {FRONT}\nprojected_area_side_m2 = {SIDE}\nblock_coefficient = {CB}\ndraught_m ="
    text = text.replace("draught_m =", more) + "\n[propulsion]\nnominal_rpm = 84.0\nXnn = 77e-5\n" + WAVES
    lines = text.splitlines()
    for key, line in replaced.items():
        lines = [line if one.split("=")[0].strip() == key else one for one in lines]
    return "\n".join(lines) + "\n"


def card_with(effects: Mapping[str, Mapping[str, float]] | None = None, text: str | None = None) -> ManoeuvringCard:
    """A card with these effects, parameters as a file has them."""
    text = text or mariner_text()
    for name, parameters in (effects or {}).items():
        values = "".join(f"{key} = {value}\n" for key, value in parameters.items())
        text += f'\n[[effects]]\nname = "{name}"\n[effects.parameters]\n{values}'
    card = parse_card(text, "ship.toml")
    assert isinstance(card, ManoeuvringCard)
    return card


def ship(effects: Mapping[str, Mapping[str, float]] | None = None, text: str | None = None) -> Model:
    return _built(tuple((name, tuple(given.items())) for name, given in (effects or {}).items()), text)


@functools.cache
def _built(effects: tuple[tuple[str, tuple[tuple[str, float], ...]], ...], text: str | None) -> Model:
    return build(card_with({name: dict(given) for name, given in effects}, text))


def values(model: Model, names: list[str], at: Mapping[str, float]) -> np.ndarray:
    """Quantities by name, at states, inputs and parameters by name (others: 0, their start, their start)."""
    x = [at.get(name, U0 if name == "motion.u" else 0.0) for name in model.state_names]
    u = model.input_values({name: at[name] for name in model.input_names if name in at})
    p = model.parameter_values({name: at[name] for name in model.parameter_names if name in at})
    expression = model.expand(ca.vcat([model.symbol(name) for name in names]))
    return np.array(ca.Function("values", [model.x, model.u, model.p], [expression])(x, u, p)).ravel()


FORCES = ["force.X", "force.Y", "force.N"]


def forces(model: Model, at: Mapping[str, float]) -> np.ndarray:
    return values(model, FORCES, at)


def added_forces(
    name: str, parameters: Mapping[str, float], at: Mapping[str, float], text: str | None = None
) -> np.ndarray:
    """What an effect adds to X, Y, N at a state."""
    with_effect, bare = ship({name: parameters}, text), ship(text=text)
    known = {key: value for key, value in at.items() if key in bare}
    return forces(with_effect, at) - forces(bare, known)


def state(u: float, v: float, r: float, d: float = 0.0, **more: float) -> dict[str, float]:
    named = {key.replace("__", "."): value for key, value in more.items()}
    return {"motion.u": u, "motion.v": v, "motion.r": r, "rudder.angle": d, **named}


STATES = [state(7.0, 0.6, 0.008, 0.2), state(5.5, -0.9, 0.012, -0.55), state(8.4, 0.2, -0.006, 0.45)]
