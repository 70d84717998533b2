"""One library for Macs of both processors, from the library of each."""

from __future__ import annotations

import struct
from collections.abc import Sequence

# <mach-o/fat.h> and <mach-o/loader.h> of macOS. A library begins with its magic number, processor and model of
# processor in the order of its own bytes (both of today's Macs: little end first); the header of a universal file is
# written big end first. Each library begins on a page: 2**14 bytes are a page on ARM, and whole pages on x86-64.
_UNIVERSAL_MAGIC = 0xCAFEBABE
_LIBRARY_MAGIC = 0xFEEDFACF
_HEAD = struct.Struct(">II")
_ENTRY = struct.Struct(">IIIII")
_BEGIN = struct.Struct("<III")
_PAGE_BITS = 14


def universal(libraries: Sequence[bytes]) -> bytes:
    """A universal Mach-O file of the 64-bit Mach-O `libraries`; the loader takes the one for its processor.

    Raises
    ------
    ValueError
        One of them is not such a library, or two are for the same processor.
    """
    page = 1 << _PAGE_BITS
    heads = [_BEGIN.unpack_from(library) for library in libraries]
    if any(magic != _LIBRARY_MAGIC for magic, _, _ in heads):
        raise ValueError("only 64-bit Mach-O libraries can be joined")
    if len({processor for _, processor, _ in heads}) < len(heads):
        raise ValueError("two libraries are for the same processor")
    table, body = _HEAD.pack(_UNIVERSAL_MAGIC, len(libraries)), b""
    for (_, processor, model), library in zip(heads, libraries, strict=True):
        begin = page + len(body)
        table += _ENTRY.pack(processor, model, begin, len(library), _PAGE_BITS)
        body += library + bytes(-len(library) % page)
    return table.ljust(page, b"\0") + body
