"""ArduPilot: dataflash logs (``.bin``, ``.log``) and telemetry logs (``.tlog``)."""

from __future__ import annotations

import math
import tempfile
from array import array
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tank2sim.apps.logs.clock import board_start
from tank2sim.apps.logs.findings import LogFinding, fault, not_used, note
from tank2sim.apps.logs.streams import FIELDS, LogStream, VesselLog, text_lines, unreadable
from tank2sim.arrays import Array
from tank2sim.errors import InputError, optional_library
from tank2sim.files import first_bytes
from tank2sim.records.spelt_units import unit_of_text

GPS_EPOCH_S = 315964800.0
"""1980-01-06 in seconds since 1970 (IS-GPS-200, 3.3.4)."""

LEAP_SECONDS = 18.0
"""GPS time is this many seconds ahead of UTC since 2017-01-01 (IERS Bulletin C 52; none was added up to 2025)."""

_WEEK_S = 604800.0
# GPS week of October 2008: ArduPilot's first boards are of 2009 (ardupilot.org, "History of ArduPilot")
_FIRST_BOARD_WEEK = 1500

_MAGIC = b"\xa3\x95"

_SERVO_FUNCTIONS = FIELDS["ardupilot"]["servo_functions"]
_FIELDS, _TELEMETRY = FIELDS["dataflash"], FIELDS["mavlink"]
_FORMAL = ("FMT", "FMTU", "UNIT", "MULT", "PARM", "MSG")  # Messages about the log itself

_INSTANCES = ("I", "C", "Inst", "Instance")
_FIX = 2  # Least status of a GPS fix, in two dimensions (GPS_STATUS of ArduPilot)
_UNKNOWN_16_BITS = 65535  # Value of a 16-bit field where nothing is known (mavlink.io)
# Bytes of a message of MAVLink 1 and 2 besides its payload, by its first one (mavlink.io, "Packet Serialization")
_FRAMES = {0xFE: 8, 0xFD: 12}
_SIGNED = 13  # Bytes of a signature

_Rows = dict[str, "array[float]"]
_Table = Mapping[str, Array]
_Sender = tuple[int, str, int]  # System, kind of message, component


def _rows() -> _Rows:
    return defaultdict(lambda: array("d"))


def read_ardupilot_bin(path: Path) -> VesselLog:
    """Read a dataflash log.

    Orders to servos (RCOU) become shares of their range by the parameters SERVOn_FUNCTION, _MIN, _TRIM, _MAX and
    _REVERSED. Times are the board's, set to UTC by the GPS with the least delay; a GPS fix has the time of the
    receiver.

    Raises InputError: The file is not such a log, or no message of it is understood.
    """
    log = _dataflash(path)
    receivers = [table for (kind, _), table in log.tables.items() if kind.startswith("GPS") and _has_clock(table)]
    gps = next((table for table in receivers if _has_fix(table).any()), None)
    boot, findings = _boot(gps)
    leaps = any(finding.kind == "fault" for finding in findings)
    findings += not_used("messages", log.others)
    streams = tuple(_dataflash_streams(log, boot, by_receiver=gps is not None and not leaps))
    if not streams:
        raise InputError(path, "", "no message of it is understood", "log GPS, ATT, IMU and RCOU")
    counts = {"messages": sum(len(table["TimeUS"]) for table in log.tables.values())}
    return VesselLog(path, "ArduPilot dataflash", streams, counts, tuple(findings), gps is not None)


class _Dataflash(NamedTuple):
    """Columns by message and instance, units by message and field, parameters, and the number of all other messages."""

    tables: Mapping[tuple[str, Any], _Table]
    units: Mapping[tuple[str, str], str]
    params: Mapping[str, float]
    others: dict[str, int]


def _dataflash(path: Path) -> _Dataflash:
    library = optional_library("pymavlink.DFReader", "logs", path)
    try:
        if first_bytes(path, 2) == _MAGIC:
            return _dataflash_tables(library.DFReader_binary(str(path)))
        with tempfile.TemporaryDirectory() as folder:
            copy = Path(folder) / "log.log"  # the library reads one byte a letter
            copy.write_bytes(b"".join(text_lines(path)))
            return _dataflash_tables(library.DFReader_text(str(copy)))
    except Exception as error:
        raise unreadable(path, error, "give a whole dataflash log") from None


def _dataflash_streams(log: _Dataflash, boot: float, *, by_receiver: bool) -> Iterator[LogStream]:
    """Streams in UTC; the fixes of a GPS have the time of the receiver if `by_receiver`."""
    for (kind, instance), table in log.tables.items():
        time = table["TimeUS"] * 1e-6 - boot
        label = kind if instance in (0, None) and (kind, 1) not in log.tables else f"{kind}[{instance:.0f}]"
        fixes = kind in ("GPS", "GPS2") and _has_clock(table)
        stamps = _utc(table) if fixes and by_receiver else time
        valid = _status(table) >= _FIX if fixes else np.True_
        for field, *meaning in _fields(log, kind, instance):
            yield LogStream(f"{label}.{field}", stamps, np.where(valid, table[field], np.nan), *meaning)
        if kind == "RCOU":
            pulses = {number: table.get(f"C{number}", table.get(f"Ch{number}")) for number in range(1, 17)}
            yield from _servo_orders(time, pulses, log.params)


