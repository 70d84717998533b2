"""Writing an FMU: the same bytes each time, whole or not at all, whatever the ship is called."""

from __future__ import annotations

import io
import os
import re
import subprocess
import sys
import zipfile
from dataclasses import replace
from pathlib import Path

import fmpy
import pytest
from fmpy.validation import validate_fmu
from lxml import etree

from tank2sim.bundled import bundled
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tank2sim.fmu import export, sources
from tank2sim.fmu.check import compare_with_model
from tank2sim.fmu.export import Documents, write_fmu
from tank2sim.fmu.interface import interface
from tank2sim.fmu.templates import c_identifier
from tank2sim.fmu.unpacking import embedded_card
from tank2sim.native.compiler import require_compiler
from tank2sim.notices import Notice
from tests.fmu.driving import Unpacked
from tests.marks import first_fast

OURS = ["derivatives.c", "instance.c", "simulation.c", "snapshot.c", "values.c", "variables.c"]


# ---- the same each time ----

_EXPORT = """
import sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
from conftest import MODELS
from tank2sim.fmu.export import Documents, write_fmu
write_fmu(MODELS[sys.argv[4]](), Path(sys.argv[2]), fmi=int(sys.argv[3]), documents=Documents(card_text="x = 1"))
"""


@pytest.mark.slow
@pytest.mark.parametrize(("model", "fmi"), [("hull", 2), ("body", 3)])
def test_another_process_in_another_place_writes_the_same_bytes(model: str, fmi: int, tmp_path: Path) -> None:
    contents = []
    for name, seed in (("one", "1"), ("another", "2")):
        folder = tmp_path / name
        folder.mkdir()
        target = folder / "same.fmu"  # its name is the modelName
        command = [sys.executable, "-c", _EXPORT, str(Path(__file__).parent), str(target), str(fmi), model]
        environment = os.environ | {"TMPDIR": str(folder), "XDG_CACHE_HOME": str(folder), "PYTHONHASHSEED": seed}
        subprocess.run(command, check=True, cwd=folder, env=environment)
        contents.append(target.read_bytes())
    assert contents[0] == contents[1]


def test_no_path_of_this_machine_is_in_the_library(fmi: int, unpacked: Unpacked) -> None:
    folder = unpacked("hull", fmi).folder
    (library,) = (path for path in folder.glob("binaries/*/*"))
    content = library.read_bytes()
    assert b"/tmp" not in content
    assert b"/home" not in content
    assert str(Path.cwd()).encode() not in content


@pytest.mark.slow
def test_the_token_tells_contents_apart(models: dict[str, Model], tmp_path: Path) -> None:
    body = models["body"]
    heavier = body.with_values({"drag": 0.06})
    tokens = {
        write_fmu(model, tmp_path / "x.fmu", documents=documents).token
        for model, documents in ((body, None), (heavier, None), (body, Documents(card_text="name = 1")))
    }
    assert len(tokens) == 3


