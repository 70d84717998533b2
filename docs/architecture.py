"""The picture of the architecture, drawn from the imports of the packages as the manual is built.

A page asks for it by ``<!-- picture: architecture -->``, and for the table of packages by ``<!-- packages -->``. A
package is in the layer above the highest of those that it imports; imports in a circle are an error.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

from sphinx.application import Sphinx

SOURCES = Path(__file__).parents[1] / "src" / "tank2sim"
BOX, ROW, COLUMN = (150, 30), 62, 190  # width and height of a box, distance of rows and columns

Imports = Mapping[str, frozenset[str]]


@cache
def package_imports() -> dict[str, frozenset[str]]:
    """The packages that each package of tank2sim imports, anywhere in its modules."""
    packages = {path.parent.name for path in SOURCES.glob("*/__init__.py")}
    found = {name: frozenset(_imported(SOURCES / name)) & packages - {name} for name in sorted(packages)}
    return {name: frozenset(below) for name, below in found.items()}


def layers(imports: Imports) -> list[list[str]]:
    """The packages by layer, the lowest first; CycleError if imports go in a circle."""
    height: dict[str, int] = {}
    for name in TopologicalSorter({name: set(below) for name, below in imports.items()}).static_order():
        height[name] = 1 + max((height[other] for other in imports[name]), default=-1)
    return [sorted(name for name in imports if height[name] == level) for level in range(max(height.values()) + 1)]


def direct(imports: Imports) -> dict[str, list[str]]:
    """The imports to be drawn: without those that a chain of others has already."""

    def below(name: str) -> set[str]:
        return set(imports[name]).union(*(below(other) for other in imports[name]))

    return {
        name: [one for one in sorted(used) if not any(one in below(o) for o in used)] for name, used in imports.items()
    }


def architecture() -> str:
    """Packages as boxes in layers, the highest at the top; arrows go down to what a package imports."""
    rows = layers(package_imports())[::-1]
    wide = max(map(len, rows))
    place = {
        name: ((column - (len(row) - 1) / 2) * COLUMN, level * ROW)
        for level, row in enumerate(rows)
        for column, name in enumerate(row)
    }
    arrows = [
        _arrow(place[upper], place[lower]) for upper, lowers in direct(package_imports()).items() for lower in lowers
    ]
    boxes = [_box(name, *place[name]) for name in place]
    # Arrows over more than one layer go round the boxes between, on the right.
    view = f"{-wide * COLUMN / 2:g} -24 {wide * COLUMN + 60:g} {len(rows) * ROW:g}"
    head = f'<svg class="architecture" viewBox="{view}" role="img" aria-label="Packages of tank2sim in their layers.">'
    tip = '<defs><marker id="tip" orient="auto" refX="7" refY="4" markerWidth="8" markerHeight="8">'
    return "\n".join([head, f'{tip}<path d="M0 0L8 4L0 8Z"/></marker></defs>', *arrows, *boxes, "</svg>"])


def package_table() -> str:
    """What each package is for, by the first sentence of its docstring, the highest layer first."""
    rows = []
    for row in layers(package_imports())[::-1]:
        for name in row:
            text = ast.get_docstring(ast.parse((SOURCES / name / "__init__.py").read_text(encoding="utf-8"))) or ""
            rows.append(f"| `{name}` | {_plain(text)} |")
    return "\n".join(["| package | what it is for |", "|---|---|", *rows])


def _plain(docstring: str) -> str:
    line = docstring.splitlines()[0].replace("``", "`").replace(":func:", "")
    return line.rstrip(".")


def _imported(folder: Path) -> Iterator[str]:
    for path in folder.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom) and not node.level:
                names = [f"{node.module}.{alias.name}" for alias in node.names]
            else:
                continue
            yield from (name.split(".")[1] for name in names if name.startswith("tank2sim."))


def _box(name: str, x: float, y: float) -> str:
    width, height = BOX
    rectangle = f'<rect x="{x - width / 2:g}" y="{y - height / 2:g}" width="{width}" height="{height}" rx="5"/>'
    return f'{rectangle}<text x="{x:g}" y="{y + 5:g}" text-anchor="middle">{name}</text>'


def _arrow(upper: tuple[float, float], lower: tuple[float, float]) -> str:
    (x1, y1), (x2, y2) = upper, lower
    width, height = BOX
    if y2 - y1 <= ROW:
        return f'<path class="arrow" d="M{x1:g} {y1 + height / 2:g}L{x2:g} {y2 - height / 2 - 1:g}"/>'
    side = max(x1, x2) + width / 2 + 14 * (y2 - y1) / ROW
    bend = f"C{side:g} {y1:g} {side:g} {y2:g} {x2 + width / 2 + 1:g} {y2:g}"
    return f'<path class="arrow" d="M{x1 + width / 2:g} {y1:g}{bend}"/>'


def _fill(app: Sphinx, page: str, source: list[str]) -> None:
    for mark, made in (("<!-- picture: architecture -->", architecture), ("<!-- packages -->", package_table)):
        if mark in source[0]:
            source[0] = source[0].replace(mark, made())


def setup(app: Sphinx) -> dict[str, bool]:
    """Draw as pages are read."""
    app.connect("source-read", _fill)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
