"""Charts of the models of a steering card: steering diagrams with known turns, and influence coefficients."""

from __future__ import annotations

from collections.abc import Mapping

from tank2sim.answer.charts.curves import Plot, PlotSeries, curve_chart
from tank2sim.answer.charts.parts import plain
from tank2sim.answer.charts.rows import RowPlot, names_of, row_chart, runs_of
from tank2sim.answer.charts.theme import SHAPES
from tank2sim.answer.charts.vega import ChartRecord, ChartSpec, PlotAxis, Rule, channel, layer, tooltips
from tank2sim.apps.steering_cards.comparison import SteeringDiagrams


def steering_diagram_chart(diagrams: SteeringDiagrams) -> ChartSpec:
    """Yaw rate (deg/min) against rudder (deg): the models as lines, the tuned one too, the card's points on top."""
    series = [
        PlotSeries(label=label, x=line.rudder_deg, y=line.yaw_rate_degpmin, closed=True)
        for label, line in diagrams.models.items()
    ]
    points: list[ChartRecord] = [
        {"run": one.label, "x": plain(one.rudder_deg), "v": plain(one.yaw_rate_degpmin), "source": one.source}
        for one in diagrams.points
    ]
    marked = runs_of(points)
    across = PlotAxis(title="rudder, starboard positive (deg)", padding=12)
    up = PlotAxis(title="yaw rate, starboard positive (deg/min)", zero=True)
    shown = {"run:N": "of", "x:Q": "rudder (deg)", "v:Q": "yaw rate (deg/min)"}
    # Next to the lines these names would be too wide for the page.
    below = {"title": None, "orient": "bottom"}
    place = {"x": across.channel("x"), "y": up.channel("v"), "tooltip": tooltips(shown)}
    place["shape"] = channel("run:N", scale={"domain": marked, "range": list(SHAPES[: len(marked)])}, legend=below)
    turns = layer("point", points, place, style="start", filled=False, strokeWidth=1.8, clip=True)
    return curve_chart(
        Plot(series=series, up=up, height_px=420, over=[turns] if points else []),
        across,
        title="Steering diagrams",
        described=f"Yaw rate against rudder angle of {', '.join(diagrams.models)}, with points of {', '.join(marked)}.",
        shown=shown,
    )


def influence_bars(models: Mapping[str, Mapping[str, float]]) -> ChartSpec:
    """K % of every coefficient as bars, the models side by side.

    `models`: words of each model to its K by coefficient.
    """
    rows: list[ChartRecord] = [
        {"run": title, "name": name, "v": plain(value)} for title, K in models.items() for name, value in K.items()
    ]
    return row_chart(
        RowPlot(
            rows=rows,
            across=PlotAxis(title="change of the radius for 10 % more (%)", zero=True),
            apart=True,
            rules=[Rule(at=[0.0])],
            side={"labelLimit": 160},
            shown={"run:N": "model", "name:N": "coefficient", "v:Q": ("K (%)", "+.2f")},
        ),
        title="Influence of each coefficient",
        described=f"Influence of {len(names_of(rows))} coefficients on the steady radius, by model.",
        step_px=11,
        mark="bar",
        height={"band": 1},
        opacity=0.85,
    )
