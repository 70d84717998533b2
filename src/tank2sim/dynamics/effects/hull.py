"""Effects of the hull's drag and shape."""

from __future__ import annotations

import casadi as ca
import numpy as np

from tank2sim.cards.card import SteeredCard
from tank2sim.dynamics.effects.effect import Effect, EffectParameter, EffectSymbols
from tank2sim.dynamics.effects.forces import scales, with_forces
from tank2sim.dynamics.effects.froude_scale import speeds
from tank2sim.dynamics.effects.particulars import with_particulars
from tank2sim.dynamics.model import Model

_STRIPS = 12
"""Stations of the Gauss-Legendre sum along the hull: wherever the pivot lies, both integrals are then within 0.03 % of
the largest the same end speed can give (tests compare with the integral in closed form)."""


def _with_cross_flow_drag(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """Y, N = -1/2 rho T C_D integral of (1, x) abs(v + x r) (v + x r) dx from -L/2 to L/2.

    Norrbin (1971), Theory and observations on the use of a mathematical model for ship manoeuvring, SSPA 68; Faltinsen
    (1990), Sea Loads, 6.4; one C_D for all stations. It comes on top of the card's own cubic terms, and fades
    out with them at low speed, where the hull has cross-flow drag of its own.
    """
    model, (draught,) = with_particulars(model, card, "draught_m")
    half = model.symbol("ship.length") / 2
    Y = N = ca.SX(0)
    for station, weight in zip(*np.polynomial.legendre.leggauss(_STRIPS), strict=True):
        x = half * float(station)
        across = model.symbol("motion.v") + x * model.symbol("motion.r")
        drag = half * float(weight) * ca.fabs(across) * across
        Y, N = Y + drag, N + x * drag
    # A small craft's own terms hold at rest, too.
    kept = 1 - model.symbol("low_speed.share") if "low_speed.share" in model else 1
    pressure = -0.5 * model.symbol("ship.water_density") * draught * given["drag_coefficient"] * kept
    return with_forces(model, Y=pressure * Y, N=pressure * N)


CROSS_FLOW_DRAG = Effect(
    name="cross_flow_drag",
    acts_on="force",
    description="Water that crosses under and round the hull drags on every slice of it.",
    source="Norrbin (1971), SSPA publication 68; Faltinsen (1990), Sea Loads on Ships and Offshore Structures, 6.4",
    parameters=(
        EffectParameter(
            "drag_coefficient",
            "cross-flow drag coefficient",
            -1.0,
            3.0,
            absent=0.0,
            typical=(
                0.3,
            ),  # of 0.6 to 1 for whole hulls (Faltinsen 1990, 6.4) what cubic terms may leave out (project choice)
        ),
    ),
    equations=_with_cross_flow_drag,
    of_craft=True,
)


def _with_fouling(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """X = 1/2 rho L^2 X' u abs(u), X' negative: growth and roughness, as the allowance of ITTC 7.5-02-03-01.4."""
    u = model.symbol("motion.u")
    return with_forces(model, X=scales(model, ca.SX(1)).force * given["X"] * u * ca.fabs(u))


HULL_FOULING = Effect(
    name="hull_fouling",
    acts_on="force",
    description="Growth on the hull makes it rough and slows the ship.",
    source="ITTC 7.5-02-03-01.4, 1978 performance prediction method: roughness allowance",
    parameters=(
        EffectParameter(
            "X_prime",
            "surge force, prime, negative: more resistance",
            -0.005,
            0.005,
            absent=0.0,
            typical=(-1e-4,),  # a sixth of a usual resistance (project choice)
        ),
    ),
    equations=_with_fouling,
)


def _with_hump(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """X = 1/2 rho L^2 u^2 X' exp(-1/2 ((u - u_h)/w)^2), X' negative: a hump of the resistance by waves at u_h.

    The waves of bow and stern add up at some speeds and cancel at others: Havelock (1909); Faltinsen (2005),
    Hydrodynamics of High-Speed Marine Vehicles, 4.2. The Gaussian is project choice for one hump.
    """
    u = model.symbol("motion.u")
    place = (u - given["speed"]) / given["width"]
    return with_forces(model, X=scales(model, u).force * given["X"] * ca.exp(-0.5 * place**2))


HUMP_RESISTANCE = Effect(
    name="hump_resistance",
    acts_on="force",
    description="About one speed the ship's own waves add up and resist more than at speeds below and above.",
    source="Faltinsen (2005), Hydrodynamics of High-Speed Marine Vehicles, 4.2; Gaussian hump chosen here",
    parameters=(
        EffectParameter(
            "X_prime",
            "surge force at the hump, prime, negative: more resistance",
            -0.005,
            0.005,
            absent=0.0,
            typical=(-1e-4,),  # a sixth of a usual resistance (project choice)
        ),
        EffectParameter(
            "speed_mps",
            "speed of the hump through the water",
            0.0,
            50.0,
            typical=speeds(0.8, 0.7, 0.9, 0.6, 1.0),  # what a turn sweeps, at about the width below (project choice)
        ),
        EffectParameter(
            "width_mps",
            "width of the hump (standard deviation), by default 0.08 u0",
            0.01,
            10.0,
            # From one hump to the next hollow, at Froude numbers 0.30 and 0.26 (Havelock 1909), are two widths or so.
            lambda card: 0.08 * card.model.speed_mps,
            spread=lambda card: 0.04 * card.model.speed_mps,
        ),
    ),
    equations=_with_hump,
)


def _turning_unlike(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """Y, N = 1/2 rho L^2 V^2 (Y_rr, L N_rr) r'^2 = 1/2 rho L^4 (Y_rr, L N_rr) r^2: alike to both sides, so unlike.

    Even terms in Y and N are those that a symmetric ship has not: Abkowitz (1964); SIMMAN 2008 tactical diameters.
    """
    r = model.symbol("motion.r")
    scaling = scales(model, model.symbol("ship.length") * r)
    return with_forces(model, Y=scaling.force * given["Yrr"], N=scaling.force * scaling.length * given["Nrr"])


ASYMMETRIC_TURNING = Effect(
    name="asymmetric_turning",
    acts_on="force",
    description="The ship turns more tightly to one side than to the other.",
    source="Abkowitz (1964), HyA report Hy-5: even terms of an asymmetric ship",
    parameters=(
        # About 5 % of Nr r at r' = 0.5, as tactical diameters of SIMMAN 2008 differ between the sides (project choice).
        EffectParameter(
            "Yrr",
            "coefficient of r^2 in Y, prime, positive to starboard",
            -0.05,
            0.05,
            absent=0.0,
            typical=(1e-4,),
        ),
        EffectParameter(
            "Nrr",
            "coefficient of r^2 in N, prime, positive to starboard",
            -0.05,
            0.05,
            absent=0.0,
            typical=(-1.5e-4,),
        ),
    ),
    equations=_turning_unlike,
)
