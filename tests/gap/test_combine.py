"""Two searches as one result."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tank2sim.gap import workflow
from tank2sim.gap.outcome.combine import combine_passes, without_effect
from tank2sim.gap.result import AMBIGUOUS, MISSING, Named, Passed, Refitted
from tests.gap.made_up import missing, passed

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


def test_what_the_first_search_could_not_distinguish_is_not_distinguished_by_a_second(passes) -> None:
    first, further = passes
    unsure = replace(first, verdict=AMBIGUOUS, alternatives=(("wind",), ("bank_suction", "gyro_bias")))
    combined = combine_passes(unsure, further)
    assert combined.verdict == AMBIGUOUS
    assert combined.alternatives == (("wind", "cross_flow_drag"), ("bank_suction", "gyro_bias", "cross_flow_drag"))
    assert combine_passes(first, further).verdict == MISSING and combine_passes(first, further).alternatives == ()


@pytest.mark.parametrize(
    ("alternatives", "after", "more"),
    [((("wind",),), 5.0, True), ((), 5.0, True), ((("wind",), ()), 5.0, False), ((("wind",),), 1.0, False)],
)
def test_more_is_sought_where_something_is_surely_missing_and_the_trials_are_still_missed(
    alternatives: tuple, after: float, more: bool
) -> None:
    verdict = AMBIGUOUS if alternatives else MISSING
    found = replace(missing(), verdict=verdict, alternatives=alternatives, passed=(passed("turn35", 9.0, after),))
    assert workflow._seeks_more(found, workflow.GapOptions()) == more
    assert not workflow._seeks_more(found, workflow.GapOptions(max_effects=1))


@pytest.mark.parametrize(
    ("before", "after", "adds"), [(6.23, 5.85, False), (6.23, 4.0, True), (1.55, 1.2, True), (1.55, 1.5, False)]
)
def test_a_second_search_adds_only_what_makes_the_misfit_beyond_the_noise_clearly_smaller(
    passes, before: float, after: float, adds: bool
) -> None:
    """The first row is a wind next to a wave drift whose formula differs, which no wind was there to explain."""
    first, further = (
        replace(found, passed=(passed("turn35", 9.0, misfit),))
        for found, misfit in zip(passes, (before, after), strict=True)
    )
    assert workflow._adds(first, further, likely=0.5) == adds


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


def test_an_effect_that_others_make_superfluous_is_gone_and_the_others_are_no_surer_than_before(passes) -> None:
    both = combine_passes(*passes)
    unsure = replace(both, effects=tuple(replace(effect, confidence=0.8) for effect in both.effects))
    smaller = replace(passes[1], effects=(replace(DRAG, confidence=0.99),), coefficients=(), notices=())
    found = without_effect(smaller, unsure, "current")
    assert [(effect.name, effect.confidence) for effect in found.effects] == [("cross_flow_drag", 0.8)]
    assert found.improved is smaller.improved and found.passed is smaller.passed
    assert found.rivals is both.rivals and found.could_hide is both.could_hide
    assert len(found.notices) == 1


@pytest.mark.parametrize(("further_off", "dropped"), [(1.0, True), (1.5, False)])
def test_a_smaller_set_takes_the_place_only_where_it_follows_the_trials_as_closely(
    passes, monkeypatch: pytest.MonkeyPatch, further_off: float, dropped: bool
) -> None:
    both = combine_passes(*passes)

    def away(passed: Passed) -> Passed:
        after = {
            name: passed.measured[name] + further_off * (passed.after[name] - passed.measured[name])
            for name in passed.after
        }
        return replace(passed, after=after)

    asked = []

    def search_again(card, trials, run):
        asked.append(run.options.effects)
        gap = replace(passes[1], effects=(DRAG,), passed=tuple(map(away, both.passed)))
        return SimpleNamespace(gap=gap, trials=trials)

    monkeypatch.setattr(workflow, "_search_once", search_again)
    run = workflow._Run(workflow.GapOptions(), lambda text: None, None, np.inf)
    found = workflow._smaller(both.card, (), (passes[0], both), run)
    assert asked == [("cross_flow_drag",)]
    assert (found is not None) == dropped
