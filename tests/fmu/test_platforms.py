"""Libraries for other platforms: what they need and export, and that they answer alike wherever they can be run."""

from __future__ import annotations

import hashlib
import os
import re
import struct
import sys
import zipfile
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import fmpy
import numpy as np
import platformdirs
import pytest
from fmpy.validation import validate_fmu

from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tank2sim.fmu import libraries as fmu_libraries
from tank2sim.fmu.export import make_fmu
from tank2sim.fmu.libraries import universal
from tank2sim.fmu.platforms import PLATFORMS, named_platforms
from tank2sim.native import cross
from tank2sim.native.compiler import require_compiler
from tank2sim.native.cross import CompileTarget
from tests.cli.command_line import refused, tank2sim
from tests.fmu.driving import ShipFmu

from .driver import build, runner, zigzag

FOLDERS = {
    2: ["linux64", "aarch64-linux", "win64", "darwin64"],
    3: ["x86_64-linux", "aarch64-linux", "x86_64-windows", "x86_64-darwin", "aarch64-darwin"],
}

# What the compiler makes of the C library of Windows takes minutes: it is kept from one session to the next, as it is
# for a user. What it makes of our sources is not kept.
KEPT = os.environ.get("ZIG_GLOBAL_CACHE_DIR") or str(platformdirs.user_cache_path("tank2sim") / "libraries" / "zig")


# ---- which platforms ----


def test_platforms_go_by_the_names_of_both_versions() -> None:
    assert named_platforms("host") is None
    assert named_platforms("all") == PLATFORMS
    for names in ("aarch64-darwin,x86_64-darwin", "darwin64", "darwin64, x86_64-darwin"):
        assert [each.fmi3 for each in named_platforms(names) or ()] == ["x86_64-darwin", "aarch64-darwin"]
    assert [each.fmi2 for each in named_platforms("win64,x86_64-linux") or ()] == ["linux64", "win64"]
    for fmi, folders in FOLDERS.items():
        assert list(dict.fromkeys(each.folder(fmi) for each in PLATFORMS)) == folders


@pytest.mark.parametrize("names", ["", "amiga", "linux64,", "all,linux64", "host,win64", "LINUX64"])
def test_what_is_no_platform_is_reported(names: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="is not a platform") as caught:
        named_platforms(names)
    assert "x86_64-windows" in caught.value.remedy
    refused(tank2sim("export", "mariner", "-o", "x.fmu", "--platforms", names, cwd=tmp_path), "is not a platform")
    assert list(tmp_path.iterdir()) == []


def test_without_the_extra_it_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cross, "find_spec", lambda _: None)
    done = tank2sim("export", "mariner", "-o", "x.fmu", "--platforms", "all", cwd=tmp_path)
    refused(done, "--platforms", "pip install tank2sim[platforms]")
    assert list(tmp_path.iterdir()) == []


def test_a_universal_library_holds_each_on_a_page_of_its_own() -> None:
    slices = [struct.pack("<III", 0xFEEDFACF, processor, 3) + bytes([processor]) * 20001 for processor in (7, 12)]
    joined = universal(slices)
    magic, count, *entries = struct.unpack_from(">II10I", joined)
    assert (magic, count) == (0xCAFEBABE, 2)
    for processor, (kind, model, begin, size, alignment) in zip((7, 12), (entries[:5], entries[5:]), strict=True):
        assert (kind, model, alignment) == (processor, 3, 14)
        assert begin > 0 and begin % (1 << alignment) == 0
        assert joined[begin : begin + size] == slices[(7, 12).index(processor)]
    with pytest.raises(ValueError, match="same processor"):
        universal([slices[0], slices[0]])
    with pytest.raises(ValueError, match="Mach-O"):
        universal([slices[0], b"\x7fELF" + bytes(60)])


def test_macs_share_a_folder_in_fmi_2_and_patience_is_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    def compiled(_: object, target: CompileTarget) -> bytes:
        return struct.pack("<III", 0xFEEDFACF, 12 if "aarch64" in target.triple else 7, 0) + target.triple.encode()

    monkeypatch.setattr(fmu_libraries, "has_compiled", lambda target: "windows" not in target.triple)
    monkeypatch.setattr(fmu_libraries, "cross_compiled", compiled)
    reported: list[str] = []
    made = fmu_libraries.libraries({}, PLATFORMS, 2, reported.append)
    assert [folder for folder, _ in made] == FOLDERS[2]
    joined = made["darwin64", ".dylib"]
    assert b"x86_64-macos" in joined and b"aarch64-macos" in joined
    assert b"x86_64-windows-gnu" in made["win64", ".dll"]
    assert "x86_64-windows (the first time: 2 to 3 minutes)" in reported[0] and "x86_64-linux," in reported[0]
    assert reported[-1] == "5 of 5 libraries compiled; left: none"
    assert [folder for folder, _ in fmu_libraries.libraries({}, PLATFORMS, 3)] == FOLDERS[3]


