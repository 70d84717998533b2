"""Orders as pulses of 1000 to 2000 us: of the columns of a table, of PX4 and of ArduPilot without its parameters."""

from __future__ import annotations

import struct
from types import SimpleNamespace

import numpy as np
import pytest

from tank2sim.apps.logs import px4
from tank2sim.apps.logs.command import log
from tank2sim.apps.logs.reading import read_log
from tank2sim.apps.logs.recorded import pulses_of
from tank2sim.apps.logs.streams import LogStream
from tests.apps.logs.made_logs import T0, craft, frame, motion, voyage
from tests.marks import first_fast


@first_fast(
    ("port", "starboard", "span"),
    [("pwm_left", "pwm_right", 400), ("servo3_raw", "servo1_raw", 500), ("ch1out", "ch2out", 400), ("C3", "C1", 400)],
)
def test_sides_and_shares_of_two_thrusters_are_found(tmp_path, port, starboard, span) -> None:
    made, path = craft(), tmp_path / "craft.csv"
    table = motion(made)
    for name, share in sorted({port: made["port"], starboard: made["starboard"]}.items()):
        table[name] = np.round(1500 + span * share).astype(int)
    table["C9"] = 1500
    if span == 500:
        table.loc[0, port] = 2000  # beyond 1900: the whole range
    table.to_csv(path, index=False)
    found = log(path)
    used = {channel.quantity: channel for channel in found.voyage.channels.channels if channel.use}
    assert used["thrust_order_port"].stream == port and used["thrust_order_starboard"].stream == starboard
    assert used["thrust_order_port"].confidence >= 0.9
    for quantity, truth in (("thrust_order_port", made["port"]), ("thrust_order_starboard", made["starboard"])):
        assert found.voyage.series[quantity].values[1:] == pytest.approx(truth[1:], abs=0.002)
    assert any("1500 us" in notice for notice in found.notices)
    again = log(path, channels=found.voyage.channels)  # the channels file is of what was recorded
    assert np.array_equal(
        again.voyage.series["thrust_order_port"].values, found.voyage.series["thrust_order_port"].values
    )
    assert used["thrust_order_port"].offset == 1500 and used["thrust_order_port"].scale == pytest.approx(1 / span)


def test_a_rudder_by_pulses_keeps_its_side(saved) -> None:
    table = frame().drop(columns=["rudder_deg"])
    table["rudder_pwm"] = np.round(1500 - np.degrees(voyage().rudder) * 400 / 35)  # longer to port
    found = log(saved(table, "ship.csv"))
    assert found.voyage.series["rudder_angle"].values == pytest.approx(voyage().rudder, abs=0.005)


def stream(name: str, values: list[float], unit: str = "", quantity: str = "") -> LogStream:
    return LogStream(name, np.arange(float(len(values))), np.array(values, dtype=float), unit, quantity)


def shares(recorded: LogStream) -> np.ndarray:
    pulses, scale = pulses_of(recorded)
    assert scale is not None
    return scale.share(pulses.values)


def test_a_controller_that_turns_one_way_rests_at_its_shortest_pulse() -> None:
    pulses = stream("motor_left", [1100, 1100, 1100, 1500, 1900], "", "thrust_order_port")
    assert shares(pulses).tolist() == [0, 0, 0, 0.5, 1]


@pytest.mark.parametrize(
    "kept",
    [
        stream("shaft_rpm", [900, 1500, 1800], "rpm", "rpm"),
        stream("esc1_rpm", [900, 1500, 1800], "", "rpm"),
        stream("pressure", [1013, 1014, 1015]),
        stream("pwm_left", [0.1, 0.5, -0.5]),
        stream("pwm_left", [1500, 1500, 1500]),
    ],
)
def test_what_is_no_pulse_stays(kept) -> None:
    assert pulses_of(kept) == (kept, None)


