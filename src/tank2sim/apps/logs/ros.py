"""ROS 1 and ROS 2 bags and MCAP, read without ROS.

Standard messages are in the frames of REP 103: east, north, up for the world, ahead, port, up for the body. Here they
become north, east, and ahead, starboard; a yaw from east to the left becomes a heading from north to the right.
"""

from __future__ import annotations

import math
import tempfile
from array import array
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import cache
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np

from tank2sim.apps.logs.findings import LogFinding, note
from tank2sim.apps.logs.quantities import plain_words
from tank2sim.apps.logs.streams import LogStream, VesselLog, heading_of_quaternion, named_stream, unreadable
from tank2sim.arrays import Array
from tank2sim.errors import InputError, optional_library
from tank2sim.files import first_bytes
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

# Endings that the library needs, by the first bytes of a file
_SUFFIXES = {b"#ROS": ".bag", b"SQLi": ".db3", b"\x89MCA": ".mcap"}
# Names of frames that are fixed to the earth: east, north, up (REP 103, REP 105)
_WORLD_FRAMES = ("map", "odom", "world", "enu", "earth", "local_origin", "utm")

_OMITTED = ("header", "covariance", "seq", "status", "layout", "covariance_type")
_GROUND_WORDS = ("gps", "gnss", "vel", "fix", "navsat", "enu")


def read_ros_bag(path: Path) -> VesselLog:
    """Read a ROS 1 bag, a ROS 2 bag (its folder or file) or an MCAP file.

    Each number of each message becomes a stream, arrays of more than :data:`LONGEST_VECTOR` entries excepted, which are
    named. Times come from the headers where there are any, and from the recording elsewhere; where the headers run at
    another pace, as in a simulation, theirs are taken for all, and the log has no date. Fixes without a status
    of a fix hold no value.

    Raises InputError: The file is cut off or is not a bag, or no message of it has a number.
    """
    topics, failed = _topics(path)
    findings = [note(f"{topic} cannot be decoded ({why})", topic) for topic, why in failed.items()]
    simulated = _simulated_times(topics, findings)
    streams = [stream for topic in topics for stream in topic.streams(simulated, findings)]
    if not streams:
        raise InputError(path, "", "no message of it holds a number", "record topics with measured values")
    counts = {"messages": sum(len(topic.received) for topic in topics), "undecoded_topics": len(failed)}
    form = "MCAP" if _suffix(path) == ".mcap" else "ROS bag"
    return VesselLog(path, form, tuple(streams), counts, tuple(findings), simulated is None)


def _topics(path: Path) -> tuple[list[_Topic], dict[str, str]]:
    """Topics of a bag with their messages, and by name of the error the topics that cannot be decoded."""
    highlevel = optional_library("rosbags.highlevel", "logs", path)
    stores = optional_library("rosbags.typesys", "logs", path)
    store = stores.get_typestore(stores.Stores.LATEST)
    topics: dict[str, _Topic] = {}
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
    except Exception as error:
        remedy = "it may be cut off: repair it with 'rosbag reindex' or 'mcap recover'"
        raise unreadable(path, error, remedy, "cannot be read to its end") from None
    return list(topics.values()), failed


def _named(path: Path, folder: Path) -> Path:
    """The bag under a name that ends as its first bytes say, for the library goes by the name."""
    if path.is_dir() or (suffix := _suffix(path)) == path.suffix:
        return path
    link = folder / f"log{suffix}"
    link.symlink_to(path.resolve())
    return link


def _suffix(path: Path) -> str:
    """The ending that a bag should have, by its first bytes."""
    return "" if path.is_dir() else _SUFFIXES.get(first_bytes(path, 4), path.suffix)


def _simulated_times(topics: Iterable[_Topic], findings: list[LogFinding]) -> tuple[Array, Array] | None:
    """Times of recording and of the headers (n,), s, where these run at another pace; None where they do not."""
    pairs = [np.column_stack(topic.clock) for topic in topics if topic.stamped and len(topic.received) > 1]
    both = np.concatenate([np.zeros((0, 2)), *pairs])
    both = both[both[:, 1] > 0]
    if len(both) < 2 or abs(float(np.median(both[:, 1] - both[:, 0]))) < _OFF_BY_S:
        return None
    both = both[np.argsort(both[:, 0], kind="stable")]
    spans = np.ptp(both, axis=0)
    if not spans.all() or abs(spans[1] / spans[0] - 1) < _PACE:
        return None
    text = f"the times of the headers run {spans[1] / spans[0]:.3g} times as fast as the recording, as of a simulation"
    findings.append(note(f"{text}: they are taken, and the trials have no date"))
    return both[:, 0], both[:, 1]


