"""Modules import without circles, and rooms only from their own layer or a lower one (docs/developer/index.md)."""

from __future__ import annotations

import ast
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

from .conftest import ROOT
from .sources import tree

SOURCES = ROOT / "src"

LAYERS: tuple[frozenset[str], ...] = (
    frozenset({"native"}),  # and the modules that are in no room: arrays, errors, files, units ...
    frozenset({"cards", "records"}),
    frozenset({"dynamics"}),
    frozenset({"simulation"}),
    frozenset({"identification", "analysis"}),
    frozenset({"gap", "fmu"}),
    frozenset({"answer"}),
    frozenset({"results"}),
    frozenset({"api"}),
    frozenset({"apps"}),
    frozenset({"cli"}),
)
"""Rooms from the lowest layer up; rooms of one layer import each other in one direction (docs/test_architecture.py)."""

KNOWN_CIRCLES: tuple[set[str], ...] = ()
"""Modules of ``api`` that still import each other."""

KNOWN_ARROWS: set[tuple[str, str]] = set()
"""Imports from a higher layer that remain."""


def modules(sources: Path) -> dict[str, Path]:
    """Dotted name of each module and package to its file, without the front page (with Ship) and __main__."""
    found = {}
    for path in sources.rglob("*.py"):
        parts = path.relative_to(sources).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return {
        name: path for name, path in found.items() if name not in ("tank2sim", "tank2sim.ship", "tank2sim.__main__")
    }


def imported(module: ast.AST, names: dict[str, Path]) -> set[str]:
    """The modules that a module imports, inside functions and for types, too."""
    found = set()
    for node in ast.walk(module):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.module and not node.level, "imports are absolute"
            members = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= {member if member in names else node.module for member in members}
    return found & names.keys()


def imports(sources: Path) -> dict[str, set[str]]:
    names = modules(sources)
    return {name: imported(tree(path), names) - {name} for name, path in names.items()}


def is_known(name: str, other: str) -> bool:
    circles = ({f"tank2sim.api.{module}" for module in circle} for circle in KNOWN_CIRCLES)
    return (name, other) in KNOWN_ARROWS or any({name, other} <= circle for circle in circles)


def room(module: str) -> str:
    """Room of a module; a module in none has its own name."""
    return module.split(".")[1]


def layer(module: str) -> int:
    return next((number for number, rooms in enumerate(LAYERS) if room(module) in rooms), 0)


@pytest.fixture(scope="module")
def graph() -> dict[str, set[str]]:
    """Each module with its imports, without the known exceptions."""
    return {name: {other for other in others if not is_known(name, other)} for name, others in imports(SOURCES).items()}


def test_no_module_imports_itself_through_others(graph: dict[str, set[str]]) -> None:
    assert len(graph) > 250
    TopologicalSorter(graph).prepare()


def test_no_module_imports_from_a_higher_layer(graph: dict[str, set[str]]) -> None:
    up = {(name, other) for name, others in graph.items() for other in others if layer(other) > layer(name)}
    assert up == set()


def test_the_rooms_of_the_gap_import_each_other_in_one_direction(graph: dict[str, set[str]]) -> None:
    rooms: dict[str, set[str]] = {}
    for name, others in graph.items():
        parts = [module.split(".")[2] for module in (name, *others) if module.startswith("tank2sim.gap.")]
        if name.startswith("tank2sim.gap."):
            rooms.setdefault(parts[0], set()).update(set(parts[1:]) - {parts[0]})
    assert {"inference", "diagnosis", "search", "proof", "outcome"} <= rooms.keys()
    TopologicalSorter(rooms).prepare()


def test_every_folder_has_its_layer() -> None:
    folders = {path.parent.name for path in (SOURCES / "tank2sim").glob("*/__init__.py")}
    assert folders <= frozenset().union(*LAYERS)


@pytest.mark.parametrize(
    "text", ["from tank2sim.a.b import c", "def f():\n    import tank2sim.a.b"], ids=["module", "function"]
)
def test_a_circle_is_found_wherever_it_is_closed(tmp_path: Path, text: str) -> None:
    folder = tmp_path / "tank2sim" / "a"
    folder.mkdir(parents=True)
    (folder / "b.py").write_text("import tank2sim.a.c")
    (folder / "c.py").write_text(text)
    with pytest.raises(CycleError):
        TopologicalSorter(imports(tmp_path)).prepare()
