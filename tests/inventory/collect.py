"""Adds to ``inventory.json`` what the program has and the file lacks: ``python -m tests.inventory.collect``.

Nothing is taken away; ``runs`` (but for their results), ``maps``, ``not_listed`` and ``renames`` are written by hand.
"""

from __future__ import annotations

import inspect
import json
import re
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import tank2sim as t2s
from tests.inventory import outside

FILE = Path(__file__).with_name("inventory.json")


def python_names() -> Iterator[str]:
    """Public names, members of classes and arguments: ``Ship``, ``Ship.turn``, ``Ship.turn(rudder_deg)``."""
    for name in t2s.__all__:
        thing = getattr(t2s, name)
        inherited = set(outside.members(t2s.Result)) if thing is not t2s.Result else set()
        parts = outside.members(thing) if inspect.isclass(thing) else {"": outside.arguments(thing)}
        for part, arguments in parts.items():
            if part not in inherited:
                yield from (f"{name}.{part}".rstrip(".") + end for end in ("", *(f"({each})" for each in arguments)))


def run_keys(made: outside.Outcome, inventory: dict[str, Any]) -> list[str]:
    """Paths in the JSON of a run that no schema declares."""
    declared = {path for paths in inventory["json"][made.command].values() for path in paths}
    declared |= outside.beginnings(declared)
    maps = {path.removesuffix(".*") for path in declared if path.endswith(".*")}
    maps |= set(inventory["maps"].get(made.command, []))
    found = set(outside.paths(outside.in_value, made.json, None, maps))
    return sorted(found - outside.beginnings(found) - declared)


def main(names: list[str]) -> None:
    """Add commands, names and keys, and the results of the runs of these names (of all that have none)."""
    inventory = json.loads(FILE.read_text(encoding="utf-8"))
    for command, parts in [each for group in inventory["commands"].values() for each in group.items()]:
        parts.setdefault("arguments", re.findall(r"[A-Z]{2,}", outside.help_of(command).split("\n\n")[0])[1:])
        for option, entry in outside.options(command).items():
            choices = re.findall(r"[\w-]+", next(iter(re.findall(r"\S+\|\S+", entry.split("  ")[1])), ""))
            known = parts.setdefault("options", {}).setdefault(option, [])
            known += [choice for choice in choices if choice not in known and not choice.isupper()]
        if command not in ("open", "report"):
            known = inventory["json"].setdefault(command, {})
            for title, (part, whole) in outside.shapes(command).items():
                found = set(outside.paths(outside.in_schema, part, whole))
                known[title] = sorted({*known.get(title, []), *found - outside.beginnings(found)})
    inventory["python"] = sorted({*inventory["python"], *python_names()} - set(inventory["not_listed"]))
    for name, each in inventory["runs"].items():
        if name in names or "files" not in each:
            with tempfile.TemporaryDirectory() as folder:
                begun = time.perf_counter()
                made = outside.outcome(each["lines"], each.get("inputs", {}), Path(folder))
            each.setdefault("seconds", round(time.perf_counter() - begun, 1))
            each["files"] = made.files
            if made.json is not None:
                each["keys"] = sorted({*each.get("keys", []), *run_keys(made, inventory)})
    FILE.write_text(json.dumps(inventory, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
