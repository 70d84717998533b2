"""The program as its users see it: help, public names, JSON Schemas, files that commands write.

No module of the program is imported: commands are called through the console script, Python by ``import tank2sim``.
"""

from __future__ import annotations

import contextlib
import functools
import importlib
import inspect
import io
import json
import os
import re
import shlex
import sys
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any
from unittest import mock

import tank2sim as t2s
from tests.corpus.inputs import plain

JSON = "out.json"
"""File into which the last command of a run writes its JSON."""

_NAME = r"--?[A-Za-z][\w-]*"
_HEAD = re.compile(rf"([^\w-]*)(?:[A-Z][\w.-]*\s+)?({_NAME}(?:[,/\s]+{_NAME})*)")
"""Beginning of an option in a help: boxes, stars and the name of an argument may stand before its names."""

_BEGINNINGS = {b"<!doctype html": "page", b"\x89PNG": "png", b"<svg": "svg", b"%PDF": "pdf", b"PK": "zip", b"{": "json"}

Steps = Callable[[Any, Any], Iterator[tuple[str, Any]]]
"""Steps (a name, ``[]`` for an item, ``*`` for any name) from a node of a JSON Schema, or of a value, to the next."""


def run(line: str, folder: Path) -> tuple[int, str]:
    """Exit code and standard output of ``tank2sim LINE`` in a folder, in this process."""
    (script,) = entry_points(group="console_scripts", name="tank2sim")
    main, out, code = script.load(), io.StringIO(), None
    importlib.import_module("tank2sim.cli.console")  # it reads the width of the screen once, before it is changed here
    with (
        contextlib.chdir(folder),
        mock.patch.object(sys, "argv", ["tank2sim", *shlex.split(line)]),
        mock.patch.dict(os.environ, COLUMNS="200"),
        contextlib.redirect_stdout(out),
    ):
        try:
            code = main()
        except SystemExit as end:
            code = end.code
    return int(code or 0), out.getvalue()


@functools.cache
def help_of(command: str) -> str:
    """Help of a command; of the program for an empty name."""
    code, text = run(f"{command} --help", Path.cwd())
    assert code == 0, f"tank2sim {command} --help ended with {code}"
    return text


def groups(commands: Iterable[str], names: Iterable[str]) -> dict[str, str]:
    """Each of `commands` that the program's help lists, to the last of the group `names` above it."""
    found, group = {}, ""
    for line in help_of("").splitlines():
        words = re.findall(r"[\w-]+", line)
        if len(words) == 1 and words[0] in names:
            group = words[0]
        elif words and words[0] in commands:
            found[words[0]] = group
    return found


def options(command: str) -> dict[str, str]:
    """Names of each option of a command, with a blank between, to its entry in the help."""
    lines = help_of(command).splitlines()
    heads = [(number, head) for number, line in enumerate(lines) if (head := _HEAD.match(line))]
    # An explanation that continues with the name of another option stands further to the right.
    right = min(len(head[1]) for _, head in heads) + 4
    heads = [(number, head) for number, head in heads if len(head[1]) <= right]
    ends = [number for number, _ in heads[1:]] + [len(lines)]
    return {
        " ".join(re.findall(_NAME, head[2])): "\n".join(lines[number:end])
        for (number, head), end in zip(heads, ends, strict=True)
    }


def arguments(function: Any) -> list[str]:
    """Names of the arguments of a function, with those of ``**options: Unpack[...]``."""
    names: list[str] = []
    for each in inspect.signature(function).parameters.values():
        if each.kind is not each.VAR_KEYWORD:
            names.append(each.name)
        elif options := re.search(r"Unpack\[(\w+)\]", str(each.annotation)):
            names += inspect.unwrap(function).__globals__[options[1]].__annotations__
    return [name for name in names if name not in ("self", "cls")]


def members(kind: type) -> dict[str, list[str]]:
    """Public methods of a class with their arguments; its other public attributes have none."""
    fields = {name for base in kind.__mro__ for name in vars(base).get("__annotations__", {})}
    names = {name for name in {*dir(kind), *fields} - set(dir(Exception)) if not name.startswith("_")}
    found = {name: getattr(kind, name, None) for name in names}
    return {name: arguments(value) if callable(value) else [] for name, value in sorted(found.items())}


