"""Rows of numbers as other laboratories write them: ``nan`` is understood, and a fault is reported by line and
column."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tank2sim.errors import InputError
from tank2sim.files import read_bytes
from tank2sim.records.csv_table import LARGEST

NumberRows = Sequence[tuple[int, Sequence[str]]]
"""Line of the file (from 1) and cells of each row."""


def read_bytes_as_text(path: Path | str) -> str:
    """Text of a file whose letters beyond ASCII do not matter (read as ISO 8859-1); every line ends in a line feed.

    Raises
    ------
    InputError
        The file is missing or unreadable.
    """
    try:
        text = read_bytes(path).decode("latin-1")
    except FileNotFoundError:
        raise InputError(path, "", "the file does not exist", "check the name") from None
    except OSError as error:
        raise InputError(path, "", f"cannot be read ({error.strerror})", "check the name and its permissions") from None
    return text.replace("\r\n", "\n").replace("\r", "\n")


def number_rows(path: Path, rows: NumberRows, names: Sequence[str]) -> NDArray[np.float64]:
    """Values (rows, columns), nan where a cell is empty or says so.

    Raises
    ------
    InputError
        A row has too many or too few cells, or one that is not a finite number; or there are fewer than two rows.
    """
    if len(rows) < 2:
        raise InputError(path, "", "has no rows of measured values", "give the file as it was published")
    for line, cells in rows:
        if len(cells) != len(names):
            problem = f"the number of cells is {len(cells)}, and that of columns {len(names)}"
            raise InputError(path, f"line {line}", problem, "correct or delete the line")
    values = np.array([[_number(cell) for cell in cells] for _, cells in rows])
    faulty = np.argwhere(np.abs(values) > LARGEST)
    if faulty.size:
        row, column = (int(place) for place in faulty[0])
        line, cells = rows[row]
        problem = f"{cells[column][:30]!r} is not a number" + (
            f" up to {LARGEST:g}" if np.isfinite(values[row, column]) else ""
        )
        raise InputError(path, f"line {line}, column {names[column]}", problem, "write a number, or nan for none")
    return values


def _number(cell: str) -> float:
    """The value of a cell; inf if it is none."""
    text = cell.strip()
    if not text:
        return math.nan
    try:
        return float(text)
    except ValueError:
        return math.inf
