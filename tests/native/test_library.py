"""The cache of compiled libraries."""

from __future__ import annotations

import errno
import os
import subprocess
import sys

import pytest

from tank2sim.errors import InputError
from tank2sim.native.library import cached_library

_TWICE = """
from tank2sim.native.library import cached_library
one, another = cached_library({"model.c": "int x;\\n"}), cached_library({"model.c": "int y;\\n"})
assert one.parent == another.parent and one.is_file() and another.is_file()
print(one.parent)
"""


def test_a_source_is_compiled_once() -> None:
    library = cached_library({"model.c": "int once;\n"})
    written = library.stat().st_mtime_ns
    assert cached_library({"model.c": "int once;\n"}) == library and library.stat().st_mtime_ns == written


def test_a_cache_that_cannot_be_written_leaves_nothing_behind(tmp_path) -> None:
    (tmp_path / "file").touch()
    (tmp_path / "temporary").mkdir()
    places = {"XDG_CACHE_HOME": str(tmp_path / "file" / "cache"), "TMPDIR": str(tmp_path / "temporary")}
    command = [sys.executable, "-c", _TWICE]
    done = subprocess.run(command, env=os.environ | places, capture_output=True, text=True, check=True)
    assert done.stdout.startswith(str(tmp_path / "temporary"))
    assert not list((tmp_path / "temporary").iterdir())


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """A cache of its own, in which nothing has been compiled."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "tank2sim" / "libraries"


SOURCE = {"model.c": '__attribute__((visibility("default"))) int answer(void) { return 42; }\n'}


@pytest.mark.parametrize("damage", ["truncated", "changed", "emptied", "a folder", "unreadable link"])
def test_an_entry_that_is_no_longer_what_was_made_is_made_again(cache, damage) -> None:
    library = cached_library(SOURCE)
    content = library.read_bytes()
    library.unlink()
    if damage == "a folder":
        library.mkdir()
        (library / "in the way").touch()
    elif damage == "unreadable link":
        library.symlink_to(cache / "nowhere")
    else:
        wrong = {"truncated": content[: len(content) // 2], "changed": content[:-1] + b"x", "emptied": b""}[damage]
        library.write_bytes(wrong)
    again = cached_library(SOURCE)
    assert again.read_bytes() == content
    assert [path.name for path in cache.iterdir()] == [again.name]
    code = f"import ctypes; print(ctypes.CDLL({str(again)!r}).answer())"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, check=True).stdout.strip() == b"42"


def test_a_cache_into_which_others_may_write_is_not_used(cache) -> None:
    planted = cached_library(SOURCE)
    cache.chmod(0o777)
    assert cached_library(SOURCE).parent != cache
    cache.chmod(0o700)
    assert cached_library(SOURCE) == planted


def test_what_killed_runs_left_is_swept_and_what_runs_now_is_not(cache) -> None:
    cached_library(SOURCE)
    old, new, other = cache / "making-old", cache / "making-new", cache / "zig"
    for folder in (old, new, other):
        (folder / "inner").mkdir(parents=True)
    for folder in (old, other):
        os.utime(folder, (0, 0))
    cached_library({"model.c": "int another;\n"})
    assert not old.exists() and new.exists() and other.exists()


def test_a_full_disk_is_named(cache, monkeypatch) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(InputError) as caught:
        cached_library({"model.c": "int full;\n"})
    assert caught.value.source == str(cache) and "No space" in caught.value.problem
    assert not list(cache.iterdir())
