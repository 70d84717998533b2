"""What every chart is made of: records, units, the look of a series, panning and zooming."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import altair as alt
import numpy as np
from altair.utils.schemapi import debug_mode
from numpy.typing import ArrayLike

from tank2sim.answer.charts.theme import DASHES, SHAPES, STROKE
from tank2sim.arrays import Array
from tank2sim.units import UNITS

LINE_SAMPLES = 600
"""Samples of one line; a chart is about as many pixels wide."""
POINT_SAMPLES = 120
"""Measured points of one series; more would be a smear."""
HOVER_SAMPLES = 90
"""Places along a line that answer to the pointer."""

STACKS = {"stacks": True}
"""Meta data of a chart whose panels go under each other where they are too narrow side by side."""

NUMBER = ",.4~r"
"""How tooltips write numbers: four significant digits."""

ChartRecord = dict[str, Any]
Position = dict[str, alt.X | alt.Y]


def vector(values: ArrayLike) -> Array:
    """Values as a one-dimensional array of float64."""
    return np.atleast_1d(np.asarray(values, dtype=float))


def plain(value: float) -> float | None:
    """A number for JSON: six significant digits, and None for what is not finite (a gap)."""
    return float(f"{value:.6g}") + 0.0 if math.isfinite(value) else None  # + 0.0 turns -0.0 into 0.0


def records(label: str, columns: Mapping[str, Array]) -> list[ChartRecord]:
    """One record a sample, with its series under ``run`` and its place in the series under ``i``."""
    names = list(columns)
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    return [
        {"run": label, "i": place} | {name: plain(value) for name, value in zip(names, row, strict=True)}
        for place, row in enumerate(rows)
    ]


class _SharedData(alt.InlineData):  # type: ignore[misc]
    """Data of which copies of a chart share the records: Altair copies a chart in most of its steps, and copying each
    number of each record takes half of the time of a page. Nothing changes records."""

    def __deepcopy__(self, memo: object) -> _SharedData:
        return self


class Chart(alt.Chart):  # type: ignore[misc]
    """A chart whose copies share its marks and channels, which nothing changes once they are given.

    Altair copies every chart in a group each time the group is put into another, and again when that is written; with
    all that is in them this takes a quarter of the time of a page.
    """

    def __deepcopy__(self, memo: object) -> alt.Chart:
        return self.copy(deep=False)


def data(rows: Sequence[ChartRecord]) -> alt.InlineData:
    """Records as the data of a chart."""
    with debug_mode(False):  # validating thousands of numbers takes as long as all else of a page
        return _SharedData(values=list(rows))


def every(rows: Sequence[ChartRecord], limit: int) -> list[ChartRecord]:
    """At most `limit` of the records, evenly spread."""
    return list(rows[:: max(1, math.ceil(len(rows) / limit))])


def shown_unit(unit: str, display_unit: str | None = None) -> tuple[str, float]:
    """Unit in which a value is shown, and the factor to it; angles are shown in degrees.

    Parameters
    ----------
    unit : str
        Unit of the value; a unit that :data:`tank2sim.units.UNITS` lacks is shown as it is.
    display_unit : str, optional
        The unit to show it in instead, one of ``UNITS[unit].displays``.
    """
    if unit not in UNITS:
        return unit, 1.0
    displays = UNITS[unit].displays
    if display_unit is None:
        display_unit = next((name for name in displays if name.startswith("deg")), unit)
    return ("", 1.0) if display_unit == "1" else (display_unit, displays.get(display_unit, 1.0))


def with_unit(title: str, unit: str) -> str:
    """Title of an axis or column: ``heading (deg)``."""
    return f"{title} ({unit})" if unit else title


def check_labels(labels: Sequence[str]) -> None:
    """Raise ValueError if two series have the same label: they would be drawn as one line."""
    if len(set(labels)) != len(labels):
        raise ValueError(f"two series have one label: {labels}")


@dataclass(frozen=True)
class SeriesLook:
    """Encodings that distinguish the series of a chart; together they make one legend."""

    colour: alt.Color
    dash: alt.StrokeDash
    shape: alt.Shape


def series_look(labels: Sequence[str], as_points: Collection[str] = ()) -> SeriesLook:
    """Colour, dash and shape of each series, in the order of `labels`.

    Those in `as_points` appear in the legend by the shape of their points, the others by a stroke of their line.
    """
    check_labels(labels)
    shown = list(labels)
    dashes = [[1, 0] if label in as_points else list(DASHES[n % len(DASHES)]) for n, label in enumerate(labels)]
    points = [label for label in labels if label in as_points]
    shapes = [SHAPES[points.index(label) % len(SHAPES)] if label in points else STROKE for label in labels]
    # Where a chart has lines alone no shape enters the legend, and its symbol is to be reported.
    symbol = {} if as_points else {"symbolType": STROKE}
    legend = None if len(labels) == 1 else alt.Legend(title=None, **symbol)
    return SeriesLook(
        alt.Color("run:N", scale=alt.Scale(domain=shown), legend=legend),
        alt.StrokeDash("run:N", scale=alt.Scale(domain=shown, range=dashes), legend=legend),
        alt.Shape("run:N", scale=alt.Scale(domain=shown, range=shapes), legend=legend),
    )


def pan_zoom(*encodings: str, views: Sequence[str]) -> alt.TopLevelSelectionParameter:
    """Drag to pan, wheel with Ctrl to zoom, double click to go back, in all of the named `views` together.

    Without Ctrl the wheel scrolls the page, as a reader expects. Views and parameter have fixed names: those that
    Altair finds may be counted up over the life of the process, and the same page would not be the same bytes.
    """
    wheel = "wheel![event.ctrlKey || event.metaKey]"
    select = alt.IntervalSelectionConfig(type="interval", encodings=list(encodings), zoom=wheel)
    return alt.TopLevelSelectionParameter(name="window", select=select, bind="scales", views=list(views))


def stacked(panels: Sequence[alt.LayerChart], **properties: object) -> alt.VConcatChart:
    """Panels under each other that share what is across and the looks of their series, and move together along it."""
    # Altair ends the names of stacked views in their place; given so, they are the same in all its versions.
    views = [f"panel_{place}" for place in range(len(panels))]
    for view, panel in zip(views, panels, strict=True):
        panel.layer[0].name = view
    chart = alt.vconcat(*panels, spacing=14, params=[pan_zoom("x", views=views)])
    return chart.resolve_scale(x="shared", color="shared", strokeDash="shared", shape="shared").properties(**properties)


def extent(values: Array) -> tuple[float, float]:
    """Lowest and highest finite value; 0 and 0 if there is none."""
    finite = values[np.isfinite(values)]
    return (float(finite.min()), float(finite.max())) if finite.size else (0.0, 0.0)


def panel_title(text: str) -> alt.Title:
    """Return the title of one panel among several."""
    return alt.Title(text, fontSize=11, offset=22, limit=240)


def axis_above(title: str, **options: Any) -> alt.Axis:
    """Return a vertical axis with a horizontal title above it."""
    return alt.Axis(
        title=title,
        titleAngle=0,
        titleAlign="left",
        titleAnchor="end",
        titleBaseline="bottom",
        titleX=0,
        titleY=-6,
        **options,
    )


@dataclass(frozen=True)
class Frame:
    """A plot with given axes: domains in units of the data, sizes in px."""

    across: tuple[float, float]
    up: tuple[float, float]
    width_px: int
    height_px: int

    def pixels(self, across: Any, up: Any) -> tuple[Any, Any]:
        """Place in the plot, px from its left and from its top."""
        (left, right), (bottom, top) = self.across, self.up
        return self.width_px * (across - left) / (right - left), self.height_px * (top - up) / (top - bottom)

    def axes(self, *, across: tuple[str, str], up: tuple[str, str]) -> Position:
        """The two axes, each given by its field and title; their ticks have one step."""

        def axis(domain: tuple[float, float], size_px: int, title: str) -> dict[str, Any]:
            scale = alt.Scale(domain=list(domain), nice=False, zero=False)
            return {"title": title, "scale": scale, "axis": alt.Axis(tickCount=max(2, round(size_px / 70)))}

        return {
            "x": alt.X(across[0], **axis(self.across, self.width_px, across[1])),
            "y": alt.Y(up[0], **axis(self.up, self.height_px, up[1])),
        }


def free_frame(
    across: Array, up: Array, *, width_px: int, height_px: int, margins_px: tuple[float, float] = (0.0, 0.0)
) -> Frame:
    """The frame of `width_px` x `height_px` that shows all values, each axis in a scale of its own.

    `margins_px` are left free at the sides, and above and below.
    """

    def domain(values: Array, size_px: int, margin_px: float) -> tuple[float, float]:
        low, high = extent(values)
        margin = margin_px * ((high - low) or 1.0) / (size_px - 2 * margin_px)
        return (low - margin, high + margin) if high > low or margin_px else (low - 0.5, high + 0.5)

    sides, ends = margins_px
    return Frame(domain(across, width_px, sides), domain(up, height_px, ends), width_px, height_px)


def equal_frame(across: Array, up: Array, *, width_px: int, height_px: int) -> Frame:
    """The largest frame within `width_px` x `height_px` that shows all values with one scale on both axes.

    A frame is not made narrower (or lower) than 40 % of its greatest size: its domain is widened instead.
    """
    spans = [extent(across), extent(up)]
    margin = 0.05 * max(high - low for low, high in spans) or 1.0
    sizes = [high - low + 2 * margin for low, high in spans]
    unit_per_px = max(sizes[0] / width_px, sizes[1] / height_px)
    domains, pixels = [], []
    for (low, high), size, largest in zip(spans, sizes, (width_px, height_px), strict=True):
        pixel = min(largest, math.ceil(max(0.4 * largest, size / unit_per_px)))
        middle, half = (low + high) / 2, pixel * unit_per_px / 2
        domains.append((middle - half, middle + half))
        pixels.append(pixel)
    return Frame(domains[0], domains[1], pixels[0], pixels[1])
