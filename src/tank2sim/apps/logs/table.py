"""Logs in any CSV: commas, semicolons or tabs; decimal commas; a row of units; dates, local times, epochs."""

from __future__ import annotations

import csv
import itertools
import re
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from tank2sim.apps.logs.clock import DOUBLED_STEPS, TWO_DIGITS_FROM, over_midnight
from tank2sim.apps.logs.findings import LogFinding, fault, note
from tank2sim.apps.logs.quantities import CLOCK_WORDS, plain_words, quantity_of_name, unit_of_signal_k
from tank2sim.apps.logs.streams import LogStream, VesselLog, named_stream
from tank2sim.arrays import Array
from tank2sim.errors import InputError
from tank2sim.files import first_bytes
from tank2sim.records.spelt_units import split_unit
from tank2sim.records.text_layout import WHITESPACE, TextLayout, decoded_text, text_layout

_ZONES_H, _COUNTS = CLOCK_WORDS["zones_h"], CLOCK_WORDS["seconds"]
_TIME_WORDS, _DATE_WORDS = (re.compile(rf"\b({'|'.join(CLOCK_WORDS[kind])})\b") for kind in ("time", "date"))
_DATE = re.compile(r"\d{1,4}[./-]\d{1,2}[./-]\d{1,4}")
_LIKE_TIME = re.compile(rf"({_DATE.pattern}[T ,]+)?\d{{1,2}}:\d\d")
# Least and largest size of an epoch in s, ms, us and ns since 1970 (years 1973 to 2286), and its factor to seconds
_EPOCHS = ((1e8, 1e10, 1.0), (1e11, 1e13, 1e-3), (1e14, 1e16, 1e-6), (1e17, 1e19, 1e-9))
# Days of the years 2000 to 2040, and the day of 1970-01-01: of spreadsheets since 1899-12-30, of MATLAB (datenum)
_DAYS = ((36_526.0, 51_544.0, 25_569.0), (730_486.0, 745_504.0, 719_529.0))

_LONGEST_IN_DAYS = 31.0
"""Longest log whose times are taken for days. Project choice: seconds of so large a number count from a beginning, and
then differ by more."""

_FIRST_DAY, _LAST_DAY = 19800101, 21001231
"""Least and largest date yyyymmdd. Project choice: GPS time begins in 1980."""

_CLOCK_DIGITS = 3
"""Least number of different seconds of a minute of a clock in digits. Project choice: counts by 50 have two."""

_BEGINNING = 10
"""Percentile of times that are since 1970 already; counts since a start are less. Project choice: some cells are 0."""

_DOUBTFUL_STEP, _SLOWEST_STEP_S = 5.0, 100.0
"""Step of a count without a unit from which its unit is looked for, and from which it is not s. Project choice: logs
have a row a second or more; a row in 100 s shows no manoeuvre."""

_SLOWEST_MPS = 0.05
"""Speed of a track, m/s, below which its times are in a smaller unit. Project choice: receivers at rest wander so."""

_LEAST_TURNED_DEG, _SLOWEST_TURN_DEGPS = 10.0, 0.05
"""Turn of a log from which its rate gives the unit of the time, deg, and the rate at which no vessel turns at its
fastest, deg/s. Project choice: large tankers turn at 0.3 deg/s."""

_MOST = 0.5
"""Share of the rows of a time that have a value of a column that is sampled row by row. Project choice."""

_ROWS_OF_A_SIGNAL = 10
"""Least rows of a name in a column that is taken for one of names of signals. Project choice: remarks are rarer."""

_HEAD_BYTES = 1 << 16
"""Bytes by which separator, decimal sign and units are judged. Project choice: some hundred rows."""

_DEGREES_MINUTES = re.compile(
    r"^\s*(?P<front>[NSEW])?\s*(?P<degrees>[+-]?\d{1,3})\s*[°\s]\s*(?P<minutes>\d+(?:[.,]\d+)?)\s*['′]?"
    r"(?:\s*(?P<seconds>\d+(?:[.,]\d+)?)\s*[\"″])?\s*(?P<back>[NSEW])?\s*$"
)


