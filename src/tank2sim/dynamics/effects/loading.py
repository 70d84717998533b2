"""The ship at another loading condition than the card's: another mean draught, and a trim."""

from __future__ import annotations

import casadi as ca

from tank2sim.cards.card import SteeredCard
from tank2sim.cards.estimates import CLARKE_BRACKETS
from tank2sim.cards.terms import known_term
from tank2sim.dynamics.effects.derivatives import TRIM, hydrodynamic, inertial_parts, trimmed, with_changes
from tank2sim.dynamics.effects.effect import Effect, EffectParameter, EffectSymbols
from tank2sim.dynamics.effects.forces import scales, with_forces, with_validity
from tank2sim.dynamics.effects.particulars import model_particular, volume_exponent, with_particulars
from tank2sim.dynamics.effects.propeller import resistance_prime
from tank2sim.dynamics.hull import inside_range
from tank2sim.dynamics.model import Model, Quantity

BY_REGRESSION = ("Yv", "Nv", "Nr", "Yvdot", "Nrdot")
"""Derivatives that change in the ratio of Clarke's regressions. His Y_r, Y_rdot and N_vdot are small differences of
large numbers, and keep the ratio to (T/L)^2 that the card gives them."""

DEEPER, LIGHTER, DRAUGHT_MARGIN = 1.05, 0.9, 0.5
"""Draughts over the card's between which the estimates count as valid, and the distance beyond over which ``validity``
falls to zero, before the ballast of a tanker: the regressions scatter by 30 %, as much as Y_v changes at 0.75. Project
choice."""

LARGEST_TRIM, TRIM_MARGIN = 0.3, 0.3
"""Trim over the draught up to which the estimates count as valid, and the distance beyond over which ``validity`` falls
to zero. Project choice."""

EMERGED = 0.3
"""``validity`` falls from 1 to 0 as the draught at the stern falls from the diameter of the propeller to this share
less: the blades come out of the water. Project choice."""


def mean_draught(card: SteeredCard) -> float | None:
    """Mean draught of a card's ship, m, by its effect ``loading``, else as stated; None without either."""
    loaded = (entry.parameters for entry in card.effects if entry.name == LOADING.name)
    return next((one["mean_draught_m"] for one in loaded), card.ship.draught_m)


def waterplane_inertia(block: float) -> float:
    """Return I_L/(B L^3) of the waterplane about its transverse axis: 0.350 C_WP^2 - 0.405 C_WP + 0.146.

    D'Arcangelo (1969), Principles of Naval Architecture, as in Parsons (2003), Parametric design, Ship Design and
    Construction, chapter 11, cited without the books at hand; C_WP as in :func:`.volume_exponent`.

    Parameters
    ----------
    block : float
        Block coefficient at the card's draught.
    """
    waterplane = volume_exponent(block) * block
    return 0.350 * waterplane**2 - 0.405 * waterplane + 0.146


def _ratios(
    model: Model, ratio: ca.SX, beam: float, block: float, card_draught: float, card: SteeredCard
) -> dict[str, ca.SX]:
    """Factors of the hydrodynamic part of each derivative at `ratio` times the `card_draught` (m)."""
    bl, bt, volume = beam / card.ship.length_m, beam / card_draught, volume_exponent(block)

    def regression(name: str) -> ca.SX:
        bracket = CLARKE_BRACKETS[name]
        at_draught = bracket(bl, bt / ratio, block * ratio ** (volume - 1))
        return ca.SX(ratio**2 * (at_draught / bracket(bl, bt, block)))

    found = {}
    for full_name in model.parameter_names:
        name = full_name.removeprefix("derivatives.")
        if name == full_name or (term := known_term(name)).of_roll or term.d:
            continue
        if name == "Xudot":
            found[name] = ratio ** (5 / 3 * volume)
        elif name in BY_REGRESSION:
            found[name] = regression(name)
        elif term.acceleration or name == "Yr":
            found[name] = ratio**2
        elif term.v + term.r:
            found[name] = ratio
    return found


