"""Steering cards: angles converted at the door, faults by file and key, ``tank2sim influence`` on them, its charts."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from tank2sim.answer.parts import Verdict
from tank2sim.apps.steering_cards.card import find_steering_card, parse_steering_card, read_steering_card
from tank2sim.apps.steering_cards.comparison import SteeringComparison, compare_steering_models
from tank2sim.apps.steering_cards.result import SteeringModelsResult, steering_diagram_chart
from tank2sim.apps.steering_cards.steady_points import TurnInDegrees
from tank2sim.apps.steering_cards.tuning_result import TurnTuningResult
from tank2sim.apps.steering_cards.two_point_tuning import TwoPointStudy
from tank2sim.bundled import bundled
from tank2sim.cards import ManoeuvringCard, read_card
from tank2sim.errors import InputError
from tests.answer.drawn import rows_of, rows_of_layer
from tests.cli.command_line import refused, tank2sim

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


@pytest.fixture(scope="module")
def found() -> SteeringComparison:
    return compare_steering_models(read_steering_card("poznyakov-yudin"))


def test_the_steering_diagram_shows_models_and_trials(found: SteeringComparison) -> None:
    lines, points = (rows_of_layer(steering_diagram_chart(found.diagrams), number) for number in (0, -1))
    last = {row["run"]: row for row in lines}
    assert last["Japanese model, 9 m"]["v"] == pytest.approx(84.8, abs=0.1)
    assert last["through the two trial points"]["v"] == pytest.approx(61.0, abs=0.01)
    trials = [(row["x"], row["v"]) for row in points if row["run"].startswith("trials")]
    assert trials == [
        pytest.approx(point, abs=1e-3) for point in ((15, 47), (35, 61), (20, 60 * math.degrees(7.7 / 424)))
    ]


def test_the_bars_are_the_influence_of_each_model(found: SteeringComparison) -> None:
    rows = rows_of(SteeringModelsResult(found)._charts()["influence_of_each_coefficient"])
    japanese = {row["name"]: row["v"] for row in rows if row.get("run") == "Japanese model, 9 m"}
    assert japanese["C_m_b"] == pytest.approx(-5.81, abs=0.01)
    assert len(japanese) == 12


def test_the_page_says_what_cannot_be_computed(found: SteeringComparison) -> None:
    result = SteeringModelsResult(found)
    assert result.key_figures[-1].value == 3 and result.key_figures[-1].verdict is Verdict.CAUTION
    missing = {notice.partition(":")[0] for notice in result.notices}
    assert {"base model", "model of Pavlenko", "model of Sobolev"} <= missing
    assert any("unstable" in line for line in result.headline)


def turn(rudder: float, rate: float, radius: float) -> TurnInDegrees:
    return TurnInDegrees(rudder_deg=rudder, radius_m=radius, yaw_rate_degpmin=rate, drift_deg=1.0, speed_mps=7.0)


def test_two_points_are_shown_before_and_after_with_the_change_of_stability() -> None:
    study = TwoPointStudy(
        hull_factor=0.9,
        rudder_factor=1.1,
        parameters={"derivatives.Nd": -1e-3},
        before=(turn(35.0, 40.0, 500.0), turn(15.0, 30.0, 800.0)),
        after=(turn(35.0, 61.0, 424.0), turn(15.0, 47.0, 600.0)),
        course_stable_before=True,
        course_stable_after=False,
        ship="A ship",
        points=("61@35", "47@15"),
        notices=(),
    )
    result = TurnTuningResult(study)
    assert result.tables[0].rows == [[35.0, 40.0, 61.0, 500.0, 424.0], [15.0, 30.0, 47.0, 800.0, 600.0]]
    assert result.turns["radius_after_m"].to_list() == [424.0, 600.0]
    assert any("unstable" in line for line in result.headline)
