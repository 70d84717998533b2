"""The page of tows: what it says and what its charts hold."""

from dataclasses import replace

import numpy as np
import pytest

from tank2sim.bundled import bundled
from tank2sim.files import plain_json
from tank2sim.identification.tow import paper as tow_paper
from tank2sim.identification.tow.identify import identify_tow
from tank2sim.identification.tow.study import study_tows, towed_body
from tank2sim.records.tows import read_tows
from tank2sim.report.tow.charts import drag_chart, tow_speed_chart
from tank2sim.report.tow.page import tow_page


@pytest.fixture(scope="module")
def table_1():
    return read_tows(bundled("models", "wilinski-zellman", "tows.csv"))


@pytest.fixture(scope="module")
def study(table_1):
    result = identify_tow(table_1)
    return study_tows(result, towed_body(table_1, result.mass_kg, {}))


def test_the_page_holds_the_paper_next_to_what_its_tows_give(study):
    page = tow_page(plain_json(study.as_json()))
    assert [figure.value for figure in page.figures[:3]] == [2772, 529, "2.55 to 3.40"]
    speeds, models, drag, theory, estimates, by_tow = page.sections
    assert len(speeds.notes) == len(study.notes) and not any("e+" in note or "e-0" in note for note in speeds.notes)
    assert "22\u202f000 (qr) and 580\u202f000 (output_error)" in speeds.notes[0]
    rows = {row[0]: row for row in estimates.tables[1].rows}
    assert rows["2, printed"][1:4] == list(tow_paper.TABLE_2[2][0])
    assert len(rows) == 8 and len(speeds.charts) == 1 and len(models.charts) == 2 and len(by_tow.tables) == 3
    drags = {row[0]: row for row in drag.tables[0].rows}
    assert drags["as printed"][1:4] == pytest.approx([12.8, -3.6144, 0.27909], rel=3e-5)
    assert "best usable: M, B3, delay" in drags
    assert [row[3] for row in theory.tables[0].rows] == [2357, 2316, 2489]


def test_other_tows_are_not_held_next_to_the_paper(table_1):
    one = replace(table_1.only(0), body={})
    page = tow_page(plain_json(study_tows(identify_tow(one, terms=("B3",))).as_json()))
    assert [section.heading for section in page.sections] == [
        "Measured and computed speeds",
        "What these tows determine",
        "Estimates by method",
    ]
    assert len(page.sections[2].tables[1].rows) == 4


def records_of(chart, kind, panel):
    content = chart.to_dict()
    layers = content[kind][panel]["layer"]
    return [row for layer in layers for row in content["datasets"][layer["data"]["name"]]]


def test_drag_chart_has_speed_and_reynolds_number(study):
    rows = records_of(drag_chart({"qr": study.drags["qr"]}, study.body, 0.176), "hconcat", 0)
    last = max((row for row in rows if "v" in row), key=lambda row: row["v"])
    assert last["v"] == pytest.approx(0.176) and last["re"] == pytest.approx(0.176 * 3.8 / 1.139e-6, rel=1e-5)
    assert last["cv"] == pytest.approx(8.42716 * last["c"], rel=1e-4)
    assert last["c"] == pytest.approx(float(study.drags["qr"].at(np.array(0.176))), rel=1e-5)


def test_residuals_are_readings_less_the_first_fit(table_1):
    measured = {f"tow {n}": speed.tolist() for n, speed in enumerate(table_1.speed_mps.T, start=1)}
    speeds = {"t_s": table_1.time_s.tolist(), "measured_mps": measured}
    speeds |= {"simulated_t_s": [0.0, 50.0], "simulated_mps": {"line": [0.0, 0.175]}}
    rows = records_of(tow_speed_chart(speeds), "vconcat", 1)
    found = {(row["run"], row["t"]): row["v"] for row in rows}
    assert found["tow 3", 20.0] == pytest.approx(0.078 - 0.07)
    assert found["line", 50.0] == 0
