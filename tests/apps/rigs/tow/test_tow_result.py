"""Result of tows: what it says, and what its charts and tables hold."""

from dataclasses import replace

import numpy as np
import pytest

from tank2sim.apps.rigs.tow import paper as tow_paper
from tank2sim.apps.rigs.tow.identify import identify_tow
from tank2sim.apps.rigs.tow.result import TowResult, drag_chart, tow_speed_chart
from tank2sim.apps.rigs.tow.study import TowSpeeds, study_tows, towed_body
from tests.answer.drawn import panels, rows_of, whole_panel


@pytest.fixture(scope="module")
def result(table_1):
    found = identify_tow(table_1)
    return TowResult(study_tows(found, table_1, towed_body(table_1, found.mass_kg, {})))


def table_rows(result, caption):
    (found,) = (each for each in result.tables if each.caption.startswith(caption))
    return {row[0]: row for row in found.rows}


def test_the_paper_stands_next_to_what_its_tows_give(result):
    assert [figure.value for figure in result.key_figures[:3]] == [2772, 529, "2.55 to 3.40"]
    notices = result.layout().sections[-1].notes
    assert len(notices) == len(result.notices) and not any("e+" in note or "e-0" in note for note in notices)
    assert "22\u202f000 (qr) and 580\u202f000 (output_error)" in notices[0]
    polynomials = table_rows(result, "Polynomials")
    assert polynomials["2, printed"][1:4] == list(tow_paper.TABLE_2[2][0]) and len(polynomials) == 8
    drags = {row[0]: row for row in result.sections[3].tables[0].rows if row[1] == "L²"}
    assert drags["as printed"][2:5] == pytest.approx([12.8, -3.6144, 0.27909], rel=3e-5)
    assert "best usable: M, B3, delay" in drags
    assert [round(row[3]) for row in result.sections[4].tables[0].rows] == [2357, 2316, 2489]


def test_estimates_stand_by_method_with_their_errors(result):
    estimates = table_rows(result, "Estimates by method, ± one standard error")
    fit = result.study.methods["output_error"]
    mass, error = (float(text) for text in estimates["M (kg)"][3].split(" ± "))
    assert mass == pytest.approx(fit.estimates["total_mass_kg"], abs=0.05)
    assert error == pytest.approx(fit.standard_errors["total_mass_kg"], abs=5)
    assert "±" not in estimates["M (kg)"][1]  # the published method gives no error


def test_other_tows_are_not_held_next_to_the_paper(table_1):
    one = replace(table_1.only(0), body={})
    found = TowResult(study_tows(identify_tow(one, terms=("B3",)), one))
    assert [section.heading for section in found.sections] == [
        "Measured and computed speeds",
        "Estimates by method",
        "What these tows determine",
    ]
    assert len(table_rows(found, "Polynomials")) == 4


def test_charts_hold_the_speeds_and_the_models(result):
    charts, study = result._charts(), result.study
    assert list(charts) == [
        "measured_and_computed_speeds",
        "what_these_tows_determine",
        "what_these_tows_determine_2",
        "drag_coefficient",
    ]
    speed, left = panels(charts["measured_and_computed_speeds"]).values()
    first, *_ = study.speeds.simulated_mps
    drawn = [row["v"] for row in speed if row["run"] == first]
    assert drawn == pytest.approx(study.speeds.simulated_mps[first], rel=1e-5)
    assert {row["v"] for row in left if row["run"] == first} == {0.0}
    models = {row["name"]: row["m"] for row in rows_of(charts["what_these_tows_determine"]) if "name" in row}
    assert models == {one.label: pytest.approx(one.estimates["M"], rel=1e-5) for one in study.models}


def test_drag_chart_has_speed_and_reynolds_number(result):
    body, drag = result.study.body, result.study.drag_coefficients["qr"].by_length_squared
    rows = [row for row in rows_of(drag_chart({"qr": drag}, body, 0.176)) if "speed" in row]
    last = max(rows, key=lambda row: row["speed"])
    assert last["speed"] == pytest.approx(0.176) and last["re"] == pytest.approx(0.176 * 3.8 / 1.139e-6, rel=1e-5)
    assert last["cv"] == pytest.approx(8.42716 * last["c"], rel=1e-4)
    assert last["c"] == pytest.approx(float(drag.at(np.array(0.176))), rel=1e-5)


def test_residuals_are_readings_less_the_first_fit(table_1):
    speeds = TowSpeeds(
        t_s=table_1.time_s,
        measured_mps={"tow 3": table_1.speed_mps[:, 2]},
        simulated_t_s=np.array([0.0, 50.0]),
        simulated_mps={"line": np.array([0.0, 0.175])},
    )
    found = {(row["run"], row["x"]): row["v"] for row in whole_panel(tow_speed_chart(speeds), 1)}
    assert found["tow 3", 20.0] == pytest.approx(0.078 - 0.07)
    assert found["line", 50.0] == 0
