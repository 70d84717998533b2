"""Programs that take FMUs and are stricter than the standard: few variables for them, and checks of their conditions.

The conditions are read in the sources of the importers, not tried in them: Unity by CATIA-Systems/Unity-FMI-Addon
(FMI2.cs, FMUImporter.cs), Unreal by ORNL-Modelica/UnrealEngine-FMIPlugin (A_FMU.cpp), OSP by libcosim and OSP-IS 1.0.
"""

from __future__ import annotations

import re
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal
from xml.etree import ElementTree

from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tank2sim.fmu.osp import OSP_FILE

Host = Literal["unity", "unreal", "osp"]
"""A program that :func:`host_conditions` knows."""

MOST_VARIABLES = 100
"""Variables that a game engine reads one by one in each frame. Project choice: half of those with which Unity's add-on
is reported to crash (184, issue 2)."""

SHORTEST_STOP_S = 3600.0
"""Stop time (s) below which Unreal's plugin, which goes no further, would end an exercise. Project choice."""

_LARGEST_BYTES = 5_000_000  # Project choice: unpacked within the half second that Unreal's plugin waits
_FARTHEST_M = 1e5  # single precision then resolves 4 mm
_PLAIN_NAME = re.compile("[A-Za-z][A-Za-z0-9_]{0,59}", re.ASCII)

_LEAN_PARAMETERS = ("initial.x", "initial.y", "initial.psi", "initial.u")
_LEAN_OUTPUTS = ("motion.speed", "motion.heading", "propeller.speed_actual", "validity")


def lean_model(model: Model) -> Model:
    """The model with few variables, for an engine that reads all of them in each frame.

    All real inputs but ``external.*``; the states, of the other outputs speed, heading, revolutions and validity; where
    and how fast the ship starts. Everything else is a constant, and the start is not in steady motion.
    """
    held = [one.name for one in model.inputs if one.boolean or one.name.startswith("external.")]
    still = model.with_constant_inputs(held)
    constant = still.with_constants(name for name in still.parameter_names if name not in _LEAN_PARAMETERS)
    shown = (*constant.state_names, *_LEAN_OUTPUTS)
    return replace(constant, outputs=tuple(name for name in constant.outputs if name in shown))


@dataclass(frozen=True)
class HostCondition:
    """A condition of a host.

    Parameters
    ----------
    condition : str
    met : bool
    found : str
        What the FMU has, with its number, and what the host does with it.
    """

    condition: str
    met: bool
    found: str


@dataclass(frozen=True)
class _Fmu:
    """Data that the conditions look at."""

    path: Path
    root: ElementTree.Element
    sizes: dict[str, int]
    groups: ElementTree.Element | None
    variables: tuple[dict[str, str], ...]

    @property
    def name(self) -> str:
        """The modelName."""
        return self.root.get("modelName", "")

    @property
    def co_simulation(self) -> ElementTree.Element | None:
        """The element of Co-Simulation, if it is offered."""
        return self.root.find("CoSimulation")

    @property
    def identifier(self) -> str:
        """The modelIdentifier of Co-Simulation."""
        return "" if self.co_simulation is None else self.co_simulation.get("modelIdentifier", "")


def host_conditions(path: Path, host: Host) -> tuple[HostCondition, ...]:
    """The conditions of a host, in the order in which it would come upon them.

    Parameters
    ----------
    path : Path
        An FMU, FMI 2 or 3.
    host : str

    Raises
    ------
    InputError
        The file is not an FMU.
    """
    fmu = _read(path)
    found = []
    for check in _CONDITIONS[host]:
        met, words = check(fmu)
        found.append(HostCondition(check.__name__.lstrip("_"), met, words))
    return tuple(found)


def _read(path: Path) -> _Fmu:
    try:
        with zipfile.ZipFile(path) as archive:
            sizes = {entry.filename: entry.file_size for entry in archive.infolist()}
            root = ElementTree.fromstring(archive.read("modelDescription.xml"))
            groups = ElementTree.fromstring(archive.read(OSP_FILE)) if OSP_FILE in sizes else None
    except (OSError, KeyError, zipfile.BadZipFile, ElementTree.ParseError) as error:
        raise InputError(path, "", f"is not an FMU ({error})", "give a file that tank2sim exported") from None
    listed = root.find("ModelVariables")
    variables = []
    for one in [] if listed is None else list(listed):
        kind = one[0] if one.tag == "ScalarVariable" and len(one) else one
        variables.append({**one.attrib, **kind.attrib, "type": kind.tag})
    return _Fmu(path, root, sizes, groups, tuple(variables))


def _fmi_2_co_simulation(fmu: _Fmu) -> tuple[bool, str]:
    version, offered = fmu.root.get("fmiVersion", ""), fmu.co_simulation is not None
    return version.startswith("2") and offered, f"FMI {version}, {'with' if offered else 'without'} Co-Simulation"


def _model_name(fmu: _Fmu) -> tuple[bool, str]:
    met = fmu.name == fmu.identifier and bool(_PLAIN_NAME.fullmatch(fmu.name))
    return met, f"modelName {fmu.name!r}, modelIdentifier {fmu.identifier!r}: one plain name of at most 60 letters"


def _file_name(fmu: _Fmu) -> tuple[bool, str]:
    return (
        fmu.path.stem == fmu.name,
        f"file {fmu.path.stem!r}, modelName {fmu.name!r}: its folder is looked for by both",
    )


def _windows_library(fmu: _Fmu) -> tuple[bool, str]:
    place = f"binaries/win64/{fmu.identifier}.dll"
    return place in fmu.sizes, f"{place} {'is there' if place in fmu.sizes else 'is missing: export --platforms all'}"


