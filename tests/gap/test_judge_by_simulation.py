"""What simulations report of names that scores gave, on replays that are made up."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tank2sim.cards import read_card
from tank2sim.gap.inference.fit import ExplanationFit
from tank2sim.gap.proof import judge_surroundings
from tank2sim.gap.proof.improvement import NamedEffects, Proof
from tank2sim.gap.proof.judge import Judged, judge
from tank2sim.gap.result import (
    AMBIGUOUS,
    COEFFICIENTS,
    MISSING,
    NO_EFFECT_MISSING,
    OUTSIDE_LIBRARY,
    Passed,
    Refitted,
    Surroundings,
)
from tank2sim.gap.search.decision import Decision
from tank2sim.gap.search.explanations import Search
from tests.gap.made_scores import CALM, DRAG, FORCE, fit
from tests.gap.toy import NAMES

NOISE = 0.1
CARD = read_card("mariner")
ONE, OTHER, NONE = fit(-100, FORCE), fit(-99, DRAG), fit(0)
FOUND = Search(CALM, (ONE, OTHER, NONE), ())


def passed(before: float, after: float) -> Passed:
    """A fitted trial whose yaw rate is missed by so many noises by the given card and by the improved one."""
    still = {"motion.r": np.zeros(50)}
    off = ({"motion.r": np.full(50, misfit * NOISE)} for misfit in (before, after))
    return Passed("a", False, np.arange(50.0), {"motion.r": NOISE}, still, *off)


class Prover:
    """Gives each explanation a proof with the misfit of its effects after, and `before`; `refits` coefficients."""

    def __init__(self, before: float, after: Callable[[tuple[str, ...]], float], *, refits: bool = False):
        self.before, self.after = before, after
        self.coefficients = (Refitted("Nv", 9.0, 0.1, 0.0, 1.0),) if refits else ()

    def prove(self, best: ExplanationFit) -> Proof:
        results = [passed(self.before, self.after(best.hypothesis.effects))]
        return Proof((), NamedEffects(), CARD, CARD, results, self.coefficients)


def decision(verdict: str, best: ExplanationFit, *alike: ExplanationFit, strange=()) -> Decision:
    return Decision(verdict, best, alike, {}, strange)


@pytest.mark.parametrize(
    ("before", "after", "named"), [(10.0, 2.0, True), (10.0, 8.9, True), (10.0, 9.5, False), (10.0, 12.0, False)]
)
def test_a_name_with_which_simulations_come_no_closer_is_withheld(before: float, after: float, named: bool) -> None:
    judged = judge(Prover(before, lambda effects: after if effects else before), FOUND, decision(MISSING, ONE))
    assert judged.decision.verdict == (MISSING if named else OUTSIDE_LIBRARY)
    assert judged.withheld == ("" if named else NAMES[FORCE])
    assert judged.proof.misfit == pytest.approx(after if named else before)


@pytest.mark.parametrize("alike", [(), (OTHER,)])
def test_a_verdict_of_the_scores_is_not_changed_by_how_close_simulations_come(alike) -> None:
    scored = decision(AMBIGUOUS if alike else MISSING, ONE, *alike)
    for after in (0.9, 1.3, 5.0):
        assert judge(Prover(10.0, lambda effects, after=after: after), FOUND, scored).decision is scored


@pytest.mark.parametrize(("after", "named"), [(6.0, True), (8.0, False)])
@pytest.mark.parametrize("alike", [(), (OTHER,)])
def test_next_to_something_unknown_a_name_must_close_the_gap_clearly(after: float, named: bool, alike) -> None:
    odd = decision(OUTSIDE_LIBRARY, ONE, *alike, strange=("a push",))
    judged = judge(Prover(10.0, lambda effects: after if effects else 10.0), FOUND, odd)
    assert judged.decision.verdict == ((AMBIGUOUS if alike else MISSING) if named else OUTSIDE_LIBRARY)
    assert judged.withheld == ""


@pytest.mark.parametrize(
    ("before", "after", "refits", "verdict"),
    [
        (1.2, 1.1, True, NO_EFFECT_MISSING),  # near the noise
        (2.9, 1.0, True, NO_EFFECT_MISSING),
        (2.9, 1.3, False, NO_EFFECT_MISSING),
        (10.0, 2.9, True, COEFFICIENTS),  # near the noise with other coefficients
        (100.0, 19.0, True, COEFFICIENTS),
        (100.0, 21.0, True, OUTSIDE_LIBRARY),
        (10.0, 10.0, False, OUTSIDE_LIBRARY),  # nothing explains it
    ],
)
def test_where_nothing_is_named_the_coefficients_explain_the_gap_or_nothing_does(
    before: float, after: float, refits: bool, verdict: str
) -> None:
    judged = judge(Prover(before, lambda effects: after, refits=refits), FOUND, decision(NO_EFFECT_MISSING, NONE))
    assert judged.decision.verdict == verdict and judged.withheld == ""
    odd = decision(OUTSIDE_LIBRARY, NONE, strange=("a push",))
    judged = judge(Prover(before, lambda effects: after, refits=refits), FOUND, odd)
    followed = after <= 1.2  # to the noise: an odd passage of its innovations is then no missing effect
    assert judged.decision.verdict == (verdict if followed else OUTSIDE_LIBRARY)


@pytest.mark.parametrize(("moved", "alternatives"), [(4.0, (("linear_yaw_damping",),)), (2.0, ())])
def test_an_effect_that_is_the_error_of_one_coefficient_is_said_next_to_it(moved: float, alternatives) -> None:
    prover = Prover(10.0, lambda effects: 1.0)
    prover.coefficients = (Refitted("Nr", moved, 0.1, 0.0, 1.0), Refitted("Yv", 0.5, 0.1, 0.0, 1.0))
    judged = judge(prover, FOUND, decision(NO_EFFECT_MISSING, NONE))
    assert judged.decision.verdict == COEFFICIENTS and judged.alternatives(CARD) == alternatives
    outside = replace(judged, decision=replace(judged.decision, verdict=OUTSIDE_LIBRARY))
    assert outside.alternatives(CARD) == ()


@pytest.mark.parametrize(("after", "sought"), [(12.0, True), (2.0, False)])
def test_no_wind_of_each_trial_takes_the_place_of_what_closes_most_of_the_gap(
    monkeypatch, after: float, sought: bool
) -> None:
    """A wave drift whose formula differs leaves something that two numbers to a trial follow."""
    tried = []
    monkeypatch.setattr(judge_surroundings, "_simulated", lambda *arguments: tried.append(arguments) or {})
    far = replace(passed(20.0, after), after={"motion.r": np.full(50, after * 3 * NOISE)})
    named = NamedEffects([(NAMES[FORCE], {}, {})])
    judged = Judged(decision(MISSING, ONE), Proof((), named, CARD, CARD, [replace(far, before=passed(60, 0).before)]))
    assert judge_surroundings.judge_surroundings(Prover(20.0, lambda effects: after), FOUND, judged, ()) is judged
    assert bool(tried) == sought


@pytest.mark.parametrize(("speed_mps", "named"), [(8.0, True), (110.0, False)])
def test_a_wind_that_never_blows_is_not_named_by_simulation(monkeypatch, speed_mps: float, named: bool) -> None:
    """Two numbers to a trial also follow a card that is far off; a wind of 110 m/s is no explanation."""
    blows = {"a": Surroundings(speed_mps, 0.0, 1.0, 0.1)}
    common = judge_surroundings.CommonSurroundings("wind", {}, {}, blows, np.array([0.1]))
    monkeypatch.setattr(judge_surroundings, "fit_common_surroundings", lambda *arguments: common)
    monkeypatch.setattr(judge_surroundings, "_at", lambda fit, *others: fit)
    monkeypatch.setattr(judge_surroundings, "closes_gap", lambda *arguments: True)
    wind = SimpleNamespace(hypothesis=SimpleNamespace(effects=("wind",)))
    none = SimpleNamespace(hypothesis=SimpleNamespace(recorded=()))
    search = SimpleNamespace(fits=(wind,), none=none, likelihood=SimpleNamespace(motion=SimpleNamespace(names=("a",))))
    prover = SimpleNamespace(
        card=CARD,
        trials=(None, None),
        replays=SimpleNamespace(executor=None, noise={}),
        prove=lambda fit, named: SimpleNamespace(results=()),
    )
    assert bool(judge_surroundings._simulated(prover, search, ["wind"])) == named
