import numpy as np
import pytest

from tank2sim.answer.charts.curves import Plot, PlotSeries, curve_chart
from tank2sim.answer.charts.motion import (
    History,
    Signal,
    TrackData,
    history_chart,
    spiral_chart,
    track_chart,
    varying_histories,
)
from tank2sim.answer.charts.picture import chart_specification
from tank2sim.answer.charts.vega import PlotAxis
from tests.answer.drawn import rows

TIME = np.arange(0.0, 600.0, 0.1)
HEADING = Signal("motion.psi", "heading", "rad")


def metres_per_px(specification):
    encoding = specification["layer"][0]["encoding"]
    (low_x, high_x), (low_y, high_y) = (encoding[axis]["scale"]["domain"] for axis in ("x", "y"))
    return (high_x - low_x) / specification["width"], (high_y - low_y) / specification["height"]


@pytest.mark.parametrize(
    ("x", "y"),
    [
        ([0, 500, 0, -500], [0, 500, 1000, 500]),
        ([0, 5000], [0, 10]),
        ([0, 10], [0, 5000]),
        ([0, 0], [0, 900]),
        ([7, 7], [3, 3]),
        ([0, np.nan, 300], [0, np.nan, 20]),
    ],
    ids=["round", "north", "east", "straight east", "one place", "with a gap"],
)
def test_both_axes_of_a_track_have_one_scale_and_show_all_of_it(x, y):
    specification = chart_specification(track_chart([TrackData("run", x_m=x, y_m=y)]))
    across, up = metres_per_px(specification)
    assert across == pytest.approx(up, rel=1e-12)
    encoding = specification["layer"][0]["encoding"]
    for axis, values in (("x", y), ("y", x)):
        low, high = encoding[axis]["scale"]["domain"]
        assert low < np.nanmin(values) and high > np.nanmax(values)
    assert 200 < specification["width"] <= 720 and 200 < specification["height"] <= 540


def test_the_scales_of_a_track_stay_equal_because_both_are_zoomed_together():
    specification = chart_specification(track_chart([TrackData("run", x_m=[0, 1], y_m=[0, 1])]))
    (window,) = specification["params"]
    assert window["bind"] == "scales"
    assert window["select"]["encodings"] == ["x", "y"]
    assert window["views"] == [specification["layer"][0]["name"]]


def test_north_is_up_and_east_is_right():
    specification = chart_specification(track_chart([TrackData("run", x_m=[0, 100], y_m=[0, 7])]))
    line = specification["layer"][0]
    last = rows(specification, line)[-1]
    assert last[line["encoding"]["y"]["field"]] == 100
    assert last[line["encoding"]["x"]["field"]] == 7
    assert line["encoding"]["y"]["title"] == "north x (m)"
    assert line["encoding"]["x"]["title"] == "east y (m)"
    assert "sort" not in line["encoding"]["y"]


def test_a_track_is_drawn_in_the_order_of_time():
    specification = chart_specification(track_chart([TrackData("run", x_m=[0, 5, 1], y_m=[0, 9, 2])]))
    line = specification["layer"][0]
    order = line["encoding"]["order"]["field"]
    assert [row["y"] for row in sorted(rows(specification, line), key=lambda row: row[order])] == [0, 9, 2]


def test_measured_tracks_are_points_and_simulated_ones_lines():
    tracks = [
        TrackData("model", x_m=[0, 1], y_m=[0, 1]),
        TrackData("trial", x_m=[0, 2], y_m=[0, 2], measured=True),
    ]
    specification = chart_specification(track_chart(tracks))
    marks = {
        layer["mark"]["type"]: {row["run"] for row in rows(specification, layer)}
        for layer in specification["layer"][:2]
    }
    assert marks == {"line": {"model"}, "point": {"trial"}}


def test_a_long_track_is_embedded_short_and_keeps_its_advance():
    angle = 0.01 * TIME
    x = 300 * np.sin(angle)
    x[1234] = 333.0
    specification = chart_specification(track_chart([TrackData("run", x_m=x, y_m=300 - 300 * np.cos(angle))]))
    kept = rows(specification, specification["layer"][0])
    assert len(kept) <= 602
    assert max(row["x"] for row in kept) == 333.0


def test_angles_are_shown_in_degrees():
    signals = [HEADING, Signal("motion.r", "yaw rate", "rad/s")]
    run = History("run", time_s=[0, 1], values={"motion.psi": [0, np.pi / 2], "motion.r": [0, -np.pi / 180]})
    specification = chart_specification(history_chart([run], signals))
    heading, rate = (panel["layer"][0] for panel in specification["vconcat"])
    assert heading["encoding"]["y"]["title"] == "heading (deg)"
    assert rows(specification, heading)[-1]["v"] == 90.0
    assert rate["encoding"]["y"]["title"] == "yaw rate (deg/s)"
    assert rows(specification, rate)[-1]["v"] == -1.0


def test_other_units_are_shown_as_they_are_or_as_asked():
    signals = [
        Signal("motion.u", "surge speed", "m/s"),
        Signal("propeller.speed", "revolutions", "rad/s", display_unit="rpm"),
        Signal("validity", "validity", "1"),
    ]
    values = {"motion.u": [7.5], "propeller.speed": [84 * 2 * np.pi / 60], "validity": [1.0]}
    specification = chart_specification(history_chart([History("run", time_s=[0], values=values)], signals))
    layers = [panel["layer"][0] for panel in specification["vconcat"]]
    titles = [layer["encoding"]["y"]["title"] for layer in layers]
    assert titles == ["surge speed (m/s)", "revolutions (rpm)", "validity"]
    assert [rows(specification, layer)[0]["v"] for layer in layers] == [7.5, 84.0, 1.0]


