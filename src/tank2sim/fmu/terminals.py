"""Terminals of an FMU (FMI 3.0, 2.4.9): inputs and outputs that belong together, so that a tool joins them as one."""

from __future__ import annotations

from dataclasses import dataclass

from tank2sim.dynamics.effects import EFFECTS
from tank2sim.fmu.interface import FmuVariable, Interface

_DESCRIPTIONS = {
    "motion": "Motion of the ship: position and heading, velocities through the water and over the ground",
    "position": "Geographic position (WGS 84)",
    "steering": "Steering gear: rudder order and angle, failure",
    "thrusters": "Thrusters: orders, revolutions and thrust of each",
    "propulsion": "Propulsion: ordered and actual revolutions",
    "force": "Hydrodynamic forces and moment on the ship",
    "validity_by": "Factors of validity, one for each cause",
    "squat": "Largest sinkage by squat, by two formulas",
    "external": "External force and moment: X and Y at a point x, y, and N",
    "heading": "Heading order",
    "buoyancy": "Net buoyancy: order and actual",
    "pitch": "Pitch: order and actual",
    "roll": "Roll: order and actual",
}

_TERMINAL_OF = {"rudder": "steering", "propeller": "propulsion"}
"""First part of a variable's name to the terminal it belongs to, where that has another name."""


@dataclass(frozen=True)
class Terminal:
    """A terminal.

    Parameters
    ----------
    name, description : str
        What it is.
    members : tuple of pair
        Name of each member in the terminal, and the variable.
    """

    name: str
    description: str
    members: tuple[tuple[str, FmuVariable], ...]


def terminals(interface: Interface) -> tuple[Terminal, ...]:
    """The terminals: inputs and outputs with the same first part of their structured name, in the order of outputs.

    A variable whose name has one part (``validity``) belongs to none. Members are called by the rest of the name; where
    two groups share a terminal and a member's name, the later keeps its whole name.
    """
    grouped: dict[str, dict[str, FmuVariable]] = {}
    for variable in (*interface.with_causality("output"), *interface.with_causality("input")):
        first, _, member = variable.name.partition(".")
        if not member:
            continue
        members = grouped.setdefault(_TERMINAL_OF.get(first, first), {})
        members[variable.name if member in members else member] = variable
    descriptions = _DESCRIPTIONS | _of_effects()
    return tuple(
        Terminal(name, descriptions.get(name, f"Signals {name}.*"), tuple(members.items()))
        for name, members in grouped.items()
    )


def _of_effects() -> dict[str, str]:
    """First part of the names of an effect's inputs to what the effect says that they are together."""
    described = [effect for effect in EFFECTS.values() if effect.terminal]
    named = [(parameter.input_name, effect.terminal) for effect in described for parameter in effect.parameters]
    return {name.partition(".")[0]: description for name, description in named if name}
