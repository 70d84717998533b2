"""Chart of a validation: comparison errors next to their uncertainty."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import altair as alt

from tank2sim.analysis.validation.study import Validated
from tank2sim.answer.charts.parts import NUMBER, Chart, data, series_look
from tank2sim.units import in_words

COMPARISON_ERRORS = (
    "Points: error E of the simulation. Bars: plus and minus its uncertainty U_val; a point within its bar is "
    "validated, if the bar is short enough. The number names the trial."
)
"""Caption of the chart of comparison errors."""


def comparison_error_chart(figures: Sequence[Validated], numbers: Mapping[str, int]) -> alt.LayerChart:
    """E of each figure next to plus and minus U_val, in per cent of D.

    `numbers` are those of the trials by name.
    """
    rows = []
    for figure in figures:
        if figure.error is None or not figure.measured:
            continue
        content = {
            "name": f"{numbers[figure.trial]}: {in_words(figure.name)[0]}",
            "trial": figure.trial,
            "e": 100 * figure.error / abs(figure.measured),
        }
        level = figure.level_percent or 0.0
        rows.append({**content, "low": -level, "high": level, "run": figure.outcome.value})
    names = [str(row["name"]) for row in rows]
    y = alt.Y("name:N", sort=names, title=None, axis=alt.Axis(labelLimit=170))
    outcomes = list(dict.fromkeys(str(row["run"]) for row in rows))
    look = series_look(outcomes, as_points=outcomes)
    base = Chart(data(rows))
    x = alt.X("low:Q", title="per cent of the measured figure")
    bars = base.mark_bar(style="uncertainty", height=14).encode(x=x, x2="high:Q", y=y)
    zero = Chart(data([{"zero": 0.0}])).mark_rule(style="reference").encode(x="zero:Q")
    points = base.mark_point(filled=True, size=80).encode(
        x="e:Q",
        y=y,
        color=look.colour,
        shape=look.shape,
        tooltip=[
            alt.Tooltip("trial:N", title="trial"),
            alt.Tooltip("name:N", title="figure"),
            alt.Tooltip("e:Q", title="E (%)", format=NUMBER),
            alt.Tooltip("high:Q", title="U_val (%)", format=NUMBER),
        ],
    )
    chart: alt.LayerChart = alt.layer(bars, zero, points).properties(
        title="Comparison error and validation uncertainty",
        width=520,
        height=alt.Step(24),
        description=f"Comparison error of {len(rows)} figures next to the validation uncertainty.",
    )
    return chart
