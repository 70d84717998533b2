"""The Japanese model of paper 4 (after Gofman 1988): equation (2), with the terms of Inoue, Hirano and others (1981).

    Y = -h C_y^b beta - h C_y^bb beta |beta| + C_y^w r - h C_y^bw beta |r| + C_y^ww r |r| + F
    N =  h C_m^b beta - C_m^w r - h C_m^bbw beta^2 r - h C_m^bww beta r^2 - C_m^ww r |r| + l_p C_y^d delta + l_p P
    F = C_y^d delta + P,    P = -C_y^pb beta - C_y^pw r

P is the flow that meets the rudder. This is (2) restored: the print has omega^2 where r^2 = omega^2 (L/v)^2 is needed,
and its values give its results only with the plus sign of C_y^ww and with h = 1/2 on every coefficient that multiplies
a power of beta (the cause is not known: the printed beta or the printed coefficients carry a factor 2). C_y^pb, C_y^pw
are not printed. The rudder's moment l_p C_y^d delta is written C_m^d delta, a coefficient of its own in Table 4.
"""

from __future__ import annotations

from collections.abc import Mapping

import casadi as ca

from tank2sim.dynamics.steering_models.base import PAPER_4
from tank2sim.dynamics.steering_models.form import SteeringCoefficient, SteeringForm


def _rates(c: Mapping[str, ca.SX], beta: ca.SX, r: ca.SX, delta: ca.SX) -> tuple[ca.SX, ca.SX]:
    drift, turn = c["drift_share"] * beta, r * ca.fabs(r)
    inflow = -c["C_y_pb"] * beta - c["C_y_pw"] * r
    sway = (
        -c["C_y_b"] * drift
        + c["C_y_w"] * r
        - c["C_y_bb"] * drift * ca.fabs(beta)
        - c["C_y_bw"] * drift * ca.fabs(r)
        + c["C_y_ww"] * turn
        + c["C_y_d"] * delta
        + inflow
    )
    yaw = (
        c["C_m_b"] * drift
        - c["C_m_w"] * r
        - c["C_m_ww"] * turn
        - c["C_m_bww"] * drift * r**2
        - c["C_m_bbw"] * drift * beta * r
        + c["C_m_d"] * delta
        + c["l_p"] * inflow
    )
    return sway, yaw


INOUE_HIRANO = SteeringForm(
    name="inoue-hirano",
    title="Japanese model (Inoue, Hirano)",
    source=f"{PAPER_4}, eq. (2) restored and Table 4; Gofman, A. D. (1988), Sudostroenie; term list of Inoue, Hirano, "
    "Kijima and Takashina (1981), International Shipbuilding Progress 28, from memory",
    coefficients=(
        SteeringCoefficient(name="C_y_b", description="Coefficient of -h beta in Y"),
        SteeringCoefficient(name="C_y_w", description="Coefficient of r in Y"),
        SteeringCoefficient(name="C_y_bb", description="Coefficient of -h beta |beta| in Y"),
        SteeringCoefficient(name="C_y_bw", description="Coefficient of -h beta |r| in Y"),
        SteeringCoefficient(name="C_y_ww", description="Coefficient of r |r| in Y"),
        SteeringCoefficient(name="C_y_d", description="Coefficient of the rudder angle in Y"),
        SteeringCoefficient(name="C_m_b", description="Coefficient of h beta in N: the static yaw moment"),
        SteeringCoefficient(name="C_m_w", description="Coefficient of -r in N: the yaw damping"),
        SteeringCoefficient(name="C_m_ww", description="Coefficient of -r |r| in N"),
        SteeringCoefficient(name="C_m_bww", description="Coefficient of -h beta r^2 in N"),
        SteeringCoefficient(name="C_m_bbw", description="Coefficient of -h beta^2 r in N"),
        SteeringCoefficient(name="C_m_d", description="Coefficient of the rudder angle in N"),
        SteeringCoefficient(
            name="C_y_pb", description="Coefficient of -beta in the force of the rudder, by the inflow"
        ),
        SteeringCoefficient(name="C_y_pw", description="Coefficient of -r in the force of the rudder, by the inflow"),
        SteeringCoefficient(name="l_p", description="Lever of the inflow's part of the rudder force, C_m^d / C_y^d"),
        SteeringCoefficient(
            name="drift_share", description="h: share of the printed coefficients of powers of beta that acts"
        ),
    ),
    rates=_rates,
    rudder=("C_y_d", "C_m_d", "C_y_pb", "C_y_pw"),
    missing=(
        "C_y_pb, C_y_pw and the length L are not printed: they were fitted to Tables 1 and 3",
        "the coefficients at draughts of 6 and 7.5 m are not printed, so that two rows of Table 6 cannot be computed",
        "how its Table 3 came to 406.8 m for C_m_bbw: it gives 405.5 m",
        "the printed coefficients of curve 3 of Fig. 1 (trials: 47 deg/min at 15 deg, 61 at 35) give 38 deg/min at "
        "15 deg and 61.5 at 35",
    ),
)
"""The Japanese model."""
