"""NMEA 0183: sentences of navigation instruments, with or without time stamps of the recorder.

A line without a time stamp gets its time from the sentences with a clock (RMC, ZDA)
before and after it: instruments send at a steady rate, so the time of the n-th sentence of a kind is averaged over its
neighbours, each n periods away.
"""

from __future__ import annotations

import contextlib
import datetime as dt
import math
import re
from array import array
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import reduce
from operator import xor
from pathlib import Path

import numpy as np

from tank2sim.apps.logs.clock import continued_clock, full_year, rollover_s
from tank2sim.apps.logs.quantities import QUANTITIES, quantity_of_name
from tank2sim.apps.logs.streams import LogFinding, LogStream, VesselLog, mostly, not_used, optional_library, text_lines
from tank2sim.arrays import Array
from tank2sim.errors import InputError
from tank2sim.units import KNOT_MPS

_SENTENCE = re.compile(rb"(?P<body>[$!][^*$!\r\n]*)(?:\*(?P<sum>[0-9A-Fa-f]{2}))?")
_SUMMED = re.compile(rb"[$!]([A-Z0-9]{3,})[^*$!\r\n]*\*[0-9A-Fa-f]{2}")
_NUMBER = re.compile(r"[+-]?\d+(\.\d*)?")
_TAG_TIME = re.compile(rb"\\(?:[^\\]*,)?c:(\d+)[,*]")
_EPOCH = re.compile(rb"(?<![\d.])(\d{10}(?:\.\d+)?|\d{13})(?![\d.])")
_ISO = re.compile(rb"(\d{4}-\d\d-\d\d[T ]\d\d:\d\d:\d\d(?:\.\d+)?)Z?")

_FEW = 10
"""Sentences of a kind from which on all of them have no checksum, or a wrong one, by their sender and not by a fault of
the line. Project choice."""

_MOST = 0.5
"""Share of the sentences of a kind that are spoilt, or hold no value, from which that is said of the kind. Project
choice."""

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
    """Values of one field of one talker, or times of a clock, with the number of the sentence of each."""

    lines: array[int] = field(default_factory=lambda: array("q"))
    values: array[float] = field(default_factory=lambda: array("d"))
    talkers: list[str] = field(default_factory=list)

    def add(self, number: int, value: float) -> None:
        self.lines.append(number)
        self.values.append(value)

    def arrays(self) -> tuple[np.ndarray, Array]:
        """Numbers and values (n,)."""
        return np.frombuffer(self.lines, dtype=np.int64), np.frombuffer(self.values, dtype=float)


_FIELDS: dict[str, tuple[tuple[str, int, str, str], ...]] = {
    # sentence: (name of the stream, cell, unit, quantity)
    "RMC": (("sog", 6, "kn", "sog"), ("cog", 7, "deg", "cog")),
    "VTG": (("cog", 0, "deg", "cog"), ("sog", 4, "kn", "sog")),
    "HDT": (("heading", 0, "deg", "heading"),),
    "HDG": (("heading", 0, "deg", "magnetic_heading"),),
    "HDM": (("heading", 0, "deg", "magnetic_heading"),),
    "ROT": (("rate", 0, "deg/min", "yaw_rate"),),
    "RSA": (("starboard_rudder", 0, "deg", "rudder_angle"), ("port_rudder", 2, "deg", "port_rudder_angle")),
    "ROR": (("starboard_order", 0, "deg", "rudder_order"), ("port_order", 2, "deg", "")),
    "VBW": (
        ("longitudinal_water", 0, "kn", "u_water"),
        ("transverse_water", 1, "kn", "v_water"),
        ("longitudinal_ground", 3, "kn", "u_ground"),
        ("transverse_ground", 4, "kn", "v_ground"),
    ),
    "VHW": (("speed_water", 4, "kn", "u_water"), ("heading", 0, "deg", "heading")),
}
"""Fields with one number and a fixed unit: NMEA 0183, version 4.10, sentence by sentence."""

_LAST = ("HDG.true_heading", "HDM.true_heading", "VHW.heading")
"""Headings that repeat another instrument's, or rest on a compass: a gyro's goes first."""

_KMH = {("VTG", 4): 6, ("VHW", 4): 6}
"""Cells of a speed in km/h that some instruments fill in place of the one in knots."""