def shapes(command: str, door: str = "json_schema") -> dict[str, tuple[dict[str, Any], dict[str, Any]]]:
    """Each shape that the JSON of a command can have by its title: its schema and the whole one."""
    whole = getattr(t2s, door)(command)
    found = [part for part in _alternatives(whole, whole) if "properties" in part]
    return {part["title"].removesuffix("Keys"): (part, whole) for part in found}


def _alternatives(node: Any, whole: dict[str, Any]) -> Iterator[dict[str, Any]]:
    if isinstance(node, dict):
        yield node
        for part in (part for word in ("anyOf", "oneOf", "allOf") for part in node.get(word, [])):
            yield from _alternatives(part, whole)
        if "$ref" in node:
            way = node["$ref"].split("/")[1:]
            yield from _alternatives(functools.reduce(lambda part, key: part[key], way, whole), whole)


def in_schema(node: Any, whole: Any) -> Iterator[tuple[str, Any]]:
    """Steps from a node of a schema; none into values of which the schema says nothing."""
    for part in _alternatives(node, whole):
        yield from part.get("properties", {}).items()
        if isinstance(part.get("additionalProperties"), dict):
            yield "*", part["additionalProperties"]
        array = "array" in part.get("type", [])  # of arrays, if nothing is said of its items
        items = [*part.get("prefixItems", []), part.get("items")] if array else []
        yield from (("[]", item or {}) for item in items)


def in_value(value: Any, whole: Any = None) -> Iterator[tuple[str, Any]]:
    """Steps from a value of JSON to the values in it."""
    if isinstance(value, dict):
        yield from value.items()
    elif isinstance(value, list):
        yield from (("[]", item) for item in value)


def holds(steps: Steps, node: Any, whole: Any, path: str) -> bool:
    """Whether a schema or a value has a value at the end of a dotted path; ``*`` is met by any name."""
    first, *rest = path.replace("[]", ".[]").lstrip(".").split(".")
    return any(
        (step == first or (first == "*" and step != "[]")) and (not rest or holds(steps, part, whole, ".".join(rest)))
        for step, part in steps(node, whole)
    )


def paths(steps: Steps, node: Any, whole: Any, maps: Iterable[str] = (), before: str = "") -> Iterator[str]:
    """Every dotted path from a node; names in `maps` (paths) are written as ``*``."""
    for step, part in steps(node, whole):
        name = "*" if before in maps and step != "[]" else step
        path = f"{before}{name}" if name == "[]" else f"{before}.{name}".lstrip(".")
        yield path
        yield from paths(steps, part, whole, maps, path)


def beginnings(every: Iterable[str]) -> set[str]:
    """All paths of which others are longer ones: ``a`` and ``a.b`` of ``a.b[]``."""
    return {path[: end.start()] for path in every for end in re.finditer(r"\[\]|\.", path)}


@dataclass(frozen=True)
class Outcome:
    """Last command of a run, path of each new file to its kind, and content of :data:`JSON` if it was written."""

    command: str
    files: dict[str, str]
    json: Any


def outcome(lines: list[str], inputs: dict[str, str], folder: Path) -> Outcome:
    """Run commands in a folder with `inputs`: path to its text, or to the name of an input of the corpus."""
    for name, text in inputs.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(text.encode() if "\n" in text else plain()[text])
    for line in lines:
        code, _ = run(line, folder)
        assert code == 0, f"tank2sim {line} ended with {code}"
    found = {path.relative_to(folder).as_posix(): path for path in sorted(folder.rglob("*")) if path.is_file()}
    files = {name: _kind(path) for name, path in found.items() if name not in inputs}
    return Outcome(lines[-1].split()[0], files, json.loads(found[JSON].read_bytes()) if JSON in found else None)


def _kind(path: Path) -> str:
    """What a file holds, by its beginning; of a text by its ending."""
    begins = path.read_bytes()[:20].lower()
    return next((kind for known, kind in _BEGINNINGS.items() if begins.startswith(known.lower())), path.suffix[1:])
