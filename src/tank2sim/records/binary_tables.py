"""Columns of numbers from MATLAB files, HDF5 and TDMS, by the extra ``tank2sim[tank]``."""

from __future__ import annotations

import importlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from tank2sim.arrays import Array
from tank2sim.errors import InputError

_HDF5 = b"\x89HDF\r\n\x1a\n"
_MATLAB = b"MATLAB 5.0 MAT-file"
_TDMS = b"TDSm"
_FIRST_BYTES = 1024
"""Bytes that show the format: a MATLAB 7.3 file has 512 of its own before those of HDF5."""


@dataclass(frozen=True)
class RawColumn:
    """A column as a file has it.

    Parameters
    ----------
    name : str
        Path in the file: ``group/channel``, ``structure.field``, ``matrix 2`` for its second column.
    values : array, (rows,)
    unit : str
        As the file spells it; empty if it does not.
    """

    name: str
    values: Array
    unit: str = ""


def binary_columns(path: Path) -> list[RawColumn] | None:
    """Columns of equal length of a MATLAB, HDF5 or TDMS file; None if its first bytes are not of these formats.

    Variables of other lengths than the longest common one (parameters, texts) are left out.

    Raises
    ------
    InputError
        The file is missing or broken, it has no columns, or the library for its format is not installed.
    """
    try:
        with path.open("rb") as file:
            head = file.read(_FIRST_BYTES)
    except FileNotFoundError:
        raise InputError(path, "", "the file does not exist", "check the name") from None
    except OSError as error:
        raise InputError(path, "", f"cannot be read ({error.strerror})", "check the name and its permissions") from None
    if head.startswith(_TDMS):
        library, read = _library("nptdms", path), _tdms
    elif head.startswith(_HDF5) or head[512:].startswith(_HDF5):
        library, read = _library("h5py", path), _hdf5
    elif head.startswith(_MATLAB) or (path.suffix.lower() == ".mat" and b"\0" in head):
        library, read = importlib.import_module("scipy.io"), _matlab
    else:
        return None
    try:
        columns = list(read(library, path))
    except InputError:
        raise
    except Exception as error:  # each library has errors of its own for a broken file
        raise InputError(path, "", f"cannot be read ({' '.join(str(error).split())})", "export it again") from None
    return _of_equal_length(columns, path)


def _library(name: str, path: Path) -> ModuleType:
    try:
        return importlib.import_module(name)
    except ImportError:
        remedy = "install it with: pip install 'tank2sim[tank]'"
        raise InputError(path, "", f"needs the library {name}, which is not installed", remedy) from None


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
