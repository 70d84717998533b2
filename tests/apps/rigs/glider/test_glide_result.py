"""Result of glides: tables and charts hold the numbers of the study."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
import pytest

from tank2sim.apps.rigs.glider import study
from tank2sim.apps.rigs.glider.path import read_programme
from tank2sim.apps.rigs.glider.result import GlideResult, elevation_chart, isometric_chart, plan_chart, polar_chart
from tank2sim.apps.rigs.glider.study import GlideQuestion
from tank2sim.apps.rigs.glider.transient import swing_errors
from tank2sim.bundled import bundled
from tank2sim.cards import read_card
from tests.answer.drawn import line, rows_of_layer

PROBE = read_card("kulikovsky-velikanov")


@pytest.fixture(scope="module")
def result():
    programme = read_programme(bundled("models", "kulikovsky-velikanov", "programme.csv"))
    asked = GlideQuestion(
        angles_rad=(math.radians(-30),),
        roll_rad=0.1,
        programme=programme,
        as_printed=True,
        budget_kg=50.0,
        depth_m=200.0,
        views=True,
    )
    with pytest.MonkeyPatch.context() as patch:  # the long swings take most of the time
        patch.setattr(study, "swing_errors", partial(swing_errors, periods_s=(20.0, 50.0, 100.0)))
        return GlideResult(study.study_glider(PROBE, asked))


def test_tables_hold_the_glides_the_path_and_the_ranges(result) -> None:
    study = result.study
    design, ranges, glides, printed, path, printed_path = (each.df for each in result.tables)
    assert design["speed (m/s)"].to_list() == [study.design.best_glide.speed_mps, study.design.fastest_glide.speed_mps]
    assert ranges["range (km)"].to_list() == pytest.approx([each.range_m / 1000 for each in study.design.ranges])
    (state,) = study.states
    assert glides.iloc[0].to_dict() == {
        "path angle (deg)": pytest.approx(-30),
        "α (deg)": state.incidence_deg,
        "pitch (deg)": state.pitch_deg,
        "speed (m/s)": state.speed_mps,
        "C_L": state.lift_coefficient,
        "C_D": state.drag_coefficient,
        "turning radius (m)": state.turning_radius_m,
        "radius with added mass (m)": state.turning_radius_with_added_mass_m,
    }
    assert state.turning_radius_with_added_mass_m > state.turning_radius_m
    assert printed["speed over that above"][0] == study.as_printed[0].speed_mps / state.speed_mps
    assert path["height (m)"].to_list() == [place.height_m for place in study.path]
    assert len(printed_path) == len(study.path_as_printed) == len(study.steps) + 1


def test_the_error_sweep_is_in_a_study_with_views(result) -> None:
    errors = result.study.quasi_steady_error
    assert [one.duration_s[0] for one in errors.steps] == [10, 10, 10]
    assert len(errors.swings) == 3


def test_a_climb_to_the_east_is_drawn_where_it_goes() -> None:
    path = {"x_m": np.zeros(2), "y_m": np.array([0.0, 40.0]), "height_m": np.array([0.0, 30.0])}
    corners = [study.PathPlace(t_s=t, x_m=0.0, y_m=40 * t, height_m=30 * t, heading_deg=90.0) for t in (0.0, 1.0)]
    (_, plan), (_, side) = rows_of_layer(plan_chart({"p": path})), rows_of_layer(elevation_chart({"p": path}))
    assert (plan["x"], plan["v"]) == (40, 0) and (side["x"], side["v"]) == (40, 30)
    rows = rows_of_layer(isometric_chart("p", path, corners))
    assert (rows[1]["x"], rows[1]["v"]) == pytest.approx((40 * math.cos(math.pi / 6), -20 + 30), rel=1e-5)
    shadow = rows[3]
    assert shadow["v"] == pytest.approx(-20)


def test_the_polar_marks_the_glides_it_is_given(result) -> None:
    study = result.study
    chart = polar_chart(study.polar, {"best": study.design.best_glide})
    marked = rows_of_layer(chart, 1)
    assert math.degrees(math.atan2(marked[0]["v"], marked[0]["x"])) == pytest.approx(23.385, abs=1e-3)
    speeds = np.array([row["x"] for row in rows_of_layer(chart)])
    assert speeds.max() == pytest.approx(study.design.fastest_glide.horizontal_speed_mps, rel=1e-3)
    assert line(chart, "v", "polar") == pytest.approx(-study.polar["climb_mps"], rel=1e-5)
