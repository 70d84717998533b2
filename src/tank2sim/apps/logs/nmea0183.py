"""NMEA 0183: sentences of navigation instruments, with or without time stamps of the recorder.

A line without a time stamp gets its time from the sentences with a clock (RMC, ZDA)
before and after it: instruments send at a steady rate, so the time of the n-th sentence of a kind is averaged over its
neighbours, each n periods away.
"""

from __future__ import annotations

import contextlib
import datetime as dt
import itertools
import math
import re
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import reduce
from operator import xor
from pathlib import Path

import numpy as np
from scipy.ndimage import median_filter

from tank2sim.apps.logs.clock import continued_clock, full_year, over_midnight, rollover_s, stamp_s
from tank2sim.apps.logs.findings import LogFinding, fault, not_used, note
from tank2sim.apps.logs.quantities import quantity_of_name
from tank2sim.apps.logs.streams import FIELDS, LogStream, Samples, VesselLog, mostly, text_lines
from tank2sim.arrays import Array
from tank2sim.errors import InputError, optional_library
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

_NEIGHBOURS = 10
"""Sentences of a kind before and after one over which its time is averaged. Project choice: a few seconds at the usual
1 to 10 Hz, in which clocks do not drift and few sentences are lost."""


_FIELDS = FIELDS["nmea0183"]
# Headings that repeat another instrument's, or rest on a compass: a gyro's goes first
_LAST = ("HDG.true_heading", "HDM.true_heading", "VHW.heading")
_CELLS = FIELDS["nmea0183_cells"]
_STAMPS = "the recorder's time stamps"
_FIRST_DAY = dt.date(1970, 1, 1)
_TIME_OF_DAY = "time of day of "  # Beginning of the name of a clock without a date, before the kind of its sentences
_SATELLITES = ("GSV", "GSA", "GRS", "GBS", "GST", "ALM", "DTM", "TXT")  # Kinds that say nothing of the vessel

