"""ArduPilot: dataflash logs (``.bin``, ``.log``) and telemetry logs (``.tlog``)."""

from __future__ import annotations

import math
import tempfile
from array import array
from collections import Counter, defaultdict
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from tank2sim.apps.logs.clock import board_start
from tank2sim.apps.logs.streams import LogFinding, LogStream, VesselLog, not_used, optional_library, text_lines
from tank2sim.arrays import Array
from tank2sim.errors import InputError
from tank2sim.records.spelt_units import unit_of_text

GPS_EPOCH_S = 315964800.0
"""1980-01-06 in seconds since 1970 (IS-GPS-200, 3.3.4)."""

LEAP_SECONDS = 18.0
"""GPS time is this many seconds ahead of UTC since 2017-01-01 (IERS Bulletin C 52; none was added up to 2025)."""

_WEEK_S = 604800.0
_FIRST_BOARD_WEEK = 1500
"""GPS week of October 2008: ArduPilot's first boards are of 2009 (ardupilot.org, "History of ArduPilot")."""

_MAGIC = b"\xa3\x95"

_SERVO_FUNCTIONS = {
    26: "rudder_order",
    70: "rpm_order",
    73: "thrust_order_port",
    74: "thrust_order_starboard",
}
"""SERVOn_FUNCTION of ArduPilot Rover: GroundSteering, Throttle, ThrottleLeft, ThrottleRight."""

_FIELDS: dict[str, dict[str, tuple[str, str]]] = {
    # message: field to (unit where the file states none, quantity)
    "GPS": {"Lat": ("deg", "latitude"), "Lng": ("deg", "longitude"), "Spd": ("m/s", "sog"), "GCrs": ("deg", "cog")},
    "ATT": {"Yaw": ("deg", "heading"), "Roll": ("deg", "heel")},
    "IMU": {"GyrZ": ("rad/s", "yaw_rate"), "AccX": ("m/s2", "a_x"), "AccY": ("m/s2", "a_y")},
    "XKF1": {"PN": ("m", "x"), "PE": ("m", "y"), "VN": ("m/s", "v_north"), "VE": ("m/s", "v_east")},
    "WIND": {
        "DirApp": ("deg", "wind_rel_direction"),
        "SpdApp": ("m/s", "wind_rel_speed"),
        "DirTrue": ("deg", "wind_direction"),
        "SpdTrue": ("m/s", "wind_speed"),
    },
    "RPM": {"RPM": ("rpm", "rpm"), "rpm1": ("rpm", "rpm"), "rpm2": ("rpm", "rpm")},
    "ESC": {"RPM": ("rpm", "rpm")},
}
_FIELDS["GPS2"] = _FIELDS["GPS"]
"""Fields of dataflash messages: ardupilot.org, "Onboard message log messages" of Rover."""

_FORMAL = ("FMT", "FMTU", "UNIT", "MULT", "PARM", "MSG")
"""Messages about the log itself."""

_INSTANCES = ("I", "C", "Inst", "Instance")
_COMMONEST = 3
"""Status of a GPS fix in three dimensions (GPS_STATUS of ArduPilot); less is not a fix, except 2, a fix in two."""


