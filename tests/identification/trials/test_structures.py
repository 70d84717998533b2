"""Structures turn a card into the card to start from, and questions and answers go through cards unharmed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.cards import ManoeuvringCard, parse_card, read_card
from tank2sim.cards.covariance import Covariance
from tank2sim.dynamics import build
from tank2sim.identification.trials.assessment import model_selection
from tank2sim.identification.trials.assessment.model_selection import Criteria, structure_by_evidence
from tank2sim.identification.trials.options import IdentificationOptions
from tank2sim.identification.trials.problem.estimation_problem import Estimate
from tank2sim.identification.trials.problem.prepare_trials import measured
from tank2sim.identification.trials.problem.problem_from_card import (
    card_with_estimate,
    free_parameters,
    problem_from_card,
    rounded,
    with_correlations,
)
from tank2sim.identification.trials.problem.structures import STRUCTURES, prior_of_absent, structure_that_adds
from tank2sim.notices import foremost
from tank2sim.records.trials import RUDDERS


@pytest.fixture(scope="module")
def kvlcc2() -> ManoeuvringCard:
    card = read_card("kvlcc2-captive")
    assert isinstance(card, ManoeuvringCard)
    return card


@pytest.mark.parametrize("name", STRUCTURES)
def test_every_structure_is_a_card_that_builds_and_leaves_something_free(name: str, kvlcc2: ManoeuvringCard) -> None:
    started = STRUCTURES[name].start(kvlcc2)
    build(started)
    free = free_parameters(started)
    assert free and all(error > 0 for _, error in free.values())
    assert not any(parameter.endswith("dot") for parameter in free), "inertia comes from the card"


def test_cross_flow_drag_takes_the_place_of_cubic_terms_and_keeps_the_linear_ones(kvlcc2: ManoeuvringCard) -> None:
    started = STRUCTURES["cross_flow"].start(kvlcc2)
    for name in ("Yvvv", "Nvvv", "Yddd", "Ydu", "Nduu"):
        assert name in kvlcc2.derivatives and name not in started.derivatives
    for name in ("Yv", "Nr", "Yd", "Nd", "Xdd", "Yvdot"):
        assert started.derivatives[name] == kvlcc2.derivatives[name]
    assert [effect.name for effect in started.effects] == ["cross_flow_drag", "loaded_rudder"]
    assert {"cross_flow_drag.drag_coefficient", "loaded_rudder.lever"} < set(free_parameters(started))


@pytest.mark.parametrize(
    ("effects", "structure"),
    [
        (("loaded_rudder", "cross_flow_drag"), "cross_flow"),
        (("cross_flow_drag",), None),
        (("wind",), None),
        ((), None),
    ],
)
def test_the_structure_with_just_some_effects_is_known(
    effects: tuple[str, ...], structure: str | None, kvlcc2: ManoeuvringCard
) -> None:
    assert structure_that_adds(kvlcc2, effects) == structure
    mmg = read_card("kvlcc2-mmg")
    assert isinstance(mmg, ManoeuvringCard)
    assert structure_that_adds(mmg, effects) is None


def test_the_structure_of_the_card_is_the_card(kvlcc2: ManoeuvringCard) -> None:
    assert STRUCTURES["card"].start(kvlcc2).text == kvlcc2.text


def test_third_order_adds_what_is_absent_with_an_uncertainty_and_changes_no_motion_but_by_xvr(
    kvlcc2: ManoeuvringCard,
) -> None:
    started = STRUCTURES["third_order"].start(kvlcc2)
    assert {"Yvvr", "Nvrr", "Nrrr"} < set(started.uncertainty)
    changed = {name for name, value in started.derivatives.items() if value != kvlcc2.derivatives.get(name, 0.0)}
    assert changed == {"Xvr"}
    assert started.derivatives["Xvr"] == -kvlcc2.derivatives["Yvdot"]


def test_an_absent_term_is_held_to_a_share_of_the_linear_force_in_a_hard_turn(kvlcc2: ManoeuvringCard) -> None:
    value, error = prior_of_absent(kvlcc2, "Nrrr")
    assert value == 0.0
    assert error * 0.7**3 == pytest.approx(0.3 * abs(kvlcc2.derivatives["Nr"]) * 0.7)


def _estimate(free: dict[str, tuple[float, float]], factor: float) -> Estimate:
    values = np.array([value * factor for value, _ in free.values()])
    errors = np.array([error for _, error in free.values()])
    return Estimate("test", tuple(free), values, np.diag(errors**2), np.diag(errors**-2))


@pytest.mark.parametrize("name", ["mariner", "kvlcc2-captive"])
def test_an_answer_goes_into_the_card_in_its_own_signs_and_scaling(name: str) -> None:
    card = read_card(name)
    assert isinstance(card, ManoeuvringCard)
    started = STRUCTURES["cross_flow"].start(card)
    free = free_parameters(started)
    new = card_with_estimate(started, _estimate(free, 1.25))
    again = parse_card(new.text, "again")
    assert isinstance(again, ManoeuvringCard)
    found = free_parameters(again)
    assert set(found) == set(free)
    for parameter, (value, error) in free.items():
        assert found[parameter][0] == pytest.approx(1.25 * value, abs=1e-3 * error)
        assert found[parameter][1] == pytest.approx(error, rel=0.01)


def test_rounding_keeps_a_thousandth_of_the_standard_error() -> None:
    assert rounded(-0.0123456789, 0.00012) == pytest.approx(-0.0123457, abs=1.2e-7)
    assert rounded(1.23456789, 0.0) == 1.23456789


def test_the_force_of_sway_and_yaw_is_that_of_ideal_fluid_in_either_convention() -> None:
    """X = (m + m_y) v r whether the equations add m v r or the card's term holds it."""
    text = (read_card("mariner").text).replace("Xvr = 798e-5", "Xvr = 0.0")
    total = parse_card(text, "total")
    bare = parse_card(text.replace('yaw_rate_terms = "total"', 'yaw_rate_terms = "hydrodynamic"'), "bare")
    assert isinstance(total, ManoeuvringCard) and isinstance(bare, ManoeuvringCard)
    whole = prior_of_absent(total, "Xvr")[0]
    assert whole == pytest.approx(total.rigid_body.mass - total.derivatives["Yvdot"])
    assert whole == pytest.approx(prior_of_absent(bare, "Xvr")[0] + bare.rigid_body.mass)


