"""NMEA 2000: logs of candump (can-utils), Actisense and the other text formats of the library ``nmea2000``."""

from __future__ import annotations

import datetime as dt
import logging
import math
import re
from collections import Counter, defaultdict
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.stats import theilslopes

from tank2sim.apps.logs.clock import continued_clock, rollover_s, stamp_s
from tank2sim.apps.logs.findings import LogFinding, fault, not_used, note
from tank2sim.apps.logs.nmea0183 import steady_times
from tank2sim.apps.logs.streams import FIELDS, LogStream, Samples, VesselLog, mostly, text_lines
from tank2sim.arrays import Array
from tank2sim.errors import InputError, optional_library

_FIELDS: dict[int, dict[str, list[str]]] = {int(pgn): fields for pgn, fields in FIELDS["nmea2000"].items()}
_SYSTEM_TIME, _VARIATION, _RUDDER, _ENGINE = 126992, 127258, 127245, 127488
_TRUE = "true heading"

_OFTEN = 0.1
"""Share of time stamps that fall from which they are differences. Project choice: messages rarely change places."""

_CLOCKS_APART_S = 1.5
"""Difference of the clocks of two sources that is reported, s: they send whole seconds (project choice)."""

_PACE_OFF, _PACE_FROM, _PACE_FROM_S = 0.05, 8, 10.0
"""Share by which the pace of two clocks must differ, and the number and span (s) of system times from which it is known
(project choice: whole seconds over ten leave 3 %)."""

# Time of day of Actisense's ASCII and of the raw format of gateways, without a date
_CLOCK = re.compile(r"^(?:A(\d\d)(\d\d)(\d\d\.\d+)|(\d\d):(\d\d):(\d\d\.\d+)) ")

_TIMED = re.compile(r"^\(\d+\.\d+\)|^\d{4}-\d\d-\d\d|^\d\d:\d\d:\d\d\.|^A\d{6}\.")
# A frame of 29 bits: candump in any form (-L, -t, -x, -a; can-utils), Vector's ASC, and tables of frames
_FRAME = re.compile(
    r"^\s*\(?(?P<stamp>\d{4}-\d\d-\d\d[T ]\d\d:[\d:.]+Z?|\d+(?:\.\d+)?)\)?[\s,;]+"
    r"(?P<bus>\S+?)[\s,;]+(?:[RT]X\s+\S\s+\S\s+)?(?P<id>[0-9A-Fa-f]{8})x?(?:\s*\[\d\]\s*|\#|\s+[RT]x\s+d\s+\d\s+|[\s,;]+)"
    r"(?P<data>(?:[0-9A-Fa-f]{2} ?){1,8})\s*(?:[RT]|'.*')?\s*$"
)
_SIGNAL_K = re.compile(r"^\d{13};[^;]*;")  # Prefix of a line recorded by Signal K

_LINES = (
    re.compile(r"^\d{4}-\d\d-\d\d[T-][\d:.]+Z?,\d,\d+,\d+,\d+,\d+,[0-9A-Fa-f]{2},"),
    re.compile(r"^\s*(?:<0x[0-9A-Fa-f]+>|[a-z]+\d?\s+[0-9A-Fa-f]{8})\s+\[\d\]"),
    re.compile(r"^A\d{6}\.\d+ [0-9A-Fa-f]{5} [0-9A-Fa-f]{5,6} "),
    re.compile(r"^\d\d:\d\d:\d\d\.\d+ [RT] [0-9A-Fa-f]{8} "),
    _FRAME,
)

# Least time stamp that counts from 1970, s (the year 1973); less counts from the beginning, or from line to line
_FIRST_EPOCH_S = 1e8

_SAME = 0.5
"""Share of the lines of a log that decides how it is written. Project choice."""

# Messages of the vessel: without protocol, proprietary ones, satellites and other ships (AIS)
_VESSELS = frozenset((*range(127001, 129038), *range(129551, 129793), *range(129811, 130816)))
_NOT_VALUES = re.compile(r"sid|instance|reserved|spare|source")  # Beginnings of fields that are no values (canboat)


def looks_like_nmea2000(head: bytes) -> bool:
    """Whether at least half the lines of the beginning of a file are messages of a known format."""
    return mostly(head, lambda line: any(form.match(_bare(line)) for form in _LINES))


