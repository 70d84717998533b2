"""No feature that README, manual or help names is lost: the program as its users see it holds ``inventory.json``.

The program is looked at from outside alone (:mod:`tests.inventory.outside`), so that the same inventory holds before
and after a change of its inside. A feature can be

- added: ``python -m tests.inventory.collect`` writes it into the inventory;
- renamed: by a line of ``renames`` in the inventory: kind, then command (``*`` for all and for kinds without), then
  old to new; the CHANGELOG has it, too. A renamed path in JSON renames all paths that begin with it;
- removed: only by taking it out of ``inventory.json`` by hand, which a reviewer sees.
"""

from __future__ import annotations

import functools
import json
import os
import re
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest

import tank2sim as t2s
from tests.inventory import outside

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
INVENTORY: dict[str, Any] = json.loads((HERE / "inventory.json").read_text(encoding="utf-8"))
RENAMES: dict[str, dict[str, dict[str, str]]] = INVENTORY["renames"]
COMMANDS = {name: parts for group in INVENTORY["commands"].values() for name, parts in group.items()}
FAST_SECONDS, SLOW_SECONDS = 1.0, 20.0


def renamed(kind: str, name: str, command: str = "") -> str:
    """The name that a feature has now: its longest beginning that was renamed is replaced."""
    table = RENAMES.get(kind, {}).get("*", {}) | RENAMES.get(kind, {}).get(command, {})
    # A beginning ends where a name does: "figures" is none of "figures_are".
    old = max((old for old in table if re.match(rf"{re.escape(old)}(?![\w-])", name)), key=len, default="")
    return table.get(old, "") + name.removeprefix(old)


def command_now(command: str) -> str:
    return renamed("commands", command)


@functools.cache
def names_now(command: str) -> dict[str, str]:
    """Each option of a command, by every name that it has, to its entry in the help."""
    entries = outside.options(command_now(command))
    return {name: entry for names, entry in entries.items() for name in names.split()}


def line_now(line: str) -> str:
    """A command line with the names of today."""
    command, *words = line.split(" ")
    return " ".join([command_now(command), *(renamed("options", word, command) for word in words)])


def test_every_command_is_in_its_group_of_the_help() -> None:
    wanted = {command_now(name): group for group, names in INVENTORY["commands"].items() for name in names}
    assert outside.groups(set(wanted), set(INVENTORY["commands"])) == wanted


@pytest.mark.parametrize("command", COMMANDS)
def test_every_argument_option_and_choice_is_in_the_help(command: str) -> None:
    usage, entries = outside.help_of(command_now(command)), names_now(command)
    missing = [word for word in COMMANDS[command]["arguments"] if renamed("arguments", word, command) not in usage]
    for names, choices in COMMANDS[command]["options"].items():
        now = [renamed("options", name, command) for name in names.split()]
        missing += [name for name in now if name not in entries]
        entry = next((entries[name] for name in now if name in entries), "")
        missing += [f"{names} {choice}" for choice in choices if not _word(renamed("choices", choice, command), entry)]
    assert not missing


def _word(word: str, text: str) -> bool:
    return re.search(rf"(?<![\w-]){re.escape(word)}(?![\w-])", text) is not None


def test_every_python_name_and_argument_is_there() -> None:
    assert [name for name in INVENTORY["python"] if not _in_python(renamed("python", name))] == []


def _in_python(name: str) -> bool:
    """Whether ``Ship.turn(rudder_deg)`` is there: the public name, its member, the argument of the last one."""
    dotted, _, argument = name.rstrip(")").partition("(")
    first, _, member = dotted.partition(".")
    if first not in dir(t2s):
        return False
    thing = getattr(t2s, first)
    if member and member not in outside.members(thing):
        return not argument and member in outside.arguments(thing)
    thing = getattr(thing, member, None) if member else thing
    return not argument or argument in outside.arguments(thing)