def read_table_log(path: Path) -> VesselLog:
    """Read a log that is a table of text, one row a sample.

    Separator, decimal sign, encoding (UTF-8 or Windows-1252) and a row of units under the names are found from the
    first lines; the time is a column of ISO 8601, of date and time of day, or of seconds (ms, us, ns) since 1970, in
    UTC unless the name of the column has a zone (``MEZ``, ``UTC+2``). Seconds that count from the beginning are taken
    too; the log then has no date. Columns without names are ``column 1`` and so on. Rows that cannot be read are
    counted and left out.

    Raises InputError: The file cannot be read, or has no rows or no time.
    """
    text, encoding = decoded_text(head := first_bytes(path, _HEAD_BYTES), complete=False)
    lines = text.splitlines()
    layout = text_layout(path, lines[:-1] if len(head) == _HEAD_BYTES and len(lines) > 1 else lines)  # a cut line
    frame, findings, skipped = _frame(path, layout, encoding)
    time, dated, used = _TableClock(path, frame, layout, findings).times()
    counts = {"rows": len(frame), "repeated_rows": 0, "skipped": skipped}
    last = max(used, key=list(frame.columns).index)
    if not np.isfinite(time).any():
        remedy = "write ISO 8601 times, as 2024-05-04T09:30:00.2Z, or seconds since 1970"
        problem = f"holds no time that can be read, as {_first_cell(frame[last])[:40]!r}"
        raise InputError(path, f"column {last}", problem, remedy)
    values = frame.drop(columns=list(used))
    if not _by_signal(values, time) and (spread := _spread(time, values)) is not None:
        time, each = spread
        text = f"{last} has {each} rows at each time (median): they are spread evenly between them"
        findings.append(note(text, last, rows=each))
    else:
        new = ~frame.duplicated().to_numpy()
        values, time = values[new], time[new]
        counts["repeated_rows"] = counts["rows"] - len(values)
    streams = _by_signal(values, time) or _by_column(values, time, layout)
    if not streams:
        raise InputError(path, "", "has no column of numbers next to its time", "give a table of measured values")
    counts["without_time"] = int(np.isnan(time).sum())
    return VesselLog(path, "CSV", tuple(streams), counts, tuple(findings), dated)


def _by_column(frame: pd.DataFrame, time: Array, layout: TextLayout) -> list[LogStream]:
    """A stream of each column of numbers."""
    units = dict(zip(layout.names, layout.units, strict=True))
    columns = {name: _numbers(frame[name], layout.comma) for name in frame.columns}
    return [_stream(name, units[name], time, values) for name, values in columns.items() if values is not None]


def _frame(path: Path, layout: TextLayout, encoding: str) -> tuple[pd.DataFrame, list[LogFinding], int]:
    """Cells of the table, and notes of rows with too many, whose number is the last."""
    try:
        with warnings.catch_warnings(record=True) as warned:
            warnings.simplefilter("always", pd.errors.ParserWarning)
            frame = pd.read_csv(
                path,
                sep=r"\s+" if layout.separator == WHITESPACE else layout.separator,
                names=list(layout.names),
                index_col=False,
                skiprows=layout.skip,
                comment="#",
                decimal="," if layout.comma else ".",
                encoding=encoding,
                encoding_errors="replace",
                on_bad_lines="skip",
                low_memory=False,
            )
    except (ValueError, csv.Error) as error:
        raise InputError(path, "", f"is not a table ({' '.join(str(error).split())})", "give a CSV") from None
    with path.open("rb") as file:
        body = itertools.islice(file, layout.skip, None)
        skipped = max(0, sum(1 for line in body if line.strip() and not line.startswith(b"#")) - len(frame))
    findings = [note(f"{skipped} rows have too many cells and are left out")] if skipped else []
    if any(issubclass(each.category, pd.errors.ParserWarning) for each in warned):
        findings.append(note(f"rows have cells beyond the {len(layout.names)} columns; they are not read"))
    return frame, findings, skipped


