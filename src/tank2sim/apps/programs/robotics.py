"""A small craft as parameters of simulators of robots: Gazebo's hydrodynamics plugin and VRX's, and what they lose.

Gazebo (``gz-sim-hydrodynamics-system``, from gz-sim 7) takes any product of a velocity with the size of one, and of two
velocities, in SNAME's signs: the whole hull. Its own Coriolis terms are switched off (they have only part of C_A, with
other signs), and those of C_A are given as products of velocities (``xVR``, ``yUR``, ``nUV``). SimpleHydrodynamics of
VRX has one linear and one quadratic term an axis, positive for damping, and no C_A: no moment of Munk. Both as the
source of the plugins has it (gz-sim 7, VRX for Gazebo Classic); no simulator was run.

Both have x forward, y to port and z up. That turns the signs of v, r, Y and N together, and so none of a coefficient.
The mass, the inertia and the centre of gravity belong into ``<inertial>``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import combinations_with_replacement

from tank2sim.apps.programs.polynomial_fit import FigureChange
from tank2sim.cards.card import SteeredCard
from tank2sim.cards.craft_terms import CRAFT_ADDED_MASSES, VELOCITY_TERMS
from tank2sim.cards.small_craft import cruising_revolutions
from tank2sim.dynamics.build import build
from tank2sim.dynamics.model import Model
from tank2sim.dynamics.rigid_body import added_mass_forces
from tank2sim.errors import InputError
from tank2sim.escaping import xml_comment
from tank2sim.simulation.card_range import single_figures
from tank2sim.simulation.run import simulate
from tank2sim.simulation.thruster_manoeuvres import DifferenceTurn, Spin, StraightRun

VRX_TERMS = {"Xu": "xU", "Xuabsu": "xUU", "Yv": "yV", "Yvabsv": "yVV", "Nr": "nR", "Nrabsr": "nRR"}
"""Derivative to its name in VRX, where it is positive for damping."""

VRX_MASSES = {"Xudot": "xDotU", "Yvdot": "yDotV", "Nrdot": "nDotR"}

_NUMBER = "{:.10g}"
_DIFFERENCE, _SPIN = 0.3, 0.7
"""Difference of a turn and revolutions of a spin, over the cruising revolutions, with which forms are compared: a wide
turn and a spin within the reach of any craft (project choice)."""


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

    Parameters
    ----------
    derivatives : mapping
        ``Xudot Yvdot Yrdot Nvdot``, kg and kg m; absent means 0.
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


def gazebo_text(card: SteeredCard) -> str:
    """SDF of the plugins of a craft for Gazebo: hydrodynamics, and one thruster each."""
    hull = {gazebo_name(name): value for name, value in card.derivatives.items() if value}
    lines = [
        *_head(card, "Gazebo (gz-sim 7 or later): put it into <model>"),
        '<plugin filename="gz-sim-hydrodynamics-system" name="gz::sim::systems::Hydrodynamics">',
        "  <link_name>base_link</link_name>",
        f"  <water_density>{_NUMBER.format(card.environment.water_density_kgpm3)}</water_density>",
        "  <disable_coriolis>true</disable_coriolis> <!-- C_A is in the products xVR to nUR -->",
        *(f"  <{name}>{_NUMBER.format(value)}</{name}>" for name, value in hull.items()),
        *(f"  <{name}>{_NUMBER.format(value)}</{name}>" for name, value in coriolis_products(card.derivatives).items()),
        "</plugin>",
    ]
    for thruster in card.thrusters:
        most = thruster.largest_thrust_N
        least = -thruster.astern_Ns2 * thruster.lowest_radps**2
        coefficient = thruster.ahead_Ns2 / card.environment.water_density_kgpm3  # of T = rho C_T n^2 D^4, n in rad/s
        lines += [
            f"<!-- {thruster.name}: x {thruster.x_m:g}, y {-thruster.y_m:g} m (to port); command in N -->",
            '<plugin filename="gz-sim-thruster-system" name="gz::sim::systems::Thruster">',
            f"  <joint_name>{thruster.name}_joint</joint_name>",
            f"  <thrust_coefficient>{_NUMBER.format(coefficient)}</thrust_coefficient>",
            f"  <fluid_density>{_NUMBER.format(card.environment.water_density_kgpm3)}</fluid_density>",
            "  <propeller_diameter>1</propeller_diameter> <!-- only its product with the coefficient acts -->",
            f"  <max_thrust_cmd>{_NUMBER.format(most)}</max_thrust_cmd>",
            f"  <min_thrust_cmd>{_NUMBER.format(least)}</min_thrust_cmd>",
            "</plugin>",
        ]
    return "\n".join(lines) + "\n"


def vrx_text(card: SteeredCard) -> str:
    """SDF of VRX's SimpleHydrodynamics for a craft."""
    masses = {VRX_MASSES[name]: -card.derivatives.get(name, 0.0) for name in VRX_MASSES}
    damping = {VRX_TERMS[name]: -card.derivatives.get(name, 0.0) for name in VRX_TERMS}
    lines = [
        *_head(card, "VRX: put it into <model>"),
        '<plugin filename="libSimpleHydrodynamics.so" name="vrx::SimpleHydrodynamics">',
        "  <link_name>base_link</link_name>",
        *(f"  <{name}>{_NUMBER.format(value)}</{name}>" for name, value in {**masses, **damping}.items()),
        "</plugin>",
    ]
    return "\n".join(lines) + "\n"


