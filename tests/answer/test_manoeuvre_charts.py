"""Figures are drawn on a manoeuvre where its motion has them."""

from dataclasses import replace

import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.answer.charts.manoeuvre import (
    hull_rows,
    motion_of,
    overshoot_marks,
    pull_out_chart,
    pull_out_time,
    stop_speed_chart,
    turn_chart,
    turn_dimensions,
    zigzag_chart,
)
from tank2sim.answer.charts.motion import spiral_chart
from tank2sim.answer.charts.picture import chart_specification
from tank2sim.answer.parts import Verdict
from tank2sim.notices import caution
from tank2sim.results.manoeuvre import ManoeuvreResult
from tank2sim.simulation.bands import Band
from tests.answer.drawn import rows

RADIUS, LENGTH, BEAM = 300.0, 100.0, 15.0
QUARTER = 90.0


def columns(t, x, y, psi, **others):
    nothing = np.zeros_like(t)
    return {
        "t_s": t,
        "x_m": x,
        "y_m": y,
        "psi_deg": psi,
        "r_degps": nothing,
        "u_mps": nothing,
        "v_mps": nothing,
    } | others


def circle(side=1.0, course=0.0):
    """A turn on a circle at one degree a second, from a course in deg."""
    time = np.linspace(0.0, 400.0, 801)
    angle, turned = np.radians(time), np.radians(course)
    ahead, starboard = RADIUS * np.sin(angle), side * RADIUS * (1 - np.cos(angle))
    north = ahead * np.cos(turned) - starboard * np.sin(turned)
    east = ahead * np.sin(turned) + starboard * np.cos(turned)
    return motion_of(columns(time, 50.0 + north, east - 20.0, course + side * time), LENGTH, BEAM)


FIGURES = {"advance_m": RADIUS, "transfer_m": RADIUS, "tactical_diameter_m": 2 * RADIUS, "time_180_s": 180.0}


def in_style(specification, style):
    layers = [layer for layer in specification["layer"] if layer["mark"].get("style") == style]
    return [row for layer in layers for row in rows(specification, layer)]


@pytest.mark.parametrize("side", [1.0, -1.0], ids=["starboard", "port"])
@pytest.mark.parametrize("course", [0.0, 130.0])
def test_advance_transfer_and_tactical_diameter_end_on_the_track(side, course):
    motion = circle(side, course)
    ends = {dimension.text.partition(" ")[0]: dimension.end for dimension in turn_dimensions(motion, FIGURES, {})}
    assert ends["advance"] == pytest.approx(motion.place(QUARTER), abs=0.1)
    assert ends["transfer"] == pytest.approx((side * RADIUS, RADIUS), abs=0.1)
    assert ends["tactical"] == pytest.approx((2 * side * RADIUS, 0.0), abs=0.1)


def test_the_marked_advance_is_that_of_a_simulated_track():
    found = t2s.load("mariner").turn(35)
    at = np.interp(QUARTER, found.df["psi_deg"], found.df["t_s"])
    advance, transfer = (np.interp(at, found.df["t_s"], found.df[name]) for name in ("x_m", "y_m"))
    specification = chart_specification(found.plot())
    (mark,) = [row for row in in_style(specification, "dimension") if row["text"].startswith("advance")]
    assert (mark["y2"], mark["x2"]) == pytest.approx((transfer, advance), rel=1e-3)
    assert specification["usermeta"] == {"equal_scales": True}


def test_the_bars_of_an_ensemble_are_the_quantiles_of_its_table():
    bands = {"advance_m": Band(280.0, 300.0, 330.0, 15.0, 20)}
    specification = chart_specification(turn_chart(circle(), FIGURES, bands=bands))
    (bar,) = in_style(specification, "interval")
    assert (bar["x"], bar["x2"], bar["y"]) == (280.0, 330.0, RADIUS)


def test_outlines_of_the_ship_have_its_size_lie_on_the_track_and_head_along_it():
    motion = circle(course=40.0).until(360.0)
    step, corners = hull_rows(motion)
    numbers = {row["hull"] for row in corners}
    assert 2 < len(numbers) <= 15
    for number in numbers:
        points = np.array([[row["y"], row["x"]] for row in corners if row["hull"] == number])
        bow, stern = points[0], points[2:4].mean(axis=0)
        time = number * step
        assert (bow + stern) / 2 == pytest.approx(motion.place(time), abs=1e-3)
        heading = np.radians(time)
        assert bow - stern == pytest.approx(LENGTH * np.array([np.sin(heading), np.cos(heading)]), abs=1e-3)
        across = points[1] - points[4]  # starboard less port shoulder
        assert across == pytest.approx(BEAM * np.array([np.cos(heading), -np.sin(heading)]), abs=1e-3)
    assert hull_rows(motion_of(columns(*[np.arange(3.0)] * 4)))[1] == []