def _by_signal(frame: pd.DataFrame, time: Array) -> list[LogStream]:
    """Streams of a table with a column of signal names, :data:`_ROWS_OF_A_SIGNAL` rows of each or more; else none."""
    numeric = list(frame.select_dtypes("number").columns)
    texts = [name for name in frame.columns if name not in numeric]
    if len(numeric) != 1 or len(texts) != 1 or frame[texts[0]].isna().any():
        return []
    rows_of = {str(name): rows for name, rows in frame.groupby(texts[0], sort=False).indices.items()}
    if len(rows_of) < 2 or min(map(len, rows_of.values())) < _ROWS_OF_A_SIGNAL:
        return []
    values = frame[numeric[0]].to_numpy(dtype=float)
    return [_stream(name, "", time[rows], values[rows]) for name, rows in rows_of.items()]


def _spread(time: Array, values: pd.DataFrame) -> tuple[Array, int] | None:
    """Times (rows,) of a clock coarser than the rows, spread by place; None if unneeded or of several instruments."""
    begins = np.flatnonzero(np.diff(time, prepend=np.nan) != 0)
    counts = np.diff(np.append(begins, len(time)))
    each = int(np.median(counts[1:-1])) if len(counts) > 2 else 1
    if each < 2 or not np.isfinite(time).all() or (np.diff(time) < 0).any():
        return None
    runs = np.repeat(np.arange(len(counts)), counts)
    numbers = [column.to_numpy(dtype=float) for _, column in values.select_dtypes("number").items()]
    if any(_is_of_two(column, begins, runs) for column in numbers):
        return None
    if not any(_moves_within(column, runs) for column in numbers):
        return None
    steps = np.diff(time[begins])
    step = float(np.median(steps))
    lengths = np.append(np.minimum(steps, 2 * step), step)
    full = np.maximum(counts, each * (np.arange(len(counts)) % (len(counts) - 1) == 0))  # the first and last are cut
    place = np.arange(len(time)) - begins[runs] + np.where(runs == 0, full[0] - counts[0], 0)
    return time + place * (lengths / full)[runs], each


def _steps_within(column: Array, runs: np.ndarray) -> Array:
    """Sizes of the known steps of a column (rows,) between rows of one time."""
    steps = np.abs(np.diff(column))[np.diff(runs) == 0]
    return np.asarray(steps[np.isfinite(steps)])


def _moves_within(column: Array, runs: np.ndarray) -> bool:
    """Whether a column (rows,) is sampled row by row, and moves between rows of one time."""
    steps = _steps_within(column, runs)
    return len(steps) > _MOST * (len(runs) - runs[-1] - 1) and bool(steps.any())


def _is_of_two(column: Array, begins: np.ndarray, runs: np.ndarray) -> bool:
    """Whether a column (rows,) differs more between rows of one time than from one time to the next."""
    inside, outside = _steps_within(column, runs), np.abs(np.diff(column[begins]))
    known = outside[np.isfinite(outside)]
    usual = float(np.median(known)) if len(known) else 0.0
    return len(inside) > 0 and bool(np.median(inside) > DOUBLED_STEPS * usual > 0)


def _stream(name: str, unit: str, time: Array, values: Array) -> LogStream:
    """A column with the quantity that its name suggests, unless its unit is of another kind."""
    return named_stream(
        name, time, values, unit or split_unit(name)[1] or unit_of_signal_k(name, quantity_of_name(name))
    )


