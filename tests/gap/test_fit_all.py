"""Fitting many explanations: each once, whatever the order of its effects and whoever does the work."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest

from tank2sim.cards import ManoeuvringCard, parse_card
from tank2sim.gap.inference.fit import ExplanationFit
from tank2sim.gap.inference.fit_all import Fitting, HypothesisCache, Proposal, thetas_of
from tank2sim.gap.inference.hypothesis import Hypothesis
from tank2sim.gap.inference.likelihood import Likelihood
from tank2sim.gap.inference.prior import likelihood_from_card
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tests.identification.trials import made_up_ship

THETAS = {"gyro_bias": np.array([0.001]), "current": np.array([0.2, 1.0]), "linear_yaw_damping": np.array([0.1])}


@pytest.fixture(scope="module")
def card() -> ManoeuvringCard:
    read = parse_card(made_up_ship.CARD, "made_up.toml")
    assert isinstance(read, ManoeuvringCard)
    return read


@pytest.fixture(scope="module")
def likelihood(card) -> Likelihood:
    trial = made_up_ship.trial(made_up_ship.zigzag(20), name="zigzag", duration=120, step=0.5)
    trial.signals["r_radps"][:] += 5e-4
    return likelihood_from_card(card, Measured((trial,), "angle", ()))


def proposals(likelihood: Likelihood, *sets: tuple[str, ...], rounds=(0, 3)) -> list[Proposal]:
    starts = [likelihood.belief.logs, likelihood.belief.logs + 0.2]
    return [Proposal({name: THETAS[name] for name in effects}, starts, rounds) for effects in sets]


EVERY = ((), ("gyro_bias",), ("current",), ("linear_yaw_damping",), ("current", "gyro_bias"))


def fitted(
    likelihood: Likelihood, executor: Executor | None, *sets: tuple[str, ...]
) -> dict[tuple[str, ...], ExplanationFit]:
    fitting = Fitting(likelihood, HypothesisCache(likelihood.none), lambda text: None, executor)
    fitting.fit(proposals(likelihood, *sets))
    return fitting.found


@pytest.fixture(scope="module")
def alone(likelihood) -> dict[tuple[str, ...], ExplanationFit]:
    return fitted(likelihood, None, *EVERY)


def assert_same(found: dict[tuple[str, ...], ExplanationFit], expected: dict[tuple[str, ...], ExplanationFit]) -> None:
    """To the bit."""
    assert list(found) == list(expected)
    for effects, fit in found.items():
        assert fit.hypothesis.effects == effects and fit.score == expected[effects].score
        for name in ("theta", "covariance", "logs", "change"):
            np.testing.assert_array_equal(getattr(fit, name), getattr(expected[effects], name))


def executors() -> dict[str, Executor]:
    return {"threads": ThreadPoolExecutor(3), "processes": ProcessPoolExecutor(1, get_context("spawn"))}


@pytest.fixture(params=["threads", pytest.param("processes", marks=pytest.mark.slow)])
def executor(request) -> Iterator[Executor]:
    with executors()[request.param] as pool:
        yield pool


@pytest.mark.slow
def test_the_result_does_not_depend_on_who_does_the_work(likelihood, alone, executor) -> None:
    assert_same(fitted(likelihood, executor, *EVERY), alone)
    # a second search of the same ship finds the first one's explanations there
    assert_same(fitted(likelihood, executor, *EVERY[:2]), {name: alone[name] for name in EVERY[:2]})


@pytest.mark.slow
def test_another_ship_in_the_same_worker_is_another_ship(card, likelihood, alone) -> None:
    """By the order in place of the angle: the same card, and a gear between."""
    trial = made_up_ship.trial(made_up_ship.zigzag(20), name="zigzag", duration=60, step=0.5)
    trial.signals["delta_order_rad"] = trial.signals.pop("delta_rad")
    ordered = likelihood_from_card(card, Measured((trial,), "order", ()))
    expected = fitted(ordered, None, ("gyro_bias",))
    with ThreadPoolExecutor(1) as pool:
        assert_same(fitted(likelihood, pool, ("gyro_bias",)), {("gyro_bias",): alone["gyro_bias",]})
        assert_same(fitted(ordered, pool, ("gyro_bias",)), expected)
        assert_same(fitted(likelihood, pool, ("gyro_bias",)), {("gyro_bias",): alone["gyro_bias",]})


def test_the_order_of_effects_does_not_matter(likelihood, alone) -> None:
    (pair,) = fitted(likelihood, None, ("gyro_bias", "current")).items()
    assert_same(dict([pair]), {pair[0]: alone[pair[0]]})
    assert set(pair[0]) == {"current", "gyro_bias"} and pair[0] in alone
    for name, theta in thetas_of(pair[1]).items():
        assert len(theta) == len(THETAS[name])
    assert thetas_of(pair[1])["gyro_bias"] == pytest.approx([5e-4], abs=2e-4)


def test_the_better_of_two_fits_is_kept(likelihood, alone) -> None:
    fitting = Fitting(likelihood, HypothesisCache(likelihood.none), lambda text: None, None)
    worse = alone["current",].score + 3.0
    scores = iter([worse, alone["current",].score, worse])
    hypothesis = fitting.hypotheses("current")
    for _ in range(3):
        made = ExplanationFit(hypothesis, np.zeros(2), np.eye(2), likelihood.belief.logs, next(scores), np.zeros(0))
        fitting._keep(Proposal({"current": np.zeros(2)}, [], ()), made)
    assert fitting.found["current",].score == alone["current",].score
    assert fitting.has(1) and not fitting.has(0) and not fitting.has(2)
    assert fitting.best() is fitting.best(1) is fitting.found["current",]
    with pytest.raises(ValueError):
        fitting.best(2)


def test_what_is_being_fitted_is_told_in_order(likelihood, executor) -> None:
    messages: list[str] = []
    fitting = Fitting(likelihood, HypothesisCache(likelihood.none), messages.append, executor)
    fitting.fit(proposals(likelihood, (), ("gyro_bias",), rounds=(0,)))
    assert messages == ["the card as it is", "gyro_bias"]


def test_explanations_are_made_once(card) -> None:
    known = HypothesisCache(Hypothesis(card, "angle"))
    assert known("current") is known("current") and known() is known.none
    assert known("current").effects == ("current",) and known("current").driven_by == "angle"


def test_a_hopeless_score_is_not_polished(likelihood, alone) -> None:
    starts = [likelihood.belief.logs]
    limit = alone[()].score - 1e6
    fitting = Fitting(likelihood, HypothesisCache(likelihood.none), lambda text: None, None)
    fitting.fit([Proposal({}, starts, (0, 9), limit)])
    np.testing.assert_array_equal(fitting.found[()].logs, starts[0])
    assert fitting.found[()].score >= alone[()].score
