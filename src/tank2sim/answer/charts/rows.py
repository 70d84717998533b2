"""Names in rows with a value each, as point or bar, with intervals and limits: coefficients, figures, trials."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

from tank2sim.answer.charts.parts import SeriesLook, series_look
from tank2sim.answer.charts.vega import (
    SIDE,
    ChartRecord,
    ChartSpec,
    PlotAxis,
    Rule,
    TooltipFields,
    channel,
    layer,
    layered,
    rows_where,
    tooltips,
)

ROW_STEP = 21
"""Height of a row, px."""


def names_of(rows: Sequence[ChartRecord]) -> list[str]:
    """Return the names of rows, each once, in their order."""
    return list(dict.fromkeys(str(row["name"]) for row in rows))


def runs_of(rows: Sequence[ChartRecord]) -> list[str]:
    """Return the series of rows, each once, in their order."""
    return list(dict.fromkeys(str(row["run"]) for row in rows if row.get("run")))


@dataclass(frozen=True)
class RowPlot:
    """Rows along a horizontal axis, with rules.

    `rows`: ``name`` and ``v`` (None: no mark) each; ``run`` (series), ``low``, ``high``, and what the tooltip shows;
    `shown`: fields of the tooltip; by default the name and the value; `look`: by default of the series of the rows, in
    their order; `names`: the rows from top to bottom; by default as they come; `rules`: upright lines; `side`: words of
    Vega-Lite for the axis of the names; `apart`: whether the series of a name are side by side in its row.
    """

    rows: Sequence[ChartRecord]
    across: PlotAxis
    shown: TooltipFields | None = None
    look: SeriesLook | None = None
    names: Sequence[str] = ()
    rules: Sequence[Rule] = ()
    side: Mapping[str, Any] = field(default_factory=dict)
    apart: bool = False


def row_layers(
    plot: RowPlot, *, mark: Literal["point", "bar"] = "point", span_px: float = 1.8, **style: Any
) -> list[ChartSpec]:
    """Return the layers of rows: rules, the interval from ``low`` to ``high`` where rows have one, and their value.

    `mark`: whether the value is a point or a bar from zero; `span_px`: width of an interval; **style: of the mark:
    ``size``, ``height``, ``opacity``, ``filled`` ...
    """
    rows, runs = plot.rows, runs_of(plot.rows)
    look = plot.look or (series_look(runs, as_points=runs) if runs else None)
    x = plot.across.channel("v")
    y = channel("name:N", sort=list(plot.names) or names_of(rows), title=None, axis=SIDE | dict(plot.side))
    common = {"y": y, "tooltip": tooltips(plot.shown or {"name:N": "", "v:Q": plot.across.title})}
    if look:
        common["color"] = look.colour
    if plot.apart:
        common["yOffset"] = channel("run:N", sort=runs)
    found = [replace(rule, upright=True).layer(x) for rule in plot.rules]
    if spans := rows_where(rows, lambda row: row.get("low") is not None and row.get("high") is not None):
        span = {**common, "x": plot.across.channel("low"), "x2": "high"}
        offset = {"yOffset": style["yOffset"]} if "yOffset" in style else {}
        found.append(layer("rule", spans, span, strokeWidth=span_px, clip=True, **offset))
    drawn = rows_where(rows, lambda row: row.get("v") is not None)
    if not drawn:
        return found
    if mark == "bar":
        return [*found, layer("bar", drawn, {**common, "x": x}, **({"height": 10, "opacity": 0.75} | style))]
    shape = {"shape": look.shape} if look else {}
    return [*found, layer("point", drawn, {**common, "x": x, **shape}, **({"size": 60} | style))]


def row_chart(
    plot: RowPlot,
    *,
    title: str | ChartSpec = "",
    described: str,
    width_px: int = 620,
    step_px: int = ROW_STEP,
    **marks: Any,
) -> ChartSpec:
    """Return a chart of rows.

    `described`: for those who do not see the chart; `width_px`, `step_px`: width of the plot, and height of a row;
    **marks: as of :func:`row_layers`.
    """
    size = (width_px, {"step": step_px} if plot.apart else step_px * max(1, len(names_of(plot.rows))))
    return layered(row_layers(plot, **marks), size=size, title=title, description=described)
