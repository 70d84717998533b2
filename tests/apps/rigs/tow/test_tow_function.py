"""Tows through the API and the command line: mass and drag of a body of known equation of motion, and its card."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.cards import read_card
from tests.cli.command_line import refused, tank2sim

FORCE_N, MASS_KG, TOTAL_KG, B3 = 12.0, 2000.0, 2500.0, 90.0


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    """Three tows of a body with M dv/dt + B3 v^2 = T, v = sqrt(T/B3) tanh(sqrt(T B3) t/M), to 0.1 mm/s at random."""
    random = np.random.default_rng(5)
    time = np.linspace(0, 90, 10)
    speed = np.sqrt(FORCE_N / B3) * np.tanh(np.sqrt(FORCE_N * B3) * time / TOTAL_KG)
    columns = [time, *(speed + 1e-4 * random.standard_normal(10) * (time > 0) for _ in range(3))]
    file = tmp_path_factory.mktemp("tow") / "body.csv"
    comment = f"# force_N: {FORCE_N}\n# mass_kg: {MASS_KG}\n# length_m: 4.0\n"
    rows = [",".join(f"{value:.8g}" for value in row) for row in zip(*columns, strict=True)]
    file.write_text(comment + "\n".join(["t_s,speed_1_mps,speed_2_mps,speed_3_mps", *rows]) + "\n")
    return file


@pytest.fixture(scope="module")
def found(path):
    return t2s.tow(path, terms="B3")


def test_mass_and_drag_are_those_of_the_analytic_motion(found):
    assert found.method == "output_error"
    assert found.total_mass_kg == pytest.approx(TOTAL_KG, rel=0.01)
    assert found.added_mass_kg == pytest.approx(TOTAL_KG - MASS_KG, rel=0.05)
    rows = found.estimates.set_index(["method", "name"])
    drag = rows.loc[("output_error", "B3_kgpm")]
    assert abs(drag["value"] - B3) < 3 * drag["standard_error"] < 0.05 * B3
    low, high = found.mass_range_kg
    assert low < TOTAL_KG < high


def test_with_a_given_mass_the_headline_is_about_it_and_a_far_one_is_doubted(path):
    held = t2s.tow(path, terms="B3", total_mass_kg=TOTAL_KG)
    assert held.headline[0].startswith(f"M is held at {TOTAL_KG:g} kg, as given") and "B3 = " in held.headline[0]
    assert held.headline[1].startswith("By themselves the tows determine")
    assert held.key_figures[0].value == TOTAL_KG and held.key_figures[0].note == "held, as given"
    assert not held.cautions
    doubted = t2s.tow(path, terms="B3", total_mass_kg=1.4 * TOTAL_KG)
    assert any("The mass given" in caution and "by themselves" in caution for caution in doubted.cautions)


def test_the_card_has_the_numbers_and_simulates(found, tmp_path):
    found.card.save(tmp_path / "body.toml")
    card = t2s.load(tmp_path / "body.toml").card
    assert card.ship.name == "body" and card.ship.length_m == 4.0
    assert card.surge.total_mass_kg == pytest.approx(found.total_mass_kg, rel=1e-4)
    assert found.ship.model.state_names


@pytest.mark.slow
def test_a_force_is_a_number_or_a_polynomial(path):
    constant = t2s.tow(path, force_N=2 * FORCE_N, terms=["B3"])
    assert constant.total_mass_kg == pytest.approx(2 * TOTAL_KG, rel=0.01)  # (1.5) is linear in T, M and B
    rising = t2s.tow(path, force_N=[FORCE_N, 0.0], terms=["B3"], total_mass_kg=TOTAL_KG)
    assert rising.total_mass_kg == TOTAL_KG


@pytest.mark.parametrize(
    ("options", "source"),
    [
        ({"method": "magic"}, "method"),
        ({"terms": ["B4"]}, "terms"),
        ({"terms": "B3,B3"}, "terms"),
        ({"length_m": -3.0}, "length_m"),
        ({"mass_kg": float("nan")}, "mass_kg"),
        ({"force_N": [1.0, -1.0]}, "force_N"),
    ],
)
def test_bad_input_is_refused_with_place_and_remedy(path, options, source):
    with pytest.raises(t2s.InputError) as refusal:
        t2s.tow(path, **options)
    assert refusal.value.source == source and refusal.value.problem and refusal.value.remedy


TOWS = str(Path(__file__).parents[4] / "models/wilinski-zellman/tows.csv")


def test_a_force_that_varies_and_a_known_mass(tmp_path) -> None:
    arguments = ("--force-N", "11.63,0.001", "--total-mass-kg", "2800", "--terms", "B3")
    arguments += ("--json", "t.json", "-o", "body.toml")
    result = tank2sim("tow", TOWS, *arguments, cwd=tmp_path)
    assert result.returncode == 0 and "T = 11.63 + 0.001 t N" in result.stdout, result.stderr
    found = json.loads((tmp_path / "t.json").read_text())
    assert found["methods"]["qr"]["estimates"]["total_mass_kg"] == 2800
    assert found["force_N"] == pytest.approx(11.655)
    assert read_card(tmp_path / "body.toml").surge.total_mass_kg == 2800


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--force-N", "11.63,fast"], ["--force", "fast"]),
        (["--force-N", "1,-1"], ["--force", "50 s"]),
        (["--total-mass-kg", "0"], ["--total-mass-kg"]),
        (["--length-m", "-3"], ["--length-m"]),
    ],
)
def test_bad_input_ends_in_one_line_and_exit_2(tmp_path, arguments, words) -> None:
    refused(tank2sim("tow", TOWS, *arguments, cwd=tmp_path), *words)
    assert not list(tmp_path.iterdir())


def test_a_card_without_the_drag_that_it_needs_is_refused_by_its_argument() -> None:
    found = t2s.tow(TOWS, terms="none")
    with pytest.raises(t2s.InputError) as refusal:
        _ = found.card
    assert str(refusal.value.source) == "terms" and "B3" in refusal.value.remedy
