"""Charts of a validation: comparison errors next to their uncertainty, and replays of trials."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import altair as alt

from tank2sim.report.kit.chart_parts import NUMBER, data, series_look
from tank2sim.report.kit.json_values import Json
from tank2sim.units import in_words

COMPARISON_ERRORS = "Points: E; bars: plus and minus U_val about zero, in per cent of D."
"""What the chart of comparison errors shows."""


def comparison_error_chart(figures: Sequence[Mapping[str, Json]]) -> alt.LayerChart:
    """E of each of the ``figures`` of the JSON next to plus and minus U_val, in per cent of D."""
    rows = []
    for figure in figures:
        if figure["error"] is None or not figure["measured"]:
            continue
        content = {
            "name": f"{figure['trial']}: {in_words(figure['name'])[0]}",
            "e": 100 * figure["error"] / abs(figure["measured"]),
        }
        level = figure["level_percent"] or 0.0
        rows.append({**content, "low": -level, "high": level, "run": str(figure["outcome"])})
    names = [str(row["name"]) for row in rows]
    y = alt.Y("name:N", sort=names, title=None, axis=alt.Axis(labelLimit=320))
    outcomes = list(dict.fromkeys(str(row["run"]) for row in rows))
    look = series_look(outcomes, as_points=outcomes)
    base = alt.Chart(data(rows))
    bars = base.mark_rule(style="reference", strokeWidth=7, opacity=0.3).encode(
        x=alt.X("low:Q", title="per cent of the measured figure"), x2="high:Q", y=y
    )
    points = base.mark_point(filled=True, size=70).encode(
        x="e:Q",
        y=y,
        color=look.colour,
        shape=look.shape,
        tooltip=[
            alt.Tooltip("name:N", title="figure"),
            alt.Tooltip("e:Q", title="E (%)", format=NUMBER),
            alt.Tooltip("high:Q", title="U_val (%)", format=NUMBER),
        ],
    )
    chart: alt.LayerChart = alt.layer(bars, points).properties(
        title="Comparison error and validation uncertainty",
        width=430,
        height=alt.Step(18),
        description=f"Comparison error of {len(rows)} figures next to the validation uncertainty.",
    )
    return chart
