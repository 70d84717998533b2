"""A ship validated by trials through the public API: a ship against its own trials, and against another's."""

from __future__ import annotations

import pytest

import tank2sim as t2s


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
