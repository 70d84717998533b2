"""The C compiler of this machine."""

from __future__ import annotations

import ctypes
import errno
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Collection, Iterable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import repeat
from pathlib import Path

from tank2sim.errors import InputError

# -ffp-contract=off: else some compilers fuse a*b+c on some processors, and the same model gives other digits there.
# -O3 and -march=native were measured to bring nothing over -O2 on code that CasADi generates.
FLAGS = ("-std=c99", "-O2", "-fPIC", "-ffp-contract=off", "-fvisibility=hidden")

# Of the levels below -O2 the one at which code that CasADi generates compiles in less than half the time.
_QUICK = "-Og"

SHARED_SUFFIX = {"win32": ".dll", "darwin": ".dylib"}.get(sys.platform, ".so")


# Fails where headers, libraries or the linker do not fit, and with nothing else.
_TRIAL = """\
#include <math.h>
#include <string.h>
#ifdef __GNUC__
__attribute__((visibility("default")))
#endif
double trial(double x) { return cos(x) + (double) strlen("trial"); }
"""


_SILENT = "without a library or a word"


def find_compiler() -> list[str] | None:
    """Command of the C compiler: ``CC`` if it is set, else the first of cc, gcc, clang; None if none of them works."""
    command = _named_compiler()
    return list(command) if command and _trouble(command) is None else None


def require_compiler(purpose: str) -> list[str]:
    """Command of the C compiler.

    Raises InputError: There is none that works; `purpose` says what it is needed for.
    """
    command, chosen = _named_compiler(), os.environ.get("CC")
    source = f"CC={chosen}" if chosen else " ".join(command or ("C compiler",))
    if command is None:
        problem = f"no C compiler was found, and {purpose} needs one"
        raise InputError(source, "", problem, "install gcc or clang, or name one in the environment variable CC")
    trouble = _trouble(command)
    if trouble is not None:
        problem = f"this C compiler does not work, and {purpose} needs one ({_first_error(trouble)})"
        raise InputError(source, "", problem, "correct it, or name another in the environment variable CC")
    return list(command)


def compile_shared(
    sources: Iterable[Path],
    library: Path,
    *,
    include: Iterable[Path] = (),
    flags: Iterable[str] = (),
    seldom: Collection[str] = (),
) -> None:
    """Compile C sources into a shared library.

    Those named in `seldom` run seldom: they are optimised less, which takes half the time and changes no digit.

    The compiler runs in the folder of the first source with names relative to it, so that no path of this machine
    enters the library and the same sources give the same bytes; on each source by itself, as many at a time as this
    machine has processors.

    Raises InputError: There is no compiler that works, or it makes nothing and says nothing; RuntimeError: The compiler
    refused the sources: a fault of the program, with the compiler's words.
    """
    compiler = require_compiler("compiling a model")
    all_flags = [*flags, *(f"-I{path}" for path in include)]
    refusal = _refusal(compiler, list(sources), Path(library), all_flags, seldom)
    if refusal is not None and os.strerror(errno.ENOSPC) in refusal:
        problem = f"the C compiler found no room ({os.strerror(errno.ENOSPC)})"
        remedy = "make room there, or name another folder in the environment variable TMPDIR"
        raise InputError(tempfile.gettempdir(), "", problem, remedy)
    if refusal is not None and refusal.endswith(_SILENT):
        remedy = "correct it, or name another in the environment variable CC"
        raise InputError(shlex.join(compiler), "", f"this C compiler does not work ({refusal})", remedy)
    if refusal is not None:
        raise RuntimeError(f"{shlex.join(compiler)} refused generated C\n{refusal}")


def _named_compiler() -> tuple[str, ...] | None:
    chosen = os.environ.get("CC")
    if not chosen:
        return next(((name,) for name in ("cc", "gcc", "clang") if shutil.which(name)), None)
    try:
        words = shlex.split(chosen)
    except ValueError:  # quotes that do not close
        return None
    return tuple(words) if words and shutil.which(words[0]) else None


@cache
def _trouble(command: tuple[str, ...]) -> str | None:
    """Error of a compiler that cannot make the simplest library that runs; None if it can."""
    with tempfile.TemporaryDirectory(prefix="tank2sim-", ignore_cleanup_errors=True) as folder:
        trial = Path(folder, "trial.c")
        trial.write_text(_TRIAL, encoding="utf-8")
        library = Path(folder, f"trial{SHARED_SUFFIX}")
        return _refusal(list(command), [trial], library, []) or _trouble_in(library)


def _trouble_in(library: Path) -> str | None:
    """Fault of the trial library, which is loaded here; None if it answers as it should."""
    try:
        trial = ctypes.CDLL(str(library)).trial
    except (OSError, AttributeError) as error:
        return f"it made a library that cannot be loaded: {str(error).replace(f'{library}: ', '')}"
    trial.argtypes, trial.restype = [ctypes.c_double], ctypes.c_double
    return None if trial(0.0) == 6.0 else "it made a library that calculates wrongly"


def _refusal(
    compiler: list[str], sources: list[Path], library: Path, flags: Iterable[str], seldom: Collection[str] = ()
) -> str | None:
    """The compiler's error if it made no library; else None."""
    with tempfile.TemporaryDirectory(prefix="tank2sim-") as name, ThreadPoolExecutor(os.cpu_count()) as pool:
        command, folder = [*compiler, *FLAGS, *flags], sources[0].parent
        # The longest first, so that no processor is idle next to it at the end.
        sources = sorted(sources, key=lambda source: (-source.stat().st_size, source.name))
        objects = [Path(name, f"{place}.o") for place in range(len(sources))]
        optimisation = {source: [_QUICK] if source.name in seldom else [] for source in sources}
        compiling = (
            [*command, *optimisation[source], "-c", os.path.relpath(source, folder), "-o", str(compiled)]
            for source, compiled in zip(sources, objects, strict=True)
        )
        linking = [
            *command,
            "-shared",
            *(["-Wl,--build-id=none"] if sys.platform.startswith("linux") else []),
            *("-o", str(library.resolve())),
            *(compiled.name for compiled in objects),
            *([] if sys.platform == "win32" else ["-lm"]),
        ]
        refusals = list(pool.map(_run, compiling, repeat(folder), objects))
        return next(filter(None, refusals), None) or _run(linking, Path(name), library)


def _run(command: list[str], folder: Path, made: Path) -> str | None:
    """A compiler's error if it did not make its file; else None."""
    try:
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, errors="replace", check=False)
    except OSError as error:
        return f"it cannot be run ({error.strerror})"
    if done.returncode == 0 and made.exists() and made.stat().st_size:
        return None
    return done.stderr.strip() or f"it ended with code {done.returncode}, {_SILENT}"


def _first_error(words: str) -> str:
    lines = words.splitlines()
    return next((line for line in lines if "error" in line or "cannot" in line), lines[0]).strip()
