"""The yaw rig as a command and a function: inertias of an independent simulation, cards, made records, refusals."""

from __future__ import annotations

import json
import math
import re

import pytest

import tank2sim as t2s
from tank2sim.apps.rigs.yaw.card import YawRigCard
from tank2sim.apps.rigs.yaw.records import read_yaw_record
from tank2sim.bundled import bundled
from tank2sim.cards import ManoeuvringCard, read_card
from tests.cli.command_line import refused, tank2sim
from tests.yaw_truth import Truth, record, written

AIR = Truth(total=0.0204, coulomb=10.9e-4, viscous=7.6e-4, quadratic=0.0, stiffness=8.0, damping=12.0, humps=1)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rig")
    truth = Truth(humps=1)
    written(folder / "water.csv", truth, record(truth), length_m=0.67, max_current_A=1.0)
    written(folder / "air.csv", AIR, record(AIR), medium="air")
    return folder


def test_a_ships_card_gets_nrdot_with_its_uncertainty_and_the_old_value_in_a_comment(folder):
    ended = tank2sim("yaw", "water.csv", "air.csv", "--card", "mariner", "-o", "ship.toml", cwd=folder)
    assert ended.returncode == 0, ended.stderr
    new, old = read_card(folder / "ship.toml"), read_card("mariner")
    assert isinstance(new, ManoeuvringCard) and isinstance(old, ManoeuvringCard)
    assert new.derivatives["Nrdot"] == pytest.approx(-0.03 / (500 * 0.67**5), rel=0.01)
    assert 0 < new.uncertainty["Nrdot"] < 0.05 * abs(new.derivatives["Nrdot"])
    assert {**new.derivatives, "Nrdot": 0} == {**old.derivatives, "Nrdot": 0}
    (line,) = [line for line in new.text.splitlines() if line.startswith("Nrdot") and "was" in line]
    assert "was -43.8e-5" in line


def test_without_a_ship_the_rig_gets_a_card(folder):
    ended = tank2sim("yaw", "water.csv", "--inertia-kgm2", "0.0204", "-o", "rig.toml", cwd=folder)
    assert ended.returncode == 0, ended.stderr
    card = read_card(folder / "rig.toml")
    assert isinstance(card, YawRigCard)
    assert card.yaw_rig.added_inertia_kgm2 == pytest.approx(0.03, rel=0.01)
    assert card.yaw_rig.quadratic_Nms2 == pytest.approx(0.0381, rel=0.05)
    again = tank2sim("yaw", "water.csv", "air.csv", "--rig", "rig.toml", cwd=folder)
    assert again.returncode == 0, again.stderr


def test_k_t_comes_from_a_body_of_known_inertia(folder):
    ended = tank2sim(
        *("yaw", "water.csv", "--inertia-kgm2", "0.0204", "--json", "k.json"),
        *("--reference", "air.csv", "--reference-inertia-kgm2", "0.0408"),
        cwd=folder,
    )
    assert ended.returncode == 0, ended.stderr
    assert json.loads((folder / "k.json").read_text())["torque_constant_NmpA"] == pytest.approx(0.102, rel=0.005)


def test_a_record_can_be_simulated_from_a_card_and_gives_its_inertia(folder):
    ended = tank2sim("yaw", "rig.csv", "--simulate", "alyshev", "--noise", "0.003", "--json", "s.json", cwd=folder)
    assert ended.returncode == 0, ended.stderr
    found = json.loads((folder / "s.json").read_text())
    assert found["body_inertia_standard_error_kgm2"] == pytest.approx(9.2e-4)  # the card's
    assert found["added_inertia_kgm2"]["energy_least_squares"] == pytest.approx(302.0e-4, rel=0.01)
    assert found["added_inertia_kgm2"]["two_intervals_reference"] < 275e-4  # biased, and reported
    assert any("two-interval" in notice["text"] for notice in found["notices"])
    refused(tank2sim("yaw", "rig.csv", "--simulate", "alyshev", cwd=folder), "rig.csv", "exists")
    refused(tank2sim("yaw", "a.csv", "b.csv", "--simulate", "alyshev", cwd=folder), "--simulate", "2 records")
    refused(tank2sim("yaw", "a.csv", "--simulate", "mariner", cwd=folder), "model.kind", "yaw_rig", "alyshev")


def test_a_simulated_record_that_gives_no_result_is_not_left_behind_and_its_card_is_named(folder):
    text = bundled("models", "alyshev", "ship.toml").read_text()
    (folder / "rig.toml").write_text(re.sub(r"(?m)^settle_s *=.*$", "settle_s = 0.0", text))
    refused(tank2sim("yaw", "made.csv", "--simulate", "rig.toml", cwd=folder), "rig.toml", "not mirror images")
    assert not (folder / "made.csv").exists()


def test_bad_input_is_one_line(folder):
    simulated = ("--simulate", "alyshev")
    # The one run by the adaptive controller saturates the motor.
    refused(tank2sim("yaw", "six.csv", *simulated, "--controller", "adaptive", cwd=folder), "saturates")
    refused(tank2sim("yaw", "dry.csv", "--medium", "air", cwd=folder), "--medium", "simulate")
    for text in ("38,8,100", "38,8,nan,120", "38,8,100,5"):
        refused(tank2sim("yaw", "none.csv", *simulated, "--similar-to", text, cwd=folder), "--similar-to")
    refused(tank2sim("yaw", "similar.csv", "--similar-to", "38,8,100,120", cwd=folder), "--similar-to", "simulate")
    for text in ("0.67,0.2", "0.67,0.2,0.08,x", "0.67,0.2,0.08,0.22,47", "1e9,0.2,0.08,0.22", "mariner"):
        refused(tank2sim("yaw", "water.csv", "--theory", text, cwd=folder), "--theory")
    refused(tank2sim("yaw", "none.csv", cwd=folder), "none.csv", "does not exist")
    refused(tank2sim("yaw", "water.csv", "--card", "mariner", cwd=folder), "--card", "-o")
    refused(tank2sim("yaw", "water.csv", "--mirror-percent", "0.1", cwd=folder), "not mirror images", "%")
    refused(tank2sim("yaw", "water.csv", "-o", "x.toml", "--card", "mariner", cwd=folder), "--inertia")
    refused(tank2sim("yaw", "air.csv", "-o", "x.toml", "--card", "mariner", cwd=folder), "records in water")
    refused(tank2sim("yaw", "water.csv", "--reference", "air.csv", cwd=folder), "--reference-inertia")
    refused(tank2sim("yaw", "water.csv", "--rig", "mariner", cwd=folder), "model.kind")
    asked = ("--inertia-kgm2", "0.0204", "-o", "x.toml", "--card", "wilinski-zellman")
    refused(tank2sim("yaw", "water.csv", *asked, cwd=folder), "model.kind")
    refused(tank2sim("yaw", "water.csv", "--inertia-kgm2", "0.9", "-o", "x.toml", "--card", "mariner", cwd=folder),
            "negative")  # fmt: skip
    assert not (folder / "x.toml").exists()


BODY_KGM2, ADDED_KGM2 = 0.0204, 0.03


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
