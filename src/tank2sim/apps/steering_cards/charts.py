"""Charts of the models of a steering card: steering diagrams with known turns, and influence coefficients."""

from __future__ import annotations

from collections.abc import Mapping

import altair as alt

from tank2sim.answer.charts.parts import NUMBER, Chart, ChartRecord, data, pan_zoom, plain, records, series_look
from tank2sim.answer.charts.theme import SHAPES
from tank2sim.apps.steering_cards.comparison import SteeringDiagrams


def steering_diagram_chart(diagrams: SteeringDiagrams) -> alt.LayerChart:
    """Yaw rate (deg/min) against rudder (deg): the models as lines, the tuned one too, the card's points on top.

    Parameters
    ----------
    diagrams : SteeringDiagrams
    """
    lines: list[ChartRecord] = [
        row
        for label, line in diagrams.models.items()
        for row in records(label, {"d": line.rudder_deg, "r": line.yaw_rate_degpmin})
    ]
    points: list[ChartRecord] = [
        {
            "run": one.label,
            "i": place,
            "d": plain(one.rudder_deg),
            "r": plain(one.yaw_rate_degpmin),
            "source": one.source,
        }
        for place, one in enumerate(diagrams.points)
    ]
    labels = list(dict.fromkeys(row["run"] for row in lines))
    marked = list(dict.fromkeys(row["run"] for row in points))
    look = series_look(labels)
    x = alt.X("d:Q", title="rudder, starboard positive (deg)", scale=alt.Scale(padding=12))
    y = alt.Y("r:Q", title="yaw rate, starboard positive (deg/min)")
    tooltip = [
        alt.Tooltip("run:N", title="of"),
        alt.Tooltip("d:Q", title="rudder (deg)", format=NUMBER),
        alt.Tooltip("r:Q", title="yaw rate (deg/min)", format=NUMBER),
    ]
    line = Chart(data(lines), name="plot").mark_line(clip=True)
    unseen = Chart(data(lines)).mark_point(opacity=0, filled=True, size=110, clip=True)
    below = alt.Legend(title=None, orient="bottom")  # next to the lines they would be too wide for the page
    shape = alt.Shape("run:N", scale=alt.Scale(domain=marked, range=list(SHAPES[: len(marked)])), legend=below)
    point = Chart(data(points)).mark_point(style="start", filled=False, strokeWidth=1.8, clip=True)
    layers = [
        line.encode(x=x, y=y, color=look.colour, strokeDash=look.dash, order="i:Q"),
        unseen.encode(x=x, y=y, tooltip=tooltip),
        *([point.encode(x=x, y=y, shape=shape, tooltip=tooltip)] if points else []),
    ]
    return alt.layer(*layers, params=[pan_zoom("x", "y", views=["plot"])]).properties(
        title="Steering diagrams",
        width=720,
        height=420,
        description=f"Yaw rate against rudder angle of {', '.join(labels)}, with points of {', '.join(marked)}.",
    )


def influence_bars(models: Mapping[str, Mapping[str, float]]) -> alt.LayerChart:
    """K % of every coefficient as bars, the models side by side.

    Parameters
    ----------
    models : mapping
        Words of each model to its K by coefficient.
    """
    rows: list[ChartRecord] = [
        {"run": title, "name": name, "K": plain(value)} for title, K in models.items() for name, value in K.items()
    ]
    order = list(dict.fromkeys(row["name"] for row in rows))
    labels = list(dict.fromkeys(row["run"] for row in rows))
    y = alt.Y("name:N", sort=order, title=None, axis=alt.Axis(labelLimit=160))
    offset = alt.YOffset("run:N", sort=labels)
    x = alt.X("K:Q", title="change of the radius for 10 % more (%)")
    tooltip = [
        alt.Tooltip("run:N", title="model"),
        alt.Tooltip("name:N", title="coefficient"),
        alt.Tooltip("K:Q", title="K (%)", format="+.2f"),
    ]
    legend = None if len(labels) == 1 else alt.Legend(title=None, symbolType="square")
    colour = alt.Color("run:N", scale=alt.Scale(domain=labels), legend=legend)
    bars = Chart(data(rows)).mark_bar(opacity=0.85).encode(x=x, y=y, yOffset=offset, color=colour, tooltip=tooltip)
    zero = Chart(data([{"K": 0.0}])).mark_rule(style="reference").encode(x="K:Q")
    return alt.layer(bars, zero).properties(
        title="Influence of each coefficient",
        width=620,
        height=alt.Step(11),
        description=f"Influence of {len(order)} coefficients on the steady radius in {', '.join(labels)}.",
    )
