"""NMEA 2000: logs of candump (can-utils), Actisense and the other text formats of the library ``nmea2000``."""

from __future__ import annotations

import datetime as dt
import logging
import re
from array import array
from collections import Counter, defaultdict
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from tank2sim.errors import InputError
from tank2sim.logs.clock import continued_clock
from tank2sim.logs.nmea0183 import steady_times
from tank2sim.logs.streams import LogFinding, LogStream, VesselLog, optional_library

_FIELDS: dict[int, dict[str, tuple[str, str]]] = {
    127250: {"heading": ("rad", "heading")},
    127251: {"rate": ("rad/s", "yaw_rate")},
    127245: {"position": ("rad", "rudder_angle"), "angleOrder": ("rad", "rudder_order")},
    127257: {"roll": ("rad", "heel")},
    127488: {"speed": ("rpm", "rpm")},
    128259: {"speedWaterReferenced": ("m/s", "u_water")},
    129025: {"latitude": ("deg", "latitude"), "longitude": ("deg", "longitude")},
    129026: {"cog": ("rad", "cog"), "sog": ("m/s", "sog")},
    129029: {"latitude": ("deg", "latitude"), "longitude": ("deg", "longitude")},
    130306: {"windSpeed": ("m/s", "wind_rel_speed"), "windAngle": ("rad", "wind_rel_direction")},
    130578: {
        "longitudinalSpeedWaterReferenced": ("m/s", "u_water"),
        "transverseSpeedWaterReferenced": ("m/s", "v_water"),
        "longitudinalSpeedGroundReferenced": ("m/s", "u_ground"),
        "transverseSpeedGroundReferenced": ("m/s", "v_ground"),
    },
}
"""Fields of the messages (PGN) by the names of canboat, with the unit of the library and the quantity."""

_SYSTEM_TIME = 126992
_CLOCK = re.compile(r"^(?:A(\d\d)(\d\d)(\d\d\.\d+)|(\d\d):(\d\d):(\d\d\.\d+)) ")
"""Time of day of Actisense's ASCII and of the raw format of gateways, without a date."""

_TIMED = re.compile(r"^\(\d+\.\d+\)|^\d{4}-\d\d-\d\d|^\d\d:\d\d:\d\d\.|^A\d{6}\.")
_LINES = (
    re.compile(rb"^\([\d.]+\)\s+\S+\s+[0-9A-Fa-f]{8}#"),
    re.compile(rb"^\d{4}-\d\d-\d\d[T-][\d:.]+Z?,\d,\d+,\d+,\d+,\d+,[0-9A-Fa-f]{2},"),
    re.compile(rb"^\s*(?:<0x[0-9A-Fa-f]+>|[a-z]+\d?\s+[0-9A-Fa-f]{8})\s+\[\d\]"),
    re.compile(rb"^A\d{6}\.\d+ [0-9A-Fa-f]{5} [0-9A-Fa-f]{5,6} "),
    re.compile(rb"^\d\d:\d\d:\d\d\.\d+ [RT] [0-9A-Fa-f]{8} "),
)


def looks_like_nmea2000(head: bytes) -> bool:
    """Whether at least half the lines of the beginning of a file are messages of a known format."""
    lines = [line for line in head.splitlines()[:-1] or head.splitlines() if line.strip()]
    return bool(lines) and 2 * sum(any(form.match(line) for form in _LINES) for line in lines) > len(lines)


def read_nmea2000(path: Path) -> VesselLog:
    """Read a text log of NMEA 2000: headings, rates of turn, rudders, engines, speeds, positions and wind.

    Times are those of the recorder, set to UTC by the system time (PGN 126992) where the log holds it; without a time
    stamp of the recorder they are those of the system times before and after. Time stamps without a date and without a
    system time give a log without a date.

    Raises
    ------
    InputError
        The file cannot be read, no message is understood, or there is no time.
    """
    reader = _Reader(path)
    with path.open(encoding="latin-1") as file:
        for number, line in enumerate(file):
            if line.strip():
                reader.take(number, line.strip())
    return reader.log()


@dataclass
class _Column:
    """Values of a field of one source, with time stamps and numbers of lines."""

    stamps: array[float] = field(default_factory=lambda: array("d"))
    values: array[float] = field(default_factory=lambda: array("d"))
    lines: array[int] = field(default_factory=lambda: array("q"))


