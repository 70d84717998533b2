"""The result of a stability study: its charts and tables hold the numbers of the study."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tank2sim.analysis.stability.imo import ImoCriterion
from tank2sim.analysis.stability.study import Spirals, StabilityStudy, stability_study
from tank2sim.analysis.turning.spirals import SpiralPoints
from tank2sim.answer.charts.picture import chart_specification
from tank2sim.answer.parts import Verdict
from tank2sim.cards import read_card
from tank2sim.dynamics import build
from tank2sim.results.imo import BEYOND_THE_CARD, imo_section
from tank2sim.results.stability import StabilityResult
from tank2sim.results.stability_charts import DIRECT, STABLE, UNSTABLE, steering_diagram
from tests.answer.drawn import rows, rows_of


@pytest.fixture(scope="module")
def study() -> StabilityStudy:
    return stability_study(build(read_card("esso-osaka-estimated")), spirals=False)


def test_a_ship_with_a_loop_has_it_among_its_figures(study: StabilityStudy) -> None:
    result = StabilityResult(study)
    assert len(result.sections) == 6
    assert any(figure.label == "Hysteresis loop" for figure in result.key_figures)


def test_the_branches_of_the_diagram_meet_in_the_folds(study: StabilityStudy) -> None:
    assert study.steady_turning is not None
    specification = chart_specification(steering_diagram(study.steady_turning, Spirals()))
    shown = rows(specification, specification["vconcat"][0]["layer"][1])
    gap = next(place for place, row in enumerate(shown) if row["v"] is None)
    first, last = shown[:gap], [row for row in shown[gap + 1 :] if row["run"] == STABLE]
    middle = [row for row in shown if row["run"] == UNSTABLE]
    assert {row["run"] for row in first} == {STABLE}
    assert (first[-1]["x"], last[0]["x"]) == (middle[0]["x"], middle[-1]["x"])
    folds = [fold.rudder_deg for fold in study.steady_turning.folds]
    assert [middle[0]["x"], middle[-1]["x"]] == pytest.approx(folds, rel=1e-5)


def test_spirals_are_points_in_the_panel_of_the_yaw_rate_alone(study: StabilityStudy) -> None:
    assert study.steady_turning is not None
    points = SpiralPoints(np.array([10.0]), np.array([1.5]), (True,), np.zeros(1))
    specification = chart_specification(steering_diagram(study.steady_turning, Spirals(direct=points)))
    panels = specification["vconcat"]
    (point,) = rows(specification, panels[0]["layer"][2])
    assert (point["run"], point["x"], point["v"]) == (DIRECT, 10, 1.5)
    assert len(panels[0]["layer"]) == len(panels[1]["layer"]) + 1


def test_influences_and_trims_are_drawn_as_they_were_found(study: StabilityStudy) -> None:
    charts = StabilityResult(study)._charts()
    bars = [row for row in rows_of(charts["influence_on_c"]) if "name" in row]
    strongest = study.margins.derivatives[0]
    assert bars[0]["name"] == strongest.short_name and bars[0]["v"] == pytest.approx(strongest.percent, rel=1e-5)
    assert len({row["run"] for row in rows_of(charts["trim_estimate"]) if "run" in row}) == 3


def test_criteria_are_shares_of_their_limits_and_have_no_verdict_beyond_the_card() -> None:
    section = imo_section(
        [
            ImoCriterion.judged("advance", 3.0, 4.5, "L"),
            ImoCriterion.judged("tactical diameter", 6.0, 5.0, "L", "leaves the range", beyond_card=True),
            ImoCriterion.judged("overshoot", 26.0, 25.0, "deg"),
            ImoCriterion.judged("stopping", None, 15.0, "L", "no engine"),
        ]
    )
    bars = [row for row in rows_of(section.charts[0].chart) if "name" in row]
    assert [(row["v"], row["beyond"]) for row in bars] == [
        (pytest.approx(100 * 3.0 / 4.5, rel=1e-5), False),
        (pytest.approx(120.0), True),
        (pytest.approx(104.0), False),
    ]
    criteria = section.tables[0].df
    assert criteria["verdict"].to_list() == [Verdict.PASSED, BEYOND_THE_CARD, Verdict.FAILED, "open"]
    margins = criteria["margin (%)"].to_list()
    assert margins[0] == pytest.approx(100 / 3) and np.isnan(margins[1]) and margins[2] == pytest.approx(-4)
    assert section.tables[0].notes == ("tactical diameter: leaves the range", "stopping: no engine")


def test_the_headline_tells_the_criteria_that_are_not_met(study: StabilityStudy) -> None:
    criteria = (ImoCriterion.judged("advance", 5.0, 4.5, "L"), ImoCriterion.judged("stopping", 9.0, 15.0, "L"))
    result = StabilityResult(replace(study, imo=criteria))
    assert any(line.endswith(": advance.") for line in result.headline)
    assert result.imo["met"].to_list() == [False, True]
    met = StabilityResult(replace(study, imo=criteria[1:]))
    assert any("All criteria" in line for line in met.headline)
