"""NMEA 0183: sentences of navigation instruments, with or without time stamps of the recorder.

Fields are those of ``pynmea2``. A line without a time stamp gets its time from the sentences with a clock (RMC, ZDA)
before and after it: instruments send at a steady rate, so the time of the n-th sentence of a kind is averaged over its
neighbours, each n periods away.
"""

from __future__ import annotations

import datetime as dt
import re
from array import array
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import reduce
from operator import xor
from pathlib import Path

import numpy as np

from tank2sim.arrays import Array
from tank2sim.errors import InputError
from tank2sim.logs.clock import continued_clock
from tank2sim.logs.streams import LogFinding, LogStream, VesselLog, optional_library

_LINE = re.compile(rb"^(?P<stamp>.*?)(?P<body>[$!][^*$!]*)(?:\*(?P<sum>[0-9A-Fa-f]{2}))?\s*$")
_LINE_WITH_SUM = re.compile(rb"[$!][^*]*\*[0-9A-Fa-f]{2}\s*$")
_HEAD_BYTES = 65536
"""Bytes in which a log that has checksums shows one. Project choice: some thousand sentences."""

_TAG_TIME = re.compile(rb"\\(?:[^\\]*,)?c:(\d+)[,*]")
_EPOCH = re.compile(rb"(?<![\d.])(\d{10}(?:\.\d+)?|\d{13})(?![\d.])")
_ISO = re.compile(rb"(\d{4}-\d\d-\d\d[T ]\d\d:\d\d:\d\d(?:\.\d+)?)Z?")

_OVERLAP = 0.1
"""Share of sentences of a talker that may lie within the time of another before the two are two instruments. Project
choice: at a change of talker a few sentences overlap; two receivers overlap throughout."""

_STAMPS_AGREE_S = 5.0
"""Largest drift of a recorder's time stamps against the receiver's clock, s, with which they are used. Project choice:
delays of serial lines stay below a second or two."""

_BLOCK = 100_000
_NEIGHBOURS = 10
"""Sentences of a kind before and after one over which its time is averaged. Project choice: a few seconds at the usual
1 to 10 Hz, in which clocks do not drift and few sentences are lost."""


@dataclass
class _Series:
    """Values of one field of one talker, with the number of the line of each."""

    lines: array[int] = field(default_factory=lambda: array("q"))
    values: array[float] = field(default_factory=lambda: array("d"))


_FIELDS: dict[str, tuple[tuple[str, str, str, str], ...]] = {
    # sentence: (name of the stream, field of pynmea2, unit, quantity)
    "RMC": (("sog", "spd_over_grnd", "kn", "sog"), ("cog", "true_course", "deg", "cog")),
    "VTG": (("cog", "true_track", "deg", "cog"), ("sog", "spd_over_grnd_kts", "kn", "sog")),
    "HDT": (("heading", "heading", "deg", "heading"),),
    "HDG": (("heading", "heading", "deg", "magnetic_heading"),),
    "HDM": (("heading", "heading", "deg", "magnetic_heading"),),
    "ROT": (("rate", "rate_of_turn", "deg/min", "yaw_rate"),),
    "RSA": (
        ("starboard_rudder", "rsa_starboard", "deg", "rudder_angle"),
        ("port_rudder", "rsa_port", "deg", "port_rudder_angle"),
    ),
    "VBW": (
        ("longitudinal_water", "lon_water_spd", "kn", "u_water"),
        ("transverse_water", "trans_water_spd", "kn", "v_water"),
        ("longitudinal_ground", "lon_grnd_spd", "kn", "u_ground"),
        ("transverse_ground", "trans_grnd_spd", "kn", "v_ground"),
    ),
    "VHW": (("speed_water", "water_speed_knots", "kn", "u_water"),),
}
"""Fields with one number and a fixed unit: NMEA 0183, version 4.10, sentence by sentence."""

_CLOCKS = ("RMC", "ZDA")


def looks_like_nmea0183(head: bytes) -> bool:
    """Whether at least half the lines of the beginning of a file are sentences."""
    lines = [line for line in head.splitlines()[:-1] or head.splitlines() if line.strip()]
    return bool(lines) and 2 * sum(bool(re.search(rb"[$!][A-Z]{2,5}[A-Z0-9]*,", line)) for line in lines) > len(lines)


