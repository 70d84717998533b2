"""Roll as a degree of freedom: the planar ship with a rolling moment K, heel phi and rate of roll p.

    m (u' - v r - x_G r^2 + z_G p r)          = X
    m (v' + u r - z_G p' + x_G r')            = Y
    I_x p' - m z_G (v' + u r)                 = K - W GM sin(phi)
    J_z r' + m x_G (v' + u r)                 = N
    dphi/dt = p,   dpsi/dt = r cos(phi),   dx/dt = u cos(psi) - v sin(psi) cos(phi),   dy/dt alike

with the added masses (K_pdot, K_vdot, Y_pdot, K_rdot, N_pdot) on the left, about the origin midway between the
perpendiculars; z is positive downwards, phi and K to starboard. X, Y, K, N take the terms of the card that have p or
phi, in the prime system (p' = p L/U). K also has the rudder's -z_R Y_R and m_x l_x u r, the moment of the surge
added mass.

Son and Nomoto (1982), On the coupled motion of steering and rolling of a high speed container ship, Naval Architecture
and Ocean Engineering 20, 73-83 (phi in place of sin(phi), as here: the restoring moment is linear); Fossen (2011),
Handbook of Marine Craft Hydrodynamics and Motion Control, 7.1 (z_G).
"""

from __future__ import annotations

import math

import casadi as ca
import numpy as np

from tank2sim.cards.card import ManoeuvringCard
from tank2sim.cards.form import Roll
from tank2sim.cards.terms import known_term
from tank2sim.dynamics.abkowitz import polynomial
from tank2sim.dynamics.effects.effect import with_steps_for_time
from tank2sim.dynamics.effects.forces import with_forces
from tank2sim.dynamics.hull import Hull, prime_motion
from tank2sim.dynamics.kinematics import heel, rate_of_heel
from tank2sim.dynamics.model import Model, Parameter, Quantity

ACCELERATIONS_WITH_ROLL = ("Ypdot", "Kvdot", "Kpdot", "Krdot", "Npdot")
"""Acceleration derivatives that couple roll with sway and yaw."""


def roll_terms(card: ManoeuvringCard) -> list[str]:
    """Derivatives of a card that only a ship that rolls has; of a linear card only the first-order ones."""
    terms = [name for name in card.derivatives if known_term(name).of_roll]
    if card.model.kind != "linear":
        return terms
    return [
        name for name in terms if (term := known_term(name)).acceleration or sum(term.powers.values()) - term.u == 1
    ]


def roll_fault(card: ManoeuvringCard) -> str:
    """Why the mass matrix of sway, roll and yaw cannot be used; "" if it can, or the card has no roll."""
    if card.roll is None:
        return ""
    body, d = card.rigid_body, card.derivatives
    added = {name: d.get(name, 0.0) for name in ("Yvdot", "Yrdot", "Nvdot", "Nrdot", *ACCELERATIONS_WITH_ROLL)}
    matrix = _mass_matrix(body.mass, body.x_G, body.yaw_inertia, card.roll, added)
    smallest = float(np.linalg.eigvalsh((matrix + matrix.T) / 2).min())
    return "" if smallest > 0 else "sway, roll and yaw together have no positive mass"


def _mass_matrix(mass: float, x_G: float, yaw_inertia: float, roll: Roll, added: dict[str, float]) -> np.ndarray:
    return np.array(
        [
            [mass - added["Yvdot"], -mass * roll.z_G - added["Ypdot"], mass * x_G - added["Yrdot"]],
            [-mass * roll.z_G - added["Kvdot"], roll.roll_inertia - added["Kpdot"], -added["Krdot"]],
            [mass * x_G - added["Nvdot"], -added["Npdot"], yaw_inertia - added["Nrdot"]],
        ]
    )


def roll_parameters(card: ManoeuvringCard) -> tuple[Parameter, ...]:
    """Parameters of roll: inertia (kg m2), metacentric height (m), weight (N) and heights (m)."""
    roll, scales = card.roll, card.scales
    if roll is None:
        return ()
    height = card.ship.metacentric_height_m or 0.0
    mass = card.ship.displacement_kg or card.rigid_body.mass * scales.mass
    described = (
        ("ship.roll_inertia", "kg.m2", "Roll inertia I_x about the origin", roll.roll_inertia * scales.inertia, 1e-6),
        ("ship.metacentric_height", "m", "Transverse metacentric height GM", height, 1e-6),
        ("ship.weight", "N", "Weight of the ship", mass * card.environment.gravity_mps2, 1e-6),
        ("ship.z_G", "m", "Centre of gravity below the origin", roll.z_G * scales.length, None),
        ("ship.z_R", "m", "Where the rudder's sway force acts, below the origin", roll.z_R * scales.length, None),
        ("ship.l_x", "m", "Where the added mass in surge acts, below the origin", roll.l_x * scales.length, None),
    )
    return tuple(
        Parameter(
            name,
            unit,
            description,
            start=value,
            nominal=abs(value) or 1.0,
            minimum=minimum,
            tunable=name == "ship.metacentric_height",
        )
        for name, unit, description, value, minimum in described
    )


