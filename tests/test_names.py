"""A public name means one thing in the whole package, and tests share code through modules that are not tests."""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from pathlib import Path

from .conftest import ROOT
from .sources import tree

SOURCES = ROOT / "src" / "tank2sim"


def public_names(path: Path) -> list[str]:
    names = []
    for node in tree(path).body:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            names.append(node.name)
        elif isinstance(node, ast.Assign):
            names += [target.id for target in node.targets if isinstance(target, ast.Name)]
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            names.append(node.target.id)
    return [name for name in names if not name.startswith("_")]


def test_no_public_name_is_defined_twice() -> None:
    places: dict[str, set[str]] = defaultdict(set)
    for path in SOURCES.rglob("*.py"):
        for name in public_names(path):
            places[name].add(path.relative_to(SOURCES).as_posix())
    assert len(places) > 1500
    assert {name: found for name, found in places.items() if len(found) > 1} == {}


def test_no_test_imports_from_another_test() -> None:
    importing = re.compile(r"^from [\w.]*\btest_\w+ import|^import [\w.]*\btest_\w+", re.MULTILINE)
    assert [path.name for path in (ROOT / "tests").rglob("*.py") if importing.search(path.read_text("utf-8"))] == []


PRIVATE_WORDS = re.compile(
    r"\b(told|tells?|foretells?|foretold|foretelling|mended|mends?|wish|wishes|stands|stood|beside|ours|she|her|anew|bears"
    r"|hers|strangers|but for|no such)\b|(?<!here )\bis no (?!less|more|longer)[a-z]",
    re.IGNORECASE,
)
QUOTED = {"CHANGELOG.md"}  # names that moved


def test_the_words_of_a_private_language_do_not_come_back() -> None:
    """They were replaced by those of ITTC, SNAME, FMI and statistics: CONTRIBUTING, "Words"."""
    found = {}
    files = [path for folder in ("src", "docs", "fmu_templates") for path in (ROOT / folder).rglob("*")]
    for path in [*files, *ROOT.glob("*.md")]:
        if path.suffix not in {".py", ".md", ".j2", ".js", ".css", ".c", ".h"} or path.name in QUOTED:
            continue
        if lines := [
            f"{number}: {line.strip()[:100]}"
            for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
            if PRIVATE_WORDS.search(line)
        ]:
            found[path.relative_to(ROOT).as_posix()] = lines
    assert found == {}
