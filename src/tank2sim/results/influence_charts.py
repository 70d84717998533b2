"""Charts of influence coefficients: K % by exact slopes next to the 10 % difference, variances, and tuning."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tank2sim.analysis.influence.card_influence import InfluenceStudy
from tank2sim.analysis.influence.figures import figure_label
from tank2sim.analysis.tuning.result import TunedStudy
from tank2sim.answer.charts.matrix import Matrix
from tank2sim.answer.charts.parts import plain, series_look
from tank2sim.answer.charts.rows import RowPlot, row_chart, row_layers
from tank2sim.answer.charts.vega import ChartRecord, ChartSpec, PlotAxis, Rule, layered
from tank2sim.arrays import Array

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


def most_influential(result: InfluenceData, row: int) -> list[int]:
    """Places of the parameters with the largest K % on one figure, largest first."""
    sizes = np.nan_to_num(np.abs(result.exact[row]))
    order = [int(place) for place in np.argsort(-sizes, kind="stable") if sizes[place] > 1e-3 * sizes.max()]
    return order[:_MOST_BARS]


def influence_charts(result: InfluenceData) -> list[ChartSpec]:
    """One chart for each figure, of the parameters that move it most: bars by exact slopes, points by the 10 %
    difference."""
    return [_bars(result, row) for row in range(len(result.figures))]


def _bars(result: InfluenceData, row: int) -> ChartSpec:
    order = most_influential(result, row)
    names = [result.names[place] for place in order]
    values = {EXACT: result.exact[row], DIFFERENCE: result.difference[row]}
    both = {
        run: [
            {"run": run, "name": result.names[place], "v": plain(sizes[place])}
            | {"exact": plain(values[EXACT][place]), "step": plain(values[DIFFERENCE][place])}
            for place in order
        ]
        for run, sizes in values.items()
    }
    look = series_look([EXACT, DIFFERENCE], as_points=[EXACT, DIFFERENCE])
    across = PlotAxis(title="K (%)", zero=True, ticks=4)
    exact = RowPlot(
        rows=both[EXACT],
        across=across,
        shown={"name:N": "parameter", "exact:Q": f"K, {EXACT} (%)", "step:Q": f"K, {DIFFERENCE} (%)"},
        look=look,
        side={"labelLimit": 170},
    )
    bars = row_layers(exact, mark="bar", height=9, opacity=0.65)
    difference = replace(exact, rows=both[DIFFERENCE], rules=[Rule(at=[0.0])])
    points = row_layers(difference, size=34, strokeWidth=1.6)
    figure = figure_label(result.figures[row])
    return layered(
        [*bars, *points],
        size=(_WIDTH, 19 * len(names)),
        title=f"Influence on {figure}",
        description=f"K per cent of {len(names)} parameters on {figure}, by exact slopes and by a 10 % difference.",
    )


def variance_chart(result: InfluenceData) -> ChartSpec:
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
    cells = Matrix(
        colour="share",
        rows=figures,
        columns=names,
        names=("figure", "name"),
        scale={"domain": [0, max(10.0, float(shares.max(initial=0.0)))], "scheme": "blues"},
        legend={"title": "share of the variance (%)"},
        side={"labelLimit": 200, "ticks": False},
        foot={"labelAngle": -90, "ticks": False},
        shown={"figure:N": "figure", "name:N": "parameter", "share:Q": ("share (%)", ".1f")},
        written=False,
    ).layers
    return layered(
        cells,
        size=(_WIDTH, 28 * len(figures)),
        data={"values": rows},
        title="Standard errors behind those of the figures",
        description=f"Shares of {len(names)} parameters in the variances of {len(figures)} figures.",
    )


def moves_chart(tuned: TunedStudy) -> ChartSpec:
    """Numbers that tuning changed, in standard errors of the card, with the bounds."""
    rows: list[ChartRecord] = [
        {"name": one.name, "v": plain(one.standard_errors), "before": plain(one.before), "after": plain(one.after)}
        for one in tuned.parameters.values()
        if one.standard_errors is not None
    ][:_MOST_ROWS]
    within = tuned.within_standard_errors
    return row_chart(
        RowPlot(
            rows=rows,
            across=PlotAxis(title="move (standard errors of the card)", zero=True),
            side={"labelLimit": 170},
            rules=[Rule(at=[0.0]), Rule(at=[-within, within], style="limit", dash=(5, 3))],
            shown={
                "name:N": "parameter",
                "before:Q": ("before", ".6~g"),
                "after:Q": ("after", ".6~g"),
                "v:Q": ("standard errors", ".3f"),
            },
        ),
        title="What tuning changed",
        described=f"Moves of {len(rows)} parameters in standard errors; the bounds are at {within:g}.",
        width_px=_WIDTH,
        mark="bar",
    )