# ---- the libraries; all that follows needs ziglang ----

needs_compiler = pytest.mark.skipif(find_spec("ziglang") is None, reason="ziglang (tank2sim[platforms]) is missing")


@pytest.fixture(scope="session")
def exported(models: dict[str, Model], session_folder: Path) -> ShipFmu:
    """The FMU of the hull for every platform, exported once and unpacked."""

    def folder(fmi: int) -> Path:
        target = session_folder / f"everywhere{fmi}"
        if not target.exists():
            with pytest.MonkeyPatch.context() as patch:
                patch.setenv("ZIG_GLOBAL_CACHE_DIR", KEPT)
                file = session_folder / f"everywhere{fmi}-{os.getpid()}.fmu"
                file.write_bytes(make_fmu(models["hull"], fmi=fmi, platforms=PLATFORMS).content)
            assert validate_fmu(str(file)) == []
            unpacked = file.with_suffix("")
            with zipfile.ZipFile(file) as archive:
                archive.extractall(unpacked)
            unpacked.rename(target)
        return target

    return folder


def library(folder: Path, fmi: int, platform: str) -> Path:
    (each,) = (each for each in PLATFORMS if each.fmi3 == platform)
    return folder / "binaries" / each.folder(fmi) / f"Test_hull{each.target.suffix}"


def functions(fmi: int) -> set[str]:
    """Every function of the header."""
    header = (Path(fmpy.__file__).parent / "c-code" / f"fmi{fmi}Functions.h").read_text(encoding="utf-8")
    found = set(re.findall(rf"^\s*FMI{fmi}_Export\s+\w+\s+(\w+);", header, flags=re.MULTILINE))
    assert len(found) >= 44
    return found


