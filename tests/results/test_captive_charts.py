import numpy as np
import pytest

from tank2sim.answer.charts.picture import chart_png, chart_specification
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
