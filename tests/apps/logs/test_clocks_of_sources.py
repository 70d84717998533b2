"""Clocks and headings of several sources on one bus: lines that were written byte by byte, and recordings of a boat."""

from __future__ import annotations

import datetime as dt
import math
import struct
from pathlib import Path

import numpy as np
import pytest

import tank2sim as t2s

BEGIN = dt.datetime(2024, 5, 1, 12, 0, 0)


def line(moment: float, pgn: int, source: int, data: bytes) -> str:
    """A line of canboat's plain format, some seconds after the beginning by the recorder's clock."""
    stamp = (BEGIN + dt.timedelta(seconds=moment)).strftime("%Y-%m-%dT%H:%M:%S.%f")[:-3]
    return f"{stamp},2,{pgn},{source},255,{len(data)},{','.join(f'{byte:02x}' for byte in data)}"


def system_time(moment: float, seconds: float, source: int) -> str:
    """PGN 126992: days since 1970 and 0.1 ms of the day, whole seconds after the beginning."""
    whole = BEGIN + dt.timedelta(seconds=math.floor(seconds))
    days, of_day = (whole - dt.datetime(1970, 1, 1)).days, whole.hour * 3600 + whole.minute * 60 + whole.second
    return line(moment, 126992, source, struct.pack("<BBHI", 1, 0xF0, days, of_day * 10000))


def heading(moment: float, angle_deg: float, source: int) -> str:
    """PGN 127250, true: 1e-4 rad."""
    angle = round(math.radians(angle_deg % 360) * 1e4)
    return line(moment, 127250, source, struct.pack("<BHhhB", 1, angle, 0x7FFF, 0x7FFF, 0xFC))


def logged(folder: Path, lines: list[str]):
    path = folder / "bus.raw"
    path.write_text("\n".join(sorted(lines)) + "\n")
    return t2s.log(path).study


def ticks(source: int, behind_s: float = 0.0, pace: float = 1.0, shift_s: float = 0.0) -> list[str]:
    return [system_time(each / pace + 0.2, each + shift_s - behind_s, source) for each in range(40)]


def turning(pace: float = 1.0, source: int = 1, off: float = 0.0) -> list[str]:
    """A heading that turns at 2 deg/s by the satellites, every 0.2 s of the recorder."""
    moments = np.arange(0, 40 / pace, 0.2)
    return [heading(float(each) + 0.05, 100 + 2 * pace * float(each) + off, source) for each in moments]


def rate_degps(study) -> float:
    entry = study.time_line["heading"]
    time, angle = np.array(entry["t_s"]), np.unwrap(np.array(entry["value"]))
    return math.degrees(np.polyfit(time, angle, 1)[0])


def test_clocks_that_agree_change_nothing(tmp_path) -> None:
    study = logged(tmp_path, [*ticks(1), *ticks(2), *turning()])
    assert rate_degps(study) == pytest.approx(2.0, rel=0.01) and study.duration_s == pytest.approx(40, abs=1)
    assert not [finding for finding in study.findings if "clock" in finding.text]


def test_a_source_whose_clock_is_behind_is_named_and_the_majority_is_used(tmp_path) -> None:
    study = logged(tmp_path, [*ticks(1), *ticks(2), *ticks(3, behind_s=3.0), *turning()])
    (finding,) = [finding for finding in study.findings if "clock" in finding.text]
    assert finding.evidence["behind_s"] == pytest.approx(3.0) and "source 3" in finding.text
    assert study.begins_utc is not None and study.begins_utc.startswith("2024-05-01T11:59:59")  # of the majority


def test_the_time_stamps_of_a_conversion_are_stretched_to_the_clock_of_the_satellites(tmp_path) -> None:
    """93 s were converted in 31 s: a rate of turn by the time stamps would be three times the true one."""
    study = logged(tmp_path, [*ticks(1, pace=3.0), *turning(pace=3.0)])
    (finding,) = [finding for finding in study.findings if "times as fast" in finding.text]
    assert finding.kind == "fault" and finding.evidence["pace"] == pytest.approx(3.0, rel=0.02)
    assert rate_degps(study) == pytest.approx(2.0, rel=0.02) and study.duration_s == pytest.approx(40, abs=1.5)


def test_a_recorder_that_is_late_is_set_to_the_satellites(tmp_path) -> None:
    study = logged(tmp_path, [*ticks(1, shift_s=100.0), *turning()])
    (finding,) = [finding for finding in study.findings if "clock" in finding.text]
    assert finding.evidence["behind_s"] == pytest.approx(100.0, abs=1.0)
    assert study.begins_utc is not None and study.begins_utc.startswith("2024-05-01T12:01:39")


@pytest.mark.parametrize(("off", "named"), [(115.0, True), (-30.0, True), (2.0, False)])
def test_a_second_heading_that_contradicts_the_one_in_use_is_named(tmp_path, off: float, named: bool) -> None:
    study = logged(tmp_path, [*ticks(1), *turning(), *turning(source=7, off=off)])
    found = [finding for finding in study.findings if "another heading" in finding.text]
    assert len(found) == named
    if found:
        sign = 1 if found[0].stream.endswith("from 7") else -1
        assert found[0].kind == "fault" and found[0].evidence["apart_deg"] == pytest.approx(sign * off, abs=1.5)


def test_the_two_headings_of_a_boat_at_the_berth_contradict_each_other(data: Path) -> None:
    """Medians by hand: 98.8 and 344.2 deg."""
    study = t2s.log(data / "data/canboat_n2k/susteranna2020.raw").study
    (found,) = [finding for finding in study.findings if "another heading" in finding.text]
    assert found.evidence["apart_deg"] == pytest.approx(98.8 - 344.2 + 360, abs=1.0)
    (late,) = [finding for finding in study.findings if "clock of the recorder" in finding.text]
    assert late.evidence["behind_s"] == pytest.approx(2.3, abs=1.0)  # 13:52:39 at 13:52:36.95, whole seconds
