"""A ship that manoeuvres in the horizontal plane: hull, rigid body, gear, propulsion and kinematics in one model."""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from tank2sim.arrays import Array
from tank2sim.cards.card import OPPOSITE, ManoeuvringCard, MmgCard
from tank2sim.cards.scaling import Scales
from tank2sim.cards.terms import known_term
from tank2sim.dynamics.abkowitz import ACCELERATION_TERMS, ALL_TERMS, LINEAR_TERMS
from tank2sim.dynamics.hull import (
    MOTION_OUTPUTS,
    VALIDITY_FACTOR,
    Hull,
    hull_particulars,
    motion_quantities,
    polynomial_forces,
)
from tank2sim.dynamics.kinematics import motion_variables
from tank2sim.dynamics.low_speed import low_speed_parameters
from tank2sim.dynamics.mmg.hull import MMG_TERMS
from tank2sim.dynamics.mmg.ship import MmgShip, mmg_forces, mmg_parameters, sides
from tank2sim.dynamics.model import Model, Parameter, Variable
from tank2sim.dynamics.propulsion import propulsion, revolutions
from tank2sim.dynamics.rigid_body import Inertia, inertia
from tank2sim.dynamics.roll import roll_fault, roll_parameters, roll_terms, with_roll
from tank2sim.dynamics.steering_gear import steering_gear
from tank2sim.notices import Notice
from tank2sim.units import rounded_down

OPPOSED = tuple(name for name, _ in OPPOSITE.values())
"""Derivatives that the MMG method writes with the other sign, under a name of their own."""

SINGULAR = "the mass matrix of sway and yaw is singular (f4 = 0)"
NOT_POSITIVE = "mass with added mass is not positive (m - Xudot, m - Yvdot, J_z - Nrdot, f4)"

_STEPS_PER_LENGTH = 200
"""Integration steps while the ship covers its own length (benchmarks/accuracy.py prints what halving them changes)."""

_OUTPUTS = (
    *(*MOTION_OUTPUTS, "rudder.angle", "force.X", "force.Y", "force.N", "validity"),
    *(f"{VALIDITY_FACTOR}{cause}" for cause in ("low_speed", "high_speed", "drift", "yaw_rate", "rudder")),
)


def ship_model(card: ManoeuvringCard) -> Model:
    """The model of a ship without its effects, (3.5) or (3.8) of paper 2 as the card's ``model.kind`` says.

    Raises InputError: the card has a derivative that the model does not know, or its mass matrix is singular (f4 = 0 in
    3.6).
    """
    names, notices = _derivative_names(card)
    _refuse_singular_mass(card)
    gear, gear_notices = steering_gear(card.steering_gear, card.ship.length_m / card.model.speed_mps)
    engine = _engine(card)
    constants = (
        *_ship_parameters(card),
        *roll_parameters(card),
        *low_speed_parameters(card),
        *_derivative_parameters(card, names),
    )
    motion = motion_variables(card.model.speed_mps, card.ship.length_m)
    given = (*motion, *gear, *engine, *constants)
    hull = Hull(
        linear=card.model.kind == "linear",
        nominal_scale=card.model.speed_scale == "nominal",
        inertial_terms=card.model.yaw_rate_terms == "hydrodynamic",
        symbols={variable.name: variable.symbol for variable in given},
    )
    motions = "surge, sway, roll and yaw" if card.roll else "surge, sway and yaw"
    empty = Model(
        name=card.ship.name,
        description=f"{card.ship.name}: {KINDS[card.model.kind]} manoeuvring model in {motions} with steering gear",
        step_s=_step(card),
        notices=(*notices, *gear_notices, *_limits_of_tests(card)),
    )
    forces = mmg_forces(MmgShip(hull, sides(card))) if isinstance(card, MmgCard) else polynomial_forces(hull)
    loads = [quantity.name for quantity in forces if quantity.name.startswith(("propeller.torque", "propeller.power"))]
    outputs = (*_OUTPUTS, *(["propeller.speed_actual"] if engine else []), *loads)
    planar = empty.extend(*given, *motion_quantities(hull, forces), outputs=outputs)
    return with_roll(planar, hull, card) if card.roll else planar


