"""The whole identification from tows: results, what is warned of, what is refused."""

import re
from dataclasses import replace

import numpy as np
import pytest

from tank2sim.apps.rigs.tow.identify import identify_tow
from tank2sim.apps.rigs.tow.output_error import TowModel, simulated_speeds
from tank2sim.apps.rigs.tow.study import SIMPLE
from tank2sim.apps.rigs.tow.surge import SurgeCoefficients
from tank2sim.cards import read_card
from tank2sim.errors import InputError
from tank2sim.notices import foremost
from tests.apps.rigs.tow.made_tows import tows_of

# what the paper prints as its solution, which is none of its own equations (papers.md 1.5)
PRINTED = np.array([2550.0, 92418.0, -26096.0, 2015.0])


@pytest.fixture(scope="module")
def four_unknowns(table_1):
    return identify_tow(table_1)


@pytest.fixture(scope="module")
def two_unknowns(table_1):
    return identify_tow(table_1, model=SIMPLE)


def synthetic(coefficients, times, *, tows=5, scatter=0.0, force=11.63):
    rng = np.random.default_rng(11)
    readings = simulated_speeds(coefficients, force, times)[:, None] + scatter * rng.standard_normal((len(times), tows))
    readings[times == 0] = 0
    return tows_of(times, readings)


def test_the_paper_and_qr_agree_and_differ_from_the_printed_solution(four_unknowns):
    paper, qr = four_unknowns.methods["paper"], four_unknowns.methods["qr"]
    np.testing.assert_allclose(paper.values, qr.values, rtol=1e-8)
    assert paper.values[0] == pytest.approx(2857, abs=0.5)  # papers.md 1.7, true means
    assert pytest.approx(0.444, abs=5e-4) == paper.J and paper.condition > paper.condition_scaled > 1e4
    assert np.all(np.abs(qr.values / PRINTED - 1) > 0.1)


def test_added_mass_is_total_mass_less_that_of_the_body(two_unknowns):
    for fit in two_unknowns.methods.values():
        assert fit.added_mass_kg == fit.coefficients.total_mass_kg - 2243.0
        assert fit.estimates["added_mass_kg"] == fit.added_mass_kg


def test_terms_left_out_are_zero_in_the_coefficients(two_unknowns):
    coefficients = two_unknowns.methods["output_error"].coefficients
    assert coefficients.B1_kgs2pm3 == 0
    assert coefficients.B2_kgspm2 == 0
    assert coefficients.B3_kgpm == pytest.approx(97, abs=0.5)
    assert set(two_unknowns.methods["qr"].estimates) == {"total_mass_kg", "B3_kgpm", "added_mass_kg"}


def test_warnings_on_table_1_with_four_unknowns(four_unknowns):
    text = "\n".join(four_unknowns.notices)
    expected = [
        r"M, B1, B2, B3 cannot all be identified from these tows: .* 2.2e\+04 \(qr\) and 5.8e\+05 \(output_error\)",
        r"take fewer terms \(terms=\"B3\"\)",
        r"qr: almost fully correlated are B1 and B2",
        r"qr: the drag terms have opposite signs \(B2 negative\)",
        r"output_error: the drag is negative over \d+ % of the speeds up to 0.176 m/s",
        r"qr: 4 unknowns are estimated from the 3 coefficients of a speed polynomial of degree 2",
        r"qr and output_error differ in M by 1.19e\+03 kg",
    ]
    for sentence in expected:
        assert re.search(sentence, text), sentence
    assert all(warning.endswith(".") for warning in four_unknowns.notices)


def test_three_unknowns_are_still_too_many(table_1):
    text = "\n".join(identify_tow(table_1, model=TowModel(("B2", "B3"))).notices)
    assert "M, B2, B3 cannot all be identified" in text
    assert "output_error: not distinguishable from zero at 95 %: B2" in text


def test_two_unknowns_only_show_the_late_start(two_unknowns):
    (warning,) = two_unknowns.notices
    assert warning.startswith("output_error: the equation does not follow the tows within their scatter: at 10 s it is")
    assert "too fast; a late start" in warning


def test_tows_that_follow_the_model_give_no_warning_and_their_coefficients():
    truth = SurgeCoefficients(total_mass_kg=3000.0, B3_kgpm=150.0)
    tows = synthetic(truth, np.arange(0, 81, 5.0), scatter=0.001)
    result = identify_tow(tows, 11.63, 2243.0, model=SIMPLE, speed_degree=4)
    assert result.notices == ()
    for name in ("qr", "output_error"):
        fit = result.methods[name]
        errors = fit.standard_errors
        assert abs(fit.values[0] - 3000) < 3 * errors["total_mass_kg"] < 150
        assert abs(fit.values[1] - 150) < 3 * errors["B3_kgpm"] < 45