def read_nmea0183(path: Path) -> VesselLog:
    """Read the sentences RMC, GGA, VTG, HDT, THS, HDG, HDM, ROT, RSA, RPM, VBW, VHW, MWV of a log of NMEA 0183.

    Sentences with a wrong checksum, or without one in a log that has them, are left out and counted, as are those of
    other ships (AIS). Sentences that name no valid fix, rate, rudder or speed (status V) hold no value. A talker that
    takes over from another (GP, then GN) is
    the same instrument; talkers that send at the same time are two, and have streams of their own.

    Raises
    ------
    InputError
        There is no sentence with a clock (RMC or ZDA), or no sentence that is understood.
    """
    reader = _Reader(path)
    try:
        with path.open("rb") as file:
            reader.checked = any(_LINE_WITH_SUM.search(line) for line in file.read(_HEAD_BYTES).splitlines())
            file.seek(0)
            for number, line in enumerate(file):
                reader.take(number, line)
    except OSError as error:
        raise InputError(path, "", f"cannot be read ({error.strerror})", "check the name and its permissions") from None
    return reader.log()


class _Reader:
    """Reads line by line; the times are known after the last."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.checked = True
        self.counts: Counter[str] = Counter()
        self.kinds: Counter[str] = Counter()
        self.series: dict[tuple[str, str], dict[str, _Series]] = defaultdict(lambda: defaultdict(_Series))
        self.stated: dict[tuple[str, str], tuple[str, str]] = {}
        self.clock_lines = array("q")
        self.clock_times = array("d")
        self.clock_talkers: list[str] = []
        self.stamps = array("d")
        self.stamp_lines = array("q")
        types = optional_library("pynmea2", path).TalkerSentence.sentence_types
        self.place = {
            kind: {name[1]: index for index, name in enumerate(types[kind].fields)} for kind in (*_FIELDS, *_CLOCKS)
        }
        self.special: dict[str, Callable[[int, str, list[str]], None]] = {
            "RMC": self._rmc,
            "GGA": self._gga,
            "RPM": self._rpm,
            "MWV": self._mwv,
            "ZDA": self._zda,
            "THS": self._ths,
        }

    def take(self, number: int, raw: bytes) -> None:
        if not raw.strip():
            return
        self.counts["lines"] += 1
        match = _LINE.match(raw.rstrip())
        if match is None or not self._intact(match["body"], match["sum"]):
            self.counts["corrupted"] += 1
            return
        body = match["body"]
        if body[:1] == b"!" or body[1:2] == b"P":
            self.counts["ais" if body[:1] == b"!" else "proprietary"] += 1
            return
        cells = body[1:].decode("latin-1").split(",")
        talker, kind = cells[0][:-3], cells[0][-3:]
        self.kinds[kind] += 1
        if match["stamp"]:
            self._stamp(number, match["stamp"])
        try:
            if kind in self.special:
                self.special[kind](number, talker, cells[1:])
            if kind in _FIELDS:
                self._plain(number, talker, kind, cells[1:])
        except (ValueError, IndexError):
            self.counts["malformed"] += 1

    def _intact(self, body: bytes, total: bytes | None) -> bool:
        if total is None:
            return not self.checked
        return reduce(xor, body[1:], 0) == int(total, 16)

    def _add(self, number: int, talker: str, name: str, value: float, stated: tuple[str, str]) -> None:
        series = self.series[name.partition(".")[0], talker][name]
        series.lines.append(number)
        series.values.append(value)
        self.stated[name, ""] = stated

    def _plain(self, number: int, talker: str, kind: str, cells: list[str]) -> None:
        if _invalid(kind, cells):
            return
        for name, place, unit, quantity in _FIELDS[kind]:
            index = self.place[kind][place]
            status = {"RSA": index + 1, "VBW": 2 if index < 2 else 5}.get(kind)
            if status is not None and (len(cells) <= status or cells[status] != "A"):
                continue
            if index < len(cells) and cells[index]:
                self._add(number, talker, f"{kind}.{name}", float(cells[index]), (unit, quantity))

    def _rmc(self, number: int, talker: str, cells: list[str]) -> None:
        time, date = cells[self.place["RMC"]["timestamp"]], cells[self.place["RMC"]["datestamp"]]
        if time and date:
            day, month, year = int(date[:2]), int(date[2:4]), 2000 + int(date[4:6])
            self._tick(number, talker, dt.date(year, month, day), time)
        if cells[self.place["RMC"]["status"]] == "A":
            self._position(number, talker, "RMC", cells[self.place["RMC"]["lat"] :])

    def _zda(self, number: int, talker: str, cells: list[str]) -> None:
        if "RMC" not in self.kinds:
            self._tick(number, talker, dt.date(int(cells[3]), int(cells[2]), int(cells[1])), cells[0])

    def _tick(self, number: int, talker: str, date: dt.date, time: str) -> None:
        seconds = 3600 * int(time[:2]) + 60 * int(time[2:4]) + float(time[4:])
        self.clock_lines.append(number)
        self.clock_times.append(86400.0 * (date - dt.date(1970, 1, 1)).days + seconds)
        self.clock_talkers.append(talker)

    def _gga(self, number: int, talker: str, cells: list[str]) -> None:
        if cells[5] not in ("", "0"):
            self._position(number, talker, "GGA", cells[1:])

    def _position(self, number: int, talker: str, kind: str, cells: list[str]) -> None:
        if cells[0] and cells[2]:
            latitude = _degrees(cells[0], 2) * (-1 if cells[1] == "S" else 1)
            longitude = _degrees(cells[2], 3) * (-1 if cells[3] == "W" else 1)
            self._add(number, talker, f"{kind}.latitude", latitude, ("deg", "latitude"))
            self._add(number, talker, f"{kind}.longitude", longitude, ("deg", "longitude"))

    def _rpm(self, number: int, talker: str, cells: list[str]) -> None:
        if len(cells) > 4 and cells[4][:1] == "V":
            return
        shaft = int(cells[1] or 0)
        # Numbered from the centreline: 0 single or on it, odd starboard, even port (NMEA 0183, RPM).
        quantity = "rpm" if shaft == 0 else "rpm_starboard" if shaft % 2 else "rpm_port"
        self._add(number, talker, f"RPM.{cells[0]}{shaft}", float(cells[2]), ("rpm", quantity))

    def _ths(self, number: int, talker: str, cells: list[str]) -> None:
        if cells[0] and cells[1][:1] in ("A", "E"):  # by a compass, or estimated; not by hand, simulated, or not valid
            self._add(number, talker, "THS.heading", float(cells[0]), ("deg", "heading"))

    def _mwv(self, number: int, talker: str, cells: list[str]) -> None:
        if cells[4] != "A":
            return
        prefix, kind = ("wind_rel", "relative") if cells[1] == "R" else ("wind_theoretical", "theoretical")
        factor = {"N": 1852 / 3600, "K": 1 / 3.6, "M": 1.0}[cells[3]]
        self._add(number, talker, f"MWV.{kind}_angle", float(cells[0]), ("deg", f"{prefix}_direction"))
        self._add(number, talker, f"MWV.{kind}_speed", float(cells[2]) * factor, ("m/s", f"{prefix}_speed"))

    def _stamp(self, number: int, prefix: bytes) -> None:
        time = _time_of_prefix(prefix)
        if time is not None:
            self.stamp_lines.append(number)
            self.stamps.append(time)

    def log(self) -> VesselLog:
        findings: list[LogFinding] = []
        lines, times = self._clock(findings)
        streams: list[LogStream] = []
        self._single_shaft(findings)
        for (kind, _), group in self._instruments(findings):
            for name, series in group.items():
                unit, quantity = self.stated[name, ""]
                number = np.frombuffer(series.lines, dtype=np.int64)
                time = self._ticks(number) if kind in _CLOCKS else steady_times(_time_of_lines(number, lines, times))
                values = np.frombuffer(series.values, dtype=float)
                streams.append(LogStream(self._unique(name, streams), time, values, unit, quantity, "format"))
        if not streams:
            raise InputError(self.path, "", "no sentence of it is understood", "give a log with RMC, HDT, RSA, ...")
        counts = {"lines": self.counts["lines"], "corrupted": self.counts["corrupted"]}
        counts |= {key: self.counts[key] for key in ("malformed", "ais", "proprietary") if self.counts[key]}
        counts["dropped"] = sum(_lost(stream.time_s) for stream in streams if stream.name.startswith("HDT"))
        if not self.checked:
            findings.append(LogFinding("note", "no sentence has a checksum, so that none is tested for errors"))
        if spoilt := self.counts["corrupted"] + self.counts["malformed"]:
            text = f"{spoilt} of {self.counts['lines']} lines are corrupted (wrong checksum or cut) and left out"
            findings.append(LogFinding("note", text, evidence={"share": spoilt / self.counts["lines"]}))
        return VesselLog(self.path, "NMEA 0183", tuple(streams), counts, tuple(findings))

    def _single_shaft(self, findings: list[LogFinding]) -> None:
        """Take the one number that shafts and engines have for the only shaft, for many recorders call it 1."""
        sources = sorted(name for name, _ in self.stated if name.startswith("RPM."))
        numbers = {name[len("RPM.S") :] for name in sources}
        if len(numbers) != 1 or numbers == {"0"}:
            return
        shaft = max(sources)  # that of the shaft (S), if that of the engine (E) is there, too
        for name in sources:
            self.stated[name, ""] = ("rpm", "rpm" if name == shaft else "")
        side = "starboard" if int(*numbers) % 2 else "port"
        text = f"{shaft} is the only shaft and is taken for that of a single propeller, not of a {side} one"
        findings.append(LogFinding("note", text, shaft))

    def _ticks(self, number: np.ndarray) -> Array:
        """Times of sentences that carry them, with falls of the clock taken out."""
        lines, times = np.frombuffer(self.clock_lines, dtype=np.int64), np.frombuffer(self.clock_times, dtype=float)
        times, _ = continued_clock(times, "RMC")
        known = np.isin(number, lines)
        return np.where(known, times[np.clip(np.searchsorted(lines, number), 0, len(lines) - 1)], np.nan)

    @staticmethod
    def _unique(name: str, streams: list[LogStream]) -> str:
        same = sum(stream.name.split(" #")[0] == name for stream in streams)
        return name if not same else f"{name} #{same + 1}"

    def _clock(self, findings: list[LogFinding]) -> tuple[np.ndarray, Array]:
        if len(self.clock_lines) < 2:
            problem = f"has {len(self.clock_lines)} sentences with date and time (RMC or ZDA)"
            raise InputError(self.path, "", problem, "log RMC, or give a log with more than one of them")
        lines = np.frombuffer(self.clock_lines, dtype=np.int64)
        times = np.frombuffer(self.clock_times, dtype=float)
        talkers = np.array(self.clock_talkers)
        if len(set(self.clock_talkers)) > 1 and _overlapping(lines, talkers):
            first = Counter(self.clock_talkers).most_common(1)[0][0]
            lines, times = lines[talkers == first], times[talkers == first]
        times, found = continued_clock(times, "RMC")
        findings += found
        if len(self.stamps) > 0.9 * (self.counts["lines"] - self.counts["corrupted"]):
            stamp_lines, stamps = (
                np.frombuffer(self.stamp_lines, dtype=np.int64),
                np.frombuffer(self.stamps, dtype=float),
            )
            stamps, found = continued_clock(stamps, "the recorder's time stamps")
            findings += found
            shift = times - np.interp(lines, stamp_lines, stamps)
            if np.ptp(shift) < _STAMPS_AGREE_S:
                return stamp_lines, stamps + float(np.median(shift))
            text = f"the recorder's time stamps drift by {np.ptp(shift):.3g} s against the clock of RMC, which is taken"
            findings.append(LogFinding("note", text))
        rises = np.concatenate([[True], np.diff(times) > 0])
        return lines[rises], times[rises]

    def _instruments(self, findings: list[LogFinding]) -> Iterator[tuple[tuple[str, str], dict[str, _Series]]]:
        """Each sentence kind of each instrument; talkers that follow each other are one."""
        kinds = dict.fromkeys(kind for kind, _ in self.series)
        for kind in kinds:
            talkers = [talker for other, talker in self.series if other == kind]
            if len(talkers) == 1:
                yield (kind, talkers[0]), self.series[kind, talkers[0]]
                continue
            groups: list[list[str]] = []
            for talker in talkers:
                home = next((group for group in groups if not self._together(kind, [*group, talker])), None)
                if home is None:
                    groups.append([talker])
                else:
                    home.append(talker)
            if len(groups) > 1:
                names = ", ".join("/".join(group) for group in groups)
                text = f"{kind} comes from {len(groups)} instruments at the same time: {names}"
                findings.append(LogFinding("note", text, kind))
            for group in groups:
                yield (kind, group[0]), _merged([self.series[kind, talker] for talker in group])

    def _together(self, kind: str, talkers: list[str]) -> bool:
        """Whether the sentences of these talkers lie between each other."""
        lines = [np.unique(np.concatenate([part.lines for part in self.series[kind, t].values()])) for t in talkers]
        labels = np.concatenate([np.full(len(part), talker) for part, talker in zip(lines, talkers, strict=True)])
        return _overlapping(np.concatenate(lines), labels)


def _merged(groups: list[dict[str, _Series]]) -> dict[str, _Series]:
    merged: dict[str, _Series] = {}
    for name in dict.fromkeys(name for group in groups for name in group):
        parts = [group[name] for group in groups if name in group]
        lines = np.concatenate([np.frombuffer(part.lines, dtype=np.int64) for part in parts])
        values = np.concatenate([np.frombuffer(part.values, dtype=float) for part in parts])
        order = np.argsort(lines, kind="stable")
        merged[name] = _Series(array("q", lines[order].tolist()), array("d", values[order].tolist()))
    return merged


def _overlapping(lines: Array | np.ndarray, talkers: np.ndarray) -> bool:
    """Whether sentences of several talkers lie between each other, and not one talker's after the other's."""
    order = np.argsort(lines, kind="stable")
    return bool((talkers[order][1:] != talkers[order][:-1]).mean() > _OVERLAP)


def _invalid(kind: str, cells: list[str]) -> bool:
    return kind in ("RMC", "ROT") and cells[1] != "A"


def _degrees(text: str, digits: int) -> float:
    """Degrees of ``dddmm.mmm``."""
    return int(text[:digits]) + float(text[digits:]) / 60


def _time_of_lines(number: np.ndarray, lines: np.ndarray, times: Array) -> Array:
    """Times (n,) of lines by the clocks before and after, and by the usual pace of lines before the first and last."""
    pace = float(np.median(np.diff(times) / np.diff(lines)))
    before, after = np.minimum(number - lines[0], 0), np.maximum(number - lines[-1], 0)
    return np.asarray(np.interp(number, lines, times) + pace * (before + after))


def steady_times(time: Array) -> Array:
    """Times (n,) of sentences that are sent at a steady rate, from times with the jitter of the order of lines."""
    if len(time) < 2 * _NEIGHBOURS + 1:
        return time
    period = float(np.median((time[_NEIGHBOURS:] - time[:-_NEIGHBOURS]) / _NEIGHBOURS))
    reach = np.arange(-_NEIGHBOURS, _NEIGHBOURS + 1)
    padded = np.pad(time, _NEIGHBOURS, mode="reflect", reflect_type="odd")
    windows = np.lib.stride_tricks.sliding_window_view(padded, len(reach))
    blocks = range(0, len(time), _BLOCK)  # a day of sentences at once would take gigabytes
    smooth = np.concatenate([np.median(windows[k : k + _BLOCK] - period * reach, axis=1) for k in blocks])
    # Where the clock leaps (a pause of the recorder), neighbours beyond the leap do not count.
    return np.where(np.abs(smooth - time) < 2 * period, smooth, time)


def _lost(time: Array) -> int:
    """Sentences missing of a series, by its usual period."""
    steps = np.diff(time)
    if not len(steps):
        return 0
    period = np.median(steps)
    return int(np.sum(np.maximum(np.round(steps / period) - 1, 0))) if period > 0 else 0


def _time_of_prefix(prefix: bytes) -> float | None:
    if match := _TAG_TIME.search(prefix) or _EPOCH.search(prefix):
        value = float(match[1])
        return value / 1000 if value > 1e11 else value
    if match := _ISO.search(prefix):
        moment = dt.datetime.fromisoformat(match[1].decode().replace(" ", "T"))
        return moment.replace(tzinfo=dt.UTC).timestamp()
    return None
