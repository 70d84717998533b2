"""Pictures of the passport of an FMU: track of the turning circle, the zigzag, and the validity in both, as SVG."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from tank2sim.arrays import Array
from tank2sim.simulation.run import Run

_POINTS = 300
"""Most points of a line: more than a picture is wide in ems (project choice)."""

_SIZE = 300
"""Height of a picture, px (project choice)."""

_COLOURS = ["#0072B2", "#D55E00"]


def passport_pictures(manoeuvres: Mapping[str, Run]) -> dict[str, str]:
    """Caption to SVG, of the manoeuvres that there are (``turn_35``, ``zigzag_20_20``); empty without any."""
    found = {}
    if turn := manoeuvres.get("turn_35"):
        found["Track of the turning circle, to scale; north is the heading at the execute"] = _track(turn)
    if zigzag := manoeuvres.get("zigzag_20_20"):
        found["Heading and rudder angle in the zigzag, positive to starboard"] = _lines(
            {
                "heading": np.degrees(zigzag.trajectory["motion.psi"]),
                "rudder": np.degrees(zigzag.trajectory["rudder.angle"]),
            },
            {"heading": zigzag.trajectory.t, "rudder": zigzag.trajectory.t},
            "angle (deg)",
        )
    with_validity = {
        name: run.trajectory
        for name, run in (("turn", turn), ("zigzag", manoeuvres.get("zigzag_20_20")))
        if run is not None and "validity" in run.trajectory.model.outputs
    }
    if with_validity:
        found["Validity in both: 1 inside the range of the card, falling to 0 outside"] = _lines(
            {name: trajectory["validity"] for name, trajectory in with_validity.items()},
            {name: trajectory.t for name, trajectory in with_validity.items()},
            "validity",
        )
    return found


def _track(run: Run) -> str:
    north, east = run.trajectory["motion.x"], run.trajectory["motion.y"]
    place, rows = _rows(len(north)), []
    rows = [{"t": float(run.trajectory.t[row]), "x": float(north[row]), "y": float(east[row])} for row in place]
    spans = [float(np.ptp(values)) or 1.0 for values in (east, north)]
    scale = _SIZE / spans[1]
    axis = {"type": "quantitative", "scale": {"zero": False, "nice": False}}
    encoding = {
        "x": {"field": "y", "title": "y, east (m)", **axis},
        "y": {"field": "x", "title": "x, north (m)", **axis},
        "order": {"field": "t"},
    }
    return _svg(rows, encoding, {"width": spans[0] * scale, "height": _SIZE})


def _lines(values: Mapping[str, Array], times: Mapping[str, Array], title: str) -> str:
    rows = [
        {"t": float(times[name][row]), "value": float(series[row]), "of": name}
        for name, series in values.items()
        for row in _rows(len(series))
    ]
    encoding = {
        "x": {"field": "t", "type": "quantitative", "title": "t (s)"},
        "y": {"field": "value", "type": "quantitative", "title": title},
        "color": {"field": "of", "sort": list(values), "scale": {"range": _COLOURS}, "legend": {"title": None}},
        "strokeDash": {"field": "of", "sort": list(values), "legend": {"title": None}},
    }
    return _svg(rows, encoding, {"width": 1.5 * _SIZE, "height": 0.6 * _SIZE})


def _rows(count: int) -> Any:
    return np.unique(np.linspace(0, count - 1, min(count, _POINTS)).astype(int))


def _svg(rows: list[dict[str, Any]], encoding: dict[str, Any], size: dict[str, float]) -> str:
    import vl_convert  # takes as long to load as a manoeuvre to simulate

    spec = {
        "$schema": "https://vega.github.io/schema/vega-lite/v5.json",
        "data": {"values": rows},
        "mark": {"type": "line", "color": _COLOURS[0]},
        "encoding": encoding,
        "config": {"background": "transparent", "view": {"stroke": "#bbb"}},
        **size,
    }
    drawn: str = vl_convert.vegalite_to_svg(spec)
    # Names within a picture, so that one page holds several.
    return re.sub(r"<\?xml[^>]*>|<!DOCTYPE[^>]*>", "", drawn)