class _TableClock:
    """The times of a table, by the names of its columns and by their cells."""

    def __init__(self, path: Path, frame: pd.DataFrame, layout: TextLayout, findings: list[LogFinding]) -> None:
        self.path, self.layout, self.findings = path, layout, findings
        self.columns = {name: _as_numbers(frame[name]) for name in frame.columns}
        self.first = {name: _first_cell(column) for name, column in self.columns.items()}
        numeric = {name: column for name, column in self.columns.items() if column.dtype.kind in "iufb"}
        self.numbers = {name: column.to_numpy(dtype=float) for name, column in numeric.items()}
        self.named = [name for name in self.first if _TIME_WORDS.search(plain_words(name))]
        others = [name for name in self.first if name not in self.named]
        self.dates = list(filter(self._holds_dates, others))
        self.clocks = [name for name in others if name not in self.dates and _LIKE_TIME.match(self.first[name])]
        self.leftmost = list(self.columns)[:1]

    def _holds_dates(self, name: str) -> bool:
        """Whether a column is of dates, by its name and its cells."""
        if not _DATE_WORDS.search(plain_words(name)):
            return False
        return bool(_DATE.match(self.first[name])) or self._days_of_numbers(name) is not None

    def times(self) -> tuple[Array, bool, set[str]]:
        """Times (rows,), whether they are UTC, and the columns that they are made of."""
        ways: tuple[tuple[Callable[[str], tuple[Array, list[str]] | None], list[str], bool], ...] = (
            (self._dated, [*self.named, *self.dates, *self.clocks, *self.leftmost], True),
            (self._of_day, [*self.named, *self.clocks, *self.leftmost], False),
            (self._from_beginning, self.named or self.leftmost, False),
        )
        for read, names, dated in ways:
            for name in names:
                if (found := read(name)) is not None:
                    return found[0], dated, {name, *found[1]}
        problem = "it is not a log of a known format, and as a table there is no column of time"
        remedy = "give a column of ISO 8601 times, of date and time, or of seconds"
        raise InputError(self.path, "header", problem, remedy)

    def _dated(self, name: str) -> tuple[Array, list[str]] | None:
        """UTC (rows,) of a column, and the columns of dates used; None if it does not show it."""
        return self._counted(name) if name in self.numbers else self._written(name)

    def _of_day(self, name: str) -> tuple[Array, list[str]] | None:
        """Times of day (rows,) of a column, which go on over midnight; None if it holds others."""
        of_day = _clock(self.columns[name]) if re.match(r"\d{1,2}:\d\d", self.first[name]) else None
        if name in self.numbers and self._stated_count(name) is None:
            of_day = _clock_of_numbers(self.numbers[name])
        if of_day is None:
            return None
        self.findings.append(note(f"{name} has times of day without a date: the trials have no date", name))
        return over_midnight(of_day), []

    def _from_beginning(self, name: str) -> tuple[Array, list[str]] | None:
        """Times (rows,) since the beginning of the log of a column that rises; None of any other."""
        values = self.numbers.get(name, np.zeros(0))
        steps = np.diff(values[np.isfinite(values)])
        if not len(steps) or (steps >= 0).mean() <= 0.9:
            return None
        self.findings.append(note(f"{name} counts from the beginning of the log: the trials have no date", name))
        return values * (self._stated_count(name) or self._count_by_motion(name)), []

    def _counted(self, name: str) -> tuple[Array, list[str]] | None:
        """The same of a column of numbers."""
        values = self.numbers[name]
        clock = None if self._stated_count(name) or name in self.dates else _clock_of_numbers(values)
        if clock is None:
            seconds = self._epoch_seconds(name)
            return None if seconds is None else (seconds, self.dates)
        return (self._days(self.dates[0], self._zone_s(name)) + clock, self.dates[:1]) if self.dates else None

    def _written(self, name: str) -> tuple[Array, list[str]] | None:
        """The same of a column of text."""
        column, first, offset = self.columns[name], self.first[name], self._zone_s(name)
        if re.match(r"\d{4}-\d\d-\d\d[T ]\d", first):
            moments = pd.to_datetime(column, format="ISO8601", utc=True, errors="coerce")
            return _seconds(moments, offset), self.dates
        if re.match(r"\d{1,4}[./-]\d{1,2}[./-]\d{2,4}[T ,]+\d", first):
            return _seconds(_dates(self.path, name, column), offset), []
        if self.dates and re.match(r"\d{1,2}:\d\d", first):
            return self._days(self.dates[0], offset) + _clock(column), self.dates[:1]
        return None

    def _epoch_seconds(self, name: str) -> Array | None:
        """Seconds (rows,) since 1970 of numbers that count s, ms, us or ns since then, or days; None if they do not."""
        values = self.numbers[name]
        known = values[np.isfinite(values)]
        size = float(np.median(np.abs(known))) if len(known) else 0.0
        for least, largest, factor in _EPOCHS:
            if least <= size <= largest and _counts_from_1970(known, least, factor):
                return np.asarray(values * factor)
        moments = _moments_of_numbers(values)
        if moments is None and len(known) and np.ptp(known) < _LONGEST_IN_DAYS:
            day = next((day for least, largest, day in _DAYS if least <= size <= largest), None)
            moments = None if day is None else (values - day) * 86400
        return None if moments is None else moments - self._zone_s(name)

    def _stated_count(self, name: str) -> float | None:
        """Seconds of the unit in which a column counts by its name or its unit; None where neither says."""
        words = plain_words(f"{name} {self.layout.units[self.layout.names.index(name)]}")
        return next((factor for pattern, factor in _COUNTS.items() if re.search(rf"\b({pattern})\b", words)), None)

    def _count_by_motion(self, name: str) -> float:
        """Seconds of the unit in which a column counts, by the speed of the track, or else by the step."""
        values = self.numbers[name]
        step = float(np.median(np.diff(values[np.isfinite(values)])))
        if step < _DOUBTFUL_STEP:
            return 1.0
        speed = self._track_speed(values)
        if not speed:  # no positions, or the receiver was at rest
            slow = self._turns_too_slowly(values)
            if not slow and step < _SLOWEST_STEP_S - 1e-3:
                return 1.0
            rows = f"a row in {step:.4g} s shows no manoeuvre"
            why = "the heading would turn by less than any vessel" if slow else rows
            self.findings.append(fault(f"{name} states no unit, and {why}: it is taken to count ms", name))
            return 1e-3
        factor = next((factor for factor in (1.0, 1e-3, 1e-6, 1e-9) if speed > _SLOWEST_MPS * factor), 1.0)
        if factor < 1:
            text = f"{name} states no unit; in s the vessel would make {speed:.2g} m/s, so it counts in {factor:g} s"
            self.findings.append(note(text, name, unit_s=factor))
        return factor

    def _of_quantity(self, *quantities: str) -> list[Array]:
        """Values (rows,) of columns by their names; empty unless all are there."""
        columns = {quantity_of_name(name): column for name, column in self.columns.items()}
        found = [_numbers(columns[name], False) for name in quantities if name in columns]
        known = [values for values in found if values is not None]
        return known if len(known) == len(quantities) else []

    def _turns_too_slowly(self, values: Array) -> bool:
        """Whether a heading (deg) turns so slowly, with the time in s, that the time is in a smaller unit."""
        for heading in self._of_quantity("heading"):
            known = np.isfinite(heading) & np.isfinite(values)
            turned, steps = np.unwrap(heading[known], period=360), np.diff(values[known])
            if len(steps) >= _ROWS_OF_A_SIGNAL and np.ptp(turned) >= _LEAST_TURNED_DEG and (steps > 0).any():
                rates = np.abs(np.diff(turned))[steps > 0] / steps[steps > 0]
                return float(np.percentile(rates, 99)) < _SLOWEST_TURN_DEGPS
        return False

    def _track_speed(self, values: Array) -> float | None:
        """Speed of the positions of a table, 95th percentile, m in the unit of its time; None without positions."""
        for pair, metres in ((("latitude", "longitude"), 111_000.0), (("x", "y"), 1.0)):
            if track := self._of_quantity(*pair):
                shrink = float(np.cos(np.radians(np.nanmedian(track[0])))) if metres > 1 else 1.0
                way = metres * np.hypot(np.diff(track[0]), shrink * np.diff(track[1]))
                step = np.diff(values)
                good = np.isfinite(way) & (step > 0)
                return float(np.percentile(way[good] / step[good], 95)) if good.any() else None
        return None

    def _days_of_numbers(self, name: str) -> Array | None:
        """Seconds (rows,) since 1970 of dates yyyymmdd, ddmmyy (as in NMEA 0183) or yymmdd, or of spreadsheets."""
        values = self.numbers.get(name)
        if values is None:
            return None
        size = float(np.nanmedian(values)) if np.isfinite(values).any() else 0.0
        least, largest, day = _DAYS[0]
        if _FIRST_DAY <= size <= _LAST_DAY:
            return _calendar_days(values)
        if size > 991299 or size < 10100:
            return None
        first, middle, last = values // 10000, values // 100 % 100, values % 100
        forwards = [first, middle, last] if "yymmdd" in name.lower() else [last, middle, first]
        for year, month, date in (forwards, forwards[::-1]):
            full = year + np.where(year >= TWO_DIGITS_FROM, 1900, 2000)
            if (days := _calendar_days(full * 10000 + month * 100 + date)) is not None:
                return days
        return (values - day) * 86400 if least <= size <= largest else None

    def _days(self, name: str, offset_s: float) -> Array:
        """Seconds (rows,) since 1970 of a column of dates in text or numbers."""
        numbers = self._days_of_numbers(name)
        return (
            _seconds(_dates(self.path, name, self.columns[name]), offset_s) if numbers is None else numbers - offset_s
        )

    def _zone_s(self, name: str) -> float:
        """Seconds that the clock of a column is before UTC, by its name."""
        if match := re.search(r"(?:utc|gmt)\s*([+-]\d{1,2})(?::?(\d\d))?", name, re.IGNORECASE):
            return 3600.0 * (int(match[1]) + (int(match[2] or 0) / 60) * (-1 if match[1][0] == "-" else 1))
        words = plain_words(name)
        zone = next((_ZONES_H[word] for word in words.split() if word in _ZONES_H), None)
        if zone is None and re.search(r"\b(local|lt|ortszeit|bordzeit)\b", words):
            text = f"{name} is a local time of unknown zone, and is taken as UTC"
            self.findings.append(fault(text, name))
        return 3600.0 * (zone or 0)


