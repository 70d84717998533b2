"""Charts of what could explain a gap: the missing force over states, the rivals, what each trial alone would have."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from tank2sim.answer.charts.parts import extent, plain, series_look, with_unit
from tank2sim.answer.charts.rows import RowPlot, row_layers
from tank2sim.answer.charts.vega import (
    STACKS,
    ChartRecord,
    ChartSpec,
    PlotAxis,
    Rule,
    channel,
    heading,
    layer,
    layered,
    panel_title,
    rows_where,
    tooltips,
)
from tank2sim.answer.numbers import format_number
from tank2sim.arrays import Array
from tank2sim.gap.outcome.export import joined
from tank2sim.gap.outcome.lacking import NORMAL
from tank2sim.gap.outcome.study import DecidingTest, GapStudy, Lacking, TrialEstimate
from tank2sim.results.gap_charts import SETS
from tank2sim.results.gap_text import as_percent, trial_name
from tank2sim.units import in_words

MOST_RIVALS = 12
"""Explanations, and manoeuvres for the next test, that are shown: the best (project choice)."""

UNINFORMATIVE = 10.0
"""Standard error over the smallest from which the bar of a trial may leave the picture."""

_STATE_WORDS = {"rudder": "rudder angle", "drift": "drift angle"}
_MISSING = {
    "X": ("surge force", "N"),
    "Y": ("sway force", "N"),
    "N": ("yaw moment", "N m"),
    "north": ("velocity to north", "m/s"),
    "east": ("velocity to east", "m/s"),
    "ahead": ("velocity ahead", "m/s"),
    "starboard": ("velocity to starboard", "m/s"),
    "turning": ("rate of heading", "deg/s"),
}


class _Missing(NamedTuple):
    """What is missing: its words, the shown unit, and what values are divided by."""

    words: str
    unit: str
    scale: float


def _missing(lacking: Lacking) -> _Missing:
    words, unit = _MISSING[lacking.name]
    if not unit.startswith("N"):
        return _Missing(words, unit, 1.0)
    prefix, scale = _prefix(np.concatenate([columns[lacking.value_column] for columns in lacking.points.values()]))
    return _Missing(words, prefix + unit, scale)


def lacking_chart(lacking: Lacking, *, title: str = "") -> ChartSpec:
    """The missing force or signal over the state that explains most of it, and how much of it each state explains.

    Points are single instants of all trials, thinned. Squares are means of bins; their bars are 95 % by the spread
    between the trials in the bin, for instants of one trial do not err independently.
    """
    state, value = lacking.state_column, lacking.value_column
    words = _STATE_WORDS.get(lacking.explaining, lacking.explaining)
    what, means = _missing(lacking), lacking.means
    cloud_rows: list[ChartRecord] = [
        {"s": plain(over), "f": plain(size / what.scale), "trial": trial_name(trial)}
        for trial, points in lacking.points.items()
        for over, size in zip(points[state], points[value], strict=True)
    ]
    mean_rows: list[ChartRecord] = [
        {"s": plain(over), "trials": int(trials)}
        | {key: plain(size / what.scale) for key, size in zip(("f", "low", "high"), sizes, strict=True)}
        for over, trials, *sizes in zip(
            *(means[key] for key in (state, "trials", value, "low_95", "high_95")), strict=True
        )
    ]
    across, up = with_unit(words, in_words(state)[1]), with_unit(f"missing {what.words}", what.unit)
    x = PlotAxis(across, nice=False, padding=8, ticks=6)
    y = PlotAxis(up, zero=True, ticks=6)
    place = {"x": x.channel("s"), "y": y.channel("f")}
    cloud = place | {"tooltip": tooltips({"trial:N": "trial", "s:Q": across, "f:Q": up})}
    layers = [
        Rule([0.0], dash=(4, 3)).layer(place["y"]),
        layer("point", cloud_rows, cloud, style="reference", size=12, opacity=0.45, clip=True),
        *_means(mean_rows, place, y.channel("low")),
    ]
    return {
        "hconcat": [layered(layers, size=(400, 280)), _explained(lacking)],
        "spacing": 24,
        "title": title,
        "description": f"Missing {what.words} over {words}, and what each state explains.",
        "usermeta": STACKS,
    }


def when_chart(lacking: Lacking, *, title: str = "") -> ChartSpec:
    """What is missing over time, a strip a trial: the colour is its size to either side."""
    what = _missing(lacking)
    names = [trial_name(trial) for trial in lacking.over_time]
    rows: list[ChartRecord] = [
        {"trial": trial_name(trial), "f": plain(value / what.scale), "t": plain(begin), "to": plain(end)}
        for trial, parts in lacking.over_time.items()
        for begin, end, value in zip(
            *(parts[key] for key in ("t_start_s", "t_end_s", lacking.value_column)), strict=True
        )
    ]
    largest = float(np.quantile(np.abs([row["f"] or 0.0 for row in rows]), 0.98)) or 1.0 if rows else 1.0
    up = with_unit(f"missing {what.words}", what.unit)
    scale = {"domain": [-largest, 0, largest], "range": list(DIVERGING), "type": "linear", "clamp": True}
    legend = {"title": up, "gradientLength": 180, "titleLimit": 420}
    strips = {
        "x": PlotAxis("time (s)", nice=False, zero=True).channel("t"),
        "x2": "to",
        "y": channel("trial:N", sort=names, title=None, axis={"labelLimit": 220}),
        "color": channel("f:Q", scale=scale, legend=legend),
        "tooltip": tooltips({"trial:N": "trial", "t:Q": "from (s)", "to:Q": "to (s)", "f:Q": up}),
    }
    return layered(
        [layer("rect", rows, strips)],
        size=(520, 20 * max(1, len(names))),
        title=title,
        description=f"Missing {what.words} over time, by trial.",
    )


DIVERGING = ("#D55E00", "#f7f7f7", "#0072B2")
"""Colours of a size to either side: two of the palette that any eye distinguishes."""


def _means(rows: Sequence[ChartRecord], place: ChartSpec, low: ChartSpec) -> list[ChartSpec]:
    drawn = [row | {"run": "mean of a bin"} for row in rows]
    colour = {"color": channel("run:N", legend=None)}
    x, y = place["x"], place["y"]
    said = tooltips({"s:Q": x["title"], "f:Q": f"mean {y['title']}", "trials:Q": "trials in the bin"})
    ends = rows_where(drawn, lambda row: row["low"] is not None)
    marks = {**place, **colour, "tooltip": said}
    return [
        layer("line", drawn, {**place, **colour}, strokeWidth=1.4, clip=True),
        layer("rule", ends, {"x": x, "y": low, "y2": "high", **colour}, strokeWidth=1.6, clip=True),
        layer("point", drawn, marks, shape="square", filled=True, size=44),
    ]


def _explained(lacking: Lacking) -> ChartSpec:
    rows: list[ChartRecord] = [
        {"name": _STATE_WORDS.get(name, name), "v": plain(100 * share), "text": f"{100 * share:.0f} %"}
        for name, share in sorted(lacking.explained.items(), key=lambda item: -item[1])
    ]
    across = PlotAxis("share of it that each state explains (%)", domain=(0, 140), nice=False, ticks=[0, 50, 100])
    return _bars(rows, across, width=150)


_LINES = r"split(replace(datum.label, / \+ /g, '|+ '), '|')"
"""Labels of several effects with a line for each: a narrow page has no room for more."""


def _bars(rows: Sequence[ChartRecord], across: PlotAxis, *, width: int, **more: Any) -> ChartSpec:
    """Bars with their number at the end."""
    side = {"labelExpr": _LINES, "labelLimit": 150, "ticks": False, "grid": False}
    (bars,) = row_layers(RowPlot(rows, across=across, side=side), mark="bar", height=11, clip=True)
    place = {name: bars["encoding"][name] for name in ("x", "y")}
    texts = layer("text", rows, {**place, "text": "text:N"}, align="left", dx=5, fontSize=10.5, style="reference")
    lines = max((row["name"].count(" + ") + 1 for row in rows), default=1)
    return layered([bars, texts], size=(width, (10 + 12 * lines) * max(1, len(rows))), **more)


def _from_zero(rows: Sequence[ChartRecord], title: str, *, symlog: bool = False) -> PlotAxis:
    """An axis with room on the right for the number at the end of the longest bar."""
    farthest = max((row["v"] or 0.0 for row in rows), default=0.0) or 1.0
    if not symlog:
        return PlotAxis(title, domain=(0, 1.25 * farthest), nice=False, ticks=4)
    powers = [step for step in (0, 10, 100, 1e3, 1e4, 1e5, 1e6) if step <= 12 * farthest]
    scale = {"type": "symlog", "constant": 10}
    return PlotAxis(title, domain=(0, 12 * farthest), nice=False, scale=scale, ticks=powers)


def rival_chart(study: GapStudy, *, title: str = "") -> ChartSpec | None:
    """Explanations that were compared, with their loss of score to the best; None without any."""
    ranked = sorted(study.rivals, key=lambda rival: rival.loss)
    shown, none = ranked[:MOST_RIVALS], [rival for rival in ranked[MOST_RIVALS:] if not rival.effects]
    if not shown:
        return None
    rows: list[ChartRecord] = [
        {
            "name": joined(rival.effects).replace("_", " ") if rival.effects else "no effect (coefficients alone)",
            "v": plain(rival.loss),
            "text": f"{format_number(rival.loss, 3)}  ({as_percent(rival.probability)})",
        }
        for rival in (*shown, *none)
    ]
    symlog = max(row["v"] or 0.0 for row in rows) > 100
    across = _from_zero(rows, "worse than the best by, -2 log likelihood", symlog=symlog)
    described = "Explanations by their loss of score."
    return _bars(rows, across, width=430, title=heading(title, _COMPARED), description=described)


_COMPARED = (
    "A longer bar explains the data less well; the best has 0. In brackets: probability that the explanation is right "
    "as a whole, with nothing more and nothing less missing. Each effect lowers it by its prior odds; an effect within "
    "three standard errors of its absence makes it zero. The probability of an effect is the sum over all explanations "
    "that contain it."
)


def expected_chart(test: DecidingTest, *, title: str = "") -> ChartSpec | None:
    """How far apart the explanations would be in each manoeuvre that was considered; None without any."""
    best = sorted(test.expected.items(), key=lambda item: -item[1])[:MOST_RIVALS]
    sizes = [(name, math.sqrt(max(score, 0.0))) for name, score in best]  # of a score: a difference in noise units
    rows: list[ChartRecord] = [{"name": name, "v": plain(size), "text": format_number(size, 2)} for name, size in sizes]
    if not rows:
        return None
    across = _from_zero(rows, "expected difference (noise units)")
    return _bars(rows, across, width=430, title=title, description="Expected difference in each manoeuvre.")


def agreement_chart(study: GapStudy, *, title: str = "") -> ChartSpec | None:
    """What each trial alone would have each parameter of the effect, with 95 % intervals; None without any.

    The grey band is the 95 % interval of all fitting trials together.
    """
    panels = [
        _agreement_panel(study, name, trials, named=not place)
        for place, (name, trials) in enumerate(item for item in study.agreement.items() if item[1])
    ]
    if not panels:
        return None
    return {
        "hconcat": panels,
        "spacing": 20,
        "resolve": {"scale": {"color": "shared", "shape": "shared"}},
        "title": title,
        "description": "Each trial's own estimate of the parameters, with 95 % intervals.",
        "usermeta": STACKS,
    }


def _agreement_panel(study: GapStudy, name: str, trials: Mapping[str, TrialEstimate], *, named: bool) -> ChartSpec:
    effect, _, parameter = name.rpartition(".")
    words, unit = in_words(parameter)
    held = {trial.trial: trial.held_out for trial in study.trials}
    whole = [one for one in study.effects if one.name == effect and parameter in one.parameters][:1]
    middles = [one.parameters[parameter] for one in whole]
    bands = [NORMAL * one.standard_errors.get(parameter, 0.0) for one in whole]
    edges = [(middle - band, middle + band) for middle, band in zip(middles, bands, strict=True)]
    around = middles if parameter == "direction_deg" else []
    rows = [_row_of_trial(trial, alone, held.get(trial, False), *around) for trial, alone in trials.items()]
    across = PlotAxis(with_unit(words, unit), domain=_informative_range(rows, edges), nice=False, ticks=5)
    names = [trial_name(trial) for trial in held if trial in trials]
    side = {"labelLimit": 220} | ({} if named else {"labels": False, "ticks": False})
    shown = {"name:N": "trial", "v:Q": "estimate", "low:Q": "from", "high:Q": "to"}
    look = series_look(list(SETS), as_points=list(SETS))
    layers = row_layers(
        RowPlot(rows, across=across, look=look, names=names, side=side, shown=shown), size=36, clip=True
    )
    strips: list[ChartRecord] = [{"low": plain(low), "high": plain(high)} for low, high in edges]
    if strips:
        strip = layer("rect", strips, {"x": across.channel("low"), "x2": "high"}, style="reference", opacity=0.25)
        layers = [strip, Rule(middles, upright=True).layer(across.channel("v")), *layers]
    title = panel_title(f"{effect.replace('_', ' ')}: {words}")
    return layered(layers, size=(230, 22 * len(names)), title=title)


def _row_of_trial(trial: str, alone: TrialEstimate, held_out: bool, around: float | None = None) -> ChartRecord:
    """A trial's estimate with its 95 % interval; a direction (deg) within half a turn of that of all trials."""
    estimate, half = alone.value, NORMAL * alone.standard_error
    if around is not None:
        estimate += 360.0 * round((around - estimate) / 360.0)
    word = next(word for word, value in SETS.items() if value == held_out)
    ends = {"low": plain(estimate - half), "high": plain(estimate + half)}
    return {"name": trial_name(trial), "run": word, "v": plain(estimate)} | ends


def _informative_range(rows: Sequence[ChartRecord], also: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Range that holds other values and the intervals of the trials that determine the parameter, with a margin."""
    every = np.array([[row["low"], row["high"]] for row in rows], dtype=float).reshape(-1, 2)
    known = every[np.isfinite(every).all(axis=1)]
    widths = np.ptp(known, axis=1)
    informative = known[widths <= UNINFORMATIVE * widths.min(initial=math.inf)]
    low, high = extent(np.array([*informative, *also], dtype=float))
    margin = 0.05 * (high - low) or 1.0
    return low - margin, high + margin


def _prefix(values: Array) -> tuple[str, float]:
    """Prefix of a force's unit, and what a force in N is divided by."""
    low, high = extent(values)
    largest = max(abs(low), abs(high))
    return next(((word, size) for word, size in (("G", 1e9), ("M", 1e6), ("k", 1e3)) if largest >= size), ("", 1.0))
