"""``tank2sim influence`` on a steering card, and ``--through`` on a ship card."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tank2sim.cards import ManoeuvringCard, read_card
from tests.cli.command_line import refused, tank2sim


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
