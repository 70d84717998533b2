"""Charts of the motion of a ship: tracks, time histories, spirals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np
from numpy.typing import ArrayLike

from tank2sim.answer.charts.curves import Plot, PlotSeries, curve_chart, curve_panels
from tank2sim.answer.charts.labels import label_layers, spots_along
from tank2sim.answer.charts.parts import (
    LINE_SAMPLES,
    POINT_SAMPLES,
    Frame,
    equal_frame,
    every,
    free_frame,
    plain,
    records,
    series_look,
    shown_unit,
    vector,
    with_unit,
)
from tank2sim.answer.charts.vega import ChartRecord, ChartSpec, PlotAxis, Rule, layer, layered, tooltips
from tank2sim.answer.numbers import format_number
from tank2sim.answer.parts import Illustration
from tank2sim.arrays import Array
from tank2sim.records.thinning import thin_line, thin_points
from tank2sim.simulation.bands import BandOverTime
from tank2sim.units import in_words, to_si

_Columns = Mapping[str, Sequence[float | None] | Array]

LOW, MIDDLE, HIGH = "5 %", "50 %", "95 %"
"""Labels of the quantiles of an ensemble."""

# The order of the panels, and the words where the name itself is none for a reader.
_TITLES = {
    "delta_order": "rudder ordered",
    "delta": "rudder, + to starboard",
    "n": "revolutions",
    "psi": "heading",
    "r": "yaw rate",
    "u": "surge velocity",
    "v": "sway velocity, + to starboard",
    "u_ground": "surge velocity over ground",
    "v_ground": "sway velocity over ground",
    "sog": "speed over ground",
    "cog": "course over ground",
    "phi": "heel",
}
_UNITS = {
    "m": "m",
    "s": "s",
    "mps": "m/s",
    "mps2": "m/s2",
    "rad": "rad",
    "radps": "rad/s",
    "kg": "kg",
    "N": "N",
    "Nm": "N.m",
    "A": "A",
}
_TRACK = ("x_m", "y_m")
_ORDER, _ANGLE = "delta_order", "delta"


@dataclass(frozen=True)
class TrackData:
    """The path of one run: x north and y east in m, in the order of time; `time_s` (s) is for the tooltip alone."""

    label: str
    x_m: ArrayLike
    y_m: ArrayLike
    time_s: ArrayLike | None = None
    measured: bool = False

    @property
    def rows(self) -> list[ChartRecord]:
        """Rows of the chart: ``x``, ``y`` and ``t``, thinned."""
        columns = {"x": vector(self.x_m), "y": vector(self.y_m)}
        thinned = thin_points if self.measured else thin_line
        kept = thinned(list(columns.values()), POINT_SAMPLES if self.measured else LINE_SAMPLES)
        columns |= {} if self.time_s is None else {"t": vector(self.time_s)}
        return records(self.label, {name: values[kept] for name, values in columns.items()})


@dataclass(frozen=True)
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


@dataclass(frozen=True)
class History:
    """Signals of one run over time: `time_s` (n,) in s, `values` by name of signal, (n,) each, in the signal's unit.

    A run need not have every signal; NaN leaves a gap. `bands` show an ensemble about it.
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


