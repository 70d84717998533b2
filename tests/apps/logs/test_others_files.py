"""Logs of buses, boards and robots as strangers write them: forms of candump, instances, other names, other clocks."""

from __future__ import annotations

import functools
import gzip
import re
import shutil

import numpy as np
import pandas as pd
import pytest

from tank2sim.apps.logs.command import log
from tank2sim.apps.logs.reading import read_log
from tank2sim.errors import InputError
from tests.apps.logs.made_logs import T0, can_frame, candump_lines, frame, stream_of, texts, voyage
from tests.apps.logs.recorders import dataflash
from tests.marks import first_fast

ROWS = 400


@functools.cache
def frames() -> tuple[tuple[float, str, str], ...]:
    """Time, identifier and data of the first 200 s."""
    found = (re.match(r"\((\d+\.\d+)\) can0 (\w+)#(\w+)", line) for line in candump_lines())
    parts = [(float(match[1]), match[2], match[3]) for match in found if match]
    return tuple(part for part in parts if part[0] < T0 + ROWS / 2)


def spaced(data: str) -> str:
    return " ".join(data[k : k + 2] for k in range(0, len(data), 2))


def iso(time_s: float, form: str) -> str:
    return pd.Timestamp(time_s, unit="s").strftime(form)


def plain(time_s: float, name: str, data: str) -> str:
    """A line of canboat's plain format."""
    stamp, pgn = iso(time_s, "%Y-%m-%dT%H:%M:%S.%f")[:-3], int(name, 16) >> 8 & 0x3FFFF
    return f"{stamp}Z,2,{pgn},35,255,{len(data) // 2},{spaced(data).lower().replace(' ', ',')}"


FORMS = {
    "candump -L": lambda t, i, d: f"({t:.6f}) can0 {i}#{d}",
    "candump -L -x": lambda t, i, d: f"({t:.6f}) can0 {i}#{d} R",
    "candump -ta": lambda t, i, d: f" ({t:.6f})  can0  {i}   [{len(d) // 2}]  {spaced(d)}",
    "candump -tA": lambda t, i, d: f" ({iso(t, '%Y-%m-%d %H:%M:%S.%f')})  can0  {i}   [8]  {spaced(d)}",
    "candump -tz": lambda t, i, d: f" ({t - T0:010.6f})  can0  {i}   [8]  {spaced(d)}",
    "candump -x": lambda t, i, d: f" ({t:.6f})  can0  RX - -  {i}   [8]  {spaced(d)}",
    "candump -a": lambda t, i, d: f" ({t:.6f})  vcan0  {i}   [8]  {spaced(d)}   '.(A.....'",
    "us": lambda t, i, d: f"{round(t * 1e6)} 1 {i} {d}",
    "ms, with commas": lambda t, i, d: f"{round(t * 1e3)},can0,{i},{d}",
    "ASC": lambda t, i, d: f"   {t - T0:.6f} 1  {i}x       Rx   d 8 {spaced(d)}",
    "canboat": plain,
    "Signal K": lambda t, i, d: f"{round(t * 1e3)};can0;{plain(t, i, d)}",
}


@pytest.fixture
def read(tmp_path):
    def read(lines, encoding="ascii"):
        path = tmp_path / "log.txt"
        path.write_text("\n".join([*lines, ""]), encoding=encoding)
        return read_log(path)

    return read


