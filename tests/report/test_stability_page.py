"""The page of a stability study: what its charts draw."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from tank2sim.analysis.stability.study import StabilityStudy, stability_study
from tank2sim.analysis.turning.spirals import SpiralPoints
from tank2sim.answer.charts.picture import chart_specification
from tank2sim.answer.page import render_page
from tank2sim.cards import read_card
from tank2sim.dynamics import build
from tank2sim.files import plain_json
from tank2sim.report.stability.charts import (
    DIRECT,
    STABLE,
    UNSTABLE,
    criteria_chart,
    influence_chart,
    steering_diagram,
    trim_chart,
)
from tank2sim.report.stability.page import stability_page


@pytest.fixture(scope="module")
def study() -> StabilityStudy:
    return stability_study(build(read_card("esso-osaka-estimated")), spirals=False)


def rows(specification, layer):
    return specification["datasets"][layer["data"]["name"]]


def test_the_page_holds_every_part(study) -> None:
    page = stability_page(plain_json({**study.as_json(), "notices": ["a notice"]}))
    headings = [section.heading for section in page.sections]
    assert headings == [
        "IMO criteria",
        "Steady turning",
        "Straight-line stability",
        "What moves the margin",
        "Response to the rudder",
        "Nonlinear steering characteristic",
        "Notices",
    ]
    assert any(figure.label == "Hysteresis loop" for figure in page.figures)
    assert "Esso Osaka" in render_page(page)


def test_the_branches_of_the_diagram_meet_in_the_folds(study) -> None:
    specification = chart_specification(steering_diagram(plain_json(study.turning.as_json()), {}))
    drawn = rows(specification, specification["vconcat"][0]["layer"][0])
    parts = [[row for row in drawn if row["part"] == part] for part in range(3)]
    assert [part[0]["run"] for part in parts] == [STABLE, UNSTABLE, STABLE]
    assert all(before[-1]["d"] == after[0]["d"] for before, after in itertools.pairwise(parts))
    folds = np.degrees([fold.rudder_rad for fold in study.turning.folds])
    assert [parts[1][0]["d"], parts[1][-1]["d"]] == pytest.approx(folds, rel=1e-5)


def test_spirals_are_points_in_the_panel_of_the_yaw_rate_alone(study) -> None:
    nothing = np.zeros(1)
    points = SpiralPoints(np.radians([10.0]), np.radians([1.5]), np.ones(1, dtype=bool), nothing)
    specification = chart_specification(
        steering_diagram(plain_json(study.turning.as_json()), {"direct": points.as_json()})
    )
    panels = specification["vconcat"]
    (drawn,) = rows(specification, panels[0]["layer"][-1])
    assert (drawn["run"], drawn["d"], drawn["v"]) == (DIRECT, 10, 1.5)
    assert len(panels[0]["layer"]) == len(panels[1]["layer"]) + 1


def test_influences_and_trims_are_drawn_as_they_were_found(study) -> None:
    specification = chart_specification(influence_chart(study.margin.as_json()))
    bars = rows(specification, specification["layer"][0])
    assert bars[0]["name"] == study.margin.influences[0].short_name
    assert bars[0]["y"] == pytest.approx(study.margin.influences[0].percent, rel=1e-5)
    lines = {
        row["run"]
        for data in chart_specification(trim_chart(study.trim.as_json()))["datasets"].values()
        for row in data
        if "run" in row
    }
    assert len(lines) == 3


def test_bars_of_the_criteria_are_shares_of_their_limits(study) -> None:
    criteria = [
        {"name": "advance", "found": 3.0, "allowed": 4.5, "unit": "L", "beyond_card": False},
        {"name": "tactical diameter", "found": 6.0, "allowed": 5.0, "unit": "L", "beyond_card": True},
        {"name": "stopping", "found": None, "allowed": 15.0, "unit": "L", "beyond_card": False},
    ]
    specification = chart_specification(criteria_chart(criteria))
    (rows,) = (rows for rows in specification["datasets"].values() if "name" in rows[0])
    assert [(row["percent"], row["beyond"]) for row in rows] == [
        (pytest.approx(100 * 3.0 / 4.5), False),
        (pytest.approx(120.0), True),
    ]
