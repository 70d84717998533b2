"""Charts of cards compared: differences of coefficients in standard errors, and of figures in per cent."""

from __future__ import annotations

from collections.abc import Sequence

import altair as alt

from tank2sim.analysis.validation.coefficients import BEYOND_STANDARD_ERRORS, CoefficientRow
from tank2sim.answer.charts.parts import NUMBER, Chart, ChartRecord, SeriesLook, data, plain, series_look, stacked

FigurePercent = tuple[str, str, str, float, float | None]
"""Card, trial, figure in words, difference from the reference in per cent, and in standard errors."""


def errors_chart(coefficients: Sequence[CoefficientRow], labels: Sequence[str]) -> alt.LayerChart:
    """Differences of all coefficients in standard errors, a row each, a shape and colour for each card."""
    rows = [
        {"name": row.name, "z": difference.standard_errors, "run": label}
        for row in coefficients
        for label, difference in zip(labels[1:], row.differences, strict=True)
        if difference.standard_errors is not None
    ]
    names = list(dict.fromkeys(str(row["name"]) for row in rows))
    look = series_look(labels[1:], as_points=labels[1:])
    y = alt.Y("name:N", sort=names, title=None)
    tooltip = [
        alt.Tooltip("run:N", title="card"),
        alt.Tooltip("name:N", title="coefficient"),
        alt.Tooltip("z:Q", title="standard errors", format=NUMBER),
    ]
    x = alt.X("z:Q", title="difference (standard errors)")
    points = Chart(data(rows)).mark_point(filled=True, size=60)
    points = points.encode(x=x, y=y, color=look.colour, shape=look.shape, tooltip=tooltip)
    ends = [{"z": -BEYOND_STANDARD_ERRORS}, {"z": BEYOND_STANDARD_ERRORS}]
    limits = Chart(data(ends)).mark_rule(style="limit").encode(x="z:Q")
    described = f"Differences of {len(names)} coefficients from {labels[0]} in standard errors."
    chart: alt.LayerChart = alt.layer(limits, points).properties(
        title="Differences in standard errors", width=620, height=alt.Step(15), description=described
    )
    return chart


def percent_chart(percents: Sequence[FigurePercent], labels: Sequence[str], assumed: str) -> alt.VConcatChart:
    """Differences in per cent of the reference's figure: a panel a manoeuvre, a row a figure, a shape and colour for
    each card. `assumed` is added to the title."""
    panels: dict[str, list[ChartRecord]] = {}
    ends = []
    for label, name, figure, percent, z in percents:
        trial = name.replace(" deg to", "")
        row: ChartRecord = {"run": label, "name": f"{trial}: {figure}", "figure": figure, "percent": plain(percent)}
        if z:
            row |= {"low": plain(percent * (1 - 2 / abs(z))), "high": plain(percent * (1 + 2 / abs(z)))}
        ends += [float(row[key]) for key in ("percent", "low", "high") if row.get(key) is not None]
        panels.setdefault(trial, []).append(row)
    scale = alt.Scale(domain=[min(ends), max(ends)], zero=True, nice=True)
    look = series_look(labels[1:], as_points=labels[1:])
    x = alt.X("percent:Q", scale=scale, title=None)
    return stacked(
        [_percent_panel(panel, trial, x, look) for trial, panel in panels.items()],
        title=f"Difference of the figures from {labels[0]}, %{assumed}",
        description=f"Differences of {len(percents)} figures from {labels[0]} in per cent.",
    )


def _percent_panel(rows: Sequence[ChartRecord], trial: str, x: alt.X, look: SeriesLook) -> alt.LayerChart:
    y = alt.Y("figure:N", sort=None, title=None, axis=alt.Axis(grid=True))
    base = Chart(data(list(rows))).encode(y=y, color=look.colour)
    tooltip = ["run:N", "name:N", alt.Tooltip("percent:Q", title="difference (%)", format=NUMBER)]
    points = base.mark_point(filled=True, size=60).encode(x=x, shape=look.shape, tooltip=tooltip)
    bars = base.mark_rule(strokeWidth=2, opacity=0.6).encode(x="low:Q", x2="high:Q")
    zero = Chart(data([{"percent": 0.0}])).mark_rule(style="reference").encode(x="percent:Q")
    chart: alt.LayerChart = alt.layer(zero, bars, points).properties(
        title=alt.Title(trial, anchor="start", fontSize=11), width=560, height=alt.Step(16)
    )
    return chart