def _no_resources(fmu: _Fmu) -> tuple[bool, str]:
    files = [name for name in fmu.sizes if name.startswith("resources/") and not name.endswith("/")]
    own = fmu.root.get("generationTool", "").startswith("tank2sim") and files == ["resources/ship.toml"]
    words = f"{len(files)} files in resources/"
    return not files or own, f"{words}, which the library does not read" if own else f"{words}: the path given is wrong"


def _memory_callbacks(fmu: _Fmu) -> tuple[bool, str]:
    declared = fmu.co_simulation is not None and fmu.co_simulation.get("canNotUseMemoryManagementFunctions") == "true"
    return declared, f"the FMU declares that it {'does not use' if declared else 'may use'} the host's memory functions"


def _few_variables(fmu: _Fmu) -> tuple[bool, str]:
    count = len(fmu.variables)
    return count <= MOST_VARIABLES, f"{count} variables, at most {MOST_VARIABLES} (export --lean)"


def _ascii_description(fmu: _Fmu) -> tuple[bool, str]:
    texts = [fmu.root.attrib, *fmu.variables]
    others = sorted({letter for one in texts for value in one.values() for letter in value if not letter.isascii()})
    return not others, f"{len(others)} letters beyond ASCII" + (f": {''.join(others[:8])}" if others else "")


def _names_without_case(fmu: _Fmu) -> tuple[bool, str]:
    names = [one.get("name", "") for one in fmu.variables]
    lower = [name.lower() for name in names]
    doubled = [name for name, small in zip(names, lower, strict=True) if lower.count(small) > 1]
    words = f"{len(doubled)} names differ by case alone"
    return not doubled, words + (f": {', '.join(doubled[:4])}" if doubled else "")


def _default_experiment(fmu: _Fmu) -> tuple[bool, str]:
    given = fmu.root.find("DefaultExperiment")
    values = {} if given is None else given.attrib
    wanted = ("startTime", "stopTime", "stepSize", "tolerance")
    stop, step = (_number(values.get(name)) for name in ("stopTime", "stepSize"))
    met = all(name in values for name in wanted) and stop >= SHORTEST_STOP_S and step > 0
    said = ", ".join(f"{name} {values.get(name, 'missing')}" for name in wanted)
    return met, f"{said}; the stop at least {SHORTEST_STOP_S:g} s"


def _number(text: str | None) -> float:
    try:
        return float(text or "nan")
    except ValueError:
        return float("nan")


def _real_inputs(fmu: _Fmu) -> tuple[bool, str]:
    inputs = [one for one in fmu.variables if one.get("causality") == "input"]
    others = [one["name"] for one in inputs if one["type"] not in ("Real", "Float64")]
    words = f"{len(others)} of {len(inputs)} inputs are not real"
    return not others, words + (f": {', '.join(others[:4])} cannot be set (export --lean)" if others else "")


def _small_file(fmu: _Fmu) -> tuple[bool, str]:
    size = sum(fmu.sizes.values())
    return size <= _LARGEST_BYTES, f"{size / 1e6:.2g} MB unpacked, at most {_LARGEST_BYTES / 1e6:g} MB"


def _no_blank_in_path(fmu: _Fmu) -> tuple[bool, str]:
    return " " not in fmu.path.name, f"{fmu.path.name.count(' ')} blanks in the file's name"


def _start_near_zero(fmu: _Fmu) -> tuple[bool, str]:
    starts = [one.get("start") for one in fmu.variables if one.get("name") in ("initial.x", "initial.y")]
    farthest = max((abs(_number(start)) for start in starts), default=0.0)
    return farthest <= _FARTHEST_M, f"the ship starts {farthest:g} m from zero, at most {_FARTHEST_M:g} m (float)"


def _structured_names(fmu: _Fmu) -> tuple[bool, str]:
    found = fmu.root.get("variableNamingConvention", "flat")
    return found == "structured", f"variableNamingConvention {found}"


def _variable_groups(fmu: _Fmu) -> tuple[bool, str]:
    if fmu.groups is None:
        return False, f"no {OSP_FILE}"
    named = [one.get("ref", "") for one in fmu.groups.iter() if one.tag.rpartition("}")[2] == "Variable"]
    unknown = sorted({*named} - {one.get("name", "") for one in fmu.variables})
    words = f"{len(named)} variables in groups"
    return bool(named) and not unknown, words + (f", not in the FMU: {', '.join(unknown[:4])}" if unknown else "")


def _groups_next_to_it(fmu: _Fmu) -> tuple[bool, str]:
    name = f"{fmu.name}_OspModelDescription.xml"
    there = (fmu.path.parent / name).is_file()
    return there, f"{name} {'is' if there else 'is not'} next to the FMU (export --osp)"


def _library_of_the_engine(fmu: _Fmu) -> tuple[bool, str]:
    places = {"linux64": ".so", "win64": ".dll"}
    found = [folder for folder, end in places.items() if f"binaries/{folder}/{fmu.identifier}{end}" in fmu.sizes]
    return bool(found), f"libraries for {', '.join(found) or 'neither linux64 nor win64'}"


_Check = Callable[[_Fmu], tuple[bool, str]]
_OF_ENGINES: tuple[_Check, ...] = (
    *(_fmi_2_co_simulation, _model_name, _file_name, _windows_library, _no_resources, _few_variables),
    *(_ascii_description, _names_without_case),
)
_CONDITIONS: dict[Host, tuple[_Check, ...]] = {
    "unity": (*_OF_ENGINES, _memory_callbacks),
    "unreal": (
        *_OF_ENGINES,
        *(_default_experiment, _real_inputs, _small_file, _no_blank_in_path, _start_near_zero),
    ),
    "osp": (*(_fmi_2_co_simulation, _structured_names, _library_of_the_engine, _variable_groups, _groups_next_to_it),),
}
