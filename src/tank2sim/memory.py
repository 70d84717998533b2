"""Memory of this process: how the C library handles what is freed, and whether what is asked for has room."""

from __future__ import annotations

import ctypes
import os
from pathlib import Path

from tank2sim.errors import ArgumentError

_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3  # parameters of mallopt, malloc.h of glibc
_MOST_KEPT = 512 << 20
_LARGEST_KEPT = 32 << 20
"""Bytes of freed memory kept in all, and of one array, the most that glibc accepts: project choice, well below the 1 GB
that one process may need."""


def keep_freed_memory() -> None:
    """Keep freed memory in this process for its next arrays.

    Arrays of some MB are made and freed thousands of times; returned to the system each time, the pages of all of them
    are fetched and cleared again, a tenth of the processor time of ``gap``. Only glibc is asked; other C libraries do
    as they do.
    """
    try:
        adjust = ctypes.CDLL("libc.so.6").mallopt
    except (OSError, AttributeError):
        return
    adjust(_MMAP_THRESHOLD, _LARGEST_KEPT)
    adjust(_TRIM_THRESHOLD, _MOST_KEPT)


_SHARE = 0.5
"""Share of the free memory that one call may take. Project choice: the other programs of the machine go on."""


def available_bytes() -> int | None:
    """Memory that this process can have, of the machine and of its container; None where no system says so."""
    found = []
    try:
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
        found += [1024 * int(line.split()[1]) for line in lines if line.startswith("MemAvailable:")]
    except (OSError, ValueError):
        pass
    try:
        limit, taken = (
            Path(f"/sys/fs/cgroup/memory.{name}").read_text(encoding="ascii") for name in ("max", "current")
        )
        found.append(int(limit) - int(taken))  # "max": there is no limit
    except (OSError, ValueError):
        pass
    if not found and hasattr(os, "sysconf"):
        try:
            found.append(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
        except (OSError, ValueError):
            return None
    return max(0, min(found)) if found else None


def refuse_beyond_memory(name: str, number: int, bytes_each: int) -> None:
    """Refuse a number of members that have no room, before any is made.

    Parameters
    ----------
    name : str
        Of the argument.
    number : int
    bytes_each : int
        Bytes that one takes.

    Raises
    ------
    InputError
        They have no room; the message has the number of those that have.
    """
    available = available_bytes()
    if available is None:
        return
    most = int(_SHARE * available / bytes_each)
    if number > most:
        problem = (
            f"is {number:,}, which takes {number * bytes_each / 1e9:.3g} GB, and {available / 1e9:.3g} GB are free"
        )
        raise ArgumentError(name, "", problem, f"give at most {most:,}")
