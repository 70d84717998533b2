"""The page of a vessel's log: the map, the time line with its stretches, the channels, and what was found."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import PurePath

import numpy as np

from tank2sim.answer.charts.parts import vector
from tank2sim.answer.charts.picture import History, Signal, TimeMark, TrackData, history_chart, track_chart
from tank2sim.answer.page import Page
from tank2sim.answer.parts import Cell, Column, Illustration, KeyFigure, Section, Table, Verdict, notices_section
from tank2sim.arrays import Array
from tank2sim.report.json_values import Json

_SIGNALS = (
    Signal(name="rudder_order", title="rudder order", unit="rad"),
    Signal(name="rudder_angle", title="rudder angle", unit="rad"),
    Signal(name="thrust_order_port", title="port thruster", unit="1"),
    Signal(name="thrust_order_starboard", title="starboard thruster", unit="1"),
    Signal(name="rpm_order", title="ordered revolutions", unit="rad/s", display_unit="rpm"),
    Signal(name="rpm", title="revolutions", unit="rad/s", display_unit="rpm"),
    Signal(name="rpm_port", title="port revolutions", unit="rad/s", display_unit="rpm"),
    Signal(name="rpm_starboard", title="starboard revolutions", unit="rad/s", display_unit="rpm"),
    Signal(name="heading", title="heading", unit="rad"),
    Signal(name="yaw_rate", title="yaw rate", unit="rad/s"),
    Signal(name="sog", title="speed over ground", unit="m/s"),
    Signal(name="u_water", title="speed ahead through the water", unit="m/s"),
    Signal(name="v_water", title="speed to starboard through the water", unit="m/s"),
)
_MOST_TRACKS = 8
"""Stretches that have a line of their own on the map. Project choice: as many colours can be distinguished."""


def log_page(found: Json) -> Page:
    """Return the page of the JSON of ``tank2sim log``."""
    stretches, channels = found["stretches"], found["channels"]
    exciting = [stretch for stretch in stretches if stretch["excites"]]
    files = [stretch for stretch in stretches if stretch["file"]]
    faults = sum(finding["kind"] == "fault" for finding in found["findings"])
    figures = [
        KeyFigure(label="Trials cut out", value=len(files), note=f"of {len(stretches)} stretches"),
        KeyFigure(
            label="Time that excites the vessel",
            value=round(sum(float(stretch["duration_s"]) for stretch in exciting)),
            unit="s",
            note=f"of {found['duration_s']:.4g} s",
        ),
        KeyFigure(label="Channels in use", value=sum(channel["use"] for channel in channels)),
        KeyFigure(label="Faults", value=faults, verdict=Verdict.CAUTION if faults else Verdict.PASSED),
    ]
    sections = [*_map(found), *_time_line(found)]
    sections.append(Section(heading="Stretches", tables=[_stretch_table(stretches)]))
    sections += _verdicts(found.get("identified"))
    sections += notices_section(found["notices"])
    tables = [_channel_table(channels), _log_table(found["logs"])]
    sections.append(Section(heading="Channels and logs", tables=tables, folded=True))
    names = ", ".join(PurePath(str(entry["file"])).name for entry in found["logs"])
    subtitle = f"Voyage from {found['begins_utc']}" if found["begins_utc"] else "Voyage without a date"
    return Page(
        title=f"Log: {names}", subtitle=subtitle, verdict=_verdict(files, faults), figures=figures, sections=sections
    )


def _verdict(cut: Sequence[Json], faults: int) -> str:
    """What the log gives for an identification."""
    if not cut:
        return "The log has no manoeuvre that could be cut out as a trial."
    orders: dict[str, list[str]] = {}  # kind to the orders of its trials, empty without any
    for stretch in cut:
        _, kind, *order = PurePath(stretch["file"]).stem.split("_")  # such as 02_zigzag_-20
        orders.setdefault(kind, []).append(" ".join(order))
    names = ", ".join(f"{kind} {_in_short(each)}".rstrip() for kind, each in orders.items())
    count = f"{len(cut)} trials are" if len(cut) > 1 else "One trial is"
    return f"{count} cut out: {names}." + (f" {faults} faults are noted below." if faults else "")


def _in_short(orders: Sequence[str]) -> str:
    """Orders of the trials of a kind, or how many these are."""
    if all(orders):
        return " ".join(orders)
    return f"({len(orders)})" if len(orders) > 1 else ""


def _map(found: Json) -> list[Section]:
    if not found["track"]:
        return []
    time, x, y = (vector(found["track"][name]) for name in ("t_s", "x_m", "y_m"))
    tracks = [TrackData(label="voyage", x_m=x, y_m=y, time_s=time)]
    cut = [stretch for stretch in found["stretches"] if stretch["file"]]
    exciting = sorted(cut, key=lambda stretch: -stretch["duration_s"])[:_MOST_TRACKS]
    for stretch in sorted(exciting, key=lambda stretch: float(stretch["begins_s"])):
        inside = _inside(time, stretch)
        if inside.sum() > 1:
            label = PurePath(stretch["file"]).stem
            tracks.append(TrackData(label=label, x_m=x[inside], y_m=y[inside], time_s=time[inside]))
    origin = found["origin_deg"]
    caption = f"Origin at {origin[0]:g} deg N, {origin[1]:g} deg E (WGS 84)." if origin else ""
    if len(cut) > _MOST_TRACKS:
        caption += f" The longest {_MOST_TRACKS} of {len(cut)} trials are shown."
    chart = Illustration(chart=track_chart(tracks, title="Map"), caption=caption)
    return [Section(heading="Map", charts=[chart])]


def _inside(time: Array, stretch: Json) -> np.ndarray:
    begin = float(stretch["begins_s"])
    return np.asarray((time >= begin) & (time <= begin + float(stretch["duration_s"])))


def _time_line(found: Json) -> list[Section]:
    line = found["time_line"]
    shown = [signal for signal in _SIGNALS if signal.name in line]
    if not shown:
        return []
    read = {signal.name: (vector(line[signal.name]["t_s"]), vector(line[signal.name]["value"])) for signal in shown}
    time = np.unique(np.concatenate([own for own, _ in read.values()]))
    values = {name: np.interp(time, *series, left=np.nan, right=np.nan) for name, series in read.items()}
    marks = [
        TimeMark(
            signal=signal.name,
            begin_s=float(stretch["begins_s"]),
            end_s=float(stretch["begins_s"]) + float(stretch["duration_s"]),
            text=str(stretch["file"] or stretch["kind"]),
        )
        for signal in shown
        for stretch in found["stretches"]
        if stretch["excites"]
    ]
    caption = "Tinted: the stretches that excite the vessel. Times from the begin of the log."
    chart = history_chart(
        [History(label="log", time_s=time, values=values)], shown, title="What was logged", height_px=70, marks=marks
    )
    return [Section(heading="Time line", charts=[Illustration(chart=chart, caption=caption)])]


def _stretch_table(stretches: Json) -> Table:
    heads = [
        Column(title="stretch"),
        Column(title="begins", unit="s", digits=6),
        Column(title="lasts", unit="s"),
        Column(title="steering"),
        Column(title="heading change", unit="deg", digits=3),
        Column(title="reversals"),
        Column(title="speed", unit="m/s", digits=3),
        Column(title="rms yaw rate", unit="deg/s", digits=3),
        Column(title="file"),
    ]
    keys = ("kind", "begins_s", "duration_s", "steering", "heading_change_deg", "reversals", "speed_mps")
    rows: list[list[Cell]] = [
        [*(stretch[key] for key in keys), stretch["yaw_rate_rms_degps"], stretch["file"] or "-"]
        for stretch in stretches
    ]
    return Table(caption="Stretches", columns=heads, rows=rows)


def _channel_table(channels: Json) -> Table:
    heads = [Column(title=title) for title in ("quantity", "stream", "unit", "sign", "confidence", "used", "why")]
    keys = ("quantity", "stream", "unit", "sign", "confidence", "use", "why")
    rows: list[list[Cell]] = [[channel[key] for key in keys] for channel in channels]
    return Table(caption="Channels, to be confirmed or corrected in channels.toml", columns=heads, rows=rows)


def _verdicts(identified: Json) -> list[Section]:
    """What the trials say of each coefficient of a craft, and the five minutes that would say more."""
    if not identified:
        return []
    heads = [
        Column(title="coefficient (SI)"),
        Column(title="value", digits=4),
        Column(title="standard error", digits=2),
        Column(title="verdict"),
        Column(title="mostly by"),
    ]
    rows: list[list[Cell]] = [
        [name, entry["value"], entry["standard_error"], entry["verdict"], entry["by"] or "-"]
        for name, entry in identified["coefficients"].items()
    ]
    tables = [Table(caption="Coefficients", columns=heads, rows=rows)]
    if identified["next_trials"]:
        further = [Column(title="five minutes of (port/starboard, % of full)"), Column(title="would determine")]
        orders: list[list[Cell]] = [
            [entry["words"], ", ".join(entry["determines"]) or "-"] for entry in identified["next_trials"]
        ]
        tables.append(Table(caption="Next trial", columns=further, rows=orders))
    text = (
        "Identified: the standard error is at most a quarter of the value. Bounded: the trials have at least halved "
        "what was uncertain before. Not determined: the value is the card's."
    )
    return [Section(heading="What the trials determine", text=text, tables=tables)]


def _log_table(logs: Json) -> Table:
    heads = [Column(title=title) for title in ("file", "format", "streams", "read and lost")]
    rows: list[list[Cell]] = [
        [
            PurePath(str(entry["file"])).name,
            entry["format"],
            entry["streams"],
            ", ".join(f"{key.replace('_', ' ')} {value}" for key, value in entry["counts"].items()),
        ]
        for entry in logs
    ]
    return Table(caption="Logs", columns=heads, rows=rows)
