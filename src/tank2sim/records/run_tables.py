"""Tables of captive runs in the files of any tank: text of any layout, spreadsheets, MATLAB, HDF5, TDMS.

MATLAB files, HDF5 and TDMS need the extra ``tank2sim[tank]``.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from tank2sim.arrays import Array
from tank2sim.errors import InputError, close_name, optional_library
from tank2sim.files import first_bytes, read_bytes, refuse_folder
from tank2sim.records.campaign_form import ColumnEntry, FilesSection
from tank2sim.records.csv_table import LARGEST, CsvTable, read_table, table_of_rows
from tank2sim.records.spelt_units import unit_factor
from tank2sim.records.text_layout import WHITESPACE, TextLayout, cells_of, decoded_text, lines_of_text, text_layout
from tank2sim.records.workbook import is_workbook, workbook_text
from tank2sim.units import to_si

RUN_QUANTITIES = {
    "t": "s",
    "y": "m",
    "psi": "rad",
    "v": "mps",
    "r": "radps",
    "speed": "mps",
    "delta": "rad",
    "X": "N",
    "Y": "N",
    "N": "Nm",
    "thrust": "N",
    "rudder_normal_force": "N",
    "torque": "Nm",
    "propeller": "radps",
}
"""Quantities of a captive run, and the SI unit of each as the names of columns end with it; ``propeller`` is the
revolutions."""

_SEPARATORS = {"tab": "\t", "blanks": WHITESPACE}


@dataclass(frozen=True)
class _MappedColumn:
    """A column of the file as a quantity: value in SI = factor (recorded - offset)."""

    heading: str
    quantity: str
    factor: float
    offset: float


def read_run_table(path: Path, columns: Mapping[str, ColumnEntry | str], files: FilesSection) -> CsvTable:
    """Read the table of a captive run in SI, its columns named ``t_s``, ``Y_N`` and so on.

    A CSV with commas and a column ``t_s`` needs no map. In any other file a column is known by the map, or by its name
    if that is one of :data:`RUN_QUANTITIES` with a unit: in the name (``Y_kN``, ``Y [kN]``), in a row of units, or in
    the property of a channel.

    `path`: The file; `columns`: Name of a column in the file to its quantity, as ``[columns]`` of the campaign has it;
    `files`: What the campaign says of the layout.

    Raises InputError: The file cannot be read; a column of the map is not in it, has no unit, or a unit of another
    kind; or two columns are one quantity.
    """
    raw = binary_columns(path)
    if raw is not None:
        return _mapped(_table_of_arrays(path, raw), {column.name: column.unit for column in raw}, columns)
    if not columns and files == FilesSection() and _is_plain(path):
        return read_table(path).si()
    table, units = _text_table(path, files)
    return _mapped(table, units, columns)


def _is_plain(path: Path) -> bool:
    """True for the CSV that needs no map; also for a file that :func:`read_table` explains best."""
    if is_workbook(first_bytes(path, 4)):
        return False
    with path.open(encoding="utf-8-sig", errors="replace") as file:
        head = next((line for line in file if line.strip() and not line.lstrip().startswith("#")), "")
    names = [name.strip() for name in head.split(",")]
    return not head or (("t_s" in names or "t_ms" in names) and "\t" not in head and ";" not in head)


def _table_of_arrays(path: Path, raw: Sequence[RawColumn]) -> CsvTable:
    columns = {column.name: column.values for column in raw}
    for name, values in columns.items():
        if np.isinf(values).any() or (np.abs(values) > LARGEST).any():
            raise InputError(path, f"column {name}", "has a number that is too large", f"at most {LARGEST:g} can be")
    return CsvTable(path, columns, np.arange(1, len(raw[0].values) + 1, dtype=np.int64))


def _text_table(path: Path, files: FilesSection) -> tuple[CsvTable, dict[str, str]]:
    """Columns by their names in the file, and the units of its row of units."""
    lines = _lines(path, files)
    layout = text_layout(path, lines, _stated_separator(files), {None: None, ",": True, ".": False}[files.decimal])
    names = list(files.names or layout.names)
    if len(names) != len(layout.names):
        problem = f"are {len(names)}, and {path.name} has {len(layout.names)} columns"
        raise InputError(path, "files.names", problem, "name each column")
    numbers, body = zip(*layout.rows(lines), strict=True)
    rows = [_canonical(path, number, line, layout) for number, line in zip(numbers, body, strict=True)]
    if all(row.endswith(",") and row.count(",") == len(names) for row in rows):
        rows = [row[:-1] for row in rows]  # a separator after the last column
    table = table_of_rows(path, names, rows, np.array(numbers, dtype=np.int64))
    read = {name: values for name, values in table.columns.items() if not np.isnan(values).all()}
    return replace(table, columns=read), dict(zip(names, layout.units, strict=False))


def _stated_separator(files: FilesSection) -> str:
    """The separator of :func:`_lines`; empty if it is not known."""
    return ";" if files.widths else _SEPARATORS.get(files.separator or "", files.separator or "")


def _lines(path: Path, files: FilesSection) -> list[str]:
    """Lines of a file; those to be skipped are empty, and columns of stated widths are separated by semicolons."""
    data = read_bytes(path)
    lines = lines_of_text(workbook_text(path) if is_workbook(data) else decoded_text(data)[0])
    lines = [*[""] * min(files.skip_lines, len(lines)), *lines[files.skip_lines :]]
    if not files.widths:
        return lines
    ends = np.cumsum(files.widths).tolist()
    cut = [[line[begin:end].strip() for begin, end in zip([0, *ends], ends, strict=False)] for line in lines]
    return [";".join(cells) if any(cells) else "" for cells in cut]


def _canonical(path: Path, number: int, line: str, layout: TextLayout) -> str:
    """A row with commas between cells and points in numbers."""
    if layout.comma and "." in line:
        remedy = "write numbers with one decimal sign and nothing between thousands, or give [files] decimal"
        raise InputError(path, f"line {number}", "has points and decimal commas", remedy)
    line, separator = line.strip(" "), layout.separator
    if separator == "," and '"' not in line:
        return line
    cells = cells_of(line, separator) if separator == WHITESPACE or '"' in line else line.split(separator)
    return ",".join(cell.replace(",", ".") if layout.comma else cell for cell in cells)


def _mapped(table: CsvTable, units: Mapping[str, str], columns: Mapping[str, ColumnEntry | str]) -> CsvTable:
    """The table in SI with the quantities of a run alone."""
    found = _with_named_columns(table, units, _stated_columns(table, units, columns))
    if "waveform time" in table.columns:
        found.setdefault("t", _MappedColumn("waveform time", "t", 1.0, 0.0))
    if "t" not in found:
        present = ", ".join(table.columns)
        problem = "no column is the time" if found else "no column is known"
        raise table.fault("header", problem, f"name them in [columns] of the campaign; there are: {present}")
    values = {_si_name(column.quantity): _in_si(table, column) for column in found.values()}
    headings = {_si_name(column.quantity): column.heading for column in found.values()}
    return replace(table, columns=values, headings=headings)


def _stated_columns(
    table: CsvTable, units: Mapping[str, str], columns: Mapping[str, ColumnEntry | str]
) -> dict[str, _MappedColumn]:
    """Columns of the map by their quantities."""
    found: dict[str, _MappedColumn] = {}
    for name, entry in columns.items():
        heading = _heading(table, name)
        as_stated = ColumnEntry(quantity=entry) if isinstance(entry, str) else entry
        column = _stated(table, heading, units.get(heading, ""), as_stated)
        if column.quantity in found:
            both = f"columns {found[column.quantity].heading} and {heading}"
            raise table.fault(both, f"are both {column.quantity}", "take one out of [columns]")
        found[column.quantity] = column
    return found


def _with_named_columns(
    table: CsvTable, units: Mapping[str, str], stated: Mapping[str, _MappedColumn]
) -> dict[str, _MappedColumn]:
    """The columns of the map, and the others whose names show what they are."""
    found = dict(stated)
    mapped = {column.heading for column in stated.values()}
    for heading in (heading for heading in table.columns if heading not in mapped):
        named = _by_name(heading, units.get(heading, ""))
        if named is None:
            _refuse_without_unit(table, heading, found)
        elif named.quantity in found and not stated:
            both = f"columns {found[named.quantity].heading} and {heading}"
            raise table.fault(both, "are one quantity in two units", "delete one of them")
        else:
            found.setdefault(named.quantity, named)
    return found


def _refuse_without_unit(table: CsvTable, heading: str, found: Mapping[str, _MappedColumn]) -> None:
    """Refuse a column with the name of a quantity that no other column is, and without a unit."""
    quantity = _without_unit(_last_part(heading))
    if quantity in RUN_QUANTITIES and quantity not in found:
        remedy = f"give one in [columns]: {quantity} = {{ quantity = '{quantity}', unit = ... }}"
        raise table.fault(f"column {heading}", f"has no unit of {quantity}", remedy)


def _in_si(table: CsvTable, column: _MappedColumn) -> Array:
    values = table.columns[column.heading]
    if column.factor == 1.0 and not column.offset:
        return values
    return np.asarray(column.factor * (values - column.offset))


def _si_name(quantity: str) -> str:
    return f"{quantity}_{RUN_QUANTITIES[quantity]}"


def _heading(table: CsvTable, stated: str) -> str:
    """The column that a name of the map means: the name in full, without its unit, or the end of its path."""
    if stated in table.columns:
        return stated
    for bare in (lambda name: name, _without_unit):
        matches = [name for name in table.columns if re.search(rf"(^|[/.]){re.escape(stated)}$", bare(name))]
        if len(matches) == 1:
            return matches[0]
    raise table.fault("header", f"there is no column {stated}", close_name(stated, table.columns))


def _stated(table: CsvTable, heading: str, unit_in_file: str, entry: ColumnEntry) -> _MappedColumn:
    """A column as the map states it."""
    place, (quantity, by_map) = f"columns.{heading}", _quantity_and_factor(table, heading, entry)
    if entry.factor is not None:
        return _MappedColumn(heading, quantity, entry.sign * entry.factor * (by_map or 1.0), entry.offset)
    spelt, by_file = _unit_in_file(heading, unit_in_file, quantity)
    factors = [factor for factor in (by_map, by_file) if factor is not None]
    if not factors:
        problem = f"has no unit of {quantity}" + (f" ({spelt} is none)" if spelt else "")
        raise table.fault(place, problem, f"give one in [columns]: unit = '{RUN_QUANTITIES[quantity]}'")
    if not math.isclose(factors[0], factors[-1], rel_tol=1e-6):
        problem = f"is in {spelt} by the file, and in another unit by the map"
        raise table.fault(place, problem, "correct the unit, or give a factor to SI")
    return _MappedColumn(heading, quantity, entry.sign * factors[0], entry.offset)


def _quantity_and_factor(table: CsvTable, heading: str, entry: ColumnEntry) -> tuple[str, float | None]:
    """Quantity of a column of the map, and the factor of the unit that the map states; None if it states none."""
    place = f"columns.{heading}"
    quantity, factor = _quantity(entry.quantity)
    if not quantity:
        raise table.fault(place, f"{entry.quantity} is not a quantity", f"known are: {', '.join(RUN_QUANTITIES)}")
    suffix = RUN_QUANTITIES[quantity]
    if entry.unit is not None:
        factor = unit_factor(entry.unit, suffix)
        if factor is None:
            raise table.fault(place, f"{entry.unit} is not a unit of {quantity}", f"its SI unit is {suffix}")
    return quantity, factor


def _unit_in_file(heading: str, unit: str, quantity: str) -> tuple[str, float | None]:
    """Unit of a column by the file's row of units, else by its heading, and its factor; None if it is none."""
    spelt = unit or _unit_of_heading(heading)
    return spelt, unit_factor(spelt, RUN_QUANTITIES[quantity]) if spelt else None


