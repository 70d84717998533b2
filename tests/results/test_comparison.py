"""Sections of the result of cards compared hold the numbers of the comparison."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tank2sim.analysis.validation.comparison import compare_cards
from tank2sim.answer.charts.picture import chart_specification
from tank2sim.results.comparison import ComparisonResult


@pytest.fixture(scope="module")
def result(mariner_card) -> ComparisonResult:
    changed = {**mariner_card.derivatives, "Nd": 1.2 * mariner_card.derivatives["Nd"]}
    certain = dict.fromkeys(mariner_card.derivatives, 1e-4)
    other = replace(mariner_card, derivatives=changed, uncertainty=certain, source="trial.toml")
    return ComparisonResult(compare_cards([mariner_card, other], 0))


def test_the_sections_tell_what_differs_and_draw_both_tracks(result) -> None:
    tracks, figures, coefficients, _ = result.sections
    assert [section.heading for section in (tracks, figures)] == ["Tracks", "Figures of manoeuvres"]
    (row,) = coefficients.tables[1].rows
    assert row[0] == "Nd" and row[5] == pytest.approx(-20.0)  # the file counts its rudder to port: Nd is negative there
    assert str(row[2]).endswith("*") and row[4] == pytest.approx(0.1)
    drawn = chart_specification(tracks.charts[0].chart)
    assert {row["run"] for data in drawn["datasets"].values() for row in data if "run" in row} == {"mariner", "trial"}
    assert result.title == "Mariner class" and "trial differs from mariner most" in result.headline[1]


def test_the_chart_of_errors_has_a_point_for_each_difference(result) -> None:
    specification = chart_specification(result._charts()["coefficients"])
    points = [row for data in specification["datasets"].values() for row in data if "name" in row]
    assert len(points) == result.study.summary[0].compared > 0
