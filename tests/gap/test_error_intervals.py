"""When records contradict each other, and when forces are missing, on values made by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tank2sim.gap.diagnosis.error_intervals import acting, contradiction, missing_force_intervals, missing_signal
from tank2sim.gap.result import Acting, Named
from tests.gap import made_up
from tests.gap.misfit_motion import TIME, motion

FAULTS = [
    ({"bias": 5e-4}, "turning", -5e-4),
    ({"current": 0.3}, "north", 0.3),
]


@pytest.mark.parametrize(("fault", "quantity", "size"), FAULTS)
def test_what_records_lack_has_the_size_that_was_put_in(fault: dict[str, float], quantity: str, size: float) -> None:
    """A gyro that shows too much turning: the heading turns less than it says."""
    found = missing_signal([motion(seed=seed, **fault) for seed in (1, 2, 3)])
    assert found is not None and found.quantity == quantity
    assert np.mean(found.values) == pytest.approx(size, rel=0.05)
    assert np.std(found.values) < 2 * np.mean(found.errors)
    assert min(found.explained.values()) > 0.8  # a constant goes with every state


def test_a_log_that_shows_too_little_lacks_speed_ahead_and_not_to_north() -> None:
    slow = []
    for seed in (1, 2):
        replay = motion(seed=seed)
        slow.append(replace(replay, measured={**replay.measured, "motion.u": 0.9 * replay.measured["motion.u"]}))
    found = missing_signal(slow)
    assert found is not None and found.quantity == "ahead"
    assert np.mean(found.values) == pytest.approx(0.5, rel=0.03)


def test_a_current_to_the_east_is_lacking_there_and_a_log_set_askew_lacks_speed_to_starboard() -> None:
    """The log's velocity ahead and to starboard turned by 0.06 rad: at 5 m/s ahead it misses 0.3 m/s to the side."""
    east, askew = [], []
    for seed in (1, 2):
        replay = motion(seed=seed)
        seen = replay.measured
        east.append(replace(replay, measured={**seen, "motion.y": seen["motion.y"] - 0.3 * TIME}))
        askew.append(replace(replay, measured={**seen, "motion.v": seen["motion.v"] - 0.3}))
    found = missing_signal(east)
    assert found is not None and found.quantity == "east" and np.mean(found.values) == pytest.approx(-0.3, rel=0.05)
    found = missing_signal(askew)
    assert found is not None and found.quantity == "starboard" and np.mean(found.values) == pytest.approx(0.3, rel=0.05)


def test_errors_of_what_is_lacking_are_its_scatter_and_its_times_the_middles() -> None:
    """A rate of heading over 42 s, less the mean of the gyro: half a span is lost at either end."""
    found = missing_signal([motion(seed=seed, bias=5e-4, name=str(seed)) for seed in range(1, 9)])
    assert found is not None
    assert np.std(found.values) == pytest.approx(np.mean(found.errors), rel=0.3)
    track = missing_signal([motion(seed=seed, current=0.3, name=str(seed)) for seed in range(1, 17)])
    assert track is not None and np.std(track.values) == pytest.approx(np.mean(track.errors), rel=0.12)
    assert (found.time_s.min(), found.time_s.max()) == (21.0, TIME[-1] - 21.0)
    assert set(found.states) == {"heading", "yaw rate", "speed", "drift"}
    assert np.mean(found.states["drift"]) == pytest.approx(np.arctan2(0.8, 5.0), abs=1e-3)
    assert np.mean(found.states["speed"]) == pytest.approx(np.hypot(0.8, 5.0), abs=1e-2)
    for rows, known in ((84, False), (90, True)):
        short = motion(bias=5e-3)
        parts = {n: {k: v[:rows] for k, v in getattr(short, n).items()} for n in ("measured", "before", "after")}
        assert (missing_signal([replace(short, time_s=TIME[:rows], **parts)]) is not None) == known


def test_the_state_that_explains_what_is_lacking_is_named() -> None:
    """A gyro of another scale, in a record that turns ever faster: the error goes with the yaw rate."""
    wrong = []
    for seed in (1, 2):
        replay = motion(seed=seed)
        rate = 0.025 * np.cos(TIME / 60.0)
        psi = 0.025 * 60.0 * np.sin(TIME / 60.0)
        seen = {key: values for key, values in replay.measured.items() if key in ("motion.u", "motion.v")}
        noise = np.random.default_rng(seed).standard_normal((2, len(TIME)))
        seen |= {"motion.r": 1.1 * rate + 3e-4 * noise[0], "motion.psi": psi + 2e-3 * noise[1]}
        wrong.append(replace(replay, measured=seen, noise={key: replay.noise[key] for key in seen}))
    found = missing_signal(wrong)
    assert found is not None and found.quantity == "turning" and found.explaining == "yaw rate"
    assert found.explained["yaw rate"] > 0.8 > found.explained["speed"]


def test_records_that_agree_lack_nothing() -> None:
    assert missing_signal([motion(seed=seed) for seed in (1, 2)]) is None
    assert missing_signal([]) is None


def test_a_current_acts_from_the_beginning_to_the_end_and_a_late_one_late() -> None:
    late = motion(seed=4, name="late")
    drift = 0.3 * np.clip(TIME - 250.0, 0.0, None)
    late = replace(late, measured={**late.measured, "motion.x": late.measured["motion.x"] + drift})
    gap = replace(made_up.missing(), passed=(motion(current=0.3), late))
    whole, part = acting(gap)
    assert (whole.trial, whole.equation, part.trial, part.equation) == ("turn", "track", "late", "track")
    assert whole.t_start_s == 0.0 and whole.t_end_s == pytest.approx(TIME[-1], abs=0.6)
    assert part.t_start_s == pytest.approx(250.0, abs=25.0) and part.t_end_s == pytest.approx(TIME[-1], abs=0.6)


def test_forces_act_where_one_is_missing_and_not_next_to_a_current_alone() -> None:
    passage = Acting("turn35", "yaw", 10.0, 20.0, 5.0)
    gap = replace(made_up.missing(), passed=(motion(),), missing_force=replace(made_up.force(), passages=(passage,)))
    assert acting(gap) == () and missing_force_intervals(gap) is None
    bias = Named("rudder_bias", {"angle_rad": 0.01}, {}, 0.9)
    both = replace(gap, effects=(*gap.effects, bias))
    assert acting(both) == (passage,) and missing_force_intervals(both) is not None
    alone = replace(gap, effects=(bias,), equation="actuator", passed=(motion(current=0.3),))
    assert contradiction(alone) is None and missing_force_intervals(alone) is not None
