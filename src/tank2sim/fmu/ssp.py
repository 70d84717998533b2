"""A ship and its heading autopilot as one package of System Structure and Parameterization, SSP 1.0."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from typing import TYPE_CHECKING

from tank2sim.dynamics.model import Model
from tank2sim.fmu.export import ExportedFmu, make_fmu, zipped
from tank2sim.fmu.interface import FmuVariable, interface
from tank2sim.fmu.libraries import ProgressReport
from tank2sim.fmu.platforms import Platform
from tank2sim.fmu.provenance import Documents, ValueOrigin
from tank2sim.fmu.templates import render
from tank2sim.units import UNITS

if TYPE_CHECKING:
    from tank2sim.analysis.heading.designs import HeadingDesign

_STOP_SHIP_TIMES = 40  # L/u0, in which a change of course has long ended


@dataclass(frozen=True)
class Part:
    """A component of a system: its FMU's file in ``resources/``, and the connectors that it shows."""

    name: str
    description: str
    file: str
    connectors: tuple[FmuVariable, ...]


@dataclass(frozen=True)
class Joint:
    """A connection between connectors of one name."""

    start: str
    end: str
    variable: str


def ship_with_autopilot(
    ship: Model,
    made: ExportedFmu,
    *,
    every_input: bool = False,
    platforms: Sequence[Platform] | None = None,
    report: ProgressReport = lambda _: None,
) -> bytes:
    """The package: the ship's FMU as it was made, an autopilot for it for the same version of FMI, and their joints.

    Inputs are joined to outputs of the same name. The others (``heading.command`` of the autopilot, the revolutions)
    are connectors of their component with `every_input` alone: FMPy sets a connector that nothing is joined to to zero,
    also the revolutions, where libcosim and SSP 1.0 keep the start values. They are not connectors of the system, which
    the engines of OSP and ecos do not know; but all engines set variables of a component.
    Platforms and `report` are as in :func:`tank2sim.fmu.export.make_fmu`.

    Raises
    ------
    InputError
        No autopilot can be designed for the ship, or its FMU cannot be made: see
        :func:`tank2sim.analysis.heading.designs.design_heading` and :func:`tank2sim.fmu.export.make_fmu`.
    """
    from tank2sim.analysis.heading.designs import design_heading  # slow to import

    design = design_heading(ship)
    autopilot = design.autopilot
    steered = make_fmu(autopilot, fmi=made.fmi, documents=_documents(design), platforms=platforms, report=report)
    parts, joints = _joined({"ship": ship, "autopilot": autopilot}, every_input)
    values = {
        "name": f"{ship.name} with heading autopilot",
        "description": "A ship on a heading that its autopilot keeps: heading.command of autopilot, rad",
        "version": version("tank2sim"),
        "parts": parts,
        "connections": joints,
        "units": [UNITS[name] for name in sorted({connector.unit for part in parts for connector in part.connectors})],
        "stop_time": float(round(_STOP_SHIP_TIMES * ship.defaults["ship.length"] / ship.defaults["ship.speed"])),
    }
    contents = {
        "SystemStructure.ssd": render("SystemStructure.ssd.xml", values).encode("utf-8"),
        f"resources/{parts[0].file}": made.content,
        f"resources/{parts[1].file}": steered.content,
    }
    return zipped(contents, first="SystemStructure.ssd")


def _joined(models: Mapping[str, Model], every_input: bool) -> tuple[list[Part], list[Joint]]:
    """Components and connections: each input that has the name of another's output is joined to it."""
    described = {name: interface(model) for name, model in models.items()}
    parts, joints = [], []
    for name, model in models.items():
        taken = []
        inputs = described[name].with_causality("input")
        for variable in inputs:
            for other, its in described.items():
                if other != name and variable.name in {output.name for output in its.with_causality("output")}:
                    joints.append(Joint(other, name, variable.name))
                    taken.append(variable)
        connectors = (*(inputs if every_input else taken), *described[name].with_causality("output"))
        parts.append(Part(name, model.description, f"{name}.fmu", connectors))
    return parts, joints


def _documents(design: HeadingDesign) -> Documents:
    """Description of the autopilot's FMU."""
    nomoto = design.found.nomoto.dimensional
    source = f"{design.source}: K = {nomoto.K_per_s:.5g} 1/s, T = {nomoto.T_s:.5g} s"
    tuned = (parameter.name for parameter in design.autopilot.parameters if parameter.name.startswith("autopilot."))
    return Documents(source=source, origins={name: ValueOrigin(source) for name in tuned})
