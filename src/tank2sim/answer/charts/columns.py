"""Tracks and time histories of columns by the names of the trial format.

One table of columns is ``{"t_s": [...], "psi_deg": [...], ...}``; angles may be in degrees or radians.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from tank2sim.answer.charts.motion import (
    History,
    HistoryBand,
    Signal,
    TimeMark,
    TrackData,
    history_chart,
    track_chart,
)
from tank2sim.answer.charts.parts import shown_unit
from tank2sim.answer.charts.vega import ChartSpec
from tank2sim.answer.numbers import format_number
from tank2sim.answer.parts import Illustration
from tank2sim.arrays import Array
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


def motions(
    title: str, runs: Mapping[str, _Columns], measured: Sequence[str] = (), marks: Sequence[TimeMark] = ()
) -> list[Illustration]:
    """The tracks of some runs in one chart, where positions are known, and their time histories in another.

    Parameters
    ----------
    title : str
        What the runs are.
    runs : mapping
        Label to columns; those in `measured` are drawn as points.
    marks : sequence of TimeMark
        By the name of the column without its unit.
    """
    tables = {label: _in_si(columns) for label, columns in runs.items()}
    drawn = []
    if tracks := [_track(label, table, label in measured) for label, table in tables.items() if _moves(table)]:
        drawn.append(Illustration(chart=track_chart(tracks, title=f"Track: {title}")))
    signals = _signals(runs)
    if signals:
        histories = [
            History(label=label, time_s=table["t_s"], values=_by_stem(table), measured=label in measured)
            for label, table in tables.items()
        ]
        height = 110 if len(signals) <= 6 else 80
        chart = history_chart(histories, signals, title=f"Histories: {title}", height_px=height, marks=marks)
        drawn.append(Illustration(chart=chart))
    return drawn


def measured_histories(columns: _Columns, title: str) -> ChartSpec | None:
    """The signals of a record over time, but its positions; None without any."""
    return columns_chart({"measured": columns}, title)


def columns_chart(
    runs: Mapping[str, _Columns], title: str, *, measured: Sequence[str] = (), height_px: int = 60
) -> ChartSpec | None:
    """The signals of runs over time, but their positions, `measured` ones as points; None without any."""
    if not (signals := _signals(runs)):
        return None
    tables = {label: _in_si(columns) for label, columns in runs.items()}
    histories = [
        History(label=label, time_s=table["t_s"], values=_by_stem(table), measured=label in measured)
        for label, table in tables.items()
    ]
    return history_chart(histories, signals, title=title, height_px=height_px)


def varying_histories(columns: _Columns, bands: Mapping[str, BandOverTime], band_t_s: Array) -> Illustration | None:
    """The signals of a run that change, over time, with bands at `band_t_s` (n,); the others in the caption."""
    table = _by_stem(_in_si(columns))
    signals = [signal for signal in _signals({"run": columns}) if not (signal.name == _ORDER and _ANGLE in table)]
    constant = [signal for signal in signals if np.nanmax(table[signal.name]) == np.nanmin(table[signal.name])]
    shown = [signal for signal in signals if signal not in constant]
    if not shown:
        return None
    shaded = [_band(name, band, band_t_s) for name, band in bands.items() if name not in _TRACK]
    run = History(label="simulated", time_s=_in_si({"t_s": columns["t_s"]})["t_s"], values=table, bands=shaded)
    held = ", ".join(f"{signal.title} {_held(signal, table[signal.name][0])}" for signal in constant)
    said = ["Shaded: nine of ten ships at each time."] if shaded else []
    said += [f"Constant: {held}."] if held else []
    chart = history_chart([run], shown, title="Time histories", height_px=110)
    return Illustration(chart=chart, caption=" ".join(said))


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
        display = {"n": "rpm"}.get(stem_of(name))
        known = _UNITS.get(unit, "1")
        words, written = in_words(name)
        title = _TITLES.get(stem_of(name)) or (words if unit in _UNITS or not written else f"{words} ({written})")
        found.append(Signal(name=stem_of(name), title=title, unit=known, display_unit=display))
    order = list(_TITLES)
    return sorted(found, key=lambda signal: order.index(signal.name) if signal.name in order else len(order))


def _moves(table: Mapping[str, Array]) -> bool:
    return all(name in table and np.isfinite(table[name]).any() for name in _TRACK)


def _track(label: str, table: Mapping[str, Array], measured: bool) -> TrackData:
    return TrackData(label=label, x_m=table["x_m"], y_m=table["y_m"], time_s=table["t_s"], measured=measured)
