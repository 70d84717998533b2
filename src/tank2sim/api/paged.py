"""Results with a page of their own, whose charts are those of the page."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable
from typing import TYPE_CHECKING

from tank2sim.api.result import Result

if TYPE_CHECKING:
    import altair as alt

    from tank2sim.report.kit.page import Page, PageSection


class PagedResult(Result):
    """A result with a page of its own."""

    @abstractmethod
    def layout(self) -> Page:
        """Sections, tables and charts of the page."""

    def charts(self) -> dict[str, alt.TopLevelMixin]:
        """Charts of the page by their titles."""
        return charts_of(self.layout().sections)

    def page(self) -> str:
        """As :meth:`.Result.page`."""
        from tank2sim.report.kit.page import render_page

        return render_page(self.layout())


def charts_of(sections: Iterable[PageSection]) -> dict[str, alt.TopLevelMixin]:
    """Charts of the sections of a page by their titles; of those without by the headings."""
    found: dict[str, alt.TopLevelMixin] = {}
    for section in sections:
        for illustration in section.charts:
            name = illustration.title or section.heading
            found[f"{name} ({len(found) + 1})" if name in found else name] = illustration.chart
    return found
