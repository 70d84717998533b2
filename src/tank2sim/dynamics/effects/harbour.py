"""Manoeuvring aids in a harbour: tunnel thrusters at bow and stern, and tugs."""

from __future__ import annotations

import math

import casadi as ca

from tank2sim.cards.card import SteeredCard
from tank2sim.dynamics.effects.effect import Effect, EffectParameter, EffectSymbols
from tank2sim.dynamics.effects.forces import with_forces
from tank2sim.dynamics.effects.froude_scale import first, lengths, wave_speeds
from tank2sim.dynamics.effects.particulars import model_particular
from tank2sim.dynamics.model import Model

THRUST_IN_WEIGHTS = 6e-5
"""Force of a tunnel thruster over rho g L^2 T where a card gives none: 100 N on each m2 of L T of a ship of 160 m,
of which 80 to 140 are usual (Brix 1993). Project choice."""

HALF_SPEED = 0.038
"""Speed at which a tunnel thruster has lost half of its force, over sqrt(g L): 3 knots for a ship of 160 m. Project
choice, as is the form in which it fades."""

THRUSTER_PLACE = 0.42
"""Distance of a tunnel thruster from midships over L, towards the end where it is: project choice."""

TUGS = 4
"""Tugs of the effect: as many as usually take a large ship. Project choice."""


TUG_PLACE = 0.45
"""Distance from midships over L of the point of a tug where a card gives none: odd ones forward, even ones aft. Project
choice."""


def _with_thruster(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """Y = c F/(1 + (u/u_h)^2), N = x Y: c the order, F the largest force, u_h the speed at which half is left.

    The jet of a moving ship bends along the hull, whose suction behind the tunnel takes force away: Chislett and
    Bjorheden (1966), Influence of ship speed on the effectiveness of a lateral-thrust unit, Hydro- og Aerodynamisk
    Laboratorium; Brix (ed.) (1993), Manoeuvring Technical Manual.
    """
    force = given["command"] * given["force"] / (1 + (model.symbol("motion.u") / given["half_speed"]) ** 2)
    return with_forces(model, Y=force, N=given["forward"] * force)


def largest_force(card: SteeredCard) -> float:
    """Return the largest force of a usual tunnel thruster, N.

    Parameters
    ----------
    card : SteeredCard
        Card of the ship; the value goes with its weight of water L^2 T.
    """
    weight = card.environment.water_density_kgpm3 * card.environment.gravity_mps2 * card.ship.length_m**2
    return THRUST_IN_WEIGHTS * weight * model_particular(card, "draught_m")


def _thruster(end: str, sign: float) -> tuple[EffectParameter, ...]:
    place = first(lengths(sign * THRUSTER_PLACE))
    return (
        EffectParameter(
            "command",
            f"order of the thruster over its largest force, positive pushes the {end} to starboard",
            -1.0,
            1.0,
            input_name=f"{end}_tunnel_thruster.command",
            absent=0.0,
            typical=(0.5,),
        ),
        EffectParameter("force_N", "largest force of the thruster at rest", 0.0, 1e7, largest_force),
        EffectParameter("forward_m", "place of the thruster forward of midships", -250.0, 250.0, place),
        EffectParameter(
            "half_speed_mps",
            "speed at which the thruster has lost half of its force",
            0.01,
            10.0,
            first(wave_speeds(HALF_SPEED)),
        ),
    )


BOW_THRUSTER = Effect(
    name="bow_tunnel_thruster",
    acts_on="force",
    description="A tunnel thruster pushes the bow sideways, at low speed.",
    source="Chislett and Bjorheden (1966); Brix (ed.) (1993), Manoeuvring Technical Manual",
    parameters=_thruster("bow", 1.0),
    equations=_with_thruster,
    sought=False,
    terminal="Tunnel thruster at the bow",
)

STERN_THRUSTER = Effect(
    name="stern_tunnel_thruster",
    acts_on="force",
    description="A tunnel thruster pushes the stern sideways, at low speed.",
    source="Chislett and Bjorheden (1966); Brix (ed.) (1993), Manoeuvring Technical Manual",
    parameters=_thruster("stern", -1.0),
    equations=_with_thruster,
    sought=False,
    terminal="Tunnel thruster at the stern",
)


def _with_tugs(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """X, Y = sum of F_i (cos a_i, sin a_i), N = sum of x_i Y_i - y_i X_i: each tug pulls or pushes at a point.

    What a tug has left at speed, and how fast it comes to a force, is for whoever orders it.
    """
    X = Y = N = ca.SX(0)
    for tug in range(1, TUGS + 1):
        along = given[f"force_{tug}"] * ca.cos(given[f"direction_{tug}"])
        across = given[f"force_{tug}"] * ca.sin(given[f"direction_{tug}"])
        X, Y = X + along, Y + across
        N = N + given[f"forward_{tug}"] * across - given[f"starboard_{tug}"] * along
    return with_forces(model, X=X, Y=Y, N=N)


def _tug(tug: int) -> tuple[EffectParameter, ...]:
    default = None if tug == 1 else 0.0
    place = first(lengths(TUG_PLACE if tug % 2 else -TUG_PLACE))
    return (
        EffectParameter(
            f"force_{tug}_N",
            f"force of tug {tug} on the ship",
            0.0,
            5e6,
            default,
            input_name=f"tug.force_{tug}",
            absent=0.0,
            typical=lambda card: (largest_force(card),),
        ),
        EffectParameter(
            f"direction_{tug}_rad",
            f"direction of the force of tug {tug}, clockwise from the bow",
            -2 * math.pi,
            2 * math.pi,
            default,
            input_name=f"tug.direction_{tug}",
            typical=(math.pi / 2,),
        ),
        EffectParameter(f"forward_{tug}_m", f"point of tug {tug} forward of midships", -250.0, 250.0, place),
        EffectParameter(f"starboard_{tug}_m", f"point of tug {tug} to starboard", -50.0, 50.0, 0.0),
    )


TUG_FORCES = Effect(
    name="tugs",
    acts_on="force",
    description="Tugs pull and push the ship at points of its hull.",
    source="statics of forces at points",
    parameters=tuple(parameter for tug in range(1, TUGS + 1) for parameter in _tug(tug)),
    equations=_with_tugs,
    sought=False,
    terminal="Tugs",
)
