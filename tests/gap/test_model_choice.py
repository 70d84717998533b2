"""What is said of scores and of innovations, on explanations and innovations that are made up."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter

from tank2sim.cards import ManoeuvringCard, parse_card
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.gap.inference.fit import ExplanationFit
from tank2sim.gap.inference.hypothesis import Hypothesis
from tank2sim.gap.result import AMBIGUOUS, MISSING, NO_EFFECT_MISSING, OUTSIDE_LIBRARY
from tank2sim.gap.search import model_choice as module
from tank2sim.gap.search.explanations import Search
from tank2sim.gap.search.model_choice import (
    ALIKE,
    DOUBTFUL,
    DOUBTFUL_IF_RIGHT,
    EVIDENCE_NEEDED,
    SAME_KIND_SHARE,
    STANDARD_ERRORS,
    SUREST,
    TEMPER,
    Strange,
    decide,
    decide_for,
    decide_without,
    doubtful_effects,
    find_strangeness,
    is_significant,
    makes_the_card_right,
    with_one_more,
)
from tests.gap.made_scores import BIAS, CALM, DRAG, FORCE, FOUR, IN_A_SEA, LAG, LATE, fit
from tests.gap.toy import NAMES, Toy, toy_motion
from tests.gap.toy_likelihood import LOGS, judge
from tests.identification.trials import made_up_ship

YAW, SURGE, SWAY, *_ = NAMES
SETS = ((), (0,), (1,), (2,), (0, 1), (0, 2), (1, 2))


def said(theta) -> module.Decision:
    """Of the toy with some forces hidden, all single ones and pairs fitted."""
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


def of_scores(*fits: ExplanationFit) -> module.Decision:
    return decide(Search(CALM, tuple(sorted(fits, key=lambda found: found.score)), ()))


@pytest.mark.usefixtures("calm")
def test_where_waves_were_found_scores_count_half_as_much() -> None:
    fits = fit(-1.5 * EVIDENCE_NEEDED, 0), fit(0)
    for likelihood, verdict in ((CALM, MISSING), (IN_A_SEA, NO_EFFECT_MISSING)):
        decision = decide(Search(likelihood, fits, ()))
        assert decision.verdict == verdict
        odds = decision.probabilities[fits[0].hypothesis.effects] / decision.probabilities[()]
        halved = 2 if likelihood is IN_A_SEA else 1
        assert odds == pytest.approx(np.exp(1.5 * EVIDENCE_NEEDED / 2 / module.TEMPER / halved))


@pytest.mark.usefixtures("calm")
@pytest.mark.parametrize(
    ("fits", "verdict", "effects", "alike"),
    [
        # not enough, enough, and a size that is not reported from nothing
        ([fit(0), fit(-EVIDENCE_NEEDED + 0.1, 0)], NO_EFFECT_MISSING, (), []),
        ([fit(0), fit(-EVIDENCE_NEEDED - 0.1, 0)], MISSING, (YAW,), []),
        ([fit(0), fit(-50, 0, sure=STANDARD_ERRORS - 0.1)], NO_EFFECT_MISSING, (), []),
        ([fit(0), fit(-50, 0, sure=STANDARD_ERRORS + 0.1)], MISSING, (YAW,), []),
        # another as good, and one that is not
        ([fit(0), fit(-50, 0), fit(-50 + ALIKE - 0.1, 1)], AMBIGUOUS, (YAW,), [(SURGE,)]),
        ([fit(0), fit(-50, 0), fit(-50 + ALIKE + 0.1, 1)], MISSING, (YAW,), []),
        ([fit(0), fit(-50, 0), fit(-49, 1, sure=1.0)], MISSING, (YAW,), []),
        ([fit(0), fit(-11, 0), fit(-7, 1)], AMBIGUOUS, (YAW,), [(SURGE,)]),
        # a second effect must pay for itself
        ([fit(0), fit(-50, 0), fit(-50 - EVIDENCE_NEEDED + 0.1, 0, 1)], MISSING, (YAW,), []),
        ([fit(0), fit(-50, 0), fit(-50 - EVIDENCE_NEEDED - 0.1, 0, 1)], MISSING, (YAW, SURGE), []),
        ([fit(0), fit(-50, 0), fit(-90, 0, 1, sure=2.0)], MISSING, (YAW,), []),
        ([fit(0), fit(-50, 0), fit(-90, 1, 2), fit(-88, 0, 1)], AMBIGUOUS, (SURGE, SWAY), [(YAW, SURGE)]),
        # a pair with one of another single effect is no rival of a single one
        ([fit(0), fit(-50, 0), fit(-54, 0, 1), fit(-52, 1, 2)], MISSING, (YAW,), []),
        # many that are a little less good are together more probable than the best
        (
            [fit(0), fit(-50, 0), *(fit(-50 + ALIKE + 0.5, index) for index in range(1, 7))],
            AMBIGUOUS,
            (YAW,),
            [(name,) for name in NAMES[1:7]],
        ),
        # a pair alone: no single effect stands out, or none is enough
        ([fit(0), fit(-5, 0, sure=1.0), fit(-40, 0, 1)], MISSING, (YAW, SURGE), []),
        ([fit(0), fit(-5, 0), fit(-40, 0, 1)], MISSING, (YAW, SURGE), []),
        ([fit(0), fit(-8, 0), fit(-12, 0, 1)], NO_EFFECT_MISSING, (), []),
        # of as many effects the best alone is named: with one of them the card may be wrong by as much
        ([fit(0), fit(-50, 0), fit(-92, 0, 2, sure=2.0), fit(-90, 0, 1)], MISSING, (YAW,), []),
        ([fit(0), fit(-50, 0), fit(-88, 0, 2, sure=2.0), fit(-90, 0, 1)], MISSING, (YAW, SURGE), []),
        # so must a third, against the best with fewer
        ([fit(0), fit(-50, 0), fit(-70, 0, 1), fit(-80.1, 0, 1, 2)], MISSING, (YAW, SURGE, SWAY), []),
        ([fit(0), fit(-50, 0), fit(-70, 0, 1), fit(-79.9, 0, 1, 2)], MISSING, (YAW, SURGE), []),
        ([fit(0), fit(-50, 0), fit(-58, 0, 1), fit(-65, 0, 1, 2)], MISSING, (YAW,), []),
        ([fit(0), fit(-50, 0), fit(-58, 0, 1), fit(-69, 0, 1, 2)], MISSING, (YAW, SURGE, SWAY), []),
        ([fit(0), fit(-50, 0), fit(-70, 0, 1), fit(-90, 0, 1, 2, sure=2.0)], MISSING, (YAW, SURGE), []),
    ],
)
def test_verdicts_follow_the_scores(fits, verdict, effects, alike) -> None:
    found = of_scores(*fits)
    assert (found.verdict, found.best.hypothesis.effects) == (verdict, effects)
    assert [alternative.hypothesis.effects for alternative in found.alike] == alike


@pytest.mark.usefixtures("calm")
def test_a_name_that_is_not_sure_enough_is_one_of_several() -> None:
    fits = [fit(0), fit(-50, 0), fit(-38, 1)]  # odds of exp(2) to 1
    search = Search(CALM, tuple(sorted(fits, key=lambda found: found.score)), ())
    assert 0.85 < decide(search).confidence(YAW) < 0.9
    for share, verdict in ((0.5, MISSING), (0.2, MISSING), (0.1, AMBIGUOUS), (0.02, AMBIGUOUS)):
        found = decide(search, share)
        assert found.verdict == verdict and found.best.hypothesis.effects == (YAW,)
        assert [other.hypothesis.effects for other in found.alike] == ([] if verdict == MISSING else [(SURGE,)])


@pytest.mark.usefixtures("calm")
def test_where_no_other_effect_comes_near_the_alternative_is_nothing() -> None:
    search = Search(CALM, (fit(-12, 0), fit(0)), ())  # odds of exp(2) to 1
    (alternative,) = decide(search, 0.05).alike
    assert alternative.hypothesis.effects == () and decide(search).alike == ()


@pytest.mark.usefixtures("calm")
@pytest.mark.parametrize(
    ("pair", "share"),
    [
        ((FORCE, DRAG), SAME_KIND_SHARE["force"]),
        ((DRAG, BIAS), SAME_KIND_SHARE["force"]),
        ((LAG, LATE), SAME_KIND_SHARE["actuator"]),
        ((FORCE, LAG), 0.0),
        ((0, 1), 0.0),
    ],
)
def test_a_second_effect_of_the_same_kind_must_have_a_share_of_the_gain(pair, share: float) -> None:
    """Of a gain of 2000 in all: a little less than the share, a little more, and what is enough otherwise."""
    names = tuple(NAMES[place] for place in pair)
    for part in (share * 2000 - 1, share * 2000 + 1, EVIDENCE_NEEDED + 1):
        found = of_scores(fit(0), fit(-2000 + part, pair[0]), fit(-2000, *pair))
        assert found.best.hypothesis.effects == (names if part > max(share * 2000, EVIDENCE_NEEDED) else names[:1]), (
            part
        )


@pytest.mark.usefixtures("calm")
@pytest.mark.parametrize(("without", "of_both", "named"), [(2.0, 0.3, 2), (2.0, 0.9, 1), (0.9, 0.3, 1)])
def test_no_share_is_asked_of_an_effect_without_which_the_card_would_be_wrong(
    without: float, of_both: float, named: int
) -> None:
    one, both = fit(-2000 + EVIDENCE_NEEDED + 1, FORCE, width=without), fit(-2000, FORCE, DRAG, width=of_both)
    assert len(of_scores(fit(0, width=2.5), one, both).best.hypothesis.effects) == named


@pytest.mark.usefixtures("calm")
@pytest.mark.parametrize(("third", "share"), [(DRAG, SAME_KIND_SHARE["force"]), (LAG, 0.0)])
def test_a_third_effect_of_the_kind_of_another_must_have_a_share_of_the_gain(third: int, share: float) -> None:
    pair = (0, FORCE)
    for part in (share * 2000 - 1, share * 2000 + 1, EVIDENCE_NEEDED + 1):
        found = of_scores(fit(0), fit(-1000, 0), fit(-2000 + part, *pair), fit(-2000, *pair, third))
        assert len(found.best.hypothesis.effects) == (3 if part > max(share * 2000, EVIDENCE_NEEDED) else 2), part


@pytest.mark.usefixtures("calm")
def test_the_simplest_explanation_is_not_named_where_what_it_lacks_is_far_likelier() -> None:
    """A pair that is within the card's uncertainty is no name, but makes a name without it improbable."""
    pair = fit(-120, 1, 2, sure=2.0)  # odds of exp(70/6) to 1 against the single one
    found = of_scores(fit(0), fit(-50, 0), pair)
    assert (found.verdict, found.best.hypothesis.effects, found.alike) == (NO_EFFECT_MISSING, (), ())
    nearly = of_scores(fit(0), fit(-50, 0), fit(-54, 1, 2, sure=2.0))  # odds of exp(4/6) to 1 against it
    assert (nearly.verdict, nearly.best.hypothesis.effects) == (AMBIGUOUS, (YAW,))
    assert [other.hypothesis.effects for other in nearly.alike] == [(SURGE, SWAY)]


