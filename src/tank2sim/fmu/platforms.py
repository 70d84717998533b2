"""Platforms that a library can be built for, and their names in an FMU."""

from __future__ import annotations

import platform
import sys
from dataclasses import dataclass

from tank2sim.errors import ArgumentError, InputError
from tank2sim.native.cross import CompileTarget


@dataclass(frozen=True)
class Platform:
    """Where a library runs: its folders under ``binaries/``, and how it is compiled from another machine."""

    fmi2: str
    fmi3: str
    target: CompileTarget

    def folder(self, fmi: int) -> str:
        """Name of the folder in an FMU of this version of FMI."""
        return self.fmi2 if fmi == 2 else self.fmi3


# FMI 2 names no folder for Linux on ARM; aarch64-linux is the extension that its later releases recommend. On a Mac
# the same folder serves both processors.
#
# The oldest systems: glibc 2.17 is in RHEL 7 and Python's manylinux2014; macOS 11 is the first on ARM, and
# 10.13 the oldest that Apple's tools still build for when macOS 11 came.
PLATFORMS = (
    Platform("linux64", "x86_64-linux", CompileTarget("x86_64-linux-gnu.2.17", ".so")),
    Platform("aarch64-linux", "aarch64-linux", CompileTarget("aarch64-linux-gnu.2.17", ".so")),
    Platform("win64", "x86_64-windows", CompileTarget("x86_64-windows-gnu", ".dll")),
    Platform("darwin64", "x86_64-darwin", CompileTarget("x86_64-macos.10.13", ".dylib")),
    Platform("darwin64", "aarch64-darwin", CompileTarget("aarch64-macos.11.0", ".dylib")),
)
"""Every platform, which ``all`` means."""

_PROCESSORS = {"amd64": "x86_64", "x86_64": "x86_64", "arm64": "aarch64", "aarch64": "aarch64"}
_SYSTEMS = {"linux": "linux", "win32": "windows", "darwin": "darwin"}


def host_platform() -> Platform:
    """The platform of this machine.

    Raises
    ------
    InputError
        FMI has no name for it here.
    """
    processor = _PROCESSORS.get(platform.machine().lower(), platform.machine())
    name = f"{processor}-{_SYSTEMS.get(sys.platform, sys.platform)}"
    found = next((each for each in PLATFORMS if each.fmi3 == name), None)
    if found is None:
        remedy = "export on Linux, Windows or macOS with an x86-64 or ARM processor of 64 bits"
        raise InputError("this machine", f"{sys.platform} on {processor}", "is not a platform of the exporter", remedy)
    return found


def named_platforms(names: str) -> tuple[Platform, ...] | None:
    """The platforms that are asked for by name, in the order of `PLATFORMS`; None for the one of this machine.

    Parameters
    ----------
    names : str
        ``host``, ``all``, or names of folders of FMI 2 or FMI 3 with commas between; ``darwin64`` is both processors.

    Raises
    ------
    InputError
        One of them is not a platform.
    """
    if names == "host":
        return None
    if names == "all":
        return PLATFORMS
    asked = {name.strip() for name in names.split(",")}
    unknown = sorted(asked - {name for each in PLATFORMS for name in (each.fmi2, each.fmi3)})
    if unknown:
        remedy = f"choose all, host, or of {', '.join(each.fmi3 for each in PLATFORMS)} with commas between"
        raise ArgumentError("platforms", unknown[0] or repr(names), "is not a platform of the exporter", remedy)
    return tuple(each for each in PLATFORMS if asked & {each.fmi2, each.fmi3})
