"""Compiled libraries, kept: the same C source is compiled once on a machine."""

from __future__ import annotations

import contextlib
import errno
import hashlib
import os
import shutil
import stat
import tempfile
import time
from collections.abc import Callable, Collection, Iterable, Mapping
from functools import cache
from pathlib import Path

import platformdirs

from tank2sim.errors import InputError
from tank2sim.native.compiler import FLAGS, SHARED_SUFFIX, compile_shared, require_compiler

_DAYS_KEPT = 7.0
"""Age (days) at which folders of runs that were killed are removed: no run takes so long. Project choice."""

_MAKING = "making-"
"""How the name of a folder begins in which a library of the cache is being made."""


def cache_folder() -> Path:
    """Folder of compiled libraries: the user's cache.

    Where that cannot be written, or others than the user may write into it (what lies there is loaded and run), it is a
    folder that ends with the process.
    """
    folder = platformdirs.user_cache_path("tank2sim") / "libraries"
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if _is_private(folder):
            with tempfile.TemporaryFile(dir=folder):
                return folder
    except OSError as error:
        if error.errno in _NO_ROOM:
            raise _full(folder, error) from None
    return Path(_passing_folder().name)


def _is_private(folder: Path) -> bool:
    if os.name != "posix":
        return True
    found = folder.stat()
    return found.st_uid == os.geteuid() and not found.st_mode & (stat.S_IWGRP | stat.S_IWOTH)


@cache
def _passing_folder() -> tempfile.TemporaryDirectory[str]:
    # A library that is still loaded cannot be removed everywhere.
    return tempfile.TemporaryDirectory(prefix="tank2sim-", ignore_cleanup_errors=True)


def kept(sources: Mapping[str, str], making: Iterable[str], suffix: str, make: Callable[[Path], Path]) -> Path:
    """Path of what was once compiled from C sources; made if it is not kept yet, or no longer as it was made.

    The name of an entry holds a hash of its content, which is compared before it is used: one that was cut short or
    changed is made again.

    `sources`: Name to text of every source and header; all lie in one folder. `making`: What else the library depends
    on: compiler, flags. `suffix`: How its name ends. `make`: Takes the folder in which the sources lie, makes the
    library there, and returns its path.

    Raises InputError: There is no room for it.
    """
    parts = [*making, "", *(part for name in sorted(sources) for part in (name, sources[name]))]
    key = hashlib.sha256("\0".join(parts).encode("utf-8")).hexdigest()[:32]
    folder = cache_folder()
    for entry in folder.glob(f"{key}-*{suffix}"):
        if _is_whole(entry, key, suffix):
            return entry
        _remove(entry)
    try:
        return _made(folder, key, suffix, sources, make)
    except OSError as error:
        if error.errno in _NO_ROOM:
            raise _full(folder, error) from None
        raise


def _made(folder: Path, key: str, suffix: str, sources: Mapping[str, str], make: Callable[[Path], Path]) -> Path:
    """A new entry of the cache: whole or not at all, also when two processes make it at once."""
    _sweep(folder)
    with tempfile.TemporaryDirectory(prefix=_MAKING, dir=folder) as name:
        making = Path(name)
        for source, text in sources.items():
            (making / source).write_text(text, encoding="utf-8", newline="\n")
        library = make(making)
        content = library.read_bytes()
        with library.open("rb+") as stream:
            os.fsync(stream.fileno())  # else a power cut after the renaming may leave the name without the content
        entry = folder / f"{key}-{_digest(content)}{suffix}"
        if entry.is_dir():
            _remove(entry)
        os.replace(library, entry)
    return entry


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:32]


def _is_whole(entry: Path, key: str, suffix: str) -> bool:
    try:
        return entry.is_file() and entry.name == f"{key}-{_digest(entry.read_bytes())}{suffix}"
    except OSError:
        return False


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)


def _sweep(folder: Path) -> None:
    """Remove the folders that killed runs have left in the cache."""
    oldest = time.time() - _DAYS_KEPT * 86400
    for unfinished in folder.glob(f"{_MAKING}*"):
        with contextlib.suppress(OSError):
            if unfinished.stat().st_mtime < oldest:
                _remove(unfinished)


_NO_ROOM = (errno.ENOSPC, errno.EDQUOT)


def _full(folder: Path, error: OSError) -> InputError:
    remedy = "make room there, or name another place in the environment variable XDG_CACHE_HOME"
    return InputError(folder, "", f"has no room for a compiled library ({error.strerror})", remedy)


def cached_library(sources: Mapping[str, str], *, flags: Collection[str] = (), seldom: Collection[str] = ()) -> Path:
    """Path of the shared library of C sources, name to text, for this machine; compiled if it is not kept yet.

    `flags` and `seldom` are as in :func:`tank2sim.native.compiler.compile_shared`.

    Raises InputError: There is no compiler that works, or no room for the library.
    """

    def make(folder: Path) -> Path:
        library = folder / f"library{SHARED_SUFFIX}"
        compile_shared(sorted(folder.glob("*.c")), library, flags=flags, seldom=seldom)
        return library

    making = [*require_compiler("compiling a model"), *FLAGS, *flags, "seldom:", *sorted(seldom)]
    return kept(sources, making, SHARED_SUFFIX, make)
