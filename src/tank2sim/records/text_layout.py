"""How a table of text is written: encoding, preamble, separator, decimal sign, names and units, found from its lines.

The rows of values show it: a separator is the right one if it cuts the last rows of the file into the same number of
cells and most of them are numbers. What is above the first such row are the units, the names and the preamble.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from tank2sim.errors import InputError
from tank2sim.records.spelt_units import is_unit, unit_of_text

WHITESPACE = " "
"""Separator of columns of fixed width: any number of blanks."""

_SAMPLE = 40
"""Rows at the end of a text by which separator and number of columns are judged. Project choice: enough to meet values
with decimals, few enough to be fast."""
_REGULAR = 0.8
"""Share of these rows that must have the usual number of cells. Project choice: a footer and damaged rows are few."""

_MOSTLY = 0.5  # Share of numbers from which a row is one of values: logs have dates and words next to them

_LATIN = 0.9
"""Share of letters of one byte from which text is UTF-16 without its mark. Project choice: names are in any alphabet,
numbers are not."""

_UNIT_NUMBERS = ("1/min", "1/s")  # Units that begin with a digit


@dataclass(frozen=True)
class TextLayout:
    """How a table is written.

    - `separator`: One character; :data:`WHITESPACE` is any number of blanks.
    - `comma`: Decimal commas.
    - `names`, `units`: Names and units of the columns; ``column 3`` without a name, an empty unit without a unit.
    - `skip`: Lines above the first row of values.
    """

    separator: str
    comma: bool
    names: tuple[str, ...]
    units: tuple[str, ...]
    skip: int

    def rows(self, lines: Sequence[str]) -> list[tuple[int, str]]:
        """The rows of values, each with the number of its line (from 1)."""
        return [(number, line) for number, line in rows_of_text(lines) if number > self.skip]


def decoded_text(data: bytes, *, complete: bool = True) -> tuple[str, str]:
    """Text of the bytes of a file, and its encoding: UTF-16 and UTF-8 by their marks, UTF-8 if it can be, else
    Windows-1252, of which ISO 8859-1 is a part.

    `complete`: False if the bytes may end within a letter.
    """
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return data.decode("utf-16", errors="replace"), "utf-16"
    for zero, encoding in ((1, "utf-16-le"), (0, "utf-16-be")):
        zeros = data[zero::2]
        if zeros.count(0) > _LATIN * len(zeros) > 0 and not data[1 - zero :: 2].count(0):
            return data.decode(encoding, errors="replace"), encoding
    try:
        return data.decode("utf-8-sig"), "utf-8-sig"
    except UnicodeDecodeError as error:
        if not complete and error.start > len(data) - 4:
            return data[: error.start].decode("utf-8-sig"), "utf-8-sig"
    return data.decode("cp1252", errors="replace"), "cp1252"


def lines_of_text(text: str) -> list[str]:
    """Lines of a text, however they end."""
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def rows_of_text(lines: Sequence[str]) -> list[tuple[int, str]]:
    """The lines that are neither empty nor comments, each with its number (from 1)."""
    numbered = enumerate(lines, start=1)
    return [(number, line) for number, line in numbered if line.strip() and not line.lstrip().startswith("#")]


def text_layout(path: object, lines: Sequence[str], separator: str = "", comma: bool | None = None) -> TextLayout:
    """How the lines of a table are written.

    `path`: For messages; `lines`: The beginning of the file, or all of it; `separator`: If it is known; `comma`:
    Decimal commas, if it is known.

    Raises InputError: There are no rows.
    """
    numbered = rows_of_text(lines)
    if len(numbered) < 2:
        raise InputError(str(path), "", "has no rows", "give a table with a line of names and rows of values")
    separator, width = _separator([line for _, line in numbered[-_SAMPLE:]], separator)
    first = _first_row(numbered, separator, width)
    skip = numbered[first][0] - 1
    names, units = _head([line for _, line in numbered[:first]], separator, width)
    if not names:
        remarks = [line.lstrip("#% ") for line in lines[:skip] if line.startswith("#")]
        names, units = _head(remarks, separator, width)
    if comma is None:
        comma = _has_decimal_commas([line for _, line in numbered[first:]], separator)
    names = _distinct_names(names, width)
    units = [*units, *[""] * len(names)][: len(names)]
    return TextLayout(separator, comma, tuple(names), tuple(map(unit_of_text, units)), skip)


def _distinct_names(names: Sequence[str], width: int) -> list[str]:
    """A name for each of `width` columns at least, none of them twice."""
    whole = [*names, *[""] * (width - len(names))]
    whole = [name.strip() or f"column {place}" for place, name in enumerate(whole, start=1)]
    return [name if whole.index(name) == place else f"{name} ({place + 1})" for place, name in enumerate(whole)]


def _has_decimal_commas(body: Sequence[str], separator: str) -> bool:
    if separator == ",":  # quotation marks alone distinguish commas between cells and in numbers
        return any(re.search(r'"\s*[+-]?\d*,\d+', line) for line in body[:_SAMPLE])
    mark = r"\s" if separator == WHITESPACE else re.escape(separator)
    first = any(re.search(rf"(?:^|{mark})\s*[+-]?\d*,\d+", line) for line in body[:_SAMPLE])
    return first or any(re.search(r"\d,\d", line) for line in body[-_SAMPLE:])


def cells_of(line: str, separator: str) -> list[str]:
    """Cells of a line, as written."""
    if separator == WHITESPACE:
        return line.split()
    return next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])


@dataclass(frozen=True)
class _Cut:
    """Rows cut at a separator: their usual number of cells, share of rows that have it, and of cells with numbers."""

    separator: str
    width: int
    regular: float
    numbers: float

    @property
    def by_marks(self) -> bool:
        """Whether marks that are in no word and no number separate values."""
        return self.separator in ";\t|" and self.numbers > _MOSTLY

    @property
    def sure(self) -> bool:
        """Whether it is a table without being stated; blanks are within cells of dates, positions or words, too."""
        return self.regular >= _REGULAR and (self.separator != WHITESPACE or self.numbers >= _REGULAR)


def _cut(sample: Sequence[str], separator: str) -> _Cut:
    rows = [cells_of(line, separator) for line in sample]
    width, count = Counter(map(len, rows)).most_common(1)[0]
    filled = [cell for row in rows if len(row) == width for cell in row if cell.strip()]
    return _Cut(separator, width, count / len(rows), sum(map(_is_number, filled)) / max(len(filled), 1))


def _separator(sample: Sequence[str], known: str) -> tuple[str, int]:
    """Separator and number of columns of rows of values."""
    best = _Cut(",", 1, 1.0, -1.0)
    for cut in (_cut(sample, separator) for separator in known or (";", "\t", "|", ",", WHITESPACE)):
        if cut.separator == WHITESPACE and best.by_marks:
            break  # blanks would cut a table of tabs as well, and empty cells would shift its columns
        if cut.width > 1 and (known or cut.sure) and cut.numbers > best.numbers + 1e-9:
            best = cut
    return best.separator, best.width


def _first_row(numbered: Sequence[tuple[int, str]], separator: str, width: int) -> int:
    """Index of the first row of values: one of numbers, and the next one is too."""
    rows = [cells_of(line, separator) for _, line in numbered]
    values = [len(row) == width and _mostly_numbers(row) for row in rows]
    for place, (row, following) in enumerate(pairwise(values)):
        if row and following:
            return place
    return next((place for place, row in enumerate(values) if row), min(1, len(numbered) - 1))


def _mostly_numbers(row: Sequence[str]) -> bool:
    """True for a row of values: half of what is not empty are numbers, or one at least begins with a digit."""
    filled = [cell.strip() for cell in row if cell.strip()]
    if any(cell in _UNIT_NUMBERS for cell in filled):
        return False
    numbers = sum(_is_number(cell) for cell in filled)
    dates = sum(bool(re.match(r"[+-]?\d", cell)) for cell in filled)
    return bool(filled) and (numbers > _MOSTLY * len(filled) or dates > _MOSTLY * len(filled) or numbers > 1)


def _head(above: Sequence[str], separator: str, width: int) -> tuple[list[str], list[str]]:
    """Names and units from the lines above the values, the nearest last."""
    rows = [_named_cells(line, separator, width) for line in above]
    if not rows or rows[-1] is None:
        return [], []
    nearest = rows[-1]
    further = rows[-2] if len(rows) > 1 else None
    if further is not None and (_units(nearest) or (len(rows) == 2 and all(cell.strip() for cell in further))):
        return further, nearest
    return nearest, []


def _units(row: Sequence[str]) -> bool:
    filled = [cell.strip() for cell in row if cell.strip(" -")]
    return bool(filled) and sum(is_unit(cell) for cell in filled) > _MOSTLY * len(filled)


def _named_cells(line: str, separator: str, width: int) -> list[str] | None:
    """Cells of a line of names; None if it has another number of them."""
    line = line.removeprefix("%").strip(" ") if separator == WHITESPACE else line.removeprefix("%")
    candidates = [cells_of(line, separator)]
    if separator == WHITESPACE:
        joined = re.sub(r"\s+(?=[\[(])", "\0", line.strip())
        candidates += [re.split(r"\s{2,}|\t", line.strip()), [cell.replace("\0", " ") for cell in joined.split()]]
    for cells in candidates:
        if len(cells) == width:
            return cells
    # A spreadsheet leaves out the separators after the last name.
    return candidates[0] if separator != WHITESPACE and width - 1 == len(candidates[0]) > 1 else None


def _is_number(text: str) -> bool:
    try:
        float(text.strip().replace(",", "."))
    except ValueError:
        return False
    return True
