"""A ship as the hull of gunnerus-dp, a case of the Open Simulation Platform: vectors of six, in its names and groups.

Surge, sway and yaw (members 1, 2 and 6) are the ship's, the others zero. Forces act at midships in the ship's axes. The
water moves by ``Current_Velocity[1..2]`` (m/s, in the ship's axes) over the ground: the ship's forces are of its motion
through the water, and its place and velocity are over the ground.
"""

from __future__ import annotations

from dataclasses import replace

import casadi as ca

from tank2sim.apps.programs.osp_case import low_speed_damping, resting_model
from tank2sim.apps.programs.program_files import ProgramFiles
from tank2sim.cards.card import Card, SteeredCard
from tank2sim.dynamics.effects.forces import with_forces
from tank2sim.dynamics.model import Input, Model, Quantity
from tank2sim.fmu.export import make_fmu
from tank2sim.fmu.interface import Interface, interface
from tank2sim.fmu.osp import Group
from tank2sim.fmu.provenance import documents_of
from tank2sim.fmu.templates import render

VESSEL = "VesselModel"
"""Name of the model and stem of its files, as in the case."""

_PLANE = (1, 2, 6)
_AXES = ("surge", "sway", "heave", "roll", "pitch", "yaw")

# Variable and group of the case -> kinds and units of its linear and its angular half.
_INPUTS = {
    "Thrust": ("thrust", "Force", "N", "Torque", "N.m"),
    "Wave_Forces": ("wave_forces", "Force", "N", "Torque", "N.m"),
    "Current_Velocity": ("current_velocity", "LinearVelocity", "m/s", "AngularVelocity", "rad/s"),
}
_OUTPUTS = {
    "Vessel_Position": ("position", "LinearDisplacement", "m", "AngularDisplacement", "rad"),
    "Vessel_Velocity": ("velocity", "LinearVelocity", "m/s", "AngularVelocity", "rad/s"),
    "Vessel_Acceleration": ("acceleration", "LinearAcceleration", "m/s2", "AngularAcceleration", "rad/s2"),
}


def gunnerus_files(card: Card) -> ProgramFiles:
    """The hull of the case gunnerus-dp: FMU and groups of variables.

    `card`: Card of a ship or craft that moves in the plane.

    Raises InputError: As :func:`.osp_files`.
    """
    ship = card.steered()
    model = gunnerus_model(ship)
    sway, yaw = low_speed_damping(ship, model)
    made = make_fmu(model, fmi=2, documents=replace(documents_of(ship), card_text=None))
    return ProgramFiles(
        files={
            f"{VESSEL}.fmu": made.content,
            f"{VESSEL}_OspModelDescription.xml": render(
                "OspModelDescription.xml", {"groups": gunnerus_groups(interface(model))}
            ),
        },
        use=f"""Put both files into `gunnerus-dp/fmus` of the demo cases of the Open Simulation Platform, in place of
`{VESSEL}.fmu` and its description. Steps are of 0.1 s; all variables start at zero.""",
        losses=(
            "gains of the case belong to the R/V Gunnerus: set the controller's for this ship",
            "heave, roll and pitch are zero",
            "the current is taken in the ship's axes, because the case calls its first member surge",
            f"the hull damps sway at 0.3 m/s by {sway:.2g} 1/s, and yaw by {yaw:.2g} 1/s with that at its ends",
        ),
    )


def gunnerus_model(card: SteeredCard) -> Model:
    """The model of a card at rest with the names of the case."""
    model = resting_model(card, VESSEL)
    inputs = {
        f"{name}[{place}]": Input(
            name=f"{name}[{place}]", unit=first if place < 4 else second, description=f"{name} in {axis}"
        )
        for name, (_, _, first, _, second) in _INPUTS.items()
        for place, axis in enumerate(_AXES, 1)
    }
    along, across = (inputs[f"Current_Velocity[{place}]"].symbol for place in (1, 2))
    shown = {
        "Vessel_Position": [model.symbol(f"motion.{name}") for name in ("x", "y", "psi")],
        "Vessel_Velocity": [
            model.symbol("motion.u") + along,
            model.symbol("motion.v") + across,
            model.symbol("motion.r"),
        ],
        "Vessel_Acceleration": [model.symbol(f"motion.{name}") for name in ("udot", "vdot", "rdot")],
    }
    outputs = []
    for name, (_, _, first, _, second) in _OUTPUTS.items():
        values = dict(zip(_PLANE, shown[name], strict=True))
        outputs += [
            Quantity(
                name=f"{name}[{place}]",
                unit=first if place < 4 else second,
                description=f"{name} in {axis}",
                value=ca.SX(values.get(place, 0.0)),
            )
            for place, axis in enumerate(_AXES, 1)
        ]
    X, Y, N = (sum(inputs[f"{name}[{place}]"].symbol for name in ("Thrust", "Wave_Forces")) for place in _PLANE)
    psi = model.symbol("motion.psi")
    moved = (
        model.extend(*inputs.values(), *outputs, outputs=[one.name for one in outputs])
        .redefine("motion.xdot", lambda rate: rate + along * ca.cos(psi) - across * ca.sin(psi))
        .redefine("motion.ydot", lambda rate: rate + along * ca.sin(psi) + across * ca.cos(psi))
    )
    return with_forces(moved, X=X, Y=Y, N=N)


def gunnerus_groups(described: Interface) -> tuple[Group, ...]:
    """The groups of the case: six variables each, and of the outputs those of the plane, too."""

    def group(variable: str, name: str, kinds: tuple[str, str], places: tuple[int, ...]) -> Group:
        parts = {"linear": [one for one in places if one < 4], "angular": [one for one in places if one > 3]}
        return Group(
            "Generic",
            name,
            groups=tuple(
                Group(kind, f"{name}_{part}", tuple((described.by_name[f"{variable}[{one}]"], "") for one in members))
                for kind, (part, members) in zip(kinds, parts.items(), strict=True)
            ),
        )

    every, found = tuple(range(1, 7)), []
    for variable, (name, first, _, second, _) in _INPUTS.items():
        found.append(group(variable, name, (first, second), every))
    for variable, (name, first, _, second, _) in _OUTPUTS.items():
        found.append(group(variable, f"{name}_6dof", (first, second), every))
        found.append(group(variable, f"{name}_3dof", (first, second), _PLANE))
    return tuple(found)
