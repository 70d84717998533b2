"""The C compiler of this machine."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

from tank2sim.errors import InputError

# -ffp-contract=off: else some compilers fuse a*b+c on some processors, and the same model gives other digits there.
# -O3 and -march=native were measured to bring nothing over -O2 on code that CasADi generates.
FLAGS = ("-std=c99", "-O2", "-fPIC", "-ffp-contract=off", "-fvisibility=hidden")

SHARED_SUFFIX = {"win32": ".dll", "darwin": ".dylib"}.get(sys.platform, ".so")


def find_compiler() -> list[str] | None:
    """Command of the C compiler: ``CC`` if it is set, else the first of cc, gcc, clang; None if there is none."""
    chosen = os.environ.get("CC")
    if chosen:
        words = shlex.split(chosen)
        return words if words and shutil.which(words[0]) else None
    for name in ("cc", "gcc", "clang"):
        if shutil.which(name):
            return [name]
    return None


def require_compiler(purpose: str) -> list[str]:
    """Command of the C compiler.

    Raises
    ------
    InputError
        There is none; `purpose` says what it is needed for.
    """
    command = find_compiler()
    if command is None:
        raise InputError(
            os.environ.get("CC", "C compiler"),
            "",
            f"no C compiler was found, and {purpose} needs one",
            "install gcc or clang, or name one in the environment variable CC",
        )
    return command


def compile_shared(
    sources: Iterable[Path], library: Path, *, include: Iterable[Path] = (), flags: Iterable[str] = ()
) -> None:
    """Compile C sources into a shared library.

    The compiler runs in the folder of the first source with names relative to it, so that no path of this machine
    enters the library and the same sources give the same bytes.

    Raises
    ------
    InputError
        There is no compiler.
    RuntimeError
        The compiler refused the sources: a fault of the program, with the compiler's words.
    """
    sources = [Path(source) for source in sources]
    folder = sources[0].parent
    command = [
        *require_compiler("compiling a model"),
        *FLAGS,
        *flags,
        "-shared",
        *(["-Wl,--build-id=none"] if sys.platform.startswith("linux") else []),
        *(f"-I{path}" for path in include),
        "-o",
        str(Path(library).resolve()),
        *(os.path.relpath(source, folder) for source in sources),
        *([] if sys.platform == "win32" else ["-lm"]),
    ]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(command)}\n{done.stderr}")
