"""Charts of cards compared: differences of coefficients in standard errors, and of figures in per cent."""

from __future__ import annotations

from collections.abc import Sequence

from tank2sim.analysis.validation.coefficients import BEYOND_STANDARD_ERRORS, CoefficientRow
from tank2sim.answer.charts.parts import plain, series_look
from tank2sim.answer.charts.rows import RowPlot, names_of, row_chart, row_layers
from tank2sim.answer.charts.vega import ChartRecord, ChartSpec, PlotAxis, Rule, layered, stacked

FigurePercent = tuple[str, str, str, float, float | None]
"""Card, trial, figure in words, difference from the reference in per cent, and in standard errors."""


def errors_chart(coefficients: Sequence[CoefficientRow], labels: Sequence[str]) -> ChartSpec:
    """Differences of all coefficients in standard errors, a row each, a shape and colour for each card."""
    rows = [
        {"name": row.name, "v": difference.standard_errors, "run": label}
        for row in coefficients
        for label, difference in zip(labels[1:], row.differences, strict=True)
        if difference.standard_errors is not None
    ]
    return row_chart(
        RowPlot(
            rows=rows,
            across=PlotAxis(title="difference (standard errors)", zero=True),
            look=series_look(labels[1:], as_points=labels[1:]),
            rules=[Rule(at=[-BEYOND_STANDARD_ERRORS, BEYOND_STANDARD_ERRORS], style="limit")],
            shown={"run:N": "card", "name:N": "coefficient", "v:Q": "standard errors"},
        ),
        title="Differences in standard errors",
        described=f"Differences of {len(names_of(rows))} coefficients from {labels[0]} in standard errors.",
        step_px=15,
        filled=True,
    )


def percent_chart(percents: Sequence[FigurePercent], labels: Sequence[str], assumed: str) -> ChartSpec:
    """Differences in per cent of the reference's figure: a panel a manoeuvre, a row a figure, a shape and colour for
    each card. `assumed` is added to the title."""
    panels: dict[str, list[ChartRecord]] = {}
    ends = []
    for label, name, figure, percent, z in percents:
        trial = name.replace(" deg to", "")
        row: ChartRecord = {"run": label, "name": figure, "whole": f"{trial}: {figure}", "v": plain(percent)}
        if z:
            row |= {"low": plain(percent * (1 - 2 / abs(z))), "high": plain(percent * (1 + 2 / abs(z)))}
        ends += [float(row[key]) for key in ("v", "low", "high") if row.get(key) is not None]
        panels.setdefault(trial, []).append(row)
    across = PlotAxis(title="", domain=(min(0.0, *ends), max(0.0, *ends)))
    look = series_look(labels[1:], as_points=labels[1:])
    shown = {"run:N": "card", "whole:N": "figure", "v:Q": "difference (%)"}
    drawn = []
    for trial, rows in panels.items():
        layers = row_layers(
            RowPlot(rows=rows, across=across, look=look, shown=shown, rules=[Rule(at=[0.0])]), filled=True
        )
        title = {"text": trial, "anchor": "start", "fontSize": 11}
        drawn.append(layered(layers, size=(560, {"step": 16}), title=title))
    return stacked(
        drawn,
        title=f"Difference of the figures from {labels[0]}, %{assumed}",
        description=f"Differences of {len(percents)} figures from {labels[0]} in per cent.",
    )