class TestPx4:
    """The library's object in place of a file: topics as pyulog gives them."""

    @pytest.fixture
    def read(self, monkeypatch, tmp_path):
        def reading(topics: dict[str, dict[str, np.ndarray]], **parameters: float):
            entries = [SimpleNamespace(name=name, multi_id=0, data=data) for name, data in topics.items()]
            found = SimpleNamespace(
                data_list=entries, initial_parameters=parameters, dropouts=[], file_corruption=False
            )
            monkeypatch.setattr(px4, "optional_library", lambda *_: SimpleNamespace(ULog=lambda _: found))
            return {one.name: one for one in px4.read_px4_ulog(tmp_path / "log.ulg").streams}

        return reading

    @staticmethod
    def gps(made, *, old: bool = False, fix: int = 3) -> dict[str, np.ndarray]:
        table = motion(made)
        micros = (made["time"] * 1e6).astype(np.int64)
        places = {"latitude_deg": table.latitude.to_numpy(), "longitude_deg": table.longitude.to_numpy()}
        if old:
            keys = (("lat", "latitude_deg"), ("lon", "longitude_deg"))
            places = {key: np.round(1e7 * places[name]).astype(np.int32) for key, name in keys}
        return {
            "timestamp": micros + 5_000_000,
            "time_utc_usec": (micros + int(T0 * 1e6)).astype(np.uint64),
            "fix_type": np.full(len(micros), fix),
            **places,
        }

    @pytest.mark.parametrize(("topic", "old"), [("sensor_gps", False), ("vehicle_gps_position", True)])
    def test_positions_of_either_age_are_the_same(self, read, topic, old) -> None:
        made = craft()
        found = read({topic: self.gps(made, old=old)})
        latitude = found[f"{topic}.{'lat' if old else 'latitude_deg'}"]
        scale = 1e-7 if latitude.unit == "1e-7 deg" else 1.0
        assert latitude.values * scale == pytest.approx(motion(made).latitude.to_numpy(), abs=1e-7)
        assert latitude.time_s == pytest.approx(T0 + made["time"], abs=1e-5)

    def test_a_receiver_without_a_fix_shows_no_place(self, read) -> None:
        found = read({"sensor_gps": self.gps(craft(), fix=1)})
        assert np.isnan(found["sensor_gps.latitude_deg"].values).all()

    @pytest.mark.parametrize("both", [False, True])
    def test_pulses_are_orders_where_the_log_has_no_others(self, read, both) -> None:
        made = craft()
        time = (made["time"] * 1e6).astype(np.int64) + 5_000_000
        sides = np.where(made["port"] == 0, 0, 1500 + 400 * made["port"]), 1500 + 400 * made["starboard"]
        topics = {"sensor_gps": self.gps(made)}
        topics["actuator_outputs"] = {"timestamp": time, "output[0]": sides[1], "output[1]": sides[0]}
        if both:
            topics["actuator_motors"] = {
                "timestamp": time,
                "control[0]": made["starboard"],
                "control[1]": made["port"],
            }
        found = read(topics, CA_AIRFRAME=6)
        assert ("actuator_outputs.output[0]" in found) != both
        if both:
            assert found["actuator_motors.control[1]"].quantity == "thrust_order_port"
            return
        found_shares = shares(found["actuator_outputs.output[1]"])
        turning = made["port"] != 0
        assert found_shares[turning] == pytest.approx(made["port"][turning], abs=0.002)
        assert np.isnan(found_shares[~turning]).all()


@first_fast("known", [True, False])
def test_a_telemetry_log_gives_its_sides_with_and_without_parameters(tmp_path, known) -> None:
    mavlink = pytest.importorskip("pymavlink.dialects.v20.ardupilotmega")
    made, path = craft(), tmp_path / "craft.tlog"
    table, writer = motion(made), mavlink.MAVLink(None)
    parts: list[bytes] = []

    def put(time_s: float, message) -> None:
        parts.append(struct.pack(">Q", int((T0 + time_s) * 1e6)) + message.pack(writer))

    for number, function in ((1, 74), (3, 73)) if known else ():
        put(0.0, mavlink.MAVLink_param_value_message(f"SERVO{number}_FUNCTION".encode(), function, 2, 10, 0))
    for k, time in enumerate(made["time"]):
        boot, at = int(time * 1000), 1e7
        place = int(at * table.latitude[k]), int(at * table.longitude[k])
        put(time, mavlink.MAVLink_global_position_int_message(boot, *place, 0, 0, 0, 0, 0, 0))
        yaw = (made["psi"][k] + np.pi) % (2 * np.pi) - np.pi
        put(time, mavlink.MAVLink_attitude_message(boot, 0, 0, yaw, 0, 0, made["rate"][k]))
        sides = [round(1500 + 400 * made[side][k]) for side in ("starboard", "port")]
        put(time, mavlink.MAVLink_servo_output_raw_message(boot, 0, sides[0], 0, sides[1], 0, 0, 0, 0, 0))
    path.write_bytes(b"".join(parts))
    found = log(path).voyage
    assert found.series["thrust_order_port"].values == pytest.approx(made["port"], abs=0.002)
    assert found.series["heading"].values % (2 * np.pi) == pytest.approx(made["psi"] % (2 * np.pi), abs=1e-5)