def _fields(log: _Dataflash, kind: str, instance: Any) -> Iterator[tuple[str, str, str, str]]:
    """Fields of a message that are quantities: name, unit, quantity, and what states it."""
    table, alike = log.tables[kind, instance], sum(other == kind for other, _ in log.tables)
    for field, (unit, quantity) in _FIELDS.get(kind, {}).items():
        if field not in table or (kind == "XKF1" and instance):
            continue
        meaning = quantity, "format"
        if kind in ("RPM", "ESC"):  # whose they are is a guess, which the turn confirms or not
            meaning = _shaft(field, instance, table, alike)
        yield field, unit_of_text(log.units.get((kind, field), "")) or unit, *meaning


def _has_clock(table: _Table) -> bool:
    return {"GWk", "GMS"} <= set(table)


def _status(table: _Table) -> Array:
    return table.get("Status", np.full(len(table["TimeUS"]), _FIX))


def _has_fix(table: _Table) -> Array:
    """Where a table of a GPS (n,) has a time, and a fix in two or three dimensions."""
    return np.asarray((table["GWk"] > 0) & (_status(table) >= _FIX))


def _utc(table: _Table) -> Array:
    """UTC of the fixes of a GPS (n,), s since 1970."""
    return np.asarray(GPS_EPOCH_S + _WEEK_S * table["GWk"] + table["GMS"] / 1000 - LEAP_SECONDS)


def _boot(gps: _Table | None) -> tuple[float, list[LogFinding]]:
    """Time of the board at UTC 0, s, and faults of the receiver's clock."""
    if gps is None:
        return 0.0, [note("no fix of a GPS has a time: the trials have no date")]
    findings, fixed = [], _has_fix(gps)
    if (weeks := float(np.median(gps["GWk"][fixed]))) < _FIRST_BOARD_WEEK:
        text = f"the GPS week {weeks:.0f} is before the first boards: the receiver's date is 1024 weeks too early if "
        findings.append(note(f"{text}its week number has rolled over", "GPS", week=weeks))
    return board_start((gps["TimeUS"] * 1e-6 - _utc(gps))[fixed], "GPS", findings), findings


def _shaft(field: str, instance: Any, table: _Table, instances: int) -> tuple[str, str]:
    """Quantity of revolutions, and how it is known: a single one (``rpm2`` is -1) by the format, two by a guess."""
    numbered, second = field in ("rpm1", "rpm2"), table.get("rpm2")
    if numbered and second is not None and np.nanmax(np.abs(second), initial=0.0) <= 1:
        return ("rpm", "format") if field == "rpm1" else ("", "")
    if not numbered and instances == 1:
        return "rpm", "format"
    return {0: "rpm_port", 1: "rpm_starboard"}.get(int(field[-1]) - 1 if numbered else instance, ""), ""


def _dataflash_tables(reader: Any) -> _Dataflash:
    wanted = {*_FIELDS, "RCOU"}
    rows: dict[tuple[str, Any], _Rows] = defaultdict(_rows)
    units: dict[tuple[str, str], str] = {}
    while (message := reader.recv_match(type=[*wanted, "PARM"])) is not None:
        kind, names = message.get_type(), message.fmt.columns
        if kind == "PARM":
            continue
        group = rows[kind, next((getattr(message, name) for name in _INSTANCES if name in names), None)]
        if not group:
            units |= dict(zip(((kind, name) for name in names), message.fmt.units or [""] * len(names), strict=False))
        for name in names:
            group[name].append(float(getattr(message, name)))
    tables = {key: _table(group) for key, group in rows.items()}
    return _Dataflash(tables, units, reader.params, _other_messages(reader, {*wanted, *_FORMAL}))


def _other_messages(reader: Any, known: set[str]) -> dict[str, int]:
    """Number of the messages of all other kinds."""
    counts = reader.counts if isinstance(reader.counts, dict) else dict(enumerate(reader.counts))
    numbers = {form.name: counts.get(key, 0) for key, form in reader.formats.items()}
    return {kind: number for kind, number in numbers.items() if number and kind not in known}


def _table(rows: _Rows) -> _Table:
    return {name: np.array(values) for name, values in rows.items()}


