"""What is said of scores, on explanations that are made up."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from tank2sim.cards import ManoeuvringCard, parse_card
from tank2sim.gap.diagnosis.strangeness import Strange
from tank2sim.gap.inference.fit import ExplanationFit
from tank2sim.gap.inference.hypothesis import Hypothesis
from tank2sim.gap.inference.prior import PRICE
from tank2sim.gap.result import AMBIGUOUS, MISSING, NO_EFFECT_MISSING, OUTSIDE_LIBRARY
from tank2sim.gap.search import decision as module
from tank2sim.gap.search.decision import LISTED, STANDARD_ERRORS, SUREST, TEMPER, decide, is_significant
from tank2sim.gap.search.explanations import CLOSE, Search
from tank2sim.gap.workflow import RIVALS, _rivals
from tests.gap.made_scores import CALM, fit
from tests.gap.toy import NAMES, Toy, toy_motion
from tests.gap.toy_likelihood import LOGS, judge
from tests.identification.trials import made_up_ship

YAW, SURGE, SWAY, *_ = NAMES
SETS = ((), (0,), (1,), (2,), (0, 1), (0, 2), (1, 2))


def said(theta) -> module.Decision:
    """The decision on the toy with some forces hidden, all single ones and pairs fitted."""
    of = judge(toy_motion(theta), spread=1.0)
    fits = [
        of.at_best(Toy((None,) * len(indices), indices=indices), np.full(len(indices), 0.1), [LOGS], [0, 8])
        for indices in SETS
    ]
    return decide(Search(of, tuple(sorted(fits, key=lambda fit: fit.score)), ()))


@pytest.mark.parametrize(
    ("theta", "verdict", "effects"),
    [
        pytest.param((), NO_EFFECT_MISSING, (), marks=pytest.mark.slow),
        ((0.8,), MISSING, (YAW,)),
        ((0.0, -0.8), MISSING, (SURGE,)),
        ((0.9, 0.8), MISSING, NAMES[:2]),
    ],
)
def test_what_is_hidden_in_the_toy_is_said(theta, verdict, effects) -> None:
    found = said(theta)
    assert (found.verdict, found.best.hypothesis.effects) == (verdict, effects)
    assert found.strange == () and found.alike == ()
    assert sum(found.probabilities.values()) == pytest.approx(1.0)
    for name, size in zip(NAMES, theta, strict=False):
        assert found.confidence(name) > 0.9 or size == 0
    for value, estimate in zip(found.best.theta, found.best.hypothesis.estimated, strict=True):
        assert value == pytest.approx(theta[NAMES.index(estimate.effect)], abs=0.3)


# -- scores typed by hand --------------------------------------------------------------------------------------------


@pytest.fixture
def calm(monkeypatch) -> None:
    monkeypatch.setattr(module, "find_strangeness", lambda likelihood, fit: ())


def of_scores(*fits: ExplanationFit, false_discovery: float = 0.5) -> module.Decision:
    return decide(Search(CALM, tuple(sorted(fits, key=lambda found: found.score)), ()), false_discovery)


@pytest.mark.usefixtures("calm")
@pytest.mark.parametrize(
    ("fits", "verdict", "effects", "alike"),
    [
        # less probable than nothing, more probable, and a size that is not reported from nothing
        ([fit(0), fit(-PRICE + 0.1, 0)], NO_EFFECT_MISSING, (), []),
        ([fit(0), fit(-PRICE - 0.1, 0)], MISSING, (YAW,), []),
        ([fit(0), fit(-50, 0, sure=STANDARD_ERRORS - 0.1)], NO_EFFECT_MISSING, (), []),
        ([fit(0), fit(-50, 0, sure=STANDARD_ERRORS + 0.1)], MISSING, (YAW,), []),
        # what is not significant is not compared, whatever it scores
        ([fit(0), fit(-50, 0), fit(-90, 1, sure=1.0)], MISSING, (YAW,), []),
        # each effect must pay for itself
        ([fit(0), fit(-50, 0), fit(-50 - PRICE + 0.1, 0, 1)], MISSING, (YAW,), []),
        ([fit(0), fit(-50, 0), fit(-50 - PRICE - 0.1, 0, 1)], MISSING, (YAW, SURGE), []),
        ([fit(0), fit(-5, 0), fit(-40, 0, 1)], MISSING, (YAW, SURGE), []),
        ([fit(0), fit(-8, 0), fit(-12, 0, 1)], NO_EFFECT_MISSING, (), []),
        ([fit(0), fit(-50, 0), fit(-58, 0, 1), fit(-75, 0, 1, 2)], MISSING, (YAW, SURGE, SWAY), []),
        # three are as good: none of them is more probable than not
        ([fit(0), fit(-50, 0), fit(-50, 1), fit(-49.9, 2)], AMBIGUOUS, (YAW,), [(SURGE,), (SWAY,)]),
        # each of three effects is more probable than not, and no pair of them is
        (
            [fit(0), fit(-90, 0, 1), fit(-89.9, 0, 2), fit(-89.8, 1, 2)],
            AMBIGUOUS,
            (YAW, SURGE),
            [(YAW, SWAY), (SURGE, SWAY)],
        ),
    ],
)
def test_the_most_probable_set_is_named_alone_where_it_is_sure(fits, verdict, effects, alike) -> None:
    found = of_scores(*fits)
    assert (found.verdict, found.best.hypothesis.effects) == (verdict, effects)
    assert [alternative.hypothesis.effects for alternative in found.alike] == alike


@pytest.mark.usefixtures("calm")
def test_probabilities_are_those_of_the_scores() -> None:
    found = of_scores(fit(0), fit(-30, 0), fit(-24, 1), fit(-46, 0, 1))
    weights = np.exp(np.array([0, 30 - PRICE, 24 - PRICE, 46 - 2 * PRICE]) / (2 * TEMPER))
    expected = dict(zip([(), (YAW,), (SURGE,), (YAW, SURGE)], weights / weights.sum(), strict=True))
    assert found.probabilities == pytest.approx(expected)
    assert found.confidence(YAW) == pytest.approx(expected[YAW,] + expected[YAW, SURGE])
    assert found.confidence(SWAY) == 0
    huge = of_scores(fit(-1e5), fit(-1e5 - 3e4, 0))
    assert huge.probabilities[YAW,] == pytest.approx(1.0) and huge.confidence(YAW) == SUREST < 1


@pytest.mark.usefixtures("calm")
@pytest.mark.parametrize("false_discovery", [0.5, 0.3, 0.1, 0.02])
@pytest.mark.parametrize("behind", [1.0, 4.0, 12.0, 40.0])
def test_a_name_that_is_not_sure_enough_comes_with_what_holds_the_rest(false_discovery: float, behind: float) -> None:
    fits = fit(0), fit(-80, 0), fit(-80 + behind, 1), fit(-80 + 1.5 * behind, 2)
    found = of_scores(*fits, false_discovery=false_discovery)
    named = [found.best.hypothesis.effects, *(one.hypothesis.effects for one in found.alike)]
    if found.verdict == MISSING:
        assert found.confidence(YAW) >= 1 - false_discovery and named == [(YAW,)]
    else:
        assert found.verdict == AMBIGUOUS and found.confidence(YAW) < 1 - false_discovery
        held = [found.probabilities[effects] for effects in named]
        assert len(named) >= 2 and sum(held) >= LISTED and sum(held[:-1]) < max(LISTED, held[0] + 1e-12)
        assert held == sorted(held, reverse=True)


@pytest.mark.usefixtures("calm")
def test_where_no_other_effect_comes_near_the_alternative_is_nothing() -> None:
    fits = fit(-PRICE - 12, 0), fit(0)  # odds of exp(2) to 1
    (alternative,) = of_scores(*fits, false_discovery=0.05).alike
    assert alternative.hypothesis.effects == () and of_scores(*fits).alike == ()


@pytest.mark.parametrize("fits", [[fit(0)], [fit(0), fit(-50, 0)], [fit(0), fit(-50, 0), fit(-49, 1)]])
def test_no_name_is_said_where_the_innovations_are_strange(monkeypatch, fits) -> None:
    odd = (Strange("period", "", 20.0, 20.0, 99.0),)
    asked = []
    monkeypatch.setattr(module, "find_strangeness", lambda likelihood, fit: asked.append(fit) or odd)
    found = of_scores(*fits)
    assert found.verdict == OUTSIDE_LIBRARY and found.strange == odd
    assert asked == [found.best] and found.best.score == min(candidate.score for candidate in fits)


@pytest.mark.parametrize("effect", ["linear_yaw_damping", "added_sway_mass", "rudder_effectiveness"])
def test_what_the_card_may_be_wrong_by_is_not_named(effect: str) -> None:
    """A card's derivative is known to 2 %: a rescaling below 6 % is no effect, however surely it was measured."""
    card = parse_card(made_up_ship.CARD, "made_up.toml")
    assert isinstance(card, ManoeuvringCard)
    assert card.standard_error("Nr") == pytest.approx(0.02 * abs(card.derivatives["Nr"]))
    hypothesis = Hypothesis(card, "angle", [effect])
    for factor, named in ((0.05, False), (-0.05, False), (0.07, True), (-0.07, True)):
        found = ExplanationFit(hypothesis, np.array([factor]), np.array([[1e-8]]), LOGS, 0.0, np.zeros(0))
        assert is_significant(found) == named, factor
        unsure = replace(found, covariance=np.array([[(abs(factor) / 2.9) ** 2]]))
        assert not is_significant(unsure)


