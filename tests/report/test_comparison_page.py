"""The page of cards compared: what it says and draws."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from tank2sim.analysis.validation.comparison import compare_cards
from tank2sim.answer.charts.picture import chart_specification
from tank2sim.answer.page import render_page
from tank2sim.files import json_text, plain_json
from tank2sim.report.comparison.page import compare_page
from tank2sim.report.results.page import result_page


@pytest.fixture(scope="module")
def found(mariner_card):
    changed = {**mariner_card.derivatives, "Nd": 1.2 * mariner_card.derivatives["Nd"]}
    certain = dict.fromkeys(mariner_card.derivatives, 1e-4)
    other = replace(mariner_card, derivatives=changed, uncertainty=certain, source="trial.toml")
    return compare_cards([mariner_card, other], 0)


def test_the_page_tells_what_differs_and_draws_both_tracks(found) -> None:
    page = compare_page(plain_json(found.as_json()))
    assert [section.heading for section in page.sections][:2] == ["Tracks", "Figures of manoeuvres"]
    (coefficients,) = (section for section in page.sections if section.heading == "Coefficients")
    rows = {row[0]: row for row in coefficients.tables[0].rows}
    assert list(rows) == ["Nd"]
    assert rows["Nd"][5] == pytest.approx(-20.0)  # the file counts its rudder to port: Nd is negative there
    assert rows["Nd"][2].endswith("*") and rows["Nd"][4] == pytest.approx(0.1)
    tracks = chart_specification(page.sections[0].charts[0].chart)
    runs = {row["run"] for data in tracks["datasets"].values() for row in data if "run" in row}
    assert runs == {"mariner", "trial"}
    assert "Mariner class" in render_page(page)


def test_the_chart_of_errors_has_a_point_for_each_difference(found) -> None:
    sections = compare_page(plain_json(found.as_json())).sections
    (coefficients,) = (section for section in sections if section.heading == "Coefficients")
    specification = chart_specification(coefficients.charts[0].chart)
    points = [row for data in specification["datasets"].values() for row in data if "name" in row]
    assert len(points) == len(found.in_errors(1))


@pytest.mark.slow
def test_the_report_of_the_json_is_this_page(found) -> None:
    reported = json.loads(json_text(found.as_json()))
    assert render_page(result_page(reported, "c.json")) == render_page(compare_page(plain_json(found.as_json())))
