"""What simulations decide about names that scores gave, on replays that are made up."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from tank2sim.cards import read_card
from tank2sim.gap.inference.fit import ExplanationFit
from tank2sim.gap.proof import judge, judge_surroundings
from tank2sim.gap.proof.improvement import NamedEffects, Proof
from tank2sim.gap.proof.judge import Judge, Judged
from tank2sim.gap.result import AMBIGUOUS, MISSING, NO_EFFECT_MISSING, OUTSIDE_LIBRARY, Passed, Refitted
from tank2sim.gap.search import model_choice
from tank2sim.gap.search.explanations import Search
from tank2sim.gap.search.model_choice import decide
from tests.gap.made_scores import CALM, DRAG, FORCE, FOUR, LAG, fit
from tests.gap.toy import NAMES

NOISE = 0.1
CARD = read_card("mariner")


def replay(misfit: float) -> Passed:
    """A fitted trial whose yaw rate is missed by so many noises."""
    still = {"motion.r": np.zeros(50)}
    off = {"motion.r": np.full(50, misfit * NOISE)}
    return Passed(
        "a", held_out=False, time_s=np.arange(50.0), noise={"motion.r": NOISE}, measured=still, before=off, after=off
    )


class Prover:
    """Gives each explanation a proof with the misfit, and the change of a coefficient in its standard errors, of its
    effects."""

    def __init__(
        self,
        misfit: Callable[[tuple[str, ...]], float],
        moved: Callable[[tuple[str, ...]], float] = lambda effects: 0.0,
    ):
        self.misfit, self.moved = misfit, moved

    def prove(self, best: ExplanationFit) -> Proof:
        effects = best.hypothesis.effects
        coefficient = Refitted("Nv", self.moved(effects), 0.1, 0.0, 1.0)
        return Proof((), NamedEffects(), CARD, CARD, [replay(self.misfit(effects))], (coefficient,))


@pytest.mark.parametrize(
    ("without_drag", "without_force", "named"),
    [(1.0, 0.9, (0, FORCE, LAG)), (1.01, 0.99, (0, DRAG, LAG)), (1.01, 1.01, FOUR)],
)
def test_an_effect_with_little_gain_stays_only_if_simulations_are_closer_with_it(
    monkeypatch, without_drag: float, without_force: float, named: tuple[int, ...]
) -> None:
    monkeypatch.setattr(model_choice, "find_strangeness", lambda likelihood, fit: ())
    misfits = {DRAG: without_drag, FORCE: without_force}

    def misfit(effects: tuple[str, ...]) -> float:
        lacks = [place for place in FOUR if NAMES[place] not in effects]
        return misfits[lacks[0]] if lacks else 1.0

    lost = {DRAG: 15.0, FORCE: 20.0}  # of a gain of 2000, and the card would be wrong without
    threes = [fit(-2000 + less, *(one for one in FOUR if one != gone), width=2.0) for gone, less in lost.items()]
    found = Search(CALM, (fit(-2000, *FOUR, width=0.3), *threes, fit(-1000, 0, width=2.0), fit(0, width=2.5)), ())
    whole = decide(found)
    assert len(whole.best.hypothesis.effects) == len(FOUR)
    decision = Judge(Prover(misfit), 0.5).with_fewer(found, whole).decision
    assert {*decision.best.hypothesis.effects} == {NAMES[place] for place in named}
    assert decision.verdict == MISSING


@pytest.mark.parametrize(
    ("reached", "closer", "width", "named"),
    [
        (1.0, 0.94, 0.5, True),  # the card is right with it, and simulations are a little closer
        (1.0, 0.96, 0.5, False),
        (1.0, 0.5, 1.4, False),  # no card is made right, and the trials were followed to the noise
        (2.0, 1.3, 1.4, True),
        (2.0, 1.5, 1.4, False),
    ],
)
def test_an_effect_that_scores_nearly_as_well_as_none_is_named_if_simulations_are_closer(
    monkeypatch, reached: float, closer: float, width: float, named: bool
) -> None:
    monkeypatch.setattr(model_choice, "find_strangeness", lambda likelihood, fit: ())
    found = Search(CALM, (fit(0, width=1.5), fit(8, 0, width=width)), ())
    none = decide(found)
    assert none.verdict == NO_EFFECT_MISSING
    judge = Judge(Prover(lambda effects: closer if effects else reached), 0.5)
    found_more = judge.with_more(found, judge.with_fewer(found, none))
    decision = found_more.decision
    assert decision.best.hypothesis.effects == ((NAMES[0],) if named else ())
    assert decision.verdict == (MISSING if named else NO_EFFECT_MISSING)
    assert found_more.proof.misfit == pytest.approx(closer if named else reached)
    judged = judge.judge(found, none)
    assert judged.decision.best.hypothesis.effects == ((NAMES[0],) if named else ()) and judged.withheld == ()


@pytest.mark.parametrize(
    ("moved", "gain", "verdict"),
    [(9.0, 40.0, MISSING), (3.0, 40.0, None), (9.0, 5.0, AMBIGUOUS), (9.0, -5.0, AMBIGUOUS), (9.0, -30.0, None)],
)
def test_an_effect_is_named_whose_place_a_coefficient_far_off_would_take(
    monkeypatch, moved: float, gain: float, verdict: str | None
) -> None:
    """Simulations are as close with the coefficient, which is nine of its standard errors off; where the scores are as
    good, too, both are said."""
    monkeypatch.setattr(model_choice, "find_strangeness", lambda likelihood, fit: ())
    smaller = fit(-500, LAG, width=2.5)
    found = Search(CALM, (fit(-500 - gain, FORCE, LAG, width=0.7), smaller, fit(0, width=2.5)), ())
    force = NAMES[FORCE]
    judge = Judge(Prover(lambda effects: 1.0, lambda effects: 1.0 if force in effects else moved), 0.5)
    judged = judge.with_more(found, Judged(replace(decide(found), best=smaller), judge.prover.prove(smaller)))
    assert (force in judged.decision.best.hypothesis.effects) == (verdict is not None)
    if verdict:
        assert judged.decision.verdict == verdict
        assert (smaller in judged.decision.alike) == (verdict == AMBIGUOUS)


@pytest.mark.parametrize(
    ("gain", "moved", "verdict"), [(30.0, 9.0, AMBIGUOUS), (30.0, 3.0, MISSING), (60.0, 9.0, MISSING)]
)
def test_a_name_near_the_noise_is_said_next_to_the_coefficient_that_does_as_well(
    monkeypatch, gain: float, moved: float, verdict: str
) -> None:
    """Roll was named at 96 % where a yaw damping of the card was 15 % off."""
    monkeypatch.setattr(model_choice, "find_strangeness", lambda likelihood, fit: ())
    none = fit(0, width=1.5)
    found = Search(CALM, (fit(-gain, FORCE, width=0.3), none), ())
    prover = Prover(lambda effects: 1.0, lambda effects: 1.0 if effects else moved)
    monkeypatch.setattr(judge, "closes_gap", lambda *arguments: True)
    decision = Judge(prover, 0.5).judge(found, decide(found)).decision
    assert decision.verdict == verdict and decision.best.hypothesis.effects == (NAMES[FORCE],)
    assert (none in decision.alike) == (verdict == AMBIGUOUS)
    assert (decision.confidence(NAMES[FORCE]) == pytest.approx(0.5)) == (verdict == AMBIGUOUS)


@pytest.mark.parametrize(
    ("gain", "after", "sought"),
    [(100.0, 5.0, False), (20.0, 5.0, True), (100.0, 12.0, True), (100.0, 2.0, False)],
)
def test_no_wind_of_each_trial_takes_the_place_of_what_is_far_ahead_and_closes_most_of_the_gap(
    monkeypatch, gain: float, after: float, sought: bool
) -> None:
    """A wave drift whose formula differs leaves something that two numbers to a trial follow."""
    monkeypatch.setattr(model_choice, "find_strangeness", lambda likelihood, fit: ())
    tried = []
    monkeypatch.setattr(judge_surroundings, "_simulated", lambda *arguments: tried.append(arguments) or {})
    found = Search(CALM, (fit(-gain, FORCE), fit(0)), ())
    decision = decide(found)
    assert decision.verdict == MISSING
    closed = replace(replay(after), before={"motion.r": np.full(50, 20 * NOISE)})
    judged = Judged(decision, Proof((), NamedEffects([(NAMES[FORCE], {}, {})]), CARD, CARD, [closed]))
    assert judge_surroundings.judge_surroundings(Prover(lambda effects: after), found, judged, ()) is judged
    assert bool(tried) == sought


@pytest.mark.parametrize(("moved", "stays"), [(9.0, True), (3.0, False)])
def test_a_doubtful_effect_stays_whose_place_a_coefficient_far_off_would_take(
    monkeypatch, moved: float, stays: bool
) -> None:
    monkeypatch.setattr(model_choice, "find_strangeness", lambda likelihood, fit: ())
    found = Search(CALM, (fit(-540, FORCE, LAG), fit(-500, LAG), fit(-50, FORCE), fit(0)), ())
    force = NAMES[FORCE]
    judge = Judge(Prover(lambda effects: 1.0, lambda effects: 1.0 if force in effects else moved), 0.5)
    judged = judge.with_fewer(found, decide(found))
    assert (force in judged.decision.best.hypothesis.effects) == stays


def passed(before: float, after: float, *, held_out: bool = False) -> Passed:
    """A trial that is missed by so many noises by the given card and by the improved one."""
    one = replay(after)
    return replace(one, held_out=held_out, before={"motion.r": np.full(50, before * NOISE)})


@pytest.mark.parametrize(
    ("fitted", "clearly"),
    [
        ((10.0, 4.0), True),
        ((10.0, 7.5), False),
        ((2.9, 0.5), False),  # a gap that is not far above the noise
    ],
)
def test_a_second_explanation_must_bring_the_fitted_trials_clearly_closer(fitted, clearly) -> None:
    assert judge._closes_clearly([passed(*fitted)]) == clearly


@pytest.mark.parametrize(
    ("gain", "coefficients", "named"),
    [
        (30.0, 2.0 / 1.04, True),  # within 5 % of what the card's coefficients alone reach
        (30.0, 2.0 / 1.06, False),
        (41.0, 1.0, True),  # far ahead by its score: coefficients are not asked for
        (39.0, 1.0, False),
    ],
)
def test_a_name_not_far_ahead_must_follow_the_trials_as_closely_as_coefficients_alone(
    monkeypatch, gain: float, coefficients: float, named: bool
) -> None:
    monkeypatch.setattr(model_choice, "find_strangeness", lambda likelihood, fit: ())
    monkeypatch.setattr(judge, "closes_gap", lambda *arguments: True)
    found = Search(CALM, (fit(-gain, FORCE, width=0.3), fit(0, width=1.5)), ())
    judged = Judge(Prover(lambda effects: 2.0 if effects else coefficients), 0.5).judge(found, decide(found))
    assert judged.decision.verdict == (MISSING if named else NO_EFFECT_MISSING)
    assert judged.withheld == (() if named else (NAMES[FORCE],))


@pytest.mark.parametrize(("second", "named"), [(6.0, True), (8.0, False)])
def test_after_a_name_was_excluded_the_next_must_close_the_gap_clearly(monkeypatch, second: float, named: bool) -> None:
    """The best by its score brings no simulation closer; the second leaves 60 or 80 % of the misfit."""
    monkeypatch.setattr(model_choice, "find_strangeness", lambda likelihood, fit: ())
    found = Search(CALM, (fit(-300, FORCE, width=0.3), fit(-250, DRAG, width=0.3), fit(0, width=1.5)), ())

    class Trials(Prover):
        def prove(self, best: ExplanationFit) -> Proof:
            proof, effects = super().prove(best), best.hypothesis.effects
            after = 12.0 if NAMES[FORCE] in effects else second if effects else 10.0
            return replace(proof, results=[passed(10.0, after)])

    judged = Judge(Trials(lambda effects: 1.0), 0.5).judge(found, decide(found))
    assert judged.withheld[0] == NAMES[FORCE] and len(judged.withheld) == (1 if named else 2)
    assert (judged.decision.verdict == MISSING) == named
    if named:
        assert judged.decision.best.hypothesis.effects == (NAMES[DRAG],)
    else:
        assert judged.decision.verdict == OUTSIDE_LIBRARY  # 10 noises are left, and nothing explains them
