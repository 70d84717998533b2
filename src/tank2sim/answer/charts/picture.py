"""One plot function for each kind of thing, and the chart as a picture.

A chart is defined once, in Altair, and is drawn the same in a picture (:func:`chart_png`) and in a page
(:mod:`tank2sim.answer.page`). It states what is drawn; the looks are defined in :mod:`tank2sim.answer.charts.theme`.
"""

from __future__ import annotations

from typing import Any

import altair as alt

from tank2sim.answer.charts.analysis import (
    FrequencyResponse,
    OutputError,
    PolesZeros,
    bode_chart,
    error_chart,
    pole_zero_chart,
)
from tank2sim.answer.charts.motion import (
    History,
    Signal,
    SpiralData,
    TimeMark,
    Tow,
    TrackData,
    history_chart,
    spiral_chart,
    tow_chart,
    track_chart,
)
from tank2sim.answer.charts.theme import LIGHT, LOCALE

__all__ = [
    "VEGALITE_VERSION",
    "FrequencyResponse",
    "History",
    "OutputError",
    "PolesZeros",
    "Signal",
    "SpiralData",
    "TimeMark",
    "Tow",
    "TrackData",
    "bode_chart",
    "chart_picture",
    "chart_png",
    "chart_specification",
    "error_chart",
    "history_chart",
    "pole_zero_chart",
    "spiral_chart",
    "tow_chart",
    "track_chart",
]

VEGALITE_VERSION = ".".join(alt.SCHEMA_VERSION.lstrip("v").split(".")[:2])
"""Version of Vega-Lite that Altair writes, and in which its charts are drawn: ``6.1``."""

CHECKED_AGAINST_SCHEMA = False
"""Whether each chart is compared with the schema of Vega-Lite, which takes more than half of the time of a page. No
chart's form depends on what a user gives: the tests of the pages set this, and a page is not delayed by it."""


def chart_specification(chart: alt.TopLevelMixin) -> dict[str, Any]:
    """The Vega-Lite specification of a chart, without its looks; the same chart gives the same specification."""
    specification: dict[str, Any] = chart.to_dict(validate=CHECKED_AGAINST_SCHEMA)
    specification.pop("config", None)
    return specification


def chart_picture(chart: alt.TopLevelMixin, ending: str = ".png") -> bytes:
    """The chart as a picture on white; needs no network and no browser.

    Parameters
    ----------
    chart : Chart
    ending : str
        ``.svg`` or ``.pdf``; else it is a PNG.
    """
    import vl_convert

    how: dict[str, Any] = {
        "vl_version": VEGALITE_VERSION,
        "config": LIGHT,
        "format_locale": LOCALE,
        "allowed_base_urls": [],
    }
    specification = chart_specification(chart)
    match ending.lower():
        case ".svg":
            return str(vl_convert.vegalite_to_svg(specification, **how)).encode()
        case ".pdf":
            return bytes(vl_convert.vegalite_to_pdf(specification, **how))
        case _:
            return chart_png(chart)


def chart_png(chart: alt.TopLevelMixin, *, scale: float = 2.0) -> bytes:
    """The chart as a PNG picture on white, `scale` pixels to each px of its size. Needs no network and no browser."""
    import vl_convert

    picture: bytes = vl_convert.vegalite_to_png(
        chart_specification(chart),
        vl_version=VEGALITE_VERSION,
        scale=scale,
        config=LIGHT,
        format_locale=LOCALE,
        allowed_base_urls=[],
    )
    return picture