@pytest.mark.usefixtures("calm")
@pytest.mark.parametrize(("gain", "named"), [(EVIDENCE_NEEDED - 1, 0), (EVIDENCE_NEEDED + 1, 2)])
def test_more_effects_must_be_ahead_of_what_simulations_excluded(gain: float, named: int) -> None:
    search = Search(CALM, (fit(-50 - gain, 0, 1), fit(0)), ())
    assert len(decide(search, excluded=[fit(-50, 0)]).best.hypothesis.effects) == named
    assert len(decide(search, excluded=[fit(-50, 2)]).best.hypothesis.effects) == 2  # holds none of it


def search_of_four(force: float, drag: float) -> Search:
    """Four effects with a gain of 2000, and three of them each time, with so much of it less."""
    lost = {0: 900.0, FORCE: force, DRAG: drag, LAG: 100.0}
    threes = [fit(-2000 + lost[without], *(one for one in FOUR if one != without)) for without in FOUR]
    fits = [fit(0), fit(-1000, 0), *threes, fit(-2000, *FOUR)]
    return Search(CALM, tuple(sorted(fits, key=lambda found: found.score)), ())


@pytest.mark.parametrize(
    ("force", "drag", "doubtful"),
    [(20, 15, (DRAG, FORCE)), (15, 20, (FORCE, DRAG)), (DOUBTFUL + 1, DOUBTFUL - 1, (DRAG,)), (70, 80, ())],
)
def test_effects_with_little_gain_next_to_others_are_doubtful(force, drag, doubtful) -> None:
    search = search_of_four(force, drag)
    assert doubtful_effects(search, search.fits[0]) == tuple(NAMES[place] for place in doubtful)
    assert doubtful_effects(search, next(one for one in search.fits if len(one.hypothesis.effects) == 1)) == ()


