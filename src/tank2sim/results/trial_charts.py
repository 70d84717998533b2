"""Charts of trials next to simulations by two cards: tracks, histories, errors over windows, figures."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TypeVar

import numpy as np

from tank2sim.answer.charts.before_after import before_after_switch, misfit_maps, switch
from tank2sim.answer.charts.parts import equal_frame, extent, plain, records, series_look, with_unit
from tank2sim.answer.charts.rows import RowPlot, row_layers
from tank2sim.answer.charts.vega import (
    STACKS,
    ChartRecord,
    ChartSpec,
    PlotAxis,
    Rule,
    bare_layer,
    layer,
    layered,
    panel_title,
    shared_looks,
    tooltips,
)
from tank2sim.answer.parts import Illustration
from tank2sim.arrays import Array
from tank2sim.identification.trials.study import PredictedFigure, TrialErrors, TrialMotions
from tank2sim.records.thinning import Indices, thin_points
from tank2sim.units import in_words

_T = TypeVar("_T")

MEASURED, BEFORE, AFTER = "measured", "card before", "card found"

MODEL_SERIES = {"before": BEFORE, "after": AFTER}
"""Word of the switch to the series that it shows."""

PANELS_PER_ROW = 3
"""Trials next to each other in a picture."""

MOST_TRIALS = 12
"""Trials of which tracks and histories are shown: the worst. More are hard to look at, and make the page slow (project
choice)."""

PER_SHEET = 6
"""Trials in one picture of histories: as many as are readable on a sheet of paper."""

MODEL_SAMPLES, MEASURED_SAMPLES = 140, 40
"""Samples of a line, and points of a series, in a small panel (about 200 px wide)."""

SERIES = {MEASURED: "measured", BEFORE: "before", AFTER: "found"}
"""Series to its name in :class:`.TrialMotions` and :class:`.TrialErrors`."""

SHOWN_SIGNALS = {
    "delta_deg": "rudder",
    "psi_deg": "heading",
    "r_degps": "yaw rate",
    "speed_mps": "speed",
    "beta_deg": "drift angle",
}
"""Column of a trial that is shown over time, to its words."""

SYMBOLS = {
    "u_mps": "u",
    "v_mps": "v",
    "u_ground_mps": "u ground",
    "v_ground_mps": "v ground",
    "sog_mps": "speed",
    "r_degps": "r",
    "psi_deg": "ψ",
    "phi_deg": "φ",
    "x_m": "x",
    "y_m": "y",
}

_TRACK = ("x_m", "y_m")
_LOOK = series_look([AFTER, BEFORE, MEASURED], as_points=[MEASURED])


def worst_trials(trials: Sequence[_T], sizes: Sequence[float], most: int | None = None) -> list[_T]:
    """The trials with the largest `sizes`, in their own order; by default :data:`MOST_TRIALS`."""
    worst = sorted(range(len(trials)), key=lambda place: -sizes[place])[: MOST_TRIALS if most is None else most]
    return [trials[place] for place in sorted(worst)]


def trial_pictures(
    trials: Sequence[TrialMotions],
    words: str,
    stem: str,
    *,
    captions: tuple[str, str],
    signals: Mapping[str, str] = SHOWN_SIGNALS,
) -> list[Illustration]:
    """Tracks and time histories of trials, in sheets; empty without any.

    `words`: which trials, for the titles; `stem`: for the names of the charts; `captions`: of tracks and histories;
    `signals`: column to words.
    """
    tracks = track_grid(trials, title=f"Tracks of trials {words}")
    drawn = [Illustration(tracks, caption=captions[0], name=f"tracks_{stem}")] if tracks else []
    moving = [
        trial for trial in trials if not signals.keys().isdisjoint({*trial.measured, *trial.before, *trial.found})
    ]
    for first in range(0, len(moving), PER_SHEET):
        sheet = history_grid(moving[first : first + PER_SHEET], signals=signals, title=f"Motions of trials {words}")
        drawn.append(Illustration(sheet, caption=captions[1], name=f"histories_{stem}"))
    return drawn


def track_grid(trials: Sequence[TrialMotions], *, title: str = "") -> ChartSpec | None:
    """Tracks, a panel a trial, x north up and y east to the right in one scale; measured as points, models as lines.

    The scale fits the measurement and the card found: the card before may leave the panel. None where no trial has a
    track.
    """
    drawn = {trial.trial: panel for trial in trials if (panel := _track_panel(trial))}
    if not drawn:
        return None
    text = f"Tracks of {', '.join(drawn)}, measured and simulated; north is up."
    panels = list(drawn.values())
    slender = all(panel["width"] <= 110 for panel in panels)
    return panel_grid(panels, title, text, columns=PANELS_PER_ROW + slender) | {"usermeta": {"equal_scales": True}}


def _track_panel(trial: TrialMotions) -> ChartSpec | None:
    series = {label: columns for label, columns in _series(trial, _TRACK).items() if set(_TRACK) <= set(columns)}
    if not series:
        return None
    shown = [columns for label, columns in series.items() if label != BEFORE] or list(series.values())
    north, east = (np.concatenate([columns[name] for columns in shown]) for name in _TRACK)
    frame = equal_frame(east, north, width_px=205, height_px=260)
    place = frame.axes(across=("y", "east y (m)"), up=("x", "north x (m)"))
    ticks = max(2, frame.width_px // 70)
    place["x"]["axis"] = {"tickCount": ticks, "labelOverlap": "greedy", "labelSeparation": 6}
    rows: list[ChartRecord] = []
    for label, columns in series.items():
        kept = _thinned(label, [columns["x_m"], columns["y_m"]])
        rows += records(label, {"x": columns["x_m"][kept], "y": columns["y_m"][kept]})
    marks = series_marks(place | {"tooltip": tooltips({"x:Q": "north (m)", "y:Q": "east (m)"})})
    size = frame.width_px, frame.height_px
    return layered(marks, size=size, data={"values": rows}, title=panel_title(trial.trial))


def history_grid(
    trials: Sequence[TrialMotions], *, signals: Mapping[str, str] = SHOWN_SIGNALS, title: str = ""
) -> ChartSpec:
    """Signals over time, a column of panels a trial; `signals`: column to words."""
    text = f"Time histories of {', '.join(trial.trial for trial in trials)}, measured and simulated."
    return panel_grid([_histories(trial, signals) for trial in trials], title, text)


def _histories(trial: TrialMotions, signals: Mapping[str, str]) -> ChartSpec:
    series = _series(trial, tuple(signals))
    names = [name for name in signals if any(name in columns for columns in series.values())]
    fields = {name: f"s{place}" for place, name in enumerate(signals)}
    rows: list[ChartRecord] = []
    for label, columns in series.items():
        shown = _chosen(columns, names)
        kept = _thinned(label, list(shown.values()))
        values = {fields[name]: column[kept] for name, column in shown.items()}
        rows += records(label, {"t": columns["t_s"][kept], **values})
    times = extent(np.concatenate([columns["t_s"] for columns in series.values()]))
    panels = []
    for name in names:
        up = with_unit(signals[name], in_words(name)[1])
        place = place_over_time(times, whole_range(rows, fields[name]), up, fields[name], labelled=name == names[-1])
        place["tooltip"] = tooltips({"t:Q": "time (s)", f"{fields[name]}:Q": up})
        panels.append(layered(series_marks(place), size=(200, 66)))
    resolve = shared_looks(x="shared")
    data = {"data": {"values": rows}, "title": panel_title(trial.trial)}
    return data | {"vconcat": panels, "spacing": 12, "resolve": resolve}


def place_over_time(
    times: tuple[float, float], ends: tuple[float, float], up: str, field: str, *, labelled: bool
) -> ChartSpec:
    """Return the axes of a small panel over time; the ends are given, so that they stay when a line is taken away."""
    across = PlotAxis("time (s)", domain=times, nice=False, ticks=4 if labelled else None, hidden=not labelled)
    size = PlotAxis(up, domain=ends, above=True, ticks=3)
    return {"x": across.channel("t"), "y": size.channel(field)}


def whole_range(rows: Sequence[ChartRecord], field: str, included: Sequence[float] = ()) -> tuple[float, float]:
    """Return the lowest and the highest value of a field."""
    return extent(np.array([*(row[field] for row in rows if row.get(field) is not None), *included], dtype=float))


def window_chart(sets: Mapping[str, Sequence[TrialErrors]], *, title: str = "") -> ChartSpec:
    """Error over windows of each signal in each trial, as a share of the signal, to switch between before and after.

    `sets`: ``fitted`` and ``held out`` to their trials.
    """
    rows = [
        {"group": word, "trial": trial.trial, "signal": symbol, "model": model, "misfit": 100 * errors[name].relative}
        | {"error": f"{errors[name].rms_error:.3g} {in_words(name)[1]}".strip()}
        for word, trials in sets.items()
        for trial in trials
        for model, errors in zip(MODEL_SERIES, (trial.before, trial.found), strict=True)
        for name, symbol in SYMBOLS.items()
        if name in errors
    ]
    return misfit_maps(
        rows,
        list(MODEL_SERIES),
        title=title,
        what="share (%)",
        subtitle="Number and colour: root mean square error as a share of the signal, %.",
        shown={"error:N": "rms error"},
    )


def figure_chart(sets: Mapping[str, Sequence[PredictedFigure]], *, title: str = "") -> ChartSpec | None:
    """Figures of turns and zigzags, predicted against measured, and their errors; None without a figure.

    `sets`: ``fitted`` and ``held out`` to their figures.
    """
    panels = []
    for ending, words, unit, error_unit in (("_deg", "overshoot", "deg", "deg"), ("_m", "distance", "m", "%")):
        rows = list(_figure_rows(sets, ending))
        if rows:
            panels.append(_figure_panels(rows, words, unit, error_unit))
    if not panels:
        return None
    return {
        "vconcat": panels,
        "spacing": 26,
        "title": title,
        "description": "Figures of turns and zigzags predicted against measured, and their errors.",
        "usermeta": STACKS,
    }


def _figure_rows(sets: Mapping[str, Sequence[PredictedFigure]], ending: str) -> Iterable[ChartRecord]:
    for word, figures in sets.items():
        shown = [figure for figure in figures if figure.figure.endswith(ending)]
        for figure in shown:
            yield {"run": BEFORE, "set": word} | _figure_row(figure, ending, figure.before, None)
        for figure in shown:
            yield {"run": AFTER, "set": word} | _figure_row(figure, ending, figure.predicted, figure.interval_95)


def _figure_row(
    figure: PredictedFigure, ending: str, value: float | None, interval: tuple[float, float] | None
) -> ChartRecord:
    predicted = math.nan if value is None else value
    low, high = interval or (predicted, predicted)
    measured = figure.measured

    def error(value: float) -> float | None:
        difference = value - measured
        return plain(100 * difference / measured if ending == "_m" else difference)

    return {
        "name": f"{figure.trial} · {figure.figure.removesuffix(ending).replace('_', ' ')}",
        "measured": plain(measured),
        "predicted": plain(predicted),
        "low": plain(low),
        "high": plain(high),
        "error": error(predicted),
        "least": error(low),
        "most": error(high),
    }


def _figure_panels(rows: list[ChartRecord], words: str, unit: str, error_unit: str) -> ChartSpec:
    look = series_look([AFTER, BEFORE], as_points=[AFTER, BEFORE])
    reached = [row for row in rows if row["predicted"] is not None]
    ends = extent(np.array([row[key] for row in reached or rows for key in ("measured", "low", "high")], dtype=float))
    domain = min(0.0, ends[0]), 1.05 * ends[1]
    shown = {
        "name:N": "figure",
        "set:N": "trial is",
        "run:N": "by",
        "measured:Q": f"measured ({unit})",
        "predicted:Q": f"predicted ({unit})",
        "error:Q": f"error ({error_unit})",
    }
    across, up = (
        PlotAxis(f"{kind} {words} ({unit})", domain=domain, nice=False, ticks=5) for kind in ("measured", "predicted")
    )
    x, colour = across.channel("measured"), {"color": look.colour}
    equal = layer(
        "line",
        [{"measured": end, "predicted": end} for end in domain],
        {"x": x, "y": up.channel("predicted")},
        style="reference",
        strokeWidth=1,
    )
    span = {"x": x, "y": up.channel("low"), "y2": "high", **colour}
    bars = layer("rule", reached, span, strokeWidth=1.2, clip=True)
    marks = {"x": x, "y": up.channel("predicted"), **colour, "shape": look.shape, "tooltip": tooltips(shown)}
    points = layer("point", reached, marks, filled=False, size=46)
    names = list(dict.fromkeys(row["name"] for row in rows))
    errors = [row | {"v": row["error"], "low": row["least"], "high": row["most"]} for row in reached]
    error_axis = PlotAxis(f"predicted less measured ({error_unit})", padding=10, ticks=6, zero=True)
    side = {"labelLimit": 300}
    lines = row_layers(
        RowPlot(errors, across=error_axis, look=look, names=names, side=side, rules=[Rule([0.0])], shown=shown), size=46
    )
    return {
        "hconcat": [
            layered([equal, bars, points], size=(210, 210)),
            layered(lines, size=(220, max(210, 19 * len(names)))),
        ],
        "spacing": 18,
        "resolve": shared_looks(),
    }


def _series(trial: TrialMotions, names: Sequence[str]) -> dict[str, dict[str, Array]]:
    """Label to time and the columns that it has, without values that ran away.

    Of what was measured the part that was simulated: after a turn, a model or ship may have sailed on for long.
    """
    every = {label: _chosen(getattr(trial, name), ("t_s", *names)) for label, name in SERIES.items()}
    series = {label: columns for label, columns in every.items() if set(columns) - {"t_s"}}
    times = [columns["t_s"] for label, columns in series.items() if label != MEASURED]
    if times and MEASURED in series:
        time, simulated = series[MEASURED]["t_s"], np.concatenate(times)
        inside = (time >= simulated.min()) & (time <= simulated.max())
        series[MEASURED] = {name: values[inside] for name, values in series[MEASURED].items()}
    return series


def _chosen(columns: Mapping[str, Array], names: Iterable[str]) -> dict[str, Array]:
    return {name: columns[name] for name in names if name in columns}


def _thinned(label: str, columns: Sequence[Array]) -> Indices:
    # Several signals share one set of samples: evenly spread ones, and the extremes of each.
    return thin_points(columns, MEASURED_SAMPLES if label == MEASURED else MODEL_SAMPLES)


def series_marks(place: ChartSpec) -> list[ChartSpec]:
    """Points (measured) and lines (by the cards) at a `place`, of the rows of the chart that they are in."""
    points = place | {"color": _LOOK.colour, "shape": _LOOK.shape}
    lines = place | {"color": _LOOK.colour, "strokeDash": _LOOK.dash, "order": "i:Q"}
    switched = {"filter": before_after_switch(MODEL_SERIES)}
    return [
        bare_layer("point", points, clip=True, size=14, strokeWidth=1)
        | {"transform": [{"filter": f"datum.run == '{MEASURED}'"}, switched]},
        bare_layer("line", lines, clip=True, strokeWidth=1.5)
        | {"transform": [{"filter": f"datum.run != '{MEASURED}'"}, switched]},
    ]


def panel_grid(
    panels: Sequence[ChartSpec], title: str | ChartSpec, alternative_text: str, columns: int = PANELS_PER_ROW
) -> ChartSpec:
    """Return panels of trials in rows, with one legend and a switch between before and after."""
    return {
        "concat": list(panels),
        "columns": columns,
        "spacing": 26,
        "params": switch(list(MODEL_SERIES)),
        "resolve": shared_looks(),
        "title": title,
        "description": alternative_text,
    }