def _bare(line: bytes) -> str:
    """A line without blanks and what Signal K puts before it."""
    return _SIGNAL_K.sub("", line.decode("latin-1").strip())


def read_nmea2000(path: Path) -> VesselLog:
    """Read a text log of NMEA 2000: headings, rates of turn, rudders, engines, speeds, positions and wind.

    Times are the recorder's, set to UTC by the system time (PGN 126992) where the log holds it; without a time
    stamp of the recorder they follow the system times before and after. Time stamps without a date and without a
    system time give a log without a date.

    Raises InputError: The file cannot be read, no message is understood, or there is no time.
    """
    reader = _Reader(path)
    for number, line in enumerate(text_lines(path)):
        if line.strip() and not line.startswith(b"#"):
            reader.take(number, _bare(line))
    return reader.log()


class _Key(NamedTuple):
    """A column: message, source, field, quantity, and instance of a rudder or an engine."""

    pgn: int
    source: int
    field: str
    quantity: str
    instance: str


class _Reader:
    """Reads line by line; the shift of the recorder's clock is known after the last."""

    def __init__(self, path: Path) -> None:
        self.path = path
        logging.getLogger("nmea2000").setLevel(logging.ERROR)
        self.decoder = optional_library("nmea2000", "logs", path).NMEA2000Decoder()
        self.counts: Counter[str] = Counter()
        self.unused: Counter[int] = Counter()
        self.columns: dict[_Key, Samples] = defaultdict(Samples)
        self.clocks: dict[int, Samples] = defaultdict(Samples)
        self.sums = Samples()
        self.variation = math.nan
        self.days, self.last_s = 0, 0.0

    def take(self, number: int, line: str) -> None:
        """Take a line; one that cannot be read is counted."""
        self.counts["lines"] += 1
        stamp = math.nan
        try:
            if frame := _FRAME.match(line):
                stamp = stamp_s(frame["stamp"])
                self._sum(stamp, number)
                line = f"(0.0) can0 {frame['id']}#{frame['data'].replace(' ', '')}"
            message = self.decoder.decode(line)
        except Exception:  # whatever the library raises, the line is not a message
            self.counts["corrupted"] += 1
            return
        if message is None:
            return
        if clock := _CLOCK.match(line):
            stamp = self._of_day(clock)
        elif not frame and _TIMED.match(line):
            stamp = message.timestamp.replace(tzinfo=dt.UTC).timestamp()
        self.counts["timed" if math.isfinite(stamp) else "untimed"] += 1
        self._keep(message.PGN, message.source, {entry.id: entry.value for entry in message.fields}, stamp, number)

    def _keep(self, pgn: int, source: int, values: dict[str, object], stamp: float, number: int) -> None:
        """Keep a system time or a variation, and the fields that are quantities, of an unused message all numbers."""
        if pgn == _SYSTEM_TIME:
            if isinstance(values.get("date"), dt.date):
                moment = dt.datetime.combine(values["date"], values["time"], tzinfo=dt.UTC)  # type: ignore[arg-type]
                self.clocks[source].add(moment.timestamp(), number, stamp)
            return
        if pgn == _VARIATION:
            self.variation = _number(values, "variation", self.variation)
        self.unused[pgn] += pgn not in _FIELDS
        instance = str(values["instance"]) if pgn in (_RUDDER, _ENGINE) and "instance" in values else ""
        names = filter(_is_value, values) if pgn in _VESSELS else ()
        for name in _FIELDS.get(pgn, names):
            if isinstance(value := values.get(name), int | float):
                key = _Key(pgn, source, name, _quantity(pgn, name, values), instance)
                self.columns[key].add(float(value), number, stamp)
                if key.quantity == "magnetic_heading":
                    variation = _number(values, "variation", 0.0) or self.variation
                    true = (value + _number(values, "deviation", 0.0) + variation) % (2 * math.pi)
                    if math.isfinite(true):
                        self.columns[_Key(pgn, source, _TRUE, "heading", "")].add(true, number, stamp)

    def _sum(self, stamp: float, number: int) -> None:
        """Count where time stamps fall, and add them up, for they may be differences (candump -t d)."""
        before, total = (self.sums.stamps[-1], self.sums.values[-1]) if self.sums.lines else (0.0, 0.0)
        self.counts["falls"] += stamp < before
        self.sums.add(total + stamp, number, stamp)

    def _of_day(self, clock: re.Match[str]) -> float:
        """Time of day, s, which goes on over midnight."""
        hours, minutes, seconds = (float(part) for part in clock.groups() if part is not None)
        time = 3600 * hours + 60 * minutes + seconds
        self.days += time < self.last_s - 43200
        self.last_s = time
        return 86400 * self.days + time

    def log(self) -> VesselLog:
        """The log after the last line."""
        ticks, findings = self._one_clock()
        if not any(key.quantity for key in self.columns):
            raise InputError(self.path, "", "no message of it is understood", "give a log of candump or of Actisense")
        timed = self.counts["timed"] > _SAME * (self.counts["timed"] + self.counts["untimed"])
        if not timed and len(ticks.values) < 2:
            remedy = "log with time stamps: candump -L"
            raise InputError(self.path, "", "has neither time stamps nor system times", remedy)
        clock, found = continued_clock(np.array(ticks.values), "system time")
        findings += found
        if timed:
            times, dated = self._recorded_times(ticks, clock, findings)
        else:
            between = [np.interp(column.lines, ticks.lines, clock) for column in self.columns.values()]
            times, dated = [steady_times(time) for time in between], True
        streams = [self._stream(key, time) for key, time in zip(self.columns, times, strict=True)]
        streams.sort(key=lambda stream: _TRUE in stream.name)
        return VesselLog(self.path, "NMEA 2000", tuple(streams), self._lost(findings), tuple(findings), dated)

    def _lost(self, findings: list[LogFinding]) -> dict[str, int]:
        """Number of lines, and of those that were lost or not used, which is said."""
        counts = {"lines": self.counts["lines"]}
        if spoilt := self.counts["corrupted"]:
            findings.append(note(f"{spoilt} of {self.counts['lines']} lines are corrupted and left out"))
            counts["corrupted"] = spoilt
        if unused := self.unused.total():
            counts["unused"] = unused
            kinds = {f"PGN {pgn}": number for pgn, number in self.unused.items() if pgn in _VESSELS and number}
            others = unused - sum(kinds.values())
            findings += not_used("messages", kinds | ({"of makers, satellites, other ships": others} if others else {}))
        return counts

    def _recorded_times(self, ticks: Samples, clock: Array, findings: list[LogFinding]) -> tuple[list[Array], bool]:
        """Times of all columns by their stamps, set by the system times (m,) if there are any; whether they are UTC."""
        columns = [*self.columns.values(), ticks]
        stamps = [np.array(column.stamps) for column in columns]
        dated = float(np.nanmedian(stamps[0])) > _FIRST_EPOCH_S
        if not dated and self.counts["falls"] > _OFTEN * self.counts["lines"]:
            stamps = [np.interp(column.lines, self.sums.lines, self.sums.values) for column in columns]
            findings.append(note("the time stamps count from line to line and are added up"))
        if not len(clock):
            return stamps[:-1], dated
        pace, found = _pace(stamps[-1], clock)
        findings += found
        shift = float(np.nanmedian(clock - pace * stamps[-1]))
        if dated and pace == 1.0:
            turned, rolled = rollover_s(shift)
            shift += turned
            findings += rolled or _recorder_off(shift)
        return [pace * stamp + shift for stamp in stamps[:-1]], True

    def _one_clock(self) -> tuple[Samples, list[LogFinding]]:
        """System times of the source with most (of several within a fifth, the middle one); findings on the others."""
        if not self.clocks:
            return Samples(), []
        most = max(len(column.values) for column in self.clocks.values())
        often = {source: column for source, column in self.clocks.items() if len(column.values) > 0.8 * most}
        ahead = {source: _ahead_s(column, often) for source, column in self.clocks.items()}
        chosen = min(often, key=lambda source: abs(ahead[source] - float(np.median([ahead[key] for key in often]))))
        findings = []
        for source, by in ahead.items():
            late = ahead[chosen] - by
            if abs(late) > _CLOCKS_APART_S:
                word = "behind" if late > 0 else "ahead of"
                text = f"the clock of source {source} is {abs(late):.2g} s {word} the clock of {chosen}, which is used"
                findings.append(note(text, behind_s=late))
        return self.clocks[chosen], findings

    def _stream(self, key: _Key, time: Array) -> LogStream:
        """A column under a name of its own; engines by their instance; a single one has no side."""
        alike = [other for other in self.columns if other._replace(source=key.source) == key]
        usual = ["rad" if key.field == _TRUE else "", key.quantity]
        unit, usual_quantity = _FIELDS.get(key.pgn, {}).get(key.field, usual)
        side, quantity = self._side(key)
        label = f"{key.pgn}.{key.field}" + (f" ({key.quantity})" if key.quantity != usual_quantity else "")
        label += (f" of {side}" if side else "") + (f" from {key.source}" if len(alike) > 1 else "")
        return LogStream(label, time, np.array(self.columns[key].values), unit, quantity, "format" if quantity else "")

    def _side(self, key: _Key) -> tuple[str, str]:
        """Side or number of one of several rudders or engines, and its quantity; empty, and its own, if it is alone."""
        instances = {other.instance for other in self.columns if (other.pgn, other.field) == (key.pgn, key.field)}
        if len(instances) < 2:
            return "", key.quantity
        # The port engine is the first (canboat, ENGINE_INSTANCE).
        order = sorted(instances, key=lambda other: ("Starboard" in other and "Port" not in other, other))
        place = order.index(key.instance)
        if key.pgn != _ENGINE:
            return str(place), key.quantity
        return [("port", "rpm_port"), ("starboard", "rpm_starboard")][place] if place < 2 else (str(place), "")


