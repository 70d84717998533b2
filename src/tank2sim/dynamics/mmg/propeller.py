"""The propeller of the MMG method: its wake, which drift and yaw change, and its thrust.

    T = rho n^2 D^4 K_T,   K_T = k_0 + k_1 J + k_2 J^2,   J = u_P/(n D),   u_P = (1 - w_P) u,   X_P = (1 - t_P) T
    (1 - w_P)/(1 - w_P0) = 1 + (1 - exp(-C_1 abs(beta_P))) (C_2 - 1),   beta_P = beta - x_P' r'
    or   1 - w_P = (1 - w_P0) + tau ((v' + x_P' r')^2 + C_Pv v' + C_Pr r')        (Son and Nomoto 1982)

C_2 is C_2+ for beta_P > 0, else C_2-. The ratio has a kink there: at beta_P = 0 its slopes are those of beta_P < 0.

Written without J, thrust is regular at n = 0:

    T = rho D^2 (k_0 D^2 n^2 + k_1 D n u_P + k_2 u_P abs(u_P))

which is the same for n, u >= 0. Reversed (n < 0) it is -a k_0 D^2 n^2 for the first two terms, a the stated share
(``astern``): the thrust of a propeller that is stopped and reversed hardly depends on the speed ahead (Miyauchi et al.
2022, J. Mar. Sci. Technol. 27: constant below J = -0.23). The ship going astern, w_P = 0 (the same), and t_P is kept.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import casadi as ca


def wake_ratio(p: Mapping[str, Any], beta_P: ca.SX) -> ca.SX:
    """(1 - w_P)/(1 - w_P0) at a drift angle beta_P (rad) at the propeller; `p` has C_1, C_2_plus, C_2_minus."""
    # Exponents are negative on either side, so that nothing overflows; at beta_P = 0 the slopes are of beta_P < 0.
    positive = 1 - ca.exp(-p["C_1"] * ca.if_else(beta_P > 0, beta_P, 0))
    negative = 1 - ca.exp(p["C_1"] * ca.if_else(beta_P > 0, 0, beta_P))
    ratio: ca.SX = 1 + positive * (p["C_2_plus"] - 1) + negative * (p["C_2_minus"] - 1)
    return ratio


def wake_by_polynomial(p: Mapping[str, Any], v: ca.SX, r: ca.SX) -> ca.SX:
    """1 - w_P at v' and r' (prime); `p` has w_P0, x_P, tau, C_Pv, C_Pr."""
    ratio: ca.SX = (1 - p["w_P0"]) + p["tau"] * ((v + p["x_P"] * r) ** 2 + p["C_Pv"] * v + p["C_Pr"] * r)
    return ratio


def propeller_inflow(u: ca.SX, kept: ca.SX) -> ca.SX:
    """u_P (m/s), positive from ahead, at a surge velocity u (m/s), of which 1 - w_P is `kept`; without wake astern."""
    return ca.if_else(u > 0, kept, 1) * u


def thrust_over_density(p: Mapping[str, Any], diameter: ca.SX, n: ca.SX, u_P: ca.SX) -> ca.SX:
    """T/rho (m4/s2) of one propeller at n (1/s, positive ahead) and u_P (m/s); `p` has k_0, k_1, k_2, astern."""
    ahead = ca.fmax(n, 0)
    astern = ca.fmin(n, 0)
    turning = p["k_0"] * diameter**2 * (ahead**2 - p["astern"] * astern**2) + p["k_1"] * diameter * ahead * u_P
    thrust: ca.SX = diameter**2 * (turning + p["k_2"] * u_P * ca.fabs(u_P))
    return thrust
