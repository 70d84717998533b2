"""Logs of recorders that nobody here wrote: other clocks, parts, several receivers, one shaft called 1, odd columns."""

from __future__ import annotations

import functools
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tank2sim.apps.logs.channels import LogChannel
from tank2sim.apps.logs.command import log
from tank2sim.apps.logs.content import AGREES, direction_evidence
from tank2sim.apps.logs.quantities import quantity_of_name
from tank2sim.apps.logs.reading import read_log
from tank2sim.apps.logs.reference import ReferenceMotion
from tank2sim.errors import InputError
from tests.apps.logs.made_logs import T0, craft, frame, motion, nmea_lines, sentence, used, voyage
from tests.apps.logs.recorders import dataflash

DAY = 86400.0


@functools.cache
def table() -> pd.DataFrame:
    return frame()


def written(path, columns: dict[str, object], **changes: object):
    """A CSV of the voyage with these columns of time before its own, with some changed."""
    rest = table().drop(columns=["utc", *changes]).assign(**changes)
    pd.concat([pd.DataFrame(columns), rest], axis=1).to_csv(path, index=False)
    return path


def moments() -> pd.DatetimeIndex:
    return pd.to_datetime(T0 + voyage().time, unit="s")


@pytest.mark.parametrize(("day_of_1970", "digits"), [(25569, 8), (719529, 8)])
def test_days_of_spreadsheets_and_of_matlab_are_times(tmp_path, day_of_1970, digits) -> None:
    days = (T0 + voyage().time) / DAY + day_of_1970
    found = read_log(written(tmp_path / "days.csv", {"Timestamp": np.round(days, digits)}))
    assert found.dated
    np.testing.assert_allclose(found.streams[0].time_s, T0 + voyage().time, rtol=0, atol=2e-3)


def test_a_date_and_a_clock_of_12_hours_in_two_columns(tmp_path) -> None:
    columns = {"Date": moments().strftime("%m/%d/%Y"), "Time": moments().strftime("%I:%M:%S.%f %p")}
    found = read_log(written(tmp_path / "halves.csv", columns))
    np.testing.assert_allclose(found.streams[0].time_s, T0 + voyage().time, rtol=0, atol=1e-5)


def test_times_of_day_alone_go_on_over_midnight_without_a_date(tmp_path) -> None:
    clock = (moments() + pd.Timedelta(hours=1, minutes=40)).strftime("%H:%M:%S.%f")
    assert "00:00:00.000000" in clock
    found = read_log(written(tmp_path / "clock.csv", {"hh:mm:ss": clock}))
    assert not found.dated
    np.testing.assert_allclose(np.diff(found.streams[0].time_s), 0.5, atol=1e-6)


@pytest.mark.parametrize(
    ("shafts", "expected"),
    [
        ({"E,1": 4.0, "S,1": 1.0}, {"RPM.E1": "", "RPM.S1": "rpm"}),
        ({"S,1": 1.0, "S,2": 1.0}, {"RPM.S1": "rpm_starboard", "RPM.S2": "rpm_port"}),
    ],
)
def test_an_only_shaft_of_number_1_is_that_of_the_ship_and_two_keep_their_sides(tmp_path, shafts, expected) -> None:
    """Revolutions of an engine that turns four times as fast, or of a second shaft."""
    pytest.importorskip("pynmea2")
    lines = []
    for line in nmea_lines():
        rpm = float(line.split(",")[3]) if "RPM" in line else 0.0
        own = [sentence(f"IIRPM,{shaft},{share * rpm:.1f},,A") for shaft, share in shafts.items()]
        lines += own if "RPM" in line else [line]
    path = tmp_path / "shafts.nmea"
    path.write_text("\r\n".join(lines), encoding="ascii")
    named = {stream.name: stream.quantity for stream in read_log(path).streams}
    assert {name: named[name] for name in expected} == expected


def astern() -> tuple[pd.DataFrame, np.ndarray]:
    """A craft that goes ahead and then backs for 60 s, and the revolutions of its engine."""
    time = np.arange(0, 400, 0.5)
    psi = 0.5 + 0.8 * np.sin(time / 30)
    speed = np.where(time < 300, 3.0, np.clip(3.0 - 0.1 * (time - 300), -2.0, 3.0))
    x, y = np.cumsum(0.5 * speed * np.cos(psi)), np.cumsum(0.5 * speed * np.sin(psi))
    made = {"time": time, "psi": psi, "x": x, "y": y}
    rudder = np.degrees(np.gradient(psi, 0.5) + 3.0 * np.gradient(np.gradient(psi, 0.5), 0.5)) * 4
    return motion(made).assign(rudder_deg=rudder), np.where(time < 300, 200.0, -150.0)