def _servo_orders(time: Array, pulses: Mapping[int, Array | None], params: Mapping[str, float]) -> list[LogStream]:
    """Orders as shares of the range, positive to starboard and ahead; pulses (us) of outputs with other functions."""
    streams = []
    for number, width in pulses.items():
        if width is None:
            continue
        quantity = _SERVO_FUNCTIONS.get(f"{params.get(f'SERVO{number}_FUNCTION', 0):.0f}")
        values, meaning = width, ("us", "", "")
        if quantity is not None:
            usual = {"MIN": 1100.0, "TRIM": 1500.0, "MAX": 1900.0}
            least, trim, most = (params.get(f"SERVO{number}_{name}", value) for name, value in usual.items())
            sign = -1.0 if params.get(f"SERVO{number}_REVERSED", 0) else 1.0
            values = sign * (width - trim) / np.where(width >= trim, max(most - trim, 1.0), max(trim - least, 1.0))
            meaning = ("1", quantity, "format")
        streams.append(LogStream(f"RCOU.C{number}", time, np.where(width > 0, values, math.nan), *meaning))
    return streams


def looks_like_tlog(head: bytes) -> bool:
    """Whether a file begins with two messages of MAVLink, each behind a time stamp of 8 bytes, us since 1970."""
    place = 0
    for _ in range(2):
        frame = head[place + 8 : place + 11]
        if len(frame) < 3 or frame[0] not in _FRAMES or not 9e14 < int.from_bytes(head[place : place + 8]) < 4e15:
            return False
        place += 8 + frame[1] + _FRAMES[frame[0]] + (_SIGNED if frame[0] == 0xFD and frame[2] & 1 else 0)
    return True


def read_ardupilot_tlog(path: Path) -> VesselLog:
    """Read a telemetry log: MAVLink messages with the time of the ground station. Raises as :func:`read_ardupilot_bin`.

    Orders to servos become shares of their range where the log holds the parameters SERVOn_FUNCTION.
    """
    telemetry = _Telemetry()
    mavutil = optional_library("pymavlink.mavutil", "logs", path)
    try:
        link = mavutil.mavlogfile(str(path), robust_parsing=True)
        while (message := link.recv_match()) is not None:
            telemetry.take(message)
        link.close()
    except Exception as error:
        raise unreadable(path, error, "give a whole telemetry log") from None
    findings = not_used("messages", telemetry.unread)
    system = telemetry.vehicle(findings)
    tables = telemetry.tables(system)
    streams = []
    for kind, table in tables.items():
        for field, (factor, unit, quantity) in _TELEMETRY.get(kind, {}).items():
            if field in table:
                values = np.where(table[field] == _UNKNOWN_16_BITS, np.nan, factor * table[field])
                streams.append(LogStream(f"{kind}.{field}", table["_time"], values, unit, quantity, "format"))
    if (servos := tables.get("SERVO_OUTPUT_RAW")) is not None:
        pulses = {number: servos.get(f"servo{number}_raw") for number in range(1, 17)}
        streams += _servo_orders(servos["_time"], pulses, telemetry.params[system])
    if not streams:
        remedy = "give a telemetry log with positions and attitudes"
        raise InputError(path, "", "no message of it is understood", remedy)
    counts = {"messages": sum(len(table["_time"]) for table in tables.values())}
    return VesselLog(path, "MAVLink telemetry", tuple(streams), counts, tuple(findings))


class _Telemetry:
    """Numbers of the messages of each sender, parameters of each system, and the number of all other messages."""

    def __init__(self) -> None:
        self.rows: dict[_Sender, _Rows] = defaultdict(_rows)
        self.params: dict[int, dict[str, float]] = defaultdict(dict)
        self.unread: Counter[str] = Counter()

    def take(self, message: Any) -> None:
        kind, system = message.get_type(), message.get_srcSystem()
        if kind == "PARAM_VALUE":
            self.params[system][message.param_id] = message.param_value
        elif kind in (*_TELEMETRY, "SERVO_OUTPUT_RAW", "SYSTEM_TIME"):
            group = self.rows[system, kind, message.get_srcComponent()]
            group["_time"].append(message._timestamp)
            for name in message.get_fieldnames():
                if isinstance(value := getattr(message, name), int | float):
                    group[name].append(float(value))
        else:
            self.unread[kind] += 1

    def vehicle(self, findings: list[LogFinding]) -> int:
        """The system with the most messages that are understood; others are a fault."""
        sizes: Counter[int] = Counter()
        for (system, kind, _), group in self.rows.items():
            sizes[system] += len(group["_time"]) if kind in _TELEMETRY else 0
        vehicles = sorted(+sizes, key=lambda system: (-sizes[system], system))
        first, *others = [f"{system} ({sizes[system]} messages)" for system in vehicles] or [""]
        if others:
            text = f"the log is of {len(vehicles)} vehicles: system {first} is read, and not {', '.join(others)}"
            findings.append(fault(text, system=vehicles[0]))
        return vehicles[0] if vehicles else 0

    def tables(self, vehicle: int) -> dict[str, _Table]:
        """The messages of a system by kind, each of the component that sends the most of it."""
        own = [(kind, group) for (system, kind, _), group in self.rows.items() if system == vehicle]
        return {kind: _table(group) for kind, group in sorted(own, key=lambda entry: len(entry[1]["_time"]))}
