"""How the C library of this process handles freed memory."""

from __future__ import annotations

import ctypes

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
