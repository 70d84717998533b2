"""A chart as a whole specification, as a picture, and as an object of Altair.

A chart is defined once and is drawn the same in a picture (:func:`chart_png`) and in a page
(:mod:`tank2sim.answer.page`). It states what is drawn; the looks are defined in :mod:`tank2sim.answer.charts.theme`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from tank2sim.answer.charts.theme import LIGHT, LOCALE
from tank2sim.answer.charts.vega import ChartRecord, ChartSpec

if TYPE_CHECKING:
    import altair as alt

VEGALITE_VERSION = "6.4"
"""Version of Vega-Lite in which charts are written and drawn: the newest of vl-convert 1.9, and Altair 6.3's."""

CHECKED_AGAINST_SCHEMA = False
"""Whether each chart is compared with the schema of Vega-Lite. No chart's form depends on what a user gives: the tests
of the pages set this, and a page is not delayed by it."""


def chart_specification(chart: ChartSpec | alt.TopLevelMixin) -> ChartSpec:
    """The Vega-Lite specification of a chart, without its looks; the same chart gives the same specification."""
    if isinstance(chart, dict):
        named: dict[int, tuple[str, list[ChartRecord]]] = {}
        specification: ChartSpec = {"$schema": f"https://vega.github.io/schema/vega-lite/v{VEGALITE_VERSION}.json"}
        specification |= _with_named_data(chart, named)
        specification["datasets"] = dict(named.values())
    else:
        specification = chart.to_dict(validate=CHECKED_AGAINST_SCHEMA)
        specification.pop("config", None)
    if CHECKED_AGAINST_SCHEMA:
        from altair.vegalite.v6.schema.core import Root

        Root.validate(specification | {"datasets": {}})
    return specification


def _with_named_data(part: Any, named: dict[int, tuple[str, list[ChartRecord]]]) -> Any:
    """A part of a chart whose rows have a name: layers of the same rows share them."""
    if isinstance(part, list):
        return [_with_named_data(each, named) for each in part]
    if not isinstance(part, dict):
        return part
    found = {name: _with_named_data(each, named) for name, each in part.items() if name != "data"}
    if data := part.get("data"):
        rows = data["values"]
        found["data"] = {"name": named.setdefault(id(rows), (f"rows_{len(named)}", list(rows)))[0]}
    return found


def altair_chart(chart: ChartSpec | alt.TopLevelMixin) -> alt.TopLevelMixin:
    """The chart as an object of Altair, which a user can change."""
    if not isinstance(chart, dict):
        return chart
    import altair as alt

    specification = chart_specification(chart)
    rows = specification.pop("datasets")
    kinds = {
        "layer": alt.LayerChart,
        "vconcat": alt.VConcatChart,
        "hconcat": alt.HConcatChart,
        "concat": alt.ConcatChart,
        "facet": alt.FacetChart,
    }
    kind = next((kind for name, kind in kinds.items() if name in specification), alt.Chart)
    made = kind.from_dict(specification, validate=False)
    made["datasets"] = rows
    return made


class AltairCharts(Mapping[str, "alt.TopLevelMixin"]):
    """Charts by name as objects of Altair, each made when it is first asked for: that takes a quarter of a second.

    `charts`: chart by its name.
    """

    def __init__(self, charts: Mapping[str, ChartSpec | alt.TopLevelMixin]):
        self._charts, self._made = charts, dict[str, "alt.TopLevelMixin"]()

    def __getitem__(self, name: str) -> alt.TopLevelMixin:
        """The chart of this name."""
        if name not in self._made:
            self._made[name] = altair_chart(self._charts[name])
        return self._made[name]

    def __iter__(self) -> Iterator[str]:
        """Names of the charts."""
        return iter(self._charts)

    def __len__(self) -> int:
        """Number of charts."""
        return len(self._charts)


def chart_picture(chart: ChartSpec | alt.TopLevelMixin, ending: str = ".png") -> bytes:
    """The chart as a picture on white; needs no network and no browser.

    `ending`: ``.svg`` or ``.pdf``; else it is a PNG.
    """
    import vl_convert

    if ending.lower() == ".svg":
        return str(vl_convert.vegalite_to_svg(chart_specification(chart), **_HOW)).encode()
    if ending.lower() == ".pdf":
        return bytes(vl_convert.vegalite_to_pdf(chart_specification(chart), **_HOW))
    return chart_png(chart)


def chart_png(chart: ChartSpec | alt.TopLevelMixin, *, scale: float = 2.0) -> bytes:
    """The chart as a PNG picture on white, `scale` pixels to each px of its size. Needs no network and no browser."""
    import vl_convert

    picture: bytes = vl_convert.vegalite_to_png(chart_specification(chart), scale=scale, **_HOW)
    return picture


_HOW: dict[str, Any] = {
    "vl_version": VEGALITE_VERSION,
    "config": LIGHT,
    "format_locale": LOCALE,
    "allowed_base_urls": [],
}
