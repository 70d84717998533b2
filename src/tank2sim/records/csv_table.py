"""Tables of numbers from CSV files, with comment lines, and rows of numbers as other laboratories write them.

A table is one header line and rows of numbers, separated by commas; or by semicolons or tabs, with points or decimal
commas; or the first sheet of a spreadsheet. An empty cell is a value not recorded. Lines that begin with ``#`` are
comments; ``# key: value`` with a single word before the colon can be looked up by its key.
"""

from __future__ import annotations

import csv
import difflib
import re
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn, TypeGuard

import numpy as np
from numpy.typing import NDArray

from tank2sim.arguments import bounds_of
from tank2sim.arrays import Array
from tank2sim.errors import InputError
from tank2sim.files import read_all_bytes, read_text
from tank2sim.records.text_layout import rows_of_text
from tank2sim.records.workbook import is_workbook, workbook_text
from tank2sim.units import to_si

if TYPE_CHECKING:
    import pandas as pd

_KEY = re.compile(r"([A-Za-z_][\w.-]*)\s*:(?!//)\s*(.*)", re.DOTALL)  # not the colon of https://
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_OF_NUMBERS = b"0123456789eE+-., \t\n"
_BLOCK = 1 << 22  # Characters of a file that are read at once: memory then goes with its numbers, not with its text
_FIRST_ROW = re.compile(r"^[^\S\n]*[^\s#].*$|\Z", re.MULTILINE)
_BLANK = re.compile("[ \t]")
_EMPTY_CELL = re.compile(r"(?<![^,\n])(?=[,\n])", re.ASCII)
_QUOTED_LENGTH = 30

SHORTEST_STEP = 1e-9
"""Least step of a quantity that must rise from row to row (a time, s): below, two rows are one, and slopes are noise of
the last digit. Project choice, a thousand times faster than any gauge is read."""
LARGEST = 1e15
"""Largest size of a number that a record may hold, in the unit of its column. No length, time, force or count of a
ship is near it (an epoch is 1.8e9 s, or 1.8e12 ms), and squares and products of what is below stay far inside the
range of a float. Project choice: a float this large still resolves 0.1."""

_RESEMBLES = 0.8
"""Likeness (difflib) from which a comment key is taken for a misspelt one: one letter of four, ``nois`` or ``nosie``
for ``noise``, while ``note`` and ``source`` stay free text. Project choice."""
_ALMOST_KEY = re.compile(r"([A-Za-z_][\w.-]*(?:[ \t]+[A-Za-z_][\w.-]*)?)\s*[:=](?!//)")  # two words, or an equals sign