_STATUS = {"RMC": 1, "ROT": 1, "GLL": 5, "MWV": 4}
"""Cells of the status of a sentence, A where it is valid."""

_MODE = {"RMC": 11, "VTG": 8, "GLL": 6, "GNS": 5}
"""Cells of the mode of the receiver, N where it has no fix (NMEA 0183, 2.3)."""

_PLACES = {"RMC": (2, 0), "GGA": (1, 0), "GLL": (0, 4), "GNS": (1, 0)}
"""Cells of the latitude and of the time of day of sentences with a position."""

_TIME_OF_DAY = "time of day of "
"""Beginning of the name of a clock without a date, before the kind of its sentences."""

_SATELLITES = ("GSV", "GSA", "GRS", "GBS", "GST", "ALM", "DTM", "TXT")
"""Kinds that say nothing of the vessel."""

_XDR_UNITS = {"D": "deg", "R": "rpm", "P": "%", "M": "m"}
_WIND_UNITS = {"N": KNOT_MPS, "K": 1 / 3.6, "M": 1.0, "S": 0.44704}
"""m/s of the units of MWV; S are statute miles per hour (NIST SP 811)."""


def looks_like_nmea0183(head: bytes) -> bool:
    """Whether at least half the lines of the beginning of a file are sentences."""
    return mostly(head, re.compile(rb"[$!][A-Z]{2,5}[A-Z0-9]*,").search)


def read_nmea0183(path: Path) -> VesselLog:
    """Read the sentences RMC, GGA, GLL, GNS, VTG, HDT, THS, HDG, HDM, ROT, RSA, ROR, RPM, VBW, VHW, MWV, XDR.

    Numbers of other kinds, satellites excepted, are streams without a quantity. Sentences with a wrong checksum, or
    without one where others of their kind have it, are left out and counted, as are those of other ships (AIS).
    Sentences that name no valid fix, rate, rudder or speed (status V, mode N) hold no value. A talker that takes over
    from another (GP, then GN) is the same instrument; talkers that send at the same time are two, and have streams of
    their own. Times of day alone give a log without a date.

    Raises
    ------
    InputError
        There is no clock (RMC, ZDA, times of day, stamps of the recorder), or no sentence that is understood.
    """
    reader = _Reader(path)
    reader.summed = {label for line in text_lines(path) for label in _SUMMED.findall(line)}
    for line in text_lines(path):
        reader.take(line)
    return reader.log()


