"""A ship as the hull of dp-ship, a case of the Open Simulation Platform: its FMU with the case's names, and the system.

In the case two azimuth thrusters (magnitude F and angle a each) and a bow tunnel (F_3) move the hull. At places
(x_i, y_i), forward and to starboard of midships, that is::

    X = sum F_i cos a_i      Y = sum F_i sin a_i + F_3      N = sum (x_i F_i sin a_i - y_i F_i cos a_i) + x_3 F_3

The FMUs of the case were not run here.
"""

from __future__ import annotations

from dataclasses import replace
from importlib.metadata import version
from itertools import product
from typing import Any

import casadi as ca
import numpy as np

from tank2sim.apps.programs.osp_system import CASE_INERTIA, CASE_LENGTH_M, CASE_PLACES_M, CASE_STEP_S, case_system
from tank2sim.apps.programs.program_files import ProgramFiles
from tank2sim.cards.card import Card, SteeredCard
from tank2sim.dynamics.build import build
from tank2sim.dynamics.effects.forces import with_forces
from tank2sim.dynamics.effects.surroundings import in_calm
from tank2sim.dynamics.model import Input, Model, Quantity, same_symbol
from tank2sim.fmu.export import make_fmu
from tank2sim.fmu.interface import Interface, interface
from tank2sim.fmu.osp import Group
from tank2sim.fmu.provenance import documents_of
from tank2sim.fmu.templates import render
from tank2sim.simulation.thruster_manoeuvres import thruster_commands

HULL = "hull"
"""Name of the model and stem of its files."""

_LEAST_DRAG, _LARGEST_DRAG = 0.3, 30.0
"""Bounds of drag coefficients of sway and yaw at low speed. A hull has 0.6 to 1.6 (cross flow); with less the ship
swings under the case's controller, and with more the card has no bounded force at rest (project choice)."""

_STILL_PUSH = 1e-3
"""Largest thrust at rest that counts as none, over a hundredth of the ship's weight (project choice)."""


def osp_files(card: Card) -> ProgramFiles:
    """The folder of a ship in the case dp-ship: FMU, groups of variables, and the system of the whole case.

    `card`: Card of a ship or craft that moves in the plane.

    Raises InputError: The ship does not lie still without orders, its hull does not damp motions at low speed, or a
    compiler is missing.
    """
    ship = card.steered()
    model, (mass, inertia) = hull_model(ship), _inertia(ship)
    sway, yaw = low_speed_damping(ship, model)
    made = make_fmu(model, fmi=2, documents=replace(documents_of(ship), card_text=None))
    parts, joints = case_system(f"{HULL}.fmu", ship.ship.length_m, mass, inertia)
    values = {"parts": parts, "joints": joints, "step": CASE_STEP_S, "version": version("tank2sim")}
    return ProgramFiles(
        files={
            f"{HULL}.fmu": made.content,
            f"{HULL}_OspModelDescription.xml": render("OspModelDescription.xml", {"groups": _groups(interface(model))}),
            "OspSystemStructure.xml": render("OspCaseStructure.xml", values),
            "SystemStructure.ssd": render("OspCase.ssd.xml", values),
        },
        use=_USE,
        losses=(
            f"gains and limits of the case are scaled, to {mass / CASE_INERTIA[0]:.3g} times its mass and "
            f"{ship.ship.length_m:.4g} m; this was not run with the FMUs of the case",
            f"the hull damps sway at 0.3 m/s by {sway:.2g} 1/s, and yaw by {yaw:.2g} 1/s with that at its ends; a hull "
            "of 2365 t with 0.18 and 0.46 1/s stayed within 2 m, and with a sixth it swung by 20 to 40 m",
            "rudder and propellers of the card stay as inputs, at zero: the case's thrusters move the ship",
            "waves and current of the case are in its own hull: give them to this one by effects of the card",
        ),
    )


def resting_model(card: SteeredCard, name: str) -> Model:
    """The model of a card, named so, that starts at rest at the origin with stopped engines."""
    model = build(card)
    starts = [one for one in model.parameter_names if one.startswith("initial.") and one != "initial.trim"]
    model = replace(model.with_values(dict.fromkeys(starts, 0.0)), name=name)
    engines = {"propeller.speed", *(command.name for command in thruster_commands(model))}
    stopped = (same_symbol(one, replace(one, start=0.0)) if one.name in engines else one for one in model.inputs)
    return replace(model, inputs=tuple(stopped))


def hull_model(card: SteeredCard) -> Model:
    """The model of a card at rest with the case's names: ``Thrust_d[1..3]``, ``input[1..2]``, ``q[1..3]``."""
    model = resting_model(card, HULL)
    scale = card.ship.length_m / CASE_LENGTH_M
    force = card.scales.mass * 1e-3
    words = ("port azimuth thruster", "starboard azimuth thruster", "bow tunnel thruster, positive to starboard")
    thrusts = [
        Input(name=f"Thrust_d[{place}]", unit="N", description=f"Force of the {text}", nominal=force)
        for place, text in enumerate(words, 1)
    ]
    angles = [
        Input(name=f"input[{place}]", unit="rad", description=f"Angle of the {text}, from ahead to starboard")
        for place, text in enumerate(words[:2], 1)
    ]
    forces = [
        (one.symbol * ca.cos(angle.symbol), one.symbol * ca.sin(angle.symbol))
        for one, angle in zip(thrusts, angles, strict=False)
    ]
    forces.append((ca.SX(0), thrusts[2].symbol))
    moments = [scale * (x * Y - y * X) for (x, y), (X, Y) in zip(CASE_PLACES_M, forces, strict=True)]
    outputs = [
        Quantity(name=f"q[{place}]", unit=unit, description=text, value=model.symbol(name))
        for place, (name, unit, text) in enumerate(
            (
                ("motion.x", "m", "North position"),
                ("motion.y", "m", "East position"),
                ("motion.psi", "rad", "Heading, not wrapped"),
            ),
            1,
        )
    ]
    model = model.extend(*thrusts, *angles, *outputs, outputs=[one.name for one in outputs])
    return with_forces(model, X=sum(X for X, _ in forces), Y=sum(Y for _, Y in forces), N=sum(moments))