@dataclass(frozen=True, eq=False)
class CsvTable:
    """Columns of numbers as in a file.

    Parameters
    ----------
    path : Path
        The file, or the name of a data frame.
    columns : dict
        Name to values, (rows,), nan where a cell is empty.
    lines : array of int, (rows,)
        Line of the file (from 1) of each row; of a data frame its row (from 0).
    comments : dict
        Key to text of the lines ``# key: text``; the texts of a repeated key are joined by line breaks.
    remarks : tuple of str
        The other comment lines.
    headings : dict
        Name of a column to what it is called in the file, where :meth:`si` has renamed it.
    counts : str
        Unit of `lines` in messages.
    """

    path: Path
    columns: dict[str, Array]
    lines: NDArray[np.int64]
    comments: dict[str, str] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()
    headings: dict[str, str] = field(default_factory=dict)
    counts: str = "line"

    def heading(self, name: str) -> str:
        """Name of a column in the file."""
        return self.headings.get(name, name)

    def place(self, row: int, name: str) -> str:
        """Where the cell of a `row` is, for messages: ``line 12, column psi_deg``."""
        return f"{self.counts} {self.lines[row]}, column {self.heading(name)}"

    def fault(self, place: str, problem: str, remedy: str) -> InputError:
        """An error about this table, to be raised: its place, the problem, and the remedy."""
        return InputError(self.path, place, problem, remedy)

    def column(self, name: str) -> Array:
        """Values of a column, (rows,).

        Raises InputError: The column does not exist.
        """
        if name not in self.columns:
            present = ", ".join(self.heading(other) for other in self.columns)
            raise self.fault("header", f"there is no column {name}", f"add it; the columns are {present}")
        return self.columns[name]

    def increasing(self, name: str) -> Array:
        """Values of a column, (rows,), that must be there in each row and rise from row to row (a time).

        Raises InputError: The column does not exist, a cell of it is empty, or it does not rise; the message names the
        first such row.
        """
        values = self.filled_column(name)
        falls = np.flatnonzero(np.diff(values) < SHORTEST_STEP)
        if falls.size:
            row = int(falls[0]) + 1
            problem = f"{values[row]:.10g} does not come after {values[row - 1]:.10g} of the row before"
            raise self.fault(self.place(row, name), problem, "sort the rows, and give each value once")
        return values

    def filled_column(self, name: str, remedy: str = "give each row its value") -> Array:
        """Values of a column without empty cells, (rows,).

        Raises InputError: The column does not exist, or a cell is empty: the message ends with `remedy`.
        """
        values = self.column(name)
        empty = np.flatnonzero(np.isnan(values))
        if empty.size:
            raise self.fault(self.place(int(empty[0]), name), "is empty", remedy)
        return values

    def bounded_comment(self, key: str, kind: object) -> float | None:
        """The number in the comment line ``# key: number``; None without such a line.

        `kind`: Type with bounds, of :mod:`tank2sim.quantities`. Raises InputError: As :meth:`comment_number`, or it is
        out of its bounds.
        """
        value, bounds = self.comment_number(key), bounds_of(kind)
        if value is not None and bounds is not None and not bounds.hold(value):
            raise self.fault(f"comment {key}", f"is {value:g}", f"{bounds.words} was expected")
        return value

    def bounded_comments(self, kinds: Mapping[str, object]) -> dict[str, float]:
        """Numbers of the comments that the file has, by key. `kinds`: Key to its type. Raises as
        :meth:`bounded_comment`."""
        return {key: value for key, kind in kinds.items() if (value := self.bounded_comment(key, kind)) is not None}

    def comment_number(self, key: str) -> float | None:
        """The finite number in the comment line ``# key: number``; None without such a line.

        Raises InputError: Its text is not a number, or the line is given twice.
        """
        if key not in self.comments:
            return None
        text = self.comments[key].strip()
        number = _number(text)
        if number is None:
            problem = f"{_quoted(text)} is not a number" if "\n" not in text else "is given more than once"
            raise self.fault(f"comment {key}", problem, f"write one line such as '# {key}: 11.63'")
        if abs(number) > LARGEST:
            problem = f"{_quoted(text)} is too large"
            raise self.fault(f"comment {key}", problem, f"at most {LARGEST:g} can be")
        return number

    def refuse_misspelt_keys(self, known: Sequence[str]) -> None:
        """Refuse a comment line whose key resembles one of the known keys but is none; free text is let through.

        Raises InputError: There is such a line; the message states the right spelling.
        """
        keys = [(key, f"# {key}:") for key in self.comments if key not in known]
        matches = (_ALMOST_KEY.match(remark) for remark in self.remarks)
        keys += [(match[1], f"# {match[0]}") for match in matches if match]
        spellings = {key.lower(): key for key in known}
        for key, shown in keys:
            plain = re.sub(r"[\s.-]+", "_", key.strip().lower())
            near = difflib.get_close_matches(plain, spellings, n=1, cutoff=_RESEMBLES)
            if near:
                problem = f"{_quoted(shown)} resembles a key and is none"
                raise self.fault(f"comment {key}", problem, f"write '# {spellings[near[0]]}: ...'")

    def si(self) -> CsvTable:
        """The table in SI and radians, its columns renamed by :func:`tank2sim.units.to_si` (psi_deg to psi_rad).

        Raises InputError: Two columns are one quantity in two units.
        """
        columns: dict[str, Array] = {}
        headings: dict[str, str] = {}
        for name, values in self.columns.items():
            si_name, factor = to_si(name, 1.0)
            if si_name in columns:
                both = f"columns {headings[si_name]} and {self.heading(name)}"
                raise self.fault(both, "are one quantity in two units", "delete one of them")
            columns[si_name] = values if factor == 1.0 else values * factor
            headings[si_name] = self.heading(name)
        return replace(self, columns=columns, headings=headings)