class _Reader:
    """Reads line by line; the shift of the recorder's clock is known after the last."""

    def __init__(self, path: Path) -> None:
        self.path = path
        logging.getLogger("nmea2000").setLevel(logging.ERROR)
        self.decoder = optional_library("nmea2000", path).NMEA2000Decoder()
        self.counts: Counter[str] = Counter()
        self.columns: dict[tuple[int, int, str, str], _Column] = defaultdict(_Column)
        self.units: dict[tuple[int, str], str] = {}
        self.ticks = _Column()
        self.timed = self.dated = True
        self.days, self.last_s = 0, 0.0

    def take(self, number: int, line: str) -> None:
        """Take a line."""
        self.counts["lines"] += 1
        self.timed = self.timed and bool(_TIMED.match(line))
        try:
            message = self.decoder.decode(line)
        except Exception:  # whatever the library raises, the line is not a message
            self.counts["corrupted"] += 1
            return
        if message is None:
            return
        clock = _CLOCK.match(line)
        stamp = self._of_day(clock) if clock else message.timestamp.replace(tzinfo=dt.UTC).timestamp()
        values = {entry.id: entry.value for entry in message.fields}
        if message.PGN == _SYSTEM_TIME and isinstance(values.get("date"), dt.date):
            moment = dt.datetime.combine(values["date"], values["time"], tzinfo=dt.UTC)
            _append(self.ticks, stamp, moment.timestamp(), number)
        for name, (unit, quantity) in _FIELDS.get(message.PGN, {}).items():
            if isinstance(value := values.get(name), int | float):
                self.units[message.PGN, name] = unit
                where = _quantity(message.PGN, quantity, values)
                _append(self.columns[message.PGN, message.source, name, where], stamp, float(value), number)

    def _of_day(self, clock: re.Match[str]) -> float:
        """Time of day, s, which goes on over midnight."""
        hours, minutes, seconds = (float(part) for part in clock.groups() if part is not None)
        time = 3600 * hours + 60 * minutes + seconds
        self.days += time < self.last_s - 43200
        self.last_s, self.dated = time, False
        return 86400 * self.days + time

    def log(self) -> VesselLog:
        """The log after the last line."""
        ticks = self.ticks
        if not self.columns:
            raise InputError(self.path, "", "no message of it is understood", "give a log of candump or of Actisense")
        if not self.timed and len(ticks.values) < 2:
            remedy = "log with time stamps: candump -L"
            raise InputError(self.path, "", "has neither time stamps nor system times", remedy)
        clock, findings = np.array(ticks.values), list[LogFinding]()
        if len(clock) > 1:
            clock, findings = continued_clock(clock, "system time")
        shift = float(np.median(clock - np.array(ticks.stamps))) if self.timed and len(clock) else 0.0
        streams = []
        for (pgn, source, name, quantity), column in self.columns.items():
            time = np.array(column.stamps) + shift
            if not self.timed:
                time = steady_times(np.interp(column.lines, ticks.lines, clock))
            alike = [key for key in self.columns if (key[0], *key[2:]) == (pgn, name, quantity)]
            label = f"{pgn}.{name}" + (f" ({quantity})" if quantity != _FIELDS[pgn][name][1] else "")
            label += f" from {source}" if len(alike) > 1 else ""
            unit = self.units[pgn, name]
            streams.append(
                LogStream(label, time, np.array(column.values), unit, quantity, "format" if quantity else "")
            )
        if spoilt := self.counts["corrupted"]:
            text = f"{spoilt} of {self.counts['lines']} lines are corrupted and left out"
            findings.append(LogFinding("note", text))
        dated = self.dated or len(ticks.values) > 0
        return VesselLog(self.path, "NMEA 2000", tuple(streams), dict(self.counts), tuple(findings), dated)


def _append(column: _Column, stamp: float, value: float, number: int) -> None:
    column.stamps.append(stamp)
    column.values.append(value)
    column.lines.append(number)


def _quantity(pgn: int, quantity: str, values: dict[str, object]) -> str:
    """Quantity of a field whose meaning depends on other fields of its message."""
    reference = str(values.get("reference", values.get("cogReference", "")))
    if pgn == 127250 and reference.startswith("Magnetic"):
        return "magnetic_heading"
    if pgn == 129026 and quantity == "cog" and reference.startswith("Magnetic"):
        return ""
    if pgn == 130306 and "Apparent" not in reference:
        true = "ground" in reference.lower() or "North" in reference
        return quantity.replace("wind_rel", "wind" if true else "wind_theoretical")
    if (
        pgn == 127488
        and "Starboard" in str(values.get("instance", ""))
        and "Port" not in str(values.get("instance", ""))
    ):
        return "rpm_starboard"
    return quantity
