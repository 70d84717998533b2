"""Clocks of made-up times: falls, leaps, repeated samples, gaps."""

from __future__ import annotations

import numpy as np
import pytest

from tank2sim.logs.clock import continued_clock, gaps_of, tidied, utc_text
from tank2sim.logs.streams import LogStream

TRUE = 1_700_000_000.0 + np.arange(100.0)


def test_a_clock_that_rises_stays_as_it_is() -> None:
    times, findings = continued_clock(TRUE, "clock")
    assert np.array_equal(times, TRUE) and findings == []


def test_a_gap_is_no_fault() -> None:
    paused = np.concatenate([TRUE[:40], TRUE[40:] + 300])
    times, findings = continued_clock(paused, "clock")
    assert np.array_equal(times, paused) and findings == []
    assert gaps_of(times, 5.0) == [(TRUE[39], TRUE[40] + 300)]


@pytest.mark.parametrize("fall_s", [3.0, 60.0, 86400.0])
def test_a_clock_set_back_runs_on(fall_s) -> None:
    times, (finding,) = continued_clock(np.where(TRUE[60] <= TRUE, TRUE - fall_s, TRUE), "clock")
    assert np.allclose(times, TRUE) and finding.kind == "fault"
    assert finding.evidence["fall_s"] == pytest.approx(fall_s - 1)


def test_a_clock_set_back_and_right_again_is_right_again() -> None:
    late = np.where((TRUE[30] <= TRUE) & (TRUE[70] > TRUE), TRUE - 500, TRUE)
    times, findings = continued_clock(late, "clock")
    assert np.allclose(times, TRUE) and len(findings) == 1


@pytest.mark.parametrize("leap_s", [18.0, 3600.0])
def test_a_leap_ahead_for_a_while_is_taken_back(leap_s) -> None:
    ahead = np.where((TRUE[30] <= TRUE) & (TRUE[70] > TRUE), TRUE + leap_s, TRUE)
    times, (finding,) = continued_clock(ahead, "clock")
    assert np.allclose(times, TRUE) and finding.evidence["leap_s"] == pytest.approx(leap_s)


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