class TestFrames:
    @pytest.fixture(autouse=True)
    def _library(self) -> None:
        pytest.importorskip("nmea2000")

    @staticmethod
    def assert_as_written(found, dated: bool = True) -> None:
        heading = stream_of(found, "127250.heading")
        begin = T0 if dated else 0.0
        assert found.dated == dated
        assert heading.time_s == pytest.approx(begin + voyage().time[:ROWS], abs=2e-3)
        assert np.degrees(heading.values) == pytest.approx(frame()["heading_deg"][:ROWS], abs=0.01)

    @pytest.mark.parametrize("form", FORMS)
    def test_a_frame_is_read_in_every_form(self, read, form) -> None:
        found = read([FORMS[form](*part) for part in frames()])
        self.assert_as_written(found, dated=form not in ("candump -tz", "ASC"))

    def test_time_stamps_from_line_to_line_are_added_up(self, read) -> None:
        times = [part[0] for part in frames()]
        steps = np.diff(times, prepend=times[0])
        lines = [
            f" ({step:010.6f})  can0  {i}   [8]  {spaced(d)}" for step, (_, i, d) in zip(steps, frames(), strict=True)
        ]
        found = read(lines)
        self.assert_as_written(found, dated=False)
        assert "added up" in texts(found)

    @pytest.mark.parametrize("odd", ["# format=FAST", "#", "can0 09F11223#000000FF7FFF7FFC", "a line of words"])
    @pytest.mark.parametrize("place", [0, 7])
    def test_one_line_does_not_decide_about_the_time_stamps(self, read, odd, place) -> None:
        lines = [plain(*part) for part in frames()]
        found = read([*lines[:place], odd, *lines[place:]])
        heading = stream_of(found, "127250.heading")
        good = np.isfinite(heading.time_s)
        assert heading.time_s[good] == pytest.approx(T0 + voyage().time[:ROWS], abs=2e-3)

    def test_frames_in_utf_16_are_read(self, read) -> None:
        self.assert_as_written(read([FORMS["candump -L"](*part) for part in frames()], encoding="utf-16"))

    @pytest.mark.parametrize(
        ("instances", "expected"), [((0, 1), {"rpm_port": 84.0, "rpm_starboard": 82.0}), ((1,), {"rpm": 82.0})]
    )
    def test_engines_are_told_apart_by_their_instance(self, read, instances, expected) -> None:
        engines = [
            can_frame(
                t, 127488, bytes([k]) + round((84 - 2 * k) / 0.25).to_bytes(2, "little") + b"\xff\x7f\x7f\xff\xff"
            )
            for t in voyage().time[:ROWS]
            for k in instances
        ]
        found = read([*(FORMS["candump -L"](*part) for part in frames()), *engines])
        measured = {
            stream.quantity: float(np.median(stream.values)) for stream in found.streams if "127488" in stream.name
        }
        assert measured == expected

    def test_rudders_are_told_apart_by_their_instance(self, read, tmp_path) -> None:
        second = [
            can_frame(
                t, 127245, b"\x01\xf8\xff\x7f" + round(0.9 * v / 1e-4).to_bytes(2, "little", signed=True) + b"\xff\xff"
            )
            for t, v in zip(voyage().time[:ROWS], voyage().rudder, strict=False)
        ]
        found = read([*(FORMS["candump -L"](*part) for part in frames()), *second])
        for place, share in enumerate((1.0, 0.9)):
            values = stream_of(found, f"127245.position of {place}").values
            assert values == pytest.approx(share * voyage().rudder[:ROWS], abs=1e-4)
        notes = log(tmp_path / "log.txt").notices
        assert any("127245.position of 1" in note and "rad apart" in note for note in notes)

    def test_a_magnetic_heading_with_its_variation_is_a_true_one(self, read) -> None:
        def magnetic(degrees: float) -> bytes:
            angle = round(np.radians(degrees % 360) / 1e-4).to_bytes(2, "little")
            return (
                b"\xff"
                + angle
                + b"\xff\x7f"
                + round(np.radians(-10) / 1e-4).to_bytes(2, "little", signed=True)
                + b"\xfd"
            )

        heading = frame()["heading_deg"][:ROWS]
        lines = [can_frame(t, 127250, magnetic(h + 10)) for t, h in zip(voyage().time, heading, strict=False)]
        found = read([*(FORMS["candump -L"](*part) for part in frames() if part[1][2:6] != "F112"), *lines])
        stream = stream_of(found, "127250.true heading")
        error = (np.degrees(stream.values) - heading.to_numpy() + 180) % 360 - 180
        assert stream.quantity == "heading" and np.abs(error).max() < 0.02

    def test_a_message_that_is_not_used_is_named_and_its_numbers_may_be(self, read) -> None:
        depth = [
            can_frame(t, 128267, b"\xff" + (1234).to_bytes(4, "little") + b"\xff\x7f\xff") for t in voyage().time[:40]
        ]
        found = read([*(FORMS["candump -L"](*part) for part in frames()), *depth])
        assert "40 PGN 128267" in texts(found)
        assert stream_of(found, "128267.depth").values == pytest.approx(12.34)

    def test_a_receiver_that_is_1024_weeks_late_has_the_date_of_the_recorder(self, read) -> None:
        days = int(T0 // 86400) - 7168
        clock = [
            can_frame(
                t,
                126992,
                b"\x00\xf0" + days.to_bytes(2, "little") + round((T0 + t) % 86400 / 1e-4).to_bytes(4, "little"),
            )
            for t in voyage().time[:ROWS:2]
        ]
        found = read([*(FORMS["candump -L"](*part) for part in frames()), *clock])
        self.assert_as_written(found)
        assert "1024 weeks" in texts(found)


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        (
            b'{"timestamp":"2024-05-06T21:55:00.000","prio":2,"src":35,"dst":255,"pgn":129025,"fields":{}}\n' * 9,
            "canboat",
        ),
        (b"2024-05-06-21:55:00.000 2  35 255 127250 Vessel Heading:  Heading = 0.0; Reference = True\n" * 9, "canboat"),
        (
            b'{"context":"vessels.self","updates":[{"values":[{"path":"navigation.speed","value":3}]}]}\n' * 9,
            "Signal K",
        ),
        (b'1715032500000;can0;{"pgn":127250,"fields":{}}\n' * 9, "Signal K"),
        (b'[{"t": 1, "x": 2}]\n', "JSON"),
        (b'<?xml version="1.0"?>\n<gpx></gpx>\n', "XML"),
        (gzip.compress(b"$GPRMC,1,2", mtime=0), "gzip"),
        (b"PK\x03\x04\x14\x00", "ZIP"),
        (b"hello world of words\n" * 30, "not a log of a known format"),
    ],
)
def test_what_is_no_log_is_called_what_it_is(tmp_path, content, problem) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes(content)
    with pytest.raises(InputError, match=problem) as refusal:
        read_log(path)
    assert "\n" not in str(refusal.value)