def track_chart(tracks: Sequence[TrackData], *, title: str = "", height_px: int = 540) -> ChartSpec:
    """Tracks over each other, x north up and y east to the right, both axes in one scale (also when zoomed).

    `tracks`: measured ones are drawn as open points, the others as lines; the start is marked; `height_px`: of the plot
    at most; it takes the shape of the tracks.
    """
    frame = equal_frame(
        np.concatenate([vector(track.y_m) for track in tracks]),
        np.concatenate([vector(track.x_m) for track in tracks]),
        width_px=720,
        height_px=height_px,
    )
    place = frame.axes(across=("y", "east y (m)"), up=("x", "north x (m)"))
    look = series_look([track.label for track in tracks], as_points={track.label for track in tracks if track.measured})
    lines, points = ([track.rows for track in tracks if track.measured == kind] for kind in (False, True))
    timed = {"t:Q": "time (s)"} if all(track.time_s is not None for track in tracks) else {}
    said = {"tooltip": tooltips({"run:N": "run", **timed, "x:Q": "north (m)", "y:Q": "east (m)"})}
    marks = place | {"color": look.colour}
    layers = []
    if lines:
        layers.append(layer("line", list(chain(*lines)), {**marks, "strokeDash": look.dash, "order": "i:Q"}, clip=True))
    if points:
        layers.append(layer("point", list(chain(*points)), {**marks, "shape": look.shape, **said}, clip=True))
    if lines:
        hover = [row for rows in lines for row in every(rows, _HOVER_SAMPLES)]
        layers.append(layer("point", hover, {**place, **said}, clip=True, opacity=0, filled=True, size=110))
    starts = [rows[0] for rows in lines or points]
    layers.append(layer("point", starts, place, style="start", shape="diamond", tooltip="start", clip=True))
    return layered(
        layers,
        size=(frame.width_px, frame.height_px),
        window=["x", "y"],
        title=title,
        description=f"Tracks of {_listed(tracks)}; north is up, both axes have one scale.",
        usermeta={"equal_scales": True},
    )


def history_chart(
    runs: Sequence[History],
    signals: Sequence[Signal],
    *,
    title: str = "",
    height_px: int = 120,
    marks: Sequence[TimeMark] = (),
) -> ChartSpec:
    """Signals over each other with one time axis, the runs overlaid in each; angles in degrees.

    `runs`: measured ones are drawn as open points, the others as lines; `signals`: the panels from top to bottom;
    `height_px`: of one panel; `marks`: places to tint.
    """
    span = np.concatenate([vector(run.time_s) for run in runs])
    across = PlotAxis("time (s)", domain=(float(np.nanmin(span)), float(np.nanmax(span))), nice=False)
    look = series_look([run.label for run in runs], as_points={run.label for run in runs if run.measured})
    plots = [_signal_plot(runs, signal, height_px, across, marks) for signal in signals]
    names = ", ".join(signal.title for signal in signals)
    described = f"Time histories of {names}, of {_listed(runs)}."
    return curve_panels(plots, across, title=title, described=described, look=look, shown={"run:N": "run"})


def spiral_chart(
    rudder_deg: ArrayLike, rate_degps: ArrayLike, *, loop_deg: tuple[float, float] | None = None, title: str = ""
) -> ChartSpec:
    """Steady yaw rate against rudder angle (n,), positive to starboard, joined in the order they were run.

    `loop_deg`: rudder angles between which the ship has two steady turns: the width of the loop is marked.
    """
    rudder, rate = vector(rudder_deg), vector(rate_degps)
    series = [PlotSeries("spiral", x=rudder, y=rate, points=points, closed=True) for points in (False, True)]
    ends = np.append(rudder, 0.0), np.append(rate, 0.0)
    frame = free_frame(*ends, width_px=620, height_px=400, margins_px=(24.0, 24.0))
    across = PlotAxis("rudder angle, starboard positive (deg)", domain=frame.across, nice=False)
    up = PlotAxis("yaw rate, starboard positive (deg/s)", domain=frame.up, nice=False)
    over = _loop_layers(loop_deg, across, up, frame, (rudder, rate)) if loop_deg else []
    return curve_chart(
        Plot(series, up=up, height_px=frame.height_px, rules=[Rule([0.0], upright=True), Rule([0.0])], over=over),
        across,
        title=title,
        width_px=frame.width_px,
        described="Steady yaw rate against rudder angle of spiral.",
        shown={"run:N": "run"},
    )


_HOVER_SAMPLES = 90
"""Places along one line that answer to the pointer."""


