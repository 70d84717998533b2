"""PX4: ULog files (``.ulg``)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from tank2sim.apps.logs.clock import board_start
from tank2sim.apps.logs.findings import LogFinding, fault, not_used, note
from tank2sim.apps.logs.streams import FIELDS, LogStream, VesselLog, heading_of_quaternion, unreadable
from tank2sim.arrays import Array
from tank2sim.errors import InputError, optional_library

_FIELDS = FIELDS["px4"]
_RECEIVERS = ("sensor_gps", "vehicle_gps_position")
# CA_AIRFRAME of two motors that steer by their difference (docs.px4.io, parameter reference)
_AIRFRAME_ROVER_DIFFERENTIAL = 6


@dataclass(frozen=True, eq=False)
class _Topic:
    """A topic of a ULog: its number among the topics of its name, how many these are, and its columns (n,)."""

    name: str
    instance: int
    alike: int
    data: Mapping[str, Any]

    @property
    def label(self) -> str:
        """Its name; with its number where there are several."""
        return f"{self.name}[{self.instance}]" if self.instance or self.alike > 1 else self.name

    @property
    def board_s(self) -> Array:
        """Times by the board's clock (n,), s."""
        return np.asarray(self.data["timestamp"] * 1e-6)

    @property
    def utc_s(self) -> Array:
        """UTC of the fixes of a receiver (n,), s since 1970; 0 where it is not known."""
        return np.asarray(self.data.get("time_utc_usec", np.zeros(len(self.board_s))) * 1e-6)

    def columns(self, part: str) -> dict[str, Array]:
        """Columns (n,) whose names hold a part."""
        return {key: self.data[key].astype(float) for key in sorted(self.data) if part in key}

    @property
    def controls(self) -> dict[str, Array]:
        """Controls (n,) that are used."""
        return {key: values for key, values in self.columns("control[").items() if np.isfinite(values).any()}


# Name, values, unit, quantity, and what states it
_Column = tuple[str, Array, str, str, str]


def read_px4_ulog(path: Path) -> VesselLog:
    """Read a ULog. Times are the board's, set to UTC by the GPS with the least delay; without a GPS that
    has a UTC the log has no date.

    ``actuator_motors`` and ``actuator_servos`` are orders as shares of their range: the one servo is the rudder, one
    motor the propeller, two motors the right and the left one where CA_AIRFRAME says that the difference of two motors
    steers, as PX4 numbers them. Which is which is confirmed by what the vessel does.

    Raises InputError: The file is not a ULog, or no topic of it is understood.
    """
    library = optional_library("pyulog", "logs", path)
    try:
        log = library.ULog(str(path))
    except Exception as error:
        raise unreadable(path, error, "give a whole ULog") from None
    topics = _topics(log)
    gps = next((topic for topic in topics if topic.name in _RECEIVERS and topic.utc_s.any()), None)
    boot, findings = _boot(gps)
    streams = list(_streams(topics, boot, int(log.initial_parameters.get("CA_AIRFRAME", -1))))
    if not streams:
        raise InputError(path, "", "no topic of it is understood", "log sensor_gps, vehicle_attitude, actuator_*")
    read = {stream.name.split(".")[0].split("[")[0] for stream in streams}
    sizes = {topic.name: len(topic.data["timestamp"]) for topic in log.data_list if topic.name not in read}
    findings += not_used("topics", sizes)
    counts = {"messages": sum(len(topic.board_s) for topic in topics), "dropouts": len(log.dropouts)}
    if log.file_corruption:
        findings.append(fault("parts of the file are corrupted and left out"))
    if lost := sum(dropout.duration for dropout in log.dropouts):
        findings.append(note(f"{len(log.dropouts)} dropouts of the logger, {lost / 1000:.3g} s in all"))
    return VesselLog(path, "PX4 ULog", tuple(streams), counts, tuple(findings), gps is not None)


def _topics(log: Any) -> list[_Topic]:
    """Topics of a log but receivers that are in it again: the same fixes, or all receivers' as one."""
    sizes = Counter(topic.name for topic in log.data_list)
    names = sizes.keys() - {"sensor_gps"} if "vehicle_gps_position" in sizes else sizes.keys()
    columns = {(topic.name, topic.multi_id): topic.data for topic in log.data_list if topic.name in names}
    return [_Topic(*key, sizes[key[0]], data) for key, data in columns.items()]


