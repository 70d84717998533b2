"""Curves and points in a plane, with bands and intervals: over time, frequency, an angle, another force."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tank2sim.answer.charts.parts import HOVER_SAMPLES, LINE_SAMPLES, SeriesLook, every, records, series_look, vector
from tank2sim.answer.charts.theme import BAND_OPACITY
from tank2sim.answer.charts.vega import (
    ChartRecord,
    ChartSpec,
    PlotAxis,
    Rule,
    TooltipFields,
    layer,
    layered,
    rows_where,
    stacked,
    tooltips,
)
from tank2sim.records.thinning import thin_line


@dataclass(frozen=True)
class PlotSeries:
    """Values `y` (n,) over `x` (n,) under one name: a line, or points (measured); NaN leaves a gap.

    `label`: a line and points of one name have one colour; `x`, `y` (n,); `low`, `high` (n,): edges of the band of a
    line, or ends of the intervals of points; `closed`: whether `x` goes back and forth: the extremes of both are kept;
    `more`: further columns (n,), for the tooltip.
    """

    label: str
    x: ArrayLike
    y: ArrayLike
    low: ArrayLike | None = None
    high: ArrayLike | None = None
    points: bool = False
    closed: bool = False
    more: Mapping[str, ArrayLike] = field(default_factory=dict)

    @property
    def rows(self) -> list[ChartRecord]:
        """Rows of the chart: ``x``, ``v``, ``low``, ``high``; a long line is thinned."""
        columns = {"x": vector(self.x), "v": vector(self.y)}
        if self.low is not None and self.high is not None:
            columns |= {"low": vector(self.low), "high": vector(self.high)}
        columns |= {name: vector(values) for name, values in self.more.items()}
        if not self.points:
            seen = [columns["x"], columns["v"]] if self.closed else [columns["v"]]
            kept = thin_line(seen, LINE_SAMPLES)
            columns = {name: values[kept] for name, values in columns.items()}
        return records(self.label, columns)


@dataclass(frozen=True)
class Plot:
    """One panel: series along a vertical axis, with rules. `over`: layers drawn over the series."""

    series: Sequence[PlotSeries]
    up: PlotAxis
    height_px: int = 300
    rules: Sequence[Rule] = ()
    over: Sequence[ChartSpec] = ()


def look_of(series: Sequence[PlotSeries]) -> SeriesLook:
    """Return the look of series, each name once; those that have points are points in the legend."""
    labels = list(dict.fromkeys(each.label for each in series))
    return series_look(labels, as_points={each.label for each in series if each.points})


def curve_layers(
    plot: Plot,
    across: PlotAxis,
    look: SeriesLook,
    *,
    shown: TooltipFields | None = None,
    point_px: int | None = None,
    shaded: bool = False,
) -> list[ChartSpec]:
    """Return the layers of a plot: rules, lines, bands, intervals, points, and places that answer to the pointer.

    `shown`: further fields of the tooltip, or other titles; `point_px`: area of a point; `shaded`: whether the
    intervals of points are drawn as a band.
    """
    x, y = across.channel("x"), plot.up.channel("v")
    place = {"x": x, "y": y, "color": look.colour}
    found = [rule.layer(across.channel("x") if rule.upright else plot.up.channel("v")) for rule in plot.rules]
    lines, points = (
        [row for each in plot.series if each.points == are_points for row in each.rows] for are_points in (False, True)
    )
    titles: dict[str, str | tuple[str, str]] = {"run:N": "series", "x:Q": across.title, "v:Q": plot.up.title}
    titles |= shown or {}
    if look.colour["legend"] is None:
        titles.pop("run:N")
    tooltip = tooltips(titles)
    if lines:
        found.append(layer("line", lines, {**place, "strokeDash": look.dash, "order": "i:Q"}, clip=True))
    edges = plot.up.channel("low")
    intervals = rows_where(points, lambda row: "low" in row)
    if banded := rows_where(points if shaded else lines, lambda row: "low" in row):
        band = {"x": x, "y": edges, "y2": "high", "color": look.pale}
        found.append(layer("area", banded, band, opacity=BAND_OPACITY, clip=True))
    if intervals and not shaded:
        stem = {"x": x, "y": edges, "y2": "high", "color": look.colour}
        found.append(layer("rule", intervals, stem, style="stem", clip=True))
    if points:
        size = {} if point_px is None else {"size": point_px}
        found.append(layer("point", points, {**place, "shape": look.shape, "tooltip": tooltip}, clip=True, **size))
    if lines:
        hover = every(lines, HOVER_SAMPLES)
        found.append(layer("point", hover, {"x": x, "y": y, "tooltip": tooltip}, opacity=0, filled=True, size=110))
        found[-1]["mark"]["clip"] = True
    return [*found, *plot.over]


def curve_chart(
    plot: Plot,
    across: PlotAxis,
    *,
    title: str | ChartSpec = "",
    width_px: int = 720,
    window: Sequence[str] = ("x", "y"),
    described: str = "",
    **options: Any,
) -> ChartSpec:
    """Return one plot.

    `across`: horizontal axis; `window`: axes along which a reader pans and zooms; `described`: for those who do not see
    the chart; by default the axes and the names of the series; **options: as of :func:`curve_layers`, and ``usermeta``.
    """
    usermeta = options.pop("usermeta", None)
    names = ", ".join(dict.fromkeys(each.label for each in plot.series))
    return layered(
        curve_layers(plot, across, options.pop("look", None) or look_of(plot.series), **options),
        size=(width_px, plot.height_px),
        window=window,
        title=title,
        description=described or f"{plot.up.title} against {across.title} of {names}.",
        usermeta=usermeta,
    )


def curve_panels(
    plots: Sequence[Plot],
    across: PlotAxis,
    *,
    title: str | ChartSpec = "",
    width_px: int = 720,
    described: str,
    **options: Any,
) -> ChartSpec:
    """Return plots under each other with one horizontal axis, named at the last; the title of each is above it.

    `plots`: from top to bottom; `across`, `title`, `width_px`, `described`, `options`: as of :func:`curve_chart`.
    """
    look = options.pop("look", None) or look_of([each for plot in plots for each in plot.series])
    panels = []
    for plot in plots:
        above = replace(plot, up=replace(plot.up, above=True))
        axis = across if plot is plots[-1] else replace(across, hidden=True)
        layers = curve_layers(above, axis, look, **options)
        panels.append(layered(layers, size=(width_px, plot.height_px)))
    return stacked(panels, title=title, description=described)


def gapped(parts: Sequence[ArrayLike]) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return arrays one after the other, with a gap between them."""
    joined = [part for each in parts for part in (vector(each), [np.nan])]
    return np.concatenate(joined[:-1]) if joined else np.zeros(0)