def _loaded(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """The ship at a mean draught T and a trim tau by the stern, from the card's T_0:

        m, J_z times k = (T/T_0)^(C_WP/C_B);   x_G - tau I_L/(V L)
        Y_v, N_v, N_r, Y_vdot, N_rdot in the ratio of Clarke's regressions at T and T_0;   X_udot times k^(5/3)
        Y_r, Y_rdot, N_vdot times (T/T_0)^2;   terms of higher order in v and r without rudder times T/T_0
        then by trim as Inoue, Hirano and Kijima (1981);   X -= 1/2 rho L^2 R' u|u| (k^(2/3) - 1)

    Clarke, Gedling and Hine (1983) for the linear terms, hydrodynamic parts; Soeding (1982) for X_udot; cross-flow drag
    goes with the side area for the higher terms; the Admiralty coefficient (ITTC 7.5-04-01-01.1) for the resistance.
    Draught, C_B and the areas above the water of all other effects follow. Coefficients of propeller, rudder and roll
    stay, with the card's GM.
    """
    model, (_, beam) = with_particulars(model, card, "draught_m", "beam_m")
    card_draught, block = (model_particular(card, key) for key in ("draught_m", "block_coefficient"))
    draught, trim, length = given["mean_draught"], given["trim"], model.symbol("ship.length")
    ratio = draught / card_draught
    filled = ratio ** volume_exponent(block)
    resistance = scales(model, ca.SX(1)).force * resistance_prime(model, card)
    along = model.symbol("motion.u")
    model = with_forces(model, X=-(filled ** (2 / 3) - 1) * resistance * along * ca.fabs(along))
    model = model.substitute("ship.draught", model.symbol("ship.draught") * ratio)
    model = trimmed(model, trim / draught, card)

    mass, x_G = model.symbol("ship.mass"), model.symbol("ship.x_G")
    shift = trim * waterplane_inertia(block) * length / (block * card_draught * filled)
    for name, value in (
        ("ship.x_G", x_G - shift),
        *((name, model.symbol(name) * filled) for name in _WITH_MASS if name in model),
    ):
        model = model.substitute(name, value)
    before, after = (inertial_parts(model, *parts, card) for parts in ((mass, x_G), (mass * filled, x_G - shift)))
    changes = {
        name: (factor - 1) * hydrodynamic(model, name, card) + (after[name] - before[name] if name in after else 0)
        for name, factor in _ratios(model, ratio, beam, block, card_draught, card).items()
    }
    model = with_changes(model, changes, card)
    displacement = Quantity(
        "loading.displacement",
        "kg",
        "Mass of the ship at the mean draught",
        mass * filled,
        nominal=card.rigid_body.mass * card.scales.mass,
    )
    stern = (draught + trim / 2) / model_particular(card, "propeller_diameter_m")
    valid = (
        inside_range(LIGHTER - ratio, DRAUGHT_MARGIN)
        * inside_range(ratio - DEEPER, DRAUGHT_MARGIN)
        * inside_range(ca.fabs(trim) / draught - LARGEST_TRIM, TRIM_MARGIN)
        * inside_range(1 - stern, EMERGED)
    )
    model = model.extend(displacement, outputs=[displacement.name])
    return with_validity(model, "loading", "a loading condition that is not the card's", valid)


_WITH_MASS = ("ship.mass", "ship.yaw_inertia", "ship.roll_inertia", "ship.weight")


def _a_little_lighter(card: SteeredCard) -> tuple[float]:
    return (LIGHTER * model_particular(card, "draught_m"),)


LOADING = Effect(
    name="loading",
    acts_on="force and mass",
    description="A ship that is deeper, lighter or trimmed has another mass, and other forces on the hull.",
    source="Clarke, Gedling and Hine (1983); Inoue, Hirano and Kijima (1981); Admiralty coefficient",
    parameters=(
        EffectParameter(
            "mean_draught_m", "mean draught, in place of the card's", 0.01, 50.0, typical=_a_little_lighter
        ),
        EffectParameter("trim_m", "trim in addition to the card's, positive by the stern", -10.0, 10.0, 0.0),
    ),
    equations=_loaded,
    reads_derivatives=True,
    includes=(TRIM.name,),
    sought=False,
    last=True,
)