def _loop_layers(
    loop_deg: tuple[float, float], across: PlotAxis, up: PlotAxis, frame: Frame, line: tuple[Array, Array]
) -> list[ChartSpec]:
    """The width of a loop along the line of zero yaw rate."""
    low, high = sorted(map(float, loop_deg))
    text = f"loop {format_number(high - low, 3)}°"
    place = {"x": across.channel("x"), "y": up.channel("v")}
    row = {"x": plain(low), "to": plain(high), "v": 0.0, "text": text}
    label = text, spots_along((low, 0.0), (high, 0.0), frame)
    zero = [(vector(frame.across), np.zeros(2)), (np.zeros(2), vector(frame.up))]
    return [
        layer("rule", [row], {**place, "x2": "to"}, style="overshoot", clip=True),
        *label_layers([label], frame, place, [line, *zero]),
    ]


def _listed(series: Sequence[TrackData] | Sequence[History]) -> str:
    return ", ".join(each.label for each in series)


def _signal_plot(
    runs: Sequence[History], signal: Signal, height_px: int, across: PlotAxis, marks: Sequence[TimeMark]
) -> Plot:
    """The panel of one signal."""
    if not any(signal.name in run.values for run in runs):
        raise ValueError(f"no run has the signal {signal.name}")
    unit, factor = shown_unit(signal.unit, signal.display_unit)
    series, over = [], []
    x, up = across.channel("x"), PlotAxis(with_unit(signal.title, unit))
    for run in runs:
        if signal.name in run.values:
            time, value = vector(run.time_s), factor * vector(run.values[signal.name])
            kept = thin_points([value], POINT_SAMPLES) if run.measured else slice(None)
            series.append(PlotSeries(run.label, x=time[kept], y=value[kept], points=run.measured))
        for band in run.bands:
            if band.signal == signal.name:
                edges = {"low": factor * vector(band.low), "high": factor * vector(band.high)}
                rows = records("band", {"x": vector(band.time_s)} | edges)
                over.append(
                    layer("area", rows, {"x": x, "y": up.channel("low"), "y2": "high"}, style="band", clip=True)
                )
    over += _mark_layers([mark for mark in marks if mark.signal == signal.name], x)
    return Plot(series, up=up, height_px=height_px, over=over)


def _mark_layers(marks: Sequence[TimeMark], x: ChartSpec) -> list[ChartSpec]:
    """Tinted spans, each with a line where it begins, for the shortest are no wider than that."""
    spans = [{"x": mark.begin_s, "end": mark.end_s, "text": mark.text} for mark in marks]
    place = {"x": x, "tooltip": tooltips({"text:N": "found", "x:Q": "from (s)"})}
    region = layer("rect", spans, {**place, "x2": "end"}, style="region", clip=True)
    return [region, layer("rule", spans, place, style="limit", clip=True, strokeWidth=1.2)] if spans else []


def motions(
    title: str, runs: Mapping[str, _Columns], measured: Sequence[str] = (), marks: Sequence[TimeMark] = ()
) -> list[Illustration]:
    """The tracks of some runs in one chart, where positions are known, and their time histories in another.

    `title`: what the runs are; `runs`: label to columns; those in `measured` are drawn as points; `marks`: by the name
    of the column without its unit.
    """
    tables = {label: _in_si(columns) for label, columns in runs.items()}
    drawn = []
    if tracks := [_track(label, table, label in measured) for label, table in tables.items() if _moves(table)]:
        drawn.append(Illustration(track_chart(tracks, title=f"Track: {title}")))
    height = 110 if len(_signals(runs)) <= 6 else 80
    if chart := columns_chart(runs, f"Histories: {title}", measured=measured, height_px=height, marks=marks):
        drawn.append(Illustration(chart))
    return drawn


