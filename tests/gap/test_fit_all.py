"""Many explanations, each fitted once in any order of its effects; coefficients in the conventions of the card."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest

from tank2sim.api.gap_search import identified_from
from tank2sim.cards import ManoeuvringCard, parse_card, read_card
from tank2sim.cards.covariance_reading import read_covariance
from tank2sim.cards.reading import changed_text
from tank2sim.dynamics import build
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.gap.improve_card import add_effects_to_card, card_with_effects_text
from tank2sim.gap.inference.fit import CoefficientEstimates, ExplanationFit
from tank2sim.gap.inference.fit_all import Fitting, HypothesisCache, Proposal, thetas_of
from tank2sim.gap.inference.hypothesis import Hypothesis
from tank2sim.gap.inference.likelihood import Likelihood
from tank2sim.gap.inference.prior import likelihood_from_card
from tank2sim.gap.proof.refit import effects_like, refit_coefficients
from tank2sim.gap.result import Refitted
from tank2sim.identification.trials.problem.prepare_trials import Measured, with_fitted_trials
from tank2sim.results.gap import improved_files
from tests.identification.trials import made_up_ship
from tests.records.motions import motion, trial

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


ESTIMATES = CoefficientEstimates(
    ("derivatives.Yv", "derivatives.Yd", "steering.max_rate", "derivatives.Nr"),
    np.array([-1e-4, 2e-5, 0.01, 5e-5]),
    np.array(
        [
            [4e-8, 1e-8, 0.0, 0.0],
            [1e-8, 9e-8, 0.0, -3e-9],
            [0.0, 0.0, 1e-6, 0.0],
            [0.0, -3e-9, 0.0, 1e-8],
        ]
    ),
)
"""Rudder positive to starboard."""


def moved(changes: dict[str, float]) -> list[Refitted]:
    """Coefficients of the Mariner, each changed by a share of its value, where a card states 2 %; others by nothing."""
    card = read_card("mariner").manoeuvring()
    return [
        Refitted(name, value * (1 + changes.get(name, 0.0)), 0.1 * abs(value), value, 0.02 * abs(value))
        for name, value in card.derivatives.items()
        if value
    ]


@pytest.mark.parametrize(
    ("changes", "effects"),
    [
        ({"Nr": 0.1}, {"linear_yaw_damping"}),
        ({"Nr": 0.1, "Yr": -0.05, "Yv": 0.02, "Nvrr": -0.02}, {"linear_yaw_damping"}),
        ({"Nr": 0.05}, set()),  # less than three standard errors
        ({"Nr": 0.1, "Yr": 0.1}, set()),  # more damping of yaw is a smaller Yr: the mass is not part of it
        ({"Xvr": 0.3}, {"turning_drag"}),
        ({"Nr": 0.1, "Yv": 0.3, "Xu": 0.3}, set()),  # a small part of all that moved
        (dict.fromkeys(("Yd", "Nd", "Yddd", "Nddd", "Yvvd", "Nvvd", "Yvdd", "Nvdd"), 0.15), {"rudder_effectiveness"}),
        (dict.fromkeys(("Yvdot", "Nrdot", "Yv", "Nv", "Nr", "Yvvv", "Nvvv", "Nvvr"), 0.12), {"shallow_water"}),
        ({"Yd": 0.15, "Nd": -0.15}, set()),  # no rudder is larger in Y and smaller in N
    ],
)
def test_an_effect_that_changes_the_coefficients_as_they_moved_is_said_next_to_them(changes, effects) -> None:
    card = read_card("mariner").manoeuvring()
    found = effects_like(card, moved(changes))
    assert found.keys() == effects
    for name, coefficient in found.items():
        assert coefficient.name in (EFFECTS[name].changes or changes) and coefficient.name in changes
    assert effects_like(card, moved(changes), effects) == {}


def test_added_masses_that_no_ship_has_remain_those_of_the_card(mariner_card: ManoeuvringCard) -> None:
    """By regression of the others on them; J_z - Nrdot of the Mariner is 0.00083."""
    names = ("derivatives.Nrdot", "derivatives.Nr", "derivatives.Yv")
    covariance = np.array([[4e-8, 2e-8, 0.0], [2e-8, 9e-8, 1e-8], [0.0, 1e-8, 1e-6]])
    possible = CoefficientEstimates(names, np.array([4e-4, 3e-4, 1e-4]), covariance)
    refitted, _ = refit_coefficients(mariner_card, build(mariner_card), possible)
    assert [entry.name for entry in refitted] == ["Nrdot", "Nr", "Yv"]
    impossible = replace(possible, change=np.array([2e-3, 3e-4, 1e-4]))
    refitted, base = refit_coefficients(mariner_card, build(mariner_card), impossible)
    assert base.derivatives["Nrdot"] == pytest.approx(mariner_card.derivatives["Nrdot"])
    assert {entry.name: entry.value - entry.before for entry in refitted} == pytest.approx(
        {"Nr": 3e-4 - 2e-3 * 2e-8 / 4e-8, "Yv": 1e-4}
    )
    assert refitted[0].standard_error == pytest.approx(np.sqrt(9e-8 - (2e-8) ** 2 / 4e-8))


def test_the_covariance_of_refitted_coefficients_is_written_with_the_sign_of_the_file(
    tmp_path: Path, mariner_card: ManoeuvringCard
) -> None:
    port = changed_text(mariner_card.text, "ship.toml", {"model.rudder_sign": "port"})
    path = tmp_path / "ship.toml"
    path.write_text(port)
    card = read_card(path)
    assert isinstance(card, ManoeuvringCard)
    refitted, base = refit_coefficients(card, build(card), ESTIMATES)
    assert [entry.name for entry in refitted] == ["Yv", "Yd", "Nr"]  # the gear is not written
    assert abs(refitted[1].value - card.derivatives["Yd"] - 2e-5) < 1e-6
    effect = [("rudder_bias", {"angle_rad": 0.02}, {"angle_rad": 0.001})]
    text = card_with_effects_text(add_effects_to_card(base, effect), effect, ["turn"], refitted=len(refitted))
    assert text.splitlines()[0].startswith("# rudder_bias added, 3 coefficients refitted")
    files, notices = improved_files(base, text, tmp_path / "improved.toml")
    assert not notices
    for file, content in files.items():
        file.write_text(str(content))
    improved = read_card(tmp_path / "improved.toml")
    found = read_covariance(improved)
    assert found is not None and found.names == ("derivatives.Yv", "derivatives.Yd", "derivatives.Nr")
    signs = np.array([1.0, -1.0, 1.0])
    rows = [0, 1, 3]
    np.testing.assert_allclose(found.matrix, ESTIMATES.covariance[np.ix_(rows, rows)] * np.outer(signs, signs))
    assert isinstance(improved, ManoeuvringCard)
    np.testing.assert_allclose(improved.standard_error("Yd"), 3e-4, rtol=2e-3)


def test_a_card_with_refitted_coefficients_alone_says_so(mariner_card: ManoeuvringCard) -> None:
    _, base = refit_coefficients(mariner_card, build(mariner_card), ESTIMATES)
    text = card_with_effects_text(base, [], ["turn20", "zigzag"], refitted=3)
    assert text.splitlines()[0] == "# 3 coefficients refitted by tank2sim gap from turn20, zigzag"
    assert card_with_effects_text(mariner_card, [], ["turn20"]) == mariner_card.text


def test_a_card_identified_from_the_same_trials_is_noticed(mariner_card: ManoeuvringCard) -> None:
    turn, zigzag = (trial(motion(kind)) for kind in ("turn", "zigzag"))
    seen = parse_card(with_fitted_trials(mariner_card.text, "ship.toml", [turn]), "ship.toml")
    assert isinstance(seen, ManoeuvringCard)
    both = Measured((replace(turn, path=Path("renamed.csv")), zigzag), "order", ())
    (notice,) = identified_from(seen, both)
    assert "renamed" in notice and zigzag.name not in notice
    assert identified_from(mariner_card, both) == []