def _quantity(name: str) -> tuple[str, float | None]:
    """Quantity and factor of ``Y_kN`` (1000), ``Y_N`` (1) or ``Y`` (None); an empty name if it is none."""
    if name in RUN_QUANTITIES:
        return name, None
    stem = next((known for known in RUN_QUANTITIES if name.startswith(f"{known}_")), "")
    if not stem:
        return "", None
    suffix = name.removeprefix(f"{stem}_")
    renamed, angle = to_si(name, 1.0)
    if renamed == _si_name(stem):
        return stem, angle
    factor = unit_factor(suffix.replace("ps", "/s") if suffix.endswith("ps") else suffix, RUN_QUANTITIES[stem])
    return (stem, factor) if factor is not None else ("", None)


def _by_name(heading: str, unit: str) -> _MappedColumn | None:
    """A column that its own name shows, with a unit."""
    last = _last_part(heading)
    for name in dict.fromkeys((last, _without_unit(last))):
        quantity, factor = _quantity(name)
        if not quantity:
            continue
        _, known = _unit_in_file(heading, unit, quantity)
        if factor is not None and (known is None or math.isclose(known, factor, rel_tol=1e-6)):
            return _MappedColumn(heading, quantity, factor, 0.0)
        if factor is None and known is not None:
            return _MappedColumn(heading, quantity, known, 0.0)
    return None