def read_ardupilot_bin(path: Path) -> VesselLog:
    """Read a dataflash log.

    Orders to servos (RCOU) become shares of their range by the parameters SERVOn_FUNCTION, _MIN, _TRIM, _MAX and
    _REVERSED. Times are those of the board, set to UTC by the GPS with the least delay; a GPS fix has the time of the
    receiver.

    Raises
    ------
    InputError
        The file is not such a log, or no message of it is understood.
    """
    library = optional_library("pymavlink.DFReader", path)
    try:
        with path.open("rb") as file:
            binary = file.read(2) == _MAGIC
        if binary:
            tables, units, params, unread = _dataflash_tables(library.DFReader_binary(str(path)))
        else:
            with tempfile.TemporaryDirectory() as folder:
                copy = Path(folder) / "log.log"  # the library reads one byte a letter
                copy.write_bytes(b"".join(text_lines(path)))
                tables, units, params, unread = _dataflash_tables(library.DFReader_text(str(copy)))
    except Exception as error:  # the library lets errors of struct through
        problem = f"cannot be read ({type(error).__name__}: {' '.join(str(error).split())[:100]})"
        raise InputError(path, "", problem, "give a whole dataflash log") from None
    receivers = [
        table for (kind, _), table in tables.items() if kind.startswith("GPS") and {"GWk", "GMS"} <= set(table)
    ]
    gps = next((table for table in receivers if _has_fix(table).any()), None)
    findings: list[LogFinding] = []
    if gps is None:
        boot = 0.0
        findings.append(LogFinding("note", "no fix of a GPS has a time: the trials have no date"))
    else:
        boot = _boot(gps, findings)
    leaps = any(finding.kind == "fault" for finding in findings)
    findings += not_used("messages", unread)
    streams = []
    for (kind, instance), table in tables.items():
        time = table["TimeUS"] * 1e-6 - boot
        label = kind if instance in (0, None) and (kind, 1) not in tables else f"{kind}[{instance:.0f}]"
        for field, (unit, quantity) in _FIELDS.get(kind, {}).items():
            if field not in table or (kind == "XKF1" and instance):
                continue
            values, stamps = table[field], time
            if kind in ("GPS", "GPS2") and {"GWk", "GMS"} <= set(table):
                stamps = time if leaps or gps is None else _utc(table)
                values = np.where(table.get("Status", np.full(len(time), _COMMONEST)) >= 2, values, np.nan)
            stated = unit_of_text(units.get((kind, field), "")) or unit
            meaning = (quantity, "format")
            if kind in ("RPM", "ESC"):  # whose they are is a guess, which the turn confirms or not
                meaning = _shaft(field, instance, table, sum(other == kind for other, _ in tables))
            streams.append(LogStream(f"{label}.{field}", stamps, values, stated, *meaning))
        if kind == "RCOU":
            streams += list(_servo_orders(time, table, params))
    if not streams:
        raise InputError(path, "", "no message of it is understood", "log GPS, ATT, IMU and RCOU")
    counts = {"messages": sum(len(table["TimeUS"]) for table in tables.values())}
    return VesselLog(path, "ArduPilot dataflash", tuple(streams), counts, tuple(findings), gps is not None)


def _utc(table: Mapping[str, Array]) -> Array:
    """UTC of the fixes of a GPS (n,), s since 1970."""
    return np.asarray(GPS_EPOCH_S + _WEEK_S * table["GWk"] + table["GMS"] / 1000 - LEAP_SECONDS)


def _boot(gps: Mapping[str, Array], findings: list[LogFinding]) -> float:
    """Time of the board at UTC 0, s; faults of the receiver's clock become findings."""
    fixed = _has_fix(gps)
    lag = (gps["TimeUS"] * 1e-6 - _utc(gps))[fixed]
    if (weeks := float(np.median(gps["GWk"][fixed]))) < _FIRST_BOARD_WEEK:
        text = (
            f"the GPS week {weeks:.0f} is before the first boards: the receiver's date is 1024 weeks too early if its "
        )
        findings.append(LogFinding("note", f"{text}week number has rolled over", "GPS", {"week": weeks}))
    return board_start(lag, "GPS", findings)


def _has_fix(table: Mapping[str, Array]) -> Array:
    """Where a table of a GPS (n,) has a time, and a fix in two or three dimensions."""
    return np.asarray((table["GWk"] > 0) & (table.get("Status", np.full(len(table["GWk"]), _COMMONEST)) >= 2))


def _shaft(field: str, instance: Any, table: Mapping[str, Array], instances: int) -> tuple[str, str]:
    """Quantity of revolutions, and how it is known: a single one (``rpm2`` is -1) by the format, two by a guess."""
    second = table.get("rpm2")
    if field in ("rpm1", "rpm2") and second is not None and np.nanmax(np.abs(second), initial=0.0) <= 1:
        return ("rpm", "format") if field == "rpm1" else ("", "")
    if field not in ("rpm1", "rpm2") and instances == 1:
        return "rpm", "format"
    number = int(field[-1]) - 1 if field in ("rpm1", "rpm2") else instance
    return {0: "rpm_port", 1: "rpm_starboard"}.get(number, ""), ""


_Tables = dict[tuple[str, Any], dict[str, Array]]


