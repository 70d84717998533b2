"""Results of reduced campaigns: tables and charts hold the numbers of the study."""

from __future__ import annotations

import pytest

import tank2sim as t2s
from tank2sim.answer.charts.parts import plain
from tank2sim.results.mmg_reduction import MmgReductionResult
from tank2sim.results.reduction import ReductionResult
from tests.answer.drawn import line, rows_of
from tests.identification.captive.generator import Campaign, write
from tests.identification.captive_mmg.tank import KVLCC2, write_campaign


@pytest.fixture(scope="module")
def polynomial(tmp_path_factory: pytest.TempPathFactory) -> ReductionResult:
    path = write(Campaign(seed=6, size="linear", rate_hz=5.0), tmp_path_factory.mktemp("campaign")).path
    return t2s.reduce(path, fill="clarke1983")


@pytest.fixture(scope="module")
def mmg(tmp_path_factory: pytest.TempPathFactory) -> MmgReductionResult:
    return t2s.reduce_to_mmg(write_campaign(tmp_path_factory.mktemp("mmg"), KVLCC2))


def test_every_derivative_of_the_card_is_in_the_table(polynomial: ReductionResult) -> None:
    shown = {row[0]: (row[1], row[2], row[-1]) for row in polynomial.sections[0].tables[0].rows}
    entries, estimated = polynomial.contents.entries, polynomial.contents.estimated
    assert shown == {
        name: (1e5 * entry.value, 1e5 * entry.standard_error, "estimated" if name in estimated else "measured")
        for name, entry in entries.items()
    }
    assert estimated and dict(polynomial.card.derivatives) == {name: entry.value for name, entry in entries.items()}


def test_charts_have_the_stems_of_their_files_and_the_fits(polynomial: ReductionResult) -> None:
    charts = polynomial._charts()
    assert list(charts) == ["certainty", *polynomial.study.plots, "residuals"]
    (series,) = polynomial.study.plots["static_drift_Y"].series
    assert line(charts["static_drift_Y"], "v")[: len(series.x)]
    fitted = {row["v"] for row in rows_of(charts["static_drift_Y"])}
    assert min(abs(value - series.fit_value.max()) for value in fitted) < 1e-5 * abs(series.fit_value.max())
    against = [section for section in polynomial.sections if "against motion" in section.heading]
    assert against and all(section.charts and "95 % band" in section.text for section in against)


def test_predicted_runs_are_shares_of_their_range(polynomial: ReductionResult) -> None:
    (predicted,) = (each for each in polynomial.tables if each.caption.startswith("Leave-one-out"))
    errors = polynomial.study.prediction_errors["static_drift"]
    shown = {row[0]: row[1:] for row in predicted.rows}["static drift"]
    assert shown == pytest.approx([100 * errors[force].relative for force in "XYN"])
    worst = max(row[2] for row in predicted.rows if row[2] is not None)
    assert f"sway force within {worst:.2g} %" in polynomial.headline[0]


def test_coefficients_and_residuals_of_the_mmg_method_are_tables(mmg: MmgReductionResult) -> None:
    coefficients, residuals, budget = mmg.tables
    shown = {row[0]: tuple(row[1:]) for row in coefficients.rows}
    assert shown.pop("x_R + a_H x_H") == (mmg.study.yaw_arm.value, mmg.study.yaw_arm.standard_error, "measured")
    assert shown == {
        name: (found.value, found.standard_error, found.origin) for name, found in mmg.coefficients.items()
    }
    assert [row[3] for row in residuals.rows[:5]] == pytest.approx([100 * share for share in mmg.unexplained])
    assert [row[1] for row in budget.rows if row[0] == "w_P0"] == [100.0]  # no error common to the tests is stated


def test_readings_are_drawn_as_computed_over_measured(mmg: MmgReductionResult) -> None:
    points = rows_of(mmg._charts()["sway_force"])
    readings = mmg.study.readings["Y"]
    drawn = {(row["x"], row["v"]) for row in points}
    both = zip(readings.measured.tolist(), readings.computed.tolist(), strict=True)
    assert {(plain(one), plain(other)) for one, other in both} <= drawn


def test_measured_derivatives_below_their_standard_errors_are_counted(polynomial: ReductionResult) -> None:
    table = polynomial.derivatives
    measured = table[table["origin"] == "measured"]
    lost = int((measured["value"].abs() < measured["standard_error"]).sum())
    assert lost > 1 and f"{lost} of them are smaller than the standard error" in polynomial.headline[0]
