"""Delays between heading and rate of turn: found with an honest error, applied where certain, and reported."""

from __future__ import annotations

import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.apps.logs.content import RateDelay, rate_delay
from tests.apps.logs.made_logs import frame, voyage

STEP = 0.1


def swinging(seconds: int = 900) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times, heading and rate of turn of a vessel that swings with three periods: both written down, none derived."""
    time = np.arange(0, seconds, STEP)
    swings = ((0.25, 40.0), (0.1, 23.0), (0.03, 9.0))
    heading = sum(size * np.sin(2 * np.pi * time / period) for size, period in swings)
    rate = sum(size * 2 * np.pi / period * np.cos(2 * np.pi * time / period) for size, period in swings)
    return time, np.asarray(heading), np.asarray(rate)


@pytest.mark.parametrize("delay", [-0.7, 0.0, 0.35, 1.2])
def test_a_known_delay_is_found_within_its_standard_error(delay) -> None:
    time, heading, rate = swinging()
    rng = np.random.default_rng(3)
    heading = heading + 1e-3 * rng.normal(size=len(time)) + 1e-5 * time  # noise, and a gyro that drifts
    rate = 1.02 * rate + 3e-4 * rng.normal(size=len(time)) + 1e-4  # a scale, noise, and a bias
    found = rate_delay(time, heading, time + delay, rate)
    assert found is not None and found.standard_error_s < 0.02
    assert abs(found.delay_s - delay) < 4 * found.standard_error_s + 0.01
    assert found.certain == (delay != 0.0)


@pytest.mark.parametrize("scale", [0.5, 2.0])
def test_a_rate_of_another_scale_is_as_late_with_the_same_error(scale) -> None:
    """Delays are times: they and their errors do not change with the unit of the rate."""
    time, heading, rate = swinging()
    rate = rate + 3e-4 * np.random.default_rng(3).normal(size=len(time))
    plain, scaled = (rate_delay(time, heading, time + 0.8, factor * rate) for factor in (1.0, scale))
    assert plain is not None and scaled is not None
    assert scaled.delay_s == pytest.approx(0.8, abs=0.01)
    assert scaled.standard_error_s == pytest.approx(plain.standard_error_s, rel=1e-3)


def test_the_standard_error_is_the_scatter_of_the_delay() -> None:
    time, heading, rate = swinging()
    found = []
    for seed in range(20):
        noise = 2e-3 * np.random.default_rng(seed).normal(size=(2, len(time)))
        found.append(rate_delay(time, heading + noise[0], time + 0.4, rate + noise[1]))
    scatter = np.std([one.delay_s for one in found], ddof=1)
    assert np.mean([one.standard_error_s for one in found]) == pytest.approx(scatter, rel=0.5)


@pytest.mark.parametrize(("seconds", "known"), [(359, True), (299, False)])
def test_six_minutes_are_needed(seconds, known) -> None:
    time, heading, rate = swinging(seconds)
    assert (rate_delay(time, heading, time + 0.3, rate) is not None) == known


@pytest.mark.parametrize(
    ("delay", "error", "certain"), [(0.2, 0.03, True), (0.2, 0.05, False), (0.09, 0.001, False), (-0.11, 0.001, True)]
)
def test_a_delay_is_certain_from_a_tenth_of_a_second_and_five_errors(delay, error, certain) -> None:
    assert RateDelay(delay, error).certain == certain


def test_a_delay_of_more_than_three_seconds_is_none() -> None:
    time, heading, rate = swinging()
    assert rate_delay(time, heading, time + 2.8, rate) is not None
    assert rate_delay(time, heading, time + 3.3, rate) is None


def test_what_noise_hides_is_not_certain() -> None:
    time, heading, rate = swinging()
    rng = np.random.default_rng(4)
    found = rate_delay(time, heading + 0.3 * rng.normal(size=len(time)), time + 0.2, rate)
    assert found is not None and not found.certain


def test_a_steady_turn_shows_no_delay() -> None:
    time = np.arange(0, 900, STEP)
    assert rate_delay(time, 0.01 * time, time, np.full(len(time), 0.01)) is None


def slope() -> np.ndarray:
    """Rate of turn in deg/min as the central slope of the heading: that of the made-up voyage is half a step late."""
    return 60 * np.degrees(np.gradient(voyage().heading, voyage().time))


def later(values: np.ndarray, delay_s: float) -> np.ndarray:
    time = voyage().time
    return np.interp(time - delay_s, time, values)


@pytest.mark.parametrize(("late", "quantity"), [("rot_deg_min", "yaw_rate"), ("heading_deg", "heading"), ("", "")])
def test_the_later_of_heading_and_rate_is_set_back(saved, late, quantity) -> None:
    table, made = frame(), voyage()
    rng = np.random.default_rng(7)
    table["rot_deg_min"] = slope() + rng.normal(0, 0.3, len(made.time))
    table["heading_deg"] = np.degrees(made.heading) + rng.normal(0, 0.05, len(made.time))
    if late:
        table[late] = later(table[late].to_numpy(), 0.9)
    table["heading_deg"] %= 360
    found = t2s.log(saved(table, "log.csv"))
    delays = {channel.quantity: channel.delay_s for channel in found.voyage.channels.channels if channel.use}
    for name, delay in delays.items():
        assert delay == (pytest.approx(0.9, abs=0.1) if name == quantity else 0.0), name
    assert any("set back" in notice for notice in found.notices) == bool(late)
    if quantity == "yaw_rate":
        rate, heading = (found.voyage.series[name] for name in ("yaw_rate", "heading"))
        assert rate.time_s[0] == pytest.approx(heading.time_s[0] - delays["yaw_rate"], abs=1e-6)


def test_a_channels_file_without_the_delay_keeps_the_times(saved, tmp_path) -> None:
    table, made = frame(), voyage()
    table["rot_deg_min"] = later(slope(), 0.9)
    table["heading_deg"] = np.degrees(made.heading) % 360
    path = saved(table, "log.csv")
    folder = tmp_path / "voyage"
    t2s.log(path).save(folder)
    text = (folder / "channels.toml").read_text(encoding="utf-8")
    assert text.count("delay_s = 0.") == 1
    (folder / "channels.toml").write_text(text.replace("delay_s = 0.", "delay_s = 0.0 # "), encoding="utf-8")
    again = t2s.log(path, channels=folder / "channels.toml")
    assert all(channel.delay_s == 0.0 for channel in again.voyage.channels.channels)
