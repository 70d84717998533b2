"""Which explanations a search asks for, on scores typed by hand."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tank2sim.gap.search import explanations
from tank2sim.gap.search.screening import Screened
from tests.gap.made_scores import BAND, BIAS, DRAG, FORCE, LAG, PLAY, fit
from tests.gap.toy import NAMES


class Fitting:
    """Explanations whose scores are typed, found when they are asked for."""

    def __init__(self, scores: dict[tuple[int, ...], float], known: tuple[tuple[int, ...], ...]):
        self.scores, self.likelihood = scores, SimpleNamespace(belief=SimpleNamespace(logs=None, waves=None))
        self.found = {fit(scores[places], *places).hypothesis.effects: fit(scores[places], *places) for places in known}

    def best(self, count: int | None = None):
        fits = [one for one in self.found.values() if count is None or len(one.hypothesis.effects) == count]
        return min(fits, key=lambda one: one.score)

    def has(self, count: int) -> bool:
        return any(len(effects) == count for effects in self.found)

    def fit(self, proposals) -> None:
        for proposal in proposals:
            places = tuple(NAMES.index(name) for name in proposal.effects)
            self.found[proposal.effects] = fit(self.scores[places], *places)


@pytest.mark.parametrize("first", [(0, DRAG), (DRAG,)])
def test_more_is_sought_next_to_a_single_effect_that_takes_the_place_of_the_best(monkeypatch, first) -> None:
    """Else the two others of three effects are never tried where a wrong pair was best first."""
    scores = {(): 0.0, (0, DRAG): -500.0, (DRAG,): -400.0, (0,): -600.0}
    fitting = Fitting(scores, ((), first))
    asked: list[tuple[str, ...]] = []

    class Screen:
        def __init__(self, *given) -> None: ...

        def singles(self):
            return [Screened({NAMES[0]: None}, 600.0)]

        def pairs(self):
            return []

    monkeypatch.setattr(explanations, "Screen", Screen)
    monkeypatch.setattr(
        explanations,
        "_proposals",
        lambda fitting, screened, *_, **__: [SimpleNamespace(effects=tuple(one.thetas)) for one in screened],
    )
    monkeypatch.setattr(explanations, "_fit_more", lambda fitting, best, every: asked.append(best.hypothesis.effects))
    monkeypatch.setattr(explanations, "_on_top_of", lambda *given: [])
    monkeypatch.setattr(explanations, "thetas_of", lambda one: {})
    explanations._explore(fitting, (), 4)
    assert asked[-1] == (NAMES[0],)
    assert ((NAMES[DRAG],) in asked) == (first == (DRAG,))


def test_a_pair_that_becomes_best_by_leaving_one_of_three_out_is_extended_too(monkeypatch) -> None:
    """Else a third effect is never tried next to the right two where a wrong pair was best first."""
    wrong, three, right = (0, DRAG), (0, FORCE, DRAG), (0, FORCE)
    scores = {wrong: -500.0, three: -900.0, right: -950.0, (FORCE, DRAG): 0.0, (0, FORCE, LAG): -1000.0}
    fitting = Fitting(scores, (wrong,))
    asked: list[tuple[str, ...]] = []

    def extend(fitting, best, every) -> None:
        asked.append(best.hypothesis.effects)
        larger = {wrong: three, right: (0, FORCE, LAG)}.get(tuple(NAMES.index(name) for name in asked[-1]))
        fitting.fit([SimpleNamespace(effects=tuple(NAMES[place] for place in larger))] if larger else [])

    def fit_near(fitting, screened, best) -> None:
        sets = [one.effects for one in screened if tuple(map(NAMES.index, one.effects)) in scores]
        fitting.fit([SimpleNamespace(effects=effects) for effects in sets if effects not in fitting.found])

    monkeypatch.setattr(explanations, "_fit_more", extend)
    monkeypatch.setattr(explanations, "_fit_near", fit_near)
    monkeypatch.setattr(explanations, "_with_one_swapped", lambda *given: [])
    monkeypatch.setattr(explanations, "thetas_of", lambda one: dict.fromkeys(one.hypothesis.effects))
    explanations._add_more(fitting, (), 4)
    assert (NAMES[0], NAMES[FORCE]) in asked
    assert fitting.best().hypothesis.effects == tuple(NAMES[place] for place in (0, FORCE, LAG))


def test_in_a_larger_set_each_effect_makes_room_for_the_one_that_the_screen_likes_next_to_the_others(
    monkeypatch,
) -> None:
    fitting = Fitting({}, ())
    fitting.hypotheses = lambda *names, each=(): SimpleNamespace(effects=names)
    seen = []

    def on_top_of(fitting, base, every) -> list[Screened]:
        kept = base.hypothesis.effects
        seen.append((kept, base.theta.tolist()))
        other = next(variant.effect for variant in every if variant.effect not in kept)
        return [Screened(dict.fromkeys((*kept, other)), 9.0), Screened(dict.fromkeys((*kept, NAMES[LAG])), 8.0)]

    monkeypatch.setattr(explanations, "_on_top_of", on_top_of)
    three = replace(fit(-900.0, 0, FORCE, DRAG), theta=np.array([1.0, 2.0, 3.0]))
    every = [SimpleNamespace(effect=NAMES[place]) for place in (0, FORCE, DRAG, BIAS)]
    swapped = explanations._with_one_swapped(fitting, three, every)
    assert {one.effects for one in swapped} == {
        (NAMES[FORCE], NAMES[DRAG], NAMES[BIAS]),
        (NAMES[0], NAMES[DRAG], NAMES[BIAS]),
        (NAMES[0], NAMES[FORCE], NAMES[BIAS]),
    }
    assert [theta for _, theta in seen] == [[2.0, 3.0], [1.0, 3.0], [1.0, 2.0]]


@pytest.mark.parametrize(("best", "other"), [(PLAY, BAND), (BAND, PLAY)])
def test_play_and_dead_band_are_each_tried_in_place_of_the_other(best: int, other: int) -> None:
    scores = {(): 0.0, (best, BIAS): -500.0, (BIAS,): -300.0, (other, BIAS): -498.0}
    fitting = Fitting(scores | {key[::-1]: value for key, value in scores.items()}, ((), (best, BIAS), (BIAS,)))
    card = SimpleNamespace(ship=SimpleNamespace(length_m=100.0), model=SimpleNamespace(speed_mps=5.0))
    size = SimpleNamespace(parameter=SimpleNamespace(typical_values=lambda card: (0.03,)))
    fitting.hypotheses = lambda name: SimpleNamespace(card=card, estimated=(size,))
    sought = [SimpleNamespace(effect=name) for name in NAMES]
    explanations._fit_nearly_alike(fitting, sought)
    assert {frozenset(effects) for effects in fitting.found} >= {frozenset({NAMES[other], NAMES[BIAS]})}
    without = [one for one in sought if one.effect in (NAMES[best], NAMES[BIAS])]
    explanations._fit_nearly_alike(fitting, without)
    assert len(fitting.found) == 4
