"""What only a process shows: streams, colours, help, suggestions and completion."""

from __future__ import annotations

import os
import pty
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.cli.command_line import refused, tank2sim
from tests.marks import first_fast

MODELS = Path(__file__).parents[2] / "models"


def into(output: int, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", "from tank2sim.cli import main; main()", *arguments]
    return subprocess.run(command, stdout=output, stderr=subprocess.PIPE, text=True, check=False, timeout=120)


def test_a_process_ends_as_its_command_does(tmp_path) -> None:
    assert into(subprocess.PIPE, "ships").stdout == tank2sim("ships", cwd=tmp_path).stdout
    for arguments in (["stability", "titanic"], ["fly"]):
        asked = into(subprocess.PIPE, *arguments)
        refused(asked, arguments[-1])
        assert (asked.stdout, asked.stderr) == ("", tank2sim(*arguments, cwd=tmp_path).stderr)


@pytest.mark.parametrize("arguments", [["ships"], ["--help"], []])
def test_a_reader_that_goes_away_is_no_fault(arguments) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    result = into(writing, *arguments)
    os.close(writing)
    assert (result.returncode, result.stderr) == (0, "")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no /dev/full")
@pytest.mark.parametrize("arguments", [["ships"], ["--help"]])
def test_a_full_output_is_reported_in_one_line(arguments) -> None:
    with open("/dev/full", "w") as full:
        refused(into(full.fileno(), *arguments), "output cannot be written")


def test_asked_for_nothing_it_helps(tmp_path) -> None:
    result = tank2sim(cwd=tmp_path)
    assert result.returncode == 0 and "simulate" in result.stdout and not result.stderr
    assert result.stdout == tank2sim("--help", cwd=tmp_path).stdout


@first_fast(
    "given, bundled, arguments",
    [
        ("tows", "wilinski-zellman/tows.csv", ["tow", "tows", "--terms", "B3", "-o", "tows"]),
        ("ship", "mariner/ship.toml", ["stability", "ship", "--json", "ship"]),
        ("ship", "wilinski-zellman/ship.toml", ["export", "ship", "-o", "ship"]),
        ("ship", "mariner/ship.toml", ["simulate", "ship", "--manoeuvre", "turn:35", "-o", "ship"]),
    ],
)
def test_an_input_is_not_written_over(tmp_path, given, bundled, arguments) -> None:
    data = (MODELS / bundled).read_bytes()
    (tmp_path / given).write_bytes(data)
    refused(tank2sim(*arguments, cwd=tmp_path), given, "is an input")
    assert (tmp_path / given).read_bytes() == data and len(list(tmp_path.iterdir())) == 1


@pytest.mark.slow
def test_one_file_for_two_outputs_is_refused(tmp_path) -> None:
    tows = str(MODELS / "wilinski-zellman/tows.csv")
    refused(tank2sim("tow", tows, "--terms", "B3", "-o", "x", "--json", "x", cwd=tmp_path), "two outputs")
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_a_ship_may_be_named_like_markup(tmp_path) -> None:
    result = tank2sim("stability", "mariner", "--set", 'ship.name="[/] [bold]x"', cwd=tmp_path)
    assert result.returncode == 0 and "[/] [bold]x at" in result.stdout, result.stderr


@pytest.mark.parametrize(
    ("arguments", "meant"),
    [
        (["simulat", "mariner"], "simulate"),
        (["simulate", "marinner", "--manoeuvre", "turn:35"], "mariner"),
        (["simulate", "mariner", "--manoeuvre", "tunr:35"], "turn"),
        (["simulate", "mariner", "--manoeuvre", "turn:35", "--set", "Yv=1"], "derivatives.Yv"),
        (["simulate", "mariner", "--manoeuvre", "turn:35", "--set", "length_m=100"], "ship.length_m"),
        (["simulate", "mariner", "--manoeuvre", "turn:35", "--set", "derivatives.Yvv=1"], "Yvvv"),
        (["simulate", "mariner", "--manouvre", "turn:35"], "--manoeuvre"),
    ],
)
def test_a_name_that_resembles_a_known_one_is_suggested(arguments, meant, tmp_path) -> None:
    refused(tank2sim(*arguments, cwd=tmp_path), "id you mean", meant)


def test_every_command_is_in_one_group_of_the_help(tmp_path) -> None:
    from tank2sim.api.commands import VERBS
    from tank2sim.cli import COMMANDS, GROUPS

    assert sum(map(len, GROUPS.values())) == len(COMMANDS)
    helped = " ".join(tank2sim("--help", cwd=tmp_path).stdout.split())
    for title, commands in GROUPS.items():
        shown = helped.partition(f" {title}: ")[2]
        for name in commands:
            words = f"{name} {VERBS[name].words}"
            assert shown.startswith(words)
            shown = shown.removeprefix(words).lstrip()


@pytest.mark.slow
def test_a_shell_completes_commands(tmp_path) -> None:
    completing = {"_TANK2SIM_COMPLETE": "bash_complete", "COMP_WORDS": "tank2sim sim", "COMP_CWORD": "1"}
    command = [str(Path(sys.executable).parent / "tank2sim")]
    done = subprocess.run(command, env=os.environ | completing, capture_output=True, text=True, check=False)
    assert done.stdout == "plain,simulate\n"


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


WIDE = """
from dataclasses import replace
from tank2sim.answer.parts import table
from tank2sim.cli.console import show_table
heads = [f"figure {chr(97 + place)}" for place in range(20)]
show_table(replace(table("Figures", heads, [[1000.25 + place for place in range(20)]]), wide=True))
"""


def on_terminal(folder: Path, script: str = SCRIPT, **environment: str) -> str:
    """What a command's output is on a terminal."""
    plain = {name: value for name, value in os.environ.items() if name not in ("NO_COLOR", "FORCE_COLOR")}
    ours, theirs = pty.openpty()
    wide = {"TERM": "xterm-256color", "COLUMNS": "120"}
    line = [sys.executable, "-c", script]
    with subprocess.Popen(line, cwd=folder, stdout=theirs, stderr=theirs, env=plain | wide | environment) as process:
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


@pytest.mark.parametrize("kind", ["dumb", "xterm-256color"])
def test_no_number_of_a_wide_table_is_cut_on_a_narrow_terminal(tmp_path: Path, kind: str) -> None:
    words = FRAME.sub(" ", CONTROL.sub("", on_terminal(tmp_path, WIDE, TERM=kind, COLUMNS="60"))).split()
    assert [word for word in words if word.startswith("10")] == [f"{1000.25 + place:.4g}" for place in range(20)]


def test_no_number_of_any_table_is_broken_on_a_narrow_terminal(tmp_path: Path) -> None:
    text = on_terminal(tmp_path, WIDE.replace("wide=True", "wide=False"), COLUMNS="60")
    words = FRAME.sub(" ", CONTROL.sub("", text)).split()
    assert [word for word in words if word.startswith("10")] == [f"{1000.25 + place:.4g}" for place in range(20)]
    assert words.count("figure") == 20
