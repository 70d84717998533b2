"""What recorders write beyond one tidy file: parts, several receivers, speed controllers, other clocks."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tank2sim.apps.logs.command import log
from tank2sim.apps.logs.reading import read_log
from tank2sim.errors import InputError
from tests.apps.logs.made_logs import frame, nmea_lines, sentence, voyage
from tests.apps.logs.recorders import dataflash


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
