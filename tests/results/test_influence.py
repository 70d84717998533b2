"""The result of influence coefficients and of a tuning: charts and tables hold the numbers of the study."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tank2sim.analysis.influence.card_influence import InfluenceStudy, influence
from tank2sim.analysis.influence.figures import parse_figure
from tank2sim.analysis.influence.study import Study
from tank2sim.analysis.tuning.result import Means
from tank2sim.analysis.tuning.targets import parse_target
from tank2sim.analysis.tuning.tune import tune
from tank2sim.answer.parts import Table, Verdict
from tank2sim.cards import read_card
from tank2sim.errors import InputError
from tank2sim.results.influence import InfluenceResult, TuningResult
from tests.answer.drawn import rows_of

TEXTS = ("criterion_C", "steady_radius_m@20", "steady_rate_degps@20", "K_per_s", "T_prime")
TARGET = "steady_radius_m@20=640"


@pytest.fixture(scope="module")
def study() -> InfluenceStudy:
    """Coefficients with an agreed variation, and a tuning that meets its target."""
    asked = Study(read_card("mariner"), [parse_figure(text) for text in TEXTS])
    tuned = tune(asked, [parse_target(TARGET)], Means())
    return replace(influence(asked, {"Yv": 1.0, "Nr": 2.0}).reported(), tuned=tuned)


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