def _last_part(heading: str) -> str:
    """The end of a path such as ``group/channel [m/s]``, whose unit is not a part of it."""
    bare = _without_unit(heading)
    return re.split(r"[/.]", bare)[-1] + heading[len(bare) :]


def _without_unit(heading: str) -> str:
    return re.sub(r"\s*[\[(][^\[(]*[\])]\s*$", "", heading).strip()


def _unit_of_heading(heading: str) -> str:
    match = re.search(r"[\[(]\s*([^\])]*?)\s*[\])]\s*$", heading)
    return match[1] if match else ""


_HDF5 = b"\x89HDF\r\n\x1a\n"
_MATLAB = b"MATLAB 5.0 MAT-file"
_TDMS = b"TDSm"
_FIRST_BYTES = 1024  # Bytes that show the format: a MATLAB 7.3 file has a header of 512 bytes before the HDF5 one


@dataclass(frozen=True)
class RawColumn:
    """A column as a file has it.

    - `name`: Path in the file: ``group/channel``, ``structure.field``, ``matrix 2`` for its second column.
    - `values` (rows,).
    - `unit`: As the file spells it; empty if it does not.
    """

    name: str
    values: Array
    unit: str = ""


def binary_columns(path: Path) -> list[RawColumn] | None:
    """Columns of equal length of a MATLAB, HDF5 or TDMS file; None if its first bytes are not of these formats.

    Variables of other lengths than the longest common one (parameters, texts) are left out.

    Raises InputError: The file is missing or broken, it has no columns, or the library for its format is not installed.
    """
    refuse_folder(path)
    head = first_bytes(path, _FIRST_BYTES)
    if head.startswith(_TDMS):
        library, read = optional_library("nptdms", "tank", path), _tdms
    elif head.startswith(_HDF5) or head[512:].startswith(_HDF5):
        library, read = optional_library("h5py", "tank", path), _hdf5
    elif head.startswith(_MATLAB) or (path.suffix.lower() == ".mat" and b"\0" in head):
        library, read = optional_library("scipy.io", "tank", path), _matlab
    else:
        return None
    try:
        columns = list(read(library, path))
    except InputError:
        raise
    except Exception as error:  # each library has errors of its own for a broken file
        raise InputError(path, "", f"cannot be read ({' '.join(str(error).split())})", "export it again") from None
    return _of_equal_length(columns, path)