_XDR_UNITS = {"D": "deg", "R": "rpm", "P": "%", "M": "m"}
# m/s of the units of MWV; S are statute miles per hour (NIST SP 811)
_WIND_UNITS = {"N": KNOT_MPS, "K": 1 / 3.6, "M": 1.0, "S": 0.44704}


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

    Raises InputError: There is no clock (RMC, ZDA, times of day, stamps of the recorder), or no sentence that is
    understood.
    """
    reader = _Reader(path)
    reader.summed = {label for line in text_lines(path) for label in _SUMMED.findall(line)}
    for line in text_lines(path):
        reader.take(line)
    return reader.log()


@dataclass(frozen=True, eq=False)
class _Clock:
    """Lines (n,) and their times, the name of the clock (empty: the recorder's), and the times of its own sentences."""

    name: str
    lines: np.ndarray
    times: Array
    ticks: Mapping[int, float] = field(default_factory=dict)

    @property
    def dated(self) -> bool:
        """Whether its times are UTC."""
        return not self.name.startswith(_TIME_OF_DAY)


class _Reader:
    """Reads line by line; the times are known after the last."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.known = set(optional_library("pynmea2", "logs", path).TalkerSentence.sentence_types)
        self.summed: set[bytes] = set()
        self.number = self.added = self.line = 0
        self.talker = ""
        self.talkers: list[str] = []
        self.counts: Counter[str] = Counter()
        self.kinds: Counter[str] = Counter()
        self.wrong: Counter[str] = Counter()
        self.malformed: Counter[str] = Counter()
        self.void: Counter[str] = Counter()
        self.unsummed: dict[bytes, list[tuple[int, bytes, bytes]]] = defaultdict(list)
        self.series: dict[tuple[str, str], dict[str, Samples]] = defaultdict(lambda: defaultdict(Samples))
        self.stated: dict[str, tuple[str, str, str]] = {}
        self.variation = math.nan
        self.clocks: dict[str, Samples] = defaultdict(Samples)
        self.stamps = Samples()

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
            body, total, label = match["body"].rstrip(), match["sum"], match["body"][1:].partition(b",")[0].rstrip()
            sentence = self.number, body, raw[: found[0].start()] or raw[found[-1].end() :]
            if total is None and self.summed:
                if label in self.summed:
                    self.counts["corrupted"] += 1
                else:
                    self.unsummed[label].append(sentence)
            elif total and reduce(xor, body[1:], 0) != int(total, 16):
                self.counts["corrupted"] += 1
                self.wrong[_kind(label)] += 1
            else:
                self._read(*sentence)

    def _read(self, number: int, body: bytes, prefix: bytes) -> None:
        """Read an intact sentence; one that cannot be read is counted, and ends nothing."""
        if (time := _time_of_prefix(prefix)) is not None:
            self.stamps.add(time, number)
        if body[:1] == b"!":
            self.counts["ais"] += 1
            return
        label, *cells = body[1:].decode("latin-1").split(",")
        proprietary = label[:1] == "P"
        kind, self.talker = _kind(label.encode("latin-1")), "" if proprietary else label[:-3]
        self.counts["proprietary"] += proprietary
        self.kinds[kind] += 1
        before, self.line = self.added, number
        try:
            self._take_values(kind, cells)
        except (LookupError, ValueError, ArithmeticError):
            self.malformed[kind] += 1
        else:
            self.void[kind] += before == self.added and kind != "ZDA"

    def _take_values(self, kind: str, cells: list[str]) -> None:
        """Keep the values of a sentence; of a kind that is not understood all numbers, for they may be named."""
        if kind in _SPECIAL:
            _SPECIAL[kind](self, kind, cells)
        if kind in _FIELDS:
            if _valid(kind, cells):
                self._plain(kind, cells)
        elif kind not in _SPECIAL and kind not in _SATELLITES:
            for place, cell in enumerate(cells, start=1):
                if _NUMBER.fullmatch(cell):
                    self._add(f"{kind}.{place}", float(cell), "", "", "")

    def _add(self, name: str, value: float, unit: str, quantity: str, by: str = "format") -> None:
        self.added += 1
        self.series[name.partition(".")[0], self.talker][name].add(value, self.line)
        self.stated[name] = unit, quantity, by

    def _plain(self, kind: str, cells: list[str]) -> None:
        for label, (place, unit, quantity, *shown) in _FIELDS[kind].items():
            name = f"{kind}.{label}"
            if shown and _cell(cells, shown[0]) != shown[1]:
                continue
            if text := _cell(cells, place):
                self._add(name, float(text), unit, quantity)
            elif kilometres := _cell(cells, _CELLS["kmh"].get(name)):
                self._add(name, float(kilometres) / 3.6 / KNOT_MPS, unit, quantity)

    def _rmc(self, kind: str, cells: list[str]) -> None:
        time, date = cells[0], cells[8]
        if time and date:
            day, month, year = int(date[:2]), int(date[2:4]), full_year(int(date[4:6]))
            self._tick("RMC" if cells[1] == "A" else "RMC without a fix", dt.date(year, month, day), time)
        self._position(kind, cells)
        if len(cells) > 10 and cells[9]:
            self.variation = _signed(cells[9], cells[10])

    def _zda(self, kind: str, cells: list[str]) -> None:
        self._tick(kind, dt.date(int(cells[3]), int(cells[2]), int(cells[1])), cells[0])

    def _tick(self, kind: str, date: dt.date, time: str) -> None:
        hours, minutes, rest = int(time[:2]), int(time[2:4]), float(time[4:])
        if not (0 <= hours < 24 and 0 <= minutes < 60 and 0 <= rest < 61):
            raise ValueError(time)
        seconds = 86400.0 * (date - _FIRST_DAY).days + (3600 * hours + 60 * minutes + rest)
        if self.talker not in self.talkers:
            self.talkers.append(self.talker)
        self.clocks[kind].add(seconds, self.line, self.talkers.index(self.talker))

    def _position(self, kind: str, cells: list[str]) -> None:
        place, time = _CELLS["latitude"][kind], _CELLS["time"][kind]
        if len(cells) > time and cells[time]:
            self._tick(f"{_TIME_OF_DAY}{kind}", _FIRST_DAY, cells[time])
        if not _valid(kind, cells) or (kind == "GGA" and cells[5] in ("", "0")):
            return
        if cells[place] and cells[place + 2]:
            latitude = _degrees(cells[place], 90) * {"N": 1, "S": -1}[cells[place + 1].upper()]
            longitude = _degrees(cells[place + 2], 180) * {"E": 1, "W": -1}[cells[place + 3].upper()]
            self._add(f"{kind}.latitude", latitude, "deg", "latitude")
            self._add(f"{kind}.longitude", longitude, "deg", "longitude")

    def _magnetic(self, kind: str, cells: list[str]) -> None:
        """True heading of a compass: the reading, its deviation, and the variation by itself or by RMC, + east."""
        deviation = 0.0
        if kind == "HDG":
            deviation = _signed(cells[1], cells[2]) if cells[1] else 0.0
            self.variation = _signed(cells[3], cells[4]) if cells[3] else self.variation
        if cells[0] and math.isfinite(self.variation):
            true = (float(cells[0]) + deviation + self.variation) % 360
            self._add(f"{kind}.true_heading", true, "deg", "heading")

    def _rpm(self, kind: str, cells: list[str]) -> None:
        if len(cells) > 4 and cells[4][:1] == "V":
            return
        shaft = int(cells[1] or 0)
        # Numbered from the centreline: 0 single or on it, odd starboard, even port (NMEA 0183, RPM).
        quantity = "rpm" if shaft == 0 else "rpm_starboard" if shaft % 2 else "rpm_port"
        self._add(f"RPM.{cells[0]}{shaft}", float(cells[2]), "rpm", quantity)

    def _mwv(self, kind: str, cells: list[str]) -> None:
        if _valid(kind, cells):
            prefix, words = ("wind_rel", "relative") if cells[1] == "R" else ("wind_theoretical", "theoretical")
            angle, speed = float(cells[0]), float(cells[2]) * _WIND_UNITS[cells[3]]
            self._add(f"MWV.{words}_angle", angle, "deg", f"{prefix}_direction")
            self._add(f"MWV.{words}_speed", speed, "m/s", f"{prefix}_speed")

    def _xdr(self, kind: str, cells: list[str]) -> None:
        """Transducers, four cells each: type, value, unit, name."""
        for place, (_, value, letter, name) in enumerate(zip(*[iter(cells)] * 4, strict=False), start=1):
            if value:
                unit = _XDR_UNITS.get(letter, letter)
                quantity = quantity_of_name(name, unit) if unit else ""
                self._add(f"XDR.{name or place}", float(value), unit, quantity, "name" if quantity else "")

    def log(self) -> VesselLog:
        """The log after the last line."""
        findings: list[LogFinding] = []
        self._take_unsummed(findings)
        clock = self._clock(findings)
        self._name_single_shaft(findings)
        streams = self._streams(clock, findings)
        if not any(stream.quantity for stream in streams):
            raise InputError(self.path, "", "no sentence of it is understood", "give a log with RMC, HDT, RSA, ...")
        self.counts["malformed"] = self.malformed.total()
        always, counted = ("lines", "corrupted"), ("malformed", "ais", "proprietary")
        counts = {key: self.counts[key] for key in (*always, *filter(self.counts.__getitem__, counted))}
        counts["dropped"] = sum(_lost(stream.time_s) for stream in streams if stream.name.startswith("HDT"))
        self._say_spoilt(findings)
        self._say_unused(counts, findings)
        return VesselLog(self.path, "NMEA 0183", tuple(streams), counts, tuple(findings), clock.dated)

    def _streams(self, clock: _Clock, findings: list[LogFinding]) -> list[LogStream]:
        """Fields of all instruments in the times of a clock; headings that rest on a compass are the last."""
        streams: list[LogStream] = []
        names: Counter[str] = Counter()
        for kind, name, lines, values in self._instruments(findings):
            time = steady_times(_time_of_lines(lines, clock.lines, clock.times))
            if clock.name.endswith(kind):  # it carries its own times
                time = np.array([clock.ticks.get(line, at) for line, at in zip(lines.tolist(), time, strict=True)])
            names[name] += 1
            label = f"{name} #{names[name]}" if names[name] > 1 else name
            streams.append(LogStream(label, time, values, *self.stated[name]))
        return sorted(streams, key=lambda stream: stream.name.startswith(_LAST))

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
            findings.append(note(text, name))
        if not self.summed:
            findings.append(note("no sentence has a checksum, so that none is tested for errors"))

    def _say_spoilt(self, findings: list[LogFinding]) -> None:
        """Say what is spoilt or holds no value, each kind with its number."""
        if spoilt := self.counts["corrupted"]:
            text = f"{spoilt} of {self.counts['lines']} lines are corrupted (wrong checksum or cut) and left out"
            findings.append(note(text, share=spoilt / self.counts["lines"]))
        if self.malformed:
            listed = ", ".join(f"{number} {kind}" for kind, number in self.malformed.items())
            findings.append(note(f"sentences with a cell that cannot be read are left out: {listed}"))
        totals = self.wrong + self.kinds
        for kind, number in _most_of(self.wrong, totals):
            text = f"{number} of {totals[kind]} {kind} have a wrong checksum and are left out"
            findings.append((fault if kind in _READ else note)(text, kind))
        for kind, number in _most_of(self.void, self.kinds):
            if kind in _READ:
                text = f"{number} of {self.kinds[kind]} {kind} hold no valid value (status V, mode N, or empty)"
                findings.append(note(text, kind))

    def _say_unused(self, counts: dict[str, int], findings: list[LogFinding]) -> None:
        """Say and count which kinds are not used, or not known."""
        unknown = "sentences (unknown; channels.toml may name their numbers)"
        others = self.kinds.keys() - _READ
        for key, words, which in (
            ("unused", "sentences", others & self.known),
            ("unknown", unknown, others - self.known),
        ):
            kinds = {kind: self.kinds[kind] for kind in which}
            findings += not_used(words, kinds)
            counts |= {key: sum(kinds.values())} if kinds else {}

    def _clock(self, findings: list[LogFinding]) -> _Clock:
        """The receiver's clock, by the recorder's time stamps between its ticks where nearly all lines have one."""
        order = np.argsort(self.stamps.lines, kind="stable")
        stamp_lines, stamps = (np.array(part)[order] for part in (self.stamps.lines, self.stamps.values))
        stamped = len(stamps) > 0.9 * (sum(self.kinds.values()) + self.counts["ais"])
        name = self._best_clock()
        if len(self.clocks[name].lines) < 2 or (stamped and name.startswith(_TIME_OF_DAY)):
            if not stamped or len(stamps) < 2:
                raise self._without_clock()
            return _Clock("", stamp_lines, _continued(stamps, _STAMPS, findings))
        lines, times = self._ticks(name, findings)
        if stamped:
            shift, found = rollover_s(float(np.median(times - np.interp(lines, stamp_lines, stamps))))
            findings += found
            times, stamps = times + shift, _continued(stamps, _STAMPS, findings)
            late = times - np.interp(lines, stamp_lines, stamps)
            if np.ptp(late) < _STAMPS_AGREE_S:
                ticks = dict(zip(lines.tolist(), times.tolist(), strict=True))
                return _Clock(name, stamp_lines, stamps + float(np.median(late)), ticks)
            drift = f"drift by {np.ptp(late):.3g} s against the clock of {name}, which is taken"
            findings.append(note(f"{_STAMPS} {drift}"))
        rises = np.diff(times, prepend=-np.inf) > 0
        return _Clock(name, lines[rises], times[rises], dict(zip(lines.tolist(), times.tolist(), strict=True)))

    def _ticks(self, name: str, findings: list[LogFinding]) -> tuple[np.ndarray, Array]:
        """Lines and times of the sentences of a clock, of the most frequent talker if several send at once."""
        clock = self.clocks[name]
        lines, times, talkers = (np.array(part) for part in (clock.lines, clock.values, clock.stamps))
        if name.startswith(_TIME_OF_DAY):
            times = over_midnight(times)
            findings.append(note("no sentence has a date (RMC, ZDA): the trials have no date"))
        if _overlapping(lines, talkers):
            first = Counter(talkers.tolist()).most_common(1)[0][0]
            lines, times = lines[talkers == first], times[talkers == first]
        return lines, _continued(times, name, findings)

    def _best_clock(self) -> str:
        """RMC, or ZDA if it is more frequent by far, or else the commonest times of day."""
        size = Counter({name: len(clock.lines) for name, clock in self.clocks.items()})
        rmc = "RMC" if size["RMC"] > 1 else "RMC without a fix"
        best = rmc if 2 * size[rmc] >= size["ZDA"] else "ZDA"
        undated = [name for name in size if name.startswith(_TIME_OF_DAY)]
        return best if size[best] > 1 or not undated else max(undated, key=lambda name: size[name])

    def _without_clock(self) -> InputError:
        number = sum(len(self.clocks[name].lines) for name in ("RMC", "RMC without a fix", "ZDA"))
        problem, remedy = (
            f"has {number} sentences with date and time (RMC or ZDA)",
            "log RMC, or give a log with more than one of them",
        )
        if wrong := sum(self.wrong.values()):
            total = wrong + sum(self.kinds.values())
            problem += f": {wrong} of {total} have a wrong checksum, of them {self.wrong['RMC']} RMC"
            remedy = "the file was changed or its recorder is faulty: give the file as recorded"
        return InputError(self.path, "", problem, remedy)

    def _name_single_shaft(self, findings: list[LogFinding]) -> None:
        """Take the one number that shafts and engines have for the only shaft, for many recorders call it 1."""
        sources = sorted(name for name in self.stated if name.startswith("RPM."))
        numbers = {name[len("RPM.S") :] for name in sources}
        if len(numbers) != 1 or numbers == {"0"}:
            return
        shaft = max(sources)  # the shaft's (S), even if the engine's (E) is there
        self.stated |= {name: ("rpm", "rpm" if name == shaft else "", "format") for name in sources}
        side = "starboard" if int(*numbers) % 2 else "port"
        findings.append(note(f"{shaft} is the only shaft: it counts as a single propeller, not as a {side} one", shaft))

    def _instruments(self, findings: list[LogFinding]) -> Iterator[tuple[str, str, np.ndarray, Array]]:
        """Kind, name, lines and values of each field of each instrument; talkers that follow each other are one."""
        for kind in dict.fromkeys(kind for kind, _ in self.series):
            groups = self._groups(kind)
            if len(groups) > 1:
                names = ", ".join("/".join(group) for group in groups)
                text = f"{kind} comes from {len(groups)} instruments at the same time: {names}"
                findings.append(note(text, kind))
            for group in groups:
                parts: dict[str, list[Samples]] = defaultdict(list)
                for name, samples in itertools.chain(*(self.series[kind, talker].items() for talker in group)):
                    parts[name].append(samples)
                for name, each in parts.items():
                    lines, values = (np.concatenate(column) for column in zip(*map(_columns, each), strict=True))
                    order = np.argsort(lines, kind="stable")
                    yield kind, name, lines[order], values[order]

    def _groups(self, kind: str) -> list[list[str]]:
        """Talkers of a kind of sentence, those that follow each other in one group."""
        groups: list[list[str]] = []
        for talker in (talker for other, talker in self.series if other == kind):
            home = next((group for group in groups if not self._together(kind, [*group, talker])), None)
            if home is None:
                groups.append(home := [])
            home.append(talker)
        return groups

    def _together(self, kind: str, talkers: list[str]) -> bool:
        """Whether the sentences of these talkers lie between each other."""
        lines = [np.unique(np.concatenate([part.lines for part in self.series[kind, t].values()])) for t in talkers]
        return _overlapping(np.concatenate(lines), np.repeat(np.arange(len(lines)), list(map(len, lines))))


# Kinds of sentences with more than numbers in cells
_SPECIAL: dict[str, Callable[[_Reader, str, list[str]], None]] = {
    **dict.fromkeys(("GGA", "GLL", "GNS"), _Reader._position),
    **dict.fromkeys(("HDG", "HDM"), _Reader._magnetic),
    "RMC": _Reader._rmc,
    "RPM": _Reader._rpm,
    "MWV": _Reader._mwv,
    "XDR": _Reader._xdr,
    "ZDA": _Reader._zda,
}


_READ = {*_FIELDS, *_SPECIAL}


def _columns(samples: Samples) -> tuple[np.ndarray, Array]:
    """Lines and values (n,) of a field."""
    return np.array(samples.lines), np.array(samples.values)


def _continued(times: Array, name: str, findings: list[LogFinding]) -> Array:
    """Times (n,) of a clock that goes on where it was set back, which is added to the findings."""
    continued, found = continued_clock(times, name)
    findings += found
    return continued


def _most_of(part: Counter[str], total: Counter[str]) -> list[tuple[str, int]]:
    """Kinds of which :data:`_FEW` or more sentences, and the greater part of all, are in a part; with their number."""
    return [(kind, n) for kind, n in part.items() if n >= _FEW and n > _MOST * total[kind]]


def _cell(cells: list[str], place: int | None) -> str:
    """A cell; empty where a sentence is shorter, or does not have it."""
    return cells[place] if place is not None and place < len(cells) else ""


def _valid(kind: str, cells: list[str]) -> bool:
    """Whether status and mode say that a sentence holds values."""
    mode = _cell(cells, _CELLS["mode"].get(kind)).strip()
    place, letters = _CELLS["status"].get(kind, (None, ""))
    return (place is None or cells[place][:1] in tuple(letters)) and (not mode or mode.strip("N") != "")


def _kind(label: bytes) -> str:
    """The three letters of a sentence, or all of a proprietary one."""
    return (label if label.startswith(b"P") else label[-3:]).decode("latin-1")


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
    padded = np.pad(time, _NEIGHBOURS, mode="reflect", reflect_type="odd")
    even = time[0] + period * np.arange(-_NEIGHBOURS, len(time) + _NEIGHBOURS)
    smooth = (even + median_filter(padded - even, size=2 * _NEIGHBOURS + 1))[_NEIGHBOURS:-_NEIGHBOURS]
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
    match = _TAG_TIME.search(prefix) or _EPOCH.search(prefix) or _ISO.search(prefix)
    with contextlib.suppress(ValueError):  # a month 13
        return stamp_s(match[1].decode()) if match else None
    return None
