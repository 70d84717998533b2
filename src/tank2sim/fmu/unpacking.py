"""Opening an FMU: its files in a folder, its description as FMPy reads it, the card it carries."""

from __future__ import annotations

import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import fmpy
from fmpy.model_description import read_model_description

from tank2sim.errors import InputError

Kind = Literal["ModelExchange", "CoSimulation"]

CARD_IN_FMU = "resources/ship.toml"
"""Where an FMU keeps the card of its ship, so that a check can build the model again."""


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
    def kinds(self) -> tuple[Kind, ...]:
        """What the FMU offers of Model Exchange and Co-Simulation."""
        offers: dict[Kind, Any] = {
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
        The file is missing, no FMU, damaged, of another version of FMI than 2.0 or 3.0, or has no library for this
        machine.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            damaged = archive.testzip()
            names = archive.namelist()
        if damaged is not None:
            raise zipfile.BadZipFile(damaged)
        if "modelDescription.xml" not in names:
            raise InputError(
                path, "", "is no FMU: it has no modelDescription.xml", "give a file that tank2sim exported"
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
    try:
        with zipfile.ZipFile(path) as archive:
            return archive.read(CARD_IN_FMU).decode("utf-8") if CARD_IN_FMU in archive.namelist() else None
    except (OSError, zipfile.BadZipFile, UnicodeDecodeError, RuntimeError) as error:
        raise _no_fmu(Path(path), error) from None


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
        return InputError(path, "", "there is no such file", "check the name")
    if isinstance(error, OSError):
        return InputError(path, "", f"cannot be read ({error.strerror})", "check the name and its permissions")
    return InputError(path, "", "is no FMU (it is no zip file, or a damaged one)", "give a file that tank2sim exported")
