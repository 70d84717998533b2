"""The rudder of the MMG method: the flow that meets it, its normal force, and what hull and stern make of that.

    F_N = 1/2 rho A_R f_alpha U_R^2 sin(alpha_R) = 1/2 rho A_R f_alpha U_R (u_R sin(delta) - v_R cos(delta))
    X_R = -(1 - t_R) F_N sin(delta)
    Y_R = -(1 + a_H) F_N cos(delta),   N_R = -(x_R + a_H x_H) F_N cos(delta)
    v_R = gamma_R (U beta - l_R' L r),   gamma_R+ where that is positive (beta_R > 0), else gamma_R-
    or   v_R = -U (C_Rv v' + C_Rr r' + C_Rrrr r'^3 + C_Rrrv r'^2 v')        (Son and Nomoto 1982), r'^2 <= 1
    u_R = eps sqrt(eta (u_P + kappa (sqrt(u_P^2 + 8 T/(rho pi D^2)) - u_P))^2 + (1 - eta) u_P^2),   eta = D_P/H_R
    unless the card states eta; at kappa = 1 it is eps sqrt(u_P^2 + eta 8 T/(rho pi D^2)), Son and Nomoto's

The last is the method's own form in K_T/J^2, without its division by J. Positive delta turns the ship to starboard.
The gamma_R has a kink at beta_R = 0: there the slopes are those of beta_R < 0.

Beyond the first quadrant: the square of the race is held at zero or above where a reversed or windmilling propeller
takes out of it (at least nothing flows); going astern the inflow is eps u from aft, and the force of the rudder, met by
its trailing edge, is the share ``low_speed.rudder_astern`` of that ahead.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import casadi as ca

from tank2sim.dynamics.mmg.propeller import LARGEST_PRIME_RATE


def rudder_inflow(p: Mapping[str, Any], eta: ca.SX, u_P: ca.SX, race: ca.SX, still: ca.SX) -> ca.SX:
    """u_R (m/s), positive from ahead.

    `p`: with eps and kappa. `eta`: D_P/H_R, 0 to 1. `u_P`: flow to the propeller, m/s. `race`: 8 T/(rho pi D_P^2), what
    the propeller adds to the square of the speed in its race, m2/s2. `still`: a speed (m/s) that counts as none, so
    that the roots have slopes at rest.
    """
    far = ca.sqrt(ca.fmax(u_P**2 + race, 0) + still**2)
    behind = u_P + p["kappa"] * (far - ca.sqrt(u_P**2 + still**2))
    square = eta * behind * ca.fabs(behind) + (1 - eta) * u_P * ca.fabs(u_P)
    inflow: ca.SX = p["eps"] * square / ca.sqrt(ca.fabs(square) + still**2)
    return inflow


def rudder_cross_flow(p: Mapping[str, Any], drift_speed: ca.SX, swing: ca.SX) -> ca.SX:
    """v_R (m/s) from U beta (m/s) and L r (m/s); `p` has l_R, gamma_R_plus, gamma_R_minus."""
    meets = drift_speed - p["l_R"] * swing
    across: ca.SX = ca.if_else(meets > 0, p["gamma_R_plus"], p["gamma_R_minus"]) * meets
    return across


def cross_flow_by_polynomial(p: Mapping[str, Any], speed: ca.SX, v: ca.SX, r: ca.SX) -> ca.SX:
    """v_R (m/s), positive from port, at a speed U (m/s), v' and r' (prime); `p` has C_Rv, C_Rr, C_Rrrr, C_Rrrv."""
    square = ca.fmin(r**2, LARGEST_PRIME_RATE**2)
    across: ca.SX = -speed * (p["C_Rv"] * v + p["C_Rr"] * r + square * (p["C_Rrrr"] * r + p["C_Rrrv"] * v))
    return across


def normal_force(
    p: Mapping[str, Any], pressure_area: ca.SX, flow: tuple[ca.SX, ca.SX], delta: ca.SX, still: ca.SX
) -> ca.SX:
    """F_N (N) of one rudder at an angle delta (rad, positive to starboard).

    `p`: with f_alpha, and ``rudder_astern``, the share of the force that is left when the flow comes from aft.
    `pressure_area`: 1/2 rho A_R, kg/m. `flow`: u_R and v_R, m/s. `delta`: rudder angle. `still`: as in
    :func:`rudder_inflow`.
    """
    u_R, v_R = flow
    speed = ca.sqrt(u_R**2 + v_R**2 + still**2)
    share = 1 + (1 - p["rudder_astern"]) * ca.fmin(u_R, 0) / speed
    force: ca.SX = pressure_area * p["f_alpha"] * share * speed * (u_R * ca.sin(delta) - v_R * ca.cos(delta))
    return force


def rudder_forces_of(p: Mapping[str, Any], length: ca.SX, F_N: ca.SX, delta: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX]:
    """X_R, Y_R (N) and N_R (N m); `p` has t_R, a_H, x_H, x_R (places over L)."""
    across = F_N * ca.cos(delta)
    return (
        -(1 - p["t_R"]) * F_N * ca.sin(delta),
        -(1 + p["a_H"]) * across,
        -(p["x_R"] + p["a_H"] * p["x_H"]) * length * across,
    )
