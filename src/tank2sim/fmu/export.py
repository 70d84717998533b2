"""A model as an FMU: sources, library, description and documentation in one file, the same bytes each time."""

from __future__ import annotations

import hashlib
import io
import os
import sys
import tempfile
import time
import uuid
import zipfile
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any

from tank2sim.bundled import bundled
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tank2sim.files import write_whole
from tank2sim.fmu.dependencies import structure
from tank2sim.fmu.interface import Interface, interface
from tank2sim.fmu.platforms import host_platform
from tank2sim.fmu.sources import c_sources, headers_notice
from tank2sim.fmu.templates import c_identifier, render
from tank2sim.fmu.unpacking import CARD_IN_FMU
from tank2sim.native.compiler import compile_shared, require_compiler
from tank2sim.units import UNITS

_EXPERIMENT_STEPS = 6000
_EXPERIMENT_TOLERANCE = 1e-6
_NO_TOKEN = "{00000000-0000-0000-0000-000000000000}"
_FIRST_TIME_OF_ZIP = 315532800  # 1980-01-01T00:00:00Z

# A library bears neither the name of its file nor the time of its making, so that it is the same each time.
_LINK_FLAGS = {
    "linux": ("-Wl,--strip-all",),
    "darwin": ("-Wl,-install_name,@rpath/model.dylib",),
    "win32": ("-Wl,--no-insert-timestamp",),
}


@dataclass(frozen=True, kw_only=True)
class Documents:
    """What an FMU says of its ship beside the equations.

    Parameters
    ----------
    card_text : str, optional
        The ship card, kept in the FMU as ``resources/ship.toml``.
    source : str
        Where the data come from, in a sentence.
    validity : str
        Where the model holds, in a sentence.
    """

    card_text: str | None = None
    source: str = ""
    validity: str = ""


@dataclass(frozen=True, kw_only=True)
class ExportedFmu:
    """An FMU, and what it is: its bytes, version of FMI, model identifier, token and platforms."""

    content: bytes = field(repr=False)
    fmi: int
    model_identifier: str
    token: str
    platforms: tuple[str, ...]

    def as_json(self) -> dict[str, object]:
        """What it is, without its bytes."""
        return {
            "fmi": self.fmi,
            "model_identifier": self.model_identifier,
            "token": self.token,
            "platforms": list(self.platforms),
            "size_bytes": len(self.content),
        }


def write_fmu(model: Model, path: Path, *, fmi: int = 2, documents: Documents | None = None) -> ExportedFmu:
    """Write the FMU of :func:`make_fmu` to a file, whole or not at all. Raises also if it cannot be written."""
    made = make_fmu(model, fmi=fmi, documents=documents)
    write_whole(Path(path), made.content)
    return made


def make_fmu(model: Model, *, fmi: int = 2, documents: Documents | None = None) -> ExportedFmu:
    """One FMU with Model Exchange and Co-Simulation for this machine's platform.

    The same model and documents give the same bytes: the token comes from the content, and times are those of
    SOURCE_DATE_EPOCH or, without it, constant.

    Parameters
    ----------
    fmi : int
        Version of FMI, 2 (2.0) or 3 (3.0).

    Raises
    ------
    InputError
        There is no C compiler, this machine's platform has no name in FMI, SOURCE_DATE_EPOCH is no time, or `fmi` is
        neither 2 nor 3.
    """
    if fmi not in (2, 3):
        raise InputError("--fmi", "", f"there is no FMI {fmi} here", "choose 2 or 3")
    require_compiler("exporting an FMU")
    platform, documents = host_platform(), documents or Documents()
    described = interface(model)
    identifier = c_identifier(model.name)
    files = _texts(model, described, fmi, documents)
    token = _token(files)
    for name in ("modelDescription.xml", "sources/model.h"):
        files[name] = files[name].replace(_NO_TOKEN, token)
    library = f"binaries/{platform.folder(fmi)}/{identifier}{platform.suffix}"
    contents = {name: text.encode("utf-8") for name, text in files.items()}
    contents[library] = _library(files)
    return ExportedFmu(
        content=_zipped(contents), fmi=fmi, model_identifier=identifier, token=token, platforms=(platform.folder(fmi),)
    )


