"""What every chart is made of: records, units, the look of a series, the frame of a plot."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tank2sim.answer.charts.theme import DASHES, SHAPES, STROKE
from tank2sim.answer.charts.vega import ChartRecord, ChartSpec, PlotAxis
from tank2sim.arrays import Array
from tank2sim.units import UNITS

LINE_SAMPLES = 600
"""Samples of one line; a chart is about as many pixels wide."""
POINT_SAMPLES = 120
"""Measured points of one series; more would be a smear."""
HOVER_SAMPLES = 200
"""Places along the lines of a chart that answer to the pointer."""

USUAL_MARKS = {
    "simulated": 0,
    "fit": 0,
    "after": 0,
    "card found": 0,
    "before": 1,
    "card before": 1,
    "measured": 2,
    "FMU": 3,
}
"""Name of a series to its place among colours, dashes and shapes: it looks the same on every chart. Other series take
the places that are left."""


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


def every(rows: Sequence[ChartRecord], limit: int) -> list[ChartRecord]:
    """At most `limit` of the records, evenly spread."""
    return list(rows[:: max(1, math.ceil(len(rows) / limit))])


def shown_unit(unit: str, display_unit: str | None = None) -> tuple[str, float]:
    """Unit in which a value is shown, and the factor to it; angles are shown in degrees.

    `unit`: unit of the value; a unit that :data:`tank2sim.units.UNITS` lacks is shown as it is; `display_unit`: the
    unit to show it in instead, one of ``UNITS[unit].displays``.
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


@dataclass(frozen=True)
class SeriesLook:
    """Encodings that distinguish the series of a chart; together they make one legend."""

    colour: ChartSpec
    dash: ChartSpec
    shape: ChartSpec

    @property
    def pale(self) -> ChartSpec:
        """The colour of bands: their legend is shared with lines and points, and would be as faint as the band."""
        legend = self.colour["legend"]
        return self.colour | {"legend": legend and legend | {"symbolOpacity": 1}}


def series_look(labels: Sequence[str], as_points: Collection[str] = ()) -> SeriesLook:
    """Colour, dash and shape of each series; :data:`USUAL_MARKS` have their own, others take theirs in order.

    Those in `as_points` appear in the legend by the shape of their points, the others by a stroke of their line. Raises
    ValueError: two series have the same label, and would be drawn as one line.
    """
    if len(set(labels)) != len(labels):
        raise ValueError(f"two series have one label: {labels}")
    places = _places(labels)
    shown = [places.get(place, " " * (place + 1)) for place in range(max(places, default=-1) + 1)]
    points = [label for label in labels if label in as_points]
    dashes = [[1, 0] if label in as_points else list(DASHES[place % len(DASHES)]) for place, label in enumerate(shown)]
    shapes = [SHAPES[points.index(label) % len(SHAPES)] if label in points else STROKE for label in shown]
    legend = _legend(labels, shown, lines_alone=not as_points)

    def encoding(**scale: Any) -> ChartSpec:
        return {"field": "run", "type": "nominal", "scale": {"domain": shown, **scale}, "legend": legend}

    return SeriesLook(encoding(), encoding(range=dashes), encoding(range=shapes))


def _legend(labels: Sequence[str], shown: Sequence[str], *, lines_alone: bool) -> ChartSpec | None:
    if len(labels) < 2:
        return None
    legend: ChartSpec = {"title": None} | ({} if list(labels) == shown else {"values": list(labels)})
    # Where a chart has lines alone no shape enters the legend, and its symbol is stated.
    return legend | ({"symbolType": STROKE} if lines_alone else {})


def _places(labels: Sequence[str]) -> dict[int, str]:
    """Place of each series among colours and dashes, to its label."""
    usual = [label for label in labels if label in USUAL_MARKS]
    known = {USUAL_MARKS[label]: label for label in usual}
    if len(known) < len(usual) or len(labels) == 1:
        return dict(enumerate(labels))
    left = iter(place for place in range(len(labels) + len(known) + len(USUAL_MARKS)) if place not in known)
    return known | {next(left): label for label in labels if label not in known.values()}


def extent(values: Array) -> tuple[float, float]:
    """Lowest and highest finite value; 0 and 0 if there is none."""
    finite = values[np.isfinite(values)]
    return (float(finite.min()), float(finite.max())) if finite.size else (0.0, 0.0)


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

    def axes(self, *, across: tuple[str, str], up: tuple[str, str]) -> ChartSpec:
        """The two axes, each given by its field and title; their ticks have one step."""

        def axis(domain: tuple[float, float], size_px: int, field: str, title: str) -> ChartSpec:
            ticks = max(2, round(size_px / 70))
            return PlotAxis(title, domain=domain, nice=False, ticks=ticks).channel(field)

        return {"x": axis(self.across, self.width_px, *across), "y": axis(self.up, self.height_px, *up)}


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
