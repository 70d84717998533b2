"""Charts of the yaw rig show what was found."""

import pytest

from tank2sim.answer.charts.picture import chart_specification
from tank2sim.files import plain_json
from tank2sim.identification.yaw.identify import YawOptions, identify_yaw
from tank2sim.records.yaw import read_yaw_record
from tank2sim.report.yaw.charts import balance_chart, energy_residual_chart, estimates_chart, record_chart
from tank2sim.report.yaw.page import yaw_page
from tests.yaw_truth import Truth, record, written


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    truth = Truth(humps=1)
    path = written(tmp_path_factory.mktemp("page") / "water.csv", truth, record(truth))
    return identify_yaw([read_yaw_record(path)], YawOptions(inertia_kgm2=0.0204))


@pytest.fixture(scope="module")
def reported(result):
    return plain_json(result.as_json())


def values(chart, *keys):
    found = []

    def walk(node):
        if isinstance(node, dict):
            for child in node.values():
                walk(child)
        elif isinstance(node, list):
            rows = [row for row in node if isinstance(row, dict)]
            found.extend(row for row in rows if set(keys) <= set(row))
            for child in node:
                walk(child)

    walk(chart_specification(chart))
    return found


def test_bars_of_the_balance_add_up_to_the_motors_work(result, reported):
    rows = values(balance_chart(reported["energy_balance"]), "part", "run", "v")
    motor = sum(row["v"] for row in rows if row["run"] == "motor")
    spent = sum(row["v"] for row in rows if row["run"] != "motor")
    assert spent == pytest.approx(motor, rel=1e-3)
    assert motor == pytest.approx(1e3 * result.fit.balance.work_J.sum(), rel=1e-4)


def test_estimates_stand_within_their_bars(result, reported):
    rows = values(estimates_chart(reported["methods"]), "name", "v", "low", "high")
    assert len(rows) == len(result.estimates)
    assert all(row["low"] <= row["v"] <= row["high"] for row in rows)


def test_every_subinterval_has_its_residual(reported):
    rows = values(energy_residual_chart(reported["energy_residuals"]), "hump", "w", "v")
    assert len(rows) == 12 and {row["run"] for row in rows} == {"accelerating", "braking"}


def test_page_has_a_chart_for_each_record_and_says_what_is_noted(result, reported):
    page = yaw_page(reported)
    notes = [note for section in page.sections for note in section.notes]
    assert notes == list(result.notes)
    assert values(record_chart(*next(iter(reported["histories"].items()))), "run")
    assert page.figures[0].value == pytest.approx(300, rel=0.01)
