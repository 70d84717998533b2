"""The libraries of an FMU, a platform each."""

from __future__ import annotations

import struct
import sys
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed

from tank2sim.fmu.platforms import Platform, host_platform
from tank2sim.fmu.sources import SELDOM
from tank2sim.native.compiler import SHARED_SUFFIX, require_compiler
from tank2sim.native.cross import cross_compiled, has_compiled, require_cross_compiler
from tank2sim.native.library import cached_library

ProgressReport = Callable[[str], None]
"""Hears, in a few words, what is being done."""

# Project choice: the compiler uses the processors itself too, so more at a time bring nothing.
_AT_A_TIME = 2

# A library has neither the name of its file nor the time of its making, so that it is the same each time.
_LINK_FLAGS = {
    "linux": ("-Wl,--strip-all",),
    "darwin": ("-Wl,-install_name,@rpath/model.dylib",),
    "win32": ("-Wl,--no-insert-timestamp",),
}

# <mach-o/fat.h> and <mach-o/loader.h> of macOS. A library begins with its magic number, processor and model of
# processor in the order of its own bytes (both of today's Macs: little end first); the header of a universal file is
# written big end first. Each library begins on a page: 2**14 bytes are a page on ARM, and whole pages on x86-64.
_UNIVERSAL_MAGIC = 0xCAFEBABE
_LIBRARY_MAGIC = 0xFEEDFACF
_HEAD = struct.Struct(">II")
_ENTRY = struct.Struct(">IIIII")
_BEGIN = struct.Struct("<III")
_PAGE_BITS = 14


def require_compilers(platforms: Sequence[Platform] | None) -> None:
    """Make sure that libraries for `platforms` (None: this machine's) can be made here, before anything else is done.

    Raises InputError: the compiler is missing, or this machine's platform has no name in FMI.
    """
    if platforms is None:
        require_compiler("exporting an FMU")
        host_platform()
    else:
        require_cross_compiler()


def libraries(
    sources: Mapping[str, str], platforms: Sequence[Platform] | None, fmi: int, report: ProgressReport = lambda _: None
) -> dict[tuple[str, str], bytes]:
    """The libraries of C sources: folder of the platform and ending of the name, to the library.

    Platforms that share a folder (the two Macs in FMI 2) share one universal library there.

    `sources`: name to text of every C file and header. `platforms`: None: this machine's, by its own compiler; others,
    and this one if it is among them, by the one for all. Raises InputError: as :func:`require_compilers`.
    """
    if platforms is None:
        library = cached_library(sources, flags=_LINK_FLAGS.get(sys.platform, ()), seldom=SELDOM)
        return {(host_platform().folder(fmi), SHARED_SUFFIX): library.read_bytes()}
    made = _compiled(sources, platforms, report)
    shared: dict[tuple[str, str], list[bytes]] = {}
    for platform in platforms:
        shared.setdefault((platform.folder(fmi), platform.target.suffix), []).append(made[platform])
    return {place: parts[0] if len(parts) == 1 else universal(parts) for place, parts in shared.items()}


def _compiled(
    sources: Mapping[str, str], platforms: Sequence[Platform], report: ProgressReport
) -> dict[Platform, bytes]:
    waiting = {platform: "" if has_compiled(platform.target) else _patience(platform) for platform in platforms}
    made: dict[Platform, bytes] = {}

    def report_state() -> None:
        remaining = ", ".join(f"{platform.fmi3}{note}" for platform, note in waiting.items())
        report(f"{len(made)} of {len(platforms)} libraries compiled; left: {remaining or 'none'}")

    with ThreadPoolExecutor(_AT_A_TIME) as pool:
        # What takes longest first, so that no processor is idle next to it.
        first = sorted(platforms, key=lambda platform: not waiting[platform])
        jobs = {pool.submit(cross_compiled, sources, platform.target): platform for platform in first}
        report_state()
        try:
            for job in as_completed(jobs):
                made[jobs[job]] = job.result()
                del waiting[jobs[job]]
                report_state()
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    return made


def _patience(platform: Platform) -> str:
    long = "2 to 3 minutes" if platform.target.suffix == ".dll" else "some 10 s"
    return f" (the first time: {long})"


def universal(libraries: Sequence[bytes]) -> bytes:
    """A universal Mach-O file of the 64-bit Mach-O `libraries`; the loader takes the one for its processor.

    Raises ValueError: one of them is not such a library, or two are for the same processor.
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
