"""Members of the standard trials are the whole joint draw of a card: derivatives and effects together."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tank2sim.analysis.ensemble.draws import draws_of
from tank2sim.analysis.influence.card_influence import figure_errors, influence, origin_of_errors
from tank2sim.analysis.influence.figures import parse_figure
from tank2sim.analysis.influence.study import Study
from tank2sim.analysis.validation.standard_trials import SEED, members
from tank2sim.analysis.validation.study import validate_card
from tank2sim.cards import ManoeuvringCard, parse_card
from tank2sim.cards.covariance import Covariance, covariance_file, referring
from tank2sim.dynamics import build
from tank2sim.dynamics.card_parameters import card_parameters, joint_errors, study_model
from tank2sim.simulation.ensemble import ensemble

CROSS_FLOW = """
[uncertainty]
Yv = 5e-4
Nv = 1.6e-4
[[effects]]
name = "current"
[effects.parameters]
speed_mps = 0.5
direction_deg = 90.0
[effects.uncertainty]
speed_mps = 0.1
[[effects]]
name = "propeller_side_force"
[effects.parameters]
Y_prime = 4e-5
N_prime = -2e-5
[effects.uncertainty]
Y_prime = 1e-5
N_prime = 1e-5
"""
NAMES = ("derivatives.Yv", "derivatives.Nv", "effects.1.parameters.Y_prime")
FALLS = np.array([5e-4, 1.6e-4, 1e-5])
MATRIX = np.outer(FALLS, FALLS)  # one error moves all three


@pytest.fixture(scope="module")
def joint(tmp_path_factory: pytest.TempPathFactory, mariner_card: ManoeuvringCard) -> ManoeuvringCard:
    path: Path = tmp_path_factory.mktemp("joint") / "ship.toml"
    text = referring(mariner_card.text + CROSS_FLOW, path)
    covariance_file(path).write_text(Covariance(NAMES, MATRIX).as_text())
    card = parse_card(text, str(path)).manoeuvring()
    return card


def test_members_have_all_numbers_of_the_joint_draw_and_none_that_is_an_input(joint: ManoeuvringCard) -> None:
    model = build(joint)
    drawn, reported = members(joint, model, 4)
    draws, _ = draws_of(joint, SEED)
    for number, member in enumerate(drawn):
        whole = draws.member(number)
        assert member == {name: value for name, value in whole.items() if name in model.parameter_names}
        moved = [member["derivatives.Yv"] + 1160e-5, member["derivatives.Nv"] + 264e-5]
        moved.append(member["propeller_side_force.Y"] - 4e-5)
        np.testing.assert_allclose(moved / FALLS, moved[0] / FALLS[0], rtol=1e-6)
        assert "current.speed" not in member
    assert reported == ("errors of 3 numbers go together, as the covariance next to the card says",)


def test_only_numbers_without_a_standard_error_are_reported_to_have_none(joint: ManoeuvringCard) -> None:
    reported = " ".join(draws_of(joint, 0)[1])
    assumed = reported.partition("no standard error of ")[2].partition(":")[0].split(", ")
    assert "any number" not in reported and {"Xudot", "Yvdot", "Nd", "current.direction"} < set(assumed)
    assert not {"Yv", "Nv", "current.speed", "propeller_side_force.Y"} & set(assumed)


def test_a_card_of_which_all_errors_go_together_is_not_reported_to_have_none(tmp_path, mariner_card) -> None:
    path, names = tmp_path / "ship.toml", ("derivatives.Yv", "derivatives.Nv")
    text = referring(f"{mariner_card.text}\n[uncertainty]\nYv = 5e-4\nNv = 1.6e-4\n", path)
    covariance_file(path).write_text(Covariance(names, MATRIX[:2, :2]).as_text())
    card = parse_card(text, str(path)).manoeuvring()
    reported = " ".join(draws_of(card, 0)[1])
    assert "no standard error of any number" not in reported and "no standard error of Xu" in reported


def test_the_standard_error_of_a_figure_is_of_the_whole_covariance(joint: ManoeuvringCard) -> None:
    errors = joint_errors(joint, card_parameters(joint, study_model(joint)))
    places = [[one.key for one in errors.parameters].index(name) for name in NAMES]
    own = np.array([one.standard_error for one in errors.parameters])
    slopes = np.random.default_rng(1).standard_normal((2, len(own))) / np.maximum(own, 1e-9)
    slopes[:, own == 0] = 0.0
    deviations, shares = figure_errors(slopes, errors.covariance)
    covariance = np.diag(own**2)
    covariance[np.ix_(places, places)] = MATRIX
    truth = np.array([row @ covariance @ row for row in slopes])
    np.testing.assert_allclose(deviations, np.sqrt(truth), rtol=1e-12)
    # The share is what goes of the variance when a number is known: with one of the three, all of the three.
    one, other, third = shares[:, places].T
    np.testing.assert_allclose(one, (slopes[:, places] @ FALLS) ** 2 / truth, rtol=1e-9)
    np.testing.assert_allclose([other, third], [one, one], rtol=1e-9)
    assert "covariance next to the card (3 numbers, others as if independent)" in origin_of_errors(errors)


@pytest.mark.slow
def test_influence_and_ensemble_of_a_card_with_a_covariance_say_the_same(joint: ManoeuvringCard) -> None:
    from tank2sim.analysis.ensemble.questions import OfFigures, ShipText

    study = Study(joint, [parse_figure("criterion_C")])
    result = influence(study)
    draws, _ = draws_of(joint, 2)
    spread = ensemble(OfFigures(ShipText.of(joint), ("criterion_C",)), draws, 150).figures["criterion_C"].std(ddof=1)
    assert result.figures["criterion_C"].standard_error == pytest.approx(spread, rel=0.2)
    parts = study.slopes_at(study.values)[1][0] * [one.standard_error for one in study.parameters]
    assert not 0.7 < np.linalg.norm(parts) / spread < 1.4  # as if independent it would be another


def test_numbers_in_the_covariance_are_not_said_to_have_no_standard_error(joint: ManoeuvringCard) -> None:
    notices = validate_card(joint, [], 2).notices
    (assumed,) = [notice for notice in notices if notice.startswith("the card states no standard error of")]
    named = assumed.partition("no standard error of ")[2].partition(":")[0].split(", ")
    assert "Xudot" in named and "Yv" not in named
    assert len([notice for notice in notices if "go together" in notice]) == 1