def _is_value(name: str) -> bool:
    """Whether a field is a value, and none of the message itself."""
    return not _NOT_VALUES.match(name)


def _number(values: dict[str, object], name: str, usual: float) -> float:
    """A field with a fraction; the usual value where it has none."""
    value = values.get(name)
    return value if isinstance(value, float) else usual


def _pace(stamps: Array, clock: Array) -> tuple[float, list[LogFinding]]:
    """Receiver's seconds to one of the recorder's, 1 where they agree, and a finding: replays run at another pace."""
    good = np.isfinite(stamps)
    if np.count_nonzero(good) < _PACE_FROM or np.ptp(stamps[good]) <= 0 or np.ptp(clock[good]) < _PACE_FROM_S:
        return 1.0, []
    pace = float(theilslopes(clock[good], stamps[good])[0])
    if abs(pace - 1) < _PACE_OFF or pace <= 0:
        return 1.0, []
    text = f"the clock of the satellites runs {pace:.3g} times as fast as the recorder's, and is used"
    return pace, [fault(text, pace=pace)]


def _recorder_off(ahead_s: float) -> list[LogFinding]:
    """A note on a recorder's clock that differs by more than the steps of the system time."""
    word = "behind" if ahead_s > 0 else "ahead of"
    text = f"the clock of the recorder is {abs(ahead_s):.3g} s {word} the satellites' clock, which is used"
    return [note(text, behind_s=ahead_s)] if abs(ahead_s) > _CLOCKS_APART_S else []


def _ahead_s(column: Samples, every: dict[int, Samples]) -> float:
    """Median of a clock less the time stamps; of lines without, less the mean clock of all sources at these lines."""
    clock, stamps = np.array(column.values), np.array(column.stamps)
    if np.isfinite(stamps).all():
        return float(np.median(clock - stamps))
    means = [np.interp(column.lines, other.lines, other.values) for other in every.values()]
    return float(np.median(clock - np.mean(means, axis=0)))


def _quantity(pgn: int, name: str, values: dict[str, object]) -> str:
    """Quantity of a field, whose meaning may depend on other fields of its message."""
    _, quantity = _FIELDS.get(pgn, {}).get(name, ("", ""))
    reference = str(values.get("reference", values.get("cogReference", "")))
    if pgn == 127250 and reference.startswith("Magnetic"):
        return "magnetic_heading"
    if pgn == 129026 and quantity == "cog" and reference.startswith("Magnetic"):
        return ""
    if pgn == 130306 and "Apparent" not in reference:
        true = "ground" in reference.lower() or "North" in reference
        return quantity.replace("wind_rel", "wind" if true else "wind_theoretical")
    return quantity
