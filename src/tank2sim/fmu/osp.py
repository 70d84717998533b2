"""Variable groups after the interface specification of the Open Simulation Platform, OSP-IS 1.0.1.

Groups of one kind in two FMUs are joined as one connection. The kind (``LinearVelocity``) says what the variables are;
they are in the order of the axes, forward and starboard in body axes, north and east in earth axes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from tank2sim.dynamics.model import Model
from tank2sim.fmu.interface import FmuVariable, Interface, interface
from tank2sim.fmu.templates import render


@dataclass(frozen=True)
class Group:
    """A group of variables, or of groups.

    Parameters
    ----------
    kind : str
        Element of OSP-IS, such as ``Generic`` or ``LinearVelocity``.
    name : str
        Unique in an FMU.
    variables : tuple of pair
        Variable and its axis, ``x``, ``y``, ``z`` or empty.
    groups : tuple of Group
        Those within, in the order in which the schema has their kinds.
    """

    kind: str
    name: str
    variables: tuple[tuple[FmuVariable, str], ...] = ()
    groups: tuple[Group, ...] = ()


Parts = tuple[tuple[str, str, dict[str, str]], ...]

# Generic group -> its parts: kind, name, variables with their axes. Names of groups as in OSP's demonstration vessel
# where that has them. Kinds are in the order of the schema, which is a sequence.
_MOTION: dict[str, Parts] = {
    "ned_position": (
        ("LinearDisplacement", "ned_position.linear", {"motion.x": "x", "motion.y": "y"}),
        ("AngularDisplacement", "ned_position.angular", {"motion.psi": "z"}),
    ),
    "body_velocity": (
        ("LinearVelocity", "body_velocity.linear", {"motion.u": "x", "motion.v": "y"}),
        ("AngularVelocity", "body_velocity.angular", {"motion.r": "z"}),
    ),
    "body_acceleration": (
        ("LinearAcceleration", "body_acceleration.linear", {"motion.udot": "x", "motion.vdot": "y"}),
        ("AngularAcceleration", "body_acceleration.angular", {"motion.rdot": "z"}),
    ),
    "hull_forces": (
        ("Force", "hull_forces.linear", {"force.X": "x", "force.Y": "y"}),
        ("Torque", "hull_forces.angular", {"force.N": "z"}),
    ),
    "propeller_order": (("ShaftSpeed", "propeller_order.shaft", {"propeller.speed": ""}),),
    "propeller_feedback": (("ShaftSpeed", "propeller_feedback.shaft", {"propeller.speed_actual": ""}),),
    "rudder_order": (("AngularDisplacement", "rudder_order.angle", {"rudder.command": "z"}),),
    "rudder_feedback": (("AngularDisplacement", "rudder_feedback.angle", {"rudder.angle": "z"}),),
    "heading_order": (("AngularDisplacement", "heading_order.angle", {"heading.command": "z"}),),
}


def osp_system(model: Model, file: str, identifier: str) -> dict[str, str]:
    """Name to text of the files that the engine of OSP wants next to the FMU `file`, whose modelName is `identifier`.

    ``OspSystemStructure.xml`` is a system of this ship alone, with the start of each input to change, at steps that are
    ten times the model's; ``<identifier>_OspModelDescription.xml`` has the groups of variables by which ships are
    joined.
    """
    described = interface(model)
    step = float(STEPS_IN_COMMUNICATION * model.step_s)
    values = {"step": step, "file": file, "inputs": described.with_causality("input")}
    return {
        "OspSystemStructure.xml": render("OspSystemStructure.xml", values),
        f"{identifier}_OspModelDescription.xml": render("OspModelDescription.xml", {"groups": osp_groups(described)}),
    }


OSP_FILE = "extra/com.open-simulation-platform/OspModelDescription.xml"
"""Groups of variables in the FMU. OSP's engine looks for a copy next to it, ``<modelName>_OspModelDescription.xml``."""

STEPS_IN_COMMUNICATION = 10
"""Steps of the model in a communication step of the system for OSP: project choice, within a second for ships."""


def osp_groups(interface: Interface) -> tuple[Group, ...]:
    """Generic groups with all inputs and outputs that OSP-IS has kinds for, then one for each other kind of signal.

    A part that lacks one of its variables is left out. What has no kind (``wind.speed``) is in a Generic group
    with the others of its first name and causality (``wind`` for inputs, ``position_output`` for outputs).
    """
    found = {one.name: one for causality in ("input", "output") for one in interface.with_causality(causality)}
    groups = _motion_groups(found)
    grouped = {variable.name for group in groups for variable in _variables(group)}
    others: dict[str, list[tuple[FmuVariable, str]]] = {}
    for one in found.values():
        if one.name not in grouped:
            name = one.name.partition(".")[0] + ("" if one.causality == "input" else "_output")
            others.setdefault(name, []).append((one, ""))
    return (*groups, *(Group("Generic", name, tuple(members)) for name, members in others.items()))


def _motion_groups(found: Mapping[str, FmuVariable]) -> list[Group]:
    groups = []
    for name, parts in _MOTION.items():
        within = tuple(
            Group(kind, part, tuple((found[variable], axis) for variable, axis in variables.items()))
            for kind, part, variables in parts
            if all(variable in found for variable in variables)
        )
        if within:
            groups.append(Group("Generic", name, groups=within))
    return groups


def _variables(group: Group) -> Iterator[FmuVariable]:
    yield from (variable for variable, _ in group.variables)
    for within in group.groups:
        yield from _variables(within)
