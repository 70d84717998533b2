"""Charts of estimated parameters: values next to the prior, correlations, information of the trials."""

from __future__ import annotations

from collections.abc import Mapping

from tank2sim.answer.charts.matrix import Matrix
from tank2sim.answer.charts.parts import plain, series_look
from tank2sim.answer.charts.rows import RowPlot, row_layers
from tank2sim.answer.charts.vega import (
    STACKS,
    ChartRecord,
    ChartSpec,
    PlotAxis,
    Rule,
    bare_layer,
    heading,
    layer,
    layered,
    tooltips,
)
from tank2sim.arrays import Array
from tank2sim.identification.trials.assessment.identifiability import CLOSE_CORRELATION
from tank2sim.identification.trials.study import IdentifiabilityStudy, ParameterEstimate, PosteriorStudy

_NORMAL = 1.959964


def value_with_error(value: float, error: float) -> str:
    """Value and standard error in words: ``-0.0035 ± 0.00012``."""
    return f"{value:.5g} ± {error:.2g}"


def parameter_chart(parameters: Mapping[str, ParameterEstimate], *, title: str = "") -> ChartSpec:
    """Estimates with their 95 % intervals next to the priors', in standard errors of the prior; shares next to."""
    found = [_parameter_row(name, parameter) for name, parameter in parameters.items()]
    farthest = max((abs(row[key] or 0.0) for row in found for key in ("low", "high")), default=1.0)
    # A few derivatives may move by dozens of standard errors, where the others move by one.
    wide = farthest > 12
    across = PlotAxis(
        title="value less prior, in standard errors of the prior (-)",
        zero=not wide,
        scale={"type": "symlog", "constant": 2} if wide else None,
        ticks=_symmetric_ticks(farthest) if wide else None,
    )
    look = series_look(["estimate", "prior"], as_points=["estimate", "prior"])
    prior = [row | {"run": "prior", "v": 0.0, "low": -_NORMAL, "high": _NORMAL} for row in found]
    shown = {"name:N": "parameter", "own:N": "found", "known:N": "before", "share_text:N": "from trials"}
    intervals = [
        *row_layers(
            RowPlot(rows=found, across=across, look=look, shown=shown, rules=[Rule(at=[0.0])]), size=34, yOffset=-4
        ),
        *row_layers(RowPlot(rows=prior, across=across, look=look, shown=shown), size=34, yOffset=4),
    ]
    shares = PlotAxis(title="information from trials (%)", domain=(0, 100))
    bare = {"labels": False, "ticks": False, "grid": False}
    bars = [{"name": row["name"], "v": row["share"]} | {key: row[key] for key in _SAID} for row in found]
    height = 21 * len(found)
    return {
        "hconcat": [
            layered(intervals, size=(400, height)),
            layered(
                row_layers(
                    RowPlot(rows=bars, across=shares, shown=shown, side=bare), mark="bar", height=9, opacity=0.7
                ),
                size=(150, height),
            ),
        ],
        "spacing": 18,
        "title": title,
        "description": "Estimates and priors with 95 % intervals, and the share of the trials in each.",
        "usermeta": STACKS,
    }


_SAID = ("own", "known", "share_text")


def _parameter_row(name: str, parameter: ParameterEstimate) -> ChartRecord:
    unit, share = parameter.prior_standard_error, 100 * parameter.share_from_trials
    value = (parameter.value - parameter.before) / unit
    error = _NORMAL * parameter.standard_error / unit
    return {
        "name": name,
        "run": "estimate",
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
) -> ChartSpec:
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
    across = PlotAxis(title="value less mean, in standard deviations (-)", zero=True)
    shown_as = {"name:N": "parameter", "found:N": "median", "interval:N": "95 %"}
    layers = row_layers(RowPlot(rows=rows, across=across, shown=shown_as), size=40)
    half = {"x": across.channel("quarter"), "x2": "three", "y": layers[0]["encoding"]["y"]}
    half["color"] = layers[0]["encoding"]["color"]
    normal = layer(
        "rect",
        [{"low": -_NORMAL, "high": _NORMAL}],
        {"x": across.channel("low"), "x2": "high"},
        style="reference",
        opacity=0.15,
    )
    return layered(
        [normal, *layers, layer("rule", rows, half, strokeWidth=4)],
        size=(560, 19 * len(rows)),
        title=title,
        description="Medians and intervals of sampled parameters next to the 95 % interval of a normal distribution.",
    )


def correlation_chart(known: IdentifiabilityStudy, *, title: str = "") -> ChartSpec:
    """Correlation of the estimates by the trials alone, as a heat map; frames mark :data:`CLOSE_CORRELATION`."""
    names = list(known.parameters)
    step = max(8, min(24, 560 // len(names)))
    rows: list[ChartRecord] = [
        {"one": name, "other": column_name, "c": plain(float(value))}
        for name, row in zip(names, known.correlation, strict=True)
        for column_name, value in zip(names, row, strict=True)
    ]
    axis = {"labelLimit": 200, "ticks": False}
    (cells,) = Matrix(
        colour="c",
        rows=names,
        columns=names,
        names=("one", "other"),
        scale={"domain": [-1, 1], "scheme": "blueorange"},
        side=axis,
        foot=axis,
        shown={"one:N": "one", "other:N": "other", "c:Q": ("correlation", ".3f")},
        written=False,
    ).layers
    close = f"datum.one !== datum.other && abs(datum.c) > {CLOSE_CORRELATION}"
    frames = bare_layer(
        "rect",
        {name: cells["encoding"][name] for name in ("x", "y", "tooltip")},
        filled=False,
        stroke="black",
        strokeWidth=2,
    )
    pairs = len(known.correlated_pairs)
    text = f"Framed: {pairs} pairs above {CLOSE_CORRELATION:g} either way, which are known only together."
    return layered(
        [cells, frames | {"transform": [{"filter": close}]}],
        size=(step * len(names), step * len(names)),
        data={"values": rows},
        title=heading(title, f"Colour: correlation (-). {text}"),
        description=f"Correlation of {len(names)} parameters. {text}",
    )


def singular_value_chart(values: Array, *, title: str = "") -> ChartSpec:
    """Singular values of the sensitivities in units of the prior, falling; below 1 the prior determines more."""
    rows = [{"order": order, "v": plain(value)} for order, value in enumerate(values.tolist(), start=1) if value > 0]
    across = PlotAxis(
        title="direction, by the information of the trials (-)", nice=False, padding=10, form="d", zero=True
    )
    x, up = across.channel("order"), PlotAxis(title="singular value (-)", log=True, form="~g")
    x["axis"] |= {"tickMinStep": 1}
    place: ChartSpec = {"x": x, "y": up.channel("v")}
    place["tooltip"] = tooltips({"order:Q": ("direction", "d"), "v:Q": "singular value"})
    return layered(
        [
            Rule(at=[1.0], style="limit", dash=(5, 3)).layer(place["y"]),
            layer("point", rows, place, filled=True, size=45),
        ],
        size=(620, 220),
        title=title,
        description=f"{len(rows)} singular values; {sum(value < 1 for value in values)} are below 1.",
    )
