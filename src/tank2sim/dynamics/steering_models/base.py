"""The base model of Poznyakov & Yudin, equation (1) of paper 4 with the further terms of Table 2, and models like it.

    Y = -C_y^b beta - C_y^bb beta |beta| + C_y^w r + C_y^d delta
    N =  C_m^b beta - (C_m^w + C_m^bbw beta^2) r + C_m^d delta

The models of Pavlenko and of Sobolev are printed in the same form, without coefficients; a card may give them.

Table 2 varies three more coefficients of N. Their terms are not printed; read after their superscripts, and with the
signs that their influence has in Table 2, they are -C_m^ww r |r| and -C_m^wwb beta r^2. A term in C_m^bb has no
influence there (K = 0) and is left out.
"""

from __future__ import annotations

from collections.abc import Mapping

import casadi as ca

from tank2sim.dynamics.steering_models.form import SteeringCoefficient, SteeringForm

PAPER_4 = "Poznyakov, S. I. and Yudin, Yu. I. (2007), Vestnik MGTU, on comparing ship models by influence coefficients"

EQUATION_1 = (
    SteeringCoefficient(name="C_y_b", description="Coefficient of -beta in Y"),
    SteeringCoefficient(name="C_y_w", description="Coefficient of r in Y"),
    SteeringCoefficient(name="C_y_bb", description="Coefficient of -beta |beta| in Y"),
    SteeringCoefficient(name="C_y_d", description="Coefficient of the rudder angle in Y"),
    SteeringCoefficient(name="C_m_b", description="Coefficient of beta in N: the static yaw moment"),
    SteeringCoefficient(name="C_m_w", description="Coefficient of -r in N: the yaw damping"),
    SteeringCoefficient(name="C_m_bbw", description="Coefficient of -beta^2 r in N"),
    SteeringCoefficient(name="C_m_d", description="Coefficient of the rudder angle in N"),
)
"""The coefficients of (1)."""

_OF_TABLE_2 = (
    SteeringCoefficient(
        name="C_m_ww", description="Coefficient of -r |r| in N, a term read out of Table 2", default=0.0
    ),
    SteeringCoefficient(
        name="C_m_wwb", description="Coefficient of -beta r^2 in N, a term read out of Table 2", default=0.0
    ),
)


def equation_1(c: Mapping[str, ca.SX], beta: ca.SX, r: ca.SX, delta: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Y and N of (1), as printed."""
    sway = -c["C_y_b"] * beta - c["C_y_bb"] * beta * ca.fabs(beta) + c["C_y_w"] * r + c["C_y_d"] * delta
    yaw = c["C_m_b"] * beta - (c["C_m_w"] + c["C_m_bbw"] * beta**2) * r + c["C_m_d"] * delta
    return sway, yaw


def _rates(c: Mapping[str, ca.SX], beta: ca.SX, r: ca.SX, delta: ca.SX) -> tuple[ca.SX, ca.SX]:
    sway, yaw = equation_1(c, beta, r, delta)
    return sway, yaw - c["C_m_ww"] * r * ca.fabs(r) - c["C_m_wwb"] * beta * r**2


BASE = SteeringForm(
    name="base",
    title="base model",
    source=f"{PAPER_4}, eq. (1); Yudin and Poznyakov (2006), Vestnik MGTU 9(2), 234-240",
    coefficients=(*EQUATION_1, *_OF_TABLE_2),
    rates=_rates,
    missing=(
        "its coefficients are not printed, except C_m_b = 0.4 and C_m_w = 0.46, so that its Tables 1 and 2 cannot be "
        "computed from the paper",
        "the terms of C_m_bb, C_m_ww and C_m_wwb, which Table 2 varies, are not printed",
    ),
)
"""The base model."""

_NOT_PRINTED = (
    "the paper prints neither coefficients nor results of it: they agree worse with the trials, it says",
    'it has "another set of terms in the right-hand sides" of (1); which ones is not printed, and (1) as printed '
    "is used here in their place",
)

PAVLENKO = SteeringForm(
    name="pavlenko",
    title="model of Pavlenko",
    source=f"{PAPER_4}, which names Pavlenko, V. G. (1991), Khodkost i upravlyaemost sudov, Transport, Moscow",
    coefficients=EQUATION_1,
    rates=equation_1,
    missing=_NOT_PRINTED,
)
"""The model of Pavlenko."""

SOBOLEV = SteeringForm(
    name="sobolev",
    title="model of Sobolev",
    source=f"{PAPER_4}, which names Sobolev, G. V. (1976), Upravlyaemost korablya i avtomatizatsiya sudovozhdeniya, "
    "Sudostroenie, Leningrad",
    coefficients=EQUATION_1,
    rates=equation_1,
    missing=_NOT_PRINTED,
)
"""The model of Sobolev."""
