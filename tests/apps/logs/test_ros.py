"""Bags that the tests write: frames of REP 103, header stamps, fixes without a status, topics without a meaning."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tank2sim.apps.logs.command import log
from tank2sim.apps.logs.reading import read_log
from tests.apps.logs.made_logs import T0, degrees, stream_of, voyage
from tests.marks import first_fast

pytest.importorskip("rosbags")

from rosbags.rosbag2 import Writer
from rosbags.typesys import Stores, get_typestore


def write_bag(
    folder: Path, *, heading_is_ned: bool = False, stamps_off_s: float = 0.0, pace: float = 1.0, frame: str = ""
) -> Path:
    """A ROS 2 bag of the made-up voyage at 2 Hz: a fix, an Imu, the rudder in rad as a plain number and in arrays.

    The arrays are of 0 entries at first, then of 16, and of 300. The pace is of the headers against the recording; with
    a frame, the velocity of the world is under a topic that does not say so.
    """
    store = get_typestore(Stores.ROS2_HUMBLE)
    types = store.types
    made, (latitude, longitude) = voyage(), degrees()
    path = folder / "bag"
    zeros, north_east = np.zeros(9), [np.gradient(part, made.time) for part in (made.x, made.y)]
    with Writer(path, version=9) as writer:
        kinds = {
            "/fix": "sensor_msgs/msg/NavSatFix",
            "/imu": "sensor_msgs/msg/Imu",
            "/rudder_angle": "std_msgs/msg/Float64",
            "/outputs": "std_msgs/msg/Float64MultiArray",
            "/scan": "std_msgs/msg/Float64MultiArray",
            "/motion": "geometry_msgs/msg/TwistStamped",
        }
        topics = {topic: writer.add_connection(topic, kind, typestore=store) for topic, kind in kinds.items()}

        def put(topic: str, time_s: float, message: object) -> None:
            received = round((T0 + time_s / pace + 0.05) * 1e9)  # 50 ms under way
            writer.write(topics[topic], received, store.serialize_cdr(message, kinds[topic]))

        for k, t in enumerate(made.time):
            stamp = types["builtin_interfaces/msg/Time"](sec=int(T0 + t + stamps_off_s), nanosec=int(1e9 * (t % 1)))
            header = types["std_msgs/msg/Header"](stamp=stamp, frame_id=frame)
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
            layout = types["std_msgs/msg/MultiArrayLayout"]([], 0)
            values = np.full(0 if k < 10 else 16, float(made.rudder[k]))
            put("/outputs", t, types["std_msgs/msg/Float64MultiArray"](layout, values))
            if k < 5:
                put("/scan", t, types["std_msgs/msg/Float64MultiArray"](layout, np.zeros(300)))
            if frame:
                velocity = vector(float(north_east[1][k]), float(north_east[0][k]), 0.0)
                twist = types["geometry_msgs/msg/Twist"](velocity, vector(0.0, 0.0, 0.0))
                put("/motion", t, types["geometry_msgs/msg/TwistStamped"](header, twist))
    return path


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
    assert result.cautions == ()


def test_a_heading_against_rep_103_is_left_out(tmp_path) -> None:
    result = log(write_bag(tmp_path, heading_is_ned=True))
    used = {channel.quantity for channel in result.voyage.channels.channels if channel.use}
    assert "heading" not in used and any("/imu.heading" in mark for mark in result.cautions)


def test_stamps_of_an_unset_clock_are_not_taken(tmp_path) -> None:
    found = read_log(write_bag(tmp_path, stamps_off_s=-T0))
    assert np.allclose(stream_of(found, "/imu.heading").time_s - T0, voyage().time + 0.05, atol=1e-6)
    assert any(finding.kind == "note" and "header times" in finding.text for finding in found.findings)


def test_arrays_are_read_up_to_32_entries_and_longer_ones_named(tmp_path) -> None:
    found = read_log(write_bag(tmp_path))
    output = stream_of(found, "/outputs.data[15]")
    assert np.isnan(output.values[:10]).all() and np.allclose(output.values[10:], voyage().rudder[10:])
    assert any("/scan.data has 300 entries" in finding.text for finding in found.findings)


@first_fast("frame", ["map", "odom", "/map"])
def test_a_velocity_in_a_frame_of_the_world_is_to_north_and_east(tmp_path, frame) -> None:
    found, made = read_log(write_bag(tmp_path, frame=frame)), voyage()
    named = {stream.quantity: stream.values for stream in found.streams if stream.name.startswith("/motion")}
    assert named.keys() == {"v_north", "v_east"}
    assert np.allclose(named["v_north"], np.gradient(made.x, made.time))
    assert np.allclose(named["v_east"], np.gradient(made.y, made.time))


@first_fast("frame", ["base_link", "gyro_link"])
def test_a_velocity_in_a_frame_of_the_body_is_ahead_and_to_starboard(tmp_path, frame) -> None:
    found = read_log(write_bag(tmp_path, frame=frame))
    named = {stream.quantity for stream in found.streams if stream.name.startswith("/motion")}
    assert named == {"u_ground", "v_ground", "yaw_rate"}


@first_fast("pace", [5.0, 0.5])
def test_a_simulation_at_another_pace_has_the_times_of_its_headers(tmp_path, pace) -> None:
    found = read_log(write_bag(tmp_path, stamps_off_s=-T0 + 100, pace=pace))
    for name, late in (("/imu.heading", 0.0), ("/rudder_angle", 0.05 * pace)):
        time = stream_of(found, name).time_s
        assert np.ptp(time) == pytest.approx(np.ptp(voyage().time), abs=0.3) and abs(time[-1] - 999.5) < 0.6 + late
    assert not found.dated and any("as of a simulation" in finding.text for finding in found.findings)
