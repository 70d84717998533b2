"""Results of captive tests: charts, runs and reductions hold the numbers of their studies."""

from __future__ import annotations

import math

import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.answer.charts.parts import plain
from tank2sim.answer.charts.picture import chart_png, chart_specification
from tank2sim.answer.parts import Verdict
from tank2sim.identification.captive.plot_data import (
    ForceLoop,
    ForcePlot,
    ForceSeries,
    Harmonics,
    HarmonicsPlot,
    LoopPlot,
)
from tank2sim.results.captive_charts import (
    Residual,
    force_chart,
    harmonic_chart,
    loop_chart,
    residual_chart,
)
from tank2sim.results.captive_run import CaptiveRunResult
from tank2sim.results.mmg_reduction import MmgReductionResult
from tank2sim.results.reduction import ReductionResult
from tests.answer.drawn import line, panels, rows_of, whole_panel
from tests.identification.captive.generator import Campaign, write
from tests.identification.captive.made_runs import oscillation
from tests.identification.captive_mmg.tank import KVLCC2, write_campaign


def against_drift(*series, title=""):
    return force_chart(ForcePlot(title=title, across="drift angle", unit="rad", up="Y (N)", series=series))


def loops_of(loop, across, unit, forces):
    return loop_chart(LoopPlot(title="Loops", across=across, unit=unit, loops=(loop,)), forces)


def harmonics_of(*runs):
    return harmonic_chart(HarmonicsPlot(title="Harmonics", up="Y (N)", runs=runs))


def rows(specification, layer):
    """Records of a layer; those that all layers of a panel share stand at the panel."""
    panels = specification.get("vconcat", [specification])
    (panel,) = (panel for panel in panels if any(layer is one for one in panel["layer"]))
    source = next(place["data"] for place in (layer, panel, specification) if "data" in place)
    return specification["datasets"][source["name"]]


def layers_of(specification, mark):
    return [layer for layer in specification["layer"] if layer["mark"]["type"] == mark]


def drift_series(**more):
    angle = np.deg2rad([-4.0, 0.0, 8.0])
    return ForceSeries(label="static drift", x=angle, value=[-5.0, 0.5, 11.0], **more)


def test_angles_stand_across_in_degrees_and_forces_upward_as_given():
    specification = chart_specification(against_drift(drift_series()))
    (points,) = layers_of(specification, "point")
    assert [(row["x"], row["v"]) for row in rows(specification, points)] == [(-4, -5), (0, 0.5), (8, 11)]
    assert points["encoding"]["x"]["title"] == "drift angle (deg)"
    assert points["encoding"]["y"]["title"] == "Y (N)"


def test_intervals_and_bands_reach_their_half_width_to_both_sides():
    fit = {"fit_x": [0.2, -0.1], "fit_value": [20.0, -8.0], "fit_half_width": [3.0, 1.0]}
    specification = chart_specification(against_drift(drift_series(half_width=[1, 2, 4], **fit)))
    (band,) = layers_of(specification, "area")
    assert [(row["low"], row["high"]) for row in rows(specification, band)] == [(-9, -7), (17, 23)]
    intervals = [layer for layer in layers_of(specification, "rule") if "y2" in layer["encoding"]]
    assert [(row["low"], row["high"]) for row in rows(specification, intervals[0])] == [(-6, -4), (-1.5, 2.5), (7, 15)]


def test_zero_is_marked_only_among_the_values():
    above = ForceSeries(label="far from zero", x=[0.0, 1.0], value=[5.0, 6.0])
    for series, marked in ((drift_series(), 1), (above, 0)):
        specification = chart_specification(against_drift(series))
        assert len(layers_of(specification, "rule")) == marked


def test_a_fit_is_drawn_from_left_to_right_whatever_its_order():
    series = drift_series(fit_x=[0.3, -0.3, 0.0], fit_value=[3.0, -3.0, 0.0])
    specification = chart_specification(against_drift(series))
    (line,) = layers_of(specification, "line")
    assert [row["v"] for row in rows(specification, line)] == [-3, 0, 3]
    assert line["encoding"]["order"]["field"] == "i"
    assert not layers_of(specification, "area")


