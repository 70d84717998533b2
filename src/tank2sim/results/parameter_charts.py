"""Charts of estimated parameters: values next to the prior, correlations, information of the trials."""

from __future__ import annotations

from collections.abc import Mapping

import altair as alt

from tank2sim.answer.charts.parts import NUMBER, STACKS, Chart, ChartRecord, data, plain, series_look
from tank2sim.arrays import Array
from tank2sim.identification.trials.assessment.identifiability import CLOSE_CORRELATION
from tank2sim.identification.trials.study import IdentifiabilityStudy, ParameterEstimate, PosteriorStudy

_NORMAL = 1.959964


def value_with_error(value: float, error: float) -> str:
    """Value and standard error in words: ``-0.0035 ± 0.00012``."""
    return f"{value:.5g} ± {error:.2g}"


def parameter_chart(parameters: Mapping[str, ParameterEstimate], *, title: str = "") -> alt.HConcatChart:
    """Estimates with their 95 % intervals next to the priors', in standard errors of the prior; shares next to."""
    rows = [_parameter_row(name, parameter) for name, parameter in parameters.items()]
    farthest = max((abs(row[key] or 0.0) for row in rows for key in ("low", "high")), default=1.0)
    # A few derivatives may move by dozens of standard errors, where the others move by one.
    kind = {"type": "symlog", "constant": 2} if farthest > 12 else {}
    ticks = {"values": _symmetric_ticks(farthest)} if kind else {}
    y = alt.Y("name:N", sort=list(parameters), axis=alt.Axis(title=None, grid=True, labelLimit=200))
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
    layers = [Chart(data([{"v": 0.0}])).mark_rule(style="reference").encode(x="v:Q")]
    for these_rows, offset in ((found, -4), (bands, 4)):
        base = Chart(data(these_rows)).encode(y=y, color=look.colour, tooltip=tooltip)
        layers.append(base.mark_rule(strokeWidth=1.8, yOffset=offset).encode(x=alt.X("low:Q"), x2="high:Q"))
        layers.append(base.mark_point(size=34, yOffset=offset).encode(x=x, shape=look.shape))
    height = 21 * len(rows)
    bare = alt.Y("name:N", sort=list(parameters), axis=alt.Axis(title=None, labels=False, ticks=False))
    shares = alt.X("share:Q", scale=alt.Scale(domain=[0, 100]), title="information from trials (%)")
    bars = Chart(data(rows)).mark_bar(height=9, opacity=0.7).encode(x=shares, y=bare, tooltip=tooltip)
    intervals = alt.layer(*layers).properties(width=400, height=height)
    chart = alt.hconcat(intervals, bars.properties(width=150, height=height), spacing=18)
    return chart.properties(
        title=title,
        description="Estimates and priors with 95 % intervals, and the share of the trials in each.",
        usermeta=STACKS,
    )


def _parameter_row(name: str, parameter: ParameterEstimate) -> ChartRecord:
    unit, share = parameter.prior_standard_error, 100 * parameter.share_from_trials
    value = (parameter.value - parameter.before) / unit
    error = _NORMAL * parameter.standard_error / unit
    return {
        "name": name,
        "v": plain(value),
        "low": plain(value - error),
        "high": plain(value + error),
        "share": plain(share),
        "own": value_with_error(parameter.value, parameter.standard_error),
        "known": value_with_error(parameter.before, unit),
        "share_text": f"{share:.0f} %",
    }


def _symmetric_ticks(farthest: float) -> list[float]:
    steps = [step * 10.0**power for power in range(5) for step in (2, 5, 10)]
    positive = [step for step in steps if step <= farthest][:8]
    return [-step for step in reversed(positive)] + [0.0, *positive]


