"""Effects on the force of the rudder and on its angle."""

from __future__ import annotations

import math

import casadi as ca

from tank2sim.cards.card import SteeredCard
from tank2sim.cards.terms import known_term
from tank2sim.dynamics.abkowitz import ALL_TERMS
from tank2sim.dynamics.effects.effect import Effect, EffectParameter, EffectSymbols
from tank2sim.dynamics.model import Model

STALL_WIDTH = math.radians(5.0)
"""Range of angle over which a stalling rudder loses its share of force, rad: project choice. The lift of all-movable
rudders falls off over some degrees past its maximum (Molland and Turnock 2007, Marine Rudders and Control Surfaces)."""


def with_rudder_force(model: Model, multiplier: ca.SX, equations: str = "XYN") -> Model:
    """The model with ``rudder.X``, ``rudder.Y`` and ``rudder.N``, or those of some `equations`, times `multiplier`."""
    for equation in equations:
        model = model.redefine(f"rudder.{equation}", lambda force: multiplier * force)
    return model


def _biased(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """The hull sees delta + d0: the rudder angle differs from its indicator."""
    return model.redefine("rudder.effective", lambda angle: angle + given["angle"])


RUDDER_BIAS = Effect(
    name="rudder_bias",
    acts_on="actuator",
    description="The rudder angle has a small constant offset from what its indicator shows.",
    source="formats of the ship card; kinematics",
    parameters=(
        EffectParameter(
            "angle_rad",
            "rudder angle when the indicator shows midships, positive to starboard",
            -0.35,
            0.35,
            absent=0.0,
            typical=(math.radians(1.0),),  # what a linkage or an indicator is out by (project choice)
        ),
    ),
    equations=_biased,
    behind_indicator=True,
)


def _more_effective(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """(1 + factor) F_delta, F_delta all terms of X, Y, N that hold the rudder."""
    return with_rudder_force(model, 1 + given["factor"])


RUDDER_EFFECTIVENESS = Effect(
    name="rudder_effectiveness",
    acts_on="force",
    description="The rudder gives more (or less) force than the card says.",
    source="(3.8) of Krezelewski and Misiag: its terms in delta",
    parameters=(
        EffectParameter(
            "factor",
            "relative change of the force of the rudder",
            -1.0,
            3.0,
            absent=0.0,
            typical=(0.15,),  # as rudder coefficients of model and ship differ, by wake and thrust (project choice)
        ),
    ),
    equations=_more_effective,
    changes=tuple(name for name in ALL_TERMS if known_term(name).d),
    magnified_by="factor",
)


SLOWEST_IN_JET = 0.2
"""Speed over u0 below which the jet over a rudder is compared with this in place of the flow (project choice:
slower than any turn; the forces at low speed have a jet of their own)."""


def _in_slipstream(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """F_delta (1 + (1 - s) g (1 - u/u0) + s ((w/U)^2 - 1)), w = U + g/2 (u0 n/n0 - U): the propeller keeps up the flow
    over the rudder while the ship loses speed; g is ``gain``, s is ``jet``.

    Both are the same to first order in the loss of speed at n0. w is not negative, nor is n; U is U, or
    :data:`SLOWEST_IN_JET` u0 if larger. Slipstream of momentum theory: Brix (ed.) (1993), Manoeuvring Technical Manual;
    Ogawa and Kasai (1978), Int. Shipbuilding Progress 25 (292).
    """
    u0 = model.symbol("ship.speed")
    by_loss = 1 + given["gain"] * (1 - model.symbol("motion.u") / u0)
    driven = ca.SX(1)
    if "propeller.speed_actual" in model:
        driven = ca.fmax(model.symbol("propeller.speed_actual"), 0) / model.symbol("propulsion.nominal_speed")
    past = ca.fmax(model.symbol("motion.speed"), SLOWEST_IN_JET * u0)
    by_jet = ca.fmax(1 + given["gain"] / 2 * (driven * u0 / past - 1), 0) ** 2
    return with_rudder_force(model, by_loss + given["jet"] * (by_jet - by_loss))


RUDDER_SLIPSTREAM = Effect(
    name="rudder_slipstream",
    acts_on="force",
    description="The propeller's jet keeps up the force of the rudder when the ship has lost speed.",
    source="Brix (ed.) (1993), Manoeuvring Technical Manual; Ogawa and Kasai (1978)",
    parameters=(
        EffectParameter(
            "gain",
            "relative gain of rudder force by relative loss of speed",
            -3.0,
            5.0,
            absent=0.0,
            typical=(0.7,),  # below the 1 or 2 of a jet that keeps its speed altogether (project choice)
        ),
        EffectParameter(
            "jet",
            "share of a jet that follows the revolutions, its force with the square of its speed",
            0.0,
            1.0,
            0.0,
            optional=True,
            typical=(0.0, 1.0),
            spread=1.0,  # nothing says beforehand which of the two it is (project choice)
        ),
    ),
    equations=_in_slipstream,
    in_mmg=True,
)


def _stalled(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """Y and N times 1 - loss s, X times 1 - drag loss s, s = 3 a^2 - 2 a^3 rising from 0 to 1 over ``width`` above the
    angle of stall: with ``drag`` 1 the force normal to the rudder falls off, with 0 the lift, and the drag stays.
    """
    a = ca.fmax(0, ca.fmin(1, (ca.fabs(model.symbol("rudder.effective")) - given["angle"]) / given["width"]))
    lost = given["loss"] * a**2 * (3 - 2 * a)
    return with_rudder_force(with_rudder_force(model, 1 - given["drag"] * lost, "X"), 1 - lost, "YN")


RUDDER_STALL = Effect(
    name="rudder_stall",
    acts_on="force",
    description="Beyond some angle the flow leaves the rudder, which then loses a share of its force.",
    source="Molland and Turnock (2007), Marine Rudders and Control Surfaces, chapter 5",
    parameters=(
        EffectParameter(
            "angle_rad",
            "rudder angle at which stall begins, either way",
            0.0,
            math.pi / 2,
            # Rudders of usual aspect ratio stall at 15 to 35 deg: Molland and Turnock (2007), chapter 5.
            typical=tuple(math.radians(angle) for angle in (20.0, 25.0, 15.0, 30.0)),
        ),
        EffectParameter(
            "loss",
            "share of the rudder force that is lost beyond it",
            0.0,
            1.0,
            absent=0.0,
            typical=(0.4,),  # project choice
        ),
        EffectParameter(
            "width_rad",
            "range of angle over which it is lost",
            math.radians(1.0),  # a step would have no derivatives
            math.radians(30.0),
            STALL_WIDTH,
            optional=True,
            typical=(STALL_WIDTH, 3 * STALL_WIDTH),
            spread=math.radians(10.0),  # behind a ship it may be gradual (project choice)
        ),
        EffectParameter(
            "drag",
            "share of that loss which the longitudinal force has too",
            0.0,
            1.0,
            1.0,
            optional=True,
            typical=(0.0, 1.0),
            spread=1.0,  # nothing says beforehand which of the two it is (project choice)
        ),
    ),
    equations=_stalled,
)