def _as_numbers(column: pd.Series[Any]) -> pd.Series[Any]:
    """A column of numbers with another decimal sign than the rest of the table as numbers; any other as it is."""
    if column.dtype.kind in "iufb" or not re.fullmatch(r"\s*-?\d+[.,]\d+\s*", _first_cell(column)):
        return column
    return pd.to_numeric(column.astype(str).str.replace(",", ".", regex=False), errors="coerce")


def _first_cell(column: pd.Series[Any]) -> str:
    return next((str(value) for value in column.dropna()[:1]), "")


def _counts_from_1970(known: Array, least: float, factor: float) -> bool:
    """Whether nearly all of these numbers (n,) are at `least` so large, and count in steps of a log."""
    large = bool(np.percentile(known, _BEGINNING) >= least)
    return large and (len(known) < 2 or bool(np.median(np.diff(known)) * factor < _SLOWEST_STEP_S))


def _clock_of_numbers(values: Array) -> Array | None:
    """Seconds of the day (rows,) of hhmmss[cc|mmm] or fractions of a day; None of a count, whose digits go on to 99."""
    known = values[np.isfinite(values)]
    if len(known) < _ROWS_OF_A_SIGNAL or known.min() < 0 or np.ptp(known) == 0:
        return None
    if known.max() <= 1:
        return np.asarray(values * 86400)
    for scale in (1.0, 1e-2, 1e-3):
        digits = known * scale
        seconds, minutes = digits % 100, digits // 100 % 100
        if max(digits.max() / 240000, seconds.max() / 60, minutes.max() / 60) < 1:
            crosses = np.ptp(digits // 100) > 0 and len(np.unique(seconds // 1)) >= _CLOCK_DIGITS
            every = values * scale
            return every // 10000 * 3600 + every // 100 % 100 * 60 + every % 100 if crosses else None
    return None


def _moments_of_numbers(values: Array) -> Array | None:
    """Seconds (rows,) since 1970 of numbers yyyymmddhhmmss, with milliseconds or not; None of others."""
    size = float(np.nanmedian(values)) if np.isfinite(values).any() else 0.0
    for scale in (1.0, 1e-3):
        if _FIRST_DAY * 1e6 <= size * scale < _LAST_DAY * 1e6:
            days = _calendar_days(values * scale // 1e6)
            clock = _clock_of_numbers(values * scale % 1e6)
            return None if days is None or clock is None else days + clock
    return None


def _calendar_days(values: Array) -> Array | None:
    """Seconds (rows,) since 1970 of dates yyyymmdd; None unless all are."""
    known = np.isfinite(values)
    text = pd.Series(values[known]).astype(int).astype(str)
    moments = pd.to_datetime(text, format="%Y%m%d", utc=True, errors="coerce")
    out = np.full(len(values), np.nan)
    out[known] = _seconds(moments, 0.0)
    return out if known.any() and not moments.isna().any() else None


def _clock(column: pd.Series[Any]) -> Array:
    """Seconds (rows,) of times of day; some may end with AM or PM."""
    text = _of_24_hours(column.astype(str).str.strip().str.replace(",", ".", regex=False))
    text = text.where(text.str.count(":") > 1, text + ":00")
    return np.asarray(pd.to_timedelta(text, errors="coerce").dt.total_seconds(), dtype=float)


def _dates(path: Path, name: str, column: pd.Series[Any]) -> pd.Series[Any]:
    """Dates with numbers for months; points and a year at the end put the day first, as ISO 8601 the year."""
    text = column.astype(str).str.strip().str.replace(",", ".", regex=False)
    parts = text.str.extract(r"^(\d{1,4})[./-](\d{1,2})[./-](\d{2,4})[T ,]*(.*)$")
    first, second = (pd.to_numeric(parts[place], errors="coerce") for place in (0, 1))
    sign = next((match[1] for value in text[:1] if (match := re.match(r"\d+([./-])", value))), ".")
    if (first > 31).any():
        order = [0, 1, 2]
    elif sign == "." or (first > 12).any():
        order = [2, 1, 0]
    elif (second > 12).any():
        order = [2, 0, 1]
    else:
        example = text.iloc[0]
        raise InputError(
            path, f"column {name}", f"{example!r} may be day/month or month/day", "write dates as ISO 8601"
        )
    short = pd.to_numeric(parts[order[0]], errors="coerce")
    century = short.ge(TWO_DIGITS_FROM).map({True: "19", False: "20"})
    year = parts[order[0]].where(parts[order[0]].str.len() == 4, century + parts[order[0]])
    joined = year + "-" + parts[order[1]].str.zfill(2) + "-" + parts[order[2]].str.zfill(2)
    clock = _of_24_hours(parts[3].fillna(""))
    joined = joined.where(clock == "", joined + "T" + clock)
    return pd.to_datetime(joined, format="ISO8601", utc=True, errors="coerce")


def _of_24_hours(clock: pd.Series[Any]) -> pd.Series[Any]:
    """Times of day; some may end with AM or PM."""
    parts = clock.str.extract(r"^\s*(\d{1,2})(:\S*)\s*([AaPp])\.?\s?[Mm]\.?\s*$")
    hours = pd.to_numeric(parts[0], errors="coerce") % 12 + 12 * parts[2].str.lower().eq("p")
    halved = hours.fillna(0).astype(int).astype(str).str.zfill(2) + parts[1].fillna("")
    return clock.where(parts[0].isna(), halved)


def _seconds(moments: pd.Series[Any], offset_s: float) -> Array:
    values = (moments - pd.Timestamp(0, tz="UTC")) / pd.Timedelta(seconds=1)
    return np.asarray(values.to_numpy(dtype=float) - offset_s)


def _numbers(column: pd.Series[Any], comma: bool) -> Array | None:
    """Values (rows,) of a column, nan where it has none; None of a column of words."""
    if pd.api.types.is_numeric_dtype(column):
        values = column.to_numpy(dtype=float)
    else:
        text = column.astype(str).str.strip()
        values = pd.to_numeric(text.str.replace(",", ".", regex=False) if comma else text, errors="coerce").to_numpy(
            float
        )
        if np.isfinite(values).sum() < 0.5 * len(values):
            values = np.array([_angle(cell) for cell in text])
    return values if np.isfinite(values).any() else None


def _angle(text: str) -> float:
    """Degrees of an angle in degrees and minutes, with the letter of its hemisphere; nan if it is none."""
    match = _DEGREES_MINUTES.match(text)
    if match is None:
        return float("nan")
    parts = [float(match[name].replace(",", ".")) if match[name] else 0.0 for name in ("minutes", "seconds")]
    degrees = float(match["degrees"])
    size = abs(degrees) + parts[0] / 60 + parts[1] / 3600
    south = (match["front"] or match["back"] or "") in ("S", "W")
    return -size if south or match["degrees"].startswith("-") else size
