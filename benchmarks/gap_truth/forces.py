"""Forces of the hidden effects, written from the physics rather than from the analyst's library.

Each is a function of the motion and the effect's parameters (SI, radians, one element a lane) to X', Y', N' on top of
the polynomial. Where a text-book formula has a corner there is a bend here, and where it is a power, a slower growth.
"""

from __future__ import annotations

import numpy as np

from gap_truth.motion import Force, Motion, Parameters
from gap_truth.ship import AIR_KGPM3, GRAVITY_MPS2, WATER_KGPM3, Array

Forces = tuple[Array | float, Array | float, Array | float]

_STRIPS = np.linspace(-0.5, 0.5, 21)
_WEIGHTS = np.where(np.abs(_STRIPS) == 0.5, 0.5, 1.0) / (len(_STRIPS) - 1)  # trapezoid
_FULLNESS = 1.0 + 0.25 * (2.0 * _STRIPS) ** 2 - 0.25 / 3.0  # of Cd along the hull: more at the ends; mean 1


def wind(m: Motion, p: Parameters) -> Forces:
    """Relative wind on the upper works, less the still air that the hull's own resistance already contains."""
    towards = p["direction_rad"] + np.pi - m.psi
    blown = _air(m, m.u - p["speed_mps"] * np.cos(towards), m.v - p["speed_mps"] * np.sin(towards))
    still = _air(m, m.u, m.v)
    return blown[0] - still[0], blown[1] - still[1], blown[2] - still[2]


def _air(m: Motion, along: Array, across: Array) -> tuple[Array, Array, Array]:
    """Forces of moving through the air at these speeds; head force fuller than cos(gamma), moment as sin(2 gamma)."""
    squared = along * along + across * across
    speed = np.sqrt(squared) + 1e-9
    c, s = along / speed, across / speed
    pressure = (AIR_KGPM3 / WATER_KGPM3) * squared / (m.hull.length_m**2 * m.speed**2)
    surge = -0.72 * c * (0.85 + 0.15 * c * c) * pressure * m.hull.front_m2
    sway = -0.85 * s * (0.9 + 0.1 * s * s) * pressure * m.hull.side_m2
    return surge, sway, -0.20 * s * c * pressure * m.hull.side_m2


def wave_drift(m: Motion, p: Parameters) -> Forces:
    """Mean drift 1/2 rho g a^2 of waves from a direction, a little more against them than with them."""
    relative = p["direction_rad"] - m.psi  # bearing of where the waves come from
    c, s = np.cos(relative), np.sin(relative)
    encounter = 1.0 + 0.25 * c * m.u / m.hull.speed_mps
    size = GRAVITY_MPS2 * (p["height_m"] / 2.0) ** 2 / m.speed**2 * encounter
    return -0.6 * c * size * m.hull.beam_m / m.hull.length_m**2, -0.9 * s * np.abs(s) * size / m.hull.length_m, 0.0


def bank_suction(m: Motion, p: Parameters) -> Forces:
    """A bank alongside: a pressure low that goes with the forward speed, the propeller drawing water adds some."""
    pull = (m.u / m.speed) ** 2 * (0.85 + 0.15 * m.rpm_ratio)
    return 0.0, p["Y_prime"] * pull, p["N_prime"] * pull


def propeller_side_force(m: Motion, p: Parameters) -> Forces:
    """Side force of the screw, with its thrust: revolutions squared, growing as the advance falls."""
    load = m.nominal * m.rpm_ratio * (1.15 * m.rpm_ratio - 0.15 * m.u / m.hull.speed_mps)
    return 0.0, p["Y_prime"] * load, p["N_prime"] * load


def loading_side_force(m: Motion, p: Parameters) -> Forces:
    """Side force that comes with propeller loading beyond that of steady ahead: n^2/u^2 above one, bounded."""
    excess = m.rpm_ratio**2 * m.nominal - 1.0
    excess = excess / np.sqrt(1.0 + (excess / 6.0) ** 2)
    return 0.0, p["Y_prime"] * excess, p["N_prime"] * excess


def rudder_slipstream(m: Motion, p: Parameters) -> Forces:
    """The rudder stands partly in a jet that keeps its speed with the revolutions while the ship loses hers."""
    share = 0.4 * p["gain"]
    inflow = 1.0 + share * (m.rpm_ratio * m.hull.speed_mps / m.speed - 1.0)
    grown = inflow * inflow - 1.0
    return grown * m.steering[0], grown * m.steering[1], grown * m.steering[2]


def rudder_stall(m: Motion, p: Parameters) -> Forces:
    """Smooth loss of rudder lift about the stall angle, two degrees wide; the drag stays."""
    lost = p["loss"] / (1.0 + np.exp((p["angle_rad"] - np.abs(m.rudder)) / np.radians(2.0)))
    return 0.0, -lost * m.steering[1], -lost * m.steering[2]


def loaded_rudder(m: Motion, p: Parameters) -> Forces:
    """More jet over the rudder as the ship slows, at the rudder angle less the straightened local drift."""
    drift = p["straightening"] * np.arctan2(m.v_prime + p["lever"] * m.r_prime, m.u / m.speed)
    jet = p["loading"] * (m.rpm_ratio * m.hull.speed_mps / m.speed - 1.0)
    lift = jet * np.sin(m.rudder + drift)
    return -0.4 * np.abs(lift * np.sin(m.rudder)) * 278e-5, -278e-5 * lift, 139e-5 * lift


