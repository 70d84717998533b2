"""Results of autopilots, influence and stability: charts and tables hold the numbers of their studies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tank2sim.analysis.heading.margins import LargestSteps, LoopMargins, LoopResponse
from tank2sim.analysis.heading.runs import CourseChange, CourseKeeping
from tank2sim.analysis.heading.study import AutopilotStudy, ClosedLoop, ShipAlone
from tank2sim.analysis.influence.card_influence import InfluenceStudy, influence
from tank2sim.analysis.influence.figures import parse_figure
from tank2sim.analysis.influence.study import Study
from tank2sim.analysis.stability.imo import ImoCriterion
from tank2sim.analysis.stability.study import Spirals, StabilityStudy, stability_study
from tank2sim.analysis.tuning.result import Means
from tank2sim.analysis.tuning.targets import parse_target
from tank2sim.analysis.tuning.tune import tune
from tank2sim.analysis.turning.spirals import SpiralPoints
from tank2sim.answer.charts.picture import chart_specification
from tank2sim.answer.parts import Table, Verdict
from tank2sim.cards import read_card
from tank2sim.dynamics import build
from tank2sim.errors import InputError
from tank2sim.results.autopilot import AutopilotResult
from tank2sim.results.imo import BEYOND_THE_CARD, imo_section
from tank2sim.results.influence import InfluenceResult, TuningResult
from tank2sim.results.stability import StabilityResult
from tank2sim.results.stability_charts import DIRECT, STABLE, UNSTABLE, steering_diagram
from tests.answer.drawn import line, panels, rows, rows_of

OMEGA = np.logspace(-3, 1, 60)
LOOP = 0.1 / (1j * OMEGA * (1 + 10j * OMEGA))
CHANGE = CourseChange(
    ordered_deg=20.0,
    rise_time_s=60.0,
    overshoot_deg=1.0,
    settling_time_s=200.0,
    largest_rudder_deg=15.0,
    rate_limited_s=3.0,
)
MOTION = {
    "t_s": np.arange(4.0),
    "delta_deg": np.array([0.0, 10.0, 10.0, 10.0]),
    "r_degps": np.array([0.0, 0.1, 0.2, 0.3]),
    "psi_deg": np.array([0.0, 0.05, 0.2, 0.45]),
}
STUDY = AutopilotStudy(
    ship="A ship",
    design="pid",
    source="poles placed",
    gains={"Kp": 1.2},
    limits={"largest_rudder_deg": 35.0},
    ship_alone=ShipAlone(speed_mps=7.7, stable=True, rudder_deg=-1.0, K_per_s=0.2, T_s=100.0),
    margins=(
        LoopMargins(
            speed_mps=7.7,
            gain_margin_up=np.inf,
            gain_margin_down=0.0,
            gain_margin_dB=np.inf,
            phase_margin_deg=60.0,
            delay_margin_s=10.0,
            sensitivity_peak=float(1 / np.abs(1 + LOOP).min()),
            crossover_radps=0.1,
            bandwidth_radps=0.1,
            stable=True,
            poles=(-0.05 + 0.08j, -0.05 - 0.08j),
        ),
    ),
    responses=(LoopResponse(speed_mps=7.7, omega_radps=OMEGA, loop=LOOP, heading=LOOP / (1 + LOOP)),),
    closed_loop=ClosedLoop(
        largest_steps=LargestSteps(within_rate_deg=4.0, within_angle_deg=np.inf),
        course_changes={"change": CHANGE, "large": CHANGE},
        course_keeping=CourseKeeping(**dict.fromkeys(CourseKeeping.__dataclass_fields__, 1.0)),
    ),
    weather={"current_mps": 0.5, "current_towards_deg": 90.0, "wind_mps": 10.0, "wind_from_deg": 45.0}
    | {"wave_yaw_deg": 0.2, "wave_radps": 0.6, "seed": 1},
    track={},
    waypoints_m=np.zeros((0, 2)),
    histories=dict.fromkeys(("change", "large", "keeping"), MOTION),
    track_histories={},
    notices=(),
)


def test_the_charts_show_the_loop_and_the_course_change() -> None:
    charts = AutopilotResult(STUDY)._charts()
    assert list(charts) == [
        "course_change_by_20_deg",
        "a_change_that_takes_the_rudder_to_its_limit",
        "course_keeping_the_last_waves",
        "loop_transfer",
        "nyquist_curve",
        "sensitivity_and_closed_loop",
        "poles_of_the_closed_loop",
    ]
    magnitude, phase = panels(charts["loop_transfer"]).values()
    assert [row["v"] for row in magnitude] == pytest.approx(20 * np.log10(np.abs(LOOP)), rel=1e-4)
    assert [row["v"] for row in phase] == pytest.approx(np.degrees(np.angle(LOOP)), rel=1e-4)
    sensitivity = line(charts["sensitivity_and_closed_loop"], "v", "S, 7.7 m/s")
    wanted = -20 * np.log10(np.abs(1 + LOOP))
    assert sensitivity == pytest.approx(wanted[wanted > -60], rel=1e-4)
    heading = panels(charts["course_change_by_20_deg"])["heading (deg)"]
    assert [row["v"] for row in heading] == pytest.approx(MOTION["psi_deg"])


def test_the_margins_are_a_table_with_units() -> None:
    margins = AutopilotResult(STUDY).tables[2].df
    assert margins["phase margin (deg)"].to_list() == [60.0] and margins["stable"].to_list() == [True]


TEXTS = ("criterion_C", "steady_radius_m@20", "steady_rate_degps@20", "K_per_s", "T_prime")
TARGET = "steady_radius_m@20=640"


@pytest.fixture(scope="module")
def study() -> InfluenceStudy:
    """Coefficients with an agreed variation, and a tuning that meets its target."""
    asked = Study(read_card("mariner"), [parse_figure(text) for text in TEXTS])
    tuned = tune(asked, [parse_target(TARGET)], Means())
    return replace(influence(asked, {"Yv": 1.0, "Nr": 2.0}), tuned=tuned)


def tables(result: InfluenceResult, caption: str) -> list[Table]:
    return [each for each in result.tables if each.caption.startswith(caption)]


def test_every_parameter_has_both_coefficients(study: InfluenceStudy) -> None:
    result = InfluenceResult(study)
    by_slopes, by_difference = tables(result, "K by exact slopes"), tables(result, "K by the 10 % difference")
    assert [len(each.columns) for each in by_difference] == [4, 3]  # no wider than the page
    names = [number.name for number in study.parameters.values()]
    assert [row[0] for row in by_slopes[0].rows] == names
    place = names.index("Nr")
    assert by_slopes[0].rows[place][1] == pytest.approx(result.coefficients.loc["derivatives.Nr", "criterion_C"], 1e-3)
    assert by_difference[0].rows[place][2] == pytest.approx(
        result.differences.loc["derivatives.Nr", "steady_radius_m@20"], 1e-3
    )


def test_the_most_influential_parameters_stand_first(study: InfluenceStudy) -> None:
    """Nr and Yv have the largest K on the criterion, Nd on the radius."""
    result = InfluenceResult(replace(study, tuned=None))
    order = [row["name"] for row in rows_of(result.plot()) if row.get("run") == "exact slope"]
    assert set(order[:2]) == {"Nr", "Yv"}
    assert "by Nd" in result.headline[0]
    assert [(one.label, one.unit) for one in result.key_figures][2:4] == [
        ("steady rate, 20 deg", "deg/s"),
        ("K", "1/s"),
    ]


def test_a_tuning_shows_its_target_its_moves_and_the_agreed_variation(study: InfluenceStudy) -> None:
    assert study.tuned is not None and study.agreed is not None
    result = TuningResult(study)
    figures = tables(result, "Figures before and after")[0].df.set_index("figure")
    assert figures.loc["steady radius, 20 deg", "target"] == "= 640"
    assert figures.loc["steady radius, 20 deg", "verdict"] is Verdict.PASSED
    (moves,) = tables(result, "Parameters that changed")
    assert [row[:3] for row in moves.rows] == [
        [key, one.before, one.after] for key, one in study.tuned.parameters.items()
    ]
    drawn = [row for row in rows_of(result.plot(name="what_tuning_changed")) if "name" in row]
    assert drawn[0]["v"] == pytest.approx(next(iter(study.tuned.parameters.values())).standard_errors, rel=1e-5)
    (changes,) = tables(result, "Change of the figures")
    first = study.agreed.figures["criterion_C"]
    assert changes.rows[0][1:] == [first.foretold_exact, first.foretold_difference, first.direct]
    assert result.targets.loc[TARGET, "after"] == pytest.approx(640, rel=1e-5)


def test_a_study_without_its_ship_has_no_card(study: InfluenceStudy) -> None:
    with pytest.raises(InputError, match="has no card"):
        _ = TuningResult(study).card


def test_targets_that_cannot_be_reached_are_named_with_the_nearest(study: InfluenceStudy) -> None:
    assert study.tuned is not None
    missed = TuningResult(replace(study, tuned=replace(study.tuned, reached=False, contradiction=(TARGET,))))
    assert f"{TARGET} cannot be reached" in missed.headline[0] and "640" in missed.headline[0]
    assert [one.verdict for one in missed.key_figures][1] is Verdict.FAILED


@pytest.fixture(scope="module")
def stability() -> StabilityStudy:
    return stability_study(build(read_card("esso-osaka-estimated")), spirals=False)


def test_a_ship_with_a_loop_has_it_among_its_figures(stability: StabilityStudy) -> None:
    result = StabilityResult(stability)
    assert len(result.sections) == 6
    assert any(figure.label == "Hysteresis loop" for figure in result.key_figures)


def test_the_branches_of_the_diagram_meet_in_the_folds(stability: StabilityStudy) -> None:
    assert stability.steady_turning is not None
    specification = chart_specification(steering_diagram(stability.steady_turning, Spirals()))
    shown = rows(specification, specification["vconcat"][0]["layer"][1])
    gap = next(place for place, row in enumerate(shown) if row["v"] is None)
    first, last = shown[:gap], [row for row in shown[gap + 1 :] if row["run"] == STABLE]
    middle = [row for row in shown if row["run"] == UNSTABLE]
    assert {row["run"] for row in first} == {STABLE}
    assert (first[-1]["x"], last[0]["x"]) == (middle[0]["x"], middle[-1]["x"])
    folds = [fold.rudder_deg for fold in stability.steady_turning.folds]
    assert [middle[0]["x"], middle[-1]["x"]] == pytest.approx(folds, rel=1e-5)


def test_spirals_are_points_in_the_panel_of_the_yaw_rate_alone(stability: StabilityStudy) -> None:
    assert stability.steady_turning is not None
    points = SpiralPoints(np.array([10.0]), np.array([1.5]), (True,), np.zeros(1))
    specification = chart_specification(steering_diagram(stability.steady_turning, Spirals(direct=points)))
    panels = specification["vconcat"]
    (point,) = rows(specification, panels[0]["layer"][2])
    assert (point["run"], point["x"], point["v"]) == (DIRECT, 10, 1.5)
    assert len(panels[0]["layer"]) == len(panels[1]["layer"]) + 1


def test_influences_and_trims_are_drawn_as_they_were_found(stability: StabilityStudy) -> None:
    charts = StabilityResult(stability)._charts()
    bars = [row for row in rows_of(charts["influence_on_c"]) if "name" in row]
    strongest = stability.margins.derivatives[0]
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


def test_the_headline_tells_the_criteria_that_are_not_met(stability: StabilityStudy) -> None:
    criteria = (ImoCriterion.judged("advance", 5.0, 4.5, "L"), ImoCriterion.judged("stopping", 9.0, 15.0, "L"))
    result = StabilityResult(replace(stability, imo=criteria))
    assert any(line.endswith(": advance.") for line in result.headline)
    assert result.imo["met"].to_list() == [False, True]
    met = StabilityResult(replace(stability, imo=criteria[1:]))
    assert any("All criteria" in line for line in met.headline)