@pytest.mark.slow
def test_times_are_those_of_source_date_epoch(
    models: dict[str, Model], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    gain = models["gain"]
    monkeypatch.delenv("SOURCE_DATE_EPOCH", raising=False)
    write_fmu(gain, tmp_path / "plain.fmu")
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    write_fmu(gain, tmp_path / "dated.fmu")
    for name, date, moment in (("plain", None, 1980), ("dated", "2023-11-14T22:13:20Z", 2023)):
        with zipfile.ZipFile(tmp_path / f"{name}.fmu") as archive:
            root = etree.fromstring(archive.read("modelDescription.xml"))
            assert root.get("generationDateAndTime") == date
            assert {entry.date_time[0] for entry in archive.infolist()} == {moment}
    assert validate_fmu(str(tmp_path / "dated.fmu")) == []


# ---- what is in it ----


@pytest.mark.slow
def test_sources_compile_alone(fmi: int, unpacked: Unpacked, tmp_path: Path) -> None:
    sources = sorted(str(path) for path in (unpacked("hull", fmi).folder / "sources").glob("*.c"))
    library = tmp_path / "library.so"
    command = [*require_compiler("the test"), "-shared", "-fPIC", *sources, "-lm", "-o", str(library)]
    assert subprocess.run(command, capture_output=True, text=True, check=True).stderr == ""
    assert library.stat().st_size > 10_000


@first_fast("fmi", [2, 3])
@first_fast("name", ["hull", "body", "gain"])
def test_sources_are_c99_without_a_warning(name: str, fmi: int, unpacked: Unpacked, tmp_path: Path) -> None:
    folder = unpacked(name, fmi).folder / "sources"
    files = [*OURS, *(["fmi2.c"] if fmi == 2 else ["fmi3.c", "fmi3_unsupported.c"])]
    flags = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-O2", "-fPIC"]
    for file in files:
        command = [*require_compiler("the test"), *flags, "-c", str(folder / file), "-o", str(tmp_path / "x.o")]
        assert subprocess.run(command, capture_output=True, text=True, check=False).stderr == ""


def test_sources_are_listed(fmi: int, unpacked: Unpacked) -> None:
    folder = unpacked("hull", fmi).folder
    there = sorted(path.name for path in (folder / "sources").glob("*.c"))
    if fmi == 2:
        root = etree.parse(str(folder / "modelDescription.xml")).getroot()
        for kind in ("ModelExchange", "CoSimulation"):
            assert [file.get("name") for file in root.find(kind).iter("File")] == there
    else:
        build = etree.parse(str(folder / "sources" / "buildDescription.xml"))
        schema = etree.XMLSchema(file=str(Path(fmpy.__file__).parent / "schema" / "fmi3" / "fmi3BuildDescription.xsd"))
        schema.assertValid(build)
        assert [file.get("name") for file in build.getroot().iter("SourceFile")] == there


@pytest.mark.slow
def test_documentation_names_source_units_and_licences(fmi: int, hull: Model, tmp_path: Path) -> None:
    documents = Documents(card_text='name = "x"', source="Towing tank A & B", validity="3 to 9 m/s")
    exported = write_fmu(hull, tmp_path / "x.fmu", fmi=fmi, documents=documents)
    with zipfile.ZipFile(io.BytesIO(exported.content)) as archive:
        page = archive.read("documentation/index.html").decode()
        assert archive.read("documentation/licenses/license.txt") == bundled("LICENSE").read_bytes()
        notice = archive.read("documentation/licenses/FMI-headers.txt").decode()
    for words in ("Towing tank A &amp; B", "3 to 9 m/s", "rudder.command", "rad (deg)", "+ to starboard", "Test hull"):
        assert words in page
    assert "Modelica Association" in notice
    assert "Redistributions in binary form" in notice
    assert embedded_card(tmp_path / "x.fmu") == 'name = "x"'
    assert len(exported.content) == (tmp_path / "x.fmu").stat().st_size


# ---- whatever the ship is called ----

NASTY = [
    "Quote \" and ' and <tag> & amp; */ /* %s %n #r1#",
    "../../etc/passwd",
    "C:\\con\\..\\x",
    "Zeile eins\nZeile zwei\r\n\tdrei",
    "Bełchatów 船 🚢 Ünïcödé",
    "船",
    "",
    "2nd ship",
    "int",
    "CON",
    "bell \x07 null \x00 escape \x1b \ufffe \ud800",
    "x" * 500,
    "]]> <!-- -->",
    "{{ 7 * 7 }} {% raw %}",
]


@pytest.mark.parametrize("name", NASTY)
def test_any_name_gives_a_c_identifier(name: str) -> None:
    identifier = c_identifier(name)
    assert re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]{0,63}", identifier)
    assert identifier.lower() not in ("int", "con")