@pytest.mark.parametrize("signed", [True, False])
def test_revolutions_without_their_sign_are_a_fault_where_the_vessel_backs(saved, signed) -> None:
    made, rpm = astern()
    path = saved(made.assign(engine_rpm=rpm if signed else np.abs(rpm)), "back.csv")
    faults = [finding.text for finding in log(path).voyage.findings if finding.kind == "fault"]
    assert any("engine_rpm" in text and "astern" in text for text in faults) is not signed


def test_a_heading_of_a_craft_in_a_current_that_backs_is_one() -> None:
    rng = np.random.default_rng(1)
    time = np.arange(0, 600.0)
    heading = np.cumsum(rng.normal(0, 0.1, len(time)))
    speed = np.where(time % 100 < 35, -0.7, 1.0)
    north = speed * np.cos(heading) + 0.25
    east = speed * np.sin(heading) - 0.2
    empty = np.zeros(0)
    track = ReferenceMotion(time, north, east, empty, empty)
    assert (direction_evidence(time, heading, track).agreement or 0) >= AGREES
    other = heading + np.cumsum(rng.normal(0, 0.05, len(time)))
    assert (direction_evidence(time, other, track).agreement or 0) < AGREES
    assert (direction_evidence(time, -heading, track).agreement or 0) < AGREES


@pytest.mark.parametrize("swapped", [False, True])
def test_an_array_of_thrusters_without_sides_is_assigned_by_the_turn(tmp_path, swapped) -> None:
    made, path = craft(), tmp_path / "craft.csv"
    first, second = ("starboard", "port") if swapped else ("port", "starboard")
    orders = {"/usv/thrusters[0]": made[first], "/usv/thrusters[1]": made[second]}
    motion(made).assign(**orders).to_csv(path, index=False)
    found = used(log(path))
    assert found["thrust_order_port"] == f"/usv/thrusters[{int(swapped)}]"
    assert found["thrust_order_starboard"] == f"/usv/thrusters[{int(not swapped)}]"


@pytest.mark.parametrize(("north", "east"), [("X_N[m]", "Y_E[m]"), ("north_m", "east_m"), ("Northing", "Easting")])
def test_local_positions_are_known_by_their_names(tmp_path, north, east) -> None:
    made, path = voyage(), tmp_path / "local.csv"
    columns = {"t[s]": made.time, north: made.x, east: made.y, "psi[deg]": np.degrees(made.heading) % 360}
    pd.DataFrame({**columns, "rudder_deg": np.degrees(made.rudder)}).to_csv(path, index=False)
    found = used(log(path))
    assert (found.get("x"), found.get("y")) == (north, east) and found["heading"] == "psi[deg]"


@pytest.mark.parametrize(("first", "second"), [("x", "y"), ("pos_x", "pos_y"), ("n", "e")])
def test_positions_of_unknown_axes_are_not_taken(first, second) -> None:
    assert quantity_of_name(first) not in ("x", "y") and quantity_of_name(second) not in ("x", "y")


@pytest.mark.parametrize("true", [False, True])
def test_a_magnetic_heading_alone_is_said_to_give_none(saved, true) -> None:
    changed = table().assign(compass=(table().heading_deg + 25.0) % 360)
    path = saved((changed if true else changed.drop(columns="heading_deg")), "compass.csv")
    faults = [finding.stream for finding in log(path).voyage.findings if finding.kind == "fault"]
    assert ("compass" in faults) is not true


def test_a_table_of_a_row_a_sample_is_taken_apart_by_its_names(saved) -> None:
    made = table().assign(timestamp=T0 + voyage().time).drop(columns="utc")
    rows = made.melt("timestamp", var_name="signal").sort_values("timestamp", kind="stable")
    path = saved(rows, "long.csv")
    named = {stream.name: stream for stream in read_log(path).streams}
    assert named.keys() == set(made.columns) - {"timestamp"}
    np.testing.assert_allclose(named["heading_deg"].values, made.heading_deg)
    np.testing.assert_allclose(named["heading_deg"].time_s, made.timestamp, rtol=0, atol=1e-6)
    assert (named["rudder_deg"].quantity, named["rudder_deg"].unit) == ("rudder_angle", "deg")


