"""An FMU that is hostile: it cannot reach outside its archive, fill the disk, or leave processes behind."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import pytest

from tank2sim.errors import InputError
from tank2sim.fmu import process
from tank2sim.fmu.unpacking import embedded_card, unpack
from tests.fmu.driving import FmuFile


@pytest.mark.parametrize("identifier", ["../../outside", "..", "a/b", "/tmp/outside", "", "a.b"])
def test_a_library_outside_the_archive_is_not_loaded(
    identifier: str, fmi: int, fmu_file: FmuFile, tmp_path: Path
) -> None:
    path = tmp_path / "x.fmu"
    with zipfile.ZipFile(fmu_file("hull", fmi)) as source, zipfile.ZipFile(path, "w") as target:
        for name in source.namelist():
            data = source.read(name)
            if name == "modelDescription.xml":
                data = re.sub(rb'modelIdentifier="[^"]*"', f'modelIdentifier="{identifier}"'.encode(), data)
            target.writestr(name, data)
    folder = tmp_path / "unpacked" / "here"
    folder.mkdir(parents=True)
    # what the path would lead to is there
    library = next((tmp_path / "unpacked").parent.glob("*.fmu"))
    shutil.copy(library, tmp_path / "outside.so")
    with pytest.raises(InputError) as caught:
        unpack(path, folder)
    assert caught.value.place == "modelIdentifier" and caught.value.source == str(path)


@pytest.mark.parametrize("name", ["../outside.txt", "resources/../../outside.txt", "/outside.txt", "..\\outside.txt"])
def test_a_path_out_of_the_archive_is_refused(name: str, fmu_file: FmuFile, tmp_path: Path) -> None:
    path, folder = tmp_path / "x.fmu", tmp_path / "unpacked"
    shutil.copy(fmu_file("hull", 2), path)
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr(name, b"outside")
    with pytest.raises(InputError) as caught:
        unpack(path, folder)
    assert repr(name) in caught.value.problem
    assert not folder.exists()


@pytest.mark.parametrize("bomb", [pytest.param("large", marks=pytest.mark.slow), "many"])
def test_an_archive_that_would_fill_the_disk_is_not_unpacked(bomb: str, tmp_path: Path) -> None:
    path, folder = tmp_path / "bomb.fmu", tmp_path / "unpacked"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        if bomb == "large":
            with archive.open("modelDescription.xml", "w", force_zip64=True) as stream:
                for _ in range(600):
                    stream.write(bytes(1_000_000))
        else:
            for number in range(10_001):
                archive.writestr(f"{number}", b"")
    assert path.stat().st_size < 5e6
    for read in (lambda: unpack(path, folder), lambda: embedded_card(path)):
        with pytest.raises(InputError) as caught:
            read()
        assert "unpack to" in caught.value.problem
    assert not folder.exists()


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="process groups are POSIX")
@pytest.mark.parametrize("ends", [False, True], ids=["at the time limit", "when it ends itself"])
def test_no_process_that_a_library_started_goes_on(ends: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    mark = tmp_path / "alive"
    grandchild = f"import time, pathlib\nwhile True: pathlib.Path({str(mark)!r}).touch(); time.sleep(0.05)"
    wait = "while not p.exists(): time.sleep(0.02)" + ("" if ends else "\ntime.sleep(60)")
    code = (
        "import pathlib, subprocess, sys, time\n"
        f"p = pathlib.Path({str(mark)!r})\nsubprocess.Popen([sys.executable, '-c', {grandchild!r}])\n{wait}"
    )
    monkeypatch.setattr(process, "_LONGEST_S", 6.0)
    run = process._run_alone
    if ends:
        assert run([sys.executable, "-c", code], dict(os.environ)) == 0
    else:
        with pytest.raises(subprocess.TimeoutExpired):
            run([sys.executable, "-c", code], dict(os.environ))
    assert mark.exists()
    time.sleep(0.2)  # what was being written
    mark.unlink()
    time.sleep(0.5)
    assert not mark.exists()