def test_a_card_with_a_byte_order_mark_is_restructured_like_any_other(kvlcc2: ManoeuvringCard) -> None:
    marked = parse_card("\ufeff" + kvlcc2.text, "marked")
    assert isinstance(marked, ManoeuvringCard)
    plain, found = (STRUCTURES["cross_flow"].start(card) for card in (kvlcc2, marked))
    assert found.derivatives == plain.derivatives and found.effects == plain.effects


@pytest.mark.slow
@pytest.mark.parametrize(
    ("ship", "start", "expected"), [("mariner", "mariner", "card"), ("kvlcc2", "kvlcc2-captive", "cross_flow")]
)
def test_evidence_takes_the_terms_that_made_the_trials(ship: str, start: str, expected: str, tmp_path: Path) -> None:
    """The Mariner is a polynomial of third order; the bundled KVLCC2 has cross-flow drag and a loaded rudder."""
    for angle in (10, 20):
        t2s.load(ship).zigzag(angle, angle).to_csv(tmp_path / f"{angle}.csv")
    card = read_card(start)
    assert isinstance(card, ManoeuvringCard)
    trials = measured(sorted(tmp_path.glob("*.csv")), card)
    structure, notices = structure_by_evidence(card, trials, IdentificationOptions())
    assert structure == expected and bool(notices) == (expected == "cross_flow")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("ship", "start", "expected"), [("mariner", "mariner", "card"), ("kvlcc2", "kvlcc2-captive", "cross_flow")]
)
def test_where_the_criterion_decides_nothing_the_predictions_of_trials_left_out_do(
    ship: str, start: str, expected: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    alike = Criteria(aic=0.0, bic=0.0, samples=100.0, parameters=10.0)
    monkeypatch.setattr(model_selection, "criteria", lambda *_: alike)
    for angle in (10, 20):
        t2s.load(ship).zigzag(angle, angle).df[::10].to_csv(tmp_path / f"{angle}.csv", index=False)
    card = read_card(start)
    assert isinstance(card, ManoeuvringCard)
    trials = measured(sorted(tmp_path.glob("*.csv")), card)
    structure, notices = structure_by_evidence(card, trials, IdentificationOptions())
    assert structure == expected and notices


@pytest.mark.slow
def test_structures_that_noise_hides_are_marked_unless_a_hard_turn_is_held_out(tmp_path: Path) -> None:
    """In a zigzag with much noise the hull might be either, and the two turn differently with hard rudder."""
    card = read_card("mariner")
    assert isinstance(card, ManoeuvringCard)
    ship, trials = t2s.load("mariner"), {}
    for name, run in {"zigzag": ship.zigzag(10, 10), "hard": ship.turn(35), "gentle": ship.turn(20)}.items():
        run.to_csv(tmp_path / f"{name}.csv")
        trials[name] = measured([tmp_path / f"{name}.csv"], card)
    random = np.random.default_rng(4)
    (trial,) = trials["zigzag"].trials
    signals = {
        name: values + (0 if name in RUDDERS else 0.3 * np.std(values) * random.standard_normal(len(values)))
        for name, values in trial.signals.items()
    }
    noisy = replace(trials["zigzag"], trials=(replace(trial, signals=signals),))
    marks = [
        foremost(structure_by_evidence(card, noisy, IdentificationOptions(), held)[1])
        for held in (None, trials["hard"], trials["gentle"])
    ]
    assert marks[0] and marks[0] == marks[2] and not marks[1]


@pytest.mark.parametrize(("sign", "expected"), [("starboard", 0.8), ("port", -0.8)])
def test_correlations_of_a_card_enter_the_prior_in_the_signs_of_the_model(
    sign: str, expected: float, tmp_path: Path
) -> None:
    """A rudder that counts to port in the card turns the sign of Nd, and so of its correlation with Nr."""
    text = read_card("kvlcc2-captive").text.replace('rudder_sign = "starboard"', f'rudder_sign = "{sign}"')
    card = parse_card(text, "signed.toml")
    assert isinstance(card, ManoeuvringCard)
    errors = np.array([card.uncertainty["Nr"], card.uncertainty["Nd"]])
    correlation = np.array([[1.0, 0.8], [0.8, 1.0]])
    covariance = Covariance(("derivatives.Nr", "derivatives.Nd"), correlation * np.outer(errors, errors))
    t2s.load("mariner").zigzag(20, 20).to_csv(tmp_path / "z.csv")
    trials = measured([tmp_path / "z.csv"], card)
    plain = problem_from_card(card, trials.trials, trials.driven_by)
    assert with_correlations(plain, card) is plain
    found = np.linalg.inv(with_correlations(plain, replace(card, covariance=covariance)).known)
    rows = [plain.free.index(f"derivatives.{name}") for name in ("Nr", "Nd", "Yv")]
    assert found[rows[0], rows[1]] == pytest.approx(expected, abs=1e-3)
    assert found[rows[0], rows[2]] == pytest.approx(0.0, abs=1e-9) and found[rows[2], rows[2]] == pytest.approx(1.0)
