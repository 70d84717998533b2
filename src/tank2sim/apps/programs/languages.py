"""A ship's card in another language: a polynomial for an MMG ship, other conventions, other programs."""

from __future__ import annotations

import math
from dataclasses import replace

from tank2sim.apps.programs.conventions import Conventions, in_conventions
from tank2sim.apps.programs.forms import FORMS
from tank2sim.apps.programs.mmg_programs import mmgdynamics_text, shipmmg_text
from tank2sim.apps.programs.polynomial_fit import (
    SCATTER,
    fit_polynomial,
    manoeuvre_motions,
    polynomial_card,
    scattered_motions,
)
from tank2sim.apps.programs.program_code import mss_function, pvs_class
from tank2sim.apps.programs.program_files import ProgramFiles, figure_changes
from tank2sim.apps.programs.robotics import (
    AddedMass,
    gazebo_text,
    growth_per_step,
    place_of_added_mass,
    vrx_model,
    vrx_terms,
    vrx_text,
)
from tank2sim.cards import Card, ManoeuvringCard, SteeredBy, SteeredCard
from tank2sim.cards.card import MmgCard
from tank2sim.cards.reading import changed_text, craft_in_scaling, parse_card
from tank2sim.dynamics import build
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.dynamics.model import Model
from tank2sim.errors import ArgumentError

_OF_CRAFT = ("small_craft", "gazebo", "vrx")
_FOLDERS = ", ".join(name for name, form in FORMS.items() if form.writer)
_OF_MMG = {"shipmmg": shipmmg_text, "mmgdynamics": mmgdynamics_text}


def converted(
    card: Card, to: str, wanted: Conventions, scatter: float | None, added_mass: AddedMass | None = None
) -> ProgramFiles:
    """A card in another language.

    `to`: Language, as of ``convert``; `wanted`: Of the new card; `scatter`: Spread of the motions of a fit about
    standard manoeuvres; `added_mass`: Where Gazebo and VRX have it: :func:`.place_of_added_mass`.

    Raises InputError: The card cannot be had in that language.
    """
    if FORMS[to].writer:
        if not wanted.unchanged or scatter is not None or added_mass is not None:
            remedy = "leave scaling, rudder sign, origin, scatter and added mass out"
            raise ArgumentError("to", to, "has conventions of its own", remedy)
        made = FORMS[to].files(card.steered())
        return replace(made, losses=(*made.losses, *_lost_sensors(card.steered())))
    if card.steered().steered_by is SteeredBy.THRUSTERS:
        return _of_craft(card.steered(), to, wanted, added_mass)
    if added_mass is not None:
        raise ArgumentError("added_mass", added_mass, "is of craft in gazebo and vrx alone", "leave it out")
    if to in _OF_CRAFT:
        problem = f"is {card.model.kind}, and {to} takes cards of small craft"
        raise card.fault("model.kind", problem, f"convert it to {_FOLDERS}, mss or pvs")
    given = card.manoeuvring()
    if abs(wanted.origin_m) > given.ship.length_m:
        raise ArgumentError("origin_m", f"{wanted.origin_m:g}", "is more than a length from midships", "give it in m")
    if to not in ("abkowitz", "mmg"):
        if not wanted.unchanged:
            raise ArgumentError("to", to, "has conventions of its own", "leave scaling, rudder sign and origin out")
        return _program(given, to)
    return _as_card(given, to, wanted, SCATTER if scatter is None else scatter)


def _as_card(given: ManoeuvringCard, to: str, wanted: Conventions, scatter: float) -> ProgramFiles:
    """A polynomial or an MMG card."""
    if to == "mmg" and not isinstance(given, MmgCard):
        problem = f"is {given.model.kind}: without thrust and rudder force its terms cannot be split into MMG's"
        raise given.fault("model.kind", problem, "convert an MMG card to abkowitz, not the other way")
    losses: tuple[str, ...] = ()
    if wanted.origin_m:
        losses = (
            "U of the new origin scales the numbers now: a difference of second order in the distance and r'",
            "figures, positions and speeds of the new card refer to its own origin",
        )
    if to == "abkowitz" and isinstance(given, MmgCard):
        return _fitted(given, wanted, scatter, losses)
    if to == "abkowitz" and given.model.kind == "linear":
        changed = parse_card(changed_text(given.text, given.source, {"model.kind": "abkowitz"}), given.source)
        assert isinstance(changed, ManoeuvringCard)
        given, losses = changed, (*losses, "third-order terms that the card does not have are zero")
    made = in_conventions(given, wanted)
    build(made)
    return ProgramFiles(text=made.text, card=made, losses=losses)


def _lost_sensors(card: SteeredCard) -> list[str]:
    """Notices on sensors of a card, which no program has."""
    names = [entry.name for entry in card.effects if EFFECTS[entry.name].acts_on == "sensor"]
    return [f"faults of sensors are left out: {', '.join(names)}"] if names else []


