"""One voyage in every format: the same streams, which lie on the truth to within the noise of the instruments."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tank2sim.apps.logs.reading import read_log
from tank2sim.apps.logs.streams import VesselLog
from tank2sim.apps.logs.voyage import Voyage, make_voyage
from tests.conftest import DATA
from tests.marks import first_fast

FORMATS = {
    "voyage.nmea": "pynmea2",
    "voyage.bag": "rosbags",
    "voyage.mcap": "rosbags",
    "voyage.bin": "pymavlink",
    "voyage.ulg": "pyulog",
    "voyage.csv": "pandas",
    "voyage_eu.csv": "pandas",
}
VESSELS = ("ship_21", "usv_22")
CASES = [(vessel, name) for vessel in VESSELS for name in FORMATS]

CLOCK_S = 0.16
"""Largest error of the clock of a format: a receiver's delay of 0.12 s is in its messages (truth files), and lines of
NMEA 0183 without time stamps are known to a fraction of the 0.2 to 0.25 s between them."""


@pytest.fixture
def logs(data: Path) -> Path:
    folder = data / "data" / "logs"
    if not folder.is_dir():
        pytest.skip(f"made-up logs are missing: no folder {folder}")
    return folder


@cache
def voyage_of(vessel: str, name: str) -> Voyage:
    return make_voyage([log_of(vessel, name)])


@cache
def log_of(vessel: str, name: str) -> VesselLog:
    return read_log(DATA / "data" / "logs" / vessel / name)


@cache
def truth_of(vessel: str) -> tuple[dict, pd.DataFrame, float]:
    folder = DATA / "data" / "logs"
    known = json.loads((folder / f"{vessel}-truth.json").read_text(encoding="utf-8"))
    return known, pd.read_csv(folder / f"{vessel}-truth.csv"), pd.Timestamp(known["t_zero_utc"]).timestamp()


def wrapped(angle: np.ndarray) -> np.ndarray:
    return (angle + np.pi) % (2 * np.pi) - np.pi


def error_of(vessel: str, name: str, quantity: str, column: str, factor: float = 1.0) -> np.ndarray | None:
    """Measured minus true values of a quantity at the times of its samples; None where the format lacks it."""
    series = voyage_of(vessel, name).series.get(quantity)
    if series is None:
        return None
    _, truth, t_zero = truth_of(vessel)
    true = truth[column].to_numpy() * factor
    if quantity == "heading":
        true = np.unwrap(true)
    at = np.interp(series.time_s - t_zero, truth.t_s, true)
    error = series.values - at
    return wrapped(error) if quantity == "heading" else error


@pytest.mark.parametrize(("vessel", "name"), CASES)
def test_headings_and_rates_of_turn_lie_on_the_truth(logs, vessel, name) -> None:
    pytest.importorskip(FORMATS[name])
    known, truth, _ = truth_of(vessel)
    rate = np.radians(truth.r_degps.to_numpy())
    for quantity, column, noise, moves in (
        ("heading", "psi_deg", known["noise"]["heading"], rate),
        ("yaw_rate", "r_degps", known["noise"]["rate"], np.gradient(rate, truth.t_s)),
    ):
        error = error_of(vessel, name, quantity, column, np.pi / 180)
        assert error is not None
        sigma = np.radians(np.hypot(noise["white_sigma"], noise["coloured_sigma"]))
        late = CLOCK_S * np.sqrt(np.mean(moves**2))
        between = 0.02 * np.sqrt(np.mean(moves**2))  # the truth is drawn straight between its samples
        digit = np.radians(0.1 if name == "voyage_eu.csv" else 0.01) / np.sqrt(12)
        assert np.std(error) < 1.35 * sigma + late + between + digit, quantity


@pytest.mark.parametrize(("vessel", "name"), CASES)
def test_positions_lie_on_the_truth(logs, vessel, name) -> None:
    pytest.importorskip(FORMATS[name])
    known, truth, t_zero = truth_of(vessel)
    voyage = voyage_of(vessel, name)
    latitude, longitude = (known["origin"][f"{key}_deg"] for key in ("latitude", "longitude"))
    radius = 6371008.8  # the sphere suffices for the place of an origin within 60 m
    north = np.radians(voyage.origin_deg[0] - latitude) * radius
    east = np.radians(voyage.origin_deg[1] - longitude) * radius * np.cos(np.radians(latitude))
    noise = known["noise"]["gps"]
    sigma = np.hypot(noise["white_sigma"], noise["coloured_sigma"])
    speed = np.hypot(np.gradient(truth.x_m, truth.t_s), np.gradient(truth.y_m, truth.t_s)).max()
    for quantity, column, shift in (("x", "x_m", north), ("y", "y_m", east)):
        series = voyage.series[quantity]
        error = series.values + shift - np.interp(series.time_s - t_zero, truth.t_s, truth[column])
        # The generator's plane is that of the radii alone; the series of second order differs by y^2 tan(phi)/2R.
        curved = 2.5 if vessel == "ship_21" else 0.01
        assert np.sqrt(np.mean(error**2)) < 1.5 * sigma + CLOCK_S * speed + curved


@pytest.mark.parametrize("name", FORMATS)
def test_rudders_and_orders_lie_on_the_truth(logs, name) -> None:
    pytest.importorskip(FORMATS[name])
    known, _, _ = truth_of("ship_21")
    noise = known["noise"]["rudder"]
    angle = error_of("ship_21", name, "rudder_angle", "delta_deg", np.pi / 180)
    order = error_of("ship_21", name, "rudder_order", "delta_order_deg", np.pi / 180)
    assert angle is not None or order is not None
    if angle is not None:
        assert np.degrees(np.median(np.abs(angle))) < np.hypot(noise["white_sigma"], noise["coloured_sigma"])
    if order is not None:  # steps fall between the samples of the truth
        assert np.degrees(np.median(np.abs(order))) < 0.06


@pytest.mark.parametrize("name", [name for name in FORMATS if name != "voyage.nmea"])
def test_orders_of_thrusters_lie_on_the_truth(logs, name) -> None:
    pytest.importorskip(FORMATS[name])
    for side, column in (("port", "command_left"), ("starboard", "command_right")):
        error = error_of("usv_22", name, f"thrust_order_{side}", column)
        assert error is not None and np.median(np.abs(error)) < 0.002


@pytest.mark.parametrize(
    ("first", "second", "digit_deg"),
    [
        ("voyage.bag", "voyage.mcap", 1e-12),
        ("voyage.bag", "voyage.nmea", 0.51e-5 / 60),  # five digits of minutes
        ("voyage.ulg", "voyage.bin", 1.01e-7),  # the board's integers of 1e-7 deg, cut off
    ],
)
@first_fast("vessel", VESSELS)
def test_positions_of_two_formats_agree_to_the_last_digit(logs, vessel, first, second, digit_deg) -> None:
    for name in (first, second):
        pytest.importorskip(FORMATS[name])
    if vessel == "usv_22" and second == "voyage.nmea":
        pytest.skip("the craft's receiver sends NMEA at another rate than the bag has")
    _, _, t_zero = truth_of(vessel)
    both_logs = [log_of(vessel, name).streams for name in (first, second)]
    for axis in ("latitude", "longitude"):
        pair = []
        for streams in both_logs:
            stream = next(s for s in streams if s.quantity == axis)
            good = np.isfinite(stream.values)
            at = np.round((stream.time_s[good] - t_zero) * 100).astype(int)
            pair.append(dict(zip(at.tolist(), stream.values[good].tolist(), strict=True)))
        both = sorted(pair[0].keys() & pair[1].keys())
        assert len(both) > 500
        assert max(abs(pair[0][at] - pair[1][at]) for at in both) <= digit_deg


@pytest.mark.parametrize(("vessel", "name"), CASES)
def test_channels_are_found_and_none_is_wrong_with_high_confidence(logs, vessel, name) -> None:
    pytest.importorskip(FORMATS[name])
    voyage = voyage_of(vessel, name)
    used = {channel.quantity: channel for channel in voyage.channels.channels if channel.use}
    wanted = {"latitude", "longitude", "heading", "yaw_rate"}
    if vessel == "ship_21":
        assert wanted | {"rpm"} <= set(used) and {"rudder_angle", "rudder_order"} & set(used)
        # The dataflash log and the ULog hold orders as shares, whose full deflection only the user knows.
        rudders = [used[key] for key in ("rudder_angle", "rudder_order") if key in used]
        assert all(channel.confidence >= (0.75 if name[-3:] in ("bin", "ulg") else 0.9) for channel in rudders)
    else:
        sides = {"rpm_port", "rpm_starboard"}
        assert wanted | sides <= set(used)
        assert all(used[side].confidence >= 0.9 for side in sides)
    assert used["heading"].stream != "HDG.heading"  # the magnetic compass
    assert not any("battery" in channel.stream or "RCIN" in channel.stream for channel in used.values())
    if name == "voyage_eu.csv" and vessel == "ship_21":
        assert used["rudder_angle"].sign == -1
    assert not any(finding.kind == "fault" for finding in voyage.findings) or name[-3:] in ("bin", "ulg")


def test_revolutions_of_a_ulog_are_assigned_to_sides_by_the_turn(logs) -> None:
    pytest.importorskip("pyulog")
    for side, column in (("port", "n_left_rpm"), ("starboard", "n_right_rpm")):
        error = error_of("usv_22", "voyage.ulg", f"rpm_{side}", column, 2 * np.pi / 60)
        assert error is not None and np.median(np.abs(error)) * 60 / 2 / np.pi < 20


def test_lost_and_spoilt_sentences_are_counted(logs) -> None:
    pytest.importorskip("pynmea2")
    for vessel in VESSELS:
        known, _, _ = truth_of(vessel)
        log = log_of(vessel, "voyage.nmea")
        assert log.counts["lines"] == known["files"]["nmea"]["lines"]
        assert log.counts["corrupted"] == len(known["files"]["nmea"]["corrupted_lines"])


def test_outages_of_the_receiver_are_reported(logs) -> None:
    for vessel, name in (("ship_21", "voyage.csv"), ("usv_22", "voyage.csv")):
        known, _, t_zero = truth_of(vessel)
        x = voyage_of(vessel, name).series["x"]
        for begin, end in known["faults"]["gps_outage_s"]:
            inside = (x.time_s > t_zero + begin + 0.2) & (x.time_s < t_zero + end - 0.2)
            assert not inside.any()
        assert any("position" in finding.text for finding in voyage_of(vessel, name).findings)


def test_bags_of_others_without_a_vessel_are_refused_in_one_line(logs) -> None:
    pytest.importorskip("rosbags")
    from tank2sim.errors import InputError

    for path in sorted((logs / "real").glob("*.bag")):
        log = read_log(path)
        assert {stream.name for stream in log.streams} >= {"u_speed", "y_speed", "position.theta"}
        with pytest.raises(InputError, match="no channel of it is understood"):
            make_voyage([log])
