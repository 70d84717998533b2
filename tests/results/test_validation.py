"""Results of validations and comparisons: verdicts, documentation, charts of what differs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tank2sim.analysis.stability.imo import ImoCriterion
from tank2sim.analysis.validation.comparison import compare_cards
from tank2sim.analysis.validation.documentation import model_documentation
from tank2sim.analysis.validation.study import TURN_FIGURES, ZIGZAG_FIGURES, Validated, Validation, Verified
from tank2sim.answer.parts import Verdict
from tank2sim.cards import SteeredBy
from tank2sim.notices import Notice
from tank2sim.results.comparison import ComparisonResult
from tank2sim.results.validation import CardValue, TrialReplay, ValidationResult, ValidationStudy
from tests.answer.browser import measured_in_browser
from tests.answer.drawn import panels, rows_of

FIGURES = (
    Validated("turn", "turn 35", "advance_m", 500.0, 510.0, 0.001, 8.0, 3.0),
    Validated("turn", "turn 35", "time_90_s", 100.0, 130.0, 0.001, 2.0, 1.0),
    Validated("zigzag", "zigzag 10/10", "overshoot_1_deg", 5.0, None),
)


HISTORIES = {"t_s": np.arange(4.0), "u_mps": np.array([7.0, 6.9, np.nan, 6.7])}


def validation(figures: tuple[Validated, ...] = FIGURES, **changes: object) -> ValidationResult:
    """A validation with some of its parts replaced."""
    found = Validation(figures, 40)
    study = ValidationStudy(
        ship="A ship",
        source="a paper",
        documentation={},
        coefficients={"Yv": CardValue(value=-0.01, standard_error=0.001, stated=True)},
        steered_by=SteeredBy.RUDDER,
        propulsion=True,
        verdict=found.verdict,
        counts=found.counts,
        figures=figures,
        members=40,
        verification=(Verified("turn", "advance_m", 500.0, 1e-4, 8.0),),
        imo=(ImoCriterion.judged("advance", 3.6, 4.5, "L"),),
        replays=(
            TrialReplay(
                trial="zigzag",
                errors=(),
                measured=HISTORIES,
                simulated={**HISTORIES, "u_mps": np.array([7.0, 6.95, 6.9, 6.85])},
            ),
        ),
        notices=(Notice("a notice"),),
    )
    return ValidationResult(replace(study, **changes))


def test_each_figure_has_its_verdict() -> None:
    result = validation()
    tables = {table.caption: table.df for table in result.tables}
    verdicts = tables["E = simulated S less measured D, and its uncertainty"]["verdict"].to_list()
    assert verdicts == ["validated", "not validated", "not validated"]
    first = result.key_figures[0]
    assert first.value == "1 of 3" and first.verdict is Verdict.FAILED
    assert min(row["v"] for row in rows_of(result._charts()["validation"]) if "most" in row) == 2.0
    assert tables["Prime system, rudder positive to starboard, times 1000"]["value"].to_list() == [-10.0]


def test_replays_are_drawn_next_to_the_measured_signals() -> None:
    speeds = panels(validation()._charts()["replays"])["surge velocity (m/s)"]
    assert [row["v"] for row in speeds if row["run"] == "simulated"] == [7.0, 6.95, 6.9, 6.85]


def test_what_the_procedure_asks_for_is_documented(mariner_card, mariner) -> None:
    documentation = model_documentation(mariner_card, mariner)
    text = validation(documentation=documentation).page()
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
    result = validation(figures=())
    assert result.key_figures[0].verdict is Verdict.CAUTION
    assert "not validated" in result.headline[0] and "not validated" in result.page()


def test_a_trial_that_made_the_card_is_no_validation() -> None:
    result = validation(tuple(replace(figure, made_card=True) for figure in FIGURES[:1]))
    assert result.key_figures[0].value == "0 of 1" and result.key_figures[0].verdict is Verdict.CAUTION
    assert "only fitted" in result.headline[0]


def test_a_criterion_beyond_the_card_has_no_verdict() -> None:
    beyond = ImoCriterion.judged("advance", 2.4, 4.5, "L", "leaves the card's validity", beyond_card=True)
    sections = validation(imo=(beyond,)).sections
    table = next(one for one in sections if one.heading == "Standard manoeuvres").tables[0]
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
    html = validation(figures, verification=verified).page()
    script = """<script>setTimeout(() => { document.body.dataset.wide = JSON.stringify(
      [...document.querySelectorAll(".table")].map((one) => one.scrollWidth - one.clientWidth)); }, 500);</script>"""
    wide = measured_in_browser(
        html.replace("</body>", script + "</body>"), tmp_path, "wide", f"--window-size={width},2000"
    )
    assert len(wide) >= 5 and max(wide) <= 0


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
    assert {row["run"] for row in rows_of(tracks.charts[0].chart) if "run" in row} == {"mariner", "trial"}
    assert result.title == "Mariner class" and "trial differs from mariner most" in result.headline[1]


def test_the_chart_of_errors_has_a_point_for_each_difference(result) -> None:
    points = [row for row in rows_of(result._charts()["coefficients"]) if "name" in row]
    assert len(points) == result.study.summary[0].compared > 0
