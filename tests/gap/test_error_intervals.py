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
