"""Clocks of made-up times: falls, leaps, repeated samples, gaps."""

from __future__ import annotations

import numpy as np
import pytest

from tank2sim.apps.logs.clock import board_start, continued_clock, full_year, gaps_of, rollover_s, tidied, utc_text
from tank2sim.apps.logs.streams import LogStream

TRUE = 1_700_000_000.0 + np.arange(100.0)


def near(times: np.ndarray, expected: np.ndarray) -> bool:
    """Equal to a microsecond: a relative tolerance of times since 1970 would be hours."""
    return bool(np.abs(times - expected).max() < 1e-6)


def test_a_clock_that_rises_stays_as_it_is() -> None:
    times, findings = continued_clock(TRUE, "clock")
    assert np.array_equal(times, TRUE) and findings == []


def test_two_falls_one_after_the_other_add_up_and_one_leap_ends_one_of_them() -> None:
    clock = TRUE - 500.0 * (TRUE[30] <= TRUE) - 70.0 * (TRUE[50] <= TRUE)
    times, findings = continued_clock(clock, "clock")
    assert near(times, TRUE) and len(findings) == 2


def test_a_gap_is_no_fault() -> None:
    paused = np.concatenate([TRUE[:40], TRUE[40:] + 300])
    times, findings = continued_clock(paused, "clock")
    assert np.array_equal(times, paused) and findings == []
    assert gaps_of(times, 5.0) == [(TRUE[39], TRUE[40] + 300)]


@pytest.mark.parametrize("fall_s", [3.0, 60.0, 86400.0])
def test_a_clock_set_back_runs_on(fall_s) -> None:
    times, (finding,) = continued_clock(np.where(TRUE[60] <= TRUE, TRUE - fall_s, TRUE), "clock")
    assert near(times, TRUE) and finding.kind == "fault"
    assert finding.evidence["fall_s"] == pytest.approx(fall_s - 1)


def test_a_clock_set_back_and_right_again_is_right_again() -> None:
    late = np.where((TRUE[30] <= TRUE) & (TRUE[70] > TRUE), TRUE - 500, TRUE)
    times, findings = continued_clock(late, "clock")
    assert near(times, TRUE) and len(findings) == 1


@pytest.mark.parametrize("leap_s", [18.0, 3600.0])
def test_a_leap_ahead_for_a_while_is_taken_back(leap_s) -> None:
    ahead = np.where((TRUE[30] <= TRUE) & (TRUE[70] > TRUE), TRUE + leap_s, TRUE)
    times, (finding,) = continued_clock(ahead, "clock")
    assert near(times, TRUE) and finding.evidence["leap_s"] == pytest.approx(leap_s)


@pytest.mark.parametrize(
    ("late_s", "right_again"),
    [(500.0, True), (501.0, True), (499.0, True), (502.5, False), (490.0, False), (510.0, False)],
)
def test_a_later_leap_ends_a_fall_only_if_it_is_as_large_to_two_samples(late_s: float, right_again: bool) -> None:
    """The clock falls by 499 s where it should rise by 1, and leaps later by about as much; else that is a gap."""
    clock = np.where(TRUE[30] <= TRUE, TRUE - 500.0, TRUE) + np.where(TRUE[70] <= TRUE, late_s, 0.0)
    times, findings = continued_clock(clock, "clock")
    assert near(times[:70], TRUE[:70]) and len(findings) == 1
    assert near(times[70:], clock[70:] if right_again else clock[70:] + 500.0)


@pytest.mark.parametrize(
    ("back_s", "taken_back"), [(3600.0, True), (3601.0, True), (3599.0, True), (3602.5, False), (3605.0, False)]
)
def test_a_leap_is_taken_back_only_if_the_fall_is_as_large_to_two_samples(back_s: float, taken_back: bool) -> None:
    clock = np.where(TRUE[30] <= TRUE, TRUE + 3600.0, TRUE) - np.where(TRUE[70] <= TRUE, back_s, 0.0)
    times, (finding,) = continued_clock(clock, "clock")
    if taken_back:
        assert near(times, np.where(TRUE[70] > TRUE, TRUE, clock)) and "leap_s" in finding.evidence
    else:
        assert near(times[:70], clock[:70]) and near(times[70:], TRUE[70:] + 3600.0)
        assert finding.evidence["fall_s"] == pytest.approx(back_s - 1)