def posterior_chart(
    parameters: Mapping[str, ParameterEstimate], posterior: PosteriorStudy, *, title: str = ""
) -> alt.LayerChart:
    """Median and intervals of 50 and 95 % of each sampled parameter, in its standard deviations from its mean.

    The grey band is the 95 % interval of a normal distribution.
    """
    rows: list[ChartRecord] = []
    for name, entry in posterior.parameters.items():
        mean, deviation = parameters[name].value, parameters[name].standard_error
        low, quarter, middle, three, high = entry.quantiles
        scaled = {"low": low, "quarter": quarter, "v": middle, "three": three, "high": high}
        shown = {key: plain((value - mean) / deviation) for key, value in scaled.items()}
        rows.append(
            {"name": name, **shown, "interval": f"{low:.4g} to {high:.4g}", "found": f"{middle:.4g}", "run": "samples"}
        )
    look = series_look(["samples"], as_points=["samples"])
    y = alt.Y("name:N", sort=[str(row["name"]) for row in rows], axis=alt.Axis(title=None, grid=True, labelLimit=200))
    x = alt.X("v:Q", title="value less mean, in standard deviations (-)")
    tooltip = [
        alt.Tooltip("name:N", title="parameter"),
        alt.Tooltip("found:N", title="median"),
        alt.Tooltip("interval:N", title="95 %"),
    ]
    normal = Chart(data([{"low": -_NORMAL, "high": _NORMAL}])).mark_rect(style="reference", opacity=0.15)
    base = Chart(data(rows)).encode(y=y, color=look.colour, tooltip=tooltip)
    layers = [
        normal.encode(x=alt.X("low:Q"), x2="high:Q"),
        base.mark_rule(strokeWidth=1.4).encode(x=alt.X("low:Q"), x2="high:Q"),
        base.mark_rule(strokeWidth=4).encode(x=alt.X("quarter:Q"), x2="three:Q"),
        base.mark_point(size=40).encode(x=x, shape=look.shape),
    ]
    description = "Medians and intervals of sampled parameters next to the 95 % interval of a normal distribution."
    return alt.layer(*layers).properties(width=560, height=19 * len(rows), title=title, description=description)


def correlation_chart(known: IdentifiabilityStudy, *, title: str = "") -> alt.LayerChart:
    """Correlation of the estimates by the trials alone, as a heat map; frames mark :data:`CLOSE_CORRELATION`."""
    names = list(known.parameters)
    step = max(8, min(24, 560 // len(names)))
    rows: list[ChartRecord] = [
        {"one": name, "other": column_name, "c": plain(float(value))}
        for name, row in zip(names, known.correlation, strict=True)
        for column_name, value in zip(names, row, strict=True)
    ]
    axis = alt.Axis(title=None, labelLimit=200, ticks=False)
    x = alt.X("other:N", sort=names, axis=axis)
    y = alt.Y("one:N", sort=names, axis=axis)
    tooltip = [alt.Tooltip("one:N"), alt.Tooltip("other:N"), alt.Tooltip("c:Q", title="correlation", format=".3f")]
    colour = alt.Color(
        "c:Q", scale=alt.Scale(domain=[-1, 1], scheme="blueorange"), legend=alt.Legend(gradientLength=180)
    )
    cells = Chart(data(rows)).mark_rect().encode(x=x, y=y, color=colour, tooltip=tooltip)
    close = [row for row in rows if row["one"] != row["other"] and abs(row["c"] or 0.0) > CLOSE_CORRELATION]
    frames = Chart(data(close)).mark_rect(filled=False, stroke="black", strokeWidth=2)
    layers = [cells, *([frames.encode(x=x, y=y, tooltip=tooltip)] if close else [])]
    pairs = len(known.correlated_pairs)
    text = f"Framed: {pairs} pairs above {CLOSE_CORRELATION:g} either way, which are known only together."
    size = {"width": step * len(names), "height": step * len(names)}
    return alt.layer(*layers).properties(
        title=alt.Title(title, subtitle=f"Colour: correlation (-). {text}"),
        description=f"Correlation of {len(names)} parameters. {text}",
        **size,
    )


def singular_value_chart(values: Array, *, title: str = "") -> alt.LayerChart:
    """Singular values of the sensitivities in units of the prior, falling; below 1 the prior determines more."""
    rows = [{"order": order, "v": plain(value)} for order, value in enumerate(values.tolist(), start=1) if value > 0]
    x = alt.X(
        "order:Q", title="direction, by the information of the trials (-)", scale=alt.Scale(nice=False, padding=10)
    )
    x = x.axis(format="d", tickMinStep=1)
    y = alt.Y("v:Q", title="singular value (-)", scale=alt.Scale(type="log"), axis=alt.Axis(format="~g"))
    tooltip = [alt.Tooltip("order:Q", title="direction"), alt.Tooltip("v:Q", title="singular value", format=NUMBER)]
    line = Chart(data([{"v": 1.0}])).mark_rule(style="limit", strokeDash=[5, 3]).encode(y="v:Q")
    points = Chart(data(rows)).mark_point(filled=True, size=45).encode(x=x, y=y, tooltip=tooltip)
    return alt.layer(line, points).properties(
        title=title,
        width=620,
        height=220,
        description=f"{len(rows)} singular values; {sum(value < 1 for value in values)} are below 1.",
    )
