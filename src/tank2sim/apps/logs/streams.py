"""The common form of all logs, named series of numbers with their times in UTC, and what the readers share."""

from __future__ import annotations

import math
import re
import tomllib
from array import array
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from tank2sim.apps.logs.findings import LogFinding
from tank2sim.apps.logs.quantities import quantity_of_name
from tank2sim.arrays import Array
from tank2sim.errors import InputError
from tank2sim.files import first_bytes
from tank2sim.records.text_layout import decoded_text

FIELDS: dict[str, dict[str, dict[str, Any]]] = tomllib.loads(
    Path(__file__).with_name("fields.toml").read_text(encoding="utf-8")
)
"""Format to its messages, their fields, and what is known of each."""

_HEAD_BYTES = 4096


@dataclass(frozen=True, eq=False)
class LogStream:
    """One series of numbers of a log.

    Parameters
    ----------
    name : str
        Unique in its log: ``HDT.heading``, ``/imu/data.angular_velocity.z``, ``GPS.Spd``.
    time_s : array (n,)
        UTC, s since 1970-01-01; as recorded, not necessarily rising.
    values : array (n,)
        As recorded, nan where nothing was.
    unit : str
        As the format or the file states it (``deg``, ``kn``, ``rad/s``); empty where nothing states it.
    quantity : str
        What the format defines it to be, a key of :data:`.quantities.QUANTITIES`; empty where it says nothing.
    stated_by : str
        ``format`` where the format defines the quantity, ``name`` where only a name suggests it, or empty.
    """

    name: str
    time_s: Array
    values: Array
    unit: str = ""
    quantity: str = ""
    stated_by: str = ""


@dataclass(frozen=True, eq=False)
class VesselLog:
    """A log as its reader gives it.

    Parameters
    ----------
    path : Path
        The file.
    format : str
        Its format in words.
    streams : tuple of LogStream
    counts : mapping
        What was read and what was lost: ``sentences``, ``corrupted``, ``dropped``, ...
    findings : tuple of LogFinding
    dated : bool
        Whether times are UTC; otherwise they count from the beginning of the log.
    """

    path: Path
    format: str
    streams: tuple[LogStream, ...]
    counts: Mapping[str, int] = field(default_factory=dict)
    findings: tuple[LogFinding, ...] = ()
    dated: bool = True


class Samples:
    """Values of a field while a file is read, with the line of the file and the time stamp (s) of each."""

    def __init__(self) -> None:
        self.lines, self.stamps, self.values = array("q"), array("d"), array("d")

    def add(self, value: float, line: int = 0, stamp: float = math.nan) -> None:
        """Append a value."""
        self.lines.append(line)
        self.stamps.append(stamp)
        self.values.append(value)


def named_stream(name: str, time_s: Array, values: Array, unit: str = "") -> LogStream:
    """A stream of the quantity that its name suggests, unless its unit is of another kind."""
    quantity = quantity_of_name(name, unit)
    return LogStream(name, time_s, values, unit, quantity, "name" if quantity else "")


def unreadable(path: Path, error: Exception, remedy: str, problem: str = "cannot be read") -> InputError:
    """The `problem` of a file at which a library failed, with its `error` (of struct, lz4, ...), and the `remedy`."""
    reason = f"{type(error).__name__}: {' '.join(str(error).split())[:100]}"
    return InputError(path, "", f"{problem} ({reason})", remedy)


def text_lines(path: Path) -> Iterator[bytes]:
    """Lines of a text file in one byte a letter: UTF-16 is decoded, the mark of UTF-8 left out."""
    encoding = decoded_text(first_bytes(path, _HEAD_BYTES), complete=False)[1]
    if encoding.startswith("utf-16"):
        with path.open(encoding=encoding, errors="replace") as text:
            yield from (line.encode("latin-1", errors="replace") for line in text)
        return
    with path.open("rb") as file:
        yield next(file, b"").removeprefix(b"\xef\xbb\xbf")
        yield from file


def mostly(head: bytes, fits: Callable[[bytes], object]) -> bool:
    """Whether half the lines of `head`, the beginning of a file, are what `fits`, but comments and a cut last one."""
    lines = re.split(rb"[\r\n]+", head)
    lines = [line for line in lines[:-1] or lines if line.strip() and not line.startswith(b"#")]
    return bool(lines) and 2 * sum(bool(fits(line)) for line in lines) > len(lines)


def wrapped_angle(angle_rad: Array) -> Array:
    """Angles (n,) within -pi to pi, rad."""
    return np.asarray((angle_rad + math.pi) % (2 * math.pi) - math.pi)


def heading_of_quaternion(w: Array, x: Array, y: Array, z: Array) -> tuple[Array, Array]:
    """Roll and yaw (n,), rad, of quaternions ``w + xi + yj + zk``: rotations z, y, x (Diebel 2006, eq. 290)."""
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x**2 + y**2))
    return roll, np.arctan2(2 * (w * z + x * y), 1 - 2 * (y**2 + z**2))