def _of_equal_length(columns: list[RawColumn], path: Path) -> list[RawColumn]:
    lengths = [len(column.values) for column in columns if len(column.values) > 1]
    if not lengths:
        raise InputError(path, "", "has no columns of numbers", "give the measured values as arrays")
    usual = max(set(lengths), key=lambda length: (lengths.count(length), length))
    return [column for column in columns if len(column.values) == usual]


def _tdms(library: Any, path: Path) -> Iterable[RawColumn]:
    with library.TdmsFile.open(path) as file:
        timed: set[int] = set()
        for group in file.groups():
            for channel in group.channels():
                name = f"{group.name}/{channel.name}"
                yield from _columns(name, channel[:], str(channel.properties.get("unit_string", "")))
                step = channel.properties.get("wf_increment")
                if step and len(channel) not in timed:
                    timed.add(len(channel))
                    begin = float(channel.properties.get("wf_start_offset", 0.0))
                    times = begin + float(step) * np.arange(len(channel), dtype=np.float64)
                    yield RawColumn("waveform time", np.asarray(times, dtype=np.float64), "s")


def _hdf5(library: Any, path: Path) -> Iterable[RawColumn]:
    found: list[RawColumn] = []

    def visit(name: str, item: Any) -> None:
        if not isinstance(item, library.Dataset) or name.startswith("#"):
            return
        unit = next((_text(item.attrs[key]) for key in ("unit", "units", "Unit", "Units") if key in item.attrs), "")
        # MATLAB stores a matrix by columns, so that HDF5 has it transposed.
        values = item[()]
        matlab = "MATLAB_class" in item.attrs and getattr(values, "ndim", 0) == 2
        found.extend(_columns(name, values.T if matlab else values, unit))

    with library.File(path, "r") as file:
        file.visititems(visit)
    return found


def _matlab(library: Any, path: Path) -> Iterable[RawColumn]:
    content = library.loadmat(str(path), simplify_cells=True)
    for name, values in content.items():
        if not name.startswith("__"):
            yield from _matlab_columns(name, values)


def _matlab_columns(name: str, values: object) -> Iterable[RawColumn]:
    if isinstance(values, Mapping):
        for field, value in values.items():
            yield from _matlab_columns(f"{name}.{field}", value)
    else:
        yield from _columns(name, values, "")


def _columns(name: str, values: object, unit: str) -> Iterable[RawColumn]:
    array = np.asarray(values)
    if array.dtype.names:
        for field in array.dtype.names:
            yield from _columns(f"{name}.{field}", array[field], unit)
        return
    if array.dtype.kind not in "iuf":
        return
    if array.ndim == 2 and min(array.shape) == 1:
        array = array.ravel()
    if array.ndim == 1:
        yield RawColumn(name, array.astype(np.float64), unit)
    elif array.ndim == 2:
        for place in range(array.shape[1]):
            yield RawColumn(f"{name} {place + 1}", array[:, place].astype(np.float64), unit)


def _text(value: object) -> str:
    if isinstance(value, bytes):
        return value.decode("utf-8", errors="replace")
    return str(np.asarray(value).ravel()[0]) if isinstance(value, np.ndarray) else str(value)