def test_a_dataflash_log_without_parameters_keeps_its_rudder(tmp_path) -> None:
    pytest.importorskip("pymavlink")
    from tests.apps.logs.recorders import dataflash

    path = dataflash(tmp_path / "servo.log", reversed_servo=0)
    lines = [line for line in path.read_text().splitlines() if not line.startswith("PARM")]
    path.write_text("\n".join(lines) + "\n")
    (pulses,) = (one for one in read_log(path).streams if one.name == "RCOU.C1")
    assert shares(pulses) * 400 * 35 / 500 == pytest.approx(np.degrees(voyage().rudder), abs=0.2)


def test_a_rudder_that_lay_hard_over_for_long_rests_in_the_middle() -> None:
    pulses = np.concatenate([np.full(60, 1127.0), np.linspace(1127, 1900, 40)])
    scale = pulses_of(LogStream("ch1", 0.2 * np.arange(100), pulses))[1]
    assert scale.rest_us == 1127  # as of a controller that turns one way
    assert scale.two_way.share(np.array([1500.0, 1900.0])).tolist() == [0.0, 1.0]


def test_a_reversed_controller_with_sides_exchanged_and_its_own_rest_is_found(tmp_path) -> None:
    """As a real craft logs it: the left column is the starboard thruster, and its controller is reversed."""
    made, path = craft(), tmp_path / "craft.csv"
    table = motion(made)
    table["thr_left"] = np.round(1512 - 380 * made["starboard"]).astype(int)
    table["thr_right"] = np.round(1512 + 380 * made["port"]).astype(int)
    table["thr_left_pwm_zero_point"] = table["thr_right_pwm_zero_point"] = 1512.0
    table["yaw_acc"] = 0.0
    table.to_csv(path, index=False)
    found = log(path)
    used = {channel.quantity: channel for channel in found.voyage.channels.channels if channel.use}
    assert (used["thrust_order_port"].stream, used["thrust_order_port"].sign) == ("thr_right", 1)
    assert (used["thrust_order_starboard"].stream, used["thrust_order_starboard"].sign) == ("thr_left", -1)
    assert used["thrust_order_port"].offset == 1512
    assert used["heading"].stream != "yaw_acc"
    assert any("against its name" in notice for notice in found.cautions)
    for quantity, truth in (("thrust_order_port", made["port"]), ("thrust_order_starboard", made["starboard"])):
        values = found.voyage.series[quantity].values
        assert np.abs(values).max() <= 1.0
        assert np.corrcoef(values, truth)[0, 1] > 0.999


def test_shares_are_never_beyond_the_full_order(tmp_path) -> None:
    """A rest off the middle leaves more room to one side."""
    made, path = craft(), tmp_path / "craft.csv"
    table = motion(made)
    scale = 408 / max(np.abs(made["port"]).max(), np.abs(made["starboard"]).max())
    for name, side in (("pwm_left", "port"), ("pwm_right", "starboard")):
        table[name] = np.round(1510 + scale * made[side]).astype(int)
    table.to_csv(path, index=False)
    found = log(path)
    assert all(
        np.abs(found.voyage.series[f"thrust_order_{side}"].values).max() <= 1.0 for side in ("port", "starboard")
    )


def test_the_scale_of_an_order_of_pulses_is_in_plain_words(tmp_path) -> None:
    made, path = craft(), tmp_path / "craft.csv"
    sides = {
        f"pwm_{name}": np.round(1500 + 400 * made[side]) for name, side in (("left", "port"), ("right", "starboard"))
    }
    motion(made).assign(**sides).to_csv(path, index=False)
    units = {each.quantity: each.unit for each in log(path).study.channels}
    assert units["thrust_order_port"] == "0.0025 of full order per recorded unit"
    assert units["heading"] == "deg"
