"""The propeller of the MMG method: its wake, which drift and yaw change, its thrust and its torque.

    T = rho n^2 D^4 K_T,   K_T = k_0 + k_1 J + k_2 J^2,   J = u_P/(n D),   u_P = (1 - w_P) u,   X_P = (1 - t_P) T
    Q = rho n^2 D^5 K_Q/eta_R,   P_D = 2 pi n Q
    (1 - w_P)/(1 - w_P0) = 1 + (1 - exp(-C_1 abs(beta_P))) (C_2 - 1),   beta_P = beta - x_P' r'
    or   1 - w_P = (1 - w_P0) + tau ((v' + x_P' r')^2 + C_Pv v' + C_Pr r')        (Son and Nomoto 1982), abs(r') <= 1

C_2 is C_2+ for beta_P > 0, else C_2-. The ratio has a kink there: at beta_P = 0 its slopes are those of beta_P < 0.

Written without J, thrust is regular at n = 0:

    T = rho D^2 (k_0 D^2 n^2 + k_1 D n u_P + k_2 u_P abs(u_P))

which is the same for n, u >= 0; so is the torque, with K_Q = q_0 + q_1 J + q_2 J^2. Reversed (n < 0) the first two
terms are -a k_0 D^2 n^2, a the stated share (``astern``), of thrust and torque: the thrust of a propeller that is
stopped and reversed hardly depends on the speed ahead (Miyauchi et al. 2022, J. Mar. Sci. Technol. 27: constant below
J = -0.23). The ship going astern, w_P = 0 (the same), and t_P is kept.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import casadi as ca

LARGEST_PRIME_RATE = 1.0
"""r' = r L/U beyond which the polynomials of wake and cross flow are not followed: a ship that turns on the spot has no
bound of r'. Project choice: as in the tightest turns."""


def wake_ratio(p: Mapping[str, Any], beta_P: ca.SX) -> ca.SX:
    """(1 - w_P)/(1 - w_P0) at a drift angle beta_P (rad) at the propeller; `p` has C_1, C_2_plus, C_2_minus."""
    # Exponents are negative on either side, so that nothing overflows; at beta_P = 0 the slopes are of beta_P < 0.
    positive = 1 - ca.exp(-p["C_1"] * ca.if_else(beta_P > 0, beta_P, 0))
    negative = 1 - ca.exp(p["C_1"] * ca.if_else(beta_P > 0, 0, beta_P))
    ratio: ca.SX = 1 + positive * (p["C_2_plus"] - 1) + negative * (p["C_2_minus"] - 1)
    return ratio


def wake_by_polynomial(p: Mapping[str, Any], v: ca.SX, r: ca.SX) -> ca.SX:
    """1 - w_P at v' and r' (prime); `p` has w_P0, x_P, tau, C_Pv, C_Pr."""
    r = ca.fmax(-LARGEST_PRIME_RATE, ca.fmin(r, LARGEST_PRIME_RATE))
    ratio: ca.SX = (1 - p["w_P0"]) + p["tau"] * ((v + p["x_P"] * r) ** 2 + p["C_Pv"] * v + p["C_Pr"] * r)
    return ratio


def propeller_inflow(u: ca.SX, kept: ca.SX) -> ca.SX:
    """u_P (m/s), positive from ahead, at a surge velocity u (m/s), of which 1 - w_P is `kept`; without wake astern."""
    return ca.if_else(u > 0, kept, 1) * u


def thrust_over_density(p: Mapping[str, Any], diameter: ca.SX, n: ca.SX, u_P: ca.SX) -> ca.SX:
    """T/rho (m4/s2) of one propeller at n (1/s, positive ahead) and u_P (m/s); `p` has k_0, k_1, k_2, astern."""
    thrust: ca.SX = diameter**2 * _open_water(p, "k", diameter, n, u_P)
    return thrust


def torque_over_density(p: Mapping[str, Any], diameter: ca.SX, n: ca.SX, u_P: ca.SX) -> ca.SX:
    """Q/rho (m5/s2) that turns one propeller, of the sign of n where it is driven; `p` has q_0, q_1, q_2, eta_R and
    astern, the share of q_0 with reversed revolutions as of k_0."""
    torque: ca.SX = diameter**3 * _open_water(p, "q", diameter, n, u_P) / p["eta_R"]
    return torque


def _open_water(p: Mapping[str, Any], curve: str, diameter: ca.SX, n: ca.SX, u_P: ca.SX) -> ca.SX:
    """n^2 D^2 K(J) (m2/s2), regular at n = 0; the curve is ``k``, K_T, or ``q``, K_Q."""
    ahead = ca.fmax(n, 0)
    astern = ca.fmin(n, 0)
    first, second, third = (p[f"{curve}_{power}"] for power in range(3))
    turning = first * diameter**2 * (ahead**2 - p["astern"] * astern**2) + second * diameter * ahead * u_P
    scaled: ca.SX = turning + third * u_P * ca.fabs(u_P)
    return scaled