def test_a_loop_keeps_the_order_of_time_and_its_forces_their_panels():
    motion = [0.1, 0.0, -0.1, 0.0]
    loop = ForceLoop(
        label="sway_01",
        motion=motion,
        forces={"Y": [1, 2, 3, 4], "N": [5, 6, 7, 8]},
        fitted_motion=[*motion, 0.1],
        fitted={"Y": [1, 2, 3, 4, 1]},
    )
    forces = {"Y": "Y (N)", "N": "N (N m)"}
    specification = chart_specification(loops_of(loop, "sway velocity", "m/s", forces))
    sway, yaw = specification["vconcat"]
    (line,) = layers_of(sway, "line")
    assert [(row["i"], row["x"], row["v"]) for row in rows(specification, line)] == [
        (0, 0.1, 1), (1, 0, 2), (2, -0.1, 3), (3, 0, 4), (4, 0.1, 1)]  # fmt: skip
    assert line["encoding"]["order"]["field"] == "i"
    (points,) = layers_of(yaw, "point")
    assert [row["v"] for row in rows(specification, points)] == [5, 6, 7, 8]
    assert points["encoding"]["x"]["title"] == "sway velocity (m/s)"
    assert not layers_of(yaw, "line")


def test_a_yaw_rate_is_shown_in_degrees_a_second():
    loop = ForceLoop(label="yaw", motion=[np.pi / 180], forces={"N": [1.0]})
    specification = chart_specification(loops_of(loop, "r", "rad/s", {"N": "N (N m)"}))
    assert rows(specification, specification["vconcat"][0]["layer"][0])[0]["x"] == 1.0


def test_a_force_that_no_loop_has_is_refused():
    with pytest.raises(ValueError, match="no loop has the force X"):
        loops_of(ForceLoop(label="a", motion=[0], forces={"Y": [0]}), "v", "1", {"X": "X (N)"})


def test_harmonics_are_bars_in_the_order_of_the_runs_with_the_fit_next_to_them():
    runs = [
        Harmonics(run="yaw_01", amplitude=[10.0, 0.1, 2.0], fitted=[9.5, 0.0, -2.1]),
        Harmonics(run="sway_00", amplitude=[5.0, 0.2]),
    ]
    specification = chart_specification(harmonics_of(*runs))
    assert len(specification["vconcat"]) == 3
    third = specification["vconcat"][2]
    (bars,), (ticks,) = layers_of(third, "bar"), layers_of(third, "tick")
    assert rows(specification, bars) == [{"run": "yaw_01", "v": 2.0}, {"run": "sway_00", "v": None}]
    assert rows(specification, ticks) == [{"run": "yaw_01", "v": 2.1}]
    assert bars["encoding"]["x"]["scale"]["domain"] == ["yaw_01", "sway_00"]
    assert bars["encoding"]["y"]["scale"]["zero"] is True
    assert bars["encoding"]["y"]["title"] == "harmonic 3 of Y (N)"


def test_residuals_of_all_forces_have_one_symmetric_scale_that_shows_all():
    residuals = [
        Residual(run="sway_00", kind="pure_sway", force="Y", value=-5.0),
        Residual(run="yaw_00", kind="pure_yaw", force="N", value=1.0),
        Residual(run="yaw_00", kind="pure_yaw", force="Y", value=float("nan")),
    ]
    specification = chart_specification(residual_chart(residuals))
    assert len(specification["vconcat"]) == 2
    for panel in specification["vconcat"]:
        (points,) = layers_of(panel, "point")
        low, high = points["encoding"]["y"]["scale"]["domain"]
        assert low == -high and high > 5
        assert points["encoding"]["x"]["scale"]["domain"] == ["sway_00", "yaw_00"]
    points = layers_of(specification["vconcat"][0], "point")[0]
    assert [(row["run"], row["name"], row["v"]) for row in rows(specification, points)] == [
        ("pure_sway", "sway_00", -5.0), ("pure_yaw", "yaw_00", None)]  # fmt: skip


