"""Names of platforms in an FMU."""

from __future__ import annotations

import platform
import sys
from dataclasses import dataclass

from tank2sim.errors import InputError


@dataclass(frozen=True)
class Platform:
    """Where a library runs: its folders under ``binaries/``, and how its file ends."""

    fmi2: str
    fmi3: str
    suffix: str

    def folder(self, fmi: int) -> str:
        """Name of the folder in an FMU of this version of FMI."""
        return self.fmi2 if fmi == 2 else self.fmi3


# FMI 2 names no folder for Linux on ARM; aarch64-linux is the extension that its later releases recommend. On a Mac
# the same folder serves both processors.
_PLATFORMS: dict[tuple[str, str], Platform] = {
    ("linux", "x86_64"): Platform("linux64", "x86_64-linux", ".so"),
    ("linux", "aarch64"): Platform("aarch64-linux", "aarch64-linux", ".so"),
    ("win32", "x86_64"): Platform("win64", "x86_64-windows", ".dll"),
    ("darwin", "x86_64"): Platform("darwin64", "x86_64-darwin", ".dylib"),
    ("darwin", "aarch64"): Platform("darwin64", "aarch64-darwin", ".dylib"),
}
_PROCESSORS = {"amd64": "x86_64", "x86_64": "x86_64", "arm64": "aarch64", "aarch64": "aarch64"}


def host_platform() -> Platform:
    """The platform of this machine.

    Raises
    ------
    InputError
        FMI has no name for it here.
    """
    processor = _PROCESSORS.get(platform.machine().lower(), platform.machine())
    found = _PLATFORMS.get((sys.platform, processor))
    if found is None:
        remedy = "export on Linux, Windows or macOS with an x86-64 or ARM processor of 64 bits"
        raise InputError("this machine", f"{sys.platform} on {processor}", "is no platform of the exporter", remedy)
    return found
