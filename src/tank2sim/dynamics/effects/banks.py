"""Banks and walls alongside, at distances that are inputs."""

from __future__ import annotations

import casadi as ca

from tank2sim.cards.card import SteeredCard
from tank2sim.dynamics.effects.effect import Effect, EffectParameter, EffectSymbols
from tank2sim.dynamics.effects.forces import with_forces, with_validity
from tank2sim.dynamics.effects.froude_scale import lengths
from tank2sim.dynamics.effects.particulars import model_particular, with_particulars
from tank2sim.dynamics.hull import inside_range
from tank2sim.dynamics.model import Model, Quantity

# Fitted by benchmarks/bank.py to the steady tests without drift of Lataire, Vantorre and Eloot (2009), a model of an
# 8000 TEU container ship at T/h of 0.50 to 0.91: five with the propeller at work, three with it stopped.
SWAY, YAW = 0.22, 0.107
"""Y/(1/2 rho L T u^2 y_B) and -N/(1/2 rho L^2 T u^2 y_B) with the propeller at work."""

STOPPED_SWAY, STOPPED_SWAY_BY_DEPTH = 0.14, 0.28
STOPPED_YAW, STOPPED_YAW_EXPONENT = 0.095, 2.5
"""The same with the propeller stopped: 0.14 - 0.28 (T/h)^2, which near the bottom pushes the ship away, and
0.095 (T/h)^2.5."""

AT_WORK = 0.6
"""Revolutions for the speed, over those that hold it, from which the propeller counts as at work; the least at which
the bank was measured with the propeller turning. Linear below it, to zero for a stopped propeller: project choice."""

SQUAT_BY_BANK, SQUAT_BY_PROPELLER = 0.28, 0.31
"""Shares of the squat of ICORELS that a bank adds for each unit of y_B, and a propeller at work: least squares over 25
sinkages of the same model."""

SHALLOWEST, DEEPEST = 0.91, 0.50
"""T/h of the tests: beyond them the values at their ends are taken."""

LARGEST_BANK, BANK_MARGIN = 0.26, 0.26
"""Largest y_B of the tests, and the distance beyond it over which ``validity`` falls to zero: project choice."""

FAR_M = 1e4
"""Distance without a bank, or without another ship, m: project choice."""

STEEPEST_SHARE = 0.95
"""Largest half height of a bank over its distance from the centre line: above it the bank is below the keel's middle.
Project choice."""

_STILL_MPS = 1e-3
"""Added to a speed that is divided by: far below any at which a bank is felt."""


def mean_nearness(distance: ca.SX, rise: ca.SX) -> ca.SX:
    """Mean of 1/y over the draught, 1/m, y the distance of a plane bank from the centre line.

    Parameters
    ----------
    distance : casadi.SX
        y at half the draught, m.
    rise : casadi.SX
        How much nearer the bank is at the keel than there, m; at most :data:`STEEPEST_SHARE` of the distance counts.
    """
    share = ca.fmin(rise / distance, STEEPEST_SHARE)
    small = share < 1e-3
    safe = ca.if_else(small, 0.5, share)
    # artanh(s)/s; the first two terms of its series where s is small
    return ca.if_else(small, 1 + share**2 / 3, ca.log((1 + safe) / (1 - safe)) / (2 * safe)) / distance


def _propeller_at_work(model: Model) -> ca.SX:
    """From 0, stopped, to 1, at work as under way; 1 for a model without revolutions."""
    if "propeller.speed_actual" not in model:
        return ca.SX(1)
    revolutions = model.symbol("propeller.speed_actual") / model.symbol("propulsion.nominal_speed")
    speed = (ca.fmax(model.symbol("motion.u"), 0) + _STILL_MPS) / model.symbol("ship.speed")
    return ca.fmin(ca.fmax(revolutions / speed / AT_WORK, 0), 1)


