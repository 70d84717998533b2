"""ROS 1 and ROS 2 bags and MCAP, read without ROS.

Standard messages are in the frames of REP 103: east, north, up for the world, ahead, port, up for the body. Here they
become north, east, and ahead, starboard; a yaw from east to the left becomes a heading from north to the right.
"""

from __future__ import annotations

import math
import tempfile
from array import array
from collections import defaultdict
from collections.abc import Iterable, Iterator
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np

from tank2sim.apps.logs.quantities import QUANTITIES, plain_words, quantity_of_name
from tank2sim.apps.logs.streams import LogFinding, LogStream, VesselLog, heading_of_quaternion, optional_library
from tank2sim.arrays import Array
from tank2sim.errors import InputError
from tank2sim.records.spelt_units import split_unit

LONGEST_VECTOR = 32
"""Entries of an array up to which each is a stream. Project choice: outputs of MAVROS are 16 or 18, joints and motors
fewer; scans and pictures have hundreds."""

_OFF_BY_S = 3600.0
"""Difference of the time in a header from the time of recording beyond which the header's is not UTC. Project choice:
latencies are seconds; a simulated or unset clock is off by years."""

_PACE = 0.01
"""Relative difference of the paces of two clocks from which one is simulated. Project choice: clocks of computers
differ by 1e-4, and the delays of a log of a minute by less than a second."""

_SUFFIXES = {b"#ROS": ".bag", b"SQLi": ".db3", b"\x89MCA": ".mcap"}
"""Endings that the library needs, by the first bytes of a file."""

_WORLD_FRAMES = ("map", "odom", "world", "enu", "earth", "local_origin", "utm")
"""Names of frames that are fixed to the earth: east, north, up (REP 103, REP 105)."""

_OMITTED = ("header", "covariance", "seq", "status", "layout", "covariance_type")
_GROUND_WORDS = ("gps", "gnss", "vel", "fix", "navsat", "enu")


def read_ros_bag(path: Path) -> VesselLog:
    """Read a ROS 1 bag, a ROS 2 bag (its folder or file) or an MCAP file.

    Each number of each message becomes a stream, arrays of more than :data:`LONGEST_VECTOR` entries excepted, which are
    named. Times are those of the headers where there are any, and of the recording elsewhere; where the headers run at
    another pace, as those of a simulation do, theirs are taken for all, and the log has no date. Fixes without a status
    of a fix hold no value.

    Raises
    ------
    InputError
        The file is cut off or is not a bag, or no message of it has a number.
    """
    highlevel = optional_library("rosbags.highlevel", path)
    stores = optional_library("rosbags.typesys", path)
    store = stores.get_typestore(stores.Stores.LATEST)
    topics: dict[str, _Topic] = {}
    findings: list[LogFinding] = []
    failed: dict[str, str] = {}
    try:
        with (
            tempfile.TemporaryDirectory() as folder,
            highlevel.AnyReader([_named(path, Path(folder))], default_typestore=store) as reader,
        ):
            for connection, received_ns, raw in reader.messages():
                try:
                    message = reader.deserialize(raw, connection.msgtype)
                except Exception as error:
                    failed.setdefault(connection.topic, type(error).__name__)
                    continue
                if connection.topic not in topics:
                    topics[connection.topic] = _Topic(connection.topic, connection.msgtype, message)
                topics[connection.topic].take(message, received_ns)
    except InputError:
        raise
    except Exception as error:  # the library lets errors of struct, lz4 and zstd through
        problem = f"cannot be read to its end ({type(error).__name__}: {' '.join(str(error).split())[:100]})"
        remedy = "it may be cut off: repair it with 'rosbag reindex' or 'mcap recover'"
        raise InputError(path, "", problem, remedy) from None
    findings += [LogFinding("note", f"{topic} cannot be decoded ({why})", topic) for topic, why in failed.items()]
    simulated = _simulated_times(topics.values(), findings)
    streams = [stream for topic in topics.values() for stream in topic.streams(simulated, findings)]
    if not streams:
        raise InputError(path, "", "no message of it holds a number", "record topics with measured values")
    counts = {"messages": sum(len(topic.received) for topic in topics.values()), "undecoded_topics": len(failed)}
    form = "MCAP" if _suffix(path) == ".mcap" else "ROS bag"
    return VesselLog(path, form, tuple(streams), counts, tuple(findings), simulated is None)


