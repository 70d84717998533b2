"""Charts of estimated parameters: values next to the prior, correlations, information of the trials."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import altair as alt
import numpy as np

from tank2sim.arrays import Array
from tank2sim.identification.trials.assessment.identifiability import CLOSE_CORRELATION, Identifiability
from tank2sim.report.kit.chart_parts import NUMBER, ChartRecord, data, plain, series_look

_NORMAL = 1.959964


@dataclass(frozen=True, kw_only=True)
class Parameters:
    """Names (k,), and estimates and priors (k,) with their standard errors; `share` of information from trials."""

    names: Sequence[str]
    values: Array
    errors: Array
    prior: Array
    prior_errors: Array
    share: Array


def parameter_chart(parameters: Parameters, *, title: str = "") -> alt.HConcatChart:
    """Estimates with their 95 % intervals next to the priors', in standard errors of the prior; shares next to."""
    rows = [_parameter_row(parameters, place) for place in range(len(parameters.names))]
    farthest = max((abs(row[key]) for row in rows for key in ("low", "high")), default=1.0)
    # A few derivatives may move by dozens of standard errors, where the others move by one.
    kind = {"type": "symlog", "constant": 2} if farthest > 12 else {}
    ticks = {"values": _symmetric_ticks(farthest)} if kind else {}
    y = alt.Y("name:N", sort=list(parameters.names), axis=alt.Axis(title=None, grid=True, labelLimit=200))
    x = alt.X("v:Q", scale=alt.Scale(**kind), title="value less prior, in standard errors of the prior (-)")
    x = x.axis(**ticks)
    tooltip = [
        alt.Tooltip("name:N", title="parameter"),
        alt.Tooltip("own:N", title="found"),
        alt.Tooltip("known:N", title="before"),
        alt.Tooltip("share_text:N", title="from trials"),
    ]
    look = series_look(["estimate", "prior"], as_points=["estimate", "prior"])
    bands = [row | {"run": "prior", "v": 0.0, "low": -_NORMAL, "high": _NORMAL} for row in rows]
    found = [row | {"run": "estimate"} for row in rows]
    layers = [alt.Chart(data([{"v": 0.0}])).mark_rule(style="reference").encode(x="v:Q")]
    for these_rows, offset in ((found, -4), (bands, 4)):
        base = alt.Chart(data(these_rows)).encode(y=y, color=look.colour, tooltip=tooltip)
        layers.append(base.mark_rule(strokeWidth=1.8, yOffset=offset).encode(x=alt.X("low:Q"), x2="high:Q"))
        layers.append(base.mark_point(size=34, yOffset=offset).encode(x=x, shape=look.shape))
    height = 21 * len(rows)
    bare = alt.Y("name:N", sort=list(parameters.names), axis=alt.Axis(title=None, labels=False, ticks=False))
    shares = alt.X("share:Q", scale=alt.Scale(domain=[0, 100]), title="information from trials (%)")
    bars = alt.Chart(data(rows)).mark_bar(height=9, opacity=0.7).encode(x=shares, y=bare, tooltip=tooltip)
    intervals = alt.layer(*layers).properties(width=400, height=height)
    chart = alt.hconcat(intervals, bars.properties(width=150, height=height), spacing=18)
    return chart.properties(
        title=title, description="Estimates and priors with 95 % intervals, and the share of the trials in each."
    )


def _parameter_row(parameters: Parameters, place: int) -> ChartRecord:
    unit = parameters.prior_errors[place]
    value, error = (
        (parameters.values[place] - parameters.prior[place]) / unit,
        _NORMAL * parameters.errors[place] / unit,
    )
    return {
        "name": parameters.names[place],
        "v": plain(value),
        "low": plain(value - error),
        "high": plain(value + error),
        "share": plain(100 * parameters.share[place]),
        "own": f"{parameters.values[place]:.5g} ± {parameters.errors[place]:.2g}",
        "known": f"{parameters.prior[place]:.5g} ± {unit:.2g}",
        "share_text": f"{100 * parameters.share[place]:.0f} %",
    }


def _symmetric_ticks(farthest: float) -> list[float]:
    steps = [step * 10.0**power for power in range(5) for step in (2, 5, 10)]
    positive = [step for step in steps if step <= farthest][:8]
    return [-step for step in reversed(positive)] + [0.0, *positive]


def correlation_chart(known: Identifiability, *, title: str = "") -> alt.LayerChart:
    """Correlation of the estimates by the trials alone, as a heat map; frames mark :data:`CLOSE_CORRELATION`."""
    names = [name.removeprefix("derivatives.") for name in known.free]
    step = max(8, min(24, 560 // len(names)))
    rows: list[ChartRecord] = [
        {"one": name, "other": column_name, "c": plain(known.correlation[row, column])}
        for row, name in enumerate(names)
        for column, column_name in enumerate(names)
    ]
    axis = alt.Axis(title=None, labelLimit=200, ticks=False)
    x = alt.X("other:N", sort=names, axis=axis)
    y = alt.Y("one:N", sort=names, axis=axis)
    tooltip = [alt.Tooltip("one:N"), alt.Tooltip("other:N"), alt.Tooltip("c:Q", title="correlation", format=".3f")]
    colour = alt.Color(
        "c:Q", scale=alt.Scale(domain=[-1, 1], scheme="blueorange"), legend=alt.Legend(gradientLength=180)
    )
    cells = alt.Chart(data(rows)).mark_rect().encode(x=x, y=y, color=colour, tooltip=tooltip)
    close = [row for row in rows if row["one"] != row["other"] and abs(row["c"] or 0.0) > CLOSE_CORRELATION]
    frames = alt.Chart(data(close)).mark_rect(filled=False, stroke="black", strokeWidth=2)
    layers = [cells, *([frames.encode(x=x, y=y, tooltip=tooltip)] if close else [])]
    text = f"Framed: {len(known.pairs)} pairs above {CLOSE_CORRELATION:g} either way, which are known only together."
    size = {"width": step * len(names), "height": step * len(names)}
    return alt.layer(*layers).properties(
        title=alt.Title(title, subtitle=f"Colour: correlation (-). {text}"),
        description=f"Correlation of {len(names)} parameters. {text}",
        **size,
    )


def singular_value_chart(known: Identifiability, *, title: str = "") -> alt.LayerChart:
    """Singular values of the sensitivities in units of the prior, falling; below 1 the prior determines more."""
    rows = [
        {"order": place + 1, "v": plain(float(value))} for place, value in enumerate(known.singular_values) if value > 0
    ]
    x = alt.X(
        "order:Q", title="direction, by the information of the trials (-)", scale=alt.Scale(nice=False, padding=10)
    )
    x = x.axis(format="d", tickMinStep=1)
    y = alt.Y("v:Q", title="singular value (-)", scale=alt.Scale(type="log"), axis=alt.Axis(format="~g"))
    tooltip = [alt.Tooltip("order:Q", title="direction"), alt.Tooltip("v:Q", title="singular value", format=NUMBER)]
    line = alt.Chart(data([{"v": 1.0}])).mark_rule(style="limit", strokeDash=[5, 3]).encode(y="v:Q")
    points = alt.Chart(data(rows)).mark_point(filled=True, size=45).encode(x=x, y=y, tooltip=tooltip)
    return alt.layer(line, points).properties(
        title=title,
        width=620,
        height=220,
        description=f"{len(rows)} singular values; {np.count_nonzero(known.singular_values < 1)} are below 1.",
    )
