"""Chart of a validation: comparison errors next to their uncertainty."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from tank2sim.analysis.validation.study import Validated
from tank2sim.answer.charts.rows import RowPlot, names_of, row_layers
from tank2sim.answer.charts.vega import SIDE, ChartSpec, PlotAxis, Rule, channel, layer, layered
from tank2sim.units import in_words

COMPARISON_ERRORS = (
    "Points: error E of the simulation. Bars: plus and minus its uncertainty U_val; a point within its bar is "
    "validated, if the bar is short enough. The number names the trial."
)
"""Caption of the chart of comparison errors."""


def comparison_error_chart(figures: Sequence[Validated], numbers: Mapping[str, int]) -> ChartSpec:
    """E of each figure next to plus and minus U_val, in per cent of D.

    `numbers` are those of the trials by name.
    """
    rows = [
        {
            "name": f"{numbers[figure.trial]}: {in_words(figure.name)[0]}",
            "trial": figure.trial,
            "v": 100 * figure.error / abs(figure.measured),
            "least": -(figure.level_percent or 0.0),
            "most": figure.level_percent or 0.0,
            "run": figure.outcome.value,
        }
        for figure in figures
        if figure.error is not None and figure.measured
    ]
    across = PlotAxis(title="per cent of the measured figure", zero=True)
    y = channel("name:N", sort=names_of(rows), title=None, axis=SIDE | {"labelLimit": 170})
    bars = layer("bar", rows, {"x": across.channel("least"), "x2": "most", "y": y}, style="uncertainty", height=14)
    shown = {"trial:N": "trial", "name:N": "figure", "v:Q": "E (%)", "most:Q": "U_val (%)"}
    side = {"labelLimit": 170}
    points = row_layers(
        RowPlot(rows=rows, across=across, shown=shown, side=side, rules=[Rule(at=[0.0])]), filled=True, size=80
    )
    return layered(
        [bars, *points],
        size=(520, {"step": 24}),
        title="Comparison error and validation uncertainty",
        description=f"Comparison error of {len(rows)} figures next to the validation uncertainty.",
    )