@needs_compiler
@pytest.mark.slow
def test_every_platform_is_there_and_nothing_is_compiled_twice(
    fmi: int, exported: ShipFmu, hull: Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = exported(fmi)
    assert sorted(path.name for path in (folder / "binaries").iterdir()) == sorted(FOLDERS[fmi])
    monkeypatch.setattr(cross, "_compile", lambda *_: pytest.fail("compiled again"))
    reported: list[str] = []
    again = make_fmu(hull, fmi=fmi, platforms=PLATFORMS, report=reported.append)
    assert again.platforms == tuple(FOLDERS[fmi])
    assert reported[0].startswith("0 of 5") and reported[-1].startswith("5 of 5")


@needs_compiler
@pytest.mark.slow
@pytest.mark.parametrize("platform", ["x86_64-linux", "aarch64-linux", "x86_64-windows"])
def test_a_zigzag_has_the_same_digits_everywhere(
    platform: str,
    fmi: int,
    exported: ShipFmu,
    unpacked: Callable[[str, int], object],
    tmp_path: Path,
    session_folder: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    how = runner(platform)
    if how.missing:
        pytest.skip(how.missing)
    monkeypatch.setenv("ZIG_GLOBAL_CACHE_DIR", KEPT)
    monkeypatch.setenv("ZIG_LOCAL_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setenv("WINEPREFIX", str(session_folder / f"wine-{os.getpid()}"))
    folder = exported(fmi)
    zig = [sys.executable, "-m", "ziglang", "cc", "-target", how.triple]
    driver = build(zig, tmp_path / ("driver.exe" if "windows" in platform else "driver"))
    got = zigzag([*how.command, str(driver)], folder, library(folder, fmi, platform))

    # What this machine's own compiler makes of the same model is the measure.
    own = unpacked("hull", fmi).folder  # type: ignore[attr-defined]
    (own_library,) = own.glob("binaries/*/*")
    expected = zigzag([str(build(require_compiler("the test"), tmp_path / "own"))], own, own_library)
    assert expected.shape[0] == 300
    headings = expected[:, 2]
    assert headings.max() > 0.35 > -0.35 > headings.min(), "the ship has zigzagged"
    if "windows" in platform:  # whose C library rounds some sines the other way: the last digit of 16 may differ
        assert np.max(np.abs(got - expected) / np.abs(expected).max(axis=0)) < 1e-13
    else:
        assert np.array_equal(got, expected)


@needs_compiler
@pytest.mark.slow
@pytest.mark.parametrize("platform", ["x86_64-linux", "aarch64-linux"])
def test_linux_libraries_run_on_old_systems(platform: str, fmi: int, exported: ShipFmu) -> None:
    lief = pytest.importorskip("lief")
    elf = lief.ELF.parse(str(library(exported(fmi), fmi, platform)))
    assert elf.header.machine_type.name == {"x86_64-linux": "X86_64", "aarch64-linux": "AARCH64"}[platform]
    assert set(elf.libraries) <= {"libc.so.6", "libm.so.6"}
    needed = [
        tuple(map(int, version.name.removeprefix("GLIBC_").split(".")))
        for library in elf.symbols_version_requirement
        for version in library.get_auxiliary_symbols()
    ]
    assert needed and max(needed) <= (2, 17)
    assert {symbol.name for symbol in elf.exported_symbols} == functions(fmi)


@needs_compiler
@pytest.mark.slow
def test_the_dll_needs_nothing_but_windows(fmi: int, exported: ShipFmu) -> None:
    lief = pytest.importorskip("lief")
    pe = lief.PE.parse(str(library(exported(fmi), fmi, "x86_64-windows")))
    assert pe.header.machine.name == "AMD64"
    for needed in (each.name.lower() for each in pe.imports):
        assert needed == "kernel32.dll" or needed.startswith("api-ms-win-crt-"), needed  # Windows 10 and later
    assert {entry.name for entry in pe.get_export().entries} == functions(fmi)


@needs_compiler
@pytest.mark.slow
@pytest.mark.parametrize("processor", ["x86_64", "aarch64"])
def test_libraries_for_macs_are_whole(processor: str, fmi: int, exported: ShipFmu) -> None:
    lief = pytest.importorskip("lief")
    content = library(exported(fmi), fmi, f"{processor}-darwin").read_bytes()
    file = lief.MachO.parse(list(content))  # its parts live no longer than it does
    parts = {part.header.cpu_type.name: part for part in file}
    assert set(parts) == ({"X86_64", "ARM64"} if fmi == 2 else {{"x86_64": "X86_64", "aarch64": "ARM64"}[processor]})
    part = parts[{"x86_64": "X86_64", "aarch64": "ARM64"}[processor]]
    assert part.header.magic.name == "MAGIC_64"
    assert part.header.file_type.name == "DYLIB"
    assert [each.name for each in part.libraries] == ["@rpath/model.dylib", "/usr/lib/libSystem.B.dylib"]
    assert all(symbol.binding_info for symbol in part.imported_symbols if symbol.name != "dyld_stub_binder")
    oldest = part.version_min.version if processor == "x86_64" else part.build_version.minos
    assert oldest[:2] == ([10, 13] if processor == "x86_64" else [11, 0])
    names = {entry.symbol.name for entry in part.dyld_info.exports}
    assert names - {"__mh_dylib_header", "___dso_handle"} == {
        f"_{name}" for name in functions(fmi)
    }  # two of the linker
    if processor == "aarch64":  # without a signature, if only an ad-hoc one, these Macs load nothing
        begin = part.fat_offset
        check_signature(content[begin:], part.code_signature.data_offset)


def check_signature(content: bytes, begin: int) -> None:
    """The ad-hoc signature in a Mach-O library: <kern/cs_blobs.h> of macOS; every page has the hash that it says."""
    magic, _, count = struct.unpack_from(">III", content, begin)
    assert magic == 0xFADE0CC0 and count >= 1
    kind, place = struct.unpack_from(">II", content, begin + 12)
    assert kind == 0
    directory = content[begin + place :]
    magic, _, _, flags, hashes, _, _, pages, limit = struct.unpack_from(">9I", directory)
    size, sort, _, page_bits = struct.unpack_from(">4B", directory, 36)
    assert magic == 0xFADE0C02 and flags & 0x2, "ad hoc"
    assert (size, sort, limit) == (32, 2, begin), "SHA-256 of all that comes before it"
    assert pages == -(-limit // (1 << page_bits))
    for page in range(pages):
        text = content[page << page_bits : min((page + 1) << page_bits, limit)]
        assert directory[hashes + 32 * page : hashes + 32 * (page + 1)] == hashlib.sha256(text).digest()
