"""Ships and craft validated by trials through the public API."""

from __future__ import annotations

import craft_log
import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.errors import InputError
from tests.craft_trials import written


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("trials")
    t2s.load("mariner").zigzag(20, 20).to_csv(folder / "zigzag.csv")
    return folder


@pytest.fixture(scope="module")
def found(folder):
    return t2s.validate("mariner", folder, members=5)


def test_a_ship_agrees_with_its_trial(found, folder):
    rows = found.figures.set_index("figure")
    truth = t2s.load("mariner").zigzag(20, 20).figures
    for name in ("overshoot_1_deg", "overshoot_2_deg"):
        assert rows.loc[name, "measured"] == pytest.approx(truth[name], rel=0.01)
        assert rows.loc[name, "error"] == pytest.approx(rows.loc[name, "simulated"] - rows.loc[name, "measured"])
        assert rows.loc[name, "outcome"] == "validated"
    assert found.verdict.startswith("4 of 4 figures validated")
    assert found.ship.name == t2s.load("mariner").name
    numerical = found.verification.set_index(["trial", "figure"])["numerical"]
    assert 0 < numerical[("zigzag 20/20", "overshoot_1_deg")] < 0.01


@pytest.mark.slow
def test_another_ship_is_refuted(folder):
    ship = t2s.load("mariner", {"derivatives.Nd": -1.5 * 139e-5})
    other = t2s.validate(ship, [folder / "zigzag.csv"], members=2)
    assert "not validated" in set(other.figures["outcome"])


def test_bad_input_is_refused_with_place_and_remedy(tmp_path):
    with pytest.raises(t2s.InputError) as refusal:
        t2s.validate("wilinski-zellman")
    assert refusal.value.place == "model.kind" and refusal.value.remedy
    with pytest.raises(t2s.InputError) as refusal:
        t2s.validate("mariner", tmp_path)  # an empty folder
    assert refusal.value.source == str(tmp_path) and refusal.value.remedy


@pytest.mark.slow
def test_a_record_counts_as_its_file(folder):
    by_file = t2s.validate("mariner", folder / "zigzag.csv", members=0)
    by_record = t2s.validate("mariner", t2s.read_trial(folder / "zigzag.csv"), members=0)
    assert by_record.figures.equals(by_file.figures) and len(by_file.figures) == 4


class _Exact:
    """In place of a random number generator: the card is not off."""

    def normal(self) -> float:
        return 0.0


@pytest.fixture(scope="module")
def truth() -> dict[str, float]:
    return craft_log.random_craft(np.random.default_rng(7))


@pytest.fixture(scope="module")
def ship(truth) -> t2s.Ship:
    loss = {f"thrusters.{number}.speed_loss_kg": truth["loss"] for number in (0, 1)}
    terms = {f"derivatives.{name}": truth[name] for name in ("Yrdot", "Yr", "Nv", "Nrabsu")}
    terms["derivatives.Nvdot"] = truth["Yrdot"]
    return craft_log.first_card(truth, _Exact()).replace({**terms, **loss})


@pytest.mark.slow
def test_the_true_card_predicts_and_one_of_half_the_thrust_does_not(truth, ship, tmp_path) -> None:
    paths = written(tmp_path, truth, ["zigzag"])
    right = t2s.validate(ship, paths, members=0).study.predictions
    assert min(right.determination.values()) > 0.97
    # 1 cm and 0.1 deg of noise, in the state from which the prediction begins, too
    assert right.end_distance_m < 1.0 and right.end_heading_deg < 3.0
    half = {f"thrusters.{number}.ahead_Ns2": 0.5 * truth["ahead"] for number in (0, 1)}
    wrong = t2s.validate(ship.replace(half), paths, members=0).study.predictions
    assert wrong.end_distance_m > 3 * right.end_distance_m
    assert wrong.determination["u"] < right.determination["u"] - 0.1


@pytest.mark.slow
def test_a_trial_that_is_too_short_is_said(truth, ship, tmp_path) -> None:
    with pytest.raises(InputError, match="longer than 20 s"):
        t2s.validate(ship, written(tmp_path, truth, ["straight"]))


def test_without_trials_the_model_is_documented_and_verified(ship) -> None:
    result = t2s.validate(ship, members=0)
    assert result.study.predictions is None and "not validated" in result.headline[0]
    assert "Fossen" in result.study.documentation["Mathematical model"]
    figures = {row.name: row for row in result.study.verification}
    assert 0 < figures["final_speed_mps"].U_num < 1e-3 * figures["final_speed_mps"].value
    coefficients = next(table.df for table in result.tables if table.caption == "SI").set_index("coefficient")
    assert coefficients.loc["Xu", "value"] == pytest.approx(ship.card.derivatives["Xu"], rel=1e-3)
