"""Every argument of a public function is documented: by its docstring, its type, its unit, or the manual's list.

Public is what the reference shows: modules that ``tank2sim.cli``, ``tank2sim.api`` and the commands of apps import, and
those that the theory names.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from tests.conftest import ROOT
from tests.sources import tree

from .examples import MANUAL

SOURCES = ROOT / "src" / "tank2sim"
_UNIT = re.compile(
    r"_(m|s|kg|N|Nm|mps|mps2|rad|deg|radps|degps|degpmin|rpm|rps|kgpm3|kgm2|m2|m3|m2ps|A|J|Hz|NmpA|prime)$"
)
_DOCUMENTED = re.compile(r'^class (\w+)(?:\([^)]*\))?:.*\n    r?"""', re.MULTILINE)
Function = ast.FunctionDef | ast.AsyncFunctionDef


@cache
def documented_types() -> frozenset[str]:
    """Classes of tank2sim that have a docstring."""
    texts = (path.read_text(encoding="utf-8") for path in SOURCES.rglob("*.py"))
    return frozenset(name for text in texts for name in _DOCUMENTED.findall(text))


@cache
def everywhere() -> frozenset[str]:
    """Names in the manual's list of arguments that mean the same everywhere."""
    rows = re.findall(
        r"^\| (`.*?) \|", (MANUAL / "reference" / "arguments.md").read_text(encoding="utf-8"), re.MULTILINE
    )
    return frozenset(name for row in rows for name in re.findall(r"`(\w+)`", row))


@cache
def public_modules() -> tuple[Path, ...]:
    """The files of the modules that the commands or the Python API import or the theory names."""
    files = [path for room in ("cli", "api") for path in (SOURCES / room).glob("*.py")]
    files += [path for path in (SOURCES / "apps").rglob("*.py") if "\n@verb" in path.read_text(encoding="utf-8")]
    imported = (one for path in files for one in ast.walk(tree(path)))
    names = {one.module for one in imported if isinstance(one, ast.ImportFrom) and one.module}
    theory = "".join(page.read_text(encoding="utf-8") for page in (MANUAL / "theory").glob("*.md"))
    for name in re.findall(r"`(\w+(?:\.\w+)+)`", theory):
        names |= {f"tank2sim.{name}", f"tank2sim.{name.rpartition('.')[0]}"}
    paths = {SOURCES.parent / name.replace(".", "/") for name in names if name.startswith("tank2sim.")}
    packages = {page.stem for page in (MANUAL / "reference").glob("*.md")}
    modules = {path / "__init__.py" if path.is_dir() else path.with_suffix(".py") for path in paths}
    return tuple(sorted(path for path in modules if path.is_file() and path.relative_to(SOURCES).parts[0] in packages))


def functions(module: ast.Module) -> Iterator[tuple[str, Function, str]]:
    """Public functions and methods with the docstring of their class."""
    for one in module.body:
        if isinstance(one, Function) and not one.name.startswith("_"):
            yield one.name, one, ""
        elif isinstance(one, ast.ClassDef) and not one.name.startswith("_"):
            for method in one.body:
                if isinstance(method, Function) and not method.name.startswith("_"):
                    yield f"{one.name}.{method.name}", method, ast.get_docstring(one) or ""


def undocumented(function: Function, of_class: str = "") -> list[str]:
    """The arguments of a function that nothing documents."""
    own = ast.get_docstring(function) or ""
    arguments = function.args
    given = [*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs, arguments.vararg, arguments.kwarg]
    names = [one for one in given if one is not None and one.arg not in ("self", "cls") and not one.arg.startswith("_")]
    return [one.arg for one in names if not _is_documented(one, f"{own} {of_class}")]


def _is_documented(argument: ast.arg, docstring: str) -> bool:
    if _UNIT.search(argument.arg) or argument.arg in everywhere():
        return True
    if re.search(rf"\b{re.escape(argument.arg)}\b", docstring):
        return True
    kind = ast.unparse(argument.annotation) if argument.annotation else ""
    return bool(documented_types() & set(re.findall(r"\w+", kind)))


@pytest.mark.parametrize("path", public_modules(), ids=lambda path: path.relative_to(SOURCES).as_posix())
def test_every_argument_of_a_public_function_is_documented(path: Path) -> None:
    found = {name: undocumented(function, own) for name, function, own in functions(tree(path))}
    assert {name: arguments for name, arguments in found.items() if arguments} == {}


def test_the_public_modules_are_many_and_have_docstrings() -> None:
    assert len(public_modules()) > 80
    assert [path.name for path in public_modules() if not ast.get_docstring(tree(path))] == []


def test_an_undocumented_argument_is_seen() -> None:
    module = ast.parse(
        'def f(speed_mps: float, path: str, gain: float, card: Card, wrong: int) -> None:\n    """Of `gain`."""'
    )
    ((_, function, _),) = functions(module)
    assert undocumented(function) == ["wrong"] if "Card" in documented_types() else ["card", "wrong"]
