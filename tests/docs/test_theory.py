"""Every equation of the theory manual names a source, a place in the code and a test, and both are there."""

from __future__ import annotations

import importlib
import re
from pathlib import Path

import pytest

from tank2sim.dynamics.effects import EFFECTS
from tests.conftest import ROOT

from .examples import MANUAL

THEORY = sorted((MANUAL / "theory").glob("*.md"))
_EQUATION = re.compile(r"^\$\$\n(.*?)^\$\$\n", re.DOTALL | re.MULTILINE)
_WHERE = re.compile(
    r"\n\{\.where\}\n\*Source\* (?P<source>.+?)\*Code\*\s(?P<code>.+?)\*Test\*\s(?P<test>.+?)\n(?:\n|\Z)", re.DOTALL
)


def places(page: Path) -> list[re.Match[str] | None]:
    """What stands right after each equation of a page."""
    text = page.read_text(encoding="utf-8")
    return [_WHERE.match(text, found.end()) for found in _EQUATION.finditer(text)]


def named(text: str) -> list[str]:
    return re.findall(r"`([^`]+)`", text)


def stands_in_the_code(name: str) -> bool:
    """Whether ``package.module`` or ``package.module.thing`` of tank2sim is there."""
    try:
        importlib.import_module(f"tank2sim.{name}")
    except ModuleNotFoundError:
        module, _, thing = name.rpartition(".")
        try:
            return hasattr(importlib.import_module(f"tank2sim.{module}"), thing)
        except ModuleNotFoundError:
            return False
    return True


def is_in_the_checkout(name: str) -> bool:
    """Whether ``folder/test_module.py::test_name`` is there, or a script of ``benchmarks/`` or ``docs/``."""
    file, _, test = name.partition("::")
    path = ROOT / file if file.startswith(("benchmarks/", "docs/")) else ROOT / "tests" / file.removeprefix("tests/")
    if not path.is_file():
        return False
    return (
        not test or re.search(rf"^def {re.escape(test)}\(", path.read_text(encoding="utf-8"), re.MULTILINE) is not None
    )


def test_the_manual_has_equations() -> None:
    assert sum(len(places(page)) for page in THEORY) >= 50


@pytest.mark.parametrize("page", THEORY, ids=lambda page: page.stem)
def test_every_equation_says_where_it_is_from_where_it_is_and_what_holds_it(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    for found, where in zip(_EQUATION.finditer(text), places(page), strict=True):
        assert where is not None, f"{page.name}: nothing after {found[1]}"
        assert named(where["code"]) and named(where["test"]), f"{page.name}: no name after {found[1]}"
        lost = [name for name in named(where["code"]) if not stands_in_the_code(name)]
        lost += [name for name in named(where["test"]) if not is_in_the_checkout(name)]
        assert not lost, f"{page.name}: not there: {lost}"


@pytest.mark.parametrize("page", sorted(MANUAL.rglob("*.md")), ids=lambda page: page.relative_to(MANUAL).as_posix())
def test_tests_named_in_the_text_are_there(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert [name for name in re.findall(r"`([\w/]+\.py(?:::\w+)?)`", text) if not is_in_the_checkout(name)] == []


def sections(text: str) -> dict[str, str]:
    """What stands under each heading that is the name of an effect."""
    pieces = re.split(r"^### `(\w+)`\n", text, flags=re.MULTILINE)
    return dict(zip(pieces[1::2], pieces[2::2], strict=True))


def test_every_effect_has_its_equation_with_its_code_and_a_test_that_tries_it() -> None:
    found = sections((MANUAL / "theory" / "effects.md").read_text(encoding="utf-8"))
    assert set(found) == set(EFFECTS) and len(found) == len(EFFECTS)
    for name, text in found.items():
        assert _EQUATION.search(text), f"{name} has no equation"
        where = re.search(r"\*Code\*\s`([\w.]+)\.(\w+)`\.\s\*Test\*", text)
        assert where, f"{name} names no code"
        module, constant = where.groups()
        assert getattr(importlib.import_module(f"tank2sim.{module}"), constant) is EFFECTS[name], name
        files = {ROOT / "tests" / test.partition("::")[0] for test in re.findall(r"`([\w/]+\.py::\w+)`", text)}
        assert any(re.search(rf"\b{name}\b", file.read_text(encoding="utf-8")) for file in files), (
            f"{name} is not tried"
        )


def test_what_is_not_there_is_seen() -> None:
    assert not stands_in_the_code("dynamics.hull.no_such_function") and not stands_in_the_code("no_module.thing")
    assert not is_in_the_checkout("dynamics/test_ship.py::test_none") and not is_in_the_checkout("no/test_file.py")