@pytest.mark.parametrize("command", INVENTORY["json"])
def test_every_key_is_in_the_json_schema(command: str) -> None:
    shapes = outside.shapes(command_now(command), renamed("python", "json_schema")).values()
    for title, paths in INVENTORY["json"][command].items():
        keys = [renamed("json", path, command) for path in paths]
        # One shape of today has all keys of one: a script cannot read keys that are scattered over several.
        lost = [[key for key in keys if not outside.holds(outside.in_schema, *shape, key)] for shape in shapes]
        assert min(lost, key=len) == [], title


def _marks(run: dict[str, Any]) -> list[pytest.MarkDecorator]:
    slow = [] if run["seconds"] <= FAST_SECONDS else ["slow"] if run["seconds"] <= SLOW_SECONDS else ["long"]
    return [getattr(pytest.mark, name) for name in slow]


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=_marks(run), id=name) for name, run in INVENTORY["runs"].items()]
)
def test_a_command_writes_its_files_and_keys(name: str, tmp_path: Path) -> None:
    run = INVENTORY["runs"][name]
    if "needs" in run:
        pytest.importorskip(run["needs"])
    command = run["lines"][-1].split()[0]
    made = outside.outcome([line_now(line) for line in run["lines"]], run.get("inputs", {}), tmp_path)
    wanted = {renamed("files", path, command): kind for path, kind in run["files"].items()}
    assert {path: made.files.get(path) for path in wanted} == wanted
    keys = [renamed("json", path, command) for path in run.get("keys", [])]
    assert [key for key in keys if not outside.holds(outside.in_value, made.json, None, key)] == []


FEATURES = [row for row in (HERE / "features.md").read_text(encoding="utf-8").splitlines() if row.startswith("| ")][1:]


def test_every_other_feature_has_a_test() -> None:
    for row in FEATURES:
        path, name = row.split("`")[-2].split("::")
        assert re.search(rf"^ *def {name}\(", (ROOT / path).read_text(encoding="utf-8"), re.M), row


def test_renames_are_of_what_is_in_the_inventory() -> None:
    """A line of ``renames`` that no feature needs is a slip, and would hide one."""
    assert [old for kind, table in RENAMES.items() for old in _unused(kind, table)] == []


WORDS = {"json": "JSON", "python": "Python"}


def test_every_rename_is_in_the_changelog() -> None:
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    rows = [
        f"| {WORDS.get(kind, kind.removesuffix('s'))} | {f'`{command}`'.replace('`*`', '')} | `{old}` | `{new}` |"
        for kind, table in RENAMES.items()
        for command, names in table.items()
        for old, new in names.items()
    ]
    assert [row for row in rows if row not in text] == []


def _unused(kind: str, table: dict[str, dict[str, str]]) -> Iterable[str]:
    known = json.dumps({key: part for key, part in INVENTORY.items() if key != "renames"})
    for command, names in table.items():
        assert command == "*" or command in COMMANDS, f"{kind}: {command} is not a command"
        yield from (f"{kind} {command} {old}" for old in names if not _word(old, known))


def test_what_is_not_there_is_seen() -> None:
    shape = next(iter(outside.shapes("simulate").values()))
    assert not outside.holds(outside.in_schema, *shape, "figures.not_there") and "--not-there" not in names_now("audit")
    assert not outside.holds(outside.in_value, {"a": [1]}, None, "a.b") and not _in_python("Ship.turn(not_there)")


def test_a_command_run_here_leaves_the_width_of_the_screen() -> None:
    program = "from pathlib import Path; from tests.inventory import outside; outside.run('ships', Path.cwd()); "
    program += "from tank2sim.cli.console import screen; print(screen.width)"
    command, environment = [sys.executable, "-c", program], {**os.environ, "COLUMNS": "80"}
    root = Path(__file__).parents[2]
    found = subprocess.run(command, env=environment, cwd=root, capture_output=True, text=True, check=True)
    assert found.stdout.split()[-1] == "80"