@pytest.mark.parametrize("exchanged", [False, True])
def test_positions_without_a_name_are_those_that_the_heading_follows(tmp_path, exchanged) -> None:
    made = table()
    places = [made.latitude, made.longitude][:: -1 if exchanged else 1]
    columns = [pd.Series((T0 + voyage().time) * 1000, name=0), *places, made.heading_deg, made.rudder_deg]
    path = tmp_path / "bare.csv"
    pd.concat(columns, axis=1).astype({0: "int64"}).to_csv(path, index=False, header=False)
    channels = {c.quantity: c for c in log(path).voyage.channels.channels if c.use}
    first, second = ("column 3", "column 2") if exchanged else ("column 2", "column 3")
    assert (channels["latitude"].stream, channels["longitude"].stream) == (first, second)
    assert channels["latitude"].confidence < 0.9
    assert channels["heading"].stream == "column 4"


def bare(folder: Path, columns: list[pd.Series]) -> dict[str, LogChannel]:
    """Channels in use of a table without a row of names; the first column is UTC, ms since 1970."""
    path = folder / "bare.csv"
    time = pd.Series((T0 + voyage().time) * 1000, name=0)
    pd.concat([time, *columns], axis=1).astype({0: "int64"}).to_csv(path, index=False, header=False)
    return {channel.quantity: channel for channel in log(path).voyage.channels.channels if channel.use}


def test_a_rudder_without_a_name_is_found_where_the_heading_alone_shows_the_turn(tmp_path) -> None:
    made = table()
    found = bare(tmp_path, [made.latitude, made.longitude, made.heading_deg, -made.rudder_deg, made.shaft_rpm])
    assert (found["rudder_angle"].stream, found["rudder_angle"].sign) == ("column 5", -1)
    assert found["rudder_angle"].confidence < 0.8  # to be confirmed: the heading may be the course


def test_one_of_several_alike_rudders_without_a_name_is_used(tmp_path) -> None:
    made = table()
    rng = np.random.default_rng(3)
    alike = [made.rudder_deg + rng.normal(0, 0.3, len(made)) for _ in range(3)]
    found = bare(tmp_path, [made.latitude, made.longitude, made.heading_deg, made.rot_deg_min, *alike])
    assert found["rudder_angle"].stream in ("column 6", "column 7", "column 8")


def test_the_columns_that_vary_and_are_not_understood_are_listed(saved) -> None:
    made = table()
    made["Kwartal"] = np.random.default_rng(3).normal(size=len(made))
    made["constant"] = 4.0
    path = saved(made, "voyage.csv")
    notes = [f for f in log(path).voyage.findings if f.kind == "note" and "Kwartal" in f.text]
    assert [note.evidence["streams"] for note in notes] == [1]


def test_a_temperature_that_lies_near_the_course_is_no_heading(saved) -> None:
    """A ship on 78 deg most of the time, and an engine at 78 degC."""
    made = table().rename(columns={"heading_deg": "P3"})
    made["Engine temperature"] = (
        np.degrees(voyage().heading) + np.random.default_rng(3).normal(0, 20, len(made))
    ) % 360
    assert used(log(saved(made)))["heading"] == "P3"


class TestDataflash:
    @pytest.fixture(autouse=True)
    def _library(self) -> None:
        pytest.importorskip("pymavlink")

    def test_a_receiver_without_an_instance_is_one(self, tmp_path) -> None:
        found = read_log(dataflash(tmp_path / "old.log", statuses=(None,)))
        assert {"GPS.Lat", "GPS.Lng"} <= {stream.name for stream in found.streams}

    def test_the_clock_is_that_of_the_receiver_with_a_fix(self, tmp_path) -> None:
        found = read_log(dataflash(tmp_path / "two.log", statuses=(1, 3)))
        named = {stream.name: stream for stream in found.streams}
        assert np.isnan(named["GPS[0].Lat"].values).all()
        assert np.isfinite(named["GPS[1].Lat"].values).all()
        utc = 315964800 + 2300 * 604800 + 100000 - 18
        assert named["ATT.Yaw"].time_s[0] == pytest.approx(utc, abs=1e-3)

    @pytest.mark.slow
    def test_two_speed_controllers_are_a_guess_and_one_is_the_shaft(self, tmp_path) -> None:
        for escs, expected in ((1, [("rpm", "format")]), (2, [("rpm_port", ""), ("rpm_starboard", "")])):
            found = read_log(dataflash(tmp_path / f"{escs}.log", escs=escs))
            speeds = [stream for stream in found.streams if stream.name.startswith("ESC")]
            assert [(stream.quantity, stream.stated_by) for stream in speeds] == expected

    @pytest.mark.parametrize("reversed_servo", [0, 1])
    def test_a_reversed_servo_steers_as_the_vessel_does(self, tmp_path, reversed_servo) -> None:
        found = read_log(dataflash(tmp_path / "servo.log", reversed_servo=reversed_servo))
        (rudder,) = (stream for stream in found.streams if stream.quantity == "rudder_order")
        assert rudder.values * 35 == pytest.approx(np.degrees(voyage().rudder), abs=0.1)


