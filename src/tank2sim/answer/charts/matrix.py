"""A matrix: a number in a coloured cell for each trial and signal."""

from __future__ import annotations

from collections.abc import Sequence

import altair as alt

from tank2sim.answer.charts.parts import Chart

ROW_PX = 21
"""Height of a row, px."""

DARKEST = 100.0
"""Number of the darkest colour, and of all greater ones. Project choice: a misfit of so many noise units is far from
any doubt, and an error of so many per cent is as large as the signal."""

_DARK = 18
"""Number above which a cell is dark: it is written in white there."""


def matrix_layers(
    field: str,
    trials: Sequence[str],
    signals: Sequence[str],
    *,
    side: alt.Axis,
    legend: alt.Legend,
    tooltip: Sequence[alt.Tooltip],
) -> list[alt.Chart]:
    """Return the cells and the numbers of a matrix, without data.

    The data have ``trial``, ``signal``, `field` (number that colours the cell) and ``text`` (number as written).

    Parameters
    ----------
    field : str
    trials, signals : sequence of str
        Rows and columns in their order.
    side : Axis
        Axis of the trials.
    legend : Legend
    tooltip : sequence of Tooltip
        Besides the trial and the signal.
    """
    base = Chart().encode(
        x=alt.X("signal:N", sort=list(signals), scale=alt.Scale(domain=list(signals))).axis(
            title="signal", orient="bottom", labelAngle=0
        ),
        y=alt.Y("trial:N", sort=list(trials), axis=side),
        tooltip=[alt.Tooltip("trial:N"), alt.Tooltip("signal:N"), *tooltip],
    )
    colours = alt.Scale(type="log", domain=[1, DARKEST], scheme="blues", clamp=True)
    ink = alt.condition(f"datum.{field} > {_DARK}", alt.value("white"), alt.value("black"))  # whatever the page is
    return [
        base.mark_rect().encode(color=alt.Color(f"{field}:Q", scale=colours, legend=legend)),
        base.mark_text(fontSize=10.5).encode(text="text:N", color=ink),
    ]