def _head(card: SteeredCard, where: str) -> list[str]:
    """Comments on a craft, and its rigid body."""
    body = card.rigid_body
    # About the centre of gravity, as SDF has it.
    inertia = body.yaw_inertia - body.mass * body.x_G**2
    return [
        f"<!-- {xml_comment(card.ship.name)}, by tank2sim, for {where} -->",
        f"<!-- <inertial>: pose {_NUMBER.format(body.x_G)} 0 0, mass {_NUMBER.format(body.mass)}, izz "
        f"{_NUMBER.format(inertia)}; the origin of base_link is midships -->",
    ]


def vrx_model(card: SteeredCard) -> Model:
    """The model of a craft with what VRX's plugin has of its hull: six terms of damping, no C_A, no effects."""
    kept = {*VRX_TERMS, *VRX_MASSES}
    derivatives = {name: value for name, value in card.derivatives.items() if name in kept}
    model = build(replace(card, derivatives=derivatives, effects=()))
    added = {name: model.symbol(f"derivatives.{name}") for name in CRAFT_ADDED_MASSES}
    motion = (model.symbol(f"motion.{letter}") for letter in "uvr")
    for force, value in zip("XYN", added_mass_forces(added, *motion), strict=True):
        model = model.redefine(f"force.{force}", lambda old, value=value: old - value)  # type: ignore[misc]
    return model


def gazebo_model(card: SteeredCard) -> Model:
    """The model of a craft with what Gazebo's plugin has of it: the whole hull, without effects."""
    return build(replace(card, effects=()))


def craft_changes(card: SteeredCard, model: Model) -> tuple[FigureChange, ...]:
    """Figures of a straight run, a turn and a spin of a card, and of another `model` of the same craft."""
    n = cruising_revolutions(card)
    before = build(card)
    found = []
    for manoeuvre in (StraightRun(n), DifferenceTurn(_DIFFERENCE * n), Spin(_SPIN * n)):
        try:
            runs = [simulate(each, manoeuvre).figures for each in (before, model)]
        except InputError:
            continue  # thrusters that are not on both sides, or do not reverse as far
        first, second = map(single_figures, runs)
        for name, value in first.items():
            if not name.endswith(("_lengths", "_percent")):
                found.append(FigureChange(manoeuvre.words, name, value, second.get(name)))
    return tuple(found)