class TestParts:
    @pytest.fixture
    def parts(self, tmp_path) -> list[Path]:
        table = frame()
        paths = [tmp_path / "whole.csv", tmp_path / "a.csv", tmp_path / "b.csv"]
        for path, rows in zip(paths, (table, table[:700], table[700:]), strict=True):
            rows.to_csv(path, index=False)
        return paths

    @pytest.mark.parametrize("order", [(0, 1), (1, 0)])
    def test_files_that_follow_each_other_are_one_log(self, parts, order) -> None:
        whole, *halves = parts
        one, joined = log(whole), log([halves[place] for place in order])
        assert len(joined.cuts) == len(one.cuts) == 2
        for name, series in one.voyage.series.items():
            np.testing.assert_allclose(joined.voyage.series[name].values, series.values, rtol=0, atol=1e-9)

    def test_files_of_the_same_time_stay_apart(self, parts, saved) -> None:
        table = frame().drop(columns=["heading_deg"])
        result = log([parts[0], saved(table, "other.csv")])
        assert any(channel.stream.startswith("whole: ") for channel in result.voyage.channels.channels)


def test_hours_of_am_and_pm_are_read(saved) -> None:
    table = frame()
    moments = pd.to_datetime(table["utc"])
    table["utc"] = moments.dt.strftime("%m/%d/%Y %I:%M:%S.%f %p")
    expected = ((moments - pd.Timestamp(0, tz="UTC")) / pd.Timedelta(seconds=1)).to_numpy()
    np.testing.assert_allclose(read_log(saved(table, "us.csv")).streams[0].time_s, expected, rtol=0, atol=1e-5)


def test_a_time_that_cannot_be_read_is_named(saved) -> None:
    table = frame()
    table["utc"] = [f"{29}.11.2023 quarter past {k}" for k in range(len(table))]
    with pytest.raises(InputError, match="column"):
        read_log(saved(table, "odd.csv"))


class TestSentences:
    @pytest.fixture(autouse=True)
    def _library(self) -> None:
        pytest.importorskip("pynmea2")

    def test_a_log_without_checksums_is_read_and_says_so(self, tmp_path) -> None:
        lines = nmea_lines()
        for name, text in (("with", lines), ("without", [line.split("*")[0] for line in lines])):
            (tmp_path / f"{name}.nmea").write_text("\n".join(text) + "\n", encoding="ascii")
        checked, unchecked = (read_log(tmp_path / f"{name}.nmea") for name in ("with", "without"))
        assert unchecked.counts["corrupted"] == 0
        assert any("checksum" in finding.text for finding in unchecked.findings)
        for one, other in zip(checked.streams, unchecked.streams, strict=True):
            np.testing.assert_array_equal(one.values, other.values)

    def test_a_true_heading_with_a_status_is_a_heading(self, tmp_path) -> None:
        lines = []
        for line in nmea_lines():
            words = line.split("*")[0].split(",")
            status = "V" if len(lines) < 100 else "A"
            lines.append(sentence(f"HETHS,{words[1]},{status}") if words[0].endswith("HDT") else line)
        (tmp_path / "ths.nmea").write_text("\n".join(lines) + "\n", encoding="ascii")
        (heading,) = (stream for stream in read_log(tmp_path / "ths.nmea").streams if stream.quantity == "heading")
        valid = [line.split(",")[1] for line in lines[100:] if "THS" in line]
        np.testing.assert_array_equal(heading.values, np.array(valid, dtype=float))