def test_every_captive_chart_can_be_drawn():
    series = drift_series(half_width=[1, 1, 1], fit_x=[-0.1, 0.1], fit_value=[-9, 9], fit_half_width=[1, 1])
    other = ForceSeries(label="rudder", x=[0.0, 0.1], value=[0.0, 1.0])
    loop = ForceLoop(label="run", motion=[0, 1], forces={"Y": [0, 1]}, fitted_motion=[0, 1], fitted={"Y": [0, 1]})
    charts = [
        against_drift(series, other, title="Static"),
        loops_of(loop, "v", "1", {"Y": "Y (N)"}),
        harmonics_of(Harmonics(run="a", amplitude=[1, 2])),
        residual_chart([Residual(run="a", kind="b", force="Y", value=1.0)], title="Residuals"),
    ]
    for chart in charts:
        assert chart_png(chart, scale=1.0).startswith(b"\x89PNG")
        assert chart_specification(chart) == chart_specification(chart)


@pytest.fixture(scope="module")
def yaw(tmp_path_factory: pytest.TempPathFactory) -> CaptiveRunResult:
    path = write(Campaign(seed=3, size="linear", rate_hz=5.0), tmp_path_factory.mktemp("campaign")).path
    return t2s.reduce_runs(path.parent / "yaw_00.csv", campaign=path)


def test_tables_hold_coefficients_and_derivatives(yaw: CaptiveRunResult) -> None:
    derivatives, forces, every = yaw.tables
    (run,) = yaw.runs
    assert {row[1]: row[2] for row in derivatives.rows} == {
        name: 1e5 * value for name, value in run.derivatives.values.items()
    }
    first = next(row for row in forces.rows if row[1:3] == ["Y (N)", 1])
    found = run.coefficient("Y_water", 1)
    assert first[3] == f"{found.cosine:.5g} ± {found.cosine_error:.2g}"
    row = next(row for row in every.rows if (row[0], row[2]) == ("Y_water", 1))
    assert row[7] == pytest.approx(math.hypot(found.cosine, found.sine))
    assert yaw.key_figures[0].value == 1e5 * run.derivatives.values[yaw.key_figures[0].label.partition(",")[0]]


def test_charts_hold_the_cycle_and_the_residual(yaw: CaptiveRunResult) -> None:
    charts = yaw._charts()
    assert list(charts) == ["cycle", "forces_1", "residual_1"]
    (run,) = yaw.runs
    means = [row["v"] for row in whole_panel(charts["cycle"], 1) if "low" in row]
    assert means[: len(run.cycles["Y"].mean)] == pytest.approx(run.cycles["Y"].mean, rel=1e-4)
    residual = panels(charts["residual_1"])["Y (N)"]
    assert {row["v"] for row in residual} <= {float(f"{value:.6g}") for value in run.history["Y_residual_N"]}
    assert line(charts["forces_1"], "v", "fit")


def test_repeats_that_differ_are_marked(tmp_path) -> None:
    files = [oscillation(tmp_path, "a.csv"), oscillation(tmp_path, "b.csv"), oscillation(tmp_path, "c.csv", change=0.5)]
    found = t2s.reduce_runs(files, type="pure_yaw")
    (repeats,) = (each for each in found.tables if each.caption == "3 runs compared")
    marked = {tuple(row[:3]) for row in repeats.rows if row[-1] is Verdict.CAUTION}
    assert ("Y", "cos", 1) in marked
    assert marked == {(row.signal, row.part, row.order) for row in found.repeats if row.chance < 0.01}
    assert f"in {len(marked)} of 33 coefficients" in found.headline[0]
    again = CaptiveRunResult.read(found.to_dict(), "r.json")
    assert again.to_dict() == found.to_dict() and again.page() == found.page()


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
