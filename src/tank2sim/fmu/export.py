"""A model as an FMU: sources, library, description and documentation in one file, the same bytes each time."""

from __future__ import annotations

import hashlib
import io
import os
import time
import uuid
import zipfile
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tank2sim.bundled import bundled
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.dynamics.model import Model
from tank2sim.errors import ArgumentError, InputError
from tank2sim.files import write_whole
from tank2sim.fmu.dependencies import fmu_structure
from tank2sim.fmu.interface import FmuVariable, Interface, interface
from tank2sim.fmu.libraries import ProgressReport, libraries, require_compilers
from tank2sim.fmu.osp import OSP_FILE, osp_groups
from tank2sim.fmu.platforms import Platform
from tank2sim.fmu.provenance import Documents
from tank2sim.fmu.sources import c_sources, headers_notice
from tank2sim.fmu.templates import c_identifier, render
from tank2sim.fmu.unpacking import CARD_IN_FMU
from tank2sim.units import UNITS

if TYPE_CHECKING:
    from tank2sim.fmu.acceptance import AcceptanceResult

_EXPERIMENT_S = 3600.0  # project choice: some hosts end at the stop time of the default experiment
_EXPERIMENT_TOLERANCE = 1e-6
_NO_TOKEN = "{00000000-0000-0000-0000-000000000000}"
_DESCRIPTION = "modelDescription.xml"
_ICON_FILES = ("icon.png", "icon.svg")

_FIRST_TIME_OF_ZIP = 315532800  # 1980-01-01T00:00:00Z

