"""PX4: ULog files (``.ulg``)."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from tank2sim.apps.logs.clock import board_start
from tank2sim.apps.logs.streams import (
    LogFinding,
    LogStream,
    VesselLog,
    heading_of_quaternion,
    not_used,
    optional_library,
)
from tank2sim.arrays import Array
from tank2sim.errors import InputError

_FIELDS: dict[str, dict[str, tuple[str, str]]] = {
    "sensor_gps": {
        "latitude_deg": ("deg", "latitude"),
        "longitude_deg": ("deg", "longitude"),
        "lat": ("1e-7 deg", "latitude"),
        "lon": ("1e-7 deg", "longitude"),
        "vel_m_s": ("m/s", "sog"),
        "cog_rad": ("rad", "cog"),
        "vel_n_m_s": ("m/s", "v_north"),
        "vel_e_m_s": ("m/s", "v_east"),
    },
    "vehicle_local_position": {
        "x": ("m", "x"),
        "y": ("m", "y"),
        "vx": ("m/s", "v_north"),
        "vy": ("m/s", "v_east"),
    },
    "vehicle_angular_velocity": {"xyz[2]": ("rad/s", "yaw_rate")},
    "vehicle_acceleration": {"xyz[0]": ("m/s2", "a_x"), "xyz[1]": ("m/s2", "a_y")},
    "rpm": {"rpm_estimate": ("rpm", "rpm"), "indicated_frequency_rpm": ("rpm", "rpm")},
}
"""Fields of uORB messages (docs.px4.io, "uORB Message Reference"); frames north, east, down and ahead, starboard,
down."""
_FIELDS["vehicle_gps_position"] = _FIELDS["sensor_gps"]

_RECEIVERS = ("sensor_gps", "vehicle_gps_position")
_AIRFRAME_ROVER_DIFFERENTIAL = 6
"""CA_AIRFRAME of two motors that steer by their difference (docs.px4.io, parameter reference)."""


def read_px4_ulog(path: Path) -> VesselLog:
    """Read a ULog. Times are those of the board, set to UTC by the GPS with the least delay; without a GPS that
    has a UTC the log has no date.

    ``actuator_motors`` and ``actuator_servos`` are orders as shares of their range: the one servo is the rudder, one
    motor the propeller, two motors the right and the left one where CA_AIRFRAME says that the difference of two motors
    steers, as PX4 numbers them. Which is which is confirmed by what the vessel does.

    Raises
    ------
    InputError
        The file is not a ULog, or no topic of it is understood.
    """
    library = optional_library("pyulog", path)
    try:
        log = library.ULog(str(path))
    except Exception as error:  # the library lets errors of struct, and TypeError, through
        problem = f"cannot be read ({type(error).__name__}: {' '.join(str(error).split())[:100]})"
        raise InputError(path, "", problem, "give a whole ULog") from None
    topics = {(topic.name, topic.multi_id): topic.data for topic in log.data_list}
    if any(name == "vehicle_gps_position" for name, _ in topics):  # the same fixes, or those of all receivers as one
        topics = {(name, instance): data for (name, instance), data in topics.items() if name != "sensor_gps"}
    receivers = [data for (name, _), data in topics.items() if name in _RECEIVERS]
    gps = next((data for data in receivers if _utc_of(data).any()), None)
    boot, findings = 0.0, list[LogFinding]()
    if gps is None:
        findings.append(LogFinding("note", "no GPS of it has a UTC: the trials have no date"))
    else:
        known = gps["time_utc_usec"] > 0
        boot = board_start(
            (gps["timestamp"][known] * 1e-6 - gps["time_utc_usec"][known] * 1e-6), "sensor_gps", findings
        )
    airframe = int(log.initial_parameters.get("CA_AIRFRAME", -1))
    streams = list(_streams(topics, boot, airframe))
    if not streams:
        raise InputError(path, "", "no topic of it is understood", "log sensor_gps, vehicle_attitude, actuator_*")
    read = {stream.name.split(".")[0].split("[")[0] for stream in streams}
    findings += not_used(
        "topics", {topic.name: len(topic.data["timestamp"]) for topic in log.data_list if topic.name not in read}
    )
    counts = {"messages": sum(len(data["timestamp"]) for data in topics.values()), "dropouts": len(log.dropouts)}
    if log.file_corruption:
        findings.append(LogFinding("fault", "parts of the file are corrupted and left out"))
    if lost := sum(dropout.duration for dropout in log.dropouts):
        findings.append(LogFinding("note", f"{len(log.dropouts)} dropouts of the logger, {lost / 1000:.3g} s in all"))
    return VesselLog(path, "PX4 ULog", tuple(streams), counts, tuple(findings), gps is not None)


def _utc_of(data: dict[str, Any]) -> Array:
    """UTC of the fixes of a receiver (n,), us since 1970; 0 where it is not known."""
    return np.asarray(data.get("time_utc_usec", np.zeros(len(data["timestamp"]))))


def _streams(topics: dict[tuple[str, int], dict[str, Any]], boot: float, airframe: int) -> Iterator[LogStream]:
    ordered = any(name in ("actuator_motors", "actuator_servos") for name, _ in topics)
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
        if name == "vehicle_attitude":
            roll, _, yaw = heading_of_quaternion(*(data[f"q[{place}]"].astype(float) for place in range(4)))
            yield LogStream(f"{label}.heading", time, yaw % (2 * np.pi), "rad", "heading", "format")
            yield LogStream(f"{label}.heel", time, roll, "rad", "heel", "format")
        if name == "esc_status":
            yield from _speeds(label, time, data)
        if name in ("actuator_motors", "actuator_servos"):
            yield from _orders(name, time, data, airframe)
        if name == "actuator_outputs" and not ordered:  # logs of before PX4 1.13 have pulses alone
            for key in sorted(key for key in data if key.startswith("output[")):
                pulses = data[key].astype(float)
                yield LogStream(f"{label}.{key}", time, np.where(pulses > 0, pulses, np.nan), "us")


def _speeds(label: str, time: Array, data: dict[str, Any]) -> Iterator[LogStream]:
    """Revolutions that speed controllers report; of two, PX4 numbers the right one first, which the turn confirms."""
    keys = [key for key in data if key.endswith(".esc_rpm") and np.abs(data[key].astype(float)).max() > 0]
    quantities = ("rpm",) if len(keys) == 1 else ("rpm_starboard", "rpm_port")
    for place, key in enumerate(sorted(keys)):
        quantity = quantities[place] if place < len(quantities) else ""
        yield LogStream(f"{label}.{key}", time, data[key].astype(float), "rpm", quantity, "")


def _orders(name: str, time: Array, data: dict[str, Any], airframe: int) -> Iterator[LogStream]:
    controls = {key: data[key].astype(float) for key in sorted(data) if key.startswith("control[")}
    controls = {key: values for key, values in controls.items() if np.isfinite(values).any()}
    quantities: tuple[str, ...] = ()
    if name == "actuator_servos":
        quantities = ("rudder_order",)
    elif len(controls) == 1:
        quantities = ("rpm_order",)
    elif len(controls) == 2 and airframe == _AIRFRAME_ROVER_DIFFERENTIAL:
        quantities = ("thrust_order_starboard", "thrust_order_port")
    for place, (key, values) in enumerate(controls.items()):
        quantity = quantities[place] if place < len(quantities) else ""
        yield LogStream(f"{name}.{key}", time, values, "1", quantity, "name" if name == "actuator_servos" else "")
