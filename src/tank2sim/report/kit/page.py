"""One self-contained HTML page of a result: key figures, tables and charts, for the screen and for paper.

The page fetches nothing: style, script and data are in it, and its content security policy forbids everything else. The
same content gives the same bytes.
"""

from __future__ import annotations

import functools
import importlib.metadata
import importlib.resources
import urllib.parse
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

import altair as alt
import jinja2
from markupsafe import Markup

from tank2sim import __version__
from tank2sim.escaping import json_in_html
from tank2sim.marks import marked
from tank2sim.native.library import kept
from tank2sim.report.kit.charts import VEGALITE_VERSION, chart_specification
from tank2sim.report.kit.numbers import NO_VALUE, format_column, format_number, is_number_text
from tank2sim.report.kit.theme import DARK, LIGHT, LOCALE


class Verdict(StrEnum):
    """What a figure means, in words; sign and colour only go with them."""

    NONE = ""
    PASSED = "passed"
    CAUTION = "caution"
    FAILED = "failed"


@dataclass(frozen=True, kw_only=True)
class KeyFigure:
    """A key figure, shown on a card at the top: `value` in `unit`; `note` is a few words under it.

    With a `limit` (largest value allowed, in `unit`), a bar shows the size of the value next to it.
    """

    label: str
    value: float | str
    unit: str = ""
    verdict: Verdict = Verdict.NONE
    note: str = ""
    limit: float | None = None

    @property
    def reach_percent(self) -> float:
        """Length of the bar, % of its room."""
        return self._percent(self.value)

    @property
    def limit_percent(self) -> float:
        """Place of the limit, % of the room of the bar."""
        return self._percent(self.limit)

    def _percent(self, value: float | str | None) -> float:
        sizes = [abs(size) for size in (self.value, self.limit) if isinstance(size, float | int)]
        largest = max(sizes, default=0.0)
        return round(100 * abs(value) / (_ROOM * largest), 1) if isinstance(value, float | int) and largest else 0.0


_ROOM = 1.15
"""Room of the bar of a key figure, over the larger of figure and limit. Project choice: both ends are seen."""


@dataclass(frozen=True, kw_only=True)
class Column:
    """Head of a column: its title, the unit of its numbers, and their significant digits."""

    title: str
    unit: str = ""
    digits: int = 4


_SHORT = 24
"""Characters of text in a table that are not broken into lines."""

_LONG = 10
"""Rows of a table from which on it is folded. Project choice: half a screen."""

_NOTES_SHOWN = 2
"""Notices of a section that are not folded. Project choice."""


@dataclass(frozen=True, kw_only=True)
class Link:
    """A cell that leads elsewhere: `path` is that of a file relative to the page, with slashes."""

    text: str
    path: str

    @property
    def address(self) -> str:
        """The path as a page has it: no character of a name means anything but itself."""
        return urllib.parse.quote(self.path)


Cell = float | int | bool | str | Verdict | Link | None


@dataclass(frozen=True, kw_only=True)
class PageTable:
    """A table. Cells are numbers in the unit of their column, text, verdicts, truth values or None (nothing known).

    Parameters
    ----------
    caption : str
    columns : sequence of Column
    rows : sequence of sequences
    folded : bool, optional
        Whether only the caption is seen until the reader opens the table; by default a long table is. On paper all
        are open.

    Raises
    ------
    ValueError
        A row has not as many cells as there are columns.
    """

    caption: str
    columns: Sequence[Column]
    rows: Sequence[Sequence[Cell]]
    folded: bool | None = None

    def __post_init__(self) -> None:
        for row in self.rows:
            if len(row) != len(self.columns):
                raise ValueError(f"table {self.caption!r}: {len(row)} cells in a row of {len(self.columns)} columns")


@dataclass(frozen=True, kw_only=True)
class Illustration:
    """A chart and what the reader should see in it; the chart's own title becomes the heading of its caption.

    Where the page is wide, two charts of `half` its width that follow each other are side by side.
    """

    chart: alt.TopLevelMixin
    caption: str = ""
    half: bool = False

    @property
    def title(self) -> str:
        """Title of the chart; empty if it has none."""
        title = getattr(self.chart, "title", "")
        text = getattr(title, "text", title)
        return text if isinstance(text, str) else ""


@dataclass(frozen=True, kw_only=True)
class PageSection:
    """A part of the page. An empty line in `text` starts a paragraph; `notes` are what the reader must not miss.

    Of a `folded` section only the heading is seen until the reader opens it; on paper it is open.
    """

    heading: str
    text: str = ""
    tables: Sequence[PageTable] = ()
    charts: Sequence[Illustration] = ()
    notes: Sequence[str] = ()
    folded: bool = False


def notices_section(notices: Sequence[str]) -> list[PageSection]:
    """Return the section with the notices of a result, empty without any."""
    return [PageSection(heading="Notices", notes=notices)] if notices else []


@dataclass(frozen=True, kw_only=True)
class Page:
    """All of a page, from top to bottom; everything is plain text, never HTML.

    `verdict` is the result in a sentence.
    """

    title: str
    subtitle: str = ""
    verdict: str = ""
    figures: Sequence[KeyFigure] = ()
    sections: Sequence[PageSection] = ()


