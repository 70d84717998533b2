"""What the tows of paper 1 can and cannot tell: papers.md 1.3, 1.5, 1.6 and 1.7, and what its result says of them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import printed_tows
import pytest
from numpy.polynomial import Polynomial
from scipy import stats

from tank2sim.apps.rigs.tow import paper as tow_paper
from tank2sim.apps.rigs.tow.equation_error import discretise, solve_by_qr
from tank2sim.apps.rigs.tow.findings import _worst_misfit
from tank2sim.apps.rigs.tow.identify import identify_tow
from tank2sim.apps.rigs.tow.output_error import TowModel, fit_speeds, simulated_speeds
from tank2sim.apps.rigs.tow.records import Tows
from tank2sim.apps.rigs.tow.result import TowResult, drag_chart, tow_speed_chart
from tank2sim.apps.rigs.tow.study import (
    SIMPLE,
    SIMPLE_LATE,
    TowSpeeds,
    compare_models,
    mass_range,
    speed_polynomials,
    study_tows,
    towed_body,
)
from tests.answer.drawn import panels, rows_of, whole_panel
from tests.apps.rigs.tow.made_tows import tows_of


@pytest.fixture(scope="module")
def study(table_1):
    result = identify_tow(table_1)
    return study_tows(result, table_1, towed_body(table_1, result.mass_kg, {}))


def test_speed_polynomials_of_the_printed_means_next_to_table_2():
    tows = tows_of(tow_paper.TIMES_S, tow_paper.MEANS_MPS)
    rows = list(speed_polynomials(tows))
    expected = [(0.05499, 0.05768), (0.00438, 0.00460), (0.00318, 0.00334), (0.00282, 0.00296)]
    for row, (by_n, by_less) in zip(rows, expected, strict=True):
        assert (row.rms_mps, row.rms_less_one_mps) == pytest.approx((by_n, by_less), abs=6e-6)
        fitted = np.polynomial.polynomial.polyfit(tow_paper.TIMES_S, tow_paper.MEANS_MPS, row.degree)
        np.testing.assert_allclose(row.coefficients, fitted, rtol=1e-9)
    # the errors of degrees 0 and 3 are those printed, the others are not
    printed = [error for _, error in tow_paper.TABLE_2]
    assert [abs(row.rms_mps - error) < 1e-4 for row, error in zip(rows, printed, strict=True)] == [
        True,
        False,
        False,
        True,
    ]


def test_largest_deviation_of_the_printed_model_settles_the_sign_of_B2():
    def deviation(coefficients):
        speeds = simulated_speeds(coefficients, printed_tows.FORCE_N, tow_paper.TIMES_S)
        return np.max(np.abs(speeds - tow_paper.MEANS_MPS))

    assert deviation(tow_paper.SOLUTION) == pytest.approx(0.0142, abs=5e-5)
    assert deviation(replace(tow_paper.SOLUTION, B2_kgspm2=26096.0)) == pytest.approx(0.113, abs=5e-4)
    problem = discretise(printed_tows.SPEED, tow_paper.TIMES_S, ("B1", "B2", "B3"), printed_tows.FORCE_N)
    right = dict(zip(vars(tow_paper.SOLUTION), solve_by_qr(problem), strict=True))
    assert deviation(replace(tow_paper.SOLUTION, **right)) == pytest.approx(0.0128, abs=5e-5)


# papers.md 1.7: M and its 95 % half-width, scatter, AIC
@pytest.mark.parametrize(
    ("label", "mass", "half", "scatter", "aic"),
    [
        ("M", 3336, 63, 0.00689, -476.9),
        ("M, B3", 3148, 141, 0.00641, -482.9),
        ("M, B3, delay", 2772, 226, 0.00581, -491.3),
        ("M, B2, B3", 3344, 295, 0.00629, -483.7),
        ("M, B1, B2, B3", 4047, 571, 0.00570, -492.3),
        ("M, B1, B2, B3, delay", 3355, 1276, 0.00570, -491.3),
    ],
)
def test_models_are_those_of_the_reanalysis(study, label, mass, half, scatter, aic):
    (one,) = (one for one in study.models if one.label == label)
    assert one.estimates["M"] == pytest.approx(mass, rel=2e-3)
    assert one.half_widths_95["M"] == pytest.approx(half, rel=0.012)
    assert one.scatter_mps == pytest.approx(scatter, abs=6e-6)
    assert one.aic == pytest.approx(aic, abs=0.06)


def test_the_mass_is_fixed_between_2_5_and_3_4_tonnes(study):
    low, high = study.mass_range_kg
    assert (low, high) == pytest.approx((2772 - 226, 3336 + 63), abs=2)
    assert study.best.unknowns == SIMPLE_LATE.unknowns
    usable = [one.label for one in study.models if one.usable]
    assert usable == ["M", "M, B3", "M, B3, delay"]
    assert mass_range([one for one in study.models if not one.drag_nowhere_negative]) is None


def test_a_model_far_worse_than_the_best_does_not_widen_the_range(table_1):
    # forty times the tows leave no doubt which model is best
    many = replace(table_1, names=("tow",) * 200, speed_mps=np.tile(table_1.speed_mps, 40))
    models = compare_models(many, Polynomial([11.63]), (TowModel(()), SIMPLE, SIMPLE_LATE))
    low, high = mass_range(models)
    assert (low, high) == models[2].mass_interval_kg
    assert high - low < 100


def test_tow_by_tow(study):
    paper, simple, late = study.tow_by_tow.values()
    # over its own 45 s the fourth tow gives 2682 kg; extrapolated to 50 s, 2687
    np.testing.assert_allclose(paper.alone[:, 0], [3063, 3124, 2742, 2682, 2816], atol=0.6)
    np.testing.assert_allclose(simple.alone, [(3374, 56), (3350, 37), (3100, 89), (2898, 185), (3067, 103)], atol=0.6)
    assert simple.jackknife_standard_errors == pytest.approx([84, 23], rel=0.02)
    assert late.jackknife_standard_errors == pytest.approx([62, 13, 0.37], rel=0.01)
    assert late.unknowns == ("M", "B3", "delay") and late.together[2] == pytest.approx(2.13, abs=0.01)
    np.testing.assert_allclose(
        late.jackknife_half_widths_95, 2.7764 * late.jackknife_standard_errors, rtol=1e-4
    )  # Student's t, 4 degrees
    np.testing.assert_allclose(simple.spread_standard_errors, stats.sem(simple.alone))


def test_the_ellipse_is_the_joint_region(study, table_1):
    ellipse = next(one for one in study.confidence_ellipses if one.label == "M, B3")
    fit = fit_speeds(table_1, 11.63, SIMPLE)
    apart = np.vstack([ellipse.mass_kg, ellipse.B3_kgpm]) - fit.estimates[:, None]
    distance = np.einsum("ik,ij,jk->k", apart, np.linalg.inv(fit.covariance), apart)
    np.testing.assert_allclose(distance / 2, stats.f.ppf(0.95, 2, 46), rtol=1e-9)
    # mass and drag stand in for each other: a heavier body has less drag
    assert np.corrcoef(ellipse.mass_kg, ellipse.B3_kgpm)[0, 1] < -0.85


def test_a_constant_extra_force_cannot_be_found(table_1):
    design = fit_speeds(table_1, 11.63, SIMPLE).design
    estimates = fit_speeds(table_1, 11.63, SIMPLE).estimates
    more = (simulated(estimates, 11.63 + 1e-4, table_1)[1:] - simulated(estimates, 11.63 - 1e-4, table_1)[1:]) / 2e-4
    read = np.nonzero(~np.isnan(table_1.speed_mps[1:]))[0]
    left = np.linalg.lstsq(design, more[read], rcond=None)[1]
    assert np.sqrt(left[0]) < 1e-6 * np.linalg.norm(more[read])


def simulated(estimates, force, tows):
    coefficients = replace(
        tow_paper.SOLUTION, total_mass_kg=estimates[0], B1_kgs2pm3=0, B2_kgspm2=0, B3_kgpm=estimates[1]
    )
    return simulated_speeds(coefficients, force, tows.time_s)


def test_notes_tell_the_range_and_offer_a_way_out(study, table_1):
    text = " ".join(study.notices)
    assert "M only within 2547 to 3399 kg (added mass 304 to 1156 kg)" in text
    assert "The model of lowest AIC is M, B1, B2, B3, with a drag that is negative at some speeds" in text
    assert "(start_delay=True)" in text and 'terms="B3"' in text and "total_mass_kg, 2357 by (2.5)" in text
    posed = study_tows(identify_tow(table_1, model=SIMPLE_LATE), table_1)
    assert "start_delay" not in " ".join(posed.notices) and "total_mass_kg" not in " ".join(posed.notices)
    assert posed.mass_by_theory == () and posed.drag_coefficients == {}


def test_one_tow_is_not_compared_tow_by_tow(table_1):
    alone = table_1.only(0)
    study = study_tows(identify_tow(alone, model=SIMPLE), alone)
    assert study.tow_by_tow == {} and SIMPLE.unknowns in [one.unknowns for one in study.models]


def test_the_body_is_what_is_given_before_what_the_file_says(table_1):
    body = towed_body(table_1, 2243.0, {"length_m": 4.0, "volume_m3": None})
    assert (body.length_m, body.beam_m, body.volume_m3) == (4.0, 0.9, 2.243)
    assert towed_body(replace(table_1, body={}), 2243.0, {}) is None


def test_table_1_is_known_again(table_1):
    assert tow_paper.are_of_the_paper(table_1)
    assert not tow_paper.are_of_the_paper(table_1.only(3))
    assert not tow_paper.are_of_the_paper(replace(table_1, speed_mps=1.01 * table_1.speed_mps))


def test_a_tow_that_ends_early_is_reported_with_its_polynomial_continued(study):
    (note,) = [note for note in study.notices if note.startswith("Tow ")]
    assert all(words in note for words in ("Tow 4", "45 s", "2682 kg", "50 s", "2687 kg"))


SCATTER = 0.01


def tows(readings: list[list[float]]) -> Tows:
    """Readings of two tows at 0, 1, 2 ... s; at rest at first."""
    table = np.array([[0.0, 0.0], *readings])
    return tows_of(np.arange(len(table)), table)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_misfit_is_distinguished_from_the_95th_percentile_of_f_on_with_one_and_two_degrees_of_freedom(
    sign: int,
) -> None:
    """F(1, 2) is 18.51 at 95 %: two times, one estimate, two tows each."""
    pair = [[1 - SCATTER, 1 + SCATTER], [2 - SCATTER, 2 + SCATTER]]
    limit = SCATTER * math.sqrt(18.51)  # lack is 2 e^2, pure error 4 s^2 over 2 degrees of freedom
    assert _worst_misfit(tows(pair), np.array([0.0, 1.0, 2.0 + 0.99 * sign * limit]), 1) is None
    assert _worst_misfit(tows(pair), np.array([0.0, 1.0, 2.0 + 1.01 * sign * limit]), 1) == 2
    assert _worst_misfit(tows(pair), np.array([0.0, 1.0 + 1.01 * sign * limit, 2.0]), 1) == 1


def test_a_misfit_is_reported_with_a_single_repetition() -> None:
    """F(1, 1) is 161.4 at 95 %."""
    once = [[1 - SCATTER, 1 + SCATTER], [2.0, math.nan]]
    limit = SCATTER * math.sqrt(2 * 161.45)  # lack is e^2, pure error 2 s^2
    assert _worst_misfit(tows(once), np.array([0.0, 1.0, 2.0 + 0.99 * limit]), 1) is None
    assert _worst_misfit(tows(once), np.array([0.0, 1.0, 2.0 + 1.01 * limit]), 1) == 2


def test_no_misfit_is_reported_without_freedom_without_repetition_or_without_scatter() -> None:
    off = np.array([0.0, 1.0, 9.0])
    pair = [[1 - SCATTER, 1 + SCATTER], [2 - SCATTER, 2 + SCATTER]]
    assert _worst_misfit(tows(pair), off, 1) == 2
    assert _worst_misfit(tows(pair), off, 2) is None
    assert _worst_misfit(tows([[1.0, math.nan], [2.0, math.nan]]), off, 1) is None
    assert _worst_misfit(tows([[1.0, 1.0], [2.0, 2.0]]), off, 1) is None


@pytest.fixture(scope="module")
def result(table_1):
    found = identify_tow(table_1)
    return TowResult(study_tows(found, table_1, towed_body(table_1, found.mass_kg, {})))


def table_rows(result, caption):
    (found,) = (each for each in result.tables if each.caption.startswith(caption))
    return {row[0]: row for row in found.rows}


def test_the_paper_stands_next_to_what_its_tows_give(result):
    assert [figure.value for figure in result.key_figures[:3]] == [2772, 529, "2.55 to 3.40"]
    notices = result.layout().sections[-1].notes
    assert len(notices) == len(result.notices) and not any("e+" in note or "e-0" in note for note in notices)
    assert "22\u202f000 (qr) and 580\u202f000 (output_error)" in notices[0]
    polynomials = table_rows(result, "Polynomials")
    assert polynomials["2, printed"][1:4] == list(tow_paper.TABLE_2[2][0]) and len(polynomials) == 8
    drags = {row[0]: row for row in result.sections[3].tables[0].rows if row[1] == "L²"}
    assert drags["as printed"][2:5] == pytest.approx([12.8, -3.6144, 0.27909], rel=3e-5)
    assert "best usable: M, B3, delay" in drags
    assert [round(row[3]) for row in result.sections[4].tables[0].rows] == [2357, 2316, 2489]


def test_estimates_stand_by_method_with_their_errors(result):
    estimates = table_rows(result, "Estimates by method, ± one standard error")
    fit = result.study.methods["output_error"]
    mass, error = (float(text) for text in estimates["M (kg)"][3].split(" ± "))
    assert mass == pytest.approx(fit.estimates["total_mass_kg"], abs=0.05)
    assert error == pytest.approx(fit.standard_errors["total_mass_kg"], abs=5)
    assert "±" not in estimates["M (kg)"][1]  # the published method gives no error


def test_other_tows_are_not_held_next_to_the_paper(table_1):
    one = replace(table_1.only(0), body={})
    found = TowResult(study_tows(identify_tow(one, model=SIMPLE), one))
    assert [section.heading for section in found.sections] == [
        "Measured and computed speeds",
        "Estimates by method",
        "What these tows determine",
    ]
    assert len(table_rows(found, "Polynomials")) == 4


def test_charts_hold_the_speeds_and_the_models(result):
    charts, study = result._charts(), result.study
    assert list(charts) == [
        "measured_and_computed_speeds",
        "what_these_tows_determine",
        "what_these_tows_determine_2",
        "drag_coefficient",
    ]
    speed, left = panels(charts["measured_and_computed_speeds"]).values()
    first, *_ = study.speeds.simulated_mps
    drawn = [row["v"] for row in speed if row["run"] == first]
    assert drawn == pytest.approx(study.speeds.simulated_mps[first], rel=1e-5)
    assert {row["v"] for row in left if row["run"] == first} == {0.0}
    models = {row["name"]: row["m"] for row in rows_of(charts["what_these_tows_determine"]) if "name" in row}
    assert models == {one.label: pytest.approx(one.estimates["M"], rel=1e-5) for one in study.models}


def test_drag_chart_has_speed_and_reynolds_number(result):
    body, drag = result.study.body, result.study.drag_coefficients["qr"].by_length_squared
    rows = [row for row in rows_of(drag_chart({"qr": drag}, body, 0.176)) if "speed" in row]
    last = max(rows, key=lambda row: row["speed"])
    assert last["speed"] == pytest.approx(0.176) and last["re"] == pytest.approx(0.176 * 3.8 / 1.139e-6, rel=1e-5)
    assert last["cv"] == pytest.approx(8.42716 * last["c"], rel=1e-4)
    assert last["c"] == pytest.approx(float(drag.at(np.array(0.176))), rel=1e-5)


def test_residuals_are_readings_less_the_first_fit(table_1):
    speeds = TowSpeeds(
        t_s=table_1.time_s,
        measured_mps={"tow 3": table_1.speed_mps[:, 2]},
        simulated_t_s=np.array([0.0, 50.0]),
        simulated_mps={"line": np.array([0.0, 0.175])},
    )
    found = {(row["run"], row["x"]): row["v"] for row in whole_panel(tow_speed_chart(speeds), 1)}
    assert found["tow 3", 20.0] == pytest.approx(0.078 - 0.07)
    assert found["line", 50.0] == 0