def _dataflash_tables(
    reader: Any,
) -> tuple[_Tables, dict[tuple[str, str], str], Mapping[str, float], dict[str, int]]:
    """Columns by message and instance, units by message and field, parameters, and the number of all other messages."""
    wanted = {*_FIELDS, "RCOU"}
    rows: dict[tuple[str, Any], dict[str, array[float]]] = defaultdict(lambda: defaultdict(lambda: array("d")))
    units: dict[tuple[str, str], str] = {}
    while (message := reader.recv_match(type=[*wanted, "PARM"])) is not None:
        kind = message.get_type()
        if kind == "PARM":
            continue
        names = message.fmt.columns
        instance = next((getattr(message, name) for name in _INSTANCES if name in names), None)
        if (kind, instance) not in rows:
            stated = message.fmt.units or [""] * len(names)
            units |= {(kind, name): unit for name, unit in zip(names, stated, strict=False)}
        group = rows[kind, instance]
        for name in names:
            group[name].append(float(getattr(message, name)))
    tables = {key: {name: np.array(values) for name, values in group.items()} for key, group in rows.items()}
    counts = reader.counts if isinstance(reader.counts, dict) else dict(enumerate(reader.counts))
    numbers = {form.name: counts.get(key, 0) for key, form in reader.formats.items()}
    others = {kind: number for kind, number in numbers.items() if number and kind not in {*wanted, *_FORMAL}}
    return tables, units, reader.params, others


def _servo_orders(time: Array, table: Mapping[str, Array], params: Mapping[str, float]) -> list[LogStream]:
    """Orders as shares of the range, positive to starboard and ahead; pulses (us) of outputs with other functions."""
    streams = []
    for number in range(1, 17):
        quantity = _SERVO_FUNCTIONS.get(int(params.get(f"SERVO{number}_FUNCTION", 0)))
        pulses = table.get(f"C{number}", table.get(f"Ch{number}"))
        if pulses is None:
            continue
        if quantity is None:
            streams.append(LogStream(f"RCOU.C{number}", time, np.where(pulses > 0, pulses, math.nan), "us"))
            continue
        least, trim, most = (
            params.get(f"SERVO{number}_{name}", usual)
            for name, usual in (("MIN", 1100.0), ("TRIM", 1500.0), ("MAX", 1900.0))
        )
        share = np.where(
            pulses >= trim, (pulses - trim) / max(most - trim, 1.0), (pulses - trim) / max(trim - least, 1.0)
        )
        sign = -1.0 if params.get(f"SERVO{number}_REVERSED", 0) else 1.0
        share = np.where(pulses > 0, sign * share, math.nan)
        streams.append(LogStream(f"RCOU.C{number}", time, share, "1", quantity, "format"))
    return streams


_TELEMETRY: dict[str, dict[str, tuple[float, str, str]]] = {
    # message: field to (factor, unit, quantity)
    "GLOBAL_POSITION_INT": {
        "lat": (1e-7, "deg", "latitude"),
        "lon": (1e-7, "deg", "longitude"),
        "vx": (0.01, "m/s", "v_north"),
        "vy": (0.01, "m/s", "v_east"),
    },
    "GPS_RAW_INT": {"vel": (0.01, "m/s", "sog"), "cog": (0.01, "deg", "cog")},
    "ATTITUDE": {"yaw": (1.0, "rad", "heading"), "yawspeed": (1.0, "rad/s", "yaw_rate"), "roll": (1.0, "rad", "heel")},
    "RPM": {"rpm1": (1.0, "rpm", "rpm")},
}
"""Fields of MAVLink messages (mavlink.io, common message set)."""

_UNKNOWN_16_BITS = 65535
"""What a field of 16 bits holds where nothing is known (mavlink.io)."""


_FRAMES = {0xFE: 8, 0xFD: 12}
"""Bytes of a message of MAVLink 1 and 2 besides its payload, by its first one (mavlink.io, "Packet Serialization")."""

_SIGNED = 13
"""Bytes of a signature."""


def looks_like_tlog(head: bytes) -> bool:
    """Whether a file begins with two messages of MAVLink, each behind a time stamp of 8 bytes, us since 1970."""
    place = 0
    for _ in range(2):
        frame = head[place + 8 : place + 11]
        if len(frame) < 3 or frame[0] not in _FRAMES or not 9e14 < int.from_bytes(head[place : place + 8]) < 4e15:
            return False
        place += 8 + frame[1] + _FRAMES[frame[0]] + (_SIGNED if frame[0] == 0xFD and frame[2] & 1 else 0)
    return True


