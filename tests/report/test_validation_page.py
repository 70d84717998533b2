"""The validation report: verdicts, documentation, and a report without trials."""

from __future__ import annotations

import pytest

from tank2sim.analysis.practice.validation import Validated, Validation, Verified
from tank2sim.analysis.stability.imo import Criterion
from tank2sim.report.charts import chart_specification
from tank2sim.report.page import Verdict, render_page
from tank2sim.report.validation_page import Evidence, validation_page

FIGURES = (
    Validated("turn", "turn 35", "advance_m", 500.0, 510.0, 0.001, 8.0, 3.0),
    Validated("turn", "turn 35", "time_90_s", 100.0, 130.0, 0.001, 2.0, 1.0),
    Validated("zigzag", "zigzag 10/10", "overshoot_1_deg", 5.0, None),
)


@pytest.fixture
def evidence(mariner_card, mariner) -> Evidence:
    verified = (Verified("turn", "advance_m", 500.0, 1e-4, 8.0),)
    criteria = (Criterion("advance", 3.6, 4.5, "L"),)
    return Evidence(mariner_card, mariner, Validation(FIGURES, 40), verified, criteria, (), ("a notice",))


def test_each_figure_has_its_verdict(evidence) -> None:
    page = validation_page(evidence)
    section = next(one for one in page.sections if one.heading == "Validation")
    verdicts = [row[-2] for row in section.tables[1].rows]
    assert verdicts == [Verdict.PASSED, Verdict.FAILED, Verdict.FAILED]
    assert page.figures[0].value == "1 of 3" and page.figures[0].verdict is Verdict.FAILED
    drawn = chart_specification(section.charts[0].chart)["datasets"].values()
    assert sorted(row["e"] for data in drawn for row in data if "e" in row)[:1] == [2.0]


def test_what_the_procedure_asks_for_is_documented(evidence) -> None:
    text = render_page(validation_page(evidence))
    for item in (
        "Source of the coefficients",
        "Scale effects",
        "Steering gear",
        "Autopilot",
        "Environment",
        "Integration",
    ):
        assert item in text
    assert "rate 5 deg/s" in text and "Froude number" in text and "E = S" in text


def test_without_trials_the_report_says_that_nothing_is_validated(evidence) -> None:
    bare = Evidence(evidence.card, evidence.model, Validation((), 0), evidence.verified, evidence.criteria, ())
    page = validation_page(bare)
    assert page.figures[0].verdict is Verdict.CAUTION
    assert "not validated" in render_page(page)