def _engine(card: ManoeuvringCard) -> tuple[Variable, ...]:
    if isinstance(card, MmgCard):
        assert card.propulsion is not None
        return (*revolutions(card.propulsion), *mmg_parameters(card))
    return propulsion(card.propulsion) if card.propulsion else ()


def _limits_of_tests(card: ManoeuvringCard) -> list[Notice]:
    """Notice on what the tests behind a card leave open about yaw and the two sides."""
    notices = []
    if not card.model.valid_yaw_rate_prime > 0:
        text = "no test behind the card had a yaw rate (valid_yaw_rate_prime = 0): its derivatives by r are estimates, "
        notices.append(Notice(f"{text}and so are course stability and every turn"))
    if isinstance(card, MmgCard) and card.rudder.gamma_R_plus != card.rudder.gamma_R_minus:
        text = "gamma_R changes with the side of the flow: what is linearised about straight motion (stability, small "
        notices.append(Notice(f"{text}rudder) has gamma_R_minus"))
    return notices


KINDS = {"abkowitz": "third-order (Abkowitz)", "linear": "linear", "mmg": "MMG"}
"""Kind of model to what it is called."""


def _derivative_names(card: ManoeuvringCard) -> tuple[list[str], list[Notice]]:
    """Names of the model's derivatives, and notices on derivatives of the card that it does not use."""
    rolling = [name for name in card.derivatives if known_term(name).of_roll]
    mmg = card.model.kind == "mmg"
    every = MMG_TERMS if mmg else ALL_TERMS
    _refuse_unknown_terms(card, {*every, *rolling} - ({"Yrdot", "Nvdot"} if mmg and not card.roll else set()))
    if card.model.kind != "linear":
        return [*every, *rolling], []
    names = [*roll_terms(card), *LINEAR_TERMS["X"], *LINEAR_TERMS["Y"], *LINEAR_TERMS["N"], *ACCELERATION_TERMS]
    unused = [name for name in card.derivatives if name not in names]
    return names, [Notice(f"the linear model leaves out {len(unused)} derivatives of the card")] if unused else []


def _refuse_unknown_terms(card: ManoeuvringCard, known: set[str]) -> None:
    equations, kind, spelt = "(3.8)", "the third-order model", [*ALL_TERMS]
    if card.model.kind == "mmg":
        equations, kind = "the MMG hull", "an MMG hull"
        spelt = [*OPPOSITE, *(term for term in MMG_TERMS if term not in OPPOSED)]
    for section, given in (("derivatives", card.derivatives), ("uncertainty", card.uncertainty)):
        if name := next((name for name in given if name not in known), ""):
            close = difflib.get_close_matches(name, spelt, n=1)
            remedy = f"{f'did you mean {close[0]}? ' if close else ''}{kind} has {' '.join(spelt)}"
            raise card.fault(f"{section}.{card.places.get(name, name)}", f"is not a term of {equations}", remedy)


def _refuse_singular_mass(card: ManoeuvringCard) -> None:
    body = card.rigid_body
    added = {name: card.derivatives.get(name, 0.0) for name in ACCELERATION_TERMS}
    matrix = inertia(body.mass, body.x_G, body.yaw_inertia, added)
    if _is_singular(matrix):
        remedy = "check mass, yaw_inertia, x_G, Yvdot, Nrdot, Yrdot and Nvdot"
        raise card.fault("rigid_body", SINGULAR, remedy)
    if not _is_positive(matrix):
        remedy = "acceleration derivatives are negative: check their signs"
        raise card.fault("derivatives", NOT_POSITIVE, remedy)
    if problem := roll_fault(card):
        raise card.fault("roll.roll_inertia", problem, "check roll_inertia, z_G, Kpdot, Kvdot and Ypdot")


def mass_fault(model: Model, p: Mapping[str, float]) -> str:
    """Why a model with the parameters `p` (all, by name) has no mass matrix that can be used; empty if it has one."""
    matrix = _mass_matrix(model, p)
    if _is_singular(matrix):
        return SINGULAR
    return "" if _is_positive(matrix) else NOT_POSITIVE


