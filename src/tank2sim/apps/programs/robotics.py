"""A small craft as parameters of simulators of robots: Gazebo's hydrodynamics plugin and VRX's, and what they lose.

Gazebo (``gz-sim-hydrodynamics-system``, from gz-sim 7) takes any product of a velocity with the size of one, and of two
velocities, in SNAME's signs: the whole hull. Its own Coriolis terms are switched off (they have only part of C_A, with
other signs), and those of C_A are given as products of velocities (``xVR``, ``yUR``, ``nUV``). SimpleHydrodynamics of
VRX has one linear and one quadratic term an axis, positive for damping, and no C_A: no moment of Munk. Both as the
source of the plugins has it (gz-sim 7, VRX for Gazebo Classic); no simulator was run.

Both feed the acceleration of the last step back as a force of added mass. That is stable only if every eigenvalue of
M^-1 A is below 1, at any step (:func:`growth_per_step`): the usual numbers of surface craft diverge. The added mass
then goes into ``<fluid_added_mass>`` of the link's ``<inertial>`` (SDF 1.10, engine DART). That engine solves M + A at
once, and has C_A of the velocity over the ground.

Both have x forward, y to port and z up. That turns the signs of v, r, Y and N together, and so none of a coefficient.
The mass, the inertia and the centre of gravity belong into ``<inertial>``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations_with_replacement
from typing import Literal

import numpy as np

from tank2sim.cards.card import SteeredCard
from tank2sim.cards.craft_terms import CRAFT_ADDED_MASSES, VELOCITY_TERMS
from tank2sim.cards.form import ThrusterSection
from tank2sim.dynamics.build import build
from tank2sim.dynamics.model import Model
from tank2sim.dynamics.rigid_body import added_mass_forces
from tank2sim.errors import ArgumentError
from tank2sim.escaping import xml_comment

VRX_TERMS = {"Xu": "xU", "Xuabsu": "xUU", "Yv": "yV", "Yvabsv": "yVV", "Nr": "nR", "Nrabsr": "nRR"}
"""Derivative to its name in VRX, where it is positive for damping."""

VRX_MASSES = {"Xudot": "xDotU", "Yvdot": "yDotV", "Nrdot": "nDotR"}


def _element(name: str, value: float) -> str:
    return f"<{name}>{value:.10g}</{name}>"


def _elements(values: Mapping[str, float]) -> list[str]:
    return [f"  {_element(name, value)}" for name, value in values.items()]


def gazebo_name(name: str) -> str:
    """Name of a derivative in Gazebo.

    Examples
    --------
    >>> gazebo_name("Nrabsv"), gazebo_name("Yvdot"), gazebo_name("Yr")
    ('nRabsV', 'yDotV', 'yR')
    """
    if name in CRAFT_ADDED_MASSES:
        return f"{name[0].lower()}Dot{name[1].upper()}"
    term = next(term for term in VELOCITY_TERMS if term.name == name)
    return f"{term.force.lower()}{term.factor.upper()}{f'abs{term.size.upper()}' * bool(term.size)}"


def coriolis_products(derivatives: Mapping[str, float]) -> dict[str, float]:
    """-C_A nu (:func:`.added_mass_forces`) as coefficients of products of velocities: ``xVR``, ``yUR``, ``nUV``, ...

    `derivatives`: ``Xudot Yvdot Yrdot Nvdot``, kg and kg m; absent means 0.
    """
    known = {name: derivatives.get(name, 0.0) for name in CRAFT_ADDED_MASSES}
    products: dict[str, float] = {}
    for first, second in combinations_with_replacement("uvr", 2):
        unit = {letter: float(letter in (first, second)) for letter in "uvr"}
        # Quadratic in the velocities: what both together give beyond what each gives by itself.
        forces = added_mass_forces(known, **unit)
        if first != second:
            alone = (added_mass_forces(known, **{**unit, letter: 0.0}) for letter in (first, second))
            forces = tuple(force - sum(parts) for force, *parts in zip(forces, *alone, strict=True))
        for letter, value in zip("xyn", forces, strict=True):
            products[f"{letter}{first.upper()}{second.upper()}"] = value
    return {name: value for name, value in products.items() if value}


AddedMass = Literal["plugin", "inertial"]
"""Where the added mass goes: into the plugin, or into the inertia of the link."""

ENGINE_STEP_S = 0.001
"""Step of Gazebo's engines where a world states none."""