def _lost_effects(card: SteeredCard) -> list[str]:
    return [f"effects are left out: {', '.join(entry.name for entry in card.effects)}"] if card.effects else []


def _of_craft(card: SteeredCard, to: str, wanted: Conventions, added_mass: AddedMass | None) -> ProgramFiles:
    if to not in _OF_CRAFT:
        problem = "is small_craft, whose damping is not a polynomial about a speed"
        raise card.fault("model.kind", problem, f"convert it to {', '.join(_OF_CRAFT)}, {_FOLDERS}")
    if wanted.rudder_sign is not None or wanted.origin_m:
        raise ArgumentError("to", to, "has neither a rudder nor another origin", "leave rudder sign and origin out")
    if to == "small_craft":
        if added_mass is not None:
            raise ArgumentError("added_mass", added_mass, "is of gazebo and vrx alone", "leave it out")
        scaling = wanted.scaling or card.model.scaling
        if scaling not in ("dimensional", "prime"):
            raise ArgumentError("scaling", scaling, "is not of a small craft", "give dimensional or prime")
        made = craft_in_scaling(card, scaling)
        return ProgramFiles(text=made.text, card=made)
    if wanted.scaling is not None:
        raise ArgumentError("to", to, "has conventions of its own", "leave the scaling out")
    place = place_of_added_mass(card, added_mass)
    text, model, lost = _SIMULATORS[to]
    losses = [*_lost_effects(card), *lost(card, place)]
    if place == "inertial":
        losses.append(
            f"the added mass is in <fluid_added_mass> of the link, which the engine DART has: as a force of the plugin "
            f"it would let an error of the velocity grow {growth_per_step(card):.4g} times in each step"
        )
    changes = figure_changes(card, build(card), model(card, place))
    return ProgramFiles(text=text(card, place), losses=tuple(losses), changes=changes)


def _whole_hull(card: SteeredCard, _: AddedMass) -> Model:
    return build(replace(card, effects=()))


def _lost_by_gazebo(card: SteeredCard, _: AddedMass) -> list[str]:
    notices = [
        "the hull is whole; the thruster plugin takes a thrust in N and has neither the loss by speed, nor the "
        "dead band, nor the lag of the card"
    ]
    turning = [
        f"{thruster.name} by {math.degrees(thruster.max_azimuth_rad):.3g} deg"
        for thruster in card.thrusters
        if thruster.max_azimuth_rad is not None
    ]
    if turning:
        notices.append(f"thrusters do not turn in the file, where the card's do ({', '.join(turning)} to either side)")
    return notices


def _lost_by_vrx(card: SteeredCard, place: AddedMass) -> list[str]:
    kept = vrx_terms(place)
    lost = ["the Coriolis terms of the added mass (the moment of Munk)"] if place == "plugin" else []
    lost += [name for name, value in card.derivatives.items() if value and name not in kept]
    return [f"SimpleHydrodynamics does not have {', '.join(lost)}"] if lost else []


# Simulator of robots to its text, the model that it has, and what it lacks, in sentences
_SIMULATORS = {
    "gazebo": (gazebo_text, _whole_hull, _lost_by_gazebo),
    "vrx": (vrx_text, vrx_model, _lost_by_vrx),
}


def _fitted(card: MmgCard, wanted: Conventions, scatter: float, losses: tuple[str, ...]) -> ProgramFiles:
    bare = build(card)
    model = build(replace(card, effects=())) if card.effects else bare
    fit = fit_polynomial(card, model, scattered_motions(model, manoeuvre_motions(model), scatter))
    polynomial = polynomial_card(card, fit)
    changes = figure_changes(card, bare, build(polynomial))
    made = in_conventions(polynomial, wanted)
    if fit.covariance is not None:
        carried = "standard errors come from the MMG card's numbers, carried through the fit with their covariance"
        losses = (*losses, f"{carried}; what the fit itself misses is in the table alone")
    return ProgramFiles(text=made.text, card=made, fit=fit, changes=changes, losses=losses)


def _program(card: ManoeuvringCard, to: str) -> ProgramFiles:
    if to in _OF_MMG:
        if not isinstance(card, MmgCard):
            raise card.fault("model.kind", f"is {card.model.kind}, and {to} is a program of the MMG method", "use mss")
        notices = [
            f"{to} has the wake w_P0 exp(-4 beta_P^2) in place of C_1, C_2, and U and beta of v - x_G r: it turns "
            "more tightly than the card"
        ]
        notices += _lost_effects(card)
        if card.ship.beam_m is None:
            notices.append("the card states no beam_m: B is nan (shipmmg does not use it)")
        return ProgramFiles(text=_OF_MMG[to](card), losses=tuple(notices))
    write = mss_function if to == "mss" else pvs_class
    return ProgramFiles(text=write(card, build(card)), losses=tuple(_lost_sensors(card)))
