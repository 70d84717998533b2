"""The page of a steering card: its charts hold the models, the trials and what was found."""

from __future__ import annotations

import math
from typing import Any

import pytest

from tank2sim.analysis.catalogue.comparison import SteeringComparison, compare_steering_models
from tank2sim.answer.charts.picture import chart_specification
from tank2sim.answer.parts import Verdict
from tank2sim.cards.steering_card import SteeringCard, read_steering_card
from tank2sim.files import plain_json
from tank2sim.report.steering_card.page import influence_bars, steering_catalogue_page, steering_diagram_chart


def _rows(specification: dict[str, Any], layer: int) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = specification["datasets"][specification["layer"][layer]["data"]["name"]]
    return rows


@pytest.fixture(scope="module")
def card() -> SteeringCard:
    return read_steering_card("poznyakov-yudin")


@pytest.fixture(scope="module")
def found(card: SteeringCard) -> SteeringComparison:
    return compare_steering_models(card)


def test_the_steering_diagram_shows_models_and_trials(found: SteeringComparison) -> None:
    specification = chart_specification(steering_diagram_chart(found.as_json()["diagrams"]))
    lines, points = _rows(specification, 0), _rows(specification, -1)
    last = {row["run"]: row for row in lines}
    assert last["Japanese model, 9 m"]["r"] == pytest.approx(84.8, abs=0.1)
    assert last["through the two trial points"]["r"] == pytest.approx(61.0, abs=0.01)
    trials = [(row["d"], row["r"]) for row in points if row["run"].startswith("trials")]
    assert trials == [
        pytest.approx(point, abs=1e-3) for point in ((15, 47), (35, 61), (20, 60 * math.degrees(7.7 / 424)))
    ]


def test_the_bars_are_the_influence_of_each_model(card: SteeringCard, found: SteeringComparison) -> None:
    rows = _rows(
        chart_specification(influence_bars({card.models[one.model].title: one.K_percent for one in found.influence})), 0
    )
    japanese = {row["name"]: row["K"] for row in rows if row["run"] == "Japanese model, 9 m"}
    assert japanese["C_m_b"] == pytest.approx(-5.81, abs=0.01)
    assert len(japanese) == 12


def test_the_page_says_what_cannot_be_computed(found: SteeringComparison) -> None:
    page = steering_catalogue_page(plain_json(found.as_json()))
    assert page.figures[-1].value == 3 and page.figures[-1].verdict is Verdict.CAUTION
    missing = page.sections[-1].tables[0].rows
    assert {"base model", "model of Pavlenko", "model of Sobolev"} <= {row[0] for row in missing}
    assert any("unstable" in note for section in page.sections for note in section.notes)