def is_frame(given: object) -> TypeGuard[pd.DataFrame]:
    """Whether something is a data frame; pandas is not imported for it."""
    pandas = sys.modules.get("pandas")
    return pandas is not None and isinstance(given, pandas.DataFrame)


def table_or_path(given: pd.DataFrame | str | Path, name: str) -> CsvTable | Path:
    """Return what :func:`read_table` takes: the table of a data frame, or a path. Raises as :func:`table_of_frame`."""
    return table_of_frame(given, name) if is_frame(given) else Path(given)


def tables_or_paths(
    given: pd.DataFrame | str | Path | Iterable[pd.DataFrame | str | Path], name: str
) -> list[CsvTable | Path]:
    """Return one source, or several, as :func:`table_or_path` does."""
    if isinstance(given, str | Path) or is_frame(given):
        return [table_or_path(given, name)]
    return [table_or_path(source, f"{name}[{number}]") for number, source in enumerate(given)]


def table_of_frame(frame: pd.DataFrame, name: str) -> CsvTable:
    """Return the table of a data frame; its ``attrs`` are the comments of a file, and a named index is a column.

    `frame`: Numbers; columns are named as in a file. `name`: Name in messages and results, where a file has its path.

    Raises InputError: It has no rows, a column is given twice, or holds anything but finite numbers and gaps.
    """
    if frame.index.name and frame.index.name not in frame.columns:
        frame = frame.reset_index()
    path, columns = Path(name), {}
    if frame.empty:
        raise InputError(path, "", "has no rows or no columns", "give a data frame with the measured values")
    for number, column in enumerate(frame.columns):
        place = f"column {column}"
        if str(column) in columns:
            raise InputError(path, place, "is given twice", "delete or rename one of them")
        series = frame.iloc[:, number]
        if series.dtype.kind not in "iuf":
            raise InputError(path, place, "does not hold numbers", "convert it to numbers, NaN where nothing was read")
        values = series.to_numpy(dtype=float, na_value=np.nan)
        if too_large := np.flatnonzero(np.abs(values) > LARGEST).tolist():
            problem = f"{values[too_large[0]]:g} is too large"
            raise InputError(path, f"row {too_large[0]}, {place}", problem, f"at most {LARGEST:g} was expected")
        columns[str(column)] = values
    comments = {str(key): str(value) for key, value in frame.attrs.items()}
    return CsvTable(path, columns, np.arange(len(frame)), comments, counts="row")


def read_table(path: Path | str | CsvTable) -> CsvTable:
    """Read a CSV table of numbers; a table is returned unchanged.

    A byte order mark, CRLF, blank lines, and spaces around names and numbers do not matter. A header with semicolons or
    tabs and no commas shows the separator; decimals may then have commas. The first sheet of a spreadsheet (``.xlsx``)
    is read, whose rows are the lines of messages.

    Raises InputError: The file is missing or not UTF-8; there is no header, a column has no name or the name of
    another; there are no rows; a row has too many or too few cells; a cell is not a finite number in digits and a
    decimal sign; a file has points and decimal commas.
    """
    if isinstance(path, CsvTable):
        return path
    path = Path(path)
    text = text_with_commas(path, _table_text(path))
    plain = _plain_table(path, text)
    if plain is not None:
        return plain
    stripped = [line.strip() for line in text.split("\n")]
    rows = rows_of_text(stripped)
    if not rows:
        raise InputError(path, "", "there is no header", "begin with a line of column names, such as t_s,u_mps")
    names = _header(path, *rows[0])
    lines = np.array([number for number, _ in rows[1:]], dtype=np.int64)
    table = table_of_rows(path, names, [row for _, row in rows[1:]], lines)
    comments, remarks = _comments([line for line in stripped if line.startswith("#")])
    return replace(table, comments=comments, remarks=remarks)