def description_text(model: Model, *, fmi: int) -> str:
    """The ``modelDescription.xml`` that :func:`make_fmu` would write, but for its token, documents and source files."""
    return render(f"modelDescription-fmi{fmi}.xml", _values(model, interface(model), fmi, Documents()))


def _texts(model: Model, described: Interface, fmi: int, documents: Documents) -> dict[str, str]:
    """All files of the FMU but the library, by name, with a token of zeros."""
    sources = c_sources(model, described, fmi, _NO_TOKEN)
    values = _values(model, described, fmi, documents)
    values["sources"] = sorted(name for name in sources if name.endswith(".c"))
    files = {f"sources/{name}": text for name, text in sources.items()}
    files["modelDescription.xml"] = render(f"modelDescription-fmi{fmi}.xml", values)
    files["documentation/index.html"] = render("index.html", values)
    files["documentation/licenses/license.txt"] = bundled("LICENSE").read_text(encoding="utf-8")
    files["documentation/licenses/FMI-headers.txt"] = headers_notice(fmi)
    if fmi == 3:
        files["sources/buildDescription.xml"] = render("buildDescription.xml", values)
    if documents.card_text is not None:
        files[CARD_IN_FMU] = documents.card_text
    return files


def _values(model: Model, described: Interface, fmi: int, documents: Documents) -> dict[str, Any]:
    """What the templates of the description and the documentation tell, without the names of source files."""
    return {
        "about": {
            "name": model.name,
            "description": model.description,
            "version": version("tank2sim"),
            "date": _date(),
            "source": documents.source,
            "validity": documents.validity,
            "notices": model.notices,
        },
        "token": _NO_TOKEN,
        "fmi": fmi,
        "identifier": c_identifier(model.name),
        "interface": described,
        "structure": structure(model, described),
        "units": [UNITS[name] for name in sorted({variable.unit for variable in described.variables})],
        "sources": [],
        "experiment": {
            "step": model.step_s,
            "stop_time": model.step_s * _EXPERIMENT_STEPS,
            "tolerance": _EXPERIMENT_TOLERANCE,
        },
    }


def _token(files: dict[str, str]) -> str:
    digest = hashlib.sha256()
    for name in sorted(files):
        for part in (name, files[name]):
            data = part.encode("utf-8")
            digest.update(len(data).to_bytes(8, "big") + data)
    return f"{{{uuid.UUID(bytes=digest.digest()[:16])}}}"


def _library(files: dict[str, str]) -> bytes:
    with tempfile.TemporaryDirectory(prefix="tank2sim-") as name:
        folder = Path(name)
        for path, text in files.items():
            if path.startswith("sources/"):
                (folder / path.removeprefix("sources/")).write_text(text, encoding="utf-8", newline="\n")
        library = folder / "library"
        compile_shared(sorted(folder.glob("*.c")), library, flags=_LINK_FLAGS.get(sys.platform, ()))
        return library.read_bytes()


def _epoch() -> int | None:
    given = os.environ.get("SOURCE_DATE_EPOCH")
    if not given:
        return None
    try:
        seconds = int(given)
        time.gmtime(seconds)
    except (ValueError, OverflowError, OSError):
        remedy = "set it to seconds since 1970, or leave it out"
        raise InputError("SOURCE_DATE_EPOCH", "", f"{given!r} is no time", remedy) from None
    return seconds


def _date() -> str:
    seconds = _epoch()
    return "" if seconds is None else time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime(seconds))


def _zipped(contents: dict[str, bytes]) -> bytes:
    moment = time.gmtime(max(_epoch() or 0, _FIRST_TIME_OF_ZIP))[:6]
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=6) as archive:
        # Readers that stream want the description first.
        for name in sorted(contents, key=lambda name: (name != "modelDescription.xml", name)):
            entry = zipfile.ZipInfo(name, moment)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.create_system = 3
            entry.external_attr = (0o755 if name.startswith("binaries/") else 0o644) << 16
            archive.writestr(entry, contents[name])
    return buffer.getvalue()
