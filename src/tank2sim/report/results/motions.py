"""Columns over time and ways in the JSON of a result."""

from __future__ import annotations

from collections.abc import Mapping

from tank2sim.answer.charts.motion import TrackData, track_chart
from tank2sim.answer.parts import Illustration, Section
from tank2sim.report.json_values import Json


def is_columns(value: Json) -> bool:
    """Whether this is a table of columns over time."""
    if not isinstance(value, Mapping) or not isinstance(value.get("t_s"), list) or len(value["t_s"]) < 2:
        return False
    return len(value) > 1 and all(
        isinstance(column, list) and len(column) == len(value["t_s"]) for column in value.values()
    )


_WAYS = {
    "turning_circles_deep": "Turning circles in deep water",
    "turning_circles_shallow": "Turning circles in shallow water",
    "stops": "Stopping",
}


def from_the_bridge(result: Json) -> list[Section]:
    """Turning circles and stops of a poster or a pilot card: the way ahead is up, starboard is right."""
    charts = []
    for key, title in _WAYS.items():
        tracks = [TrackData(label=path["name"], x_m=path["ahead_m"], y_m=path["starboard_m"]) for path in result[key]]
        if tracks:
            charts.append(Illustration(chart=track_chart(tracks, title=title), caption="The ship heads up the page."))
    return [Section(heading="Ways", charts=charts)] if charts else []
