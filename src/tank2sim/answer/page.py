"""One self-contained HTML page of a result: key figures, tables and charts, for the screen and for paper.

The page fetches nothing: style, script and data are in it, and its content security policy forbids everything else. The
same content gives the same bytes.
"""

from __future__ import annotations

import functools
import importlib.metadata
import importlib.resources
import itertools
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup

from tank2sim.answer.charts.picture import VEGALITE_VERSION, chart_specification
from tank2sim.answer.charts.theme import DARK, LIGHT, LOCALE
from tank2sim.answer.numbers import NO_VALUE, format_column, format_number, is_number_text
from tank2sim.answer.parts import Cell, Column, Illustration, KeyFigure, Link, Section, Table, Verdict
from tank2sim.escaping import json_in_html
from tank2sim.native.library import kept
from tank2sim.notices import foremost
from tank2sim.version import __version__

_SHORT = 24
"""Characters of text in a table that are not broken into lines."""

_LONG = 10
"""Rows of a table from which on it is folded. Project choice: half a screen."""

_NOTES_SHOWN = 2
"""Notices of a section that are not folded. Project choice."""


@dataclass(frozen=True, kw_only=True)
class Page:
    """All of a page, from top to bottom; everything is plain text, never HTML.

    `verdict` is the result in a sentence.
    """

    title: str
    subtitle: str = ""
    verdict: str = ""
    figures: Sequence[KeyFigure] = ()
    sections: Sequence[Section] = ()


def render_page(page: Page) -> str:
    """The page as one HTML file, about 1 MB and its data. It opens without a network and can be printed."""
    numbers = {"chart": itertools.count(1), "table": itertools.count(1)}
    cautions = foremost(_messages(page))
    sections = [_section(section, numbers) for section in page.sections]
    # A section whose notices are at the top of the page may have nothing left.
    sections = list(filter(_has_content, sections))
    specifications = [chart["specification"] for section in sections for chart in section["charts"]]
    return filled_template(
        "answer/page.html.j2",
        page=page,
        cautions=[notice.line for notice in cautions],
        notes_shown=_NOTES_SHOWN,
        cards_across=_cards_across(len(page.figures)),
        figures=[(figure, _shown(figure.value)) for figure in page.figures],
        sections=sections,
        style=Markup(resource_text("answer/page.css")),
        script=Markup(resource_text("answer/page.js")),
        library=Markup(_vega()) if specifications else None,
        drawings=json_in_html({"light": LIGHT, "dark": DARK, "locale": LOCALE, "charts": specifications}),
    )


def filled_template(path: str, **content: object) -> str:
    """Return a template of the package (``"answer/page.html.j2"``) with its content, which is escaped, and the version.

    Parameters
    ----------
    path : str
    **content
        Values by their names in the template.
    """
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("tank2sim", ""), autoescape=True, undefined=jinja2.StrictUndefined
    )
    environment.trim_blocks = environment.lstrip_blocks = True
    environment.filters["paragraphs"] = _paragraphs
    return environment.get_template(path).render(version=__version__, **content)


def _has_content(section: Mapping[str, Any]) -> bool:
    return bool(section["notes"] or section["tables"] or section["charts"] or section["content"].text)


def _messages(page: Page) -> Iterable[object]:
    """The notes of all sections and tables, and the cells of tables."""
    for section in page.sections:
        yield from section.notes
        for table in section.tables:
            yield from table.notes
            yield from (cell for row in table.rows for cell in row)


def _cards_across(count: int) -> int:
    # As many as leave the fewest gaps in the last row.
    return max(3, count) if count <= 5 else min((4, 5, 3), key=lambda across: -count % across)


def _section(section: Section, numbers: Mapping[str, Iterator[int]]) -> dict[str, Any]:
    """The parts of a section; cautions are at the top of the page, and not repeated."""
    return {
        "content": section,
        "notes": _without_cautions(section.notes),
        "tables": [_table(table, next(numbers["table"])) for table in section.tables],
        "charts": [_chart(illustration, next(numbers["chart"])) for illustration in section.charts],
    }


def _without_cautions(notes: Sequence[str]) -> list[str]:
    return [note for note in notes if not foremost([note])]


def _table(table: Table, number: int) -> dict[str, Any]:
    columns = [_column(column, [row[place] for row in table.rows]) for place, column in enumerate(table.columns)]
    return {
        "number": number,
        "caption": table.caption,
        "folded": len(table.rows) > _LONG if table.folded is None else table.folded,
        "columns": columns,
        "rows": [[column["cells"][place] for column in columns] for place in range(len(table.rows))],
        "notes": _without_cautions(table.notes),
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
    if isinstance(cell, list):
        return ", ".join(map(_shown, cell)) or NO_VALUE
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
    """Return the text of a file of the package, for example ``answer/page.css``."""
    return importlib.resources.files("tank2sim").joinpath(name).read_text(encoding="utf-8")


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
