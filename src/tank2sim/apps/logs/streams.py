"""The common form of all logs: named series of numbers, each with its time in UTC."""

from __future__ import annotations

import importlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import ModuleType

import numpy as np

from tank2sim.arrays import Array, Number
from tank2sim.errors import InputError

OVERLAP_S = 2.0
"""Most that a file may reach into the next one, s. Project choice: what a message is late by, recorded."""


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


@dataclass(frozen=True)
class LogFinding:
    """Something that the reader of a log must know.

    Parameters
    ----------
    kind : str
        ``fault``: the log or a stream is not what it seems, and the result is marked; ``note``: a gap, lost sentences.
    text : str
        One sentence.
    stream : str
        The stream or channel that it is about; empty if it is the log as a whole.
    evidence : mapping
        Figures, the unit in the name.
    """

    kind: str
    text: str
    stream: str = ""
    evidence: Mapping[str, Number] = field(default_factory=dict)


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


def not_used(words: str, kinds: Mapping[str, int]) -> list[LogFinding]:
    """A note that counts what was not used; none if there is nothing.

    Parameters
    ----------
    words : str
        What is counted, ``sentences`` or ``messages``.
    kinds : mapping
        Kind to its number.
    """
    if not kinds:
        return []
    listed = ", ".join(f"{number} {kind}" for kind, number in sorted(kinds.items()))
    return [LogFinding("note", f"{words} that are not used: {listed}", evidence=dict(kinds))]


def optional_library(name: str, path: Path) -> ModuleType:
    """Import a library of the extra ``tank2sim[logs]``.

    Raises
    ------
    InputError
        It is not installed.
    """
    try:
        return importlib.import_module(name)
    except ImportError:
        package = name.partition(".")[0]
        remedy = "install it with: pip install 'tank2sim[logs]'"
        raise InputError(path, "", f"needs the library {package}, which is not installed", remedy) from None


def wrapped_angle(angle_rad: Array) -> Array:
    """Angles (n,) within -pi to pi, rad."""
    return np.asarray((angle_rad + math.pi) % (2 * math.pi) - math.pi)


def heading_of_quaternion(w: Array, x: Array, y: Array, z: Array) -> tuple[Array, Array, Array]:
    """Roll, pitch, yaw (n,), rad, of quaternions ``w + xi + yj + zk``: rotations z, y, x (Diebel 2006, eq. 290)."""
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x**2 + y**2))
    pitch = np.arcsin(np.clip(2 * (w * y - z * x), -1, 1))
    yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y**2 + z**2))
    return roll, pitch, yaw


def joined_parts(logs: Sequence[VesselLog]) -> list[VesselLog]:
    """The logs, with dated files of one format that follow each other as one.

    Streams of one name become one stream. A file that holds only streams that the others lack, or that lies in their
    time, is another instrument's and stays a log of its own.

    Parameters
    ----------
    logs : sequence of VesselLog
        In any order, in which they stay: that of the first that was given of each.
    """
    found: list[tuple[int, VesselLog]] = []
    for given in sorted(range(len(logs)), key=lambda one: _span(logs[one])[0]):
        log = logs[given]
        place = next((place for place, (_, before) in enumerate(found) if _follows(before, log)), None)
        if place is None:
            found.append((given, log))
        else:
            first, before = found[place]
            found[place] = min(first, given), _joined(before, log)
    return [log for _, log in sorted(found, key=lambda one: one[0])]


def _span(log: VesselLog) -> tuple[float, float]:
    times = [stream.time_s[np.isfinite(stream.time_s)] for stream in log.streams]
    times = [time for time in times if len(time)]
    if not times:
        return np.inf, np.inf
    return min(float(time.min()) for time in times), max(float(time.max()) for time in times)


def _follows(before: VesselLog, log: VesselLog) -> bool:
    names = {stream.name for stream in before.streams}
    return (
        before.dated
        and log.dated
        and before.format == log.format
        and any(stream.name in names for stream in log.streams)
        and _span(before)[1] <= _span(log)[0] + OVERLAP_S
    )


def _joined(before: VesselLog, log: VesselLog) -> VesselLog:
    later = {stream.name: stream for stream in log.streams}
    streams = [_continued(stream, later.pop(stream.name, None)) for stream in before.streams]
    text = f"{log.path.name} continues {before.path.name}"
    findings = (*before.findings, *log.findings, LogFinding("note", text))
    return replace(before, path=log.path, streams=(*streams, *later.values()), findings=findings)


def _continued(stream: LogStream, later: LogStream | None) -> LogStream:
    if later is None or not len(later.time_s):
        return stream
    if not len(stream.time_s):
        return later
    new = ~(later.time_s <= np.nanmax(stream.time_s))
    return replace(
        stream,
        time_s=np.concatenate([stream.time_s, later.time_s[new]]),
        values=np.concatenate([stream.values, later.values[new]]),
    )