def _named(path: Path, folder: Path) -> Path:
    """The bag under a name that ends as its first bytes say, for the library goes by the name."""
    if path.is_dir() or (suffix := _suffix(path)) == path.suffix:
        return path
    link = folder / f"log{suffix}"
    link.symlink_to(path.resolve())
    return link


def _suffix(path: Path) -> str:
    """The ending that a bag should have, by its first bytes."""
    if path.is_dir():
        return ""
    with path.open("rb") as file:
        return _SUFFIXES.get(file.read(4), path.suffix)


def _simulated_times(topics: Iterable[_Topic], findings: list[LogFinding]) -> tuple[Array, Array] | None:
    """Times of recording and of the headers (n,), s, where these run at another pace; None where they do not."""
    pairs = [np.column_stack(topic.clock) for topic in topics if topic.stamped and len(topic.received) > 1]
    both = np.concatenate(pairs) if pairs else np.zeros((0, 2))
    both = both[both[:, 1] > 0]
    if len(both) < 2 or abs(float(np.median(both[:, 1] - both[:, 0]))) < _OFF_BY_S:
        return None
    both = both[np.argsort(both[:, 0], kind="stable")]
    spans = np.ptp(both, axis=0)
    if not spans.all() or abs(spans[1] / spans[0] - 1) < _PACE:
        return None
    text = (
        f"the times of the headers run {spans[1] / spans[0]:.3g} times as fast as the recording, as of a simulation: "
    )
    findings.append(LogFinding("note", f"{text}they are taken, and the trials have no date"))
    return both[:, 0], both[:, 1]


