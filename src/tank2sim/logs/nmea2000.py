"""NMEA 2000: logs of candump (can-utils), Actisense and the other text formats of the library ``nmea2000``."""

from __future__ import annotations

import datetime as dt
import logging
import re
from array import array
from collections import Counter, defaultdict
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
    stamp of the recorder they are those of the system times before and after.

    Raises
    ------
    InputError
        The file cannot be read, no message is understood, or there is no time.
    """
    library = optional_library("nmea2000", path)
    logging.getLogger("nmea2000").setLevel(logging.ERROR)
    decoder = library.NMEA2000Decoder()
    counts: Counter[str] = Counter()
    columns: dict[tuple[int, int, str, str], tuple[array[float], array[float], array[int]]] = defaultdict(
        lambda: (array("d"), array("d"), array("q"))
    )
    ticks, tick_stamps, tick_lines = array("d"), array("d"), array("q")
    timed = True
    with path.open(encoding="latin-1") as file:
        for number, line in enumerate(file):
            if not line.strip():
                continue
            counts["lines"] += 1
            timed = timed and bool(_TIMED.match(line))
            try:
                message = decoder.decode(line.strip())
            except Exception:  # whatever the library raises, the line is not a message
                counts["corrupted"] += 1
                continue
            if message is None:
                continue
            stamp = message.timestamp.replace(tzinfo=dt.timezone.utc).timestamp()
            values = {field.id: field.value for field in message.fields}
            if message.PGN == _SYSTEM_TIME and isinstance(values.get("date"), dt.date):
                moment = dt.datetime.combine(values["date"], values["time"], tzinfo=dt.timezone.utc)
                ticks.append(moment.timestamp())
                tick_stamps.append(stamp)
                tick_lines.append(number)
            for name, (unit, quantity) in _FIELDS.get(message.PGN, {}).items():
                value = values.get(name)
                if isinstance(value, int | float):
                    where = _quantity(message.PGN, quantity, values)
                    stamps, numbers, lines = columns[message.PGN, message.source, f"{name}|{unit}", where]
                    stamps.append(stamp)
                    numbers.append(float(value))
                    lines.append(number)
    findings: list[LogFinding] = []
    if not columns:
        raise InputError(path, "", "no message of it is understood", "give a log of candump or of Actisense")
    if not timed and len(ticks) < 2:
        raise InputError(path, "", "has neither time stamps nor system times", "log with time stamps: candump -L")
    clock, found = continued_clock(np.array(ticks), "system time") if len(ticks) > 1 else (np.array(ticks), [])
    findings += found
    shift = float(np.median(clock - np.array(tick_stamps))) if timed and len(clock) else 0.0
    sources = {(pgn, name, where): set() for pgn, _, name, where in columns}
    for pgn, source, name, where in columns:
        sources[pgn, name, where].add(source)
    streams = []
    for (pgn, source, field, where), (stamps, numbers, lines) in columns.items():
        name, _, unit = field.partition("|")
        several = len(sources[pgn, field, where]) > 1
        label = f"{pgn}.{name}" + (f" {where}" if where not in dict(_FIELDS[pgn].values()).values() else "")
        time = np.array(stamps) + shift if timed else steady_times(np.interp(lines, tick_lines, clock))
        label += f" from {source}" if several else ""
        streams.append(LogStream(label, time, np.array(numbers), unit, where, "format"))
    if spoilt := counts["corrupted"]:
        findings.append(LogFinding("note", f"{spoilt} of {counts['lines']} lines are corrupted and left out"))
    return VesselLog(path, "NMEA 2000", tuple(streams), dict(counts), tuple(findings))


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
    if pgn == 127488 and "Starboard" in str(values.get("instance", "")) and "Port" not in str(values.get("instance", "")):
        return "rpm_starboard"
    return quantity