def test_a_polynomial_that_cannot_follow_the_speed_is_reported():
    truth = SurgeCoefficients(total_mass_kg=3000.0, B3_kgpm=150.0)
    tows = synthetic(truth, np.arange(0, 401, 5.0), scatter=0.001)
    warnings = identify_tow(tows, 11.63, 2243.0, model=SIMPLE).notices
    assert any("a speed polynomial of degree 2 does not follow the tows" in warning for warning in warnings)


@pytest.mark.parametrize(
    ("force", "mass", "unit", "named"),
    [
        (11.63, 4000.0, 1.0, ""),
        (11.63 / 9.80665, 2243.0, 1.0, "kgf"),
        (11.63 / 4.44822, 2243.0, 1.0, "lbf"),
        (11.63, 2.243, 1.0, "in t "),
        (11.63, 2243.0 / 0.45359237, 1.0, "lb "),
        (11.63, 2243.0, 100.0, "cm/s"),
    ],
)
def test_an_added_mass_that_no_body_has_is_marked_with_the_likely_unit(table_1, force, mass, unit, named):
    tows = replace(table_1, speed_mps=unit * table_1.speed_mps)
    found = foremost(identify_tow(tows, force, mass, model=SIMPLE).notices)
    assert found and all(message.leads and "added mass" in message and named in message for message in found)


def test_the_added_mass_of_the_paper_is_not_marked(table_1):
    for terms in (("B3",), ("B1", "B2", "B3")):
        assert not foremost(identify_tow(table_1, model=TowModel(terms)).notices)


def test_what_is_given_comes_before_the_file_and_is_reported(table_1):
    result = identify_tow(table_1, 2 * 11.63, model=SIMPLE)
    # (1.5) is linear in the force: twice the force with the same speeds gives twice of everything
    reference = identify_tow(table_1, model=SIMPLE)
    for name, fit in result.methods.items():
        np.testing.assert_allclose(fit.values, 2 * reference.methods[name].values, rtol=1e-6)
    assert "The file of the tows states 'force_N: 11.63'; 23.26 was given and used." in result.notices


def test_largest_speed_error_is_that_of_the_integrated_model(two_unknowns, table_1):
    fit = two_unknowns.methods["output_error"]
    mass, b3 = fit.values
    closed = np.sqrt(11.63 / b3) * np.tanh(table_1.time_s * np.sqrt(11.63 * b3) / mass)
    expected = np.max(np.abs(closed - table_1.mean_speed_mps))
    assert fit.largest_speed_error_mps == pytest.approx(expected, rel=1e-9)


def test_the_bundled_card_holds_the_output_error_fit(two_unknowns):
    card = read_card("wilinski-zellman")
    fit = two_unknowns.methods["output_error"]
    assert card.surge.total_mass_kg == pytest.approx(fit.coefficients.total_mass_kg, abs=0.5)
    assert card.surge.B3_kgpm == pytest.approx(fit.coefficients.B3_kgpm, abs=0.05)
    assert (card.surge.B1_kgs2pm3, card.surge.B2_kgspm2) == (0, 0)
    assert card.uncertainty["total_mass_kg"] == pytest.approx(fit.standard_errors["total_mass_kg"], abs=0.05)
    assert card.uncertainty["B3_kgpm"] == pytest.approx(fit.standard_errors["B3_kgpm"], abs=0.05)
    assert card.surge.force_N == two_unknowns.force_N
    assert card.surge.dry_mass_kg == two_unknowns.mass_kg
    assert card.model.valid_speed_mps == (0.0, two_unknowns.top_speed_mps)


def test_force_and_mass_must_be_known(table_1):
    bare = replace(table_1, force_N=None, mass_kg=None)
    for force, mass, name in ((None, 1.0, "force_N"), (1.0, None, "mass_kg")):
        said = f"does not state {name}; give {name}, or add a line '# {name}: VALUE'"
        with pytest.raises(InputError, match=re.escape(said)):
            identify_tow(bare, force, mass)


def speeds_of(function):
    times = np.arange(0, 51, 5.0)
    return tows_of(times, [function(t) for t in times], "tow.csv")


@pytest.mark.parametrize(
    ("function", "said"),
    [
        (lambda t: 0.0, "tow.csv: no tow has a speed above zero"),
        (lambda t: -0.01 * t, "tow.csv: no tow has a speed above zero"),
        (lambda t: 0.3, "tow.csv: the speed does not change"),
    ],
)
def test_tows_that_tell_nothing_are_refused(function, said):
    with pytest.raises(InputError, match=re.escape(said)):
        identify_tow(speeds_of(function), 11.63, 2243.0)


def test_too_few_readings_are_refused():
    tows = synthetic(SurgeCoefficients(total_mass_kg=3000.0), np.arange(0, 20, 5.0), tows=1)
    with pytest.raises(InputError, match=r"3 readings after the release do not test .*; give more readings"):
        identify_tow(tows, 11.63, 2243.0)
