"""Charts as Vega-Lite writes them: dictionaries of layers, panels, axes and rules.

A chart that shows thousands of numbers is made in milliseconds so; :func:`tank2sim.answer.charts.picture.altair_chart`
makes an Altair object of it for those who want to change it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

ChartRecord = dict[str, Any]
"""One row of the data of a chart."""

ChartSpec = dict[str, Any]
"""A chart, or a part of one, in the words of Vega-Lite."""

NUMBER = ",.4~r"
"""How tooltips write numbers: four significant digits."""

STACKS = {"stacks": True}
"""Meta data of a chart whose panels go under each other where they are too narrow side by side."""

_KINDS = {"Q": "quantitative", "N": "nominal", "O": "ordinal"}
_PLACE = ("x", "y")


def given(**options: Any) -> ChartSpec:
    """Return the options that are not None or empty texts."""
    return {name: value for name, value in options.items() if value is not None and value != ""}


def channel(field: str, **options: Any) -> ChartSpec:
    """Return an encoding by a field with its kind: ``v:Q`` is a quantity, ``name:N`` a name."""
    name, _, kind = field.partition(":")
    return {"field": name, **({"type": _KINDS[kind]} if kind else {}), **options}


TooltipFields = Mapping[str, str | tuple[str, str]]
"""Fields of a tooltip (``v:Q``) with their titles; a quantity may have its format, too."""


def tooltips(shown: TooltipFields) -> list[ChartSpec]:
    """Return tooltips; quantities are written with four digits or in their format."""
    found = []
    for field, title in shown.items():
        text, form = (title, NUMBER) if isinstance(title, str) else title
        found.append(channel(field, title=text, **({"format": form} if field.endswith(":Q") else {})))
    return found


@dataclass(frozen=True)
class PlotAxis:
    """An axis with its scale.

    `title`: with the unit; `nice`, `zero`: whether the scale is widened to round numbers, or to zero; `padding`: room
    at both ends, px; `ticks`: how many ticks there are, about, or where they are; `form`: format of the numbers
    (d3-format); `above`: whether the title is above the axis, across; `hidden`: whether numbers and title are left out,
    for another panel has them; `scale`: further words of Vega-Lite for the scale.
    """

    title: str
    log: bool = False
    domain: tuple[float, float] | None = None
    nice: bool = True
    zero: bool = False
    padding: float | None = None
    ticks: int | Sequence[float] | None = None
    form: str = ""
    above: bool = False
    hidden: bool = False
    scale: Mapping[str, Any] | None = None

    def channel(self, field: str) -> ChartSpec:
        """Return the encoding of a field along this axis."""
        scale = given(
            type="log" if self.log else None,
            domain=None if self.domain is None else list(self.domain),
            padding=self.padding,
        )
        scale |= {"nice": self.nice} | ({} if self.log else {"zero": self.zero}) | dict(self.scale or {})
        ticks = {"tickCount": self.ticks} if isinstance(self.ticks, int) else given(values=self.ticks)
        axis = ticks | given(format=self.form)
        if self.hidden:
            axis |= {"labels": False, "ticks": False}
        elif self.above:
            axis |= _ABOVE
        return channel(f"{field}:Q", title=None if self.hidden else self.title, scale=scale, axis=axis)


_ABOVE = {"titleAngle": 0, "titleAlign": "left", "titleAnchor": "end", "titleBaseline": "bottom"} | {
    "titleX": 0,
    "titleY": -6,
}

SIDE = {"grid": True, "labelLimit": 200}
"""Axis of names at the side of rows."""


@dataclass(frozen=True)
class Rule:
    """Lines across a plot at values of its vertical axis, or upright ones at values of the other axis."""

    at: Sequence[float]
    upright: bool = False
    style: Literal["reference", "limit", "dimension"] = "reference"
    dash: Sequence[int] = ()

    def layer(self, axis: ChartSpec) -> ChartSpec:
        """Return the lines in a plot with that axis."""
        field = axis["field"]
        look = {"strokeDash": list(self.dash)} if self.dash else {}
        rows = [{field: value} for value in self.at]
        return layer("rule", rows, {"x" if self.upright else "y": axis}, style=self.style, clip=True, **look)


def layer(mark: str, rows: Sequence[ChartRecord], encoding: Mapping[str, Any], **look: Any) -> ChartSpec:
    """Return marks for rows; encodings are channels or fields with their kind (``text:N``)."""
    channels = {
        name: channel(value) if isinstance(value, str) else value
        for name, value in encoding.items()
        if value is not None
    }
    return {"data": {"values": rows}, "mark": {"type": mark, **look}, "encoding": channels}


def rows_where(rows: Sequence[ChartRecord], test: Callable[[ChartRecord], bool]) -> Sequence[ChartRecord]:
    """Return the rows that pass a test; where all do, the same list, which a chart has once."""
    passing = [row for row in rows if test(row)]
    return rows if len(passing) == len(rows) else passing


def bare_layer(mark: str, encoding: Mapping[str, Any], **look: Any) -> ChartSpec:
    """Return marks for the rows of the chart that the layer is in."""
    found = layer(mark, (), encoding, **look)
    return {name: part for name, part in found.items() if name != "data"}


def layered(
    layers: Sequence[ChartSpec], *, size: tuple[Any, Any], window: Sequence[str] = (), **properties: Any
) -> ChartSpec:
    """Return layers over each other.

    `size`: width and height, px; a height ``{"step": 19}`` is for one name; `window`: axes along which a reader
    pans and zooms; **properties: ``title``, ``description``, ``usermeta``, ``data``, ``resolve``.
    """
    found = {**given(**properties), "layer": list(layers), "width": size[0], "height": size[1]}
    if window:
        named = [dict(each) for each in layers]
        _placed(named)["name"] = "plot"
        found |= {"layer": named, "params": [pan_zoom(window, ["plot"])]}
    return found


def _placed(layers: Sequence[ChartSpec]) -> ChartSpec:
    """The first layer that has a place along both axes; a window is bound to its scales."""
    return next((each for each in layers if set(_PLACE) <= set(each["encoding"])), layers[0])


def pan_zoom(axes: Sequence[str], views: Sequence[str]) -> ChartSpec:
    """Drag to pan, wheel with Ctrl to zoom, double click to go back, in all of the named `views` together.

    Without Ctrl the wheel scrolls the page, as a reader expects.
    """
    wheel = "wheel![event.ctrlKey || event.metaKey]"
    select = {"type": "interval", "encodings": list(axes), "zoom": wheel}
    return {"name": "window", "select": select, "bind": "scales", "views": list(views)}


def stacked(panels: Sequence[ChartSpec], *, window: bool = True, **properties: Any) -> ChartSpec:
    """Return panels under each other that share the looks of their series, and with a `window` one horizontal axis."""
    found = {**given(**properties), "spacing": 14, "resolve": shared_looks()}
    if not window:
        return found | {"vconcat": list(panels)}
    views = []
    for place, panel in enumerate(panels):
        views.append(f"panel_{place}")
        panel["layer"] = [dict(each) for each in panel["layer"]]
        _placed(panel["layer"])["name"] = views[-1]
    found["resolve"]["scale"]["x"] = "shared"
    return found | {"vconcat": list(panels), "params": [pan_zoom(["x"], views)]}


def shared_looks(**more: str) -> ChartSpec:
    """Return the resolution of scales by which panels have one legend."""
    return {"scale": {"color": "shared", "strokeDash": "shared", "shape": "shared"} | more}


def heading(text: str, subtitle: str = "") -> ChartSpec:
    """Return a title with a line below."""
    return {"text": text, "subtitle": subtitle}


def panel_title(text: str) -> ChartSpec:
    """Return the title of one panel among several."""
    return {"text": text, "fontSize": 11, "offset": 22, "limit": 240}
