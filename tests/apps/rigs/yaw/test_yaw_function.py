"""Records of the yaw rig through the public API: inertias of an independent simulation, cards, refusals."""

from __future__ import annotations

import math

import pytest

import tank2sim as t2s
from tank2sim.apps.rigs.yaw.records import read_yaw_record
from tests.yaw_truth import Truth, record, written

BODY_KGM2, ADDED_KGM2 = 0.0204, 0.03


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rig")
    truth = Truth(total=BODY_KGM2 + ADDED_KGM2, humps=1)
    written(folder / "water.csv", truth, record(truth), length_m=0.67, max_current_A=1.0)
    return folder


@pytest.fixture(scope="module")
def found(folder):
    return t2s.yaw(folder / "water.csv", inertia_kgm2=BODY_KGM2, theory="0.685,0.2,0.1,0.24,0.49")


def test_the_inertia_is_that_of_the_body_simulated_elsewhere(found):
    assert found.added_inertia_kgm2 == pytest.approx(ADDED_KGM2, rel=0.01)
    row = found.estimates.loc["energy_least_squares"]
    assert row["total_inertia_kgm2"] == pytest.approx(BODY_KGM2 + ADDED_KGM2, rel=0.01)
    assert 0 < row["total_inertia_standard_error_kgm2"] < 0.01 * row["total_inertia_kgm2"]
    rows = {row["formula"]: row for row in found.to_dict()["theory"]}
    assert rows["(9)"]["value_kgm2"] == pytest.approx(797.1e-4, rel=1e-3)  # papers.md 3.3
    assert rows["(9)"]["printed_kgm2"] == pytest.approx(797.6e-4)  # Alyshev (2019), Table 1


def test_nrdot_of_the_body_goes_onto_a_ships_card(found):
    value, _ = found.nrdot()
    assert value == pytest.approx(-ADDED_KGM2 / (0.5 * 1000 * 0.67**5), rel=0.01)
    ship = found.with_nrdot("mariner")
    assert ship.derivatives.loc["Nrdot", "value"] == pytest.approx(value, rel=1e-5)
    assert t2s.load("mariner").derivatives.loc["Nrdot", "value"] == pytest.approx(-43.8e-5)


def test_a_record_is_simulated_once(tmp_path):
    path = tmp_path / "rig.csv"
    assert t2s.simulate_yaw("alyshev", path, medium="air", noise_A=0.003) == path
    found = t2s.yaw(path)
    assert found.added_inertia_kgm2 is None
    assert found.estimates.loc[found.method, "total_inertia_kgm2"] == pytest.approx(179.6e-4, rel=0.01)  # the card's
    with pytest.raises(t2s.InputError) as refusal:
        t2s.simulate_yaw("alyshev", path)
    assert refusal.value.source == str(path) and refusal.value.remedy


def test_a_simulated_record_is_identified_at_once(tmp_path):
    path = tmp_path / "rig.csv"
    found = t2s.yaw(path, simulate="alyshev", noise_A=0.003, similar_to="38,8,100,120")
    again = t2s.yaw(path)
    assert found.estimates.loc[found.method].tolist() == pytest.approx(
        again.estimates.loc[found.method].tolist(), rel=1e-3
    )
    assert "rates times 8.968" in found.notices[-1]
    # (L*/L) sqrt(B/B*) = 8.968 of paper 3: rates times, times by; a hump's motion lasts three rises.
    programme = read_yaw_record(path).programme
    assert math.degrees(programme.max_rate_radps) == pytest.approx(100 / 60 * 8.968, rel=1e-4)
    assert 3 * programme.rise_s == pytest.approx(120 / 8.968, rel=1e-4) and programme.humps == 5
    with pytest.raises(t2s.InputError) as refusal:
        t2s.yaw(path, simulate="alyshev")
    assert refusal.value.source == str(path)


@pytest.mark.parametrize(
    ("options", "source"),
    [
        ({"method": "magic"}, "method"),
        ({"terms": ["stiction"]}, "terms"),
        ({"theory": "0.67,0.2"}, "theory"),
        ({"reference_inertia_kgm2": 0.02}, "reference"),
        ({"noise_A": 0.1}, "noise_A"),
    ],
)
def test_bad_input_is_refused_with_place_and_remedy(folder, options, source):
    with pytest.raises(t2s.InputError) as refusal:
        t2s.yaw(folder / "water.csv", **options)
    assert refusal.value.source == source and refusal.value.problem and refusal.value.remedy


def test_a_card_of_another_kind_is_refused_with_its_key(found, folder):
    for call in (lambda: t2s.yaw(folder / "water.csv", rig="mariner"), lambda: found.with_nrdot("wilinski-zellman")):
        with pytest.raises(t2s.InputError) as refusal:
            call()
        assert refusal.value.place == "model.kind" and refusal.value.remedy


def test_a_method_without_an_estimate_is_refused_before_a_card_is_made(folder):
    terms = "coulomb,viscous,quadratic,braking_quadratic"
    found = t2s.yaw(folder / "water.csv", inertia_kgm2=BODY_KGM2, terms=terms, method="output_error")
    assert "output_error" not in found.estimates.index
    with pytest.raises(t2s.InputError) as refusal:
        found.rig_card()
    assert refusal.value.source == "method" and "energy_least_squares" in refusal.value.remedy