@pytest.mark.parametrize("side", [1.0, -1.0], ids=["starboard", "port"])
def test_overshoots_reach_from_the_heading_of_the_order_to_the_peak(side):
    time = np.linspace(0.0, 200.0, 2001)
    psi = side * 17.0 * np.sin(2 * np.pi * time / 100.0)  # peaks of 17 deg at 25, 75, 125 s
    motion = motion_of(columns(time, time, 0 * time, psi))
    figures = {"overshoots_deg": [7.0, 7.0], "execute_times_s": [10.0, 60.0], "overshoot_times_s": [15.0, 15.0]}
    bands = {"overshoot_2_deg": Band(6.0, 7.0, 9.0, 1.0, 20)}
    first, second = overshoot_marks(motion, figures, 10.0, bands)
    assert (first["x"], first["from"], first["v"]) == pytest.approx((25.0, side * 10.0, side * 17.0))
    assert (second["x"], second["from"], second["v"]) == pytest.approx((75.0, -side * 10.0, -side * 17.0))
    assert (second["low"], second["high"]) == (-side * 16.0, -side * 19.0) and "low" not in first
    drawn = in_style(chart_specification(zigzag_chart(motion, figures, 10.0)), "overshoot")
    assert [row["v"] for row in drawn] == pytest.approx([max(side * psi) * side, -max(side * psi) * side], rel=1e-4)


def test_both_pull_outs_begin_at_their_order_and_show_the_neutral_rudder():
    time = np.linspace(0.0, 100.0, 201)
    rates, rudder = np.where(time < 40.0, 0.8, 0.8 * np.exp(-(time - 40.0) / 10.0)), np.where(time <= 40.0, 20.0, -1.5)
    motion = motion_of(columns(time, time, 0 * time, time, r_degps=rates, delta_deg=rudder))
    assert pull_out_time(motion, -1.5) == 40.0
    specification = chart_specification(pull_out_chart({"from a turn to starboard": motion}, -1.5))
    drawn = {row["x"]: row["v"] for row in rows(specification, specification["layer"][2])}
    assert drawn[0.0] == 0.8 and drawn[10.0] == pytest.approx(0.8 / np.e, rel=1e-4)
    assert "−1.5°" in specification["layer"][2]["encoding"]["x"]["title"]


def test_a_pull_out_is_simulated_to_both_sides():
    found = t2s.load("mariner").pullout(20)
    assert found.figures["steady_rate_degps"] > 0 > found.other_side.figures["steady_rate_degps"]
    (chart, *_) = found.charts().values()
    specification = chart_specification(chart)
    assert {row["run"] for row in rows(specification, specification["layer"][2])} == {
        "from a turn to starboard",
        "from a turn to port",
    }
    assert "is stable" in found.headline[0]
    apart = {
        side: {**figures, "residual_rate_degps": 0.5 * figures["steady_rate_degps"]}
        for side, figures in (("own", found.study.figures), ("other", found.other_side.figures))
    }
    other = replace(found.other_side, figures=apart["other"])
    unstable = ManoeuvreResult(replace(found.study, figures=apart["own"], other_side=other))
    assert "stay apart" in unstable.headline[0]


def test_a_stop_shows_speed_and_revolutions_over_the_distance_along_the_track():
    time = np.linspace(0.0, 10.0, 101)
    way = 5.0 * time - 0.25 * time**2  # 5 m/s, slowing by 0.5 m/s²
    motion = motion_of(columns(time, 0.6 * way, 0.8 * way, 0 * time, u_mps=5.0 - 0.5 * time, n_rpm=60.0 - 12.0 * time))
    drawn = chart_specification(stop_speed_chart(motion))
    speed, revolutions = (rows(drawn, panel["layer"][0])[-1] for panel in drawn["vconcat"])
    assert (speed["x"], speed["v"]) == pytest.approx((25.0, 0.0), abs=1e-6)
    assert revolutions["v"] == -60.0


def test_the_loop_of_a_spiral_is_marked_between_its_rudders_of_no_yaw_rate():
    chart = spiral_chart([10.0, 0.0, -10.0, 0.0, 10.0], [0.5, 0.2, -0.5, -0.2, 0.5], loop_deg=(-2.0, 2.5))
    specification = chart_specification(chart)
    (mark,) = in_style(specification, "overshoot")
    assert (mark["x"], mark["to"], mark["v"]) == (-2.0, 2.5, 0.0)


def test_limits_are_those_of_the_trials_of_the_standard():
    mariner = t2s.load("mariner-nominal")
    assert mariner.turn(35, duration_s=10).limits == {"advance_lengths": 4.5, "tactical_diameter_lengths": 5.0}
    assert mariner.turn(30, duration_s=10).limits == {}
    time = 160.93 / 7.7175  # L/V, between 10 and 30 s: 5 + V/2 deg
    limits = mariner.zigzag(-10, 10, duration_s=10).limits
    assert limits["overshoot_1_deg"] == pytest.approx(5 + time / 2, rel=1e-3)
    assert "overshoot_1_deg" not in t2s.load("kvlcc2-l7").zigzag(10, 10, duration_s=10).limits


def test_a_figure_outside_the_range_of_the_card_has_no_claim_of_a_limit_met():
    found = t2s.load("mariner-nominal").turn(35)
    first = found.key_figures[0]
    assert (first.verdict, first.limit) == (Verdict.PASSED, pytest.approx(4.5 * 160.93))
    outside = ManoeuvreResult(replace(found.study, outside_card_range=("advance_m",)))
    assert outside.key_figures[0].verdict == Verdict.CAUTION
    figures = outside.tables[0].df
    assert figures["range of the card"].to_list()[0] == "outside"


def test_the_caution_of_a_stop_beyond_the_card_is_on_its_page():
    found = t2s.load("mariner-nominal").turn(35, duration_s=10)
    beyond = caution("the stop leaves the card")
    page = ManoeuvreResult(replace(found.study, notices=(beyond,))).page()
    assert beyond.line in page.partition("<main")[0]