class _Topic:
    """Numbers of the messages of one topic."""

    def __init__(self, name: str, kind: str, message: Any) -> None:
        header = getattr(message, "header", None)
        self.name, self.kind = name, kind.rpartition("/")[2]
        self.stamped = hasattr(header or message, "stamp")
        self.frame, self.child = (
            str(frame).strip("/").lower()
            for frame in (getattr(header, "frame_id", ""), getattr(message, "child_frame_id", ""))
        )
        self.received, self.stamps = array("d"), array("d")
        self.columns = {path: array("d") for path in _numbers_of(message)}
        self.valid = array("b")
        lists = {path: value for path, value in _fields_of(message) if _is_list(value)}
        self.scans = {path: len(value) for path, value in lists.items() if len(value) > LONGEST_VECTOR}
        self.grows = len(lists) > len(self.scans)  # lists are often empty at first

    def take(self, message: Any, received_ns: int) -> None:
        for path in _numbers_of(message) if self.grows else ():
            if path not in self.columns:
                self.columns[path] = array("d", [math.nan] * len(self.received))
        self.received.append(received_ns * 1e-9)
        if self.stamped:
            stamp = getattr(message, "header", message).stamp
            self.stamps.append(stamp.sec + stamp.nanosec * 1e-9)
        for path, column in self.columns.items():
            try:
                column.append(float(_getter(path)(message)))
            except (IndexError, TypeError, ValueError):
                column.append(math.nan)
        self.valid.append(getattr(getattr(message, "status", None), "status", 0) >= 0)

    @property
    def clock(self) -> tuple[Array, Array]:
        """Times of recording and of the headers (n,), s."""
        return np.frombuffer(self.received, dtype=float), np.frombuffer(self.stamps, dtype=float)

    def _time(self, simulated: tuple[Array, Array] | None, findings: list[LogFinding]) -> Array:
        received, stamps = self.clock
        if simulated is not None:
            return np.where(stamps > 0, stamps, np.nan) if self.stamped else np.interp(received, *simulated)
        if self.stamped and abs(float(np.median(stamps - received))) < _OFF_BY_S:
            return stamps
        if (stamps != 0).any():
            text = f"{self.name}: header times differ from recording times, which are used"
            findings.append(note(text, self.name))
        return received

    def streams(self, simulated: tuple[Array, Array] | None, findings: list[LogFinding]) -> Iterator[LogStream]:
        time = self._time(simulated, findings)
        for path, size in self.scans.items():
            text = f"{self.name}.{path} has {size} entries, more than {LONGEST_VECTOR}, and is not read"
            findings.append(note(text, self.name))
        valid = np.frombuffer(self.valid, dtype=np.int8) > 0
        columns = {
            path: np.where(valid, np.frombuffer(values, dtype=float), np.nan) for path, values in self.columns.items()
        }
        converted = self._standard(columns)
        for quantity, values, unit in converted:
            yield LogStream(f"{self.name}.{quantity}", time, values, unit, quantity, "format")
        for path, values in columns.items() if not converted else ():
            name = self.name if path == "data" else f"{self.name}.{path}"
            stream = named_stream(name, time, values, split_unit(name.replace("/", " ").replace(".", " "))[1])
            if stream.quantity.startswith("wind") and stream.quantity.endswith("speed") and not stream.unit:
                # REP 103: SI; what can be tested by content is not taken for granted
                stream = replace(stream, unit="m/s")
            yield stream

    def _standard(self, columns: dict[str, Array]) -> list[tuple[str, Array, str]]:
        """Quantities, values and units of a standard message in the frames of trials; empty for any other message."""
        prefix = _PREFIXES.get(self.kind, "")
        if self.kind == "NavSatFix":
            return [(name, columns[name], "deg") for name in ("latitude", "longitude")]
        if self.kind == "Imu":
            return [
                *_attitude(columns, "orientation"),
                ("yaw_rate", -columns["angular_velocity.z"], "rad/s"),
                ("a_x", columns["linear_acceleration.x"], "m/s2"),
                ("a_y", -columns["linear_acceleration.y"], "m/s2"),
            ]
        if self.kind == "Odometry":
            return [*_pose(columns, "pose.pose."), *_velocity(columns, "twist.twist.", self.child in _WORLD_FRAMES)]
        if self.kind in _POSES:
            return _pose(columns, prefix)
        words = set(plain_words(self.name).split())
        measured = (
            self.kind in _PREFIXES
            and {f"{prefix}linear.x", f"{prefix}linear.y"} <= columns.keys()
            and words.isdisjoint(_ORDER_WORDS)
        )
        of_world = not words.isdisjoint(_GROUND_WORDS) or self.frame in _WORLD_FRAMES
        return _velocity(columns, prefix, of_world) if measured else []


