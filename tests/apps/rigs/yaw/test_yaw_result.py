"""Result of the yaw rig: charts and tables hold the numbers of the study."""

import pytest

from tank2sim.apps.rigs.yaw.energy import intervals
from tank2sim.apps.rigs.yaw.identify import YawOptions, identify_yaw
from tank2sim.apps.rigs.yaw.records import read_yaw_record
from tank2sim.apps.rigs.yaw.result import YawResult
from tests.answer.drawn import rows_of
from tests.yaw_truth import Truth, record, written


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    truth = Truth(humps=1)
    path = written(tmp_path_factory.mktemp("page") / "water.csv", truth, record(truth))
    return YawResult(identify_yaw([read_yaw_record(path)], YawOptions(inertia_kgm2=0.0204)))


@pytest.fixture(scope="module")
def charts(result):
    return result._charts()


def test_bars_of_the_balance_add_up_to_the_motors_work(result, charts):
    rows = [row for row in rows_of(charts["energy_balance"]) if {"part", "run", "v"} <= set(row)]
    motor = sum(row["v"] for row in rows if row["run"] == "motor")
    spent = sum(row["v"] for row in rows if row["run"] != "motor")
    assert spent == pytest.approx(motor, rel=1e-3)
    (both,) = intervals(read_yaw_record(result.study.records[0]))
    work = sum(Truth().kt * part.integral(part.rate_radps * part.current_A) for part in both)
    assert motor == pytest.approx(1e3 * work, rel=1e-4)


def test_estimates_are_within_their_bars(result, charts):
    rows = {row["name"]: row for row in rows_of(charts["estimates_by_method"]) if "name" in row}
    assert {name.replace(" ", "_") for name in rows} == set(result.study.methods)
    assert all(row["low"] <= row["v"] <= row["high"] for row in rows.values())
    for method, value in result.study.added_inertia_kgm2.items():
        assert rows[method.replace("_", " ")]["v"] == pytest.approx(1e4 * value, rel=1e-5)


def test_every_subinterval_has_its_residual(result, charts):
    rows = [row for row in rows_of(charts["energy_balance_2"]) if "hump" in row]
    assert len(rows) == 12 and {row["run"] for row in rows} == {"accelerating", "braking"}
    assert sorted(row["v"] for row in rows) == pytest.approx(
        sorted(1e6 * one.left_J for one in result.study.energy_residuals), rel=1e-5
    )


def test_tables_hold_the_estimates_and_the_friction(result):
    estimates, friction = result.tables
    best = result.study.methods["energy_least_squares"]
    assert estimates.rows[0][3] == pytest.approx(1e4 * best.total_inertia_kgm2)
    assert [row[:2] for row in friction.rows] == [["coulomb", "N m"], ["viscous", "N m s"], ["quadratic", "N m s²"]]
    assert friction.heads[2:5] == ("energy least squares", "as many equations", "output error")
    assert float(friction.rows[1][2].split(" ± ")[0]) == pytest.approx(1e4 * best.friction["viscous_Nms"], rel=1e-3)
    assert result.key_figures[0].value == pytest.approx(300, rel=0.01)