def growth_per_step(card: SteeredCard) -> float:
    """Factor by which an error of the velocity grows in a step of a plugin that takes added mass from the last step.

    The largest root z of ``z^2 I - z (I - dt M^-1 D - M^-1 A) - M^-1 A = 0``, with the rigid mass M and the added mass
    A about the origin of the link, and the slope D of the damping at the highest speed of the card. Without damping it
    is the largest eigenvalue of M^-1 A, or 1; above 1 the velocity has no bound, at any step dt.
    """
    body, known = card.rigid_body, card.derivatives
    lever = body.mass * body.x_G
    mass = np.array([[body.mass, 0, 0], [0, body.mass, lever], [0, lever, body.yaw_inertia]])
    place = {"u": 0, "v": 1, "r": 2, "X": 0, "Y": 1, "N": 2}
    added, damping = np.zeros((3, 3)), np.zeros((3, 3))
    for name in CRAFT_ADDED_MASSES:
        added[place[name[0]], place[name[1]]] = -known.get(name, 0.0)
    fastest = card.model.speed_range_mps[1]
    for term in VELOCITY_TERMS:  # of u alone at that speed
        size = (fastest if term.size == "u" else 0.0) if term.size else 1.0
        slope = -known.get(term.name, 0.0) * size * (2.0 if term.factor == term.size == "u" else 1.0)
        damping[place[term.force], place[term.factor]] += slope
    inverse, one = np.linalg.inv(mass), np.eye(3)
    step = np.block(
        [[one - ENGINE_STEP_S * inverse @ damping - inverse @ added, inverse @ added], [one, np.zeros((3, 3))]]
    )
    return float(np.abs(np.linalg.eigvals(step)).max())


def place_of_added_mass(card: SteeredCard, wanted: AddedMass | None) -> AddedMass:
    """Where the added mass of a craft goes: as `wanted`, by default into the plugin where that is stable.

    Raises InputError: It is wanted in the plugin, and an error would grow there.
    """
    growth = growth_per_step(card)
    if wanted == "plugin" and growth >= 1:
        problem = f"would let an error of the velocity grow {growth:.4g} times in each step, however short"
        raise ArgumentError("added_mass", "plugin", problem, "leave it out, or give inertial")
    return wanted or ("plugin" if growth < 1 else "inertial")


def _inertial(card: SteeredCard) -> list[str]:
    """The added mass of a link about its origin, positive, kg, kg m and kg m^2; what a card does not have is zero."""
    known = {name: -card.derivatives.get(name, 0.0) for name in CRAFT_ADDED_MASSES}
    coupled = (known["Yrdot"] + known["Nvdot"]) / 2 + 0.0  # the matrix of SDF is symmetric
    given = {"xx": known["Xudot"], "yy": known["Yvdot"], "yr": coupled, "rr": known["Nrdot"]}
    rows = ("xx xy xz xp xq xr", "yy yz yp yq yr", "zz zp zq zr", "pp pq pr", "qq qr", "rr")
    return [
        "<!-- put this into the <inertial> of base_link (SDF 1.10, engine DART); zz, pp and qq are not on the card -->",
        "<fluid_added_mass>",
        *("  " + " ".join(_element(key, given.get(key, 0.0)) for key in row.split()) for row in rows),
        "</fluid_added_mass>",
    ]


