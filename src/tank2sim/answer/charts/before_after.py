"""A switch between before and after in a chart, by mouse or keyboard, and the map of misfits that has it."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence

from tank2sim.answer.charts.matrix import DARKEST, ROW_PX, Matrix
from tank2sim.answer.charts.vega import STACKS, ChartRecord, ChartSpec, channel, heading

BOTH, ALL = "both", "all"
"""The first setting of a switch, and that on paper: two series together, or more of them."""

_NAME = "shown"


def switch(words: Sequence[str]) -> list[ChartSpec]:
    """The parameter of a chart by which its reader takes one of `words`, or them together; none for less than two."""
    if len(words) < 2:
        return []
    together = BOTH if len(words) == 2 else ALL
    choice = {"input": "radio", "options": [*words, together], "name": "Show: "}
    return [{"name": _NAME, "bind": choice, "value": together}]


def before_after_switch(series: Mapping[str, str], field: str = "run") -> str:
    """The filter of a chart with a :func:`switch`: rows whose `field` is the series chosen, or no series of it.

    `series`: word of the switch to the name of the series in the rows; `field`: field of the rows that names the
    series.
    """
    if len(series) < 2:
        return "true"
    names, of = json.dumps(list(series.values())), json.dumps(dict(series))
    return f"!{of}[{_NAME}] || datum.{field} === {of}[{_NAME}] || indexof({names}, datum.{field}) < 0"


IN_NOISE = "misfit (noise units)"
"""What the cells of :func:`misfit_maps` usually hold."""

_SUBTITLE = "Number and colour: root mean square of simulated less measured, in standard deviations of the noise."


def misfit_maps(
    rows: Sequence[ChartRecord],
    models: Sequence[str],
    *,
    title: str = "",
    what: str = IN_NOISE,
    subtitle: str = _SUBTITLE,
    shown: Mapping[str, str] | None = None,
) -> ChartSpec:
    """Misfit of each signal in each trial, in one scale of colours, to switch between models.

    `rows`: ``group`` (words for a kind of trials, or nothing), ``trial``, ``signal``, ``model`` and ``misfit`` (-)
    each; `models`: names to switch between, in their order from left to right; `what`, `subtitle`: what a cell holds;
    `shown`: further fields of the tooltip.
    """
    groups = list(dict.fromkeys(row["group"] for row in rows))
    signals = list(dict.fromkeys(row["signal"] for row in rows))
    parts = [[row for row in rows if row["group"] == group] for group in groups]
    return {
        "vconcat": [_maps(part, signals, models, what, {"text:N": what, **(shown or {})}) for part in parts],
        "spacing": 18,
        "params": switch(models),
        "title": heading(title, subtitle),
        "description": f"{what[:1].upper()}{what[1:]} by trial and signal, {' and '.join(models)}.",
        "usermeta": STACKS,
    }


def _maps(
    rows: Sequence[ChartRecord], signals: Sequence[str], models: Sequence[str], what: str, shown: Mapping[str, str]
) -> ChartSpec:
    heads = {model: f"{rows[0]['group']}, {model}".removeprefix(", ") for model in models}
    cells = [
        {name: value for name, value in row.items() if name != "group"}
        | {"head": heads[row["model"]], "misfit": min(row["misfit"], DARKEST), "text": in_noise(row["misfit"])}
        for row in rows
    ]
    trials = list(dict.fromkeys(row["trial"] for row in rows))
    layers = Matrix(
        colour="misfit",
        rows=trials,
        columns=signals,
        side={"labelLimit": 230},
        foot={"title": "signal", "orient": "bottom", "labelAngle": 0},
        legend={"title": what, "gradientLength": 180},
        shown={"trial:N": "trial", "signal:N": "signal", **shown},
    ).layers
    cell_px = max(40, 6 * max((len(name) for name in signals), default=0) + 8)
    head = {"title": None, "labelFontSize": 11, "labelAnchor": "start", "labelLimit": 260}
    return {
        "data": {"values": cells},
        "transform": [{"filter": before_after_switch({model: model for model in models}, "model")}],
        "facet": {"column": channel("head:N", sort=list(heads.values()), header=head)},
        "spec": {"layer": layers, "width": cell_px * len(signals), "height": ROW_PX * len(trials)},
        "spacing": 16,
    }


def in_noise(misfit: float) -> str:
    """A misfit as a cell shows it: two figures, or more where it has them before the point."""
    if not math.isfinite(misfit):
        return "∞"
    if misfit >= 1e4:
        return f"{misfit:.0e}".replace("e+0", "e").replace("e+", "e")
    return f"{misfit:.0f}" if misfit >= 9.95 else f"{misfit:.1f}"
