"""Labels of a chart: none is printed on another, none leaves the plot, and they cover as little as can be of lines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from tank2sim.answer.charts.parts import Frame, plain
from tank2sim.answer.charts.theme import LABEL_PX
from tank2sim.answer.charts.vega import ChartRecord, ChartSpec, layer
from tank2sim.arrays import Array

GAP_PX = 3.0
"""Least distance between two labels, and to the edge of the plot. Project choice."""

_TRACE_PX = 4.0
"""Distance of the points by which a line is followed. Project choice: a label is three times as high."""

_SHARES = (0.5, 0.3, 0.7, 0.15, 0.85)
"""Places along a line at which its label is tried, as shares of its length."""

_NARROW, _WIDE = frozenset("fijlrt.,:;|!'()[]/ °I1"), frozenset("mwMW%—")
_WIDTHS = {"narrow": 0.42, "usual": 0.61, "capital": 0.75, "wide": 0.95}
"""Widths of characters in semi-bold type, in its size: upper bounds over the fonts of a page."""

_Point = tuple[float, float]


@dataclass(frozen=True)
class Spot:
    """A place for a label: `at` across and up in units of the data, its offset in px, and the side that is there."""

    at: _Point
    dx: float = 0.0
    dy: float = 0.0
    align: Literal["left", "center", "right"] = "center"


Label = tuple[str, Sequence[Spot]]
"""A text, and the places where it may be, the best first."""


def spots_about(at: _Point, *, up: bool = True) -> list[Spot]:
    """Return places about a point: above it (below, if not `up`), to its sides, and on its other side."""
    first, second = (-9.0, 11.0) if up else (11.0, -9.0)
    return [
        Spot(at, dy=first),
        Spot(at, dx=6.0, dy=first, align="left"),
        Spot(at, dx=-6.0, dy=first, align="right"),
        Spot(at, dx=8.0, align="left"),
        Spot(at, dx=-8.0, align="right"),
        Spot(at, dy=second),
    ]


def spots_along(begin: _Point, end: _Point, frame: Frame) -> list[Spot]:
    """Return places along a line, on both sides of it, and beyond its ends."""
    first, last = (np.array(point, dtype=float) for point in (begin, end))
    places: list[_Point] = [tuple((first + share * (last - first)).tolist()) for share in _SHARES]
    across, up = np.abs(np.subtract(frame.pixels(*end), frame.pixels(*begin)))
    if across >= up:
        middle = [Spot(place, dy=dy) for place in places for dy in (-9.0, 11.0)]
        aside = [(dy, dx, side) for dy in (0.0, -9.0, 11.0) for dx, side in _SIDES]
        return [*middle, *(Spot(point, dx=dx, dy=dy, align=side) for point in (end, begin) for dy, dx, side in aside)]
    middle = [Spot(place, dx=dx, align=side) for place in places for dx, side in _SIDES]
    return [*middle, *(Spot(point, dy=dy) for point in (end, begin) for dy in (-9.0, 11.0))]


_SIDES: tuple[tuple[float, Literal["left", "right"]], ...] = ((6.0, "left"), (-6.0, "right"))


def place_labels(
    labels: Sequence[Label], frame: Frame, lines: Sequence[tuple[Array, Array]] = ()
) -> list[tuple[str, Spot]]:
    """Choose a place for each label, in their order; one without a free place is left out.

    `lines` (n,): lines, across and up in units of the data, that labels should leave free.
    """
    drawn = np.concatenate([np.empty((0, 2)), *(_traced(frame, *line) for line in lines)])
    chosen: list[tuple[str, Spot]] = []
    taken = np.empty((0, 4))
    for text, spots in labels:
        boxes = np.array([_box(text, spot, frame) for spot in spots]).reshape(-1, 4)
        free = [place for place, box in enumerate(boxes) if _free(box, taken, frame)]
        if not free:
            continue
        best = min(free, key=lambda place: (_covered(boxes[place], drawn) + 0.5 * place, place))
        chosen.append((text, spots[best]))
        taken = np.vstack([taken, boxes[best]])
    return chosen


def label_layers(
    labels: Sequence[Label], frame: Frame, position: Mapping[str, ChartSpec], lines: Sequence[tuple[Array, Array]] = ()
) -> list[ChartSpec]:
    """Return labels in their places, over a rim in the colour of the paper that keeps them legible.

    `labels`, `frame`, `lines`: as of :func:`place_labels`; `position`: the channels ``x`` and ``y``.
    """
    fields = [position[axis]["field"] for axis in ("x", "y")]
    groups: dict[tuple[float, float, str], list[ChartRecord]] = {}
    for text, spot in place_labels(labels, frame, lines):
        row = {name: plain(value) for name, value in zip(fields, spot.at, strict=True)}
        groups.setdefault((spot.dx, spot.dy, spot.align), []).append(row | {"text": text})
    return [
        layer("text", rows, {**position, "text": "text:N"}, style=style, dx=dx, dy=dy, align=align)
        for (dx, dy, align), rows in groups.items()
        for style in ("rim", "words")
    ]


def _text_width(text: str) -> float:
    """Width of a label, px; not less than any font of a page takes."""
    kinds = (
        "narrow" if c in _NARROW else "wide" if c in _WIDE else "capital" if c.isupper() else "usual" for c in text
    )
    return LABEL_PX * sum(_WIDTHS[kind] for kind in kinds)


def _box(text: str, spot: Spot, frame: Frame) -> tuple[float, float, float, float]:
    """Left, top, right and bottom of a label, px."""
    width, (x, y) = _text_width(text), frame.pixels(*spot.at)
    left = x + spot.dx - {"left": 0.0, "center": 0.5, "right": 1.0}[spot.align] * width
    middle = y + spot.dy
    return left, middle - 0.5 * LABEL_PX, left + width, middle + 0.5 * LABEL_PX


def _free(box: Array, taken: Array, frame: Frame) -> bool:
    left, top, right, bottom = box
    within = left >= GAP_PX and top >= GAP_PX
    if not (within and right <= frame.width_px - GAP_PX and bottom <= frame.height_px - GAP_PX):
        return False
    across = np.minimum(right, taken[:, 2]) - np.maximum(left, taken[:, 0])
    up = np.minimum(bottom, taken[:, 3]) - np.maximum(top, taken[:, 1])
    return not bool(np.any((across > -GAP_PX) & (up > -GAP_PX)))


def _covered(box: Array, points: Array) -> int:
    left, top, right, bottom = box
    across = (points[:, 0] > left) & (points[:, 0] < right)
    return int(np.sum(across & (points[:, 1] > top) & (points[:, 1] < bottom)))


def _traced(frame: Frame, across: Array, up: Array) -> Array:
    """Points (n, 2) of a line in px, evenly along it."""
    x, y = frame.pixels(np.asarray(across, dtype=float), np.asarray(up, dtype=float))
    known = np.isfinite(x) & np.isfinite(y)
    x, y = np.atleast_1d(x[known]), np.atleast_1d(y[known])
    if len(x) < 2:
        return np.column_stack([x, y])
    way = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    at = np.arange(0.0, way[-1] + _TRACE_PX, _TRACE_PX)
    return np.column_stack([np.interp(at, way, x), np.interp(at, way, y)])