def gazebo_text(card: SteeredCard, place: AddedMass) -> str:
    """SDF of the plugins of a craft for Gazebo: hydrodynamics, and one thruster each."""
    density = card.environment.water_density_kgpm3
    left_out: Sequence[str] = CRAFT_ADDED_MASSES
    products: dict[str, float] = {}
    about, disabled = "C_A comes with <fluid_added_mass>", ["  <disable_added_mass>true</disable_added_mass>"]
    if place == "plugin":
        left_out, products = (), coriolis_products(card.derivatives)
        about, disabled = "C_A is in the products xVR to nUR", []
    hull = {gazebo_name(name): value for name, value in card.derivatives.items() if value and name not in left_out}
    lines = [
        *_head(card, "Gazebo (gz-sim 7 or later)", place),
        '<plugin filename="gz-sim-hydrodynamics-system" name="gz::sim::systems::Hydrodynamics">',
        "  <link_name>base_link</link_name>",
        *_elements({"water_density": density}),
        *disabled,
        f"  <disable_coriolis>true</disable_coriolis> <!-- {about} -->",
        *_elements(hull | products),
        "</plugin>",
    ]
    for thruster in card.thrusters:
        coefficient = thruster.ahead_Ns2 / density  # of T = rho C_T n^2 D^4, n in rad/s
        least = -thruster.astern_Ns2 * thruster.lowest_radps**2
        lines += [
            f"<!-- {thruster.name}: {_joint(thruster)}; command in N -->",
            '<plugin filename="gz-sim-thruster-system" name="gz::sim::systems::Thruster">',
            f"  <joint_name>{thruster.name}_joint</joint_name>",
            *_elements({"thrust_coefficient": coefficient, "fluid_density": density}),
            "  <propeller_diameter>1</propeller_diameter> <!-- only its product with the coefficient acts -->",
            *_elements({"max_thrust_cmd": thruster.largest_thrust_N, "min_thrust_cmd": least}),
            "</plugin>",
        ]
    return "\n".join(lines) + "\n"


def _joint(thruster: ThrusterSection) -> str:
    """Place of a thruster from midships and the axis in which it pushes ahead, x forward and y to port."""
    along, across = math.cos(thruster.azimuth_rad), -math.sin(thruster.azimuth_rad)
    axis = " ".join(f"{round(value, 9) + 0.0:g}" for value in (along, across, 0.0))
    return f"x {thruster.x_m:g}, y {-thruster.y_m + 0.0:g} m (to port), axis of the joint {axis}"


def vrx_text(card: SteeredCard, place: AddedMass) -> str:
    """SDF of VRX's SimpleHydrodynamics for a craft."""
    known = dict(card.derivatives)
    if place == "inertial":
        known |= dict.fromkeys(VRX_MASSES, -0.0)
    values = {key: -known.get(name, 0.0) for name, key in VRX_MASSES.items()}
    values |= {key: 0.0 - known.get(name, 0.0) for name, key in VRX_TERMS.items()}
    lines = [
        *_head(card, "VRX", place),
        '<plugin filename="libSimpleHydrodynamics.so" name="vrx::SimpleHydrodynamics">',
        "  <link_name>base_link</link_name>",
        *_elements(values),
        "</plugin>",
    ]
    return "\n".join(lines) + "\n"


def _head(card: SteeredCard, program: str, place: AddedMass) -> list[str]:
    """Comments on a craft and its rigid body, and the added mass of the link."""
    body = card.rigid_body
    # About the centre of gravity, as SDF has it.
    inertia = body.yaw_inertia - body.mass * body.x_G**2
    return [
        f"<!-- {xml_comment(card.ship.name)}, by tank2sim, for {program}: put it into <model> -->",
        f"<!-- <inertial>: pose {body.x_G:.10g} 0 0, mass {body.mass:.10g}, izz {inertia:.10g}; the origin of "
        "base_link is midships -->",
        *(_inertial(card) if place == "inertial" else []),
    ]


def vrx_terms(place: AddedMass) -> set[str]:
    """Derivatives that the plugin of VRX has, or the link with it."""
    return {*VRX_TERMS, *(CRAFT_ADDED_MASSES if place == "inertial" else VRX_MASSES)}


def vrx_model(card: SteeredCard, place: AddedMass) -> Model:
    """The model of a craft with the terms of VRX's plugin: six of damping, no effects; C_A with the inertia alone."""
    inertial = place == "inertial"
    kept = vrx_terms(place)
    derivatives = {name: value for name, value in card.derivatives.items() if name in kept}
    model = build(replace(card, derivatives=derivatives, effects=()))
    if inertial:
        return model
    added = {name: model.symbol(f"derivatives.{name}") for name in CRAFT_ADDED_MASSES}
    motion = (model.symbol(f"motion.{letter}") for letter in "uvr")
    for force, value in zip("XYN", added_mass_forces(added, *motion), strict=True):
        model = model.redefine(f"force.{force}", lambda old, value=value: old - value)  # type: ignore[misc]
    return model
