"""Base of the results of the API, which print, draw and write themselves as JSON, picture and page."""

from __future__ import annotations

import base64
import html
import re
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from tank2sim.api.bounds import checked
from tank2sim.files import json_text, plain_json, schema_name, write_together
from tank2sim.marks import marked

if TYPE_CHECKING:
    import altair as alt
    import pandas as pd

    from tank2sim.report.kit.page import Page, PageSection

REPR_ROWS = 20
"""Rows of a table in ``repr``: with its heading it fits a screen of 24 lines. Project choice."""


@dataclass(frozen=True)
class ResultTable:
    """A table of a result.

    Parameters
    ----------
    title : str
    columns : tuple of str
        Heads, units in brackets.
    rows : sequence of sequences
        Cells: numbers, text, truth values, lists of numbers, or None where there is no value.
    notes : tuple of str
        Sentences under the table.
    wide : bool
        Names in it are never broken on the screen, however wide it becomes.
    """

    title: str
    columns: tuple[str, ...]
    rows: Sequence[Sequence[object]]
    notes: tuple[str, ...] = ()
    wide: bool = False

    @property
    def df(self) -> pd.DataFrame:
        """The table as a data frame."""
        import pandas as pd

        return pd.DataFrame(self.rows, columns=list(self.columns))

    @property
    def text(self) -> str:
        """The table as text, at most :data:`REPR_ROWS` rows; numbers with five digits."""
        import pandas as pd

        cells = [[cell_text(cell) for cell in row] for row in self.rows[:REPR_ROWS]]
        lines = [self.title, pd.DataFrame(cells, columns=list(self.columns)).to_string(index=False)]
        omitted = len(self.rows) - REPR_ROWS
        return "\n".join(lines + ([f"... {omitted} more rows in .tables"] if omitted > 0 else []))


def cell_text(value: object) -> str:
    """A value as tables show it: numbers with five digits, ``-`` for None."""
    match value:
        case None:
            return "-"
        case bool():
            return "yes" if value else "no"
        case float():
            return f"{value:.5g}"
        case list():
            return ", ".join(cell_text(item) for item in value)
        case _:
            return str(value)


class Result(ABC):
    """Result of a call of the API; every command of the command line prints and writes one."""

    command: ClassVar[str]
    """Command that gives the same result on the command line; its name is in :attr:`schema`."""

    notices: tuple[str, ...]
    """Limits of the result, one sentence each."""

    @abstractmethod
    def content(self) -> Mapping[str, object]:
        """The content of the JSON, without its ``schema``; keys carry units (``advance_m``)."""

    @property
    @abstractmethod
    def headline(self) -> tuple[str, ...]:
        """One or a few sentences with the main findings."""

    @property
    @abstractmethod
    def tables(self) -> tuple[ResultTable, ...]:
        """Tables that the command line prints."""

    @property
    def schema(self) -> str:
        """Name and version of the JSON's schema, for example ``tank2sim/simulate/1``."""
        return schema_name(self.command)

    def to_dict(self) -> dict[str, object]:
        """The result as JSON values: lists for arrays, None for what is not a finite number."""
        plain: dict[str, object] = plain_json({"schema": self.schema, **self.content()})
        return plain

    @checked
    def to_json(self, path: str | Path | None = None, **keys: object) -> str:
        """Return the result as JSON text, also written to `path`; `keys` are added at its end.

        Raises
        ------
        InputError
            The file cannot be written.
        """
        text = json_text({**self.to_dict(), **keys})
        if path is not None:
            write_together({Path(path): text})
        return text

    def charts(self) -> dict[str, alt.TopLevelMixin]:
        """Charts of the result by name, the main one first; empty where the command draws none."""
        return {}

    @checked
    def plot(self, path: str | Path | None = None, name: str | None = None) -> alt.TopLevelMixin:
        """One chart of the result (Altair), also written to `path` as PNG, SVG or PDF, by its ending.

        Parameters
        ----------
        path : path, optional
        name : str, optional
            One of :meth:`charts`; by default the main one.

        Raises
        ------
        InputError
            The file cannot be written.
        LookupError
            The chart does not exist.
        """
        charts = self.charts()
        if not charts or (name is not None and name not in charts):
            raise LookupError(
                f"no chart {name or ''} of {type(self).__name__}; there are: {', '.join(charts) or 'none'}"
            )
        chart = charts[name] if name is not None else next(iter(charts.values()))
        if path is not None:
            write_together({Path(path): self.picture(name, ending=Path(path).suffix)})
        return chart

    def picture(self, name: str | None = None, *, ending: str = ".png") -> bytes:
        """One chart of the result as PNG, or as SVG or PDF if that is the `ending` of its file's name."""
        from tank2sim.report.kit.charts import chart_picture

        return chart_picture(self.plot(name=name), ending)

    def layout(self) -> Page:
        """Return sections, tables and charts of the page, made from :meth:`to_dict` alone.

        Raises
        ------
        InputError
            The result cannot be drawn.
        """
        from tank2sim.report.results.page import result_page

        return result_page(self.to_dict(), f"tank2sim {self.command}")

    def page(self) -> str:
        """Return the page of the result: self-contained HTML. Raises as :meth:`layout`."""
        from tank2sim.report.kit.page import render_page

        return render_page(self.layout())

    @checked
    def to_html(self, path: str | Path) -> None:
        """Write :meth:`page` to a file."""
        write_together({Path(path): self.page()})

    @property
    def marks(self) -> tuple[str, ...]:
        """Notices that mark the result as one that its data do not carry."""
        return tuple(marked(self.notices))

    def __repr__(self) -> str:
        return "\n".join([*self.marks, *self.headline, *(table.text for table in self.tables[:1])])

    def _repr_html_(self) -> str:
        parts = [f"<p>{html.escape(line)}</p>" for line in (*self.marks, *self.headline)]
        if self.charts():
            picture = base64.b64encode(self.picture()).decode("ascii")
            parts.append(f'<img alt="{html.escape(" ".join(self.headline))}" src="data:image/png;base64,{picture}">')
        parts += [
            f"<p>{html.escape(table.title)}</p>{table.df.to_html(index=False, na_rep='')}" for table in self.tables
        ]
        return "\n".join(parts)


class PagedResult(Result):
    """A result whose charts are those of its page."""

    def charts(self) -> dict[str, alt.TopLevelMixin]:
        """Charts of the page by their titles."""
        return charts_of(self.layout().sections)


def charts_of(sections: Iterable[PageSection]) -> dict[str, alt.TopLevelMixin]:
    """Return the charts of the sections of a page by their titles; those without a title by the headings."""
    charts: dict[str, alt.TopLevelMixin] = {}
    for section in sections:
        for illustration in section.charts:
            name = illustration.title or section.heading
            charts[f"{name} ({len(charts) + 1})" if name in charts else name] = illustration.chart
    return charts


def section_charts(sections: Iterable[PageSection]) -> dict[str, alt.TopLevelMixin]:
    """Charts of sections of a page by the words of their heading, numbered from the second on: ``speeds_2``."""
    charts: dict[str, alt.TopLevelMixin] = {}
    for section in sections:
        stem = re.sub(r"\W+", "_", section.heading.lower()).strip("_")
        for illustration in section.charts:
            number = sum(re.fullmatch(rf"{stem}(_\d+)?", name) is not None for name in charts) + 1
            charts[stem if number == 1 else f"{stem}_{number}"] = illustration.chart
    return charts