@pytest.mark.parametrize(("gain", "doubtful"), [(DOUBTFUL_IF_RIGHT - 1, True), (DOUBTFUL_IF_RIGHT + 1, False)])
def test_an_effect_that_makes_the_card_right_is_less_doubtful(gain: float, doubtful: bool) -> None:
    """Without it the coefficients are off by twice their standard errors: simulations are as close either way."""
    whole, without = fit(-2000, DRAG, LAG, width=0.4), fit(-2000 + gain, LAG, width=2.0)
    search = Search(CALM, (whole, without, fit(0)), ())
    assert doubtful_effects(search, whole) == ((NAMES[DRAG],) if doubtful else ())


@pytest.mark.usefixtures("calm")
def test_an_effect_that_swings_is_half_as_far_ahead_of_what_does_not(monkeypatch) -> None:
    """Ahead by 15 it is given alone, unless its frequency can adapt to random forces."""
    search = Search(CALM, (fit(-300, FORCE), fit(-285, DRAG), fit(0)), ())
    steady = decide(search)
    assert (steady.verdict, steady.alike) == (MISSING, ())
    swings = {**EFFECTS, NAMES[FORCE]: replace(EFFECTS[NAMES[FORCE]], resonant=True)}
    monkeypatch.setattr("tank2sim.gap.search.model_choice.EFFECTS", swings)
    swinging = decide(search)
    assert swinging.verdict == AMBIGUOUS and [one.hypothesis.effects for one in swinging.alike] == [(NAMES[DRAG],)]
    odds = [one.confidence(NAMES[FORCE]) / one.confidence(NAMES[DRAG]) for one in (steady, swinging)]
    assert odds[1] == pytest.approx(np.sqrt(odds[0]))


