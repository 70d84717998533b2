"""Base of the results that are not yet declared by a study and sections."""

from __future__ import annotations

import re
from abc import abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from tank2sim.answer.parts import Section, Table, table
from tank2sim.answer.result import Result
from tank2sim.files import plain_json

if TYPE_CHECKING:
    import altair as alt

    from tank2sim.answer.page import Page


def screen_table(
    title: str,
    columns: Sequence[str],
    rows: Iterable[Sequence[Any]],
    notes: Sequence[str] = (),
    wide: bool = False,
) -> Table:
    """A table of a result that is not yet declared by sections.

    Parameters
    ----------
    title, columns, rows, notes, wide
        As of :class:`.Table`, with heads as text.
    """
    return replace(table(title, columns, rows, *notes, digits=5), wide=wide)


class OldResult(Result[Any]):
    """A result that writes its JSON, tables and page by itself."""

    notices: tuple[str, ...] = ()
    sections = ()

    @property
    def title(self) -> str:
        """None: the page has it."""
        return ""

    @abstractmethod
    def content(self) -> Mapping[str, object]:
        """The content of the JSON, without its ``schema``; keys carry units (``advance_m``)."""

    @property
    @abstractmethod
    def tables(self) -> tuple[Table, ...]:
        """Tables that the command line prints."""

    def to_dict(self) -> dict[str, Any]:
        """As :meth:`.Result.to_dict`."""
        plain: dict[str, Any] = plain_json({"schema": self.schema, **self.content()})
        return plain

    def charts(self) -> dict[str, alt.TopLevelMixin]:
        """As :meth:`.Result.charts`; none."""
        return {}

    def layout(self) -> Page:
        """Return sections, tables and charts of the page, made from :meth:`to_dict` alone.

        Raises
        ------
        InputError
            The result cannot be drawn.
        """
        from tank2sim.report.results.page import result_page

        return result_page(self.to_dict(), f"tank2sim {self.command}")


class PagedResult(OldResult):
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
