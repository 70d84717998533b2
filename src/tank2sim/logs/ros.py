"""ROS 1 and ROS 2 bags and MCAP, read without ROS.

Standard messages are in the frames of REP 103: east, north, up for the world, ahead, port, up for the body. Here they
become north, east, and ahead, starboard; a yaw from east to the left becomes a heading from north to the right.
"""

from __future__ import annotations

import math
from array import array
from collections import defaultdict
from collections.abc import Iterator
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np

from tank2sim.arrays import Array
from tank2sim.errors import InputError
from tank2sim.logs.quantities import QUANTITIES, plain_words, quantity_of_name
from tank2sim.logs.streams import LogFinding, LogStream, VesselLog, heading_of_quaternion, optional_library
from tank2sim.records.spelt_units import split_unit

LONGEST_VECTOR = 8
"""Entries of an array up to which each is a stream. Project choice: actuators and joints are few, scans and pictures
are not."""

_OFF_BY_S = 3600.0
"""Difference of the time in a header from the time of recording beyond which the header's is not UTC. Project choice:
latencies are seconds; a simulated or unset clock is off by years."""

_OMITTED = ("header", "covariance", "seq", "status", "layout", "covariance_type")
_GROUND_WORDS = ("gps", "gnss", "vel", "fix", "navsat", "enu")


def read_ros_bag(path: Path) -> VesselLog:
    """Read a ROS 1 bag, a ROS 2 bag (its folder or file) or an MCAP file.

    Each number of each message becomes a stream, arrays of more than :data:`LONGEST_VECTOR` entries excepted. Times are
    those of the headers where there are any, and of the recording elsewhere. Fixes without a status of a fix hold no
    value.

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
        with highlevel.AnyReader([path], default_typestore=store) as reader:
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
    streams = [stream for topic in topics.values() for stream in topic.streams(findings)]
    if not streams:
        raise InputError(path, "", "no message of it holds a number", "record topics with measured values")
    counts = {"messages": sum(len(topic.received) for topic in topics.values()), "undecoded_topics": len(failed)}
    return VesselLog(path, "ROS bag" if path.suffix != ".mcap" else "MCAP", tuple(streams), counts, tuple(findings))


class _Topic:
    """Numbers of the messages of one topic."""

    def __init__(self, name: str, kind: str, message: Any) -> None:
        self.name, self.kind = name, kind.replace("/msg/", "/")
        self.paths = list(_numbers_of(message))
        self.get = [_getter(path) for path in self.paths]
        self.stamped = hasattr(message, "header") and hasattr(message.header, "stamp")
        self.received, self.stamps = array("d"), array("d")
        self.columns: dict[str, array[float]] = defaultdict(lambda: array("d"))
        self.valid = array("b")

    def take(self, message: Any, received_ns: int) -> None:
        self.received.append(received_ns * 1e-9)
        if self.stamped:
            self.stamps.append(message.header.stamp.sec + message.header.stamp.nanosec * 1e-9)
        for path, get in zip(self.paths, self.get, strict=True):
            try:
                self.columns[path].append(float(get(message)))
            except (IndexError, TypeError, ValueError):
                self.columns[path].append(math.nan)
        self.valid.append(getattr(getattr(message, "status", None), "status", 0) >= 0)

    def _time(self, findings: list[LogFinding]) -> Array:
        received = np.frombuffer(self.received, dtype=float)
        if not self.stamped:
            return received
        stamps = np.frombuffer(self.stamps, dtype=float)
        if abs(float(np.median(stamps - received))) < _OFF_BY_S:
            return stamps
        if (stamps != 0).any():
            text = f"{self.name}: the times of its headers are not those of the recording, which are taken"
            findings.append(LogFinding("note", text, self.name))
        return received

    def streams(self, findings: list[LogFinding]) -> Iterator[LogStream]:
        time = self._time(findings)
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
                ("u_ground", columns["twist.twist.linear.x"], "m/s", "u_ground"),
                ("v_ground", -columns["twist.twist.linear.y"], "m/s", "v_ground"),
                ("yaw_rate", -columns["twist.twist.angular.z"], "rad/s", "yaw_rate"),
            ]
        if kind in ("Twist", "TwistStamped", "TwistWithCovarianceStamped"):
            prefix = {"Twist": "", "TwistStamped": "twist.", "TwistWithCovarianceStamped": "twist.twist."}[kind]
            ahead, left = pick(f"{prefix}linear.x"), pick(f"{prefix}linear.y")
            words = plain_words(self.name).split()
            if ahead is None or left is None or {"cmd", "command", "setpoint"} & set(words):
                return []
            if set(words) & set(_GROUND_WORDS):
                return [("v_north", left, "m/s", "v_north"), ("v_east", ahead, "m/s", "v_east")]
            rate = -columns[f"{prefix}angular.z"]
            return [
                ("u_ground", ahead, "m/s", "u_ground"),
                ("v_ground", -left, "m/s", "v_ground"),
                ("yaw_rate", rate, "rad/s", "yaw_rate"),
            ]
        if kind in ("Pose", "PoseStamped", "PoseWithCovarianceStamped"):
            prefix = {"Pose": "", "PoseStamped": "pose.", "PoseWithCovarianceStamped": "pose.pose."}[kind]
            return [
                ("x", columns[f"{prefix}position.y"], "m", "x"),
                ("y", columns[f"{prefix}position.x"], "m", "y"),
                *_attitude(columns, f"{prefix}orientation"),
            ]
        return []


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


def _getter(path: str) -> Any:
    name, _, place = path.partition("[")
    get = attrgetter(name)
    if not place:
        return get
    index = int(place.rstrip("]"))
    return lambda message: get(message)[index]