@pytest.mark.usefixtures("calm")
def test_without_a_doubtful_effect_the_others_are_judged_among_what_does_not_hold_it() -> None:
    search = search_of_four(300.0, 12.0)
    whole = decide(search)
    fewer = decide_without(search, whole, NAMES[DRAG], 0.5)
    assert {*fewer.best.hypothesis.effects} == {NAMES[place] for place in FOUR if place != DRAG}
    assert fewer.alike == () and fewer.verdict == MISSING
    assert all(NAMES[DRAG] not in effects for effects in fewer.probabilities)
    assert decide_without(search, fewer, NAMES[LAG], 0.5) is fewer  # the pair was not fitted


def test_one_effect_more_is_tried_that_scores_nearly_as_well_and_is_significant() -> None:
    best, near, far = fit(-50, 0), fit(-50 + ALIKE - 1, 0, 2), fit(-50 + ALIKE + 1, 0, 4)
    others = fit(-49, 2, 3), fit(-48, 0, 1, sure=2.0), fit(-47, 0, 1, 2), fit(0)
    search = Search(CALM, tuple(sorted([best, near, far, *others], key=lambda found: found.score)), ())
    assert with_one_more(search, best) == (near,)


@pytest.mark.usefixtures("calm")
@pytest.mark.parametrize(("width", "right"), [(0.7, True), (0.8, False)])
def test_an_effect_that_makes_the_card_right_is_compared_with_those_that_do(width: float, right: bool) -> None:
    """Probabilities of a larger explanation in place of none, whose coefficients are off by 1.5 standard errors."""
    none, wide, narrow = fit(0, width=1.5), fit(4, 1, width=1.5), fit(8, 2, width=0.6)
    larger = fit(6, 0, width=width)
    search = Search(CALM, (none, wide, larger, narrow), ())
    assert makes_the_card_right(larger, none) == right
    assert not makes_the_card_right(fit(6, 0, width=0.3), fit(0, width=0.99))
    found = decide_for(search, larger, none, 0.5)
    scores = {(): 6 + EVIDENCE_NEEDED, (YAW,): 6, (SWAY,): 8} | ({} if right else {(SURGE,): 4})
    weights = {effects: np.exp(-score / 2 / TEMPER) for effects, score in scores.items()}
    for effects, weight in weights.items():
        assert found.probabilities[effects] == pytest.approx(weight / sum(weights.values()))
    assert found.best is larger and (found.probabilities[SURGE,] == 0.0) == right
    assert [one.hypothesis.effects for one in found.alike] == ([(SWAY,)] if right else [(), (SURGE,), (SWAY,)])


@pytest.mark.usefixtures("calm")
def test_probabilities_are_those_of_the_scores() -> None:
    found = of_scores(fit(0), fit(-30, 0), fit(-24, 1), fit(-36, 0, 1))
    weights = np.exp([0, 15 / TEMPER, 12 / TEMPER, 18 / TEMPER])
    expected = dict(zip([(), (YAW,), (SURGE,), (YAW, SURGE)], weights / weights.sum(), strict=True))
    assert found.probabilities == pytest.approx(expected)
    assert found.confidence(YAW) == pytest.approx(expected[YAW,] + expected[YAW, SURGE])
    assert found.confidence(SWAY) == 0
    huge = of_scores(fit(-1e5), fit(-1e5 - 3e4, 0))
    assert huge.probabilities[YAW,] == pytest.approx(1.0) and huge.confidence(YAW) == SUREST < 1


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


