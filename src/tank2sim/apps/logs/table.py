"""Logs in any CSV: commas, semicolons or tabs; decimal commas; a row of units; dates, local times, epochs."""

from __future__ import annotations

import csv
import itertools
import re
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tank2sim.apps.logs.clock import DOUBLED_STEPS, TWO_DIGITS_FROM
from tank2sim.apps.logs.quantities import QUANTITIES, quantity_of_name, unit_of_signal_k
from tank2sim.apps.logs.streams import LogFinding, LogStream, VesselLog
from tank2sim.arrays import Array
from tank2sim.errors import InputError
from tank2sim.records.spelt_units import split_unit
from tank2sim.records.text_layout import WHITESPACE, TextLayout, decoded_text, text_layout

if TYPE_CHECKING:
    import pandas as pd

_ZONES_H = {"utc": 0, "gmt": 0, "z": 0, "mez": 1, "cet": 1, "mesz": 2, "cest": 2, "wet": 0, "west": 1, "bst": 1}
_ZONES_H |= {"eet": 2, "eest": 3, "msk": 3, "sgt": 8, "hkt": 8, "jst": 9, "kst": 9, "aest": 10, "nzst": 12}
_ZONES_H |= {"est": -5, "edt": -4, "cst": -6, "cdt": -5, "mst": -7, "mdt": -6, "pst": -8, "pdt": -7}
"""Hours of time zones before UTC, by the abbreviations that names of columns use (IANA time zone database)."""

_TIME_WORDS = re.compile(
    r"\b(time|times|timestamp|zeit|uhrzeit|zeitstempel|utc|datetime|epoch|stamp|heure|horodatage|hora|ora|tijd|tijdstip"
    r"|tid|tidspunkt|czas|tempo|aika|zaman|saat|t|secs|seconds)\b"
)
_DATE_WORDS = re.compile(r"\b(date|datum|day|tag|fecha|data|dato|paivamaara|tarih)\b")
_DATE = re.compile(r"\d{1,4}[./-]\d{1,2}[./-]\d{1,4}")
_EPOCHS = ((1e8, 1e10, 1.0), (1e11, 1e13, 1e-3), (1e14, 1e16, 1e-6), (1e17, 1e19, 1e-9))
"""Least and largest size of an epoch in s, ms, us and ns since 1970 (years 1973 to 2286), and its factor to seconds."""

_DAYS = ((36_526.0, 51_544.0, 25_569.0), (730_486.0, 745_504.0, 719_529.0))
"""Days of the years 2000 to 2040, and the day of 1970-01-01: of spreadsheets since 1899-12-30, of MATLAB (datenum)."""

_LONGEST_IN_DAYS = 31.0
"""Longest log whose times are taken for days. Project choice: seconds of so large a number count from a beginning, and
then differ by more."""

_FIRST_DAY, _LAST_DAY = 19800101, 21001231
"""Least and largest date yyyymmdd. Project choice: GPS time begins in 1980."""

_CLOCK_DIGITS = 3
"""Least number of different seconds of a minute of a clock in digits. Project choice: counts by 50 have two."""

