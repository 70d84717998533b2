"""Files are written whole or not at all, and nothing that matters is written over."""

from __future__ import annotations

import os
import sys
import threading
from pathlib import Path

import pytest

from tank2sim.errors import InputError
from tank2sim.files import STANDARD_OUTPUT, read_exact_text, read_text, write_together, write_whole


def test_what_is_read_exactly_encodes_to_the_same_bytes(tmp_path: Path) -> None:
    data = b"\xef\xbb\xbfa = 1\r\nb = 2\n"
    (tmp_path / "a").write_bytes(data)
    assert read_exact_text(tmp_path / "a").encode() == data
    assert read_text(tmp_path / "a") == "a = 1\nb = 2\n"


def test_a_link_keeps_pointing_at_its_target(tmp_path: Path) -> None:
    (tmp_path / "target").write_text("old")
    (tmp_path / "link").symlink_to("target")
    (tmp_path / "dangling").symlink_to("later")
    write_together({tmp_path / "link": "new", tmp_path / "dangling": "made"})
    assert (tmp_path / "link").is_symlink() and (tmp_path / "target").read_text() == "new"
    assert (tmp_path / "dangling").is_symlink() and (tmp_path / "later").read_text() == "made"


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_a_pipe_is_written_to_and_stays(tmp_path: Path) -> None:
    pipe, got = tmp_path / "pipe", []
    os.mkfifo(pipe)
    reader = threading.Thread(target=lambda: got.append(pipe.read_bytes()), daemon=True)
    reader.start()
    write_whole(pipe, "told")
    reader.join(10)
    assert got == [b"told"] and pipe.is_fifo()


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no /dev/full")
def test_a_full_device_is_reported_and_nothing_else_is_written(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="/dev/full: cannot be written"):
        write_together({tmp_path / "a": "a", Path("/dev/full"): "b"})
    assert not list(tmp_path.iterdir())


def test_an_input_is_not_written_over_by_any_name_it_has(tmp_path: Path) -> None:
    measured, link = tmp_path / "tows.csv", tmp_path / "link.csv"
    measured.write_text("data")
    link.symlink_to(measured)
    for output in (measured, link, tmp_path / "." / "tows.csv"):
        with pytest.raises(InputError, match="is an input"):
            write_together({tmp_path / "other": "x", output: "x"}, inputs=[tmp_path / "none", measured])
    assert measured.read_text() == "data" and not (tmp_path / "other").exists()


def test_one_file_for_two_outputs_is_refused(tmp_path: Path) -> None:
    same, link = tmp_path / "a", tmp_path / "b"
    link.symlink_to(same)
    with pytest.raises(InputError, match="is given for two outputs"):
        write_together({same: "1", link: "2"})
    with pytest.raises(InputError, match="is given for two outputs"):
        write_together({same: "2"}, outputs=[same, None, same])
    assert not same.exists()


@pytest.mark.parametrize("name", ["n" * 300, "missing/a", "file/a", "folder", "loop"])
def test_a_name_that_cannot_be_written_is_reported_before_anything_is(tmp_path: Path, name: str) -> None:
    (tmp_path / "file").touch()
    (tmp_path / "folder").mkdir()
    (tmp_path / "loop").symlink_to("loop")
    with pytest.raises(InputError, match=name):
        write_together({tmp_path / "first": "x", tmp_path / name: "x"})
    assert not (tmp_path / "first").exists()


def test_a_name_as_long_as_the_system_allows_is_written(tmp_path: Path) -> None:
    write_whole(tmp_path / ("n" * 255), "x")
    assert (tmp_path / ("n" * 255)).read_text() == "x"


def test_standard_output_that_is_closed_is_refused_and_nothing_is_written(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(sys, "__stdout__", None)  # as Python has it in a process without one
    with pytest.raises(InputError, match="closed"):
        write_together({tmp_path / "page.html": "<!doctype html>", STANDARD_OUTPUT: "{}"})
    assert not list(tmp_path.iterdir())