class _Reader:
    """Reads line by line; the times are known after the last."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.known = set(optional_library("pynmea2", path).TalkerSentence.sentence_types)
        self.summed: set[bytes] = set()
        self.number = self.added = 0
        self.counts: Counter[str] = Counter()
        self.kinds: Counter[str] = Counter()
        self.wrong: Counter[str] = Counter()
        self.malformed: Counter[str] = Counter()
        self.void: Counter[str] = Counter()
        self.unsummed: dict[bytes, list[tuple[int, bytes, bytes]]] = defaultdict(list)
        self.series: dict[tuple[str, str], dict[str, _Series]] = defaultdict(lambda: defaultdict(_Series))
        self.stated: dict[str, tuple[str, str, str]] = {}
        self.variation = math.nan
        self.clocks: dict[str, _Series] = defaultdict(_Series)
        self.stamps = _Series()
        self.special: dict[str, Callable[[str, str, list[str]], None]] = {
            "RMC": self._rmc,
            "GGA": self._position,
            "GLL": self._position,
            "GNS": self._position,
            "HDG": self._magnetic,
            "HDM": self._magnetic,
            "RPM": self._rpm,
            "MWV": self._mwv,
            "XDR": self._xdr,
            "ZDA": self._zda,
            "THS": self._ths,
        }

    def take(self, raw: bytes) -> None:
        """Take a line; it may hold several sentences, and a time stamp next to them."""
        if not raw.strip() or raw.startswith(b"#"):
            return
        self.counts["lines"] += 1
        self.number += 1
        found = list(_SENTENCE.finditer(raw))
        self.counts["corrupted"] += not found
        for place, match in enumerate(found):
            self.number += place > 0
            prefix = raw[: found[0].start()] or raw[found[-1].end() :]
            self._sentence(match["body"].rstrip(), match["sum"], prefix)

    def _sentence(self, body: bytes, total: bytes | None, prefix: bytes) -> None:
        label = body[1:].partition(b",")[0]
        if total is None and self.summed and label not in self.summed:
            self.unsummed[label].append((self.number, body, prefix))
        elif (total is None and self.summed) or (total and reduce(xor, body[1:], 0) != int(total, 16)):
            self.counts["corrupted"] += 1
            self.wrong[_kind(label)] += total is not None
        else:
            self._read(self.number, body, prefix)

    def _read(self, number: int, body: bytes, prefix: bytes) -> None:
        """Read an intact sentence; one that cannot be read is counted, and ends nothing."""
        if (time := _time_of_prefix(prefix)) is not None:
            self.stamps.add(number, time)
        if body[:1] == b"!":
            self.counts["ais"] += 1
            return
        label, *cells = body[1:].decode("latin-1").split(",")
        kind, talker = _kind(label.encode("latin-1")), "" if label[:1] == "P" else label[:-3]
        self.counts["proprietary"] += label[:1] == "P"
        self.kinds[kind] += 1
        before, self.line = self.added, number
        try:
            if kind in self.special:
                self.special[kind](talker, kind, cells)
            if kind in _FIELDS and self._valid(kind, cells):
                self._plain(talker, kind, cells)
            elif kind not in self.special and kind not in _FIELDS and kind not in _SATELLITES:
                self._unknown(talker, kind, cells)
        except (LookupError, ValueError, ArithmeticError):
            self.malformed[kind] += 1
        else:
            self.void[kind] += before == self.added and kind != "ZDA"

    def _add(self, talker: str, name: str, value: float, unit: str, quantity: str, by: str = "format") -> None:
        self.added += 1
        self.series[name.partition(".")[0], talker][name].add(self.line, value)
        self.stated[name] = unit, quantity, by

    @staticmethod
    def _valid(kind: str, cells: list[str]) -> bool:
        """Whether status and mode say that a sentence holds values."""
        mode = "".join(cells[_MODE[kind] : _MODE[kind] + 1]) if kind in _MODE else ""
        return (kind not in _STATUS or cells[_STATUS[kind]] == "A") and (
            not mode.strip() or mode.strip().strip("N") != ""
        )

    def _plain(self, talker: str, kind: str, cells: list[str]) -> None:
        for name, place, unit, quantity in _FIELDS[kind]:
            status = {"RSA": place + 1, "ROR": place + 1, "VBW": 2 if place < 2 else 5}.get(kind)
            if status is not None and (len(cells) <= status or cells[status] != "A"):
                continue
            other = _KMH.get((kind, place), place)
            if place < len(cells) and cells[place]:
                self._add(talker, f"{kind}.{name}", float(cells[place]), unit, quantity)
            elif other < len(cells) and cells[other]:
                self._add(talker, f"{kind}.{name}", float(cells[other]) / 3.6 / KNOT_MPS, unit, quantity)

    def _unknown(self, talker: str, kind: str, cells: list[str]) -> None:
        """Keep the numbers of a kind that is not understood: they may be named, or found by content."""
        for place, cell in enumerate(cells, start=1):
            if _NUMBER.fullmatch(cell):
                self._add(talker, f"{kind}.{place}", float(cell), "", "", "")

    def _rmc(self, talker: str, kind: str, cells: list[str]) -> None:
        time, date = cells[0], cells[8]
        if time and date:
            day, month, year = int(date[:2]), int(date[2:4]), full_year(int(date[4:6]))
            self._tick("RMC" if cells[1] == "A" else "RMC without a fix", talker, dt.date(year, month, day), time)
        self._position(talker, kind, cells)
        if len(cells) > 10 and cells[9]:
            self.variation = _signed(cells[9], cells[10])

    def _zda(self, talker: str, kind: str, cells: list[str]) -> None:
        self._tick(kind, talker, dt.date(int(cells[3]), int(cells[2]), int(cells[1])), cells[0])

    def _tick(self, kind: str, talker: str, date: dt.date, time: str) -> None:
        hours, minutes, rest = int(time[:2]), int(time[2:4]), float(time[4:])
        if not (0 <= hours < 24 and 0 <= minutes < 60 and 0 <= rest < 61):
            raise ValueError(time)
        seconds = 3600 * hours + 60 * minutes + rest
        self.clocks[kind].add(self.line, 86400.0 * (date - dt.date(1970, 1, 1)).days + seconds)
        self.clocks[kind].talkers.append(talker)

    def _position(self, talker: str, kind: str, cells: list[str]) -> None:
        place, time = _PLACES[kind]
        if len(cells) > time and cells[time]:
            self._tick(f"{_TIME_OF_DAY}{kind}", talker, dt.date(1970, 1, 1), cells[time])
        if not self._valid(kind, cells) or (kind == "GGA" and cells[5] in ("", "0")):
            return
        if cells[place] and cells[place + 2]:
            latitude = _degrees(cells[place], 90) * {"N": 1, "S": -1}[cells[place + 1].upper()]
            longitude = _degrees(cells[place + 2], 180) * {"E": 1, "W": -1}[cells[place + 3].upper()]
            self._add(talker, f"{kind}.latitude", latitude, "deg", "latitude")
            self._add(talker, f"{kind}.longitude", longitude, "deg", "longitude")

    def _magnetic(self, talker: str, kind: str, cells: list[str]) -> None:
        """True heading of a compass: the reading, its deviation, and the variation by itself or by RMC, + east."""
        variation, deviation = self.variation, 0.0
        if kind == "HDG":
            deviation = _signed(cells[1], cells[2]) if cells[1] else 0.0
            variation = _signed(cells[3], cells[4]) if cells[3] else variation
            self.variation = variation
        if cells[0] and math.isfinite(variation):
            true = (float(cells[0]) + deviation + variation) % 360
            self._add(talker, f"{kind}.true_heading", true, "deg", "heading")

    def _rpm(self, talker: str, kind: str, cells: list[str]) -> None:
        if len(cells) > 4 and cells[4][:1] == "V":
            return
        shaft = int(cells[1] or 0)
        # Numbered from the centreline: 0 single or on it, odd starboard, even port (NMEA 0183, RPM).
        quantity = "rpm" if shaft == 0 else "rpm_starboard" if shaft % 2 else "rpm_port"
        self._add(talker, f"RPM.{cells[0]}{shaft}", float(cells[2]), "rpm", quantity)

    def _ths(self, talker: str, kind: str, cells: list[str]) -> None:
        if cells[0] and cells[1][:1] in ("A", "E"):  # by a compass, or estimated; not by hand, simulated, or not valid
            self._add(talker, "THS.heading", float(cells[0]), "deg", "heading")

    def _mwv(self, talker: str, kind: str, cells: list[str]) -> None:
        if not self._valid(kind, cells):
            return
        prefix, words = ("wind_rel", "relative") if cells[1] == "R" else ("wind_theoretical", "theoretical")
        angle, speed = float(cells[0]), float(cells[2]) * _WIND_UNITS[cells[3]]
        self._add(talker, f"MWV.{words}_angle", angle, "deg", f"{prefix}_direction")
        self._add(talker, f"MWV.{words}_speed", speed, "m/s", f"{prefix}_speed")

    def _xdr(self, talker: str, kind: str, cells: list[str]) -> None:
        """Transducers, four cells each: type, value, unit, name."""
        for place, (_, value, letter, name) in enumerate(zip(*[iter(cells)] * 4, strict=False), start=1):
            if value:
                unit, quantity = _XDR_UNITS.get(letter, letter), quantity_of_name(name)
                quantity = quantity if quantity and unit in QUANTITIES[quantity].units else ""
                self._add(talker, f"XDR.{name or place}", float(value), unit, quantity, "name" if quantity else "")

    def log(self) -> VesselLog:
        """The log after the last line."""
        findings: list[LogFinding] = []
        self._take_unsummed(findings)
        lines, times, clock, ticks = self._clock(findings)
        streams: list[LogStream] = []
        self._single_shaft(findings)
        for (kind, _), group in self._instruments(findings):
            for name, series in group.items():
                unit, quantity, by = self.stated[name]
                number, values = series.arrays()
                time = steady_times(_time_of_lines(number, lines, times))
                if clock.endswith(kind):  # it carries its own times
                    time = np.array([ticks.get(each, at) for each, at in zip(number.tolist(), time, strict=True)])
                streams.append(LogStream(self._unique(name, streams), time, values, unit, quantity, by))
        if not any(stream.quantity for stream in streams):
            raise InputError(self.path, "", "no sentence of it is understood", "give a log with RMC, HDT, RSA, ...")
        streams.sort(key=lambda stream: stream.name.startswith(_LAST))
        counts = {"lines": self.counts["lines"], "corrupted": self.counts["corrupted"]}
        self.counts["malformed"] = self.malformed.total()
        counts |= {key: self.counts[key] for key in ("malformed", "ais", "proprietary") if self.counts[key]}
        counts["dropped"] = sum(_lost(stream.time_s) for stream in streams if stream.name.startswith("HDT"))
        self._say_unread(counts, findings)
        dated = not clock.startswith(_TIME_OF_DAY)
        return VesselLog(self.path, "NMEA 0183", tuple(streams), counts, tuple(findings), dated)

    def _take_unsummed(self, findings: list[LogFinding]) -> None:
        """Read the sentences of kinds that never have a checksum, though others do; a few of a kind are cut ones."""
        for label, sentences in self.unsummed.items():
            if len(sentences) < _FEW:
                self.counts["corrupted"] += len(sentences)
                continue
            for sentence in sentences:
                self._read(*sentence)
            name = label.decode("latin-1")
            text = f"{name} has no checksum, so that its {len(sentences)} sentences are not tested for errors"
            findings.append(LogFinding("note", text, name))
        if not self.summed:
            findings.append(LogFinding("note", "no sentence has a checksum, so that none is tested for errors"))

    def _say_unread(self, counts: dict[str, int], findings: list[LogFinding]) -> None:
        """Say what is spoilt, holds no value, is not used, or is not known; each kind with its number."""
        read = {*_FIELDS, *self.special}
        if spoilt := self.counts["corrupted"]:
            text = f"{spoilt} of {self.counts['lines']} lines are corrupted (wrong checksum or cut) and left out"
            findings.append(LogFinding("note", text, evidence={"share": spoilt / self.counts["lines"]}))
        if self.malformed:
            listed = _listed(self.malformed)
            findings.append(LogFinding("note", f"sentences with a cell that cannot be read are left out: {listed}"))
        for kind, number in self.wrong.items():
            total = number + self.kinds[kind]
            if number >= _FEW and number > _MOST * total:
                text = f"{number} of {total} {kind} have a wrong checksum and are left out"
                findings.append(LogFinding("fault" if kind in read else "note", text, kind))
        for kind, number in self.void.items():
            if kind in read and number >= _FEW and number > _MOST * self.kinds[kind]:
                text = f"{number} of {self.kinds[kind]} {kind} hold no valid value (status V, mode N, or empty)"
                findings.append(LogFinding("note", text, kind))
        for key, words, which in (
            ("unused", "sentences", self.known - read),
            (
                "unknown",
                "sentences (unknown; channels.toml may name their numbers)",
                self.kinds.keys() - self.known - read,
            ),
        ):
            kinds = {kind: self.kinds[kind] for kind in which if self.kinds[kind]}
            findings += not_used(words, kinds)
            counts |= {key: sum(kinds.values())} if kinds else {}

    def _clock(self, findings: list[LogFinding]) -> tuple[np.ndarray, Array, str, dict[int, float]]:
        """Sentences and times of the best clock, its name, and the times of all its sentences."""
        order = np.argsort(self.stamps.arrays()[0], kind="stable")
        stamp_lines, stamps = (part[order] for part in self.stamps.arrays())
        stamped = len(stamps) > 0.9 * (sum(self.kinds.values()) + self.counts["ais"])
        name = self._best_clock()
        if len(self.clocks[name].lines) < 2 or (stamped and name.startswith(_TIME_OF_DAY)):
            if not stamped or len(stamps) < 2:
                raise self._without_clock()
            stamps, found = continued_clock(stamps, "the recorder's time stamps")
            findings += found
            return stamp_lines, stamps, "", {}
        lines, times = self.clocks[name].arrays()
        if name.startswith(_TIME_OF_DAY):
            times = times + 86400 * np.cumsum(np.diff(times, prepend=times[:1]) < -43200)
            findings.append(LogFinding("note", "no sentence has a date (RMC, ZDA): the trials have no date"))
        talkers = np.array(self.clocks[name].talkers)
        if len(set(talkers)) > 1 and _overlapping(lines, talkers):
            first = Counter(talkers.tolist()).most_common(1)[0][0]
            lines, times = lines[talkers == first], times[talkers == first]
        times, found = continued_clock(times, name)
        findings += found
        if stamped:
            ahead = float(np.median(times - np.interp(lines, stamp_lines, stamps)))
            shift, found = rollover_s(ahead)
            findings += found
            times = times + shift
        ticks = dict(zip(lines.tolist(), times.tolist(), strict=True))
        if stamped:
            stamps, found = continued_clock(stamps, "the recorder's time stamps")
            findings += found
            late = times - np.interp(lines, stamp_lines, stamps)
            if np.ptp(late) < _STAMPS_AGREE_S:
                return stamp_lines, stamps + float(np.median(late)), name, ticks
            text = (
                f"the recorder's time stamps drift by {np.ptp(late):.3g} s against the clock of {name}, which is taken"
            )
            findings.append(LogFinding("note", text))
        rises = np.concatenate([[True], np.diff(times) > 0])
        return lines[rises], times[rises], name, ticks

    def _best_clock(self) -> str:
        """RMC, or ZDA if it is more frequent by far, or else the commonest times of day."""
        size = Counter({name: len(clock.lines) for name, clock in self.clocks.items()})
        rmc = "RMC" if size["RMC"] > 1 else "RMC without a fix"
        best = rmc if 2 * size[rmc] >= size["ZDA"] else "ZDA"
        undated = [name for name in size if name.startswith(_TIME_OF_DAY)]
        return best if size[best] > 1 or not undated else max(undated, key=lambda name: size[name])

    def _without_clock(self) -> InputError:
        number = sum(len(self.clocks[name].lines) for name in ("RMC", "RMC without a fix", "ZDA"))
        problem = f"has {number} sentences with date and time (RMC or ZDA)"
        if wrong := sum(self.wrong.values()):
            total = wrong + sum(self.kinds.values())
            problem += f": {wrong} of {total} have a wrong checksum, of them {self.wrong['RMC']} RMC"
            return InputError(
                self.path, "", problem, "the file was changed or its recorder is faulty: give the file as recorded"
            )
        return InputError(self.path, "", problem, "log RMC, or give a log with more than one of them")

    def _single_shaft(self, findings: list[LogFinding]) -> None:
        """Take the one number that shafts and engines have for the only shaft, for many recorders call it 1."""
        sources = sorted(name for name in self.stated if name.startswith("RPM."))
        numbers = {name[len("RPM.S") :] for name in sources}
        if len(numbers) != 1 or numbers == {"0"}:
            return
        shaft = max(sources)  # that of the shaft (S), if that of the engine (E) is there, too
        for name in sources:
            self.stated[name] = ("rpm", "rpm" if name == shaft else "", "format")
        side = "starboard" if int(*numbers) % 2 else "port"
        text = f"{shaft} is the only shaft: it counts as a single propeller, not as a {side} one"
        findings.append(LogFinding("note", text, shaft))

    @staticmethod
    def _unique(name: str, streams: list[LogStream]) -> str:
        same = sum(stream.name.split(" #")[0] == name for stream in streams)
        return name if not same else f"{name} #{same + 1}"

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


def _listed(kinds: Mapping[str, int]) -> str:
    return ", ".join(f"{number} {kind}" for kind, number in kinds.items())


def _kind(label: bytes) -> str:
    """The three letters of a sentence, or all of a proprietary one."""
    return (label if label.startswith(b"P") else label[-3:]).decode("latin-1")


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


def _degrees(text: str, most: int) -> float:
    """Degrees of ``dddmm.mmm``: the minutes begin two digits before the point, leading zeros or not."""
    whole = text.partition(".")[0]
    degrees, minutes = int(whole[:-2] or 0), float(text[max(len(whole) - 2, 0) :])
    if not whole.isdigit() or minutes >= 60 or degrees + minutes / 60 > most:
        raise ValueError(text)
    return degrees + minutes / 60


def _signed(text: str, letter: str) -> float:
    """Degrees of a deviation or variation, + east."""
    return float(text) * {"E": 1, "W": -1}[letter.strip().upper()]


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
        with contextlib.suppress(ValueError):  # a month 13
            moment = dt.datetime.fromisoformat(match[1].decode().replace(" ", "T"))
            return moment.replace(tzinfo=dt.UTC).timestamp()
    return None
