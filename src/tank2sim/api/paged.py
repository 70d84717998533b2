"""Results whose charts are those of their page."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from tank2sim.api.result import Result

if TYPE_CHECKING:
    import altair as alt

    from tank2sim.report.kit.page import PageSection


class PagedResult(Result):
    """A result whose charts are those of its page."""

    def charts(self) -> dict[str, alt.TopLevelMixin]:
        """Charts of the page by their titles."""
        return charts_of(self.layout().sections)


def charts_of(sections: Iterable[PageSection]) -> dict[str, alt.TopLevelMixin]:
    """Charts of the sections of a page by their titles; of those without by the headings."""
    found: dict[str, alt.TopLevelMixin] = {}
    for section in sections:
        for illustration in section.charts:
            name = illustration.title or section.heading
            found[f"{name} ({len(found) + 1})" if name in found else name] = illustration.chart
    return found