# -- innovations that are made up ------------------------------------------------------------------------------------

RUNS, BLOCKS, NY, BLOCK_S = 4, 200, 6, 2.5
LENGTHS = np.array([200, 200, 150, 90])


def made_up(seed: int, *, added=0.0, theta=None, gaps: float = 0.05, pushed=0.0):
    """A likelihood and a fit of two parameters by least squares, to white noise; `theta` (R, 2) are each trial's own
    values of them, less those of the fit. The force that is left over is of first order by scipy's filter, four times
    as large as the smoother may be wrong by, and `pushed` (R, BLOCKS, 3) more."""
    rng = np.random.default_rng(seed)
    inside = np.arange(BLOCKS) < LENGTHS[:, None]
    known = inside[..., None] & (rng.random((RUNS, BLOCKS, NY)) > gaps)
    X = np.where(known[..., None], rng.standard_normal((RUNS, BLOCKS, NY, 2)), 0.0)
    e = rng.standard_normal((RUNS, BLOCKS, NY)) + added
    if theta is not None:
        e = e + np.einsum("rtyk,rk->rty", X, theta)
    e = np.where(known, e, 0.0)
    flat = X.reshape(-1, 2)
    best = np.linalg.lstsq(flat, e.ravel(), rcond=None)[0]
    e = e - X @ best
    motion = SimpleNamespace(
        names=tuple("abcd"),
        blocks=BLOCKS,
        block_s=BLOCK_S,
        lengths=LENGTHS,
        times=100.0 * np.arange(RUNS)[:, None] + BLOCK_S * (np.arange(BLOCKS) + 0.5),
    )
    fades = np.exp(-BLOCK_S / np.exp(LOGS[-4:-1]))
    shocks = rng.standard_normal((RUNS, 2 * BLOCKS, 3))
    forces = np.stack([lfilter([np.sqrt(1 - f**2)], [1, -f], shocks[..., i], axis=1) for i, f in enumerate(fades)], -1)
    states = np.zeros((RUNS, BLOCKS, 9 + NY))
    states[..., 6:9] = 4 * forces[:, BLOCKS:] + pushed
    spread = np.broadcast_to(np.eye(3), (RUNS, BLOCKS, 3, 3))
    motion.inside = inside
    # what is left over falls as a parameter grows
    whitened = np.concatenate([e[..., None], -X], axis=-1)
    likelihood = SimpleNamespace(
        motion=motion,
        known=known,
        innovations=lambda fit: e,
        whiten=lambda fit: (whitened, e),
        smooth=lambda fit: (states, spread),
    )
    return likelihood, ExplanationFit(Toy((None, None)), best, np.linalg.inv(flat.T @ flat), LOGS, 0.0, np.zeros(0))


@pytest.mark.parametrize("seeds", [range(60), pytest.param(range(60, 200), marks=pytest.mark.slow)])
def test_white_noise_is_not_strange(seeds) -> None:
    strange = {seed: found for seed in seeds if (found := find_strangeness(*made_up(seed, gaps=0.05 * (seed % 3))))}
    assert strange == {}


@pytest.mark.parametrize("run", [0, 3])
def test_a_burst_is_a_passage_of_its_trial(run: int) -> None:
    added = np.zeros((RUNS, BLOCKS, NY))
    added[run, 60:75, 1:3] = 3.0
    first, *_ = find_strangeness(*made_up(1, added=added))
    assert (first.kind, first.trial) == ("passage", "abcd"[run])
    begin, end = 100.0 * run + BLOCK_S * np.array([60.5, 74.5])
    assert first.begin_s == pytest.approx(begin, abs=12 * BLOCK_S)
    assert first.end_s == pytest.approx(end, abs=12 * BLOCK_S)


def test_a_burst_at_the_end_of_a_short_run_ends_with_it() -> None:
    added = np.zeros((RUNS, BLOCKS, NY))
    added[3, 80:90] = 3.0
    found = [strange for strange in find_strangeness(*made_up(2, added=added)) if strange.kind == "passage"]
    assert [strange.trial for strange in found] == ["d"]
    assert 300.0 + BLOCK_S * 65.5 < found[0].begin_s < found[0].end_s <= 300.0 + BLOCK_S * 89.5 + 1e-9


