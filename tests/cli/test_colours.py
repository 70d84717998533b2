"""Colours and frames are for a terminal: ``NO_COLOR`` takes the colours, a pipe gets neither."""

from __future__ import annotations

import os
import pty
import re
import subprocess
import sys
from pathlib import Path

SCRIPT = """
from tank2sim.answer.parts import table
from tank2sim.cli.console import show_notices, show_table
show_table(table("Figures", ("figure", "value"), [["advance", 570.2], ["transfer", 420.2]]))
show_notices(["the card is an example"])
"""
LINE = [sys.executable, "-c", SCRIPT]
COLOUR = re.compile(r"\x1b\[(?:[\d;]*;)?(?:3[0-8]|9[0-7])[;m]")
CONTROL = re.compile(r"\x1b\[[0-9;]*m")
FRAME = re.compile("[\u2500-\u257f]")


def on_terminal(folder: Path, **environment: str) -> str:
    """What a command's output is on a terminal."""
    plain = {name: value for name, value in os.environ.items() if name not in ("NO_COLOR", "FORCE_COLOR")}
    ours, theirs = pty.openpty()
    wide = {"TERM": "xterm-256color", "COLUMNS": "120"}
    with subprocess.Popen(LINE, cwd=folder, stdout=theirs, stderr=theirs, env=plain | wide | environment) as process:
        os.close(theirs)
        text = b""
        while True:
            try:
                part = os.read(ours, 65536)
            except OSError:  # the other end is closed
                part = b""
            if not part:
                break
            text += part
    os.close(ours)
    assert process.returncode == 0, text
    return text.decode()


def test_colours_on_a_terminal_are_left_out_on_demand_and_a_pipe_gets_plain_columns(tmp_path: Path) -> None:
    coloured, plain = on_terminal(tmp_path), on_terminal(tmp_path, NO_COLOR="1")
    piped = subprocess.run(
        LINE, cwd=tmp_path, capture_output=True, text=True, env=os.environ | {"COLUMNS": "120"}, check=True
    ).stdout
    assert COLOUR.search(coloured) and FRAME.search(coloured)
    assert not COLOUR.search(plain) and FRAME.search(plain)
    assert "\x1b" not in piped and not FRAME.search(piped)
    words = [FRAME.sub(" ", CONTROL.sub("", text)).split() for text in (coloured, plain, piped)]
    assert words[0] == words[1] == words[2] and "advance" in words[2]
