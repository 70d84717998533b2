"""When coefficients are fitted together with a named effect, on replays that are made up."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tank2sim.cards import read_card
from tank2sim.gap.proof import improvement
from tank2sim.gap.proof.improvement import NamedEffects, Proof, Prover, corrected, most_are_closer, sensor_faults
from tank2sim.gap.result import Passed, Refitted

CARD = read_card("mariner")
REFITTED = replace(CARD, derivatives={**CARD.derivatives, "Nv": 1.1 * CARD.derivatives["Nv"]})
NOISE = 0.1


def passed(before: float, after: float, name: str = "a", *, held_out: bool = False) -> Passed:
    """A trial whose yaw rate is missed by so many noises, by the given card and by the improved one."""
    still = {"motion.r": np.zeros(20)}
    first, second = ({"motion.r": np.full(20, misfit * NOISE)} for misfit in (before, after))
    return Passed(name, held_out, np.arange(20.0), {"motion.r": NOISE}, still, first, second)


def prover(
    monkeypatch, plain: dict[str, float], refitted: dict[str, float], held: tuple[float, float] | None
) -> Prover:
    """Replays with these misfits of each fitted trial, with the given coefficients and with others, and of one held
    out."""
    monkeypatch.setattr(improvement, "add_effects_to_card", lambda base, estimated: base)
    monkeypatch.setattr(improvement, "with_polynomial_down_to", lambda card, speed: card)
    moved = (Refitted("Nv", 1.1, 0.1, 0.0, 1.0),)
    monkeypatch.setattr(improvement, "refit_coefficients", lambda card, model, coefficients: (moved, REFITTED))

    def by_cards(card, improved, group, held_out, without_faults) -> list[Passed]:
        assert card is CARD and without_faults is None
        if held_out:
            return [passed(9.0, held[improved is REFITTED], "held", held_out=True)]
        misfits = refitted if improved is REFITTED else plain
        return [passed(9.0, misfit, name) for name, misfit in misfits.items()]

    trials = (SimpleNamespace(trials=tuple(plain)), SimpleNamespace(trials=("held",) if held else ()))
    likelihood = SimpleNamespace(
        by_formula=lambda best: SimpleNamespace(width=1.0),
        none=SimpleNamespace(model=None),
        coefficients_with=lambda found: None,
    )
    return Prover(CARD, trials, likelihood, SimpleNamespace(begin=lambda *_: [], by_cards=by_cards, noise={}))


NAMED = NamedEffects([("rudder_lag", {}, {})])


@pytest.mark.parametrize(
    ("plain", "refitted", "kept"),
    [
        (2.0, 1.89, False),  # closer by more than 5 %: other coefficients
        (2.0, 1.91, True),
        (1.09, 0.5, True),  # near the noise nothing is tried
        (1.11, 0.5, False),
    ],
)
def test_coefficients_are_fitted_too_where_the_trials_are_followed_better_by_a_twentieth(
    monkeypatch, plain: float, refitted: float, kept: bool
) -> None:
    made = prover(monkeypatch, {"a": plain}, {"a": refitted}, (5.0, 4.0))
    closed = made.prove(None, NAMED)
    proof = made.open_holdout(closed)
    assert [result.held_out for result in closed.results] == [False] and "holdout" not in closed.effect_alone
    assert (proof.base is CARD) == kept and bool(proof.coefficients) != kept
    assert proof.misfit == pytest.approx(plain if kept else refitted)
    assert [result.held_out for result in proof.results] == [False, True]
    assert proof.effect_alone == ({} if kept else {"fit": pytest.approx(plain), "holdout": pytest.approx(5.0)})


def test_without_a_trial_held_out_there_is_no_misfit_of_it_and_without_effects_none_of_theirs(monkeypatch) -> None:
    made = prover(monkeypatch, {"a": 2.0}, {"a": 1.0}, None)
    assert made.prove(None, NAMED).effect_alone == {"fit": pytest.approx(2.0)}
    assert made.prove(None, NamedEffects()).effect_alone == {}


def test_coefficients_that_follow_one_trial_and_leave_the_most_are_not_taken(monkeypatch) -> None:
    plain, refitted = {"a": 6.0, "b": 2.0, "c": 2.0}, {"a": 3.0, "b": 2.1, "c": 2.1}
    assert prover(monkeypatch, plain, refitted, None).prove(None, NAMED).base is CARD
    assert prover(monkeypatch, plain, {**refitted, "c": 1.9}, None).prove(None, NAMED).base is REFITTED


@pytest.mark.parametrize(
    ("ratios", "closer"), [((1.2, 0.9, 0.8), True), ((1.2, 1.1, 0.3), False), ((1.2, 0.7), True), ((1.2, 0.9), False)]
)
def test_most_trials_are_closer_by_the_median(ratios: tuple[float, ...], closer: bool) -> None:
    before = [passed(9.0, 2.0, str(number)) for number in range(len(ratios))]
    after = [passed(9.0, 2.0 * ratio, str(number)) for number, ratio in enumerate(ratios)]
    assert most_are_closer(before, after) == closer


def proof(*moved: float) -> Proof:
    coefficients = tuple(Refitted("Nv", size, 0.1, 0.0, 1.0) for size in moved)
    return Proof((), NamedEffects(), CARD, CARD, [passed(1.0, 1.0)], coefficients)


def test_only_faults_of_sensors_are_taken_from_what_was_measured() -> None:
    named = [("rudder_lag", {}, {}), ("gyro_bias", {"rate_radps": 0.01}, {}), ("wind", {}, {})]
    assert [name for name, *_ in sensor_faults(named)] == ["gyro_bias"]
    assert corrected(SimpleNamespace(trials=()), []) is None
