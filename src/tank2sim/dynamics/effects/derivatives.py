"""Effects that change the ship's own derivatives: dampings, couplings, added masses, water depth, trim."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import casadi as ca

from tank2sim.arguments import range_of
from tank2sim.cards.card import SteeredCard
from tank2sim.cards.terms import known_term
from tank2sim.dynamics.abkowitz import ACCELERATION_TERMS, ALL_TERMS
from tank2sim.dynamics.effects.effect import Effect, EffectEquations, EffectParameter, EffectSymbols
from tank2sim.dynamics.effects.forces import scales
from tank2sim.dynamics.effects.froude_scale import lengths
from tank2sim.dynamics.effects.particulars import model_particular, with_particulars
from tank2sim.dynamics.model import Model
from tank2sim.quantities import WaterDepth

USUAL_CHANGE = 0.15
"""Relative change of linear damping at which a search begins: as derivatives of one ship from different tanks differ
(SIMMAN 2008); project choice. Added masses, which are measured less well, have more."""


def with_changes(model: Model, changes: Mapping[str, ca.SX], card: SteeredCard) -> Model:
    """The model with derivatives changed by so much: name to an expression in the prime system, of the old ones.

    Raises
    ------
    InputError
        The card's model has no derivative of that name (the linear one has few).
    """
    for name in changes:
        if f"derivatives.{name}" not in model:
            raise card.fault("model.kind", f"a {card.model.kind} model has no {name}", 'set kind = "abkowitz"')
    full = {name: f"derivatives.{name}" for name in changes}
    return model.substitute_all({full[name]: model.symbol(full[name]) + change for name, change in changes.items()})


def hydrodynamic(model: Model, name: str, card: SteeredCard) -> ca.SX:
    """The hydrodynamic part of a derivative (prime): without the inertia of the ship that "total" cards put into it.

    With ``yaw_rate_terms = "total"``, X_vr, X_rr, Y_r, N_r contain m, m x_G, -m, -m x_G of (3.1). Of the terms by speed
    next to them, as Y_ru, the same share is taken as hydrodynamic, twice the whole at most (project choice: in the
    Mariner's data Y_ru and N_ru equal Y_r and N_r).
    """
    symbol = model.symbol(f"derivatives.{name}")
    inertial = inertial_parts(model, model.symbol("ship.mass"), model.symbol("ship.x_G"), card)
    base = name.rstrip("u")
    if base not in inertial:
        return symbol
    whole = model.symbol(f"derivatives.{base}")
    part = whole - inertial[base]
    if name == base:
        return part
    return symbol * ca.fmin(2.0, ca.fmax(-2.0, part / ca.if_else(whole == 0, 1.0, whole)))


def inertial_parts(model: Model, mass: ca.SX, x_G: ca.SX, card: SteeredCard) -> dict[str, ca.SX]:
    """Rigid-body parts in derivatives of a "total" card, of a mass (kg) whose centre is x_G (m) forward; prime, none
    of others."""
    if card.manoeuvring().model.yaw_rate_terms == "hydrodynamic":
        return {}
    mass, x_G = mass / scales(model, model.symbol("ship.speed")).mass, x_G / model.symbol("ship.length")
    return {"Xvr": mass, "Xrr": mass * x_G, "Yr": -mass, "Nr": -mass * x_G}


def _magnified(names: Iterable[str]) -> EffectEquations:
    """Equations that magnify derivatives by 1 + ``factor``, and their change by speed where the model has that."""
    always = tuple(names)

    def equations(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
        factor = given["factor"]
        by_speed = [name for name in _by_speed(always) if f"derivatives.{name}" in model]
        changes = {name: factor * hydrodynamic(model, name, card) for name in (*always, *by_speed)}
        return with_changes(model, changes, card)

    return equations


def _by_speed(names: Iterable[str]) -> tuple[str, ...]:
    """Terms that are these derivatives times a change of speed (Nru of Nr): the same water at other speeds."""
    return tuple(name for base in names for power in ("u", "uu") if (name := base + power) in ALL_TERMS)


def _added(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """Derivatives change by the parameters of the same names."""
    return with_changes(model, given, card)


CUBIC_YAW_DAMPING = Effect(
    name="cubic_yaw_damping",
    acts_on="force",
    description="The hull resists fast turning more than in proportion to the rate of turn.",
    source="(3.8) of Krezelewski and Misiag; Abkowitz (1964)",
    parameters=(
        # About 15 % of the Mariner's N by turning at r' = 0.5, as cubic terms have there (project choice).
        EffectParameter("Yrrr", "change of Yrrr, prime", -0.1, 0.1, absent=0.0, typical=(1e-3,)),
        EffectParameter("Nrrr", "change of Nrrr, prime, negative damps", -0.1, 0.1, absent=0.0, typical=(-1e-3,)),
    ),
    equations=_added,
    changes=("Yrrr", "Nrrr"),
)

SWAY_YAW_COUPLING = Effect(
    name="sway_yaw_coupling",
    acts_on="force",
    description="Drifting and turning together give a force and a moment that neither gives alone.",
    source="(3.8) of Krezelewski and Misiag; Abkowitz (1964)",
    parameters=(
        # At v' = 0.2 and r' = 0.5 about 15 % of the forces of the linear terms (project choice).
        EffectParameter("Yvrr", "change of Yvrr, prime", -0.5, 0.5, absent=0.0, typical=(-5e-3,)),
        EffectParameter("Nvrr", "change of Nvrr, prime", -0.5, 0.5, absent=0.0, typical=(-2e-3,)),
    ),
    equations=_added,
    changes=("Yvrr", "Nvrr"),
)

TURNING_DRAG = Effect(
    name="turning_drag",
    acts_on="force",
    description="The ship loses more (or less) speed in a turn.",
    source="(3.8) of Krezelewski and Misiag: the term X_vr v r",
    parameters=(
        EffectParameter(
            "Xvr",
            "change of Xvr, prime, positive slows a turning ship more (v r < 0)",
            -0.05,
            0.05,
            absent=0.0,
            typical=(
                2e-3,
            ),  # a quarter of the m' of a cargo ship, which X_vr + m' holds with added mass (project choice)
        ),
    ),
    equations=_added,
    changes=("Xvr",),
)

ADDED_YAW_INERTIA = Effect(
    name="added_yaw_inertia",
    acts_on="mass",
    description="More (or less) water turns with the ship when its rate of turn changes.",
    source="(3.7) of Krezelewski and Misiag: J_z - Nrdot; Alyshev (2019)",
    parameters=(EffectParameter("factor", "relative change of Nrdot", -1.0, 5.0, absent=0.0, typical=(0.3,)),),
    equations=_magnified(("Nrdot",)),
    changes=("Nrdot",),
)

ADDED_SWAY_MASS = Effect(
    name="added_sway_mass",
    acts_on="mass",
    description="More (or less) water moves with the ship when its drift changes.",
    source="(3.7) of Krezelewski and Misiag: m - Yvdot",
    parameters=(EffectParameter("factor", "relative change of Yvdot", -0.9, 5.0, absent=0.0, typical=(0.2,)),),
    equations=_magnified(("Yvdot",)),
    changes=("Yvdot",),
)

LINEAR_YAW_DAMPING = Effect(
    name="linear_yaw_damping",
    acts_on="force",
    description="The hull resists turning more (or less), at small rates of turn too.",
    source="(3.5) of Krezelewski and Misiag: hydrodynamic parts of Yr and Nr",
    parameters=(
        EffectParameter(
            "factor",
            "relative change of the hydrodynamic Yr and Nr at all speeds",
            -1.0,
            5.0,
            absent=0.0,
            typical=(USUAL_CHANGE,),
        ),
    ),
    equations=_magnified(("Yr", "Nr")),
    changes=("Yr", "Nr", *_by_speed(("Yr", "Nr"))),
)

LINEAR_SWAY_DAMPING = Effect(
    name="linear_sway_damping",
    acts_on="force",
    description="The hull resists drifting sideways more (or less), at small drift too.",
    source="(3.5) of Krezelewski and Misiag: Yv and Nv",
    parameters=(
        EffectParameter(
            "factor", "relative change of Yv and Nv at all speeds", -1.0, 5.0, absent=0.0, typical=(USUAL_CHANGE,)
        ),
    ),
    equations=_magnified(("Yv", "Nv")),
    changes=("Yv", "Nv", *_by_speed(("Yv", "Nv"))),
)


def _odd_in_motion(name: str) -> bool:
    term = known_term(name)
    return term.force in "YN" and not term.acceleration and term.d == 0 and (term.v + term.r) % 2 == 1


MAGNIFIED_BY_SHALLOW_WATER = (*ACCELERATION_TERMS, *(name for name in ALL_TERMS if _odd_in_motion(name)))
"""Added masses, and the terms of Y and N that are odd in v and r and have no rudder."""


def _in_shallow_water(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """Added masses and the odd sway and yaw terms of the hull, times 1 + magnification.

    Under a small keel clearance the flow goes round the ends instead of below, and all these rise together, to
    several times at H/T = 1.2: Brix (ed.) (1993), Manoeuvring Technical Manual; Vantorre (2003). One factor for all
    is project choice, for the data rarely show more; :data:`WATER_DEPTH` has the published factors.
    """
    names = [name for name in MAGNIFIED_BY_SHALLOW_WATER if f"derivatives.{name}" in model]
    return with_changes(model, {name: given["magnification"] * hydrodynamic(model, name, card) for name in names}, card)


SHALLOW_WATER = Effect(
    name="shallow_water",
    acts_on="force and mass",
    description="Near the bottom more water moves with the ship, and it resists drift and turning more.",
    source="Brix (ed.) (1993), Manoeuvring Technical Manual; Vantorre (2003), MARSIM",
    parameters=(
        EffectParameter(
            "magnification",
            "relative increase of added masses and of sway and yaw damping (0 in deep water)",
            -0.5,
            5.0,
            absent=0.0,
            typical=(0.3,),  # damping at a depth of some three draughts, by the factors below (project choice)
        ),
    ),
    equations=_in_shallow_water,
    reads_derivatives=True,
)


DEEPEST_M = range_of(WaterDepth)[1]
"""Depth of the deepest water, m."""

AGROUND = 0.95
"""Largest draught over depth: at 1 the ship is aground, and the fit of the source ends before. Project choice."""


def least_depth(card: SteeredCard) -> float:
    """Depth of the water (m) below which no ship of this draught floats with water under it."""
    return model_particular(card, "draught_m") / AGROUND


def at_depth(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """Y_v, N_v, N_r times f = 1/(1 - h)^n - h with h = T/H, as input ``water.depth`` says.

    n = 0.40 Cb B/T for Y_v, 0.425 Cb B/T for N_v, 1.5 - 14.28 T/L for N_r: Kijima, Katsuno, Nakiri and Furukawa (1990),
    J. Soc. Naval Arch. Japan 168. f is 1 in deep water. h is held below :data:`AGROUND`. Added masses,
    Y_r and the terms of higher order stay as they are; the card must be of deep water.
    """
    model, (beam, draught, block) = with_particulars(model, card, "beam_m", "draught_m", "block_coefficient")
    h = ca.fmin(draught / ca.fmax(given["depth"], draught), AGROUND)
    fullness = block * beam / draught
    powers = {"Yv": 0.40 * fullness, "Nv": 0.425 * fullness, "Nr": 1.5 - 14.28 * draught / card.ship.length_m}
    changes = {name: ((1 - h) ** -power - h - 1) * hydrodynamic(model, name, card) for name, power in powers.items()}
    return with_changes(model, changes, card)


WATER_DEPTH = Effect(
    name="water_depth",
    acts_on="force",
    description="The hull resists drift and turning more as the water under it becomes shallow.",
    source="Kijima, Katsuno, Nakiri and Furukawa (1990), J. Soc. Naval Architects of Japan 168",
    parameters=(
        # Not sought in trials: they show one factor of shallow water, SHALLOW_WATER's.
        EffectParameter("depth_m", "depth of the water", least_depth, DEEPEST_M, input_name="water.depth"),
    ),
    equations=at_depth,
    reads_derivatives=True,
    terminal="Water under the ship",
)


def _trimmed(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """Linear derivatives of a hull trimmed by tau at an unchanged mean draught T:

        Y_v (1 + 2/3 tau/T), Y_r (1 + 0.80 tau/T), N_v - 0.27 Y_v tau/T, N_r (1 + 0.30 tau/T)

    Inoue, Hirano and Kijima (1981), Hydrodynamic derivatives on ship manoeuvring, Int. Shipbuilding Progress 28 (321).
    """
    model, (draught,) = with_particulars(model, card, "draught_m")
    return trimmed(model, given["by_stern"] / draught, card)


def trimmed(model: Model, share: ca.SX, card: SteeredCard) -> Model:
    """The model with the linear derivatives of a hull trimmed by this share of its draught, as :data:`TRIM` has."""
    changes = {
        "Yv": 2 / 3 * share * hydrodynamic(model, "Yv", card),
        "Yr": 0.80 * share * hydrodynamic(model, "Yr", card),
        "Nr": 0.30 * share * hydrodynamic(model, "Nr", card),
        "Nv": -0.27 * share * hydrodynamic(model, "Yv", card),
    }
    return with_changes(model, changes, card)


TRIM = Effect(
    name="trim",
    acts_on="force",
    description="A hull deeper aft than forward keeps its course better, and one deeper forward worse.",
    source="Inoue, Hirano and Kijima (1981), International Shipbuilding Progress 28 (321)",
    parameters=(
        EffectParameter(
            "by_stern_m",
            "trim, draught aft less draught forward",
            -10.0,
            10.0,
            absent=0.0,
            typical=lengths(0.005),  # a tenth of a usual draught (project choice)
        ),
    ),
    equations=_trimmed,
    reads_derivatives=True,
)
