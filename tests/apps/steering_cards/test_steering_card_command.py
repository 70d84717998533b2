"""``tank2sim influence`` on a steering card, and ``--through`` on a ship card."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tank2sim.cards import ManoeuvringCard, read_card
from tests.cli.command_line import refused, tank2sim


@pytest.mark.slow
def test_a_steering_card_gives_the_tables_of_paper_4(tmp_path: Path) -> None:
    result = tank2sim("influence", "poznyakov-yudin", "--json", "out.json", "--page", "out.html", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    for words in ("399.6", "404", "410.6", "model of Pavlenko", "unstable on a straight course", "not given"):
        assert words in result.stdout, words
    reported = json.loads((tmp_path / "out.json").read_text(encoding="utf-8"))
    assert reported["steady_turns"]["inoue-hirano"][3]["radius_m"] == pytest.approx(399.6, abs=0.25)
    assert reported["influence"]["inoue-hirano"]["K_percent"]["C_m_w"] == pytest.approx(7.1, abs=0.05)
    deeper = reported["combined_predictions"]["inoue-hirano-deeper"]
    assert (deeper["predicted_m"], deeper["misread_m"]) == pytest.approx((404.0, 410.6), abs=0.06)
    assert set(reported["missing"]) == {"inoue-hirano", "base", "base-restored", "pavlenko", "sobolev"}
    assert set(reported["manoeuvres"]) == {"inoue-hirano", "curve-3", "base-restored"}
    page = (tmp_path / "out.html").read_text(encoding="utf-8")
    for words in (
        "Steering diagrams",
        "Influence of each coefficient",
        "Turning circles",
        "Influence over the draught",
    ):
        assert words in page


def test_options_of_ship_cards_are_refused_on_a_steering_card(tmp_path: Path) -> None:
    result = tank2sim("influence", "poznyakov-yudin", "--tune", "steady_radius_m=424@20", cwd=tmp_path)
    refused(result, "--tune", "does not go with a steering card")


def test_a_ship_card_is_scaled_to_turn_through_two_points(tmp_path: Path) -> None:
    result = tank2sim("influence", "mariner", "--through", "35@35", "1400m@3", "-o", "own.toml", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    again = tank2sim("influence", "own.toml", "--through", "35@35", "1400m@3", "--json", "again.json", cwd=tmp_path)
    assert again.returncode == 0, again.stderr
    reported = json.loads((tmp_path / "again.json").read_text(encoding="utf-8"))
    assert (reported["hull_factor"], reported["rudder_factor"]) == pytest.approx((1, 1), abs=1e-6)
    card = read_card(tmp_path / "own.toml")
    assert isinstance(card, ManoeuvringCard) and "turn through 35@35 1400m@3" in card.ship.source


@pytest.mark.slow
def test_two_points_have_a_page_and_a_steering_card_a_picture(tmp_path: Path) -> None:
    points = ("influence", "mariner", "--through", "35@35", "1400m@3")
    result = tank2sim(*points, "--page", "page.html", "--json", "out.json", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    found = json.loads((tmp_path / "out.json").read_text(encoding="utf-8"))
    assert found["schema"] == "tank2sim/influence/1" and found["after"][1]["radius_m"] == pytest.approx(1400)
    assert "tuned to two turns" in (tmp_path / "page.html").read_text(encoding="utf-8")
    refused(tank2sim(*points, "--plot", "p.png", cwd=tmp_path), "--plot", "there is no chart to draw")
    assert tank2sim("influence", "poznyakov-yudin", "--plot", "p.png", cwd=tmp_path).returncode == 0
    assert (tmp_path / "p.png").read_bytes().startswith(b"\x89PNG")


def test_a_yaw_rate_is_to_the_side_of_the_rudder(tmp_path: Path) -> None:
    result = tank2sim(
        "influence", "kvlcc2-captive", "--through", "30@-35", "31.5@-10", "--json", "out.json", cwd=tmp_path
    )
    assert result.returncode == 0, result.stderr
    reported = json.loads((tmp_path / "out.json").read_text(encoding="utf-8"))
    assert [turn["yaw_rate_degpmin"] for turn in reported["after"]] == pytest.approx([-30, -31.5])


@pytest.mark.parametrize(
    ("points", "words"),
    [
        (("35@35",), "has 1 point"),
        (("35@35", "much@3"), "is not a point"),
        (("35@35", "0m@3"), "is not a point"),
        (("35@35", "20@95"), "is not a point"),
        (("35@35", "20@35"), "one rudder angle"),
        (("60@35", "1@3"), "no hull factor and rudder factor"),
    ],
)
def test_points_that_cannot_be_read_or_met_are_refused(points: tuple[str, ...], words: str, tmp_path: Path) -> None:
    refused(tank2sim("influence", "mariner", "--through", *points, cwd=tmp_path), words)