@pytest.mark.slow
def test_names_that_resemble_markup_or_paths_do_no_harm(fmi: int, models: dict[str, Model], tmp_path: Path) -> None:
    # All of them at once: an export of each would only take longer.
    everything = " | ".join(NASTY)
    model = replace(models["body"], name=everything, description=everything, notices=(Notice(everything),))
    exported = write_fmu(
        model,
        tmp_path / "x.fmu",
        fmi=fmi,
        documents=Documents(card_text="name = 'ł'", source=everything, validity=everything),
    )
    report = compare_with_model(tmp_path / "x.fmu", model=model)
    assert report.validation == ()
    assert report.passed
    with zipfile.ZipFile(io.BytesIO(exported.content)) as archive:
        root = etree.fromstring(archive.read("modelDescription.xml"))
        assert root.get("modelName") == "x"
        assert "船 🚢 Ünïcödé" in root.get("description")
        assert "<tag> & amp; */ /* %s" in root.get("description")
        page = archive.read("documentation/index.html").decode()
        assert "<tag>" not in page
        assert "{{ 7 * 7 }}" in page
        assert all(".." not in entry for entry in archive.namelist())


# ---- what goes wrong ----


def test_without_a_compiler_nothing_is_written(hull: Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CC", "no-such-compiler")
    with pytest.raises(InputError, match="no C compiler"):
        write_fmu(hull, tmp_path / "x.fmu")
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_is_missing_is_reported(hull: Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = export.ExportedFmu(content=b"PK\x03\x04", fmi=2, model_identifier="x", token="", platforms=())
    monkeypatch.setattr(export, "make_fmu", lambda *_, **__: made)
    with pytest.raises(InputError, match="cannot be written"):
        write_fmu(hull, tmp_path / "missing" / "x.fmu")


def test_there_is_no_fmi_1(hull: Model, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="choose 2 or 3"):
        write_fmu(hull, tmp_path / "x.fmu", fmi=1)


@pytest.mark.parametrize("epoch", ["yesterday", "1e9", "99999999999999999999"])
def test_a_source_date_epoch_that_is_no_time_is_reported(
    epoch: str, hull: Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", epoch)
    with pytest.raises(InputError, match="SOURCE_DATE_EPOCH"):
        write_fmu(hull, tmp_path / "x.fmu")
    assert list(tmp_path.iterdir()) == []


def test_an_fmu_bounds_its_states_by_the_number_of_the_simulation(hull: Model, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sources, "TIMES_BEYOND", 7.5)
    texts = sources.c_sources(hull, interface(hull), 3, "{token}")
    found = [(name, line) for name, text in texts.items() for line in text.splitlines() if "TIMES_BEYOND " in line]
    assert sorted(name for name, _ in found) == ["model.h", "simulation.c"]  # defined once, used once
    assert ("model.h", "#define TIMES_BEYOND 7.5") in found


@pytest.mark.skipif(os.name != "posix", reason="makes compilers of shell scripts")
@pytest.mark.parametrize(
    "text",
    [
        '[ "$out" ] && : > "$out"',
        '[ "$out" ] && echo "not a library" > "$out"',
        'echo "double nothing(void) { return 0; }" > "$0.c" && cc -shared -fPIC "$0.c" -o "$out"',
    ],
    ids=["empty", "text", "without its functions"],
)
@first_fast("from_the_start", [True, False])
def test_a_library_that_does_not_work_is_not_exported(
    text: str, from_the_start: bool, hull: Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a compiler that says nothing; or that makes the library of its trial well, and the FMU's badly."""
    folder = tmp_path / "bin"
    folder.mkdir()
    compiler = folder / "compiler"
    well = "" if from_the_start else 'case "$*" in *trial*) exec cc "$@" ;; esac\n'
    out = 'out=""; for word in "$@"; do [ "$before" = -o ] && out="$word"; before="$word"; done\n'
    # a compiler for single files makes objects as it should, and goes wrong with what it links
    objects = 'case "$*" in *" -c "*) exec cc "$@" ;; esac\n'
    compiler.write_text(f"#!/bin/sh\n{well}{objects}{out}{text}\nexit 0\n")
    compiler.chmod(0o755)
    monkeypatch.setenv("CC", str(compiler))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    with pytest.raises(InputError, match=r"does not work"):
        write_fmu(hull, tmp_path / "x.fmu")
    assert not (tmp_path / "x.fmu").exists()
