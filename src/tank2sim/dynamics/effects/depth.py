"""Water of finite depth: more resistance, squat, the water left under the keel, and grounding."""

from __future__ import annotations

from typing import Any

import casadi as ca

from tank2sim.cards.card import SteeredCard
from tank2sim.dynamics.effects.derivatives import DEEPEST_M, at_depth, least_depth
from tank2sim.dynamics.effects.effect import Effect, EffectParameter, EffectSymbols
from tank2sim.dynamics.effects.forces import scales, with_forces, with_validity
from tank2sim.dynamics.effects.particulars import model_particular, with_particulars
from tank2sim.dynamics.effects.propeller import resistance_prime
from tank2sim.dynamics.hull import inside_range
from tank2sim.dynamics.model import Model, Quantity
from tank2sim.units import KNOT_MPS

MIDSHIP_COEFFICIENT = 0.98
"""Area of the midship section over B T, of usual merchant ships (0.97 to 0.995): a project choice."""

LARGEST_LOSS = 0.5
"""Largest loss of speed by shallow water over the speed in deep water: far above what the formula was made from, and
its force stays finite. Project choice."""

LARGEST_DEPTH_FROUDE, DEPTH_FROUDE_MARGIN = 0.7, 0.3
"""Depth Froude number up to which formulas of squat are said to hold (PIANC 2014, report 121, appendix D), and the
distance, to the critical speed, over which ``validity`` falls: project choice."""

CLEARANCE_MARGIN = 0.1
"""``validity`` falls from 1 to 0 as the water under the keel falls from this share of the draught to none: least
clearances of harbours in sheltered water are about so much. Project choice."""

_STILL_MPS = 1e-3
"""Added to the square of a speed that is divided by: far below any speed at which the bottom is felt."""


def _square(model: Model) -> ca.SX:
    return model.symbol("motion.u") ** 2 + _STILL_MPS**2


def _relative_loss(model: Model, section: ca.SX, depth: ca.SX, gravity: float) -> ca.SX:
    """Loss of speed by shallow water over the speed in deep water, from 0 to :data:`LARGEST_LOSS`."""
    blocked = ca.fmax(section / depth**2 - 0.05, 0)
    waves = 1 - ca.sqrt(ca.tanh(gravity * depth / _square(model)))
    return ca.fmin(0.1242 * blocked + waves, LARGEST_LOSS)


def barrass_squat(block: Any, speed_mps: Any) -> Any:
    """Return the largest sinkage in open shallow water, m, by Barrass (2004).

    Parameters
    ----------
    block : float or symbol
        Block coefficient.
    speed_mps : float or symbol
        Speed through the water.
    """
    return block * (speed_mps / KNOT_MPS) ** 2 / 100


def icorels_squat(volume_m3: Any, length_m: Any, square: Any) -> Any:
    """Return the largest sinkage, m, by ICORELS (1980).

    Parameters
    ----------
    volume_m3, length_m : float or symbol
        Displaced volume and length of the ship.
    square : float or symbol
        Square of the depth Froude number, below 1.
    """
    return 2.4 * volume_m3 / length_m**2 * square / (1 - square) ** 0.5


def _with_finite_depth(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """Derivatives as in ``water_depth``, and with Fr_h = u/sqrt(g H):

        X -= 1/2 rho L^2 R' u|u| (1/(1 - l)^2 - 1),   l = 0.1242 (A_M/H^2 - 0.05) + 1 - sqrt(tanh(g H/u^2))
        squat by Barrass = C_B u_k^2/100, u_k in knots;   by ICORELS = 2.4 nabla/L^2 Fr_h^2/sqrt(1 - Fr_h^2)

    l is the loss of speed by Lackenby (1963), after Schlichting (1934), The effect of shallow water on ship speed, the
    Shipbuilder 70, as in ITTC 7.5-04-01-01.1: the resistance is that at the speed that the same power gives in deep
    water. R' is the card's. Barrass (2004), Thirty-two years of research into ship squat, for open shallow
    water; ICORELS (1980), PIANC Bulletin 35. Both are of the whole ship's largest sinkage, at the bow of full ships.
    The clearance is depth less draught less the larger of the two.
    """
    model = at_depth(model, given, card)
    model, (beam, draught, block) = with_particulars(model, card, "beam_m", "draught_m", "block_coefficient")
    depth, gravity = given["depth"], card.environment.gravity_mps2
    u, usual = model.symbol("motion.u"), model_particular(card, "draught_m")
    loss = given["resistance"] * _relative_loss(model, ca.SX(MIDSHIP_COEFFICIENT * beam * draught), depth, gravity)
    resistance = scales(model, ca.SX(1)).force * resistance_prime(model, card) * u * ca.fabs(u)
    slowed = with_forces(model, X=-resistance * (1 / (1 - loss) ** 2 - 1))
    square = u**2 / (gravity * depth)
    volume = block * beam * draught * model.symbol("ship.length")
    sinkages = (
        ("Barrass (2004)", "barrass", barrass_squat(block, u)),
        ("ICORELS (1980)", "icorels", icorels_squat(volume, model.symbol("ship.length"), ca.fmin(square, 0.9))),
    )
    squats = [
        Quantity(f"squat.{name}", "m", f"Largest sinkage by squat, {source}", value, nominal=0.1 * usual)
        for source, name, value in sinkages
    ]
    clearance = Quantity(
        "water.under_keel_clearance",
        "m",
        "Water under the keel: depth less draught less the larger squat; not above zero: aground",
        depth - draught - ca.fmax(squats[0].symbol, squats[1].symbol),
        nominal=usual,
    )
    left = inside_range(CLEARANCE_MARGIN - clearance.symbol / draught, CLEARANCE_MARGIN)
    critical = inside_range(ca.fabs(u) / ca.sqrt(gravity * depth) - LARGEST_DEPTH_FROUDE, DEPTH_FROUDE_MARGIN)
    shown = (*squats, clearance)
    deep = slowed.extend(*shown, outputs=[quantity.name for quantity in shown])
    deep = with_validity(deep, "under_keel_clearance", "water under the keel (0: aground)", left)
    return with_validity(deep, "depth_froude", "the depth Froude number", critical)


FINITE_DEPTH = Effect(
    name="finite_depth",
    acts_on="force",
    description="Shallow water slows the ship, lets it sink deeper and turn wider, until it grounds.",
    source="Kijima et al. (1990); Lackenby (1963), ITTC 7.5-04-01-01.1; Barrass (2004); ICORELS (1980)",
    parameters=(
        EffectParameter("depth_m", "depth of the water", least_depth, DEEPEST_M, input_name="water.depth"),
        EffectParameter(
            "resistance", "share of the added resistance that acts (0: the card is of this depth)", 0.0, 1.0, 1.0
        ),
    ),
    equations=_with_finite_depth,
    reads_derivatives=True,
    sought=False,
    terminal="Water under the ship",
)
