"""The common form of all logs: named series of numbers, each with its time in UTC."""

from __future__ import annotations

import importlib
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType

import numpy as np

from tank2sim.arrays import Array
from tank2sim.errors import InputError


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
    evidence: Mapping[str, float] = field(default_factory=dict)


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
    """A note of the kinds of sentences or messages of a log that are not used, each with its number; none of none."""
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
    """Roll, pitch and yaw (n,), rad, of unit quaternions in the order of rotations z, y, x (Diebel 2006, eq. 290)."""
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x**2 + y**2))
    pitch = np.arcsin(np.clip(2 * (w * y - z * x), -1, 1))
    yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y**2 + z**2))
    return roll, pitch, yaw