@pytest.mark.parametrize("step_s", [0.1, 10.0])
@pytest.mark.parametrize(("steps", "fault"), [(1.4, False), (1.6, True)])
def test_a_fall_of_more_than_one_and_a_half_steps_is_a_clock_set_back(step_s: float, steps: float, fault: bool) -> None:
    true = step_s * np.arange(100.0)
    clock = np.where(true >= true[60], true - (1 + steps) * step_s, true)
    times, findings = continued_clock(clock, "clock")
    assert bool(findings) == fault and near(times, true if fault else clock)


def test_a_receiver_that_lost_whole_weeks_of_its_counter_is_set_right_and_a_recorder_is_not() -> None:
    week = 604800.0
    for turns in (1, 2, -1):
        added, (finding,) = rollover_s(-1024 * week * turns + 3600.0)
        assert added == 1024 * week * turns and finding.evidence["weeks"] == 1024 * turns
    assert rollover_s(0.9 * 86400.0) == (0.0, [])
    added, (finding,) = rollover_s(-3 * 86400.0)
    assert added == 0.0 and finding.evidence["days"] == pytest.approx(-3.0)
    added, (finding,) = rollover_s(1024 * week + 2 * 86400.0)  # two days beside it: no counter's fault
    assert added == 0.0 and finding.evidence["days"] == pytest.approx(7170.0)


def test_years_of_two_digits_begin_with_gps() -> None:
    assert [full_year(year) for year in (79, 80, 99, 0)] == [2079, 1980, 1999, 2000]


def test_the_start_of_a_board_is_the_least_lag_and_the_median_where_the_receiver_leaps() -> None:
    findings: list = []
    lag = np.array([100.3, 100.1, 100.9, 100.2])
    assert board_start(lag, "GPS", findings) == 100.1 and findings == []
    assert board_start(np.append(lag, 98.0), "GPS", findings) == 100.2 and len(findings) == 1


@pytest.mark.parametrize(("apart", "text"), [(4.0, "two instruments"), (2.0, "the time of another")])
def test_repeated_times_are_two_instruments_if_they_differ_by_more_than_three_steps(apart: float, text: str) -> None:
    values = np.column_stack([np.arange(100.0), np.arange(100.0) + apart]).ravel()
    _, repeated, (finding,) = tidied(LogStream("a", np.repeat(TRUE, 2), values))
    assert repeated == 100 and text in finding.text
    few = np.repeat(TRUE, [2] * 20 + [1] * 80)  # a sixth: chance
    assert tidied(LogStream("a", few, np.arange(120.0) * apart))[1:] == (20, [])


def test_samples_out_of_order_are_sorted_and_no_fault() -> None:
    order = np.arange(100)
    order[[40, 41]] = 41, 40
    stream, repeated, findings = tidied(LogStream("a", TRUE[order], order.astype(float)))
    assert np.array_equal(stream.values, np.arange(100.0)) and (repeated, findings) == (0, [])


def test_repeated_samples_and_values_that_are_none_are_left_out() -> None:
    times = np.repeat(TRUE, [1] * 99 + [3])
    values = np.concatenate([np.arange(99.0), [99.0, 99.0, 99.0]])
    values[5], values[6] = np.nan, 1e200
    stream, repeated, _ = tidied(LogStream("a", times, values))
    assert (len(stream.values), repeated) == (98, 2)


def test_two_instruments_under_one_name_are_a_fault() -> None:
    values = np.column_stack([np.arange(100.0), np.arange(100.0) + 50]).ravel()
    stream, repeated, (finding,) = tidied(LogStream("RMC.latitude", np.repeat(TRUE, 2), values))
    assert repeated == 100 and "two instruments" in finding.text and np.array_equal(stream.values, np.arange(100.0))


def test_times_in_words() -> None:
    assert utc_text(1_691_365_806.0) == "2023-08-06T23:50:06.000Z"
    assert utc_text(1_691_366_399.9996) == "2023-08-07T00:00:00.000Z"


def test_a_time_beyond_all_calendars_is_none() -> None:
    time = np.arange(100.0)
    time[60] = 1e154
    tidy, _, findings = tidied(LogStream("heading", time, np.arange(100.0)))
    assert len(tidy.values) == 99 and not findings
