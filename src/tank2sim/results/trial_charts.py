"""Charts of trials next to simulations by two cards: tracks, histories, errors over windows, figures."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

import altair as alt
import numpy as np

from tank2sim.answer.charts.before_after import before_after_switch, switch
from tank2sim.answer.charts.matrix import ROW_PX, matrix_layers
from tank2sim.answer.charts.parts import (
    NUMBER,
    STACKS,
    Chart,
    ChartRecord,
    Position,
    axis_above,
    data,
    equal_frame,
    extent,
    panel_title,
    plain,
    records,
    series_look,
    with_unit,
)
from tank2sim.arrays import Array
from tank2sim.identification.trials.study import PredictedFigure, TrialErrors, TrialMotions, WindowError
from tank2sim.records.thinning import Indices, thin_points
from tank2sim.units import in_words

MEASURED, BEFORE, AFTER = "measured", "card before", "card found"

MODEL_SERIES = {"before": BEFORE, "after": AFTER}
"""Word of the switch to the series that it shows."""

PANELS_PER_ROW = 3
"""Trials next to each other in a picture."""

MODEL_SAMPLES, MEASURED_SAMPLES = 140, 40
"""Samples of a line, and points of a series, in a small panel (about 200 px wide)."""

SERIES = {MEASURED: "measured", BEFORE: "before", AFTER: "found"}
"""Series to its name in :class:`.TrialMotions` and :class:`.TrialErrors`."""

_SIGNALS = {
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
_POINT_LOOK = {"color": _LOOK.colour.to_dict(), "shape": _LOOK.shape.to_dict()}
_LINE_LOOK = {"color": _LOOK.colour.to_dict(), "strokeDash": _LOOK.dash.to_dict()}
_SHARED = {"color": "shared", "strokeDash": "shared", "shape": "shared"}


def track_grid(trials: Sequence[TrialMotions], *, title: str = "") -> alt.ConcatChart | None:
    """Tracks, a panel a trial, x north up and y east to the right in one scale; measured as points, models as lines.

    The scale fits the measurement and the card found: the card before may leave the panel. None where no trial has a
    track.
    """
    panels, rows_of = [], {}
    for trial in trials:
        series = {label: columns for label, columns in _series(trial, _TRACK).items() if set(_TRACK) <= set(columns)}
        if not series:
            continue
        shown = [columns for label, columns in series.items() if label != BEFORE] or list(series.values())
        north, east = (np.concatenate([columns[name] for columns in shown]) for name in _TRACK)
        frame = equal_frame(east, north, width_px=205, height_px=260)
        position = frame.axes(across=("y:Q", "east y (m)"), up=("x:Q", "north x (m)"))
        narrow = alt.Axis(tickCount=max(2, frame.width_px // 70), labelOverlap="greedy", labelSeparation=6)
        position["x"] = position["x"].axis(narrow)
        rows: list[ChartRecord] = []
        for label, columns in series.items():
            kept = _thinned(label, [columns["x_m"], columns["y_m"]])
            rows += records(label, {"x": columns["x_m"][kept], "y": columns["y_m"][kept]})
        tooltip = [
            alt.Tooltip("x:Q", title="north (m)", format=NUMBER),
            alt.Tooltip("y:Q", title="east (m)", format=NUMBER),
        ]
        name = trial.trial
        rows_of[name] = rows
        layers = alt.layer(*_marks(position, tooltip), data=alt.NamedData(name))
        panels.append(layers.properties(title=panel_title(name), width=frame.width_px, height=frame.height_px))
    if not panels:
        return None
    text = f"Tracks of {', '.join(rows_of)}, measured and simulated; north is up."
    slender = all(panel.width <= 110 for panel in panels)
    chart = _grid(panels, title, text, columns=PANELS_PER_ROW + slender).properties(usermeta={"equal_scales": True})
    return _with_rows(chart, rows_of)


def history_grid(
    trials: Sequence[TrialMotions], *, signals: Mapping[str, str] = _SIGNALS, title: str = ""
) -> alt.ConcatChart:
    """Signals over time, a column of panels a trial; `signals`: column to words."""
    made = {trial.trial: _histories(trial, signals) for trial in trials}
    text = f"Time histories of {', '.join(made)}, measured and simulated."
    chart = _grid([panels for panels, _ in made.values()], title, text)
    return _with_rows(chart, {name: rows for name, (_, rows) in made.items()})


def _histories(trial: TrialMotions, signals: Mapping[str, str]) -> tuple[alt.VConcatChart, list[ChartRecord]]:
    series = _series(trial, tuple(signals))
    names = [name for name in signals if any(name in columns for columns in series.values())]
    fields = {name: f"s{place}" for place, name in enumerate(signals)}
    rows: list[ChartRecord] = []
    for label, columns in series.items():
        shown = {name: columns[name] for name in names if name in columns}
        kept = _thinned(label, list(shown.values()))
        values = {fields[name]: column[kept] for name, column in shown.items()}
        rows += records(label, {"t": columns["t_s"][kept], **values})
    times = extent(np.concatenate([columns["t_s"] for columns in series.values()]))
    scale = alt.Scale(domain=list(times), nice=False, zero=False)
    panels = []
    for name in names:
        up, last = with_unit(signals[name], in_words(name)[1]), name == names[-1]
        axis = alt.Axis(title="time (s)", tickCount=4) if last else alt.Axis(title=None, labels=False, ticks=False)
        position: Position = {
            "x": alt.X("t:Q", scale=scale, axis=axis),
            "y": alt.Y(f"{fields[name]}:Q", scale=_whole(rows, fields[name]), axis=axis_above(up, tickCount=3)),
        }
        tooltip = [
            alt.Tooltip("t:Q", title="time (s)", format=NUMBER),
            alt.Tooltip(f"{fields[name]}:Q", title=up, format=NUMBER),
        ]
        panels.append(alt.layer(*_marks(position, tooltip)).properties(width=200, height=66))
    chart = alt.vconcat(*panels, data=alt.NamedData(trial.trial), spacing=12).resolve_scale(x="shared", **_SHARED)
    return chart.properties(title=panel_title(trial.trial)), rows


def _whole(rows: Sequence[ChartRecord], field: str) -> alt.Scale:
    # Given explicitly, so that it stays when the switch takes a line away.
    values = np.array([row[field] for row in rows if row.get(field) is not None], dtype=float)
    return alt.Scale(domain=list(extent(values)), nice=True, zero=False)


def window_chart(sets: Mapping[str, Sequence[TrialErrors]], *, title: str = "") -> alt.VConcatChart:
    """Error over windows of each signal in each trial, as a share of the signal, as a heat map.

    Parameters
    ----------
    sets : mapping
        ``fitted`` and ``held out`` to their trials.
    title : str
        Of the chart.
    """
    every = [errors for trials in sets.values() for trial in trials for errors in (trial.before, trial.found)]
    signals = [symbol for name, symbol in SYMBOLS.items() if any(name in errors for errors in every)]
    rows = []
    for word, trials in sets.items():
        maps = [
            _window_map(trials, label, signals, f"{label} · {word}", named=label == BEFORE)
            for label in MODEL_SERIES.values()
        ]
        rows.append(alt.hconcat(*maps, spacing=16))
    return alt.vconcat(*rows, spacing=18).properties(
        title=alt.Title(title, subtitle="Number and colour: root mean square error as a share of the signal, %."),
        description="Errors over windows by trial and signal, of the card before and the card found.",
        usermeta=STACKS,
    )


def _errors_of(trial: TrialErrors, label: str) -> dict[str, WindowError]:
    return trial.before if label == BEFORE else trial.found


def _window_map(
    trials: Sequence[TrialErrors], label: str, signals: Sequence[str], title: str, *, named: bool
) -> alt.LayerChart:
    rows = []
    for trial in trials:
        for name, errors in _errors_of(trial, label).items():
            share, error = 100 * errors.relative, errors.rms_error
            rows.append(
                {"trial": trial.trial, "signal": SYMBOLS.get(name, name), "share": plain(share)}
                | {"text": _in_three(share), "error": f"{error:.3g} {in_words(name)[1]}".strip()}
            )
    side = alt.Axis(title=None, labelLimit=230) if named else alt.Axis(title=None, labels=False, ticks=False)
    layers = matrix_layers(
        "share",
        [trial.trial for trial in trials],
        signals,
        side=side,
        legend=alt.Legend(gradientLength=180),  # of all maps alike, which makes it one
        tooltip=[alt.Tooltip("text:N", title="share (%)"), alt.Tooltip("error:N", title="rms error")],
    )
    size = {"width": 38 * len(signals), "height": ROW_PX * len(trials)}
    return alt.layer(*layers, data=data(rows)).properties(title=panel_title(title), **size)


def figure_chart(sets: Mapping[str, Sequence[PredictedFigure]], *, title: str = "") -> alt.VConcatChart | None:
    """Figures of turns and zigzags, predicted against measured, and their errors; None without a figure.

    Parameters
    ----------
    sets : mapping
        ``fitted`` and ``held out`` to their figures.
    title : str
        Of the chart.
    """
    panels = []
    for ending, words, unit, error_unit in (("_deg", "overshoot", "deg", "deg"), ("_m", "distance", "m", "%")):
        rows = list(_figure_rows(sets, ending))
        if rows:
            panels.append(_figure_panels(rows, words, unit, error_unit))
    if not panels:
        return None
    return alt.vconcat(*panels, spacing=26).properties(
        title=title,
        description="Figures of turns and zigzags predicted against measured, and their errors.",
        usermeta=STACKS,
    )


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


def _figure_panels(rows: list[ChartRecord], words: str, unit: str, error_unit: str) -> alt.HConcatChart:
    look = series_look([AFTER, BEFORE], as_points=[AFTER, BEFORE])
    reached = [row for row in rows if row["predicted"] is not None]
    ends = extent(np.array([row[key] for row in reached or rows for key in ("measured", "low", "high")], dtype=float))
    scale = alt.Scale(domain=[min(0.0, ends[0]), 1.05 * ends[1]], nice=False)
    tooltip = [
        alt.Tooltip("name:N", title="figure"),
        alt.Tooltip("set:N", title="trial is"),
        alt.Tooltip("run:N", title="by"),
        alt.Tooltip("measured:Q", title=f"measured ({unit})", format=NUMBER),
        alt.Tooltip("predicted:Q", title=f"predicted ({unit})", format=NUMBER),
        alt.Tooltip("error:Q", title=f"error ({error_unit})", format=NUMBER),
    ]
    line = Chart(data([{"a": value, "b": value} for value in scale.domain]))
    equal = line.mark_line(style="reference", strokeWidth=1).encode(
        x=alt.X("a:Q", scale=scale, title=f"measured {words} ({unit})", axis=alt.Axis(tickCount=5)),
        y=alt.Y("b:Q", scale=scale, title=f"predicted {words} ({unit})", axis=alt.Axis(tickCount=5)),
    )
    base = Chart(data(reached)).encode(color=look.colour, shape=look.shape, tooltip=tooltip)
    bars = Chart(data(reached)).mark_rule(strokeWidth=1.2, clip=True).encode(color=look.colour)
    points = base.mark_point(filled=False, size=46).encode(
        x=alt.X("measured:Q", scale=scale), y=alt.Y("predicted:Q", scale=scale)
    )
    names = list(dict.fromkeys(row["name"] for row in rows))
    y = alt.Y("name:N", sort=names, axis=alt.Axis(title=None, grid=True, labelLimit=300))
    errors = base.mark_point(filled=False, size=46).encode(
        x=alt.X(
            "error:Q",
            title=f"predicted less measured ({error_unit})",
            scale=alt.Scale(padding=10),
            axis=alt.Axis(tickCount=6),
        ),
        y=y,
    )
    zero = Chart(data([{"error": 0.0}])).mark_rule(style="reference").encode(x="error:Q")
    return alt.hconcat(
        alt.layer(equal, bars.encode(x="measured:Q", y="low:Q", y2="high:Q"), points).properties(width=210, height=210),
        alt.layer(zero, bars.encode(x="least:Q", x2="most:Q", y=y), errors).properties(
            width=220, height=max(210, 19 * len(names))
        ),
        spacing=18,
    ).resolve_scale(**_SHARED)


def _series(trial: TrialMotions, names: Sequence[str]) -> dict[str, dict[str, Array]]:
    """Label to time and those of the columns that it has; what ran away is left out.

    Of what was measured the part that was simulated: after a turn, a model or ship may have sailed on for long.
    """
    series = {
        label: {name: columns[name] for name in ("t_s", *names) if name in columns}
        for label, columns in ((label, getattr(trial, name)) for label, name in SERIES.items())
        if not set(names).isdisjoint(columns)
    }
    times = [columns["t_s"] for label, columns in series.items() if label != MEASURED]
    if times and MEASURED in series:
        time = series[MEASURED]["t_s"]
        inside = (time >= min(model[0] for model in times)) & (time <= max(model[-1] for model in times))
        series[MEASURED] = {name: values[inside] for name, values in series[MEASURED].items()}
    return series


def _thinned(label: str, columns: Sequence[Array]) -> Indices:
    # Several signals share one set of samples: evenly spread ones, and the extremes of each.
    return thin_points(columns, MEASURED_SAMPLES if label == MEASURED else MODEL_SAMPLES)


def _marks(position: Position, tooltip: Sequence[alt.Tooltip]) -> list[alt.Chart]:
    # All panels of a trial share their data: the series determines what is a line and what a point.
    # Encodings are handed over as dictionaries: Altair copies its own objects, with all they leave open, at every
    # level.
    place = {name: channel.to_dict() for name, channel in position.items()}
    messages = [shown.to_dict() for shown in tooltip]
    points = place | _POINT_LOOK | {"tooltip": messages}
    lines = place | _LINE_LOOK | {"order": {"field": "i", "type": "quantitative"}}
    return [_drawn("point", "==", points, size=14, strokeWidth=1), _drawn("line", "!=", lines, strokeWidth=1.5)]


def _drawn(kind: str, sign: str, encoding: ChartRecord, **mark: float) -> alt.Chart:
    return Chart(
        mark={"type": kind, "clip": True, **mark},
        encoding=alt.FacetedEncoding(**encoding),
        transform=[{"filter": f"datum.run {sign} '{MEASURED}'"}, {"filter": before_after_switch(MODEL_SERIES)}],
    )


def _grid(
    panels: Sequence[alt.LayerChart | alt.VConcatChart],
    title: str,
    alternative_text: str,
    columns: int = PANELS_PER_ROW,
) -> alt.ConcatChart:
    chart = alt.concat(*panels, columns=columns, spacing=26, params=switch(list(MODEL_SERIES))).resolve_scale(**_SHARED)
    return chart.properties(title=title, description=alternative_text)


def _with_rows(chart: alt.ConcatChart, rows: Mapping[str, list[ChartRecord]]) -> alt.ConcatChart:
    # Data by name, put in at last: Altair copies those of a panel whenever the panel is put into another.
    chart["datasets"] = dict(rows)
    return chart


def _in_three(percent: float) -> str:
    if not math.isfinite(percent):
        return "∞"
    return f"{percent:.0f}" if percent >= 10 else f"{percent:.1f}"
