"""Compiled libraries, kept: the same C source is compiled once on a machine."""

from __future__ import annotations

import hashlib
import os
import tempfile
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


def cached_library(source: str) -> Path:
    """Path of the shared library of a C source; compiled if it is not in the cache yet.

    Raises
    ------
    InputError
        There is no compiler, or it has to be compiled and the compiler does not work.
    """
    compiler = require_compiler("compiling a model")
    key = hashlib.sha256("\0".join([source, *compiler, *FLAGS]).encode()).hexdigest()[:32]
    library = cache_folder() / f"{key}{SHARED_SUFFIX}"
    if not library.exists():
        with tempfile.TemporaryDirectory(dir=library.parent) as folder:
            file = Path(folder, "model.c")
            file.write_text(source, encoding="utf-8")
            compiled = Path(folder, library.name)
            compile_shared([file], compiled)
            os.replace(compiled, library)  # whole or not at all, also when two processes compile at once
    return library
