"""C compiled for other machines, by the compiler that the PyPI package ``ziglang`` brings along."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path

from tank2sim.errors import ArgumentError, InputError
from tank2sim.native.compiler import FLAGS
from tank2sim.native.library import cache_folder, kept

# A library has neither names of its making nor debugging data, so that it is the same each time.
_LINK_FLAGS = ("-s", "-shared")
_LINK_FLAGS_OF = {".so": ("-lm",), ".dylib": ("-Wl,-install_name,@rpath/model.dylib",), ".dll": ()}


@dataclass(frozen=True)
class CompileTarget:
    """Target of a compilation: processor, system and the oldest version of it, and how the name of a library ends."""

    triple: str
    suffix: str

    @property
    def flags(self) -> tuple[str, ...]:
        """Flags of the compiler."""
        # Code for Windows is always independent of its place, and the compiler refuses to be reported so.
        compiling = (flag for flag in FLAGS if not (flag == "-fPIC" and self.suffix == ".dll"))
        return ("-target", self.triple, *compiling, *_LINK_FLAGS, *_LINK_FLAGS_OF[self.suffix])


def require_cross_compiler() -> None:
    """Make sure that the compiler for other machines is there.

    Raises InputError: It is not installed.
    """
    _compiler()


def has_compiled(target: CompileTarget) -> bool:
    """Whether something was compiled for this target before: the first time takes longer, for Windows minutes."""
    return _mark(target).exists()


def cross_compiled(sources: Mapping[str, str], target: CompileTarget) -> bytes:
    """The shared library of C sources for a target; kept, and compiled only if it is not kept yet.

    `sources`: Name to text of every source and header; all lie in one folder.

    Raises InputError: The compiler is not installed or cannot be run, or the folder that ZIG_GLOBAL_CACHE_DIR names
    cannot be made; RuntimeError: The compiler refused the sources: a fault of the program, with the compiler's words.
    """
    compiler = _compiler()

    def make(folder: Path) -> Path:
        library = folder / f"model{target.suffix}"
        _compile(compiler, target, library)
        _mark(target).touch()
        return library

    return kept(sources, [_version(), *target.flags], target.suffix, make).read_bytes()


def _compile(compiler: Path, target: CompileTarget, library: Path) -> None:
    """Compile the C files in the folder of the library, where the compiler runs: it sees no path of this machine."""
    names = sorted(path.name for path in library.parent.glob("*.c"))
    # What it makes of our sources goes with the folder: it is never used again.
    caches = {"ZIG_GLOBAL_CACHE_DIR": str(_zig_cache()), "ZIG_LOCAL_CACHE_DIR": str(library.parent / "cache")}
    try:
        done = subprocess.run(
            [str(compiler), "cc", *names, *target.flags, "-o", library.name],
            cwd=library.parent,
            env=os.environ | caches,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            check=False,
        )
    except OSError as error:
        problem = f"its compiler for other machines cannot be run ({error.strerror})"
        raise ArgumentError("platforms", "", problem, 'install ziglang again, or take platforms="host"') from None
    if done.returncode != 0 or not library.exists():
        raise RuntimeError(f"zig cc refused generated C for {target.triple}\n{done.stderr.strip()}")


def _compiler() -> Path:
    spec = find_spec("ziglang")
    folders = spec.submodule_search_locations if spec else None
    compiler = Path(folders[0], "zig.exe" if sys.platform == "win32" else "zig") if folders else None
    if compiler is None or not compiler.is_file():
        problem = "needs a compiler for other machines, which is not installed"
        raise ArgumentError("platforms", "", problem, 'pip install tank2sim[platforms], or take platforms="host"')
    return compiler


def _version() -> str:
    try:
        return version("ziglang")
    except PackageNotFoundError:  # put there by other means than pip
        return "unknown"


def _zig_cache() -> Path:
    """Where the compiler keeps what it makes of the C library of each target: where its user wants it, else with us."""
    wanted = os.environ.get("ZIG_GLOBAL_CACHE_DIR")
    folder = Path(wanted).absolute() if wanted else cache_folder() / "zig"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        problem = f"cannot be made ({error.strerror}), and the compiler keeps its files there"
        remedy = "set ZIG_GLOBAL_CACHE_DIR to a folder that you may write to, or leave it out"
        raise InputError(folder, "", problem, remedy) from None
    return folder


def _mark(target: CompileTarget) -> Path:
    return _zig_cache() / f"tank2sim-{_version()}-{target.triple}"
