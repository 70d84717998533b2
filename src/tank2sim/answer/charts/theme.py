"""How charts look: one palette and one Vega-Lite configuration for light paper, one for a dark screen.

Colours follow Okabe & Ito (2008), "Color Universal Design: how to make figures and presentations that are
friendly to colorblind people", https://jfly.uni-koeln.de/color/, in an order that keeps neighbours apart. Their yellow
is left out on white and their black on dark, where neither is seen. No chart relies on colour alone: lines differ in
their dashes too, points in their shapes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

Config = dict[str, Any]

LIGHT_PALETTE = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
DARK_PALETTE = ("#56B4E9", "#E69F00", "#2BC49A", "#E29AC2", "#F0E442", "#F0864A", "#FFFFFF")

DASHES = ((1, 0), (7, 3), (2, 2), (9, 3, 2, 3), (5, 2))
"""Stroke and gap, px. Five dashes and seven colours repeat together only after 35 series."""

SHAPES = ("circle", "square", "triangle-up", "diamond", "triangle-down")

STROKE = "M-1.7,0L1.7,0"
"""A line in a legend, as an SVG path; Vega's own is too short to show its dashes."""

CROSS = "M-.8,-.8L.8,.8M-.8,.8L.8,-.8"
"""A cross of two diagonals, as an SVG path; Vega's own is a filled plus."""

BAND_OPACITY = 0.16
"""Opacity of a shaded band. Project choice: lines and the grid are seen through it."""

LABEL_PX = 12.0
"""Size of the type of labels on a chart."""

FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, 'Helvetica Neue', 'Liberation Sans', Arial, sans-serif"


@dataclass(frozen=True, kw_only=True)
class Tone:
    """Colours of one appearance, as CSS writes them."""

    paper: str
    ink: str
    muted: str
    grid: str
    line: str
    limit: str
    palette: tuple[str, ...]


LIGHT_TONE = Tone(
    paper="#ffffff",
    ink="#16212c",
    muted="#52606d",
    grid="#e4e9ee",
    line="#b4bfca",
    limit="#B3261E",
    palette=LIGHT_PALETTE,
)
DARK_TONE = Tone(
    paper="#151c23",
    ink="#e8edf2",
    muted="#a3b0bd",
    grid="#27313b",
    line="#4b5966",
    limit="#FF8A80",
    palette=DARK_PALETTE,
)


def vega_config(tone: Tone) -> Config:
    """The Vega-Lite configuration of a tone; charts themselves say nothing of fonts and colours.

    Marks name a style (``limit``, ``reference``, ``band``, ``hull``, ...) where they show something that is not a
    series.
    """
    return {
        "background": tone.paper,
        "font": FONT,
        "padding": 6,
        "aria": False,  # one description for the whole chart; else each of its thousands of points gets one
        "view": {"stroke": tone.line, "strokeWidth": 0.75},
        "title": {
            "anchor": "start",
            "color": tone.ink,
            "fontSize": 15,
            "fontWeight": 600,
            "offset": 12,
            "frame": "bounds",
        }
        | {"subtitleColor": tone.muted, "subtitleFontSize": 12, "subtitlePadding": 5},
        "axis": {"domain": False, "gridColor": tone.grid, "tickColor": tone.line, "tickSize": 4, "labelPadding": 4}
        | {"labelColor": tone.muted, "labelFontSize": 11.5, "labelFlush": False}
        | {"titleColor": tone.ink, "titleFontSize": 12, "titleFontWeight": 500, "titlePadding": 8},
        "axisQuantitative": {"labelOverlap": True, "labelSeparation": 6},
        "header": {"labelColor": tone.ink, "labelFontSize": 12, "labelFontWeight": 600, "title": None},
        "legend": {"orient": "top", "title": None, "labelColor": tone.ink, "titleColor": tone.ink, "labelFontSize": 12}
        | {
            "labelLimit": 320,
            "symbolSize": 90,
            "symbolStrokeWidth": 2,
            "columnPadding": 22,
            "offset": 8,
            "labelOffset": 8,
        }
        | {"layout": {"top": {"anchor": "start", "direction": "horizontal", "margin": 30}}},
        "line": {"strokeWidth": 1.8, "strokeCap": "butt", "strokeJoin": "round"},
        "point": {"size": 32, "strokeWidth": 1.4, "filled": False, "opacity": 1},
        "rule": {"color": tone.ink},
        "range": {"category": list(tone.palette)},
        "style": _styles(tone),
    }


def _styles(tone: Tone) -> Config:
    return {
        "limit": {"color": tone.limit, "opacity": 1},
        "reference": {"color": tone.muted, "strokeWidth": 1},
        "region": {"color": tone.limit, "opacity": 0.08},
        "start": {"color": tone.ink, "size": 80, "filled": True, "opacity": 1},
        "stem": {"strokeWidth": 1.2, "opacity": 0.5},
        "dimension": {"color": tone.ink, "strokeWidth": 1, "strokeDash": [4, 3], "opacity": 1},
        "overshoot": {"color": tone.limit, "strokeWidth": 2.5, "opacity": 1},
        "interval": {"color": tone.palette[1], "strokeWidth": 8, "opacity": 0.45},
        "band": {"fill": tone.palette[0], "fillOpacity": BAND_OPACITY, "strokeWidth": 0},
        "uncertainty": {"fill": tone.palette[0], "fillOpacity": 0.25, "stroke": tone.palette[0], "strokeWidth": 1},
        "hull": {"fill": tone.muted, "fillOpacity": 0.35, "stroke": tone.muted, "strokeWidth": 0.75},
        "words": {"color": tone.ink, "fontSize": LABEL_PX, "fontWeight": 600},
        "rim": {"color": tone.paper, "stroke": tone.paper, "strokeWidth": 4, "fontSize": LABEL_PX, "fontWeight": 600},
    }


LOCALE = {"decimal": ".", "thousands": "\u202f", "grouping": [3], "currency": ["", ""], "minus": "\u2212"}
"""Numbers on axes as in tables (d3-format): a narrow space between thousands, a true minus sign."""

LIGHT = vega_config(LIGHT_TONE)
DARK = vega_config(DARK_TONE)