def with_roll(model: Model, hull: Hull, card: ManoeuvringCard) -> Model:
    """The planar model of a ship with roll as a degree of freedom: states ``motion.phi``, ``motion.p``.

    Parameters
    ----------
    model : Model
        In surge, sway and yaw, with the parameters of :func:`roll_parameters` and the derivatives by roll.
    hull : Hull
        Its symbols.
    card : ManoeuvringCard
        With ``roll``.
    """
    (phi, p), starts = heel()
    K, phidot = _moment(model, hull, card, p.symbol, phi.symbol), rate_of_heel(p.symbol)
    forces = model.symbol("force.Y"), K.symbol, model.symbol("force.N")
    vdot, pdot, rdot = _accelerations(model, hull, card, forces)
    acceleration = Quantity(
        "motion.pdot",
        "rad/s2",
        "Acceleration of roll, positive to starboard",
        pdot,
        display_unit="deg/s2",
        nominal=1e-3,
    )
    rolling = phi, p, *starts, K, phidot, acceleration
    model = model.extend(*rolling, outputs=("motion.phi", "motion.p", "force.K"))
    model = with_forces(model, **_forces_by_roll(hull, card, p.symbol, phi.symbol))
    model = model.redefine("motion.vdot", lambda _: vdot).redefine("motion.rdot", lambda _: rdot)
    v, r, upright = hull["motion.v"], hull["motion.r"], ca.cos(phi.symbol)
    for name in ("motion.xdot", "motion.ydot"):
        model = model.redefine(name, lambda speed: ca.substitute(speed, v, v * upright))
    model = model.redefine("motion.psidot", lambda rate: ca.substitute(rate, r, r * upright))
    return with_steps_for_time(model, natural_period_s(card) / (2 * math.pi))


def natural_period_s(card: ManoeuvringCard) -> float:
    """Period (s) of undamped roll without coupling, 2 pi sqrt((I_x - K_pdot)/(W GM)).

    Raises
    ------
    ValueError
        The card has no roll.
    """
    if card.roll is None:
        raise ValueError("the card has no roll")
    values = {parameter.name: float(parameter.start) for parameter in roll_parameters(card)}
    added = card.derivatives.get("Kpdot", 0.0) * card.scales.inertia
    inertia = values["ship.roll_inertia"] - added
    return 2 * math.pi * math.sqrt(inertia / (values["ship.weight"] * values["ship.metacentric_height"]))


def _of_polynomial(hull: Hull, card: ManoeuvringCard, force: str, p: ca.SX, phi: ca.SX) -> ca.SX:
    """X, Y (N), K or N (N m) of the card's terms of roll: all but Kp fade out at low speed as the polynomial does."""
    names = [name for name in roll_terms(card) if name[0] == force and not known_term(name).acceleration]
    speed = hull["ship.speed"] if hull.linear or hull.nominal_scale else hull.speed
    v, r, du = prime_motion(hull, speed)
    rolling = {"p": p * hull["ship.length"] / speed, "phi": phi}
    motion = {"v": v, "r": r, "d": hull["rudder.effective"], "u": du, **rolling}
    total = ca.SX(0)
    for kept, share in ((True, 1 - hull.low_share), (False, ca.SX(1))):
        chosen = [name for name in names if (name != "Kp") == kept]
        total += share * polynomial(chosen, {name: hull.coefficient(name) for name in chosen}, **motion)
    scales = hull.scales(speed)
    arm = scales.length if force in "KN" else 1
    force_or_moment: ca.SX = scales.force * arm * total
    return force_or_moment


def _forces_by_roll(hull: Hull, card: ManoeuvringCard, p: ca.SX, phi: ca.SX) -> dict[str, ca.SX]:
    X, Y, N = (_of_polynomial(hull, card, force, p, phi) for force in "XYN")
    return {"X": X - hull["ship.mass"] * hull["ship.z_G"] * p * hull["motion.r"], "Y": Y, "N": N}


def _moment(model: Model, hull: Hull, card: ManoeuvringCard, p: ca.SX, phi: ca.SX) -> Quantity:
    u, r = hull["motion.u"], hull["motion.r"]
    forward = hull["ship.speed"] if hull.linear else u
    added_mass = -hull.scales(ca.SX(1)).mass * hull.coefficient("Xudot")
    value = (
        _of_polynomial(hull, card, "K", p, phi)
        - hull["ship.z_R"] * model.symbol("rudder.Y")
        + (added_mass * hull["ship.l_x"] + hull["ship.mass"] * hull["ship.z_G"]) * forward * r
        - hull["ship.weight"] * hull["ship.metacentric_height"] * phi
    )
    return Quantity(
        "force.K",
        "N.m",
        "Rolling moment about the origin without the part by acceleration, positive to starboard",
        value,
        nominal=1e6,
    )


def _accelerations(
    model: Model, hull: Hull, card: ManoeuvringCard, forces: tuple[ca.SX, ca.SX, ca.SX]
) -> tuple[ca.SX, ca.SX, ca.SX]:
    """dv/dt, dp/dt, dr/dt from the `forces` Y (N), K and N (N m)."""
    unit = hull.scales(hull["ship.speed"])
    given = set(roll_terms(card))
    added = {
        name: unit.derivative(known_term(name)) * hull.coefficient(name) if name in given else ca.SX(0)
        for name in ACCELERATIONS_WITH_ROLL
    }
    by_height = -hull["ship.mass"] * hull["ship.z_G"]
    sway, sway_yaw, yaw_sway, yaw = (
        model.symbol(f"inertia.{name}") for name in ("sway", "sway_yaw", "yaw_sway", "yaw")
    )
    matrix = ca.vertcat(
        ca.horzcat(sway, by_height - added["Ypdot"], sway_yaw),
        ca.horzcat(by_height - added["Kvdot"], hull["ship.roll_inertia"] - added["Kpdot"], -added["Krdot"]),
        ca.horzcat(yaw_sway, -added["Npdot"], yaw),
    )
    v, p, r = ca.vertsplit(ca.inv(matrix) @ ca.vertcat(*forces))
    return v, p, r
