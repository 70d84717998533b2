"""The validation report: verdicts, documentation, and a report without trials."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import Any

import pytest

from tank2sim.analysis.stability.imo import ImoCriterion
from tank2sim.analysis.validation.documentation import model_documentation
from tank2sim.analysis.validation.study import TURN_FIGURES, ZIGZAG_FIGURES, Validated, Validation, Verified
from tank2sim.answer.charts.picture import chart_specification
from tank2sim.answer.page import render_page
from tank2sim.answer.parts import Verdict
from tank2sim.files import plain_json
from tank2sim.report.validation.page import validation_page
from tests.report.browser import measured_in_browser

FIGURES = (
    Validated("turn", "turn 35", "advance_m", 500.0, 510.0, 0.001, 8.0, 3.0),
    Validated("turn", "turn 35", "time_90_s", 100.0, 130.0, 0.001, 2.0, 1.0),
    Validated("zigzag", "zigzag 10/10", "overshoot_1_deg", 5.0, None),
)


def validation_json(**changes: object) -> Any:
    """The JSON of a validation with some of its parts replaced."""
    verified = Verified("turn", "advance_m", 500.0, 1e-4, 8.0)
    return plain_json(
        {
            "ship": "A ship",
            "documentation": {},
            "coefficients": {"Yv": {"value": -0.01, "standard_error": 0.001, "stated": True}},
            "propulsion": True,
            **Validation(FIGURES, 40).as_json(),
            "verification": [{**vars(verified), "U_num": verified.numerical}],
            "imo": [asdict(ImoCriterion.judged("advance", 3.6, 4.5, "L"))],
            "replays": [],
            "notices": ["a notice"],
        }
        | changes
    )


def test_each_figure_has_its_verdict() -> None:
    page = validation_page(validation_json())
    section = next(one for one in page.sections if one.heading == "Validation")
    verdicts = [row[-1] for row in section.tables[1].rows]
    assert verdicts == ["validated", "not validated", "not validated"]
    assert page.figures[0].value == "1 of 3" and page.figures[0].verdict is Verdict.FAILED
    drawn = chart_specification(section.charts[0].chart)["datasets"].values()
    assert sorted(row["e"] for data in drawn for row in data if "e" in row)[:1] == [2.0]


def test_what_the_procedure_asks_for_is_documented(mariner_card, mariner) -> None:
    documentation = model_documentation(mariner_card, mariner)
    text = render_page(validation_page(validation_json(documentation=documentation)))
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


def test_without_trials_the_report_says_that_nothing_is_validated() -> None:
    page = validation_page(validation_json(**Validation((), 0).as_json()))
    assert page.figures[0].verdict is Verdict.CAUTION
    assert "not validated" in render_page(page)


def test_a_trial_that_made_the_card_is_no_validation() -> None:
    figures = tuple(replace(figure, made_card=True) for figure in FIGURES[:1])
    page = validation_page(validation_json(**Validation(figures, 40).as_json()))
    assert page.figures[0].value == "0 of 1" and page.figures[0].verdict is Verdict.CAUTION
    assert "only fitted" in page.verdict


def test_a_criterion_beyond_the_card_has_no_verdict() -> None:
    beyond = ImoCriterion.judged("advance", 2.4, 4.5, "L", "leaves the card's validity", beyond_card=True)
    page = validation_page(validation_json(imo=[asdict(beyond)]))
    table = next(one for one in page.sections if one.heading == "Standard manoeuvres").tables[0]
    assert table.rows[0][4] == "beyond the card"


@pytest.mark.slow
@pytest.mark.parametrize("width", [1440, 1160, 1100])
def test_the_verdicts_stand_on_the_page_without_scrolling(tmp_path, width) -> None:
    figures = tuple(
        Validated("zigzag of a long name", "zigzag", name, 123.456, 234.567, 0.001234, 12.3456, 3.45678)
        for name in (*ZIGZAG_FIGURES, *TURN_FIGURES)
    )
    verified = tuple(
        Verified("turn 35 deg to starboard", name, 1234.5, -1.2345e-4, 12.345)
        for name in ("steady_rate_degps", "speed_loss_percent", "initial_turning_distance_m", "tactical_diameter_m")
    )
    verification = [{**vars(row), "U_num": row.numerical} for row in verified]
    html = render_page(validation_page(validation_json(**Validation(figures, 40).as_json(), verification=verification)))
    script = """<script>setTimeout(() => { document.body.dataset.wide = JSON.stringify(
      [...document.querySelectorAll(".table")].map((one) => one.scrollWidth - one.clientWidth)); }, 500);</script>"""
    wide = measured_in_browser(
        html.replace("</body>", script + "</body>"), tmp_path, "wide", f"--window-size={width},2000"
    )
    assert len(wide) >= 5 and max(wide) <= 0
