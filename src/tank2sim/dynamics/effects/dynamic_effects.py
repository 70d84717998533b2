"""Effects with states of their own: heel, and flow that answers late."""

from __future__ import annotations

import math

from tank2sim.cards.card import SteeredCard
from tank2sim.cards.terms import known_term
from tank2sim.dynamics.effects.effect import Effect, EffectParameter, EffectSymbols, with_steps_for
from tank2sim.dynamics.effects.forces import scales, speed_of_scaling, with_forces
from tank2sim.dynamics.effects.froude_scale import time_scale_passages
from tank2sim.dynamics.effects.particulars import model_particular
from tank2sim.dynamics.kinematics import heel, rate_of_heel
from tank2sim.dynamics.model import Model, Quantity, State


def _remembering(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """A share of the linear sway damping answers late: v in Y_v v and N_v v is v - share (v - z), dz/dt = (v - z)/tau.

    The simplest memory, of one decaying exponential, that vanishes in steady motion: Cummins (1962), The impulse
    response function and ship motions; Nomoto (1975), 14th ITTC: derivatives of manoeuvring that depend on frequency.
    """
    z = State(
        "flow_memory.v",
        "m/s",
        "Sway velocity that the flow remembers, positive to starboard",
        display_unit="knots",
        nominal=0.1 * card.model.speed_mps,
        derivative="flow_memory.vdot",
        start=model.symbol("initial.v"),
        steady=True,
    )
    late = model.symbol("motion.v") - z.symbol
    rate = Quantity(
        "flow_memory.vdot",
        "m/s2",
        "Rate of change of the sway velocity that the flow remembers",
        late / given["time_constant"],
    )
    scaling = scales(model, speed_of_scaling(model, card))
    Y, N = (
        -given["share"] * late * scaling.derivative(known_term(name)) * model.symbol(f"derivatives.{name}")
        for name in ("Yv", "Nv")
    )
    return with_steps_for(with_forces(model.extend(z, rate), Y=Y, N=N), "flow_memory.time_constant")


FLOW_MEMORY = Effect(
    name="flow_memory",
    acts_on="force",
    description="The flow round the hull needs time to answer a change of drift.",
    source="Cummins (1962), Schiffstechnik 9, in its simplest form; linear sway damping",
    parameters=(
        # Circulation settles within the time in which the flow passes the hull once or a part of it (sizes chosen
        # here).
        EffectParameter(
            "share", "share of the linear sway damping that answers late", -1.0, 1.0, absent=0.0, typical=(0.3,)
        ),
        EffectParameter(
            "time_constant_s", "time in which it answers", 0.05, 300.0, typical=time_scale_passages(0.4, 0.2, 0.8, 1.6)
        ),
    ),
    equations=_remembering,
    reads_derivatives=True,
)

TYPICAL_STABILITY = 0.05
"""Metacentric height in beams where a card gives none: in the middle of 0.03 to 0.08 of loaded merchant ships; a
project choice, as are the parameters' defaults."""


def _natural_period(card: SteeredCard) -> float:
    """Roll period (s): 2 pi k / sqrt(g GM) with k = 0.4 B, so 0.80 B/sqrt(GM): near 2 C B/sqrt(GM) of the IMO
    2008 Intact Stability Code, part A, 2.3."""
    beam = model_particular(card, "beam_m")
    height = card.ship.metacentric_height_m
    stable = height if height is not None and height > 0 else TYPICAL_STABILITY * beam
    return 2 * math.pi * 0.4 * beam / math.sqrt(card.environment.gravity_mps2 * stable)


def _rolling(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """Heel drives Y and N, and the turn drives heel, outwards:

        d2phi/dt2 + 2 zeta w dphi/dt + w^2 (phi + h u r/g) = 0,   w = 2 pi/T
        Y, N = 1/2 rho L^2 V^2 (Y_phi, L N_phi) phi

    h = (height of the centre of gravity over the centre of lateral force)/(metacentric height). Hirano and Takashina
    (1980), A calculation of ship turning motion taking coupling effect due to heel into consideration, Trans. West
    Japan Soc. Naval Arch. 59; Son and Nomoto (1981). Only h times Y_phi, N_phi acts on the path; h alone sets the heel.
    """
    pulse = 2 * math.pi / given["roll_period"]
    driving = model.symbol("motion.u") * model.symbol("motion.r") / card.environment.gravity_mps2
    (phi, p), _ = heel(at_rest=True)
    phidot = rate_of_heel(p.symbol)
    pdot = Quantity(
        p.derivative,
        "rad/s2",
        "Acceleration of heel",
        -(pulse**2) * (phi.symbol + given["heel_ratio"] * driving) - 2 * given["damping"] * pulse * p.symbol,
        display_unit="deg/s2",
        nominal=1e-3,
    )
    scaling = scales(model, speed_of_scaling(model, card))
    rolling = with_forces(
        model.extend(phi, p, phidot, pdot, outputs=["motion.phi", "motion.p"]),
        Y=scaling.force * given["Yphi"] * phi.symbol,
        N=scaling.force * scaling.length * given["Nphi"] * phi.symbol,
    )
    return with_steps_for(rolling, "roll_coupling.roll_period", share=1 / (2 * math.pi))


ROLL_COUPLING = Effect(
    name="roll_coupling",
    resonant=True,
    acts_on="force",
    description="The ship heels in a turn, and a heeled hull is pushed and turned aside.",
    source="Hirano and Takashina (1980), Trans. West Japan Soc. Naval Arch. 59; Son and Nomoto (1981)",
    parameters=(
        # 0.05 rad of heel then give some 5 % of the forces of a hard turn (project choice).
        EffectParameter(
            "Yphi", "sway force by heel, prime, both positive to starboard", -0.05, 0.05, absent=0.0, typical=(1e-3,)
        ),
        EffectParameter(
            "Nphi", "yaw moment by heel, prime, both positive to starboard", -0.05, 0.05, absent=0.0, typical=(-5e-4,)
        ),
        # Period and damping are known about so well (project choice). The ratio stays: only its product with Yphi and
        # Nphi acts.
        EffectParameter(
            "roll_period_s",
            "natural period of roll",
            0.2,
            60.0,
            _natural_period,
            spread=lambda card: 0.2 * _natural_period(card),
        ),
        EffectParameter("damping", "roll damping over the critical one", 0.0, 2.0, 0.1, spread=0.05),
        EffectParameter("heel_ratio", "outward heel in a steady turn over u r/g", 0.0, 20.0, 3.0),
    ),
    equations=_rolling,
    in_roll=True,
)
