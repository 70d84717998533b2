"""The results of a steering card and of two points met: charts hold the models, the trials and the findings."""

from __future__ import annotations

import math
from typing import Any

import pytest

from tank2sim.analysis.turning.points import TurnInDegrees
from tank2sim.answer.charts.picture import chart_specification
from tank2sim.answer.parts import Verdict
from tank2sim.apps.steering_cards.card import read_steering_card
from tank2sim.apps.steering_cards.comparison import SteeringComparison, compare_steering_models
from tank2sim.apps.steering_cards.result import SteeringModelsResult, steering_diagram_chart
from tank2sim.apps.steering_cards.tuning_result import TurnTuningResult
from tank2sim.apps.steering_cards.two_point_tuning import TwoPointStudy
from tests.answer.drawn import rows_of


def _rows(specification: dict[str, Any], layer: int) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = specification["datasets"][specification["layer"][layer]["data"]["name"]]
    return rows


@pytest.fixture(scope="module")
def found() -> SteeringComparison:
    return compare_steering_models(read_steering_card("poznyakov-yudin"))


def test_the_steering_diagram_shows_models_and_trials(found: SteeringComparison) -> None:
    specification = chart_specification(steering_diagram_chart(found.diagrams))
    lines, points = _rows(specification, 0), _rows(specification, -1)
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