def test_time_histories_share_one_axis_and_one_window_of_time():
    signals = [HEADING, Signal("motion.u", "speed", "m/s")]
    runs = [
        History("a", time_s=TIME, values={"motion.psi": TIME, "motion.u": TIME}),
        History("b", time_s=[0, 900], values={"motion.psi": [0, 1]}),
    ]
    specification = chart_specification(history_chart(runs, signals))
    domains = [panel["layer"][0]["encoding"]["x"]["scale"]["domain"] for panel in specification["vconcat"]]
    assert domains == [[0, 900], [0, 900]]
    assert specification["resolve"]["scale"]["x"] == "shared"
    assert specification["params"][0]["select"]["encodings"] == ["x"]
    assert specification["params"][0]["views"] == [panel["layer"][0]["name"] for panel in specification["vconcat"]]


def test_a_run_without_a_signal_is_left_out_of_its_panel_alone():
    signals = [HEADING, Signal("motion.u", "speed", "m/s")]
    full = History("full", time_s=[0, 1], values={"motion.psi": [0, 1], "motion.u": [1, 1]})
    part = History("part", time_s=[0, 1], values={"motion.psi": [0, 1]})
    specification = chart_specification(history_chart([full, part], signals))
    labels = [{row["run"] for row in rows(specification, panel["layer"][0])} for panel in specification["vconcat"]]
    assert labels == [{"full", "part"}, {"full"}]


def test_a_signal_that_no_run_has_is_refused():
    with pytest.raises(ValueError, match=r"no run has the signal motion\.psi"):
        history_chart([History("run", time_s=[0], values={})], [HEADING])


def test_two_runs_of_one_name_are_refused():
    track = TrackData("run", x_m=[0, 1], y_m=[0, 1])
    with pytest.raises(ValueError, match="one label"):
        track_chart([track, track])


def test_a_gap_in_a_history_is_embedded_as_null():
    run = History("run", time_s=[0, 1, 2], values={"motion.psi": [0, np.nan, 1]})
    specification = chart_specification(history_chart([run], [HEADING]))
    assert rows(specification, specification["vconcat"][0]["layer"][0])[1]["v"] is None


def test_series_differ_in_dashes_as_well_as_in_colour():
    tracks = [TrackData(f"run {n}", x_m=[0, n], y_m=[0, 1]) for n in range(35)]
    encoding = chart_specification(track_chart(tracks))["layer"][0]["encoding"]
    dashes = encoding["strokeDash"]["scale"]["range"]
    looks = {(place % 7, tuple(dash)) for place, dash in enumerate(dashes)}
    assert len(looks) == 35
    assert encoding["color"]["scale"]["domain"] == [track.label for track in tracks]


def test_a_tow_shows_what_was_measured_as_points_and_the_model_as_a_line():
    model = PlotSeries("tow 1", x=TIME, y=np.tanh(TIME / 9))
    measured = PlotSeries("tow 1", x=[0, 5], y=[0, 0.5], points=True)
    plot = Plot([model, measured], up=PlotAxis("speed (m/s)"))
    specification = chart_specification(curve_chart(plot, PlotAxis("time (s)")))
    line, points, _ = specification["layer"]
    assert (line["mark"]["type"], points["mark"]["type"]) == ("line", "point")
    assert [(row["x"], row["v"]) for row in rows(specification, points)] == [(0, 0), (5, 0.5)]
    assert line["encoding"]["order"]["field"] == "i"
    drawn = [row["x"] for row in sorted(rows(specification, line), key=lambda row: row["i"])]
    assert drawn == sorted(drawn) and drawn[-1] == pytest.approx(TIME[-1])
    assert rows(specification, line)[-1]["v"] == pytest.approx(1.0, abs=1e-6)
    assert "(s)" in line["encoding"]["x"]["title"] and "(m/s)" in line["encoding"]["y"]["title"]


def test_a_spiral_is_joined_in_its_order_and_shown_in_degrees():
    specification = chart_specification(spiral_chart([20, 0, -20, 0, 20], [0.5, 0.2, -0.5, -0.2, 0.5]))
    line = next(layer for layer in specification["layer"] if layer["mark"]["type"] == "line")
    drawn = sorted(rows(specification, line), key=lambda row: row[line["encoding"]["order"]["field"]])
    assert [row[line["encoding"]["x"]["field"]] for row in drawn] == pytest.approx([20, 0, -20, 0, 20])
    assert [row[line["encoding"]["y"]["field"]] for row in drawn] == pytest.approx([0.5, 0.2, -0.5, -0.2, 0.5])


def test_revolutions_that_stay_the_same_are_said_in_rpm_on_each_side() -> None:
    time = np.arange(3.0)
    columns = {"t_s": time, "n_port_rpm": np.full(3, 740.0), "n_starboard_rpm": np.full(3, 640.0), "u_mps": time}
    drawn = varying_histories(columns, {}, np.zeros(0))
    assert drawn is not None and drawn.caption.endswith("n port 740 rpm, n starboard 640 rpm.")