def _table_text(path: Path) -> str:
    """Text of a table, of a spreadsheet as comma-separated lines; raises as :func:`read_table`."""
    try:
        if path.is_file():
            with path.open("rb") as file:
                if is_workbook(file.read(4)):
                    return workbook_text(path)
    except OSError:
        pass  # said by read_text
    return read_text(path)


def text_with_commas(path: Path, text: str) -> str:
    """The text with commas between cells and points in numbers, if its header has semicolons or tabs instead.

    Raises InputError: There are points in numbers, and decimal commas.
    """
    header = next(_FIRST_ROW.finditer(text))[0]  # empty in a text without rows
    separator = ";" if ";" in header else "\t"
    if separator not in header or "," in header:
        return text
    lines = text.split("\n")
    body = rows_of_text(lines)
    point = next((number for number, line in body[1:] if "." in line), None)
    if point is not None and any("," in line for _, line in body):
        remedy = "write numbers with one decimal sign and nothing between thousands"
        raise InputError(path, f"line {point}", "has a point, and other numbers have decimal commas", remedy)
    written = str.maketrans({",": ".", separator: ","})
    for number, line in body:
        lines[number - 1] = line.translate(written)
    return "\n".join(lines)


def _plain_table(path: Path, text: str) -> CsvTable | None:
    """The table of a text of comments, a header and rows of numbers alone; None if anything at all is unusual."""
    begin, preamble = 0, []
    while (end := text.find("\n", begin)) >= 0 and (line := text[begin:end].strip()).startswith("#"):
        preamble.append(line)
        begin = end + 1
    if end < 0 or not line:
        return None
    names = _header(path, len(preamble) + 1, line)
    values = _read_fast(text, len(names), end + 1)
    if values is None or not values.size:
        return None
    first = len(preamble) + 2
    lines = np.arange(first, first + values.shape[1], dtype=np.int64)
    comments, remarks = _comments(preamble)
    return CsvTable(path, dict(zip(names, values, strict=True)), lines, comments, remarks)


def table_of_rows(path: Path, names: Sequence[str], rows: Sequence[str], lines: NDArray[np.int64]) -> CsvTable:
    """Table of rows with commas between cells and points in numbers.

    `path`: For messages. `names`: Names of the columns. `rows`: Lines of values. `lines` (rows,): Line of the file of
    each row.

    Raises InputError: There are no rows; a row has too many or too few cells; a cell is not a finite number.
    """
    if not rows:
        raise InputError(path, "", "there are no rows under the header", "add the measured values")
    values = _read_fast("\n".join(rows), len(names))
    if values is None:
        values = np.ascontiguousarray(_read_with_care(path, names, rows, lines).T)
    return CsvTable(path, dict(zip(names, values, strict=True)), lines)


def _header(path: Path, number: int, line: str) -> list[str]:
    place = f"line {number}"
    names = _cells(path, place, line)
    if any(_number(name) is not None for name in names):
        problem = "there is no header: the first line has numbers"
        raise InputError(path, place, problem, "put a line of column names above it, such as t_s,u_mps")
    for position, name in enumerate(names, start=1):
        if not name:
            raise InputError(path, place, f"column {position} has no name", "name it or delete it")
        if name in names[: position - 1]:
            raise InputError(path, f"{place}, column {name}", "is given twice", "delete or rename one of them")
    return names


