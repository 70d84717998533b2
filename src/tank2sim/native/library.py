"""Compiled libraries, kept: the same C source is compiled once on a machine."""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Callable, Collection, Iterable, Mapping
from functools import cache
from pathlib import Path

import platformdirs

from tank2sim.native.compiler import FLAGS, SHARED_SUFFIX, compile_shared, require_compiler


def cache_folder() -> Path:
    """Folder of compiled libraries: the user's cache; where that cannot be written, one that ends with the process."""
    folder = platformdirs.user_cache_path("tank2sim") / "native"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except OSError:
        return Path(_passing_folder().name)


@cache
def _passing_folder() -> tempfile.TemporaryDirectory[str]:
    # A library that is still loaded cannot be removed everywhere.
    return tempfile.TemporaryDirectory(prefix="tank2sim-", ignore_cleanup_errors=True)


def kept(sources: Mapping[str, str], making: Iterable[str], suffix: str, make: Callable[[Path], Path]) -> Path:
    """Path of what was once compiled from C sources; made if it is not kept yet.

    Parameters
    ----------
    sources : mapping
        Name to text of every source and header; all lie in one folder.
    making : iterable of str
        What else the library depends on: compiler, flags.
    suffix : str
        How its name ends.
    make : callable
        Takes the folder in which the sources lie, makes the library there, and returns its path.
    """
    parts = [*making, "", *(part for name in sorted(sources) for part in (name, sources[name]))]
    key = hashlib.sha256("\0".join(parts).encode("utf-8")).hexdigest()[:32]
    library = cache_folder() / f"{key}{suffix}"
    if not library.exists():
        with tempfile.TemporaryDirectory(dir=library.parent) as name:
            folder = Path(name)
            for source, text in sources.items():
                (folder / source).write_text(text, encoding="utf-8", newline="\n")
            os.replace(make(folder), library)  # whole or not at all, also when two processes compile at once
    return library


def cached_library(sources: Mapping[str, str], *, flags: Collection[str] = (), seldom: Collection[str] = ()) -> Path:
    """Path of the shared library of C sources, name to text, for this machine; compiled if it is not kept yet.

    `flags` and `seldom` are those of :func:`tank2sim.native.compiler.compile_shared`.

    Raises
    ------
    InputError
        There is no compiler that works.
    """

    def make(folder: Path) -> Path:
        library = folder / f"library{SHARED_SUFFIX}"
        compile_shared(sorted(folder.glob("*.c")), library, flags=flags, seldom=seldom)
        return library

    making = [*require_compiler("compiling a model"), *FLAGS, *flags, "seldom:", *sorted(seldom)]
    return kept(sources, making, SHARED_SUFFIX, make)
