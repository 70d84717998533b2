"""Bags that the tests write: frames of REP 103, header stamps, fixes without a status, topics without a meaning."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tank2sim.api.log import log
from tank2sim.logs.reading import read_log
from tests.logs.made_logs import T0, degrees, voyage

pytest.importorskip("rosbags")

from rosbags.rosbag2 import Writer
from rosbags.typesys import Stores, get_typestore


def write_bag(folder: Path, *, heading_is_ned: bool = False, stamps_off_s: float = 0.0) -> Path:
    """A ROS 2 bag of the made-up voyage at 2 Hz: a fix, an Imu, and the rudder in rad as a plain number."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    types = store.types
    made, (latitude, longitude) = voyage(), degrees()
    path = folder / "bag"
    zeros = np.zeros(9)
    with Writer(path, version=9) as writer:
        kinds = {
            "/fix": "sensor_msgs/msg/NavSatFix",
            "/imu": "sensor_msgs/msg/Imu",
            "/rudder_angle": "std_msgs/msg/Float64",
        }
        topics = {topic: writer.add_connection(topic, kind, typestore=store) for topic, kind in kinds.items()}

        def put(topic: str, time_s: float, message: object) -> None:
            received = round((T0 + time_s + 0.05) * 1e9)  # 50 ms under way
            writer.write(topics[topic], received, store.serialize_cdr(message, kinds[topic]))

        for k, t in enumerate(made.time):
            stamp = types["builtin_interfaces/msg/Time"](sec=int(T0 + t + stamps_off_s), nanosec=int(1e9 * (t % 1)))
            header = types["std_msgs/msg/Header"](stamp=stamp, frame_id="")
            status = types["sensor_msgs/msg/NavSatStatus"](status=-1 if 100 <= k < 110 else 0, service=1)
            fix = types["sensor_msgs/msg/NavSatFix"](
                header, status, float(latitude[k]), float(longitude[k]), 0.0, zeros, 0
            )
            put("/fix", t, fix)
            yaw = made.heading[k] if heading_is_ned else np.pi / 2 - made.heading[k]
            vector, turn = types["geometry_msgs/msg/Vector3"], types["geometry_msgs/msg/Quaternion"]
            imu = types["sensor_msgs/msg/Imu"](
                header,
                turn(0.0, 0.0, float(np.sin(yaw / 2)), float(np.cos(yaw / 2))),
                zeros,
                vector(0.0, 0.0, float(-made.rate[k])),
                zeros,
                vector(0.0, 0.0, 9.81),
                zeros,
            )
            put("/imu", t, imu)
            put("/rudder_angle", t, types["std_msgs/msg/Float64"](float(made.rudder[k])))
    return path


def stream_of(found, name):
    return next(stream for stream in found.streams if stream.name == name)


def test_frames_of_rep_103_become_those_of_trials(tmp_path) -> None:
    found = read_log(write_bag(tmp_path))
    made = voyage()
    heading = stream_of(found, "/imu.heading")
    error = (heading.values - made.heading + np.pi) % (2 * np.pi) - np.pi
    assert np.abs(error).max() < 1e-12
    assert np.allclose(stream_of(found, "/imu.yaw_rate").values, made.rate)
    assert np.allclose(heading.time_s - T0, made.time, atol=1e-6)  # of the header, not of the recording
    assert np.allclose(stream_of(found, "/rudder_angle").time_s - T0, made.time + 0.05, atol=1e-6)


def test_a_fix_without_a_fix_holds_no_position(tmp_path) -> None:
    latitude = stream_of(read_log(write_bag(tmp_path)), "/fix.latitude")
    assert np.isnan(latitude.values[100:110]).all() and np.isfinite(latitude.values).sum() == len(latitude.values) - 10


def test_manoeuvres_of_a_bag_are_found(tmp_path) -> None:
    result = log(write_bag(tmp_path))
    assert [stretch.kind.value for stretch in result.found if stretch.kind.excites] == ["zigzag", "turn"]
    assert result.marks == ()


def test_a_heading_against_rep_103_is_left_out(tmp_path) -> None:
    result = log(write_bag(tmp_path, heading_is_ned=True))
    used = {channel.quantity for channel in result.voyage.channels.channels if channel.use}
    assert "heading" not in used and any("/imu.heading" in mark for mark in result.marks)


def test_stamps_of_an_unset_clock_are_not_taken(tmp_path) -> None:
    found = read_log(write_bag(tmp_path, stamps_off_s=-T0))
    assert np.allclose(stream_of(found, "/imu.heading").time_s - T0, voyage().time + 0.05, atol=1e-6)
    assert any("times of its headers" in finding.text for finding in found.findings)