# Beginnings of the paths of standard messages
_PREFIXES = {
    "Twist": "",
    "TwistStamped": "twist.",
    "TwistWithCovarianceStamped": "twist.twist.",
    "Pose": "",
    "PoseStamped": "pose.",
    "PoseWithCovarianceStamped": "pose.pose.",
}
_POSES = ("Pose", "PoseStamped", "PoseWithCovarianceStamped")
_ORDER_WORDS = ("cmd", "command", "setpoint")


def _velocity(columns: dict[str, Array], prefix: str, of_world: bool) -> list[tuple[str, Array, str]]:
    """Velocity and rate of turn of a twist, of the body or of the world (without a rate where that is 0)."""
    x, y, rate = columns[f"{prefix}linear.x"], columns[f"{prefix}linear.y"], -columns[f"{prefix}angular.z"]
    turn = [("yaw_rate", rate, "rad/s")]
    if of_world:
        turn = turn if np.nanmax(np.abs(rate), initial=0.0) > 0 else []
        return [("v_north", y, "m/s"), ("v_east", x, "m/s"), *turn]
    return [("u_ground", x, "m/s"), ("v_ground", -y, "m/s"), *turn]


def _pose(columns: dict[str, Array], prefix: str) -> list[tuple[str, Array, str]]:
    """Position, heading and heel of a pose of REP 103."""
    x, y = columns[f"{prefix}position.y"], columns[f"{prefix}position.x"]
    return [("x", x, "m"), ("y", y, "m"), *_attitude(columns, f"{prefix}orientation")]


def _attitude(columns: dict[str, Array], prefix: str) -> list[tuple[str, Array, str]]:
    """Heading and heel of a quaternion of REP 103; empty where it is not filled in."""
    w, x, y, z = (columns[f"{prefix}.{axis}"] for axis in "wxyz")
    if not np.nanmax(np.abs(w**2 + x**2 + y**2 + z**2), initial=0.0) > 0.5:
        return []
    roll, yaw = heading_of_quaternion(w, x, y, z)
    return [("heading", np.asarray((math.pi / 2 - yaw) % (2 * math.pi)), "rad"), ("heel", roll, "rad")]


def _fields_of(message: Any, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Paths and values of a message and those within it: ``twist.linear.x``."""
    for name in getattr(message, "__dataclass_fields__", {}):
        if name.startswith("__") or name in _OMITTED or name.endswith("_covariance"):
            continue
        value = getattr(message, name)
        if hasattr(value, "__dataclass_fields__"):
            yield from _fields_of(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value


def _is_list(value: Any) -> bool:
    """Whether a value is a list of numbers."""
    return isinstance(value, np.ndarray) or (
        isinstance(value, list) and all(isinstance(item, int | float | np.number) for item in value)
    )


def _numbers_of(message: Any) -> Iterator[str]:
    """Paths of the numbers of a message: ``twist.linear.x``, ``control[0]``."""
    for path, value in _fields_of(message):
        if path.rpartition(".")[2].isupper():
            continue
        if isinstance(value, bool | int | float | np.number):
            yield path
        elif _is_list(value) and len(value) <= LONGEST_VECTOR:
            yield from (f"{path}[{place}]" for place in range(len(value)))


@cache
def _getter(path: str) -> Callable[[Any], Any]:
    """Function that gets the number at a path out of a message."""
    name, _, place = path.partition("[")
    get, index = attrgetter(name), int(place.rstrip("]") or 0)
    return (lambda message: get(message)[index]) if place else get