def test_a_rate_of_the_gear_that_the_card_may_be_wrong_by_is_not_named() -> None:
    """5 deg/s are stated, and known to 2 %: 4.8 deg/s are no slower gear, 4.6 deg/s are."""
    stated = made_up_ship.CARD.replace("[steering_gear]", "[steering_gear]\nmax_rate_degps = 5.0")
    for text, rate, named in ((stated, 4.8, False), (stated, 4.6, True), (made_up_ship.CARD, 4.8, True)):
        hypothesis = Hypothesis(parse_card(text, "made_up.toml"), "order", ["rudder_rate_limit"])
        found = ExplanationFit(hypothesis, np.array([np.radians(rate)]), np.array([[1e-12]]), LOGS, 0.0, np.zeros(0))
        assert is_significant(found) == named, rate


def test_a_gear_that_is_better_than_the_card_states_is_no_fault_of_it() -> None:
    """5 deg/s and 0.5 s are stated: 8 deg/s, or 0.2 s, are no limit and no lag."""
    stated = made_up_ship.CARD.replace("[steering_gear]", "[steering_gear]\nmax_rate_degps = 5.0")
    for name, value, named in (
        *(("rudder_rate_limit", np.radians(8.0), False), ("rudder_rate_limit", np.radians(3.0), True)),
        *(("rudder_lag", 0.2, False), ("rudder_lag", 1.0, True)),
    ):
        hypothesis = Hypothesis(parse_card(stated, "made_up.toml"), "order", [name])
        found = ExplanationFit(hypothesis, np.array([value]), np.array([[1e-12]]), LOGS, 0.0, np.zeros(0))
        assert is_significant(found) == named, (name, value)