def cross_flow_drag(m: Motion, p: Parameters) -> Forces:
    """Drag of strips in the local cross flow, trapezoid over the length, Cd larger towards the ends."""
    sway, yaw = np.zeros_like(m.u), np.zeros_like(m.u)
    for x, weight in zip(_STRIPS, _WEIGHTS * _FULLNESS, strict=True):
        local = m.v_prime + x * m.r_prime
        strip = weight * local * np.abs(local)
        sway, yaw = sway + strip, yaw + x * strip
    size = -p["drag_coefficient"] * m.hull.draught_m / m.hull.length_m
    return 0.0, size * sway, size * yaw


def hull_fouling(m: Motion, p: Parameters) -> Forces:
    """Roughness drag, quadratic with a little of the viscous power."""
    return p["X_prime"] * (m.u / m.speed) ** 2 * (m.hull.speed_mps / m.speed) ** 0.1, 0.0, 0.0


def hump_resistance(m: Motion, p: Parameters) -> Forces:
    """A bump of wave resistance about one speed, with longer feet than a bell curve's."""
    off = (m.speed - p["speed_mps"]) / p["width_mps"]
    return p["X_prime"] / (1.0 + 0.5 * off * off) ** 2, 0.0, 0.0


def engine_droop(m: Motion, p: Parameters) -> Forces:
    """Thrust lost because the engine falls back as the ship slows: n (1 - droop (1 - (u/u0)^1.5)/1.5)."""
    kept = 1.0 - p["droop"] * (1.0 - np.maximum(m.u, 0.1) ** 1.5 / m.hull.speed_mps**1.5) / 1.5
    return m.hull.xnn * m.rpm_ratio**2 * (kept * kept - 1.0) * m.nominal, 0.0, 0.0


def asymmetric_turning(m: Motion, p: Parameters) -> Forces:
    """An even force in yaw rate, from an unequal hull: r'^2, growing slower in the tightest turns."""
    even = m.r_prime**2 / (1.0 + 0.3 * m.r_prime**2)
    return 0.0, p["Yrr"] * even, p["Nrr"] * even


def cubic_yaw_damping(m: Motion, p: Parameters) -> Forces:
    """Between quadratic and cubic in yaw rate, equal to the cubic at r' = 0.5."""
    cubic = m.r_prime * np.abs(m.r_prime) ** 1.8 * 0.5**0.2
    return 0.0, p["Yrrr"] * cubic, p["Nrrr"] * cubic


def sway_yaw_coupling(m: Motion, p: Parameters) -> Forces:
    """Drift force changed by the flow's curvature: v' r'^2, slower growing at large drift."""
    coupled = m.v_prime * m.r_prime**2 / (1.0 + 0.5 * m.v_prime**2)
    return 0.0, p["Yvrr"] * coupled, p["Nvrr"] * coupled


def turning_drag(m: Motion, p: Parameters) -> Forces:
    """Drag of turning with drift, v' r', with the sine of the drift angle squared off a little."""
    return p["Xvr"] * m.v_prime * m.r_prime * (1.05 - 0.3 * m.v_prime**2), 0.0, 0.0


def tug(m: Motion, p: Parameters) -> Forces:
    """A push for a limited time, slack taken up in three seconds. Outside any library."""
    slack_s = 3.0 * m.hull.time
    on = np.clip((m.t_s - p["t0"]) / slack_s, 0.0, 1.0) * np.clip((p["t0"] + p["dur"] - m.t_s) / slack_s, 0.0, 1.0)
    return 0.0, p["F"] * on * m.nominal, p["F"] * p["lever"] * on * m.nominal


def oscillation(m: Motion, p: Parameters) -> Forces:
    """A force of a fixed period: chain, sloshing, hunting. Outside any library."""
    swing = np.sin(2.0 * np.pi * m.t_s / p["period_s"] + p["phase_rad"]) * m.nominal
    return 0.0, p["Y"] * swing, p["N"] * swing


def drag_step(m: Motion, p: Parameters) -> Forces:
    """Something caught half-way: drag from `t0` on. Outside any library."""
    return p["X"] * np.clip((m.t_s - p["t0"]) / (2.0 * m.hull.time), 0.0, 1.0) * m.nominal, 0.0, 0.0


def flooding(m: Motion, p: Parameters) -> Forces:
    """A list growing with time, and its sideways force. Outside any library."""
    grown = m.t_s / (400.0 * m.hull.time) * (m.u / m.speed) ** 2
    return -0.3 * np.abs(p["Y"]) * grown, p["Y"] * grown, p["N"] * grown


FORCES: dict[str, Force] = {
    force.__name__: force
    for force in (
        *(wind, wave_drift, bank_suction, propeller_side_force, loading_side_force, rudder_slipstream, rudder_stall),
        *(loaded_rudder, cross_flow_drag, hull_fouling, hump_resistance, engine_droop, asymmetric_turning),
        *(cubic_yaw_damping, sway_yaw_coupling, turning_drag),
    )
} | {"out_tug": tug, "out_oscillation": oscillation, "out_drag_step": drag_step, "out_flooding": flooding}
"""Every effect that is a force without a state of its own."""
