"""Texts of a chart as it is drawn, each with its box: from the scene that Vega makes of it, measured in ink."""

from __future__ import annotations

import functools
import io
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any
from xml.sax.saxutils import escape, quoteattr

import altair as alt
import numpy as np
import vl_convert
from PIL import Image

from tank2sim.answer.charts.picture import VEGALITE_VERSION, chart_specification
from tank2sim.answer.charts.theme import LIGHT, LOCALE

Box = tuple[float, float, float, float]
"""Left, top, right and bottom, px."""

_BASELINES = {"top": 0.79, "middle": 0.30, "bottom": -0.21, "line-top": 0.79, "line-bottom": -0.21}
"""How far Vega draws the base of a text below its place, in its size."""


@dataclass(frozen=True)
class Written:
    """A text, the box of its ink, and the box of the view that it is in."""

    text: str
    box: Box
    view: Box
    role: str


def written_texts(chart: alt.TopLevelMixin) -> tuple[list[Written], Box]:
    """The texts of a chart, each once (a rim is drawn under its words), and the box of the picture."""
    scene = vl_convert.vegalite_to_scenegraph(
        chart_specification(chart),
        vl_version=VEGALITE_VERSION,
        config=LIGHT,
        format_locale=LOCALE,
        allowed_base_urls=[],
    )
    left, top = scene["origin"]
    picture = (-left, -top, scene["width"] - left, scene["height"] - top)
    found = dict.fromkeys(_in_mark(scene["scenegraph"], 0.0, 0.0, picture))
    return list(found), picture


def _in_mark(mark: dict[str, Any], x: float, y: float, view: Box) -> Iterator[Written]:
    for item in mark.get("items", []):
        if mark["marktype"] == "group":
            to_x, to_y = x + item.get("x", 0.0), y + item.get("y", 0.0)
            sized = "width" in item and "height" in item
            inner = (to_x, to_y, to_x + item["width"], to_y + item["height"]) if sized else view
            for part in item.get("items", []):
                yield from _in_mark(part, to_x, to_y, inner)
        elif mark["marktype"] == "text" and item.get("opacity", 1) and str(item.get("text", "")).strip():
            place = x + item.get("x", 0.0), y + item.get("y", 0.0)
            lines = item["text"] if isinstance(item["text"], list) else [str(item["text"])]
            raised = {"middle": 0.5, "bottom": 1.0}.get(item.get("baseline", ""), 0.0) * (len(lines) - 1)
            for number, line in enumerate(lines):
                below = (number - raised) * item.get("lineHeight", item.get("fontSize", 11) + 2)
                one = item | {"text": line, "dy": item.get("dy", 0.0) + below}
                yield Written(line, _box(one, *place), view, mark.get("role", ""))


def _box(item: dict[str, Any], x: float, y: float) -> Box:
    size = item.get("fontSize", 11)
    left, top, right, bottom = _ink(str(item["text"]), item["font"], size, str(item.get("fontWeight", "normal")))
    width = right - left
    start = {"left": 0.0, "center": -width / 2, "right": -width}[item.get("align", "left")] + item.get("dx", 0.0)
    down = _BASELINES.get(item.get("baseline", "alphabetic"), 0.0) * size + item.get("dy", 0.0)
    corners = np.array([[start, top + down], [start + width, bottom + down]])
    corners = np.array([[a, b] for a in corners[:, 0] for b in corners[:, 1]])
    turn = np.radians(item.get("angle", 0.0))
    turned = corners @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]]) + [x, y]
    low, high = turned.min(axis=0).tolist(), turned.max(axis=0).tolist()
    return low[0], low[1], high[0], high[1]


@functools.cache
def _ink(text: str, font: str, size: float, weight: str) -> Box:
    """The ink of a text written from (0, 0), px."""
    wide, high = 40 + int(size * len(text)), int(4 * size)
    style = f"font-family={quoteattr(font)} font-size='{size}px' font-weight='{weight}'"
    svg = (
        f"<svg xmlns='http://www.w3.org/2000/svg' width='{wide}' height='{high}'>"
        f"<text x='20' y='{high // 2}' {style}>{escape(text)}</text></svg>"
    )
    pixels = np.asarray(Image.open(io.BytesIO(vl_convert.svg_to_png(svg, scale=2))))[..., 3]
    rows, columns = np.flatnonzero(pixels.any(axis=1)) / 2, np.flatnonzero(pixels.any(axis=0)) / 2
    middle = high // 2
    return columns[0] - 20, rows[0] - middle, columns[-1] - 20 + 0.5, rows[-1] - middle + 0.5


def faults(chart: alt.TopLevelMixin) -> list[str]:
    """Texts that overlap, that leave their view (those drawn in it), or that leave the picture."""
    texts, picture = written_texts(chart)
    found = [
        f"{one.text!r} on {other.text!r}"
        for place, one in enumerate(texts)
        for other in texts[place + 1 :]
        if _overlap(one.box, other.box)
    ]
    found += [f"{one.text!r} leaves its axes" for one in texts if one.role == "mark" and not _within(one.box, one.view)]
    return found + [f"{one.text!r} leaves the picture" for one in texts if not _within(one.box, picture)]


def _overlap(one: Box, other: Box) -> bool:
    return min(one[2], other[2]) - max(one[0], other[0]) > 0 and min(one[3], other[3]) - max(one[1], other[1]) > 0


def _within(inner: Box, outer: Box, slack: float = 1.0) -> bool:
    low = inner[0] >= outer[0] - slack and inner[1] >= outer[1] - slack
    return low and inner[2] <= outer[2] + slack and inner[3] <= outer[3] + slack