def _with_banks(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """Y = 1/2 rho L T u^2 y_B c_Y, N = -1/2 rho L^2 T u^2 y_B c_N, y_B = B/2 (mean(1/y_S) - mean(1/y_P)).

    y_S, y_P are the distances of the banks from the centre line. y_B is by Ch'ng, Doctors and Renilson (1993),
    A method of calculating the ship-bank interaction forces and moments in restricted water, International
    Shipbuilding Progress 40, 7-23, which has it at the surface and at half the draught; the split by the propeller is
    that of Vantorre, Delefortrie, Eloot and Laforce (2003), Experimental investigation of ship-bank interaction forces,
    MARSIM. Both are cited without the papers at hand. Going astern, both forces are zero.
    """
    model, (beam, draught) = with_particulars(model, card, "beam_m", "draught_m")
    u, length = ca.fmax(model.symbol("motion.u"), 0), model.symbol("ship.length")
    rise = given["slope"] * draught / 2
    starboard, port = (mean_nearness(given[f"{side}_distance"] + beam / 2, rise) for side in ("starboard", "port"))
    nearness = beam / 2 * (starboard - port)
    at_work = _propeller_at_work(model)
    depth = model.symbol("water.depth") if "water.depth" in model else ca.SX(draught / DEEPEST)
    shallow = ca.fmin(ca.fmax(draught / depth, DEEPEST), SHALLOWEST)
    sway = at_work * given["sway_coefficient"] + (1 - at_work) * (STOPPED_SWAY - STOPPED_SWAY_BY_DEPTH * shallow**2)
    yaw = at_work * given["yaw_coefficient"] + (1 - at_work) * STOPPED_YAW * shallow**STOPPED_YAW_EXPONENT
    force = 0.5 * model.symbol("ship.water_density") * length * draught * u**2 * nearness
    drawn = with_forces(model, Y=force * sway, N=-force * length * yaw)
    inside = inside_range(ca.fabs(nearness) - LARGEST_BANK, BANK_MARGIN)
    drawn = with_validity(drawn, "bank", "the distance of a bank", inside)
    if "water.under_keel_clearance" not in model:
        return drawn
    added = SQUAT_BY_BANK * ca.fabs(nearness) + SQUAT_BY_PROPELLER * at_work
    squat = Quantity(
        "squat.bank",
        "m",
        "Largest sinkage by squat near a bank: by ICORELS, increased by bank and propeller",
        model.symbol("squat.icorels") * (1 + added),
        nominal=0.1 * model_particular(card, "draught_m"),
    )
    drawn = drawn.extend(squat, outputs=[squat.name])
    return drawn.redefine(
        "water.under_keel_clearance", lambda clearance: ca.fmin(clearance, depth - draught - squat.symbol)
    )


def _distance(side: str) -> EffectParameter:
    return EffectParameter(
        f"{side}_distance_m",
        f"distance of the bank from the ship's {side} side at half the draught ({FAR_M:.0f}: none)",
        0.0,
        FAR_M,
        input_name=f"bank.{side}_distance",
        absent=FAR_M,
        typical=lengths(0.25),  # about two beams: a bank that is felt (project choice)
    )


BANK = Effect(
    name="bank",
    acts_on="force",
    description="Banks or walls alongside draw the ship to the nearer one and turn its bow away, by their distances.",
    source="Ch'ng, Doctors and Renilson (1993); Vantorre et al. (2003); fitted to Lataire, Vantorre and Eloot (2009)",
    parameters=(
        _distance("port"),
        _distance("starboard"),
        EffectParameter("slope", "run of the banks per unit of rise (0: vertical walls)", 0.0, 20.0, 0.0),
        EffectParameter("sway_coefficient", "bank force coefficient in sway, propeller at work", -1.0, 2.0, SWAY),
        EffectParameter("yaw_coefficient", "bank moment coefficient, propeller at work, bow away", -1.0, 1.0, YAW),
    ),
    equations=_with_banks,
    sought=False,
    terminal="Banks alongside",
)
