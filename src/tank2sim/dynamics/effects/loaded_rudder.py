"""The rudder in the slipstream of a loaded propeller, with the flow turned towards it by hull and propeller."""

from __future__ import annotations

import casadi as ca

from tank2sim.cards.card import SteeredCard
from tank2sim.dynamics.effects.effect import Effect, EffectParameter, EffectSymbols
from tank2sim.dynamics.effects.forces import scales
from tank2sim.dynamics.effects.rudder import RUDDER_SLIPSTREAM
from tank2sim.dynamics.model import Model

LEAST_INFLOW = 0.05
"""The flow over the rudder is never slower than this share of u0: the formula does not hold for a propeller that turns
astern, and must not divide by zero there (project choice)."""


def _in_loaded_slipstream(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """Rudder forces by angle of attack and inflow speed.

    w = U + k (u0 n/n0 - U) is the inflow speed over its share at u0 and n0; alpha = delta + atan(gamma (v + l L r)/w);
    the foil's forces are

    Y = 1/2 rho L^2 w^2 sin(alpha) cos(delta) Y_d, N likewise with N_d and L,
    X = 1/2 rho L^2 w^2 sin(alpha) sin(delta) X_dd.

    They replace the polynomial's rudder, less 1/2 rho L^2 gamma (v + l L r) U Y_d (N likewise): to first order the
    force at delta = 0 at the nominal loading, which is part of the card's Yv, Nv, Yr, Nr. Of a polynomial that was
    measured at the nominal loading, the share m stays; of the foil's forces, the share m of those at that loading
    (w = U) is then subtracted in the place of their first order, so that with m = 1 what the loading changes is added.
    After the rudder of the MMG model: Yasukawa and Yoshimura (2015), J. Mar. Sci. Technol. 20, 37-52, with its
    slipstream linear in the loading; m is this project's.
    """
    v, r, delta = (model.symbol(name) for name in ("motion.v", "motion.r", "rudder.effective"))
    u0, length = model.symbol("ship.speed"), model.symbol("ship.length")
    speed = model.symbol("motion.speed")
    driven = u0
    if "propeller.speed" in model:
        driven = u0 * model.symbol("propeller.speed_actual") / model.symbol("propulsion.nominal_speed")
    across = given["straightening"] * (v + given["lever"] * length * r)

    def lift(flow: ca.SX) -> ca.SX:
        """w^2 sin(alpha), without the angle itself."""
        w = ca.fmax(flow, LEAST_INFLOW * u0)
        return w**2 * (w * ca.sin(delta) + across * ca.cos(delta)) / ca.sqrt(w**2 + across**2)

    force, share = scales(model, ca.SX(1)).force, given["measured"]
    slope = {name: model.symbol(f"derivatives.{name}") for name in ("Yd", "Nd")}
    drag = model.symbol("derivatives.Xdd") if "derivatives.Xdd" in model else ca.SX(0)
    change = lift(speed + given["loading"] * (driven - speed)) - share * lift(speed)
    side = change * ca.cos(delta) - (1 - share) * across * speed
    return (
        model.redefine("rudder.X", lambda measured: share * measured + force * change * ca.sin(delta) * drag)
        .redefine("rudder.Y", lambda measured: share * measured + force * side * slope["Yd"])
        .redefine("rudder.N", lambda measured: share * measured + force * length * side * slope["Nd"])
    )


LOADED_RUDDER = Effect(
    name="loaded_rudder",
    acts_on="force",
    description="The propeller's jet over the rudder grows as the ship slows, and meets it at the angle of the flow.",
    source="rudder of the MMG model: Yasukawa and Yoshimura (2015), J. Mar. Sci. Technol. 20, 37-52",
    parameters=(
        # It replaces the polynomial's rudder, so it vanishes nowhere. The KVLCC2 of Yasukawa and Yoshimura
        # (2015) has gamma_R = 0.40 and 0.64 and l_R' = -0.71; the loading is a project choice.
        EffectParameter(
            "loading",
            "relative gain of inflow speed at the rudder by relative loss of the ship's speed",
            0.0,
            1.5,
            typical=(0.6, 0.2),
        ),
        EffectParameter("straightening", "share of the cross flow that reaches the rudder", 0.0, 2.0, typical=(0.5,)),
        EffectParameter(
            "lever",
            "place where the cross flow is taken, in ship lengths forward of midships",
            -4.0,
            0.0,
            typical=(-0.7,),
        ),
        EffectParameter(
            "measured",
            "share of the card's own rudder forces that stays, as measured at the nominal loading",
            0.0,
            1.0,
            0.0,
            typical=(0.0, 1.0),
            optional=True,
            spread=1.0,  # nothing says beforehand how far a polynomial holds (project choice)
        ),
    ),
    equations=_in_loaded_slipstream,
    in_mmg=True,
    reads_derivatives=True,
    includes=(RUDDER_SLIPSTREAM.name,),
)
