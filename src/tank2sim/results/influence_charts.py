"""Charts of influence coefficients: K % by exact slopes next to the 10 % difference, variances, and tuning."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

import altair as alt
import numpy as np

from tank2sim.analysis.influence.card_influence import InfluenceStudy
from tank2sim.analysis.tuning.result import TunedStudy
from tank2sim.answer.charts.parts import NUMBER, Chart, ChartRecord, data, plain, series_look
from tank2sim.arrays import Array
from tank2sim.units import in_words

EXACT, DIFFERENCE = "exact slope", "10 % difference"

_MOST_ROWS = 24
"""Parameters in a chart of all figures, or of tuning. The table has all."""

_MOST_BARS = 12
"""Parameters in the chart of one figure: those that move it most. Project choice: two charts side by side are half a
screen high."""

_WIDTH = 600


@dataclass(frozen=True, eq=False)
class InfluenceData:
    """What is drawn of a result: names of the figures (nf,) and of the parameters (k,), and K % by exact slopes and by
    the 10 % difference and shares of the variance, (nf, k); nan where there is none."""

    figures: tuple[str, ...]
    names: tuple[str, ...]
    exact: Array
    difference: Array
    shares: Array

    @staticmethod
    def of(study: InfluenceStudy) -> InfluenceData:
        """From the study."""
        rows = [[row[key] for key in study.parameters] for row in study.influence_percent.values()]
        shares = [[figure.share_of_variance[key] for key in study.parameters] for figure in study.figures.values()]
        return InfluenceData(
            figures=tuple(study.figures),
            names=tuple(number.name for number in study.parameters.values()),
            exact=np.array([[cell.exact for cell in row] for row in rows]),
            difference=np.array([[cell.difference for cell in row] for row in rows]),
            shares=np.array(shares),
        )


_ORDINALS = ("first", "second", "third", "fourth")


def figure_label(text: str) -> str:
    """Words for a figure without its unit: ``advance_m@35`` is ``advance, 35 deg``, ``@spin:400`` ends in ``rpm``."""
    kind, _, argument = text.partition("@")
    words = re.sub(r"^overshoot (\d)$", lambda found: f"{_ORDINALS[int(found[1]) - 1]} overshoot", in_words(kind)[0])
    unit = "rpm" if ":" in argument else "deg"
    return f"{words}, {argument} {unit}" if argument else words


def most_influential(result: InfluenceData, row: int) -> list[int]:
    """Places of the parameters with the largest K % on one figure, largest first."""
    sizes = np.nan_to_num(np.abs(result.exact[row]))
    order = [int(place) for place in np.argsort(-sizes, kind="stable") if sizes[place] > 1e-3 * sizes.max()]
    return order[:_MOST_BARS]


def influence_charts(result: InfluenceData) -> list[alt.LayerChart]:
    """One chart for each figure, of the parameters that move it most: bars by exact slopes, points by the 10 %
    difference."""
    return [_bars(result, row) for row in range(len(result.figures))]


def _bars(result: InfluenceData, row: int) -> alt.LayerChart:
    exact, difference, order = result.exact[row], result.difference[row], most_influential(result, row)
    names = [result.names[place] for place in order]
    bars = [_record(result, place, EXACT, exact[place], difference[place]) for place in order]
    points = [record | {"run": DIFFERENCE, "k": record["step"]} for record in bars if record["step"] is not None]
    look = series_look([EXACT, DIFFERENCE], as_points=[EXACT, DIFFERENCE])
    axis = alt.Axis(title=None, grid=True, labelLimit=170)
    y = alt.Y("name:N", sort=names, scale=alt.Scale(domain=names), axis=axis)
    x = alt.X("k:Q", title="K (%)", axis=alt.Axis(tickCount=4))
    tooltip = [
        alt.Tooltip("name:N", title="parameter"),
        alt.Tooltip("exact:Q", title=f"K, {EXACT} (%)", format=NUMBER),
        alt.Tooltip("step:Q", title=f"K, {DIFFERENCE} (%)", format=NUMBER),
    ]
    zero = Chart(data([{"k": 0.0}])).mark_rule(style="reference").encode(x=x)
    drawn = Chart(data(bars)).mark_bar(height=9, opacity=0.65).encode(x=x, y=y, color=look.colour, tooltip=tooltip)
    marks = Chart(data(points)).mark_point(size=34, strokeWidth=1.6)
    marked = marks.encode(x=x, y=y, color=look.colour, shape=look.shape, tooltip=tooltip)
    figure = figure_label(result.figures[row])
    return alt.layer(drawn, zero, marked).properties(
        width=_WIDTH,
        height=19 * len(names),
        title=f"Influence on {figure}",
        description=f"K per cent of {len(names)} parameters on {figure}, by exact slopes and by a 10 % difference.",
    )


def _record(result: InfluenceData, place: int, run: str, exact: float, difference: float) -> ChartRecord:
    return {
        "run": run,
        "name": result.names[place],
        "k": plain(exact) if math.isfinite(exact) else None,
        "exact": plain(exact),
        "step": plain(difference),
    }


def variance_chart(result: InfluenceData) -> alt.Chart:
    """Share of each parameter in the variance of each figure, as a heat map of those with 1 % of any."""
    shares = 100 * result.shares
    order = [int(k) for k in np.argsort(-shares.max(axis=0), kind="stable") if shares[:, k].max() >= 1][:_MOST_ROWS]
    names = [result.names[place] for place in order]
    figures = [figure_label(text) for text in result.figures]
    rows: list[ChartRecord] = [
        {"figure": figures[row], "name": result.names[place], "share": plain(float(shares[row, place]))}
        for row in range(len(figures))
        for place in order
    ]
    tooltip = [
        alt.Tooltip("figure:N"),
        alt.Tooltip("name:N", title="parameter"),
        alt.Tooltip("share:Q", title="share (%)", format=".1f"),
    ]
    axis = alt.Axis(title=None, labelLimit=200, ticks=False)
    scale = alt.Scale(domain=[0, max(10.0, float(shares.max(initial=0.0)))], scheme="blues")
    return (
        Chart(data(rows))
        .mark_rect()
        .encode(
            x=alt.X("name:N", sort=names, axis=alt.Axis(title=None, labelAngle=-90, ticks=False)),
            y=alt.Y("figure:N", sort=figures, axis=axis),
            color=alt.Color("share:Q", scale=scale, legend=alt.Legend(title="share of the variance (%)")),
            tooltip=tooltip,
        )
        .properties(
            width=_WIDTH,
            height=28 * len(figures),
            title="Standard errors behind those of the figures",
            description=f"Shares of {len(names)} parameters in the variances of {len(figures)} figures.",
        )
    )


def moves_chart(tuned: TunedStudy) -> alt.LayerChart:
    """Numbers that tuning changed, in standard errors of the card, with the bounds."""
    rows: list[ChartRecord] = [
        {"name": one.name, "z": plain(one.standard_errors), "before": plain(one.before), "after": plain(one.after)}
        for one in tuned.parameters.values()
        if one.standard_errors is not None
    ][:_MOST_ROWS]
    shown = [row["name"] for row in rows]
    x = alt.X("z:Q", title="move (standard errors of the card)")
    y = alt.Y("name:N", sort=shown, axis=alt.Axis(title=None, grid=True, labelLimit=170))
    tooltip = [
        alt.Tooltip("name:N", title="parameter"),
        *(alt.Tooltip(f"{key}:Q", title=key, format=".6~g") for key in ("before", "after")),
        alt.Tooltip("z:Q", title="standard errors", format=".3f"),
    ]
    within = tuned.within_standard_errors
    bounds = Chart(data([{"z": -within}, {"z": within}])).mark_rule(style="limit", strokeDash=[5, 3]).encode(x=x)
    zero = Chart(data([{"z": 0.0}])).mark_rule(style="reference").encode(x=x)
    bars = Chart(data(rows)).mark_bar(height=10, opacity=0.75).encode(x=x, y=y, tooltip=tooltip)
    return alt.layer(bars, zero, bounds).properties(
        width=_WIDTH,
        height=max(60, 20 * len(shown)),
        title="What tuning changed",
        description=f"Moves of {len(shown)} parameters in standard errors; the bounds are at {within:g}.",
    )