def columns_chart(
    runs: Mapping[str, _Columns],
    title: str,
    *,
    measured: Sequence[str] = (),
    height_px: int = 60,
    marks: Sequence[TimeMark] = (),
) -> ChartSpec | None:
    """The signals of runs over time, but their positions, `measured` ones as points; None without any."""
    if not (signals := _signals(runs)):
        return None
    tables = {label: _in_si(columns) for label, columns in runs.items()}
    histories = [
        History(label, time_s=table["t_s"], values=_by_stem(table), measured=label in measured)
        for label, table in tables.items()
    ]
    return history_chart(histories, signals, title=title, height_px=height_px, marks=marks)


def varying_histories(columns: _Columns, bands: Mapping[str, BandOverTime], band_t_s: Array) -> Illustration | None:
    """The signals of a run that change, over time, with bands at `band_t_s` (n,); the others in the caption."""
    table = _by_stem(_in_si(columns))
    signals = [signal for signal in _signals({"run": columns}) if not (signal.name == _ORDER and _ANGLE in table)]
    constant = [signal for signal in signals if np.nanmax(table[signal.name]) == np.nanmin(table[signal.name])]
    shown = [signal for signal in signals if signal not in constant]
    if not shown:
        return None
    shaded = [_band(name, band, band_t_s) for name, band in bands.items() if name not in _TRACK]
    run = History("simulated", time_s=_in_si({"t_s": columns["t_s"]})["t_s"], values=table, bands=shaded)
    held = ", ".join(f"{signal.title.partition(',')[0]} {_held(signal, table[signal.name][0])}" for signal in constant)
    said = ["Shaded: nine of ten ships at each time."] if shaded else []
    said += [f"Constant: {held}."] if held else []
    return Illustration(history_chart([run], shown, title="Time histories", height_px=110), caption=" ".join(said))


def _band(name: str, band: BandOverTime, time_s: Array) -> HistoryBand:
    low, high = _in_si({f"p5_{name}": band.p5, f"p95_{name}": band.p95}).values()
    return HistoryBand(signal=stem_of(name), time_s=time_s, low=low, high=high)


def _held(signal: Signal, value: float) -> str:
    unit, factor = shown_unit(signal.unit, signal.display_unit)
    return f"{format_number(factor * value)} {unit}".strip()


def _in_si(columns: _Columns) -> dict[str, Array]:
    found = {}
    for name, values in columns.items():
        numbers = np.array([np.nan if value is None else value for value in values], dtype=float)
        si, factor = to_si(name, 1.0)
        found[si] = factor * numbers
    return found


def stem_of(name: str) -> str:
    """Return the name of a column without its unit."""
    return name.rpartition("_")[0] or name


def _by_stem(table: Mapping[str, Array]) -> dict[str, Array]:
    return {stem_of(name): values for name, values in table.items() if name != "t_s" and name not in _TRACK}


def _signals(runs: Mapping[str, _Columns]) -> list[Signal]:
    names = dict.fromkeys(name for columns in runs.values() for name in columns if name not in ("t_s", *_TRACK))
    found = []
    for name in names:
        unit = to_si(name, 1.0)[0].rpartition("_")[2]
        display = {"n": "rpm"}.get(stem_of(name).partition("_")[0])  # also n_port
        known = _UNITS.get(unit, "1")
        words, written = in_words(name)
        title = _TITLES.get(stem_of(name)) or (words if unit in _UNITS or not written else f"{words} ({written})")
        found.append(Signal(stem_of(name), title, known, display_unit=display))
    order = list(_TITLES)
    return sorted(found, key=lambda signal: order.index(signal.name) if signal.name in order else len(order))


def _moves(table: Mapping[str, Array]) -> bool:
    return all(name in table and np.isfinite(table[name]).any() for name in _TRACK)


def _track(label: str, table: Mapping[str, Array], measured: bool) -> TrackData:
    return TrackData(label, x_m=table["x_m"], y_m=table["y_m"], time_s=table["t_s"], measured=measured)