@pytest.mark.parametrize("period", [8.3, 21.0, 60.0])
def test_a_line_in_all_trials_is_a_period(period: float) -> None:
    """Of a phase of its own in each, in one of six signals and as large as its noise: no passage stands out."""
    t = BLOCK_S * np.arange(BLOCKS)
    added = np.zeros((RUNS, BLOCKS, NY))
    added[..., 4] = np.sin(2 * np.pi * t / period + np.arange(RUNS)[:, None])
    found = find_strangeness(*made_up(3, added=added, gaps=0.0))
    assert [strange.kind for strange in found] == ["period"]
    assert found[0].begin_s == found[0].end_s == pytest.approx(period, rel=0.05)


@pytest.mark.parametrize(("run", "axis"), [(1, 1), (2, 2)])
def test_a_force_that_pushes_once_is_strange_and_one_that_pushes_always_is_not(run: int, axis: int) -> None:
    pushed = np.zeros((RUNS, BLOCKS, 3))
    pushed[run, 70:95, axis] = 40.0
    (first,) = find_strangeness(*made_up(6, pushed=pushed))
    assert (first.kind, first.trial) == ("push", "abcd"[run])
    begin, end = 100.0 * run + BLOCK_S * np.array([70.5, 94.5])
    assert first.begin_s == pytest.approx(begin, abs=25 * BLOCK_S) and first.end_s == pytest.approx(
        end, abs=25 * BLOCK_S
    )
    pushed[...] = 40.0 * np.sin(np.arange(BLOCKS))[:, None]
    assert find_strangeness(*made_up(6, pushed=pushed)) == ()


def test_a_trial_that_has_another_value_disagrees() -> None:
    theta = np.zeros((RUNS, 2))
    theta[2, 1] = 0.35  # some ten of its standard errors; in a trial's passages it drowns
    found = find_strangeness(*made_up(4, theta=theta))
    assert [(strange.kind, strange.trial) for strange in found] == [("trial", "c")]
    assert (found[0].begin_s, found[0].end_s) == pytest.approx((200.0 + 0.5 * BLOCK_S, 200.0 + 149.5 * BLOCK_S))


def test_the_strangest_is_reported_first() -> None:
    added, theta = np.zeros((RUNS, BLOCKS, NY)), np.zeros((RUNS, 2))
    added[0, 20:60] = 4.0
    theta[2, 1] = 0.35
    found = find_strangeness(*made_up(5, added=added, theta=theta))
    assert found[0].kind == "passage" and {strange.kind for strange in found} >= {"passage", "trial"}
    assert [strange.excess for strange in found] == sorted((strange.excess for strange in found), reverse=True)
    assert all(np.isfinite(strange.excess) for strange in found)


@pytest.mark.parametrize("memory", [0.0, 0.9])
def test_noise_of_another_colour_has_no_strange_passage(memory: float) -> None:
    """Sums of squares of coloured noise vary more: chance still makes one in twenty as strange as once in twenty."""
    blocks, rng, excess = 400, np.random.default_rng(4), []
    for _ in range(60):
        white = rng.standard_normal((blocks + 100, 3))
        noise = lfilter([math.sqrt(1 - memory**2)], [1.0, -memory], white, axis=0)[100:]
        motion = SimpleNamespace(names=("a",), blocks=blocks, lengths=[blocks], times=np.arange(blocks)[None, :])
        likelihood = SimpleNamespace(motion=motion, known=np.ones((1, blocks, 3), dtype=bool))
        (found,) = module._passages(likelihood, noise[None])
        excess.append(found.excess)
    assert np.mean(np.array(excess) > -2 * math.log(0.05)) < 0.25
    assert np.mean(np.array(excess) > -2 * math.log(3e-3)) < 0.1


def test_a_burst_in_white_noise_is_the_strangest_passage() -> None:
    noise = np.random.default_rng(4).standard_normal((1, 400, 3))
    noise[0, 200:212] *= 3
    motion = SimpleNamespace(names=("a",), blocks=400, lengths=[400], times=10.0 * np.arange(400)[None, :])
    (found,) = module._passages(SimpleNamespace(motion=motion, known=np.ones((1, 400, 3), dtype=bool)), noise)
    assert found.excess > -2 * math.log(1e-6)
    assert (found.begin_s, found.end_s) == pytest.approx((2000, 2110), abs=30)