def render_page(page: Page) -> str:
    """The page as one HTML file, about 1 MB and its data. It opens without a network and can be printed."""
    counter = _Counter()
    marks = marked(_messages(page))
    sections = [_section(section, counter, marks) for section in page.sections]
    sections = [section for section in sections if _has_content(section)]
    specifications = [chart["specification"] for section in sections for chart in section["charts"]]
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("tank2sim", "report"), autoescape=True, undefined=jinja2.StrictUndefined
    )
    environment.trim_blocks = environment.lstrip_blocks = True
    environment.filters["paragraphs"] = _paragraphs
    return environment.get_template("kit/page.html.j2").render(
        page=page,
        marks=marks,
        notes_shown=_NOTES_SHOWN,
        cards_across=_cards_across(len(page.figures)),
        figures=[(figure, _shown(figure.value)) for figure in page.figures],
        sections=sections,
        version=__version__,
        style=Markup(resource_text("kit/page.css")),
        script=Markup(resource_text("kit/page.js")),
        library=Markup(_vega()) if specifications else None,
        drawings=json_in_html({"light": LIGHT, "dark": DARK, "locale": LOCALE, "charts": specifications}),
    )


def _has_content(section: dict[str, Any]) -> bool:
    """Whether anything is left in a section whose notices are at the top of the page."""
    return bool(section["notes"] or section["tables"] or section["charts"] or section["content"].text)


def _messages(page: Page) -> Iterable[str]:
    """The notes of all sections, and the cells of their tables that are text."""
    for section in page.sections:
        yield from section.notes
        for table in section.tables:
            yield from (cell for row in table.rows for cell in row if isinstance(cell, str))


def _cards_across(count: int) -> int:
    # As many as leave the fewest gaps in the last row.
    return max(3, count) if count <= 5 else min((4, 5, 3), key=lambda across: -count % across)


class _Counter:
    """Numbers of figures and tables, from 1 through the whole page."""

    def __init__(self) -> None:
        self.charts = self.tables = 0

    def next_chart(self) -> int:
        self.charts += 1
        return self.charts

    def next_table(self) -> int:
        self.tables += 1
        return self.tables


def _section(section: PageSection, counter: _Counter, marks: Sequence[str]) -> dict[str, Any]:
    """The parts of a section; notices that mark the whole page are at its top, and not repeated."""
    return {
        "content": section,
        "notes": [note for note in section.notes if note not in marks],
        "tables": [_table(table, counter.next_table()) for table in section.tables],
        "charts": [_chart(illustration, counter.next_chart()) for illustration in section.charts],
    }


def _table(table: PageTable, number: int) -> dict[str, Any]:
    columns = [_column(column, [row[place] for row in table.rows]) for place, column in enumerate(table.columns)]
    return {
        "number": number,
        "caption": table.caption,
        "folded": len(table.rows) > _LONG if table.folded is None else table.folded,
        "columns": columns,
        "rows": [[column["cells"][place] for column in columns] for place in range(len(table.rows))],
    }


def _column(column: Column, cells: Sequence[Cell]) -> dict[str, Any]:
    numbers: list[Any] = [cell for cell in cells if is_number_text(cell)]
    texts = iter(format_column(numbers, column.digits))
    shown = [
        {
            "text": next(texts) if is_number_text(cell) else _shown(cell),
            "verdict": cell if isinstance(cell, Verdict) else "",
            "address": cell.address if isinstance(cell, Link) else "",
        }
        for cell in cells
    ]
    longest = max((len(cell["text"]) for cell in shown), default=0)
    kind = "number" if numbers else "short" if longest <= _SHORT else ""
    return {"head": column, "kind": kind, "cells": shown}


def _shown(cell: Cell) -> str:
    if cell is None:
        return NO_VALUE
    if isinstance(cell, str):
        return str(cell)
    if isinstance(cell, Link):
        return cell.text
    if is_number_text(cell):
        return format_number(cell)
    return "yes" if cell else "no"


def _chart(illustration: Illustration, number: int) -> dict[str, Any]:
    specification = chart_specification(illustration.chart)
    title = specification.pop("title", "")
    heading, subtitle = (title.get("text", ""), title.get("subtitle", "")) if isinstance(title, dict) else (title, "")
    return {
        "number": number,
        "heading": heading,
        "caption": " ".join(text for text in (subtitle, illustration.caption) if text),
        "description": specification.get("description", heading),
        "half": illustration.half,
        "switch": any(
            "bind" in parameter for parameter in specification.get("params", ()) if "select" not in parameter
        ),
        "moves": any("select" in parameter for parameter in specification.get("params", ())),
        "specification": specification,
    }


def _paragraphs(text: str) -> Iterable[str]:
    return [part.strip() for part in text.split("\n\n") if part.strip()]


def resource_text(name: str) -> str:
    """Return the text of a file of the package ``tank2sim.report``."""
    return importlib.resources.files("tank2sim.report").joinpath(name).read_text(encoding="utf-8")


@functools.cache
def _vega() -> str:
    """The library that draws the charts of a page; made once on a machine, for that takes a second."""
    making = "vl-convert", importlib.metadata.version("vl-convert-python"), VEGALITE_VERSION, _SNIPPET
    return kept({}, making, ".js", _make_vega).read_text(encoding="utf-8")


_SNIPPET = "window.vegaEmbed = vegaEmbed;"


def _make_vega(folder: Path) -> Path:
    import vl_convert

    bundle: str = vl_convert.javascript_bundle(_SNIPPET, vl_version=VEGALITE_VERSION)
    bundle = f"(() => {{{bundle}}})();"  # its hundreds of short names stay its own
    path = folder / "vega.js"
    path.write_text(bundle.replace("</script", "<\\/script").replace("<!--", "<\\!--"), encoding="utf-8", newline="\n")
    return path
