"""The first sheet of a spreadsheet (``.xlsx``) as lines of text, with commas between cells, line by line its rows."""

from __future__ import annotations

import csv
import io
import re
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from tank2sim.errors import InputError
from tank2sim.files import read_bytes

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

_BEGINS = b"PK\x03\x04"

_LARGEST_PART = 1 << 29
"""Bytes of an unpacked part that are read at most. Project choice: a full sheet of numbers has half of that."""
_LAST_ROW, _LAST_COLUMN = 1 << 20, 1 << 14  # the size of a sheet in Excel
# Errors of Python's libraries for a damaged file
_DAMAGE = (zipfile.BadZipFile, zlib.error, LookupError, ValueError, RuntimeError, EOFError, OSError)
_PLACE = re.compile(r"([A-Z]{1,3})([0-9]{1,7})")


def is_workbook(data: bytes) -> bool:
    """Whether a file begins as a spreadsheet does (and as any other zip file)."""
    return data.startswith(_BEGINS)


def workbook_text(path: Path) -> str:
    """The first sheet as comma-separated text; line n is row n, and cells that hold commas are quoted.

    Numbers are as the file holds them, formulas as their last results. A row whose first cell begins with ``#`` is a
    comment and keeps its text. Each other row has as many cells as the first of them.

    Raises InputError: The file is not a spreadsheet, is broken, or a cell holds an error such as ``#DIV/0!`` or a
    formula without its result.
    """
    from xml.etree.ElementTree import ParseError

    try:
        with zipfile.ZipFile(io.BytesIO(read_bytes(path))) as book:
            strings = ["".join(_texts(item)) for item in _part(path, book, "xl/sharedStrings.xml", wanted=False)]
            sheet = _part(path, book, _first_sheet(path, book))
            rows = dict(_rows(path, sheet, strings))
    except (*_DAMAGE, ParseError) as error:
        problem = f"is not a spreadsheet that can be read ({' '.join(str(error).split())[:80]})"
        raise InputError(path, "", problem, "save it as .xlsx or .csv again") from None
    return _lines(rows)


def _lines(rows: dict[int, list[str]]) -> str:
    """Text of the rows, padded to the width of the first that is not a comment."""
    width = next((len(cells) for _, cells in sorted(rows.items()) if cells and not cells[0].startswith("#")), 0)
    text = io.StringIO()
    written = csv.writer(text, lineterminator="\n")
    for number in range(1, max(rows, default=0) + 1):
        cells = rows.get(number, [])
        if cells and cells[0].startswith("#"):
            text.write(", ".join(cell for cell in cells if cell) + "\n")
        elif not any(cells):
            text.write("\n")
        else:
            written.writerow([*cells, *[""] * (width - len(cells))])
    return text.getvalue()


def _part(path: Path, book: zipfile.ZipFile, name: str, *, wanted: bool = True) -> Element | list[Element]:
    """An XML part of the book; an empty list without it."""
    from xml.etree.ElementTree import fromstring

    if not wanted and name not in book.namelist():
        return []
    if book.getinfo(name).file_size > _LARGEST_PART:
        raise InputError(path, name, "is too large", "save the sheet as .csv")
    data = book.read(name)
    if b"<!DOCTYPE" in data[:1024] or b"<!ENTITY" in data[:4096]:
        raise InputError(path, name, "has definitions that no spreadsheet has", "save it as .xlsx or .csv again")
    return fromstring(data)


def _first_sheet(path: Path, book: zipfile.ZipFile) -> str:
    """Name of the part with the first sheet."""
    sheet = next(_every(_part(path, book, "xl/workbook.xml"), "sheet"), None)
    if sheet is None:
        raise KeyError("no sheet")
    reference = next((value for key, value in sheet.attrib.items() if key.endswith("}id")), "")
    for relation in _every(_part(path, book, "xl/_rels/workbook.xml.rels"), "Relationship"):
        if relation.get("Id") == reference:
            target = relation.get("Target", "")
            return target.removeprefix("/") if target.startswith("/") else f"xl/{target}"
    raise KeyError("no sheet")


def _every(element: Element | list[Element], tag: str) -> Iterator[Element]:
    """Elements of a name within another, in any namespace."""
    for part in [element] if not isinstance(element, list) else element:
        yield from (one for one in part.iter() if one.tag.rpartition("}")[2] == tag)


def _texts(item: Element) -> Iterator[str]:
    """Texts of a string; a phonetic reading of it is left out."""
    for child in item:
        tag = child.tag.rpartition("}")[2]
        if tag == "t":
            yield child.text or ""
        elif tag == "r":
            yield from _texts(child)


def _rows(path: Path, sheet: Element | list[Element], strings: list[str]) -> Iterator[tuple[int, list[str]]]:
    """Number from 1 and cells of each row, up to its last cell with a text."""
    for number, row in enumerate(_every(sheet, "row"), start=1):
        line = int(row.get("r", number))
        cells: list[str] = []
        for cell in _every(row, "c"):
            column = _column(cell.get("r")) if cell.get("r") else len(cells)
            text = " ".join(_cell(path, cell, strings).split())
            if text:
                cells += [""] * (column - len(cells))
                cells[column:] = [text]
        if not 0 < line <= _LAST_ROW:
            raise ValueError(f"row {line}")
        yield line, cells


def _column(place: str | None) -> int:
    """Number from 0 of the column of a cell such as ``AB12``."""
    match = _PLACE.fullmatch(place or "")
    if match is None:
        raise ValueError(f"cell {place}")
    column = 0
    for letter in match[1]:
        column = 26 * column + ord(letter) - ord("A") + 1
    if column > _LAST_COLUMN:
        raise ValueError(f"cell {place}")
    return column - 1


def _cell(path: Path, cell: Element, strings: list[str]) -> str:
    kind = cell.get("t", "n")
    value = next((one.text or "" for one in _every(cell, "v")), "")
    if kind == "e":
        raise InputError(path, f"cell {cell.get('r')}", f"holds the error {value}", "correct or empty the cell")
    if not value and next(_every(cell, "f"), None) is not None:
        problem = "holds a formula without its result"
        raise InputError(path, f"cell {cell.get('r')}", problem, "open and save the file, or write the value")
    if kind == "s":
        return strings[int(value)]
    if kind == "inlineStr":
        return "".join(text for one in _every(cell, "is") for text in _texts(one))
    return value
