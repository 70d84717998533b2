"""The steering gear of a log against gears that were made up, and the log of a commissioning at the dock."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.apps.logs.gear import LoggedGear

ORDERS = [0, 10, -5, -20, 15, 15.6, 3, 3.7, -12, 0, 8, -8, -8.7, 12]


def voyage(
    folder: Path, *, rate: float = 3.0, lag_s: float = 0.7, band: float = 1.0, noise: float = 0.05, order: bool = True
) -> LoggedGear | None:
    """The gear by a CSV log of a rudder that follows :data:`ORDERS`, 8 s each; angles in deg, 5 Hz."""
    step = 0.01
    time = np.arange(0.0, 8.0 * len(ORDERS), step)
    asked = np.repeat(ORDERS, round(8.0 / step)).astype(float)
    angle, moving, found = 0.0, False, []
    for number in range(len(time)):
        found.append(angle)
        off = asked[max(0, number - round(lag_s / step))] - angle
        moving = abs(off) > band or (moving and abs(off) > 1e-9)
        angle += min(max(off, -rate * step), rate * step) if moving else 0.0
    rows = slice(None, None, 20)
    random = np.random.default_rng(3)
    measured = np.array(found)[rows]
    measured += noise * random.standard_normal(len(measured))
    columns = {"time_s": time[rows], "rudder_angle_deg": measured}
    if order:
        columns["rudder_order_deg"] = asked[rows]
    columns["heading_deg"] = 90 + 0.01 * random.standard_normal(len(measured))  # at the dock
    path = folder / "dock.csv"
    table = [",".join(f"{value:.4f}" for value in row) for row in zip(*columns.values(), strict=True)]
    lines = [",".join(columns), *table]
    path.write_text("\n".join(lines) + "\n")
    return t2s.log(path).study.gear


@pytest.mark.parametrize(("rate", "lag_s", "band"), [(3.0, 0.7, 1.0), (6.0, 1.5, 0.3)])
def test_rate_lag_and_dead_band_of_a_gear_are_found_within_their_errors(tmp_path, rate, lag_s, band) -> None:
    gear = voyage(tmp_path, rate=rate, lag_s=lag_s, band=band)
    assert gear is not None and gear.rate_degps is not None and gear.rate_error_degps is not None
    assert gear.rate_degps == pytest.approx(rate, abs=max(3 * gear.rate_error_degps, 0.03 * rate))
    assert gear.lag_s == pytest.approx(lag_s, abs=0.15)
    # An order off by more than the band moves the rudder, one by less does not: 0.6 and 0.7 deg are between.
    assert (gear.dead_band_deg > 0.65) == (band > 0.65)
    assert gear.residual_deg == pytest.approx(0.05, abs=0.15)
    assert gear.moves == 7  # up, down, up, down, up, down, up
    assert gear.starboard is not None and gear.port is not None
    assert gear.starboard.angle_deg == pytest.approx(15.6, abs=0.1)
    assert gear.port.angle_deg == pytest.approx(-20.0, abs=0.1)


def test_a_log_without_orders_says_nothing_of_the_gear(tmp_path) -> None:
    assert voyage(tmp_path, order=False) is None


def test_an_order_that_was_recorded_at_another_time_says_nothing_of_the_gear(tmp_path) -> None:
    """The order ends before the angle begins: nothing is simulated, and nothing fails."""
    time = np.arange(0.0, 200.0, 0.2)
    lines = ["time_s,rudder_order_deg,rudder_angle_deg,heading_deg"]
    for each in time:
        angle = f"{10 * math.sin(each / 5):.3f}"
        early, late = (angle, "") if each < 90 else ("", angle)
        lines.append(f"{each:.1f},{early},{late},90.{int(each) % 7}")
    path = tmp_path / "apart.csv"
    path.write_text("\n".join(lines) + "\n")
    assert t2s.log(path).study.gear is None


def test_a_rudder_that_does_not_follow_the_order_has_no_gear(tmp_path) -> None:
    time = np.arange(0.0, 200.0, 0.2)
    columns = (time, 10 * np.sign(np.sin(time / 4)), 12 * np.sin(time / 2.7 + 1), 90 + 0.01 * np.cos(time))
    rows = [",".join(f"{value:.4f}" for value in row) for row in zip(*columns, strict=True)]
    path = tmp_path / "other.csv"
    path.write_text("\n".join(["time_s,rudder_order_deg,rudder_angle_deg,heading_deg", *rows]) + "\n")
    assert t2s.log(path).study.gear is None


def test_the_gear_of_a_boat_at_the_dock_is_found_though_no_turn_confirms_its_rudder(data: Path) -> None:
    """Commissioning of an autopilot: swept by hand to -38 and +35 deg, then steered by orders of 6 deg."""
    result = t2s.log(data / "data/canboat_n2k/ac42-commissioning.raw")
    gear = result.study.gear
    assert gear is not None
    assert gear.port is not None and gear.port.angle_deg == pytest.approx(-38.0, abs=0.3)
    assert gear.starboard is not None and gear.starboard.angle_deg == pytest.approx(35.0, abs=0.3)
    assert 0.05 < gear.lag_s < 0.4 and gear.dead_band_deg < 0.3
    assert gear.rate_degps is None  # the orders are slower than the drive
    assert 20 < gear.fastest_degps < 35
    assert math.isfinite(gear.residual_deg) and gear.words in result.headline