class _Topic:
    """Numbers of the messages of one topic."""

    def __init__(self, name: str, kind: str, message: Any) -> None:
        self.name, self.kind = name, kind.replace("/msg/", "/")
        self.paths = list(_numbers_of(message))
        self.get = [_getter(path) for path in self.paths]
        self.stamped = hasattr(getattr(message, "header", message), "stamp")
        self.frame = str(getattr(getattr(message, "header", None), "frame_id", "")).strip("/").lower()
        self.child = str(getattr(message, "child_frame_id", "")).strip("/").lower()
        self.received, self.stamps = array("d"), array("d")
        self.columns: dict[str, array[float]] = defaultdict(lambda: array("d"))
        self.valid = array("b")
        self.lists = list(_lists_of(message))
        self.longest = self._length(message)
        self.scans = {path: size for path, size in self._sizes(message) if size > LONGEST_VECTOR}

    def _sizes(self, message: Any) -> Iterator[tuple[str, int]]:
        return ((path, len(attrgetter(path)(message))) for path in self.lists)

    def _length(self, message: Any) -> int:
        """Entries of all lists that are short enough to be streams."""
        return sum(size for _, size in self._sizes(message) if size <= LONGEST_VECTOR)

    def take(self, message: Any, received_ns: int) -> None:
        if self.lists and self._length(message) > self.longest:  # lists are often empty at first
            self.longest = self._length(message)
            for path in _numbers_of(message):
                if path not in self.paths:
                    self.paths.append(path)
                    self.get.append(_getter(path))
                    self.columns[path].extend([math.nan] * len(self.received))
        self.received.append(received_ns * 1e-9)
        if self.stamped:
            stamp = getattr(message, "header", message).stamp
            self.stamps.append(stamp.sec + stamp.nanosec * 1e-9)
        for path, get in zip(self.paths, self.get, strict=True):
            try:
                self.columns[path].append(float(get(message)))
            except (IndexError, TypeError, ValueError):
                self.columns[path].append(math.nan)
        self.valid.append(getattr(getattr(message, "status", None), "status", 0) >= 0)

    @property
    def clock(self) -> tuple[Array, Array]:
        """Times of recording and of the headers (n,), s."""
        return np.frombuffer(self.received, dtype=float), np.frombuffer(self.stamps, dtype=float)

    def _time(self, simulated: tuple[Array, Array] | None, findings: list[LogFinding]) -> Array:
        received, stamps = self.clock
        if simulated is not None:
            return np.where(stamps > 0, stamps, np.nan) if self.stamped else np.interp(received, *simulated)
        if not self.stamped:
            return received
        if abs(float(np.median(stamps - received))) < _OFF_BY_S:
            return stamps
        if (stamps != 0).any():
            text = f"{self.name}: header times differ from recording times, which are used"
            findings.append(LogFinding("note", text, self.name))
        return received

    def streams(self, simulated: tuple[Array, Array] | None, findings: list[LogFinding]) -> Iterator[LogStream]:
        time = self._time(simulated, findings)
        for path, size in self.scans.items():
            text = f"{self.name}.{path} has {size} entries, more than {LONGEST_VECTOR}, and is not read"
            findings.append(LogFinding("note", text, self.name))
        valid = np.frombuffer(self.valid, dtype=np.int8) > 0
        columns = {
            path: np.where(valid, np.frombuffer(values, dtype=float), np.nan) for path, values in self.columns.items()
        }
        kind = self.kind.rpartition("/")[2]
        converted = self._standard(kind, columns)
        for path, values, unit, quantity in converted:
            yield LogStream(f"{self.name}.{path}", time, values, unit, quantity, "format")
        if converted:
            return
        for path, values in columns.items():
            name = self.name if path == "data" else f"{self.name}.{path}"
            unit = split_unit(name.replace("/", " ").replace(".", " "))[1]
            quantity = quantity_of_name(name)
            if quantity and unit and unit not in QUANTITIES[quantity].units:
                quantity = ""
            if quantity.startswith("wind") and quantity.endswith("speed"):
                unit = unit or "m/s"  # REP 103: SI; what can be tested by content is not taken for granted
            yield LogStream(name, time, values, unit, quantity, "name" if quantity else "")

    def _standard(self, kind: str, columns: dict[str, Array]) -> list[tuple[str, Array, str, str]]:
        """Streams of a standard message in the frames of trials; empty for any other message."""
        pick = columns.get
        if kind == "NavSatFix":
            return [
                ("latitude", columns["latitude"], "deg", "latitude"),
                ("longitude", columns["longitude"], "deg", "longitude"),
            ]
        if kind == "Imu":
            return [
                *_attitude(columns, "orientation"),
                ("yaw_rate", -columns["angular_velocity.z"], "rad/s", "yaw_rate"),
                ("a_x", columns["linear_acceleration.x"], "m/s2", "a_x"),
                ("a_y", -columns["linear_acceleration.y"], "m/s2", "a_y"),
            ]
        if kind == "Odometry":
            return [
                ("x", columns["pose.pose.position.y"], "m", "x"),
                ("y", columns["pose.pose.position.x"], "m", "y"),
                *_attitude(columns, "pose.pose.orientation"),
                *_velocity(columns, "twist.twist.", self.child in _WORLD_FRAMES),
            ]
        if kind in ("Twist", "TwistStamped", "TwistWithCovarianceStamped"):
            prefix = {"Twist": "", "TwistStamped": "twist.", "TwistWithCovarianceStamped": "twist.twist."}[kind]
            ahead, left = pick(f"{prefix}linear.x"), pick(f"{prefix}linear.y")
            words = plain_words(self.name).split()
            if ahead is None or left is None or {"cmd", "command", "setpoint"} & set(words):
                return []
            of_world = bool(set(words) & set(_GROUND_WORDS)) or self.frame in _WORLD_FRAMES
            return _velocity(columns, prefix, of_world)
        if kind in ("Pose", "PoseStamped", "PoseWithCovarianceStamped"):
            prefix = {"Pose": "", "PoseStamped": "pose.", "PoseWithCovarianceStamped": "pose.pose."}[kind]
            return [
                ("x", columns[f"{prefix}position.y"], "m", "x"),
                ("y", columns[f"{prefix}position.x"], "m", "y"),
                *_attitude(columns, f"{prefix}orientation"),
            ]
        return []


