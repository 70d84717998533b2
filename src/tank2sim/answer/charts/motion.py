"""Charts of what a ship did: its track, its motions over time, tows, the spiral."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import altair as alt
import numpy as np
from numpy.typing import ArrayLike

from tank2sim.answer.charts.labels import label_layers, spots_along
from tank2sim.answer.charts.parts import (
    HOVER_SAMPLES,
    LINE_SAMPLES,
    NUMBER,
    POINT_SAMPLES,
    Chart,
    ChartRecord,
    Frame,
    Position,
    SeriesLook,
    axis_above,
    data,
    equal_frame,
    every,
    free_frame,
    pan_zoom,
    plain,
    records,
    series_look,
    shown_unit,
    stacked,
    vector,
    with_unit,
)
from tank2sim.answer.numbers import format_number
from tank2sim.arrays import Array
from tank2sim.records.thinning import thin_line, thin_points


@dataclass(frozen=True, kw_only=True)
class TrackData:
    """The path of one run: x north and y east in m, in the order of time; `time_s` (s) is for the tooltip alone."""

    label: str
    x_m: ArrayLike
    y_m: ArrayLike
    time_s: ArrayLike | None = None
    measured: bool = False


@dataclass(frozen=True, kw_only=True)
class Signal:
    """What one panel of a time history shows.

    `name` is the key in :attr:`History.values`, `title` its words on the axis, `unit` a key of
    :data:`tank2sim.units.UNITS`. Angles are shown in degrees; `display_unit` chooses another of the unit's displays.
    """

    name: str
    title: str
    unit: str
    display_unit: str | None = None


@dataclass(frozen=True, kw_only=True)
class HistoryBand:
    """A band of one signal over time: `time_s`, and its edges `low` and `high`, (n,) in the unit of the signal."""

    signal: str
    time_s: ArrayLike
    low: ArrayLike
    high: ArrayLike


@dataclass(frozen=True, kw_only=True)
class History:
    """Signals of one run over time: `time_s` (n,) in s, `values` by name of signal, (n,) each, in the signal's unit.

    A run need not have every signal; NaN leaves a gap. `bands` are those of an ensemble about it.
    """

    label: str
    time_s: ArrayLike
    values: Mapping[str, ArrayLike]
    measured: bool = False
    bands: Sequence[HistoryBand] = ()


@dataclass(frozen=True, kw_only=True)
class TimeMark:
    """A place in the panel of one signal, from `begin_s` to `end_s` (s), and what is to be said of it."""

    signal: str
    begin_s: float
    end_s: float
    text: str


@dataclass(frozen=True, kw_only=True)
class Tow:
    """Speed over time of one tow, as measured and as a model gives it; s and m/s, NaN where nothing was measured."""

    label: str
    time_s: ArrayLike
    speed_mps: ArrayLike
    model_time_s: ArrayLike
    model_speed_mps: ArrayLike


@dataclass(frozen=True, kw_only=True)
class SpiralData:
    """Steady yaw rate (rad/s) against rudder angle (rad, positive to starboard), in the order they were run."""

    label: str
    rudder_rad: ArrayLike
    yaw_rate_radps: ArrayLike


def track_chart(
    tracks: Sequence[TrackData], *, title: str = "", width_px: int = 720, height_px: int = 540
) -> alt.LayerChart:
    """Tracks over each other, x north up and y east to the right, both axes in one scale (also when zoomed).

    Parameters
    ----------
    tracks : sequence of TrackData
        Measured ones are drawn as open points, the others as lines. The start is marked.
    title : str
        Title of the chart.
    width_px, height_px : int
        Size of the plot at most; it takes the shape of the tracks.
    """
    paths = [(track, vector(track.x_m), vector(track.y_m)) for track in tracks]
    frame = equal_frame(
        np.concatenate([y for _, _, y in paths]),
        np.concatenate([x for _, x, _ in paths]),
        width_px=width_px,
        height_px=height_px,
    )
    rows = [(track.measured, _track_rows(track, x, y)) for track, x, y in paths]
    position = frame.axes(across=("y:Q", "east y (m)"), up=("x:Q", "north x (m)"))
    starts = [row[0] for measured, row in rows if not measured] or [row[0] for _, row in rows]
    start = Chart(data(starts)).mark_point(style="start", shape="diamond", tooltip="start", clip=True)
    layers = _lines_and_points(rows, position, _look(tracks), _track_tooltip(tracks))
    return _in_window(
        [layers[0].properties(name="plot"), *layers[1:], start.encode(**position)],
        title=title,
        width=frame.width_px,
        height=frame.height_px,
        description=f"Tracks of {_listed(tracks)}; north is up, both axes have one scale.",
        usermeta={"equal_scales": True},
    )


def history_chart(
    runs: Sequence[History],
    signals: Sequence[Signal],
    *,
    title: str = "",
    width_px: int = 720,
    height_px: int = 120,
    marks: Sequence[TimeMark] = (),
) -> alt.VConcatChart:
    """Signals over each other with one time axis, the runs overlaid in each; angles in degrees.

    Parameters
    ----------
    runs : sequence of History
        Measured ones are drawn as open points, the others as lines.
    signals : sequence of Signal
        The panels from top to bottom.
    title : str
        Title of the chart.
    width_px, height_px : int
        Size of one panel.
    marks : sequence of TimeMark
        Places to tint.
    """
    look = _look(runs)
    span = np.concatenate([vector(run.time_s) for run in runs])
    time_scale = alt.Scale(domain=[float(np.nanmin(span)), float(np.nanmax(span))], nice=False, zero=False)
    panels = []
    for place, signal in enumerate(signals):
        last = place == len(signals) - 1
        axis = alt.Axis(title="time (s)") if last else alt.Axis(title=None, labels=False, ticks=False)
        x = alt.X("t:Q", scale=time_scale, axis=axis)
        shaded = [_shaded(band, signal, x) for run in runs for band in run.bands if band.signal == signal.name]
        layers = [*_history_layers(runs, signal, look, x), *shaded, *_marked(marks, signal, x)]
        panels.append(alt.layer(*layers).properties(width=width_px, height=height_px))
    names = ", ".join(signal.title for signal in signals)
    return stacked(panels, title=title, description=f"Time histories of {names}, of {_listed(runs)}.")


def tow_chart(tows: Sequence[Tow], *, title: str = "", width_px: int = 720, height_px: int = 380) -> alt.LayerChart:
    """Speeds of several tows against time: what was measured as points, what the model gives as lines."""
    labels = [tow.label for tow in tows]
    look = series_look(labels, as_points=labels)
    measured, modelled = [], []
    for tow in tows:
        time, speed = vector(tow.model_time_s), vector(tow.model_speed_mps)
        kept = thin_line([speed], LINE_SAMPLES)
        modelled += records(tow.label, {"t": time[kept], "v": speed[kept]})
        measured += records(tow.label, {"t": vector(tow.time_s), "v": vector(tow.speed_mps)})
    x = alt.X("t:Q", title="time (s)", scale=alt.Scale(nice=False))
    y = alt.Y("v:Q", title="speed (m/s)", scale=alt.Scale(zero=True))
    tooltip = [
        alt.Tooltip("run:N", title="tow"),
        alt.Tooltip("t:Q", title="time (s)", format=NUMBER),
        alt.Tooltip("v:Q", title="measured (m/s)", format=NUMBER),
    ]
    lines = Chart(data(modelled), name="plot").mark_line(clip=True).encode(x=x, y=y, color=look.colour, order="i:Q")
    points = (
        Chart(data([row for row in measured if row["v"] is not None]))
        .mark_point(clip=True)
        .encode(x=x, y=y, color=look.colour, shape=look.shape, tooltip=tooltip)
    )
    return _in_window(
        [lines, points],
        title=alt.Title(title, subtitle="Points: measured. Lines: model.") if title else "",
        width=width_px,
        height=height_px,
        description=f"Speed over time of {_listed(tows)}; points were measured, lines are the model.",
    )


def spiral_chart(
    spirals: Sequence[SpiralData],
    *,
    loop_rad: tuple[float, float] | None = None,
    title: str = "",
    width_px: int = 620,
    height_px: int = 400,
) -> alt.LayerChart:
    """Yaw rate against rudder angle, in degrees, the points joined in the order they were run.

    Parameters
    ----------
    spirals : sequence of SpiralData
    loop_rad : pair of float, optional
        Rudder angles between which the ship has two steady turns, rad: the width of the loop is marked.
    title : str
        Title of the chart.
    width_px, height_px : int
        Size of the plot.
    """
    labels = [spiral.label for spiral in spirals]
    look = series_look(labels, as_points=labels)
    degree = shown_unit("rad")[1]
    rows: list[ChartRecord] = []
    for spiral in spirals:
        rudder, rate = degree * vector(spiral.rudder_rad), degree * vector(spiral.yaw_rate_radps)
        rows += records(spiral.label, {"d": rudder, "r": rate})
    drawn = [(degree * vector(spiral.rudder_rad), degree * vector(spiral.yaw_rate_radps)) for spiral in spirals]
    across, up = (np.concatenate([[0.0], *(line[axis] for line in drawn)]) for axis in (0, 1))
    frame = free_frame(across, up, width_px=width_px, height_px=height_px, margins_px=(24.0, 24.0))
    scales = [alt.Scale(nice=False, domain=list(domain)) for domain in (frame.across, frame.up)]
    x = alt.X("d:Q", title="rudder angle, starboard positive (deg)", scale=scales[0])
    y = alt.Y("r:Q", title="yaw rate, starboard positive (deg/s)", scale=scales[1])
    tooltip = [
        alt.Tooltip("run:N", title="run"),
        alt.Tooltip("d:Q", title="rudder (deg)", format=NUMBER),
        alt.Tooltip("r:Q", title="yaw rate (deg/s)", format=NUMBER),
    ]
    base = Chart(data(rows)).encode(x=x, y=y, color=look.colour, order="i:Q")
    zero = [
        Chart(data([{"d": 0.0}])).mark_rule(style="reference").encode(x="d:Q"),
        Chart(data([{"r": 0.0}])).mark_rule(style="reference").encode(y="r:Q"),
    ]
    lines = base.mark_line(clip=True).properties(name="plot")
    points = base.mark_point(clip=True).encode(shape=look.shape, tooltip=tooltip)
    loop = _loop_layers(degree * vector(loop_rad), {"x": x, "y": y}, frame, drawn) if loop_rad else []
    return _in_window(
        [*zero, lines, points, *loop],
        title=title,
        width=width_px,
        height=height_px,
        description=f"Steady yaw rate against rudder angle of {_listed(spirals)}.",
    )


def _loop_layers(
    rudders: Array, position: Position, frame: Frame, lines: Sequence[tuple[Array, Array]]
) -> list[alt.Chart]:
    """The width of a loop along the line of zero yaw rate, in deg."""
    low, high = sorted(rudders.tolist())
    text = f"loop {format_number(high - low, 3)}°"
    row = {"d": plain(low), "to": plain(high), "r": 0.0, "text": text}
    width = Chart(data([row])).mark_rule(style="overshoot", clip=True).encode(**position, x2="to:Q")
    label = text, spots_along((low, 0.0), (high, 0.0), frame)
    zero = [(vector(frame.across), np.zeros(2)), (np.zeros(2), vector(frame.up))]
    return [width, *label_layers([label], frame, position, ("d", "r"), [*lines, *zero])]


def _listed(series: Sequence[TrackData] | Sequence[History] | Sequence[Tow] | Sequence[SpiralData]) -> str:
    return ", ".join(series_shown.label for series_shown in series)


def _look(runs: Sequence[TrackData] | Sequence[History]) -> SeriesLook:
    return series_look([run.label for run in runs], as_points={run.label for run in runs if run.measured})


def _in_window(layers: Sequence[alt.Chart], **properties: object) -> alt.LayerChart:
    # Pans and zooms both axes by one factor, so that equal scales stay equal; one of the layers is named "plot".
    return alt.layer(*layers, params=[pan_zoom("x", "y", views=["plot"])]).properties(**properties)


def _track_tooltip(tracks: Sequence[TrackData]) -> list[alt.Tooltip]:
    timed = all(track.time_s is not None for track in tracks)
    return [
        alt.Tooltip("run:N", title="run"),
        *([alt.Tooltip("t:Q", title="time (s)", format=NUMBER)] if timed else []),
        alt.Tooltip("x:Q", title="north (m)", format=NUMBER),
        alt.Tooltip("y:Q", title="east (m)", format=NUMBER),
    ]


def _track_rows(track: TrackData, x: Array, y: Array) -> list[ChartRecord]:
    kept = thin_points([x, y], POINT_SAMPLES) if track.measured else thin_line([x, y], LINE_SAMPLES)
    time = {} if track.time_s is None else {"t": vector(track.time_s)[kept]}
    return records(track.label, {"x": x[kept], "y": y[kept]} | time)


def _history_layers(runs: Sequence[History], signal: Signal, look: SeriesLook, x: alt.X) -> list[alt.Chart]:
    if not any(signal.name in run.values for run in runs):
        raise ValueError(f"no run has the signal {signal.name}")
    unit, factor = shown_unit(signal.unit, signal.display_unit)
    title = with_unit(signal.title, unit)
    rows = []
    for run in runs:
        if signal.name not in run.values:
            continue
        time, value = vector(run.time_s), factor * vector(run.values[signal.name])
        kept = thin_points([value], POINT_SAMPLES) if run.measured else thin_line([value], LINE_SAMPLES)
        rows.append((run.measured, records(run.label, {"t": time[kept], "v": value[kept]})))
    tooltip = [
        alt.Tooltip("run:N", title="run"),
        alt.Tooltip("t:Q", title="time (s)", format=NUMBER),
        alt.Tooltip("v:Q", title=title, format=NUMBER),
    ]
    y = alt.Y("v:Q", scale=alt.Scale(zero=False), axis=axis_above(title))
    return _lines_and_points(rows, {"x": x, "y": y}, look, tooltip)


def _shaded(band: HistoryBand, signal: Signal, x: alt.X) -> alt.Chart:
    factor = shown_unit(signal.unit, signal.display_unit)[1]
    columns = {"t": vector(band.time_s), "low": factor * vector(band.low), "high": factor * vector(band.high)}
    area = Chart(data(records("band", columns))).mark_area(style="band", clip=True)
    return area.encode(x=x, y=alt.Y("low:Q"), y2="high:Q")


def _marked(marks: Sequence[TimeMark], signal: Signal, x: alt.X) -> list[alt.Chart]:
    """Tinted spans, each with a line where it begins, for the shortest are no wider than that."""
    rows: list[ChartRecord] = [
        {"t": mark.begin_s, "end": mark.end_s, "text": mark.text} for mark in marks if mark.signal == signal.name
    ]
    if not rows:
        return []
    tooltip = [alt.Tooltip("text:N", title="found"), alt.Tooltip("t:Q", title="from (s)", format=NUMBER)]
    base = Chart(data(rows)).encode(x=x, tooltip=tooltip)
    spans = base.mark_rect(style="region", clip=True).encode(x2="end:Q")
    return [spans, base.mark_rule(style="limit", clip=True, strokeWidth=1.2)]


def _lines_and_points(
    rows: Sequence[tuple[bool, list[ChartRecord]]],
    position: Position,
    look: SeriesLook,
    tooltip: list[alt.Tooltip],
) -> list[alt.Chart]:
    lines = [row for measured, series in rows if not measured for row in series]
    points = [row for measured, series in rows if measured for row in series]
    hover = [row for measured, series in rows if not measured for row in every(series, HOVER_SAMPLES)]
    layers = []
    if lines:
        line = Chart(data(lines)).mark_line(clip=True)
        layers.append(line.encode(**position, color=look.colour, strokeDash=look.dash, order="i:Q"))
    if points:
        point = Chart(data(points)).mark_point(clip=True)
        layers.append(point.encode(**position, color=look.colour, shape=look.shape, tooltip=tooltip))
    if hover:
        unseen = Chart(data(hover)).mark_point(clip=True, opacity=0, filled=True, size=110)
        layers.append(unseen.encode(**position, tooltip=tooltip))
    return layers