def _read_fast(text: str, width: int, begin: int = 0) -> Array | None:
    """Values (width, rows) of the text from `begin` by numpy's compiled reader; None if anything at all is unusual."""
    rows = text.count("\n", begin) + (not text.endswith("\n"))
    values, row = np.empty((width, rows)), 0
    while begin < len(text):
        end = text.find("\n", begin + _BLOCK) + 1 or len(text)
        block = _numbers(text[begin:end], width)
        if block is None:
            return None
        values[:, row : row + len(block)] = block.T
        begin, row = end, row + len(block)
    return values if row == rows and not (np.abs(values) > LARGEST).any() else None


def _numbers(body: str, width: int) -> Array | None:
    """Values (rows, width) of whole rows; None if anything at all is unusual."""
    if not body.isascii() or body.encode().translate(None, _OF_NUMBERS):
        return None
    if not body.endswith("\n"):
        body += "\n"
    if _BLANK.search(body):
        body = re.sub(r"[ \t]*([,\n])[ \t]*", r"\1", body).lstrip(" \t")
    if body.startswith(",") or any(mark in body for mark in (",,", ",\n", "\n,")):
        body = _EMPTY_CELL.sub("nan", body)
    lines = body.splitlines()
    try:
        values: Array = np.loadtxt(lines, delimiter=",", ndmin=2, comments=None, dtype=np.float64)
    except ValueError:
        return None
    return values if values.shape == (len(lines), width) else None


def _read_with_care(path: Path, names: Sequence[str], rows: Sequence[str], lines: NDArray[np.int64]) -> Array:
    """Values (rows, width) cell by cell, or the error that names the first cell at fault."""
    values = np.empty((len(rows), len(names)))
    for row, line in enumerate(rows):
        place = f"line {lines[row]}"
        cells = _cells(path, place, line)
        if len(cells) != len(names):
            problem = f"there are {len(cells)} cells for {len(names)} columns"
            raise InputError(path, place, problem, "give each row one cell a column, empty if it was not recorded")
        for column, cell in enumerate(cells):
            number = _number(cell) if cell else np.nan
            if number is None or abs(number) > LARGEST:
                _refuse(path, f"{place}, column {names[column]}", cell)
            values[row, column] = number
    return values


def _cells(path: Path, place: str, line: str) -> list[str]:
    try:
        return [cell.strip() for cell in next(csv.reader([line], skipinitialspace=True))]
    except csv.Error as error:
        raise InputError(
            path, place, f"cannot be read ({error})", "give a text file of comma-separated values"
        ) from None


def _refuse(path: Path, place: str, cell: str) -> NoReturn:
    problem, remedy = "is not a number", "write digits with a decimal point, or nothing"
    if cell.lstrip("+-").lower() in ("nan", "inf", "infinity", "na", "null", "none", "-", ""):
        remedy = "leave the cell empty if nothing was recorded"
    elif _NUMBER.fullmatch(cell):
        problem, remedy = "is too large", f"at most {LARGEST:g} was expected"
    raise InputError(path, place, f"{_quoted(cell)} {problem}", remedy)


def _comments(lines: Sequence[str]) -> tuple[dict[str, str], tuple[str, ...]]:
    comments: dict[str, str] = {}
    remarks = []
    for line in lines:
        text = line.lstrip("#").strip()
        match = _KEY.fullmatch(text)
        if match is None:
            remarks.append(text)
            continue
        key, value = match.groups()
        comments[key] = f"{comments[key]}\n{value}" if key in comments else value
    return comments, tuple(remarks)


def _number(text: str) -> float | None:
    """The finite number that a text is, as written in a table; None if it is none."""
    if not _NUMBER.fullmatch(text):
        return None
    value = float(text)
    return value if np.isfinite(value) else None


def _quoted(text: str) -> str:
    return repr(text if len(text) <= _QUOTED_LENGTH else text[:_QUOTED_LENGTH] + "...")


def read_bytes_as_text(path: Path | str) -> str:
    """Text of a file whose letters beyond ASCII do not matter (read as ISO 8859-1); every line ends in a line feed.

    Raises InputError: The file is missing or unreadable.
    """
    text = read_all_bytes(Path(path)).decode("latin-1")
    return text.replace("\r\n", "\n").replace("\r", "\n")