def mass_faults(model: Model, p: Array) -> list[str]:
    """As :func:`mass_fault` for each of n ships, with parameter vectors `p` (n, parameters)."""
    matrix = _mass_matrix(model, dict(zip(model.parameter_names, p.T, strict=True)))
    singular, positive = np.broadcast_arrays(_is_singular(matrix), _is_positive(matrix))
    return [str(fault) for fault in np.where(singular, SINGULAR, np.where(positive, "", NOT_POSITIVE))]


def _mass_matrix(model: Model, p: Mapping[str, Any]) -> Inertia:
    added = {name: p[f"derivatives.{name}"] for name in ACCELERATION_TERMS}
    if model["derivatives.Xudot"].unit == "kg":
        return inertia(p["ship.mass"], p["ship.x_G"], p["ship.yaw_inertia"], added)
    scales = Scales(p["ship.water_density"], p["ship.length"], p["ship.speed"])
    mass, yaw_inertia = p["ship.mass"] / scales.mass, p["ship.yaw_inertia"] / scales.inertia
    return inertia(mass, p["ship.x_G"] / p["ship.length"], yaw_inertia, added)


def _is_singular(matrix: Inertia) -> Any:
    scale = abs(matrix.sway * matrix.yaw) + abs(matrix.sway_yaw * matrix.yaw_sway)
    rounding = 1e-12  # of the two products whose difference f4 is
    return abs(matrix.determinant) <= rounding * scale


def _is_positive(matrix: Inertia) -> Any:
    return (matrix.surge > 0) & (matrix.sway > 0) & (matrix.yaw > 0) & (matrix.determinant > 0)


def _step(card: ManoeuvringCard) -> float:
    """Step (s): :data:`_STEPS_PER_LENGTH`, and five in a time constant of the gear, rounded down to 1, 2 or 5."""
    wanted = card.ship.length_m / card.model.speed_mps / _STEPS_PER_LENGTH
    if card.steering_gear and card.steering_gear.time_constant_s:
        wanted = min(wanted, card.steering_gear.time_constant_s / 5)
    return rounded_down(wanted)


def _ship_parameters(card: ManoeuvringCard) -> tuple[Parameter, ...]:
    def largest(name: str, unit: str, description: str, start: float) -> Parameter:
        return Parameter(
            name,
            unit,
            description,
            display_unit="deg" if unit == "rad" else None,
            start=start,
            minimum=0.0,
            maximum=math.pi / 2 if unit == "rad" else None,
            tunable=False,
        )

    model = card.model
    rudder = math.pi / 2 if model.valid_rudder_rad is None else model.valid_rudder_rad
    return (
        *hull_particulars(card, "Speed u0 about which forces are expanded", "J_z"),
        largest("ship.largest_drift", "rad", "Largest drift angle at which the card holds", model.valid_drift_rad),
        largest(
            "ship.largest_yaw_rate", "1", "Largest yaw rate r L/U at which the card holds", model.valid_yaw_rate_prime
        ),
        largest("ship.largest_rudder", "rad", "Largest rudder angle at which the card holds", rudder),
    )


def _derivative_parameters(card: ManoeuvringCard, names: list[str]) -> tuple[Parameter, ...]:
    symbols = {"d": "delta", "u": "Du"}

    def described(name: str) -> str:
        term = known_term(name)
        if term.acceleration:
            return f"Acceleration derivative of {term.force} by d{term.acceleration}/dt, prime system"
        powers = [
            f"{symbols.get(letter, letter)}^{power}" if power > 1 else symbols.get(letter, letter)
            for letter, power in term.powers.items()
        ]
        return f"Coefficient of {' '.join(powers) or '1'} in {term.force}, prime system, rudder + to starboard"

    return tuple(
        Parameter(f"derivatives.{name}", "1", described(name), nominal=1e-3, start=card.derivatives.get(name, 0.0))
        for name in names
    )
