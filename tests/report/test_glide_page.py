"""The page of a glider and its charts."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tank2sim.analysis.glide.study import GlideQuestion, study
from tank2sim.answer.charts.picture import chart_specification
from tank2sim.bundled import bundled
from tank2sim.cards import read_card
from tank2sim.files import plain_json
from tank2sim.report.glide.charts import SpacePath, elevation_chart, isometric_chart, plan_chart, polar_chart
from tank2sim.report.glide.page import glide_page
from tank2sim.simulation.glide_programme import read_programme

PROBE = read_card("kulikovsky-velikanov")


@pytest.fixture(scope="module")
def found():
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
    return study(PROBE, asked)


def lines(chart, layer=0):
    specification = chart_specification(chart)
    # Altair lifts the data of a chart with one layer.
    source = specification["layer"][layer].get("data") or specification["data"]
    return specification["datasets"][source["name"]]


@pytest.mark.slow
def test_the_page_has_the_figures_and_every_chart(found) -> None:
    page = glide_page(plain_json(found.as_json()))
    assert page.figures[0].value == pytest.approx(23.385, abs=5e-4)
    charts = [one for section in page.sections for one in section.charts]
    assert len(charts) == 7
    titles = [chart_specification(one.chart)["title"] for one in charts]
    assert titles[0] == "Glide polar" and titles[-1] == "Error of the quasi-steady path, steps"
    assert "12.8 kg" in page.sections[-1].notes[0]


def test_the_error_sweep_is_in_the_json_of_a_study_with_views(found) -> None:
    errors = found.as_json()["quasi_steady_error"]
    assert [one["duration_s"][0] for one in errors["steps"]] == [10, 10, 10]
    assert len(errors["swings"]) == 3


def test_a_climb_to_the_east_is_drawn_where_it_goes() -> None:
    path = SpacePath(label="p", north_m=[0, 0], east_m=[0, 40], height_m=[0, 30])
    (_, plan), (_, side) = lines(plan_chart([path])), lines(elevation_chart([path]))
    assert (plan["a"], plan["b"]) == (40, 0) and (side["a"], side["b"]) == (40, 30)
    rows = lines(isometric_chart(path, path))
    assert (rows[1]["a"], rows[1]["b"]) == pytest.approx((40 * math.cos(math.pi / 6), -20 + 30), rel=1e-5)
    shadow = rows[3]
    assert shadow["b"] == pytest.approx(-20)


def test_the_polar_marks_the_glides_it_is_given(found) -> None:
    reported = found.as_json()
    chart = polar_chart(reported["polar"], {"best": reported["design"]["best_glide"]})
    marked = lines(chart, 2)
    assert math.degrees(math.atan2(marked[0]["y"], marked[0]["x"])) == pytest.approx(23.385, abs=1e-3)
    speeds = np.array([row["x"] for row in lines(chart)])
    assert speeds.max() == pytest.approx(found.fastest.horizontal_speed_mps, rel=1e-3)
