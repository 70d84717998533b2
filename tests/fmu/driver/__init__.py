"""A simulator in C, built for any platform and run where this machine can: natively, or under qemu-user or wine."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import fmpy
import numpy as np
from fmpy.model_description import read_model_description

STEPS = 3000
_SOURCE = Path(__file__).with_name("driver.c")
_HEADERS = Path(fmpy.__file__).parent / "c-code"
_SYSROOT = Path("/usr/aarch64-linux-gnu")  # where Debian's libc6-arm64-cross puts the C library
_FLAGS = ("-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-O2", "-isystem", str(_HEADERS))


@dataclass(frozen=True)
class Runner:
    """How a program for a platform is compiled (triple) and started here; `missing` says why it cannot be."""

    triple: str
    command: tuple[str, ...] = ()
    missing: str = ""


def runner(platform: str) -> Runner:
    """The runner of a platform, by its folder of FMI 3."""
    if platform == "x86_64-linux":
        here = sys.platform == "linux" and os.uname().machine == "x86_64"
        return Runner("x86_64-linux-gnu.2.17", missing="" if here else "this is not a x86-64 Linux")
    if platform == "aarch64-linux":
        emulator = shutil.which("qemu-aarch64")
        there = emulator and _SYSROOT.is_dir()
        missing = "" if there else "aarch64 Linux needs qemu-user and libc6-arm64-cross, which are not installed"
        return Runner("aarch64-linux-gnu.2.17", (str(emulator), "-L", str(_SYSROOT)), missing)
    wine = shutil.which("wine") or shutil.which("wine64")
    return Runner("x86_64-windows-gnu", (str(wine),), "" if wine else "Windows needs wine, which is not installed")


def build(compiler: Sequence[str], program: Path) -> Path:
    """The driver, compiled by a compiler (with what chooses its target) without a warning."""
    libraries = [] if program.suffix == ".exe" else ["-ldl"]
    command = [*compiler, *_FLAGS, str(_SOURCE), *libraries, "-o", str(program)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return program


def zigzag(command: Sequence[str], folder: Path, library: Path) -> np.ndarray:
    """Outputs of the FMU unpacked in `folder` in a 20/20 zigzag, every second, by a driver and one of its libraries."""
    description = read_model_description(str(folder), validate=False)
    references = {variable.name: variable.valueReference for variable in description.modelVariables}
    outputs = [
        variable.valueReference
        for variable in description.modelVariables
        if variable.causality == "output" and variable.type in ("Real", "Float64")
    ]
    numbers = STEPS, references["rudder.command"], references["motion.psi"], *outputs
    version, token = description.fmiVersion[0], description.guid or description.instantiationToken
    quiet = {"WINEDEBUG": "-all", "WINEDLLOVERRIDES": "mscoree,mshtml="}
    done = subprocess.run(
        [*command, version, str(library), token, *map(str, numbers)],
        env=os.environ | quiet,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return np.array([[float(number) for number in line.split()] for line in done.stdout.splitlines()])