_TERMINALS = {
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


@dataclass(frozen=True, kw_only=True)
class ExportedFmu:
    """An FMU, and what it is: its bytes, version of FMI, model identifier, token and platforms."""

    content: bytes = field(repr=False)
    fmi: int
    model_identifier: str
    token: str
    platforms: tuple[str, ...]


def write_fmu(model: Model, path: Path, *, fmi: int = 2, documents: Documents | None = None) -> ExportedFmu:
    """Write the FMU of :func:`make_fmu` to a file, whole or not at all. Raises also if it cannot be written."""
    made = make_fmu(model, fmi=fmi, documents=named_after(documents or Documents(), Path(path)))
    write_whole(Path(path), made.content)
    return made


def named_after(documents: Documents, path: Path) -> Documents:
    """The documents with the name of a file, which game engines look for as modelName, as the model identifier."""
    return replace(documents, identifier=c_identifier(path.stem))


def _identifier(model: Model, documents: Documents) -> str:
    return documents.identifier or c_identifier(model.name)


def _titled(model: Model) -> str:
    """Name and description, as the description of the FMU: its modelName is the identifier."""
    return model.description if model.name in model.description else f"{model.name}: {model.description}"


def make_fmu(
    model: Model,
    *,
    fmi: int = 2,
    documents: Documents | None = None,
    platforms: Sequence[Platform] | None = None,
    report: ProgressReport = lambda _: None,
    sources: bool = True,
) -> ExportedFmu:
    """One FMU with Model Exchange and Co-Simulation for this machine's platform, or for others.

    The same model and documents give the same bytes: the token comes from the content, and times are those of
    SOURCE_DATE_EPOCH or, without it, constant.

    Parameters
    ----------
    fmi : int
        Version of FMI, 2 (2.0) or 3 (3.0).
    platforms : sequence of Platform, optional
        None: this machine's, compiled by its own compiler; others need the extra ``platforms``.
    report : callable, optional
        Hears which libraries are being compiled.
    sources : bool
        Whether the C sources are in it. Without them it holds libraries alone; :func:`without_coefficients` makes a
        model whose libraries show no coefficient either.

    Raises
    ------
    InputError
        There is no compiler, this machine's platform has no name in FMI, SOURCE_DATE_EPOCH is not a time, or `fmi` is
        neither 2 nor 3.
    """
    if fmi not in (2, 3):
        raise ArgumentError("fmi", "", f"there is no FMI {fmi} here", "choose 2 or 3")
    require_compilers(platforms)
    documents = documents or Documents()
    described = interface(model)
    identifier = _identifier(model, documents)
    files, token = _with_token(_texts(model, described, fmi, documents, sources))
    written = {name.removeprefix("sources/"): text for name, text in files.items() if name.startswith("sources/")}
    if not sources:
        files = {name: text for name, text in files.items() if not name.startswith("sources/")}
    with ThreadPoolExecutor(1) as pool:  # the reference is calculated while the compiler works
        promised = pool.submit(_gathered, model)
        made = libraries(written, platforms, fmi, report)
        evidence = promised.result()
    contents = _encoded(files | evidence.reference_files()) | _icons(fmi)
    contents |= {f"binaries/{folder}/{identifier}{suffix}": library for (folder, suffix), library in made.items()}
    contents |= _encoded(evidence.passport_files(documents, zipped(contents, first=_DESCRIPTION), fmi))
    return ExportedFmu(
        content=zipped(contents, first=_DESCRIPTION),
        fmi=fmi,
        model_identifier=identifier,
        token=token,
        platforms=tuple(folder for folder, _ in made),
    )


def without_coefficients(model: Model) -> Model:
    """The model with all parameters as numbers in its equations, except for start and place."""
    kept = ("initial.", "origin.")
    return model.with_constants(name for name in model.parameter_names if not name.startswith(kept))


def description_text(model: Model, *, fmi: int) -> str:
    """The ``modelDescription.xml`` that :func:`make_fmu` would write, except for its token, documents and source
    files."""
    return render(f"modelDescription-fmi{fmi}.xml", _values(model, interface(model), fmi, Documents()))


def _gathered(model: Model) -> AcceptanceResult:
    from tank2sim.fmu.acceptance import gather  # SciPy, which takes as long to load as a reference run

    return gather(model)


def _texts(model: Model, described: Interface, fmi: int, documents: Documents, sources: bool) -> dict[str, str]:
    """All files of the FMU but the library, by name, with a token of zeros; `sources` says whether it names those."""
    written = c_sources(model, described, fmi, _NO_TOKEN)
    values = _values(model, described, fmi, documents)
    values["sources"] = sorted(name for name in written if name.endswith(".c")) if sources else []
    files = {f"sources/{name}": text for name, text in written.items()}
    files[_DESCRIPTION] = render(f"modelDescription-fmi{fmi}.xml", values)
    files["documentation/index.html"] = render("index.html", values)
    files["documentation/licenses/license.txt"] = bundled("LICENSE").read_text(encoding="utf-8")
    files["documentation/licenses/FMI-headers.txt"] = headers_notice(fmi)
    files[OSP_FILE] = render("OspModelDescription.xml", {"groups": osp_groups(described)})
    if fmi == 3:
        files["sources/buildDescription.xml"] = render("buildDescription.xml", values)
        grouped = {"terminals": terminals(described)}
        files["terminalsAndIcons/terminalsAndIcons.xml"] = render("terminalsAndIcons.xml", grouped)
    if documents.card_text is not None:
        files[CARD_IN_FMU] = documents.card_text
    return files


def _encoded(files: dict[str, str]) -> dict[str, bytes]:
    return {name: text.encode("utf-8") for name, text in files.items()}


def _icons(fmi: int) -> dict[str, bytes]:
    """The pictures by which a tool shows the FMU (FMI 2.0, 2.3; FMI 3.0, 2.5.1)."""
    names = {"icon.png": "model.png"} if fmi == 2 else {name: f"terminalsAndIcons/{name}" for name in _ICON_FILES}
    return {name: bundled("fmu_templates", file).read_bytes() for file, name in names.items()}


def _values(model: Model, described: Interface, fmi: int, documents: Documents) -> dict[str, Any]:
    """The data of the templates of the description and the documentation, without the names of source files."""
    return {
        "about": {
            "name": model.name,
            "description": model.description,
            "title": _titled(model),
            "version": version("tank2sim"),
            "date": _date(),
            "source": documents.source,
            "validity": documents.validity,
            "notices": [notice.line for notice in model.notices],
        },
        "token": _NO_TOKEN,
        "fmi": fmi,
        "identifier": _identifier(model, documents),
        "interface": described,
        "structure": fmu_structure(model, described),
        "units": [UNITS[name] for name in sorted({variable.unit for variable in described.variables})],
        "sources": [],
        "experiment": {
            "step": model.step_s,
            "stop_time": _EXPERIMENT_S,
            "tolerance": _EXPERIMENT_TOLERANCE,
        },
    }


def _with_token(files: dict[str, str]) -> tuple[dict[str, str], str]:
    """The files with the token that comes from their content in place of zeros, and the token."""
    token = _token(files)
    sealed = {name: files[name].replace(_NO_TOKEN, token) for name in (_DESCRIPTION, "sources/model.h")}
    return files | sealed, token


def _token(files: dict[str, str]) -> str:
    digest = hashlib.sha256()
    for name in sorted(files):
        for part in (name, files[name]):
            data = part.encode("utf-8")
            digest.update(len(data).to_bytes(8, "big") + data)
    return f"{{{uuid.UUID(bytes=digest.digest()[:16])}}}"


def _epoch() -> int | None:
    given = os.environ.get("SOURCE_DATE_EPOCH")
    if not given:
        return None
    try:
        seconds = int(given)
        time.gmtime(seconds)
    except (ValueError, OverflowError, OSError):
        remedy = "set it to seconds since 1970, or leave it out"
        raise InputError("SOURCE_DATE_EPOCH", "", f"{given!r} is not a time", remedy) from None
    return seconds


def _date() -> str:
    seconds = _epoch()
    return "" if seconds is None else time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime(seconds))


def zipped(contents: Mapping[str, bytes], *, first: str) -> bytes:
    """A zip archive, the same bytes each time, with one entry before the others: readers that stream want it first."""
    moment = time.gmtime(max(_epoch() or 0, _FIRST_TIME_OF_ZIP))[:6]
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=6) as archive:
        for name in sorted(contents, key=lambda name: (name != first, name)):
            entry = zipfile.ZipInfo(name, moment)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.create_system = 3
            entry.external_attr = (0o755 if name.startswith("binaries/") else 0o644) << 16
            archive.writestr(entry, contents[name])
    return buffer.getvalue()


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
    descriptions = _TERMINALS | _terminals_of_effects()
    return tuple(
        Terminal(name, descriptions.get(name, f"Signals {name}.*"), tuple(members.items()))
        for name, members in grouped.items()
    )


def _terminals_of_effects() -> dict[str, str]:
    """First part of the names of an effect's inputs to what the effect says that they are together."""
    described = [effect for effect in EFFECTS.values() if effect.terminal]
    named = [(parameter.input_name, effect.terminal) for effect in described for parameter in effect.parameters]
    return {name.partition(".")[0]: description for name, description in named if name}