_COUNTS = (
    (r"ms|msec|milli\w*", 1e-3),
    (r"us|usec|micro\w*", 1e-6),
    (r"ns|nano\w*", 1e-9),
    (r"min|mins|minutes?", 60.0),
    (r"h|hr|hrs|hours?", 3600.0),
    (r"s|sec|secs|seconds?", 1.0),
)
"""Words for the unit in which a column counts time, and its seconds."""

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

    Raises
    ------
    InputError
        The file cannot be read, or has no rows or no time.
    """
    import pandas as pd

    layout, encoding = _layout(path)
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
    rows = len(frame)
    with path.open("rb") as file:
        body = itertools.islice(file, layout.skip, None)
        skipped = max(0, sum(1 for line in body if line.strip() and not line.startswith(b"#")) - rows)
    findings = [LogFinding("note", f"{skipped} rows have too many cells and are left out")] if skipped else []
    if any(issubclass(each.category, pd.errors.ParserWarning) for each in warned):
        findings.append(
            LogFinding("note", f"rows have cells beyond the {len(layout.names)} columns; they are not read")
        )
    time, dated, used = _time(path, frame, layout, findings)
    if not np.isfinite(time).any():
        name = sorted(used, key=list(frame.columns).index)[-1]
        first = _first_cell(frame[name])
        remedy = "write ISO 8601 times, as 2024-05-04T09:30:00.2Z, or seconds since 1970"
        raise InputError(path, f"column {name}", f"holds no time that can be read, as {first[:40]!r}", remedy)
    values = frame.drop(columns=list(used))
    by_signal = _by_signal(values, time)
    spread = None if by_signal else _spread(time, values)
    if spread is not None:
        time, each = spread
        name = sorted(used, key=list(frame.columns).index)[-1]
        text = f"{name} has {each} rows at each time (median): they are spread evenly between them"
        findings.append(LogFinding("note", text, name, {"rows": each}))
    else:
        new = ~frame.duplicated().to_numpy()
        frame, time, values = frame[new], time[new], values[new]
        by_signal = _by_signal(values, time)
    streams = by_signal or [
        _stream(name, unit, time, numbers)
        for name, unit in zip(layout.names, layout.units, strict=True)
        if name not in used and (numbers := _numbers(frame[name], layout.comma)) is not None
    ]
    if not streams:
        raise InputError(path, "", "has no column of numbers next to its time", "give a table of measured values")
    counts = {"rows": rows, "repeated_rows": rows - len(frame), "skipped": skipped}
    counts["without_time"] = int(np.isnan(time).sum())
    return VesselLog(path, "CSV", tuple(streams), counts, tuple(findings), dated)


def _by_signal(frame: pd.DataFrame, time: Array) -> list[LogStream]:
    """Streams of a table with a column of signal names, :data:`_ROWS_OF_A_SIGNAL` rows of each or more; else none."""
    import pandas as pd

    numeric = [name for name in frame.columns if pd.api.types.is_numeric_dtype(frame[name])]
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
    moves = False
    for _, column in values.select_dtypes("number").items():
        numbers = column.to_numpy(dtype=float)
        inside = np.abs(np.diff(numbers))[np.diff(runs) == 0]
        outside = np.nanmedian(np.abs(np.diff(numbers[begins]))) if np.isfinite(np.diff(numbers[begins])).any() else 0.0
        inside = inside[np.isfinite(inside)]
        if len(inside) and np.median(inside) > DOUBLED_STEPS * outside > 0:
            return None
        moves = moves or (len(inside) > _MOST * (len(time) - len(counts)) and bool(inside.any()))
    if not moves:
        return None
    steps = np.diff(time[begins])
    step = float(np.median(steps))
    lengths = np.append(np.minimum(steps, 2 * step), step)
    full = np.maximum(counts, each * (np.arange(len(counts)) % (len(counts) - 1) == 0))  # the first and last are cut
    place = np.arange(len(time)) - begins[runs] + np.where(runs == 0, full[0] - counts[0], 0)
    return time + place * (lengths / full)[runs], each


def _stream(name: str, unit: str, time: Array, values: Array) -> LogStream:
    """A column with the quantity that its name suggests, unless its unit is of another kind."""
    quantity = quantity_of_name(name)
    unit = unit or split_unit(name)[1] or unit_of_signal_k(name, quantity)
    if quantity and unit and unit not in QUANTITIES[quantity].units:
        quantity = ""
    return LogStream(name, time, values, unit, quantity, "name" if quantity else "")


def _layout(path: Path) -> tuple[TextLayout, str]:
    """Layout by the beginning of the file, and its encoding."""
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD_BYTES)
    except OSError as error:
        raise InputError(path, "", f"cannot be read ({error.strerror})", "check the name and its permissions") from None
    text, encoding = decoded_text(head, complete=False)
    lines = text.splitlines()
    if len(head) == _HEAD_BYTES and len(lines) > 1:
        lines.pop()  # a part of a line
    return text_layout(path, lines), encoding


def _time(
    path: Path, frame: pd.DataFrame, layout: TextLayout, findings: list[LogFinding]
) -> tuple[Array, bool, set[str]]:
    """Times (rows,), whether they are UTC, and the columns that they are made of."""
    import pandas as pd

    named = [name for name in frame.columns if _TIME_WORDS.search(_plain(name))]
    dates = [
        name
        for name in frame.columns
        if _DATE_WORDS.search(_plain(name))
        and name not in named
        and (_DATE.match(_first_cell(frame[name])) or _days_of_numbers(frame[name]) is not None)
    ]
    clocks = [name for name in frame.columns if name not in (*named, *dates) and _looks_like_time(frame[name])]
    for name in [*named, *dates, *clocks, *frame.columns[:1]]:
        column = _as_numbers(frame[name])
        if pd.api.types.is_numeric_dtype(column):
            values = column.to_numpy(dtype=float)
            counted = _stated_count(name, layout) is not None
            if not counted and name not in dates and (clock := _clock_of_numbers(values)) is not None:
                if not dates:
                    continue
                day = _days(path, dates[0], frame[dates[0]], _zone_s(name, findings))
                return day + clock, True, {name, dates[0]}
            seconds = _epoch_seconds(name, values, findings)
            if seconds is not None:
                return seconds, True, {name, *dates}
            continue
        first = _first_cell(column)
        offset = _zone_s(name, findings)
        if re.match(r"\d{4}-\d\d-\d\d[T ]\d", first):
            return (
                _seconds(pd.to_datetime(column, format="ISO8601", utc=True, errors="coerce"), offset),
                True,
                {name, *dates},
            )
        if re.match(r"\d{1,4}[./-]\d{1,2}[./-]\d{2,4}[T ,]+\d", first):
            return _seconds(_dates(path, name, column), offset), True, {name}
        if dates and re.match(r"\d{1,2}:\d\d", first):
            return _days(path, dates[0], frame[dates[0]], offset) + _clock(column), True, {name, dates[0]}
    return _undated_time(path, frame, layout, [named, clocks], findings)


def _undated_time(
    path: Path, frame: pd.DataFrame, layout: TextLayout, columns: list[list[str]], findings: list[LogFinding]
) -> tuple[Array, bool, set[str]]:
    """Times (rows,) without a date: of the day, or a count; else as :func:`_time`. `columns`: by names and by cells."""
    import pandas as pd

    named, clocks = columns
    for name in [*named, *clocks, *frame.columns[:1]]:
        column = _as_numbers(frame[name])
        of_day = _clock(column) if re.match(r"\d{1,2}:\d\d", _first_cell(column)) else None
        if pd.api.types.is_numeric_dtype(column) and _stated_count(name, layout) is None:
            of_day = _clock_of_numbers(column.to_numpy(dtype=float))
        if of_day is not None:
            text = f"{name} has times of day without a date: the trials have no date"
            findings.append(LogFinding("note", text, name))
            return _over_midnight(of_day), False, {name}
    for name in named or list(frame.columns[:1]):
        column = _as_numbers(frame[name])
        if pd.api.types.is_numeric_dtype(column):
            values = column.to_numpy(dtype=float)
            steps = np.diff(values[np.isfinite(values)])
            if len(steps) and (steps >= 0).mean() > 0.9:
                text = f"{name} counts from the beginning of the log: the trials have no date"
                findings.append(LogFinding("note", text, name))
                scale = _stated_count(name, layout) or _count_by_motion(name, values, frame, findings)
                return values * scale, False, {name}
    problem = "it is not a log of a known format, and as a table there is no column of time"
    remedy = "give a column of ISO 8601 times, of date and time, or of seconds"
    raise InputError(path, "header", problem, remedy)


def _epoch_seconds(name: str, values: Array, findings: list[LogFinding]) -> Array | None:
    """Seconds (rows,) since 1970 of numbers that count s, ms, us or ns since then, or days; None if they do not."""
    known = values[np.isfinite(values)]
    size = float(np.median(np.abs(known))) if len(known) else 0.0
    for least, largest, factor in _EPOCHS:
        counts = least <= size <= largest and np.percentile(known, _BEGINNING) >= least
        if counts and (len(known) < 2 or np.median(np.diff(known)) * factor < _SLOWEST_STEP_S):
            return values * factor
    moments = _moments_of_numbers(values)
    if moments is not None:
        return moments - _zone_s(name, findings)
    for least, largest, day in _DAYS:
        if least <= size <= largest and np.nanmax(values) - np.nanmin(values) < _LONGEST_IN_DAYS:
            return (values - day) * 86400 - _zone_s(name, findings)
    return None


def _as_numbers(column: pd.Series[Any]) -> pd.Series[Any]:
    """A column of numbers with another decimal sign than the rest of the table as numbers; any other as it is."""
    import pandas as pd

    if pd.api.types.is_numeric_dtype(column) or not re.fullmatch(r"\s*-?\d+[.,]\d+\s*", _first_cell(column)):
        return column
    return pd.to_numeric(column.astype(str).str.replace(",", ".", regex=False), errors="coerce")


def _looks_like_time(column: pd.Series[Any]) -> bool:
    """Whether the first cell of a column is a date with a time, or a time of day."""
    return bool(re.match(rf"({_DATE.pattern}[T ,]+)?\d{{1,2}}:\d\d", _first_cell(column)))


def _first_cell(column: pd.Series[Any]) -> str:
    return next((str(value) for value in column.dropna()[:1]), "")


def _stated_count(name: str, layout: TextLayout) -> float | None:
    """Seconds of the unit in which a column counts by its name or its unit; None where neither says."""
    words = _plain(f"{name} {layout.units[layout.names.index(name)]}")
    return next((factor for pattern, factor in _COUNTS if re.search(rf"\b({pattern})\b", words)), None)


def _count_by_motion(name: str, values: Array, frame: pd.DataFrame, findings: list[LogFinding]) -> float:
    """Seconds of the unit in which a column counts, by the speed of the track, or else by the step."""
    step = float(np.median(np.diff(values[np.isfinite(values)])))
    if step < _DOUBTFUL_STEP:
        return 1.0
    speed = _track_speed(values, frame)
    if not speed:  # no positions, or the receiver was at rest
        slow = _turns_too_slowly(values, frame)
        if not slow and step < _SLOWEST_STEP_S - 1e-3:
            return 1.0
        rows = f"a row in {step:.4g} s shows no manoeuvre"
        why = "the heading would turn by less than any vessel" if slow else rows
        text = f"{name} states no unit, and {why}: it is taken to count ms"
        findings.append(LogFinding("fault", text, name))
        return 1e-3
    factor = next((factor for factor in (1.0, 1e-3, 1e-6, 1e-9) if speed > _SLOWEST_MPS * factor), 1.0)
    if factor < 1:
        text = f"{name} states no unit; in s the vessel would make {speed:.2g} m/s, so it counts in {factor:g} s"
        findings.append(LogFinding("note", text, name, {"unit_s": factor}))
    return factor


def _turns_too_slowly(values: Array, frame: pd.DataFrame) -> bool:
    """Whether a heading (deg) turns so slowly, with the time in s, that the time is in a smaller unit."""
    columns = {quantity_of_name(name): name for name in frame.columns}
    if "heading" not in columns or (heading := _numbers(frame[columns["heading"]], False)) is None:
        return False
    known = np.isfinite(heading) & np.isfinite(values)
    turned, steps = np.unwrap(heading[known], period=360), np.diff(values[known])
    if len(steps) < _ROWS_OF_A_SIGNAL or np.ptp(turned) < _LEAST_TURNED_DEG or not (steps > 0).any():
        return False
    rates = np.abs(np.diff(turned))[steps > 0] / steps[steps > 0]
    return float(np.percentile(rates, 99)) < _SLOWEST_TURN_DEGPS


def _track_speed(values: Array, frame: pd.DataFrame) -> float | None:
    """Speed of the positions of a table, 95th percentile, m in the unit of its time; None without positions."""
    columns = {quantity_of_name(name): name for name in frame.columns}
    for north, east, metres in (("latitude", "longitude", 111_000.0), ("x", "y", 1.0)):
        if north in columns and east in columns:
            a, b = (_numbers(frame[columns[name]], False) for name in (north, east))
            if a is None or b is None:
                continue
            shrink = float(np.cos(np.radians(np.nanmedian(a)))) if metres > 1 else 1.0
            way = metres * np.hypot(np.diff(a), shrink * np.diff(b))
            step = np.diff(values)
            good = np.isfinite(way) & (step > 0)
            return float(np.percentile(way[good] / step[good], 95)) if good.any() else None
    return None


def _clock_of_numbers(values: Array) -> Array | None:
    """Seconds of the day (rows,) of hhmmss[cc|mmm] or fractions of a day; None of a count, whose digits go on to 99."""
    known = values[np.isfinite(values)]
    if len(known) < _ROWS_OF_A_SIGNAL or known.min() < 0 or np.ptp(known) == 0:
        return None
    if known.max() <= 1:
        return np.asarray(values * 86400)
    for scale in (1.0, 1e-2, 1e-3):
        digits = values * scale
        seconds, minutes = digits % 100, digits // 100 % 100
        if known.max() * scale < 240000 and np.nanmax(seconds) < 60 and np.nanmax(minutes) < 60:
            crosses = np.ptp(known * scale // 100) > 0 and len(np.unique(known * scale % 100 // 1)) >= _CLOCK_DIGITS
            return np.asarray(digits // 10000 * 3600 + minutes * 60 + seconds) if crosses else None
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


def _days_of_numbers(column: pd.Series[Any]) -> Array | None:
    """Seconds (rows,) since 1970 of dates yyyymmdd, ddmmyy (as in NMEA 0183) or yymmdd, or of spreadsheets."""
    import pandas as pd

    if not pd.api.types.is_numeric_dtype(column):
        return None
    values = column.to_numpy(dtype=float)
    size = float(np.nanmedian(values)) if np.isfinite(values).any() else 0.0
    least, largest, day = _DAYS[0]
    if _FIRST_DAY <= size <= _LAST_DAY:
        return _calendar_days(values)
    if size > 991299 or size < 10100:
        return None
    first, middle, last = values // 10000, values // 100 % 100, values % 100
    forwards = [first, middle, last] if "yymmdd" in str(column.name).lower() else [last, middle, first]
    for year, month, date in (forwards, forwards[::-1]):
        full = year + np.where(year >= TWO_DIGITS_FROM, 1900, 2000)
        if (days := _calendar_days(full * 10000 + month * 100 + date)) is not None:
            return days
    return (values - day) * 86400 if least <= size <= largest else None


def _calendar_days(values: Array) -> Array | None:
    """Seconds (rows,) since 1970 of dates yyyymmdd; None unless all are."""
    import pandas as pd

    known = np.isfinite(values)
    text = pd.Series(values[known]).astype(int).astype(str)
    moments = pd.to_datetime(text, format="%Y%m%d", utc=True, errors="coerce")
    out = np.full(len(values), np.nan)
    out[known] = _seconds(moments, 0.0)
    return out if known.any() and not moments.isna().any() else None


def _days(path: Path, name: str, column: pd.Series[Any], offset_s: float) -> Array:
    """Seconds (rows,) since 1970 of a column of dates in text or numbers."""
    numbers = _days_of_numbers(column)
    return _seconds(_dates(path, name, column), offset_s) if numbers is None else numbers - offset_s


def _plain(name: str) -> str:
    return re.sub(r"[^a-z0-9]+", " ", re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name).lower()).strip()


def _clock(column: pd.Series[Any]) -> Array:
    """Seconds (rows,) of times of day, of which some may end with AM or PM."""
    import pandas as pd

    text = _of_24_hours(column.astype(str).str.strip().str.replace(",", ".", regex=False))
    text = text.where(text.str.count(":") > 1, text + ":00")
    seconds: Array = pd.to_timedelta(text, errors="coerce").dt.total_seconds().to_numpy(dtype=float)
    return seconds


def _over_midnight(clock: Array) -> Array:
    """Times of day, s, that go on over midnight."""
    known = np.isfinite(clock)
    days = np.cumsum(np.diff(clock[known], prepend=clock[known][:1]) < -43200)
    out = np.array(clock)
    out[known] += 86400 * days
    return out


def _dates(path: Path, name: str, column: pd.Series[Any]) -> pd.Series[Any]:
    """Dates with numbers for months; points and a year at the end put the day first, as ISO 8601 the year."""
    import pandas as pd

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
    """Times of day of which some may end with AM or PM."""
    import pandas as pd

    parts = clock.str.extract(r"^\s*(\d{1,2})(:\S*)\s*([AaPp])\.?\s?[Mm]\.?\s*$")
    hours = pd.to_numeric(parts[0], errors="coerce") % 12 + 12 * parts[2].str.lower().eq("p")
    halved = hours.fillna(0).astype(int).astype(str).str.zfill(2) + parts[1].fillna("")
    return clock.where(parts[0].isna(), halved)


def _seconds(moments: pd.Series[Any], offset_s: float) -> Array:
    import pandas as pd

    values = (moments - pd.Timestamp(0, tz="UTC")) / pd.Timedelta(seconds=1)
    return np.asarray(values.to_numpy(dtype=float) - offset_s)


def _zone_s(name: str, findings: list[LogFinding]) -> float:
    """Seconds that the clock of a column is before UTC, by its name."""
    if match := re.search(r"(?:utc|gmt)\s*([+-]\d{1,2})(?::?(\d\d))?", name, re.IGNORECASE):
        hours = int(match[1]) + (int(match[2] or 0) / 60) * (-1 if match[1][0] == "-" else 1)
        return 3600.0 * hours
    for word in _plain(name).split():
        if word in _ZONES_H:
            return 3600.0 * _ZONES_H[word]
    if re.search(r"\b(local|lt|ortszeit|bordzeit)\b", _plain(name)):
        text = f"{name} is a local time of unknown zone, and is taken as UTC"
        findings.append(LogFinding("fault", text, name))
    return 0.0


def _numbers(column: pd.Series[Any], comma: bool) -> Array | None:
    """Values (rows,) of a column, nan where it has none; None of a column of words."""
    import pandas as pd

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
