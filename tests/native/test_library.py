"""The cache of compiled libraries."""

from __future__ import annotations

import os
import subprocess
import sys

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