def test_an_effect_without_amplitude_is_out_by_its_score_alone() -> None:
    card = parse_card(made_up_ship.CARD, "made_up.toml")
    hypothesis = Hypothesis(card, "order", ["rudder_lag"])
    assert is_significant(ExplanationFit(hypothesis, np.array([3.0]), np.array([[100.0]]), LOGS, 0.0, np.zeros(0)))


@pytest.mark.usefixtures("calm")
def test_the_named_set_is_reported_however_many_larger_ones_score_better() -> None:
    pairs = [*combinations(range(1, 8), 2)]
    larger = [fit(-60.0 - place / 10, 0, *pair, sure=1.0) for place, pair in enumerate(pairs)]
    search = Search(CALM, (*sorted(larger, key=lambda one: one.score), fit(-50, 0), fit(0)), ())
    reported = {rival.effects: rival for rival in _rivals(search, decide(search))}
    assert {(YAW,), ()} <= set(reported) and len(reported) <= RIVALS + 1
    assert reported[YAW,].probability > 0.9 and sum(rival.probability for rival in reported.values()) == pytest.approx(
        1
    )
    losses = [rival.loss for rival in reported.values()]
    assert losses[0] == 0 and losses == sorted(losses)


@pytest.mark.usefixtures("calm")
def test_a_fit_that_was_given_up_is_not_reported_as_worse_than_nothing() -> None:
    search = Search(CALM, (fit(-50, 0), fit(0), fit(CLOSE - 1, 1), fit(CLOSE + 1, 2)), ())
    assert [rival.effects for rival in _rivals(search, decide(search))] == [(YAW,), (), (SURGE,)]