_Sender = tuple[int, str, int]
"""System, kind of message, component."""


def read_ardupilot_tlog(path: Path) -> VesselLog:
    """Read a telemetry log: MAVLink messages with the time of the ground station. Raises as :func:`read_ardupilot_bin`.

    Orders to servos become shares of their range where the log holds the parameters SERVOn_FUNCTION.
    """
    mavutil = optional_library("pymavlink.mavutil", path)
    rows: dict[_Sender, dict[str, array[float]]] = defaultdict(lambda: defaultdict(lambda: array("d")))
    every: dict[int, dict[str, float]] = defaultdict(dict)
    unread: Counter[str] = Counter()
    try:
        link = mavutil.mavlogfile(str(path), robust_parsing=True)
        wanted = {*_TELEMETRY, "SERVO_OUTPUT_RAW", "PARAM_VALUE", "SYSTEM_TIME"}
        while (message := link.recv_match()) is not None:
            kind, system = message.get_type(), message.get_srcSystem()
            if kind not in wanted:
                unread[kind] += 1
                continue
            if kind == "PARAM_VALUE":
                every[system][message.param_id] = message.param_value
                continue
            group = rows[system, kind, message.get_srcComponent()]
            group["_time"].append(message._timestamp)
            for name in message.get_fieldnames():
                value = getattr(message, name)
                if isinstance(value, int | float):
                    group[name].append(float(value))
        link.close()
    except Exception as error:
        problem = f"cannot be read ({type(error).__name__}: {' '.join(str(error).split())[:100]})"
        raise InputError(path, "", problem, "give a whole telemetry log") from None
    findings = not_used("messages", unread)
    system, chosen = _one_vehicle(rows, findings)
    tables = {kind: {name: np.array(values) for name, values in group.items()} for kind, group in chosen.items()}
    streams = []
    for kind, table in tables.items():
        for field, (factor, unit, quantity) in _TELEMETRY.get(kind, {}).items():
            if field in table:
                values = np.where(table[field] == _UNKNOWN_16_BITS, np.nan, factor * table[field])
                streams.append(LogStream(f"{kind}.{field}", table["_time"], values, unit, quantity, "format"))
    if "SERVO_OUTPUT_RAW" in tables:
        servos = tables["SERVO_OUTPUT_RAW"]
        pulses = {
            f"C{number}": servos[f"servo{number}_raw"] for number in range(1, 17) if f"servo{number}_raw" in servos
        }
        streams += _servo_orders(servos["_time"], pulses, every[system])
    if not streams:
        raise InputError(
            path, "", "no message of it is understood", "give a telemetry log with positions and attitudes"
        )
    counts = {"messages": sum(len(table["_time"]) for table in tables.values())}
    return VesselLog(path, "MAVLink telemetry", tuple(streams), counts, tuple(findings))


def _one_vehicle(
    rows: Mapping[_Sender, dict[str, array[float]]], findings: list[LogFinding]
) -> tuple[int, dict[str, dict[str, array[float]]]]:
    """The system with the most messages, and its messages by kind, each of the component that sends the most of it."""
    sizes: Counter[int] = Counter()
    for (system, kind, _), group in rows.items():
        sizes[system] += len(group["_time"]) if kind in _TELEMETRY else 0
    vehicles = sorted((system for system in sizes if sizes[system]), key=lambda system: (-sizes[system], system))
    if not vehicles:
        return 0, {}
    if len(vehicles) > 1:
        others = ", ".join(f"{system} ({sizes[system]} messages)" for system in vehicles[1:])
        text = f"the log is of {len(vehicles)} vehicles: system {vehicles[0]} ({sizes[vehicles[0]]} messages) is read, "
        findings.append(LogFinding("fault", f"{text}and not {others}", evidence={"system": vehicles[0]}))
    own = [(kind, group) for (system, kind, _), group in rows.items() if system == vehicles[0]]
    return vehicles[0], dict(sorted(own, key=lambda entry: len(entry[1]["_time"])))
