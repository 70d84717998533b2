"""Two searches as one result."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tank2sim.gap.outcome.combine import combine_passes
from tank2sim.gap.result import Named, Passed, Refitted
from tests.gap.made_up import missing

DRAG = Named("cross_flow_drag", {"drag_coefficient": 0.4}, {"drag_coefficient": 0.02}, 0.99)


def halved(passed: Passed) -> Passed:
    """The same trial, missed by half as much after as before."""
    after = {name: passed.measured[name] + 0.5 * (passed.after[name] - passed.measured[name]) for name in passed.after}
    return replace(passed, before=passed.after, after=after)


@pytest.fixture
def passes():
    first = replace(missing(), coefficients=(Refitted("Yv", -0.012, 1e-4, -0.011, 5e-4),), effect_alone={"fit": 9.0})
    again = (Refitted("Yv", -0.0125, 5e-5, -0.012, 1e-4), Refitted("current.speed", 0.5, 0.01, 0.45, 0.02))
    further = replace(
        missing(), effects=(DRAG,), coefficients=again, effect_alone={}, passed=tuple(map(halved, first.passed))
    )
    return first, further


def test_effects_of_both_searches_are_named_and_those_of_the_first_as_they_were_fitted_again(passes) -> None:
    combined = combine_passes(*passes)
    current, drag = combined.effects
    assert (current.name, drag) == ("current", DRAG)
    assert current.parameters["speed_mps"] == 0.5 and current.standard_errors["speed_mps"] == 0.01
    assert current.parameters["direction_rad"] == pytest.approx(-np.pi / 2)


def test_coefficients_are_compared_with_those_of_the_given_card(passes) -> None:
    (yv,) = combine_passes(*passes).coefficients
    assert (yv.value, yv.before, yv.standard_error_before) == (-0.0125, -0.011, 5e-4)


def test_trials_are_shown_before_the_first_and_after_the_second_search(passes) -> None:
    first, further = passes
    combined = combine_passes(first, further)
    for held_out in (False, True):
        assert combined.misfit("before", held_out=held_out) == first.misfit("before", held_out=held_out)
        assert combined.misfit("after", held_out=held_out) == further.misfit("after", held_out=held_out)
    assert combined.improved is further.improved and combined.card is first.card