def _velocity(columns: dict[str, Array], prefix: str, of_world: bool) -> list[tuple[str, Array, str, str]]:
    """Velocity and rate of turn of a twist, of the body or of the world (without a rate where that is 0)."""
    x, y, rate = columns[f"{prefix}linear.x"], columns[f"{prefix}linear.y"], -columns[f"{prefix}angular.z"]
    turn = [("yaw_rate", rate, "rad/s", "yaw_rate")]
    if of_world:
        named = [("v_north", y, "m/s", "v_north"), ("v_east", x, "m/s", "v_east")]
        return [*named, *(turn if np.nanmax(np.abs(rate), initial=0.0) > 0 else [])]
    return [("u_ground", x, "m/s", "u_ground"), ("v_ground", -y, "m/s", "v_ground"), *turn]


def _attitude(columns: dict[str, Array], prefix: str) -> list[tuple[str, Array, str, str]]:
    """Heading and heel of a quaternion of REP 103; empty where it is not filled in."""
    w, x, y, z = (columns[f"{prefix}.{axis}"] for axis in "wxyz")
    if not np.nanmax(np.abs(w**2 + x**2 + y**2 + z**2), initial=0.0) > 0.5:
        return []
    roll, _, yaw = heading_of_quaternion(w, x, y, z)
    heading = np.asarray((math.pi / 2 - yaw) % (2 * math.pi))
    return [("heading", heading, "rad", "heading"), ("heel", roll, "rad", "heel")]


def _numbers_of(message: Any, prefix: str = "") -> Iterator[str]:
    """Paths of the numbers of a message: ``twist.linear.x``, ``control[0]``."""
    for name in getattr(message, "__dataclass_fields__", {}):
        if (
            name.startswith("__")
            or any(name == word or name.endswith("_covariance") for word in _OMITTED)
            or name.isupper()
        ):
            continue
        value = getattr(message, name)
        path = f"{prefix}{name}"
        if isinstance(value, bool | int | float | np.number):
            yield path
        elif isinstance(value, np.ndarray | list) and 0 < len(value) <= LONGEST_VECTOR:
            if all(isinstance(item, int | float | np.number) for item in value):
                yield from (f"{path}[{place}]" for place in range(len(value)))
        elif hasattr(value, "__dataclass_fields__"):
            yield from _numbers_of(value, f"{path}.")


def _lists_of(message: Any, prefix: str = "") -> Iterator[str]:
    """Paths of the lists of numbers of a message, whatever their length."""
    for name in getattr(message, "__dataclass_fields__", {}):
        value = getattr(message, name)
        if name.startswith("__") or name in _OMITTED or name.endswith("_covariance"):
            continue
        if hasattr(value, "__dataclass_fields__"):
            yield from _lists_of(value, f"{prefix}{name}.")
        elif isinstance(value, np.ndarray) or (
            isinstance(value, list) and all(isinstance(item, int | float | np.number) for item in value)
        ):
            yield f"{prefix}{name}"


def _getter(path: str) -> Any:
    name, _, place = path.partition("[")
    get = attrgetter(name)
    if not place:
        return get
    index = int(place.rstrip("]"))
    return lambda message: get(message)[index]
