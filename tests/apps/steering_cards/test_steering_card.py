"""Steering cards: angles converted at the door, faults reported by file and key."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from tank2sim.apps.steering_cards.card import find_steering_card, parse_steering_card, read_steering_card
from tank2sim.bundled import bundled
from tank2sim.errors import InputError

TEXT = bundled("models", "poznyakov-yudin", "steering.toml").read_text(encoding="utf-8")


def test_the_bundled_card_is_read_in_si() -> None:
    card = read_steering_card("Poznyakov-Yudin")
    assert card.ship.speed_mps == 7.7
    assert card.points[0].rudder_rad == pytest.approx(math.radians(15))
    assert card.points[0].yaw_rate_radps == pytest.approx(math.radians(47) / 60)
    assert card.influence is not None and card.influence.rudder_rad == pytest.approx(math.radians(20))
    assert [point.radius_m for point in card.points if point.measured] == [None, None, 424]


def test_ship_cards_are_no_steering_cards(tmp_path: Path) -> None:
    assert find_steering_card("mariner") is None
    assert find_steering_card(str(bundled("models", "mariner", "ship.toml"))) is None
    assert find_steering_card("") is None
    own = tmp_path / "own.toml"
    own.write_text(TEXT, encoding="utf-8")
    assert find_steering_card(str(own)) == own
    assert read_steering_card(own).models.keys() == read_steering_card("poznyakov-yudin").models.keys()


@pytest.mark.parametrize(
    ("old", "new", "reported"),
    [
        ("length_m = 148.13", "length_ft = 486", "ship.length_ft: is not a key"),
        ("length_m = 148.13", "length_m = -1", "ship.length_m"),
        ("rudder_deg = 15\n", 'rudder_deg = "much"\n', "rudder_deg: is 'much'"),
        ("yaw_rate_degpmin = 47", "drift_deg = 10", "points.0: has not one of yaw rate and radius"),
        ('name = "curve-3"', 'name = "base"', "models: two have the same name"),
        ('title = "model of Sobolev"', 'title = "base model"', "models: two have the same title"),
        ('model = "inoue-hirano"\n', 'model = "nobody"\n', "influence.model: 'nobody' is not a model"),
        ("[6.0, 7.5, 9.0]", "[6.0, 6.0, 9.0]", "influence.draughts_m: has one draught twice"),
        ("[-1.60, -0.22, 1.85]", "[-1.60]", "influence.K_percent.C_y_b: has 1 values"),
        ('C_y_bw = "C_y_bb"', 'C_y_bw = "C_q"', "influence.misread_as: C_q has no K"),
        ("[ship]", "[ship", "correct the TOML"),
    ],
)
def test_a_fault_is_reported_by_its_key(old: str, new: str, reported: str) -> None:
    assert old in TEXT
    with pytest.raises(InputError) as caught:
        parse_steering_card(TEXT.replace(old, new, 1), "own.toml")
    assert str(caught.value).startswith("own.toml") and reported in str(caught.value)


def test_an_unknown_name_lists_what_is_bundled() -> None:
    with pytest.raises(InputError, match="poznyakov-yudin"):
        read_steering_card("no-such-ship")
