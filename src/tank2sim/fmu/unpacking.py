"""Opening an FMU: its files in a folder, its description as FMPy reads it, the card it carries."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import fmpy
from fmpy.model_description import read_model_description

from tank2sim.errors import InputError
from tank2sim.files import refuse_device, refuse_folder

FmuType = Literal["ModelExchange", "CoSimulation"]

CARD_IN_FMU = "resources/ship.toml"
"""Where an FMU keeps the card of its ship, so that a check can build the model again."""


LARGEST_BYTES, MOST_FILES = 512_000_000, 10_000
"""Size unpacked (bytes) and number of files above which an archive is refused: a ship's FMU for all platforms has a
hundredth of it. Project choice."""


@dataclass(frozen=True)
class UnpackedFmu:
    """An FMU in a folder, and what its description says.

    Parameters
    ----------
    folder : Path
        Where it was unpacked.
    description : fmpy.model_description.ModelDescription
        As FMPy read it.
    """

    folder: Path
    description: Any

    @property
    def fmi(self) -> int:
        """2 or 3."""
        return int(self.description.fmiVersion[0])

    @property
    def kinds(self) -> tuple[FmuType, ...]:
        """Kinds of the FMU: Model Exchange, Co-Simulation, or both."""
        offers: dict[FmuType, Any] = {
            "ModelExchange": self.description.modelExchange,
            "CoSimulation": self.description.coSimulation,
        }
        return tuple(kind for kind, interface in offers.items() if interface is not None)

    def references(self, names: Sequence[str]) -> list[int]:
        """Value references of variables."""
        return [self._references[name] for name in names]

    def boolean(self, name: str) -> bool:
        """Whether a variable is Boolean."""
        return name in self._booleans

    @cached_property
    def _references(self) -> dict[str, int]:
        return {variable.name: variable.valueReference for variable in self.description.modelVariables}

    @cached_property
    def _booleans(self) -> frozenset[str]:
        return frozenset(variable.name for variable in self.description.modelVariables if variable.type == "Boolean")


def unpack(path: Path, folder: Path) -> UnpackedFmu:
    """Unpack an FMU that can run here into a folder.

    Raises
    ------
    InputError
        The file is missing, no FMU, damaged, too large, of another version of FMI than 2.0 or 3.0, names a file or
        library outside the archive, or has none for this machine.
    """
    refuse_device(Path(path))
    refuse_folder(Path(path))
    try:
        with zipfile.ZipFile(path) as archive:
            _require_bounded(path, archive)
            damaged = archive.testzip()
            names = archive.namelist()
        if damaged is not None:
            raise zipfile.BadZipFile(damaged)
        _require_inside(path, names)
        if "modelDescription.xml" not in names:
            raise InputError(
                path, "", "is not an FMU: it has no modelDescription.xml", "give a file that tank2sim exported"
            )
        fmpy.extract(str(path), str(folder))
    except InputError:
        raise
    except Exception as error:  # whatever zipfile, zlib or fmpy find wrong with the file
        raise _no_fmu(path, error) from None
    try:
        description = read_model_description(str(folder), validate=False)
    except Exception as error:  # fmpy and lxml raise many kinds
        problem = f"cannot be read ({' '.join(str(error).split())})"
        raise InputError(path, "modelDescription.xml", problem, "export the FMU again") from None
    if not description.fmiVersion.startswith(("2.", "3.")):
        problem = f"is of FMI {description.fmiVersion}"
        raise InputError(path, "fmiVersion", problem, "give an FMU of FMI 2.0 or 3.0")
    _require_plain_identifiers(path, description)
    unpacked = UnpackedFmu(folder, description)
    if not unpacked.kinds:
        raise InputError(path, "", "offers neither Model Exchange nor Co-Simulation", "export the FMU again")
    _require_library(path, unpacked)
    return unpacked


def embedded_card(path: Path) -> str | None:
    """Text of the ship card that an FMU carries, None if it carries none.

    Raises
    ------
    InputError
        The file is missing or no FMU.
    """
    refuse_device(Path(path))
    refuse_folder(Path(path))
    try:
        with zipfile.ZipFile(path) as archive:
            _require_bounded(Path(path), archive)
            return archive.read(CARD_IN_FMU).decode("utf-8") if CARD_IN_FMU in archive.namelist() else None
    except (OSError, zipfile.BadZipFile, UnicodeDecodeError, RuntimeError) as error:
        raise _no_fmu(Path(path), error) from None


def _require_bounded(path: Path, archive: zipfile.ZipFile) -> None:
    """Refuse an archive that would fill the disk; what is unpacked is never more than its directory says."""
    entries = archive.infolist()
    size = sum(entry.file_size for entry in entries)
    if size > LARGEST_BYTES or len(entries) > MOST_FILES:
        problem = f"would unpack to {size / 1e6:.0f} MB in {len(entries)} files"
        remedy = f"at most {LARGEST_BYTES / 1e6:.0f} MB in {MOST_FILES} files are unpacked: it is not an FMU of a ship"
        raise InputError(path, "", problem, remedy)


def _require_inside(path: Path, names: list[str]) -> None:
    """Refuse an archive with a name that leads out of the folder into which it is unpacked."""
    for name in names:
        if name.startswith("/") or "\\" in name or ":" in name or ".." in name.split("/"):
            problem = f"has a file {name!r}, which leads out of the archive"
            raise InputError(path, "", problem, "do not trust this file")


def _require_plain_identifiers(path: Path, description: Any) -> None:
    """Refuse a modelIdentifier that is not a C identifier (FMI 2.0, 4.3.1): as a path it leads anywhere."""
    for interface in (description.coSimulation, description.modelExchange):
        if interface is not None and not re.fullmatch(r"[A-Za-z_]\w*", interface.modelIdentifier or "", re.ASCII):
            problem = f"is {interface.modelIdentifier!r}, and the name of a library in the archive is made of it"
            raise InputError(path, "modelIdentifier", problem, "a C identifier was expected: do not trust this file")


def _require_library(path: Path, unpacked: UnpackedFmu) -> None:
    interface = unpacked.description.coSimulation or unpacked.description.modelExchange
    name = fmpy.platform if unpacked.fmi == 2 else fmpy.platform_tuple
    library = unpacked.folder / "binaries" / name / f"{interface.modelIdentifier}{fmpy.sharedLibraryExtension}"
    if not library.is_file():
        raise InputError(
            path, f"binaries/{name}", "has no library for this machine", "check it on the machine it is for"
        )


def _no_fmu(path: Path, error: Exception) -> InputError:
    if isinstance(error, FileNotFoundError):
        return InputError(path, "", "the file does not exist", "check the name")
    if isinstance(error, OSError):
        return InputError(path, "", f"cannot be read ({error.strerror})", "check the name and its permissions")
    return InputError(
        path, "", "is not an FMU (it is not a zip file, or a damaged one)", "give a file that tank2sim exported"
    )