class TestBoards:
    @pytest.fixture(autouse=True)
    def _library(self) -> None:
        pytest.importorskip("pymavlink")

    @first_fast(("name", "encoding"), [("log.csv", "utf-16"), ("log.bin", "ascii")])
    def test_a_dataflash_log_is_known_by_its_content(self, tmp_path, name, encoding) -> None:
        text = dataflash(tmp_path / "usual.log").read_text(encoding="ascii")
        (tmp_path / name).write_text(f"a remark\n{text}", encoding=encoding)
        found, usual = read_log(tmp_path / name), read_log(tmp_path / "usual.log")
        np.testing.assert_array_equal(stream_of(found, "ATT.Yaw").values, stream_of(usual, "ATT.Yaw").values)

    @first_fast("parameter", ["SERVO9_FUNCTION", "RC7_FUNCTION"])
    def test_a_parameter_of_another_output_does_not_hide_the_rudder(self, tmp_path, parameter) -> None:
        path = dataflash(tmp_path / "log.log")
        path.write_text(path.read_text("ascii").replace("SERVO1_FUNCTION", parameter), encoding="ascii")
        stream = stream_of(read_log(path), "RCOU.C1")
        assert (stream.unit, stream.quantity) == ("us", "") and np.ptp(stream.values) > 500

    def test_a_log_whose_receiver_has_no_time_has_no_date(self, tmp_path) -> None:
        found = read_log(dataflash(tmp_path / "none.log", statuses=(1,)))
        assert not found.dated and stream_of(found, "ATT.Yaw").time_s == pytest.approx(voyage().time + 20)

    def test_messages_that_are_not_used_are_named(self, tmp_path) -> None:
        path = dataflash(tmp_path / "more.log")
        more = "FMT, 140, 20, STER, Qff, TimeUS,SteerIn,SteerOut\n" + "STER, 1000, 0.5, 0.25\n" * 3
        path.write_text(path.read_text("ascii") + more, encoding="ascii")
        assert "3 STER" in texts(read_log(path), "note")

    def test_a_week_before_the_first_board_is_named(self, tmp_path) -> None:
        path = dataflash(tmp_path / "old.log")
        path.write_text(path.read_text("ascii").replace(", 2300, ", ", 1276, "), encoding="ascii")
        assert "1276" in texts(read_log(path), "note")

    @pytest.mark.parametrize("name", ["log.tlog", "log.raw"])
    @pytest.mark.parametrize("every", [2, 60])
    def test_one_of_two_vehicles_is_read_and_the_other_named(self, tmp_path, name, every) -> None:
        mavlink = pytest.importorskip("pymavlink.dialects.v20.ardupilotmega")
        path, table = tmp_path / name, frame()
        with path.open("wb") as file:
            for k in range(0, ROWS):
                for system in (1, 7) if k % every == 0 else (1,):
                    sender = mavlink.MAVLink(None, srcSystem=system)
                    place = [
                        round(float(table[axis][k]) * 1e7) + 10_000 * (system - 1) for axis in ("latitude", "longitude")
                    ]
                    for message in (
                        mavlink.MAVLink_global_position_int_message(500 * k, *place, 0, 0, 0, 0, 0, 0),
                        mavlink.MAVLink_attitude_message(500 * k, 0, 0, float(voyage().heading[k]), 0, 0, 0),
                    ):
                        file.write(round((T0 + 0.5 * k) * 1e6).to_bytes(8, "big") + message.pack(sender))
        found = read_log(path)
        assert stream_of(found, "GLOBAL_POSITION_INT.lat").values == pytest.approx(table["latitude"][:ROWS], abs=1e-7)
        assert "2 vehicles" in texts(found, "fault") and "not 7" in texts(found, "fault")


@first_fast(
    ("name", "other"),
    [("voyage.ulg", "x.csv"), ("voyage.bag", "x.dat"), ("voyage.mcap", "x.bag"), ("voyage.bin", "x.log")],
)
def test_a_file_is_known_by_its_content(data, tmp_path, name, other) -> None:
    source = data / "data" / "logs" / "ship_21" / name
    if not source.is_file():
        pytest.skip(f"made-up logs are missing: no {source}")
    pytest.importorskip({".ulg": "pyulog", ".bin": "pymavlink"}.get(source.suffix, "rosbags"))
    shutil.copyfile(source, tmp_path / other)
    usual, found = read_log(source), read_log(tmp_path / other)
    assert found.format == usual.format and [s.name for s in found.streams] == [s.name for s in usual.streams]


def test_a_ulog_without_utc_has_no_date(data) -> None:
    pytest.importorskip("pyulog")
    path = data / "data" / "log_inputs" / "29-ulog-without-utc" / "p1_usv_22_noutc.ulg"
    if not path.is_file():
        pytest.skip(f"inputs are missing: no {path}")
    found = read_log(path)
    heading = next(stream for stream in found.streams if stream.quantity == "heading")
    assert not found.dated and heading.time_s[-1] - heading.time_s[0] == pytest.approx(600, abs=1)
