"""PX4: ULog files (``.ulg``)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from tank2sim.apps.logs.clock import board_start
from tank2sim.apps.logs.streams import (
    FIELDS,
    LogFinding,
    LogStream,
    VesselLog,
    fault,
    heading_of_quaternion,
    not_used,
    note,
    unreadable,
)
from tank2sim.arrays import Array
from tank2sim.errors import InputError, optional_library

_FIELDS = FIELDS["px4"]
_RECEIVERS = ("sensor_gps", "vehicle_gps_position")
# CA_AIRFRAME of two motors that steer by their difference (docs.px4.io, parameter reference)
_AIRFRAME_ROVER_DIFFERENTIAL = 6


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
    topics = {(topic.name, topic.multi_id): topic.data for topic in log.data_list}
    if any(name == "vehicle_gps_position" for name, _ in topics):  # the same fixes, or all receivers' as one
        topics = {(name, instance): data for (name, instance), data in topics.items() if name != "sensor_gps"}
    receivers = [data for (name, _), data in topics.items() if name in _RECEIVERS]
    gps = next((data for data in receivers if _utc_of(data).any()), None)
    boot, findings = _boot(gps)
    streams = list(_streams(topics, boot, int(log.initial_parameters.get("CA_AIRFRAME", -1))))
    if not streams:
        raise InputError(path, "", "no topic of it is understood", "log sensor_gps, vehicle_attitude, actuator_*")
    read = {stream.name.split(".")[0].split("[")[0] for stream in streams}
    sizes = {topic.name: len(topic.data["timestamp"]) for topic in log.data_list if topic.name not in read}
    findings += not_used("topics", sizes)
    counts = {"messages": sum(len(data["timestamp"]) for data in topics.values()), "dropouts": len(log.dropouts)}
    if log.file_corruption:
        findings.append(fault("parts of the file are corrupted and left out"))
    if lost := sum(dropout.duration for dropout in log.dropouts):
        findings.append(note(f"{len(log.dropouts)} dropouts of the logger, {lost / 1000:.3g} s in all"))
    return VesselLog(path, "PX4 ULog", tuple(streams), counts, tuple(findings), gps is not None)


def _boot(gps: dict[str, Any] | None) -> tuple[float, list[LogFinding]]:
    """Time of the board at UTC 0, s, and faults of the receiver's clock."""
    if gps is None:
        return 0.0, [note("no GPS of it has a UTC: the trials have no date")]
    findings: list[LogFinding] = []
    known = gps["time_utc_usec"] > 0
    lag = gps["timestamp"][known] * 1e-6 - gps["time_utc_usec"][known] * 1e-6
    return board_start(lag, "sensor_gps", findings), findings


def _utc_of(data: dict[str, Any]) -> Array:
    """UTC of the fixes of a receiver (n,), us since 1970; 0 where it is not known."""
    return np.asarray(data.get("time_utc_usec", np.zeros(len(data["timestamp"]))))


def _streams(topics: dict[tuple[str, int], dict[str, Any]], boot: float, airframe: int) -> Iterator[LogStream]:
    readers: dict[str, Callable[[str, Array, dict[str, Any]], Iterator[LogStream]]] = {
        "vehicle_attitude": _attitude,
        "esc_status": _shafts,
        "actuator_servos": _rudder_order,
        "actuator_motors": partial(_motor_orders, airframe),
    }
    if not any(name in ("actuator_motors", "actuator_servos") for name, _ in topics):
        readers["actuator_outputs"] = _pulses  # logs of before PX4 1.13 have pulses alone
    for (name, instance), data in topics.items():
        time = data["timestamp"] * 1e-6 - boot
        label = name if instance == 0 and (name, 1) not in topics else f"{name}[{instance}]"
        if name in _RECEIVERS and (_utc_of(data) > 0).all():
            utc = _utc_of(data) * 1e-6
            time = utc if np.ptp(data["timestamp"] * 1e-6 - utc) <= 1.0 else time
        for field, (unit, quantity) in _FIELDS.get(name, {}).items():
            if field in data:
                values = data[field].astype(float)
                if "fix_type" in data:
                    values = np.where(data["fix_type"] >= 2, values, np.nan)
                meaning = (quantity, "format")
                if name == "rpm" and ("rpm", 1) in topics:  # a guess, which the turn confirms or not
                    meaning = (("rpm_port", "rpm_starboard")[min(instance, 1)], "")
                yield LogStream(f"{label}.{field}", time, values, unit, *meaning)
        if name in readers:
            yield from readers[name](label, time, data)


def _attitude(label: str, time: Array, data: dict[str, Any]) -> Iterator[LogStream]:
    roll, yaw = heading_of_quaternion(*(data[f"q[{place}]"].astype(float) for place in range(4)))
    yield LogStream(f"{label}.heading", time, yaw % (2 * np.pi), "rad", "heading", "format")
    yield LogStream(f"{label}.heel", time, roll, "rad", "heel", "format")


def _shafts(label: str, time: Array, data: dict[str, Any]) -> Iterator[LogStream]:
    """Revolutions; of two shafts, PX4 numbers the right one first, which the turn confirms."""
    speeds = {key: values for key, values in _columns(data, ".esc_rpm") if np.abs(values).max() > 0}
    quantities = ("rpm",) if len(speeds) == 1 else ("rpm_starboard", "rpm_port")
    return _orders(label, time, speeds, "rpm", quantities)


def _rudder_order(label: str, time: Array, data: dict[str, Any]) -> Iterator[LogStream]:
    return _orders(label, time, _controls(data), "1", ("rudder_order",), "name")


def _motor_orders(airframe: int, label: str, time: Array, data: dict[str, Any]) -> Iterator[LogStream]:
    two = ("thrust_order_starboard", "thrust_order_port") if airframe == _AIRFRAME_ROVER_DIFFERENTIAL else ()
    controls = _controls(data)
    return _orders(label, time, controls, "1", {1: ("rpm_order",), 2: two}.get(len(controls), ()))


def _pulses(label: str, time: Array, data: dict[str, Any]) -> Iterator[LogStream]:
    for key, pulses in _columns(data, "output["):
        yield LogStream(f"{label}.{key}", time, np.where(pulses > 0, pulses, np.nan), "us")


def _columns(data: dict[str, Any], part: str) -> list[tuple[str, Array]]:
    """Names that hold a part, and values (n,)."""
    return [(key, data[key].astype(float)) for key in sorted(data) if part in key]


def _controls(data: dict[str, Any]) -> dict[str, Array]:
    return {key: values for key, values in _columns(data, "control[") if np.isfinite(values).any()}


def _orders(
    label: str, time: Array, columns: dict[str, Array], unit: str, quantities: tuple[str, ...], by: str = ""
) -> Iterator[LogStream]:
    """Streams of columns, the first ones of these quantities."""
    for place, (key, values) in enumerate(columns.items()):
        yield LogStream(f"{label}.{key}", time, values, unit, "".join(quantities[place : place + 1]), by)
