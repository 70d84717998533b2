"""The picture of the architecture is that of the imports."""

from __future__ import annotations

import ast
import importlib
import re
import sys
from graphlib import CycleError
from types import ModuleType

import pytest

from tests.conftest import ROOT
from tests.sources import tree

from .examples import MANUAL


@pytest.fixture(scope="module")
def architecture() -> ModuleType:
    """The module of the manual's pictures; Sphinx takes seconds to import, in each process that collects tests."""
    pytest.importorskip("sphinx", reason="Sphinx is not installed (extra docs)")
    sys.path.insert(0, str(MANUAL))
    return importlib.import_module("architecture")


@pytest.fixture(scope="module")
def drawn(architecture) -> str:
    return architecture.architecture()


def test_a_package_is_above_all_that_it_imports(architecture) -> None:
    imports = {"roof": frozenset({"wall", "floor"}), "wall": frozenset({"floor"}), "floor": frozenset[str]()}
    assert architecture.layers(imports) == [["floor"], ["wall"], ["roof"]]
    assert architecture.direct(imports) == {"roof": ["wall"], "wall": ["floor"], "floor": []}


def test_imports_in_a_circle_are_an_error(architecture) -> None:
    with pytest.raises(CycleError):
        architecture.layers({"a": frozenset({"b"}), "b": frozenset({"a"})})


def test_every_arrow_of_the_picture_goes_down(architecture, drawn) -> None:
    arrows = re.findall(r'class="arrow" d="M\S+ (\S+?)[LC](?:.* )?\S+ (\S+?)"', drawn)
    assert len(arrows) == sum(map(len, architecture.direct(architecture.package_imports()).values()))
    assert all(float(begin) < float(end) for begin, end in arrows)


def test_every_package_is_drawn_and_described(architecture, drawn) -> None:
    packages = [path.parent.name for path in (ROOT / "src" / "tank2sim").glob("*/__init__.py")]
    table = architecture.package_table()
    assert all(f">{name}</text>" in drawn and f"| `{name}` |" in table for name in packages)


def test_the_modules_that_the_page_names_are_there() -> None:
    named = re.findall(r"`((?:\w+\.)+\w+)`", (MANUAL / "developer" / "index.md").read_text(encoding="utf-8"))
    found = []
    for name in named:
        parts = name.split(".")
        for length in range(len(parts), 0, -1):
            path = ROOT.joinpath("src", "tank2sim", *parts[:length])
            file = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
            if file.is_file():
                names = {getattr(node, "name", None) for node in ast.walk(tree(file))}
                rest = parts[length:]
                found.append(name if not rest or rest[0] in names or rest[0].isupper() else None)
                break
    assert len(found) > 15 and None not in found