def _inertia(card: SteeredCard) -> tuple[float, float]:
    """Mass in sway (kg) and inertia in yaw (kg m2), with added masses."""
    body, known = card.body_si, card.derivatives
    units = (1.0, 1.0) if card.thrusters else (float(card.scales.mass), float(card.scales.inertia))
    return (
        body["mass"] - known.get("Yvdot", 0.0) * units[0],
        body["yaw_inertia"] - known.get("Nrdot", 0.0) * units[1],
    )


def low_speed_damping(card: SteeredCard, model: Model) -> tuple[float, float]:
    """Damping of sway and yaw in calm water at 0.3 m/s (of yaw at the ends), 1/s.

    `model`: Of :func:`resting_model`.

    Raises InputError: There is none, or the ship pushes itself at rest.
    """
    model = in_calm(model)
    length, draught = card.ship.length_m, card.ship.draught_m
    if draught is None:
        raise card.fault("ship.draught_m", "is missing, and damping at low speed is judged by it", "add it")
    pressure = 0.5 * card.environment.water_density_kgpm3 * length * draught
    names = [f"force.{letter}" for letter in "XYN"]
    function = ca.Function(
        "forces", [model.x, model.u, model.p], [model.expand(ca.vcat([model.symbol(name) for name in names]))]
    )

    def forces(**motion: float) -> Any:
        x = np.array(model.initial(model.parameter_values())).ravel()
        for letter, value in motion.items():
            x[model.state_names.index(f"motion.{letter}")] = value
        return np.array(function(x, model.input_values(), model.parameter_values())).ravel()

    still = abs(forces()[0])
    weight = card.body_si["mass"] * card.environment.gravity_mps2
    if "propeller.speed" not in model.input_names and still > _STILL_PUSH * weight / 100:
        problem = f"is missing, and the ship pushes itself with {still:.3g} N at rest: its engine cannot be stopped"
        raise card.fault("propulsion", problem, "add [propulsion] to the card")
    sizes = tuple(product((0.3, 1.0), (1, -1)))
    sway = {(v, side): -side * forces(v=side * v)[1] for v, side in sizes}
    yaw = {(v, side): -side * forces(r=side * 2 * v / length)[2] for v, side in sizes}
    for words, found, lever in (("sway", sway, 1.0), ("yaw", yaw, length / 8)):
        drag = [force / (pressure * lever * v**2) for (v, _), force in found.items()]
        if not all(_LEAST_DRAG <= value <= _LARGEST_DRAG for value in drag):
            problem = f"damp {words} with drag coefficients of {min(drag):.3g} to {max(drag):.3g} at 0.3 to 1 m/s"
            remedy = (
                "a hull has about 1, and the case's controller cannot hold others: give cross_flow_drag, or low_speed"
            )
            raise card.fault("derivatives", problem, remedy)
    mass, inertia = _inertia(card)
    return sway[0.3, 1] / (mass * 0.3), yaw[0.3, 1] / (inertia * 0.6 / length)


def _groups(described: Interface) -> tuple[Group, ...]:
    """The groups of the case's hull, in the order in which the case joins their variables."""

    def group(kind: str, name: str, *members: str, groups: tuple[Group, ...] = ()) -> Group:
        return Group(kind, name, tuple((described.by_name[member], "") for member in members), groups)

    position = (
        group("LinearDisplacement", "position_linear", "q[1]", "q[2]"),
        group("AngularDisplacement", "position_angular", "q[3]"),
    )
    # The allocation of the case has the tunnel's force in a group of moments; only the place counts.
    thrust = (
        group("Force", "thrust_main", "Thrust_d[1]", "Thrust_d[2]"),
        group("Force", "thrust_bow", "Thrust_d[3]"),
    )
    return (
        group("Generic", "position", groups=position),
        group("Generic", "thrust", groups=thrust),
        group("AngularDisplacement", "azimuthAngle", "input[1]", "input[2]"),
    )


_USE = """Copy the files into a copy of the folder `dp-ship` of the demo cases of the Open Simulation Platform, over its
`OspSystemStructure.xml` and `SystemStructure.ssd`. Open the folder with `cosim` or the demo application:

```text
cosim run OspSystemStructure.xml --duration 600
```

`hull.fmu` (FMI 2, Co-Simulation) takes the place of `OSOM.fmu`: forces of the two azimuth thrusters `Thrust_d[1]`,
`Thrust_d[2]` (N) at angles `input[1]`, `input[2]` (rad, from ahead to starboard), force of the bow tunnel `Thrust_d[3]`
(N, to starboard); north, east (m) and heading (rad, not wrapped) `q[1]`, `q[2]`, `q[3]`. All start at zero, steps are
of 0.04 s. Way-points are inputs of the Reference Generator (`x_wp`, `x_tp`, ...), as in the case's scenarios.

`tank2sim check hull.fmu --for osp` looks at its description and groups. Its variables are those of the case and not of
the card: the two cannot be compared."""
