"""Messages name the argument in Python, and the option on the command line."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import click
import pytest

import tank2sim as t2s
from tank2sim.cli import tank2sim as group
from tank2sim.cli.naming import in_options, options_of
from tests.cli.command_line import refused, tank2sim
from tests.conftest import ROOT
from tests.sources import tree


@pytest.mark.parametrize(
    "command, said, shown",
    [
        ("tow", 'take fewer terms (terms="B3").', "take fewer terms (--terms B3)."),
        ("tow", "none (start_delay=True), or length_m.", "none (--start-delay), or --length."),
        ("tow", "give length_m, or a line '# length_m: 0.67'", "give --length, or a line '# length_m: 0.67'"),
        ("tow", "ship.length_m and 'mass_kg: 3' and B3_kgpm=2", "ship.length_m and 'mass_kg: 3' and B3_kgpm=2"),
        ("tow", "tows/length_m.csv: give length_m.", "tows/length_m.csv: give --length."),
        ("glide", "leave views=False out, give angles_deg=30", "leave --no-views out, give --angles 30"),
        ("gap", "kvlcc2: black_box: is not for a craft", "kvlcc2: --black-box: is not for a craft"),
        ("autopilot", 'wave_filter_radps=0.4 with design="pid"', "--wave-filter 0.4 with --design pid"),
    ],
)
def test_arguments_in_a_message_are_called_by_their_options(command: str, said: str, shown: str) -> None:
    found = group.get_command(click.Context(group), command)
    assert found is not None and in_options(said, options_of(found)) == shown


def test_a_notice_names_the_argument_in_python_and_the_option_on_the_command_line(tmp_path: Path) -> None:
    tows = ROOT / "models" / "wilinski-zellman" / "tows.csv"
    in_python = " ".join(t2s.tow(tows).notices)
    assert 'terms="B3"' in in_python and "total_mass_kg" in in_python and "--" not in in_python
    on_line = tank2sim("tow", str(tows), cwd=tmp_path).stdout
    assert "--terms B3" in on_line and "--total-mass" in on_line and "total_mass_kg" not in on_line


def test_the_fault_of_a_ship_of_a_fleet_names_the_option(tmp_path: Path) -> None:
    for name in ("one", "two"):
        (tmp_path / "fleet" / name).mkdir(parents=True)
        t2s.load("otter").save(tmp_path / "fleet" / name / "ship.toml")
        t2s.load("otter").simulate("difference:200", duration_s=30.0).to_csv(tmp_path / "fleet" / name / "trial.csv")
    done = tank2sim("gap", "fleet", "-o", "out", "--black-box", cwd=tmp_path)
    refused(done, "--black-box: is not for a craft")
    assert "black_box" not in done.stderr + done.stdout


def test_no_message_of_a_function_names_an_option() -> None:
    """What a function says is read in Python, too; `cli.naming` makes options of its arguments."""
    own_command = re.compile(r"(^|[ (])--[a-z]")
    found = []
    others = re.compile(r"export --|wrote with --|write with --|--json|tank2sim ")
    for path in (ROOT / "src" / "tank2sim").rglob("*.py"):
        if "cli" in path.parts:
            continue
        docstrings = {
            node.body[0].value
            for node in ast.walk(tree(path))
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef)
            and node.body
            and isinstance(node.body[0], ast.Expr)
        }
        for call in ast.walk(tree(path)):
            name = getattr(getattr(call, "func", None), "id", getattr(getattr(call, "func", None), "attr", ""))
            if name in ("ArgumentError", "InputError", "Notice", "caution", "fault"):
                for text in (one for one in ast.walk(call) if isinstance(one, ast.Constant) and one not in docstrings):
                    words = str(text.value)
                    if own_command.search(words) and not others.search(words):
                        found.append((path.name, words))
    assert not found
