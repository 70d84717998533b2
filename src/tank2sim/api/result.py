"""Base of the results of the API, which print, draw and write themselves as JSON, picture and page."""

from __future__ import annotations

import base64
import html
import re
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from tank2sim.answer.parts import Table, table
from tank2sim.api.bounds import checked
from tank2sim.files import json_text, plain_json, schema_name, write_together
from tank2sim.marks import marked

if TYPE_CHECKING:
    import altair as alt

    from tank2sim.answer.page import Page
    from tank2sim.answer.parts import Section


def screen_table(
    title: str,
    columns: Sequence[str],
    rows: Iterable[Sequence[Any]],
    notes: Sequence[str] = (),
    wide: bool = False,
) -> Table:
    """A table of a result that is not yet declared by sections."""
    return replace(table(title, columns, rows, *notes), wide=wide)


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
    def tables(self) -> tuple[Table, ...]:
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
        from tank2sim.answer.charts.picture import chart_picture

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
        from tank2sim.answer.page import render_page

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
            f"<p>{html.escape(table.caption)}</p>{table.df.to_html(index=False, na_rep='')}" for table in self.tables
        ]
        return "\n".join(parts)


class PagedResult(Result):
    """A result whose charts are those of its page."""

    def charts(self) -> dict[str, alt.TopLevelMixin]:
        """Charts of the page by their titles."""
        return charts_of(self.layout().sections)


def charts_of(sections: Iterable[Section]) -> dict[str, alt.TopLevelMixin]:
    """Return the charts of the sections of a page by their titles; those without a title by the headings."""
    charts: dict[str, alt.TopLevelMixin] = {}
    for section in sections:
        for illustration in section.charts:
            name = illustration.title or section.heading
            charts[f"{name} ({len(charts) + 1})" if name in charts else name] = illustration.chart
    return charts


def section_charts(sections: Iterable[Section]) -> dict[str, alt.TopLevelMixin]:
    """Charts of sections of a page by the words of their heading, numbered from the second on: ``speeds_2``."""
    charts: dict[str, alt.TopLevelMixin] = {}
    for section in sections:
        stem = re.sub(r"\W+", "_", section.heading.lower()).strip("_")
        for illustration in section.charts:
            number = sum(re.fullmatch(rf"{stem}(_\d+)?", name) is not None for name in charts) + 1
            charts[stem if number == 1 else f"{stem}_{number}"] = illustration.chart
    return charts