def _boot(gps: _Topic | None) -> tuple[float, list[LogFinding]]:
    """Time of the board at UTC 0, s, and faults of the receiver's clock."""
    if gps is None:
        return 0.0, [note("no GPS of it has a UTC: the trials have no date")]
    findings: list[LogFinding] = []
    return board_start((gps.board_s - gps.utc_s)[gps.utc_s > 0], "sensor_gps", findings), findings


def _streams(topics: Sequence[_Topic], boot: float, airframe: int) -> Iterator[LogStream]:
    """Streams in UTC, or in the board's time."""
    readers: dict[str, Callable[[_Topic], Iterable[_Column]]] = {
        "vehicle_attitude": _attitude,
        "esc_status": _shafts,
        "actuator_servos": lambda topic: _orders(topic.controls, "1", ("rudder_order",), "name"),
        "actuator_motors": partial(_motor_orders, airframe),
    }
    if not {"actuator_motors", "actuator_servos"} & {topic.name for topic in topics}:
        readers["actuator_outputs"] = _pulses  # logs of before PX4 1.13 have pulses alone
    for topic in topics:
        time = topic.board_s - boot
        by_receiver = topic.name in _RECEIVERS and (topic.utc_s > 0).all()
        steady = by_receiver and np.ptp(topic.board_s - topic.utc_s) <= 1.0
        for name, values, *meaning in _fields(topic):
            yield LogStream(f"{topic.label}.{name}", topic.utc_s if steady else time, values, *meaning)
        for name, values, *meaning in readers.get(topic.name, _nothing)(topic):
            yield LogStream(f"{topic.label}.{name}", time, values, *meaning)


def _nothing(topic: _Topic) -> Iterable[_Column]:
    return ()


def _fields(topic: _Topic) -> Iterator[_Column]:
    """The fields of a topic that are quantities; none of a receiver without a fix."""
    fixed = topic.data["fix_type"] >= 2 if "fix_type" in topic.data else np.True_
    for field, (unit, quantity) in _FIELDS.get(topic.name, {}).items():
        if field in topic.data:
            meaning = quantity, "format"
            if topic.name == "rpm" and topic.alike > 1:  # a guess, which the turn confirms or not
                meaning = ("rpm_port", "rpm_starboard")[min(topic.instance, 1)], ""
            yield field, np.where(fixed, topic.data[field].astype(float), np.nan), unit, *meaning


def _attitude(topic: _Topic) -> Iterable[_Column]:
    roll, yaw = heading_of_quaternion(*(topic.data[f"q[{place}]"].astype(float) for place in range(4)))
    return [("heading", yaw % (2 * np.pi), "rad", "heading", "format"), ("heel", roll, "rad", "heel", "format")]


def _shafts(topic: _Topic) -> Iterable[_Column]:
    """Revolutions; of two shafts, PX4 numbers the right one first, which the turn confirms."""
    speeds = {key: values for key, values in topic.columns(".esc_rpm").items() if np.abs(values).max() > 0}
    return _orders(speeds, "rpm", ("rpm",) if len(speeds) == 1 else ("rpm_starboard", "rpm_port"))


def _motor_orders(airframe: int, topic: _Topic) -> Iterable[_Column]:
    two = ("thrust_order_starboard", "thrust_order_port") if airframe == _AIRFRAME_ROVER_DIFFERENTIAL else ()
    return _orders(topic.controls, "1", {1: ("rpm_order",), 2: two}.get(len(topic.controls), ()))


def _pulses(topic: _Topic) -> Iterable[_Column]:
    for key, pulses in topic.columns("output[").items():
        yield key, np.where(pulses > 0, pulses, np.nan), "us", "", ""


def _orders(columns: dict[str, Array], unit: str, quantities: tuple[str, ...], by: str = "") -> Iterator[_Column]:
    """Columns, the first ones of these quantities."""
    for place, (key, values) in enumerate(columns.items()):
        yield key, values, unit, "".join(quantities[place : place + 1]), by
