"""Ensembles of ships against simulations one by one, exact propagation of a linear figure, and constructed chances."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tank2sim.analysis.ensemble import results
from tank2sim.analysis.ensemble.draws import by_file_name, draws_of
from tank2sim.analysis.ensemble.questions import BEYOND_CARD_MARK, ENSEMBLE_SIGNALS, OfCriteria, OfManoeuvre, ShipText
from tank2sim.analysis.ensemble.results import (
    EnsembleRequest,
    all_chances,
    bands_without_poles,
    chance,
    manoeuvre_bands,
    named_bands,
    stability_bands,
)
from tank2sim.analysis.stability.imo import ImoCriterion, imo_criteria
from tank2sim.cards import ManoeuvringCard, parse_card
from tank2sim.cards.covariance import Covariance, covariance_file, referring
from tank2sim.cards.reading import revised
from tank2sim.dynamics import build
from tank2sim.simulation.card_range import single_figures
from tank2sim.simulation.ensemble import Ensemble, ensemble
from tank2sim.simulation.manoeuvres import Turn, Zigzag
from tank2sim.simulation.run import simulate

TWENTY = math.radians(20.0)


def changed(card: ManoeuvringCard, **uncertainty: float) -> ManoeuvringCard:
    """The card with no errors but these."""
    lines = "\n".join(f"{name} = {uncertainty.get(name, 0.0)!r}" for name in {**card.derivatives, **uncertainty})
    found = parse_card(f"{card.text}\n[uncertainty]\n{lines}\n", card.source).manoeuvring()
    return found


@pytest.mark.parametrize("manoeuvre", [Turn(TWENTY), Zigzag(-TWENTY, TWENTY)])
def test_members_are_the_ship_with_other_numbers_simulated_one_by_one(mariner_card: ManoeuvringCard, manoeuvre) -> None:
    draws, _ = draws_of(mariner_card, 5)
    times = np.linspace(0, 300, 31)
    found = ensemble(OfManoeuvre(ShipText.of(mariner_card), manoeuvre, None, times), draws, 4)
    model = build(mariner_card)
    for member in range(4):
        run = simulate(model, manoeuvre, parameters=draws.member(member))
        for name, value in single_figures(run.figures).items():
            # The ensemble keeps one step of ten.
            assert found.figures[name][member] == pytest.approx(value, rel=2e-4, nan_ok=True), name
        assert found.histories is not None
        for row, (variable, factor) in enumerate(ENSEMBLE_SIGNALS.values()):
            one = factor * np.interp(times, run.trajectory.t, run.trajectory[variable])
            # Between steps kept, a second apart, lines are straight: seen where the rudder moves at its full rate.
            np.testing.assert_allclose(
                found.histories[member, row], one, atol=1.3 if variable == "rudder.angle" else 0.05
            )


@pytest.mark.slow
def test_a_figure_linear_in_the_numbers_has_the_spread_of_the_covariance(tmp_path, mariner_card) -> None:
    # Steady speed on a straight course has none; C' = Yv (Nr - m x_G) - Nv (Yr - m) is linear in Yv and Nv.
    errors = {"Yv": 2e-4, "Nv": 1e-4}
    ship = tmp_path / "ship.toml"
    card = changed(mariner_card, **errors)
    matrix = np.array([[4e-8, 1.6e-8], [1.6e-8, 1e-8]])
    covariance_file(ship).write_text(Covariance(("derivatives.Yv", "derivatives.Nv"), matrix).as_text())
    own = parse_card(referring(card.text, ship), str(ship)).manoeuvring()
    for one, gradient in ((own, None), (card, 0.0)):
        cov = matrix if gradient is None else np.diag(np.diag(matrix))
        d = card.derivatives
        # "total" terms of the Mariner's card: Yr and Nr contain m and m x_G already.
        slope = np.array([d["Nr"], -d["Yr"]])
        bands = named_bands(one, ["criterion_C"], EnsembleRequest(400, 3))
        assert bands.figures["criterion_C"].standard_deviation == pytest.approx(math.sqrt(slope @ cov @ slope), rel=0.1)


CURRENT = """
[uncertainty]
Yv = 2e-4
Nd = 3e-4
[[effects]]
name = "current"
[effects.parameters]
speed_mps = 0.5
direction_deg = 90.0
[effects.uncertainty]
direction_deg = 5.73
"""


def test_a_covariance_goes_into_a_file_of_other_conventions_and_back(tmp_path, mariner_card) -> None:
    names, ship = ("derivatives.Yv", "derivatives.Nd", "current.direction"), tmp_path / "ship.toml"
    matrix = np.array([[4e-8, 1e-8, 0.0], [1e-8, 9e-8, -1e-5], [0.0, -1e-5, 0.01]])
    text = mariner_card.text + CURRENT
    assert 'rudder_sign = "port"' in text
    card = parse_card(text, str(ship)).manoeuvring()
    written = by_file_name(card, names, matrix)
    assert written.names == ("derivatives.Yv", "derivatives.Nd", "effects.0.parameters.direction_deg")
    # A rudder to port turns the sign of Nd; the direction is in degrees.
    deg = math.degrees(1.0)
    expected = [[4e-8, -1e-8, 0.0], [-1e-8, 9e-8, 1e-5 * deg], [0.0, 1e-5 * deg, 0.01 * deg**2]]
    np.testing.assert_allclose(written.matrix, expected, rtol=1e-12, atol=1e-25)
    covariance_file(ship).write_text(written.as_text())
    own = parse_card(referring(text, ship), str(ship)).manoeuvring()
    draws, _ = draws_of(own, 0)
    rows = [draws.names.index(name) for name in names]
    np.testing.assert_allclose((draws.root @ draws.root.T)[np.ix_(rows, rows)], matrix, rtol=1e-9, atol=1e-20)
    # The root that is symmetric in units of the errors is unique: members depend on no sign of an eigenvector.
    of_correlations = draws.root / np.sqrt(np.diag(draws.root @ draws.root.T))[:, None]
    np.testing.assert_allclose(of_correlations, of_correlations.T, atol=1e-12)


def test_members_take_their_numbers_together_from_the_samples_of_a_card(tmp_path, mariner_card) -> None:
    """Far from normal: two points. Each member is at one of them in both numbers, in a file of another rudder sign."""
    names, ship = ("derivatives.Yv", "derivatives.Nd"), tmp_path / "ship.toml"
    samples = np.array([[-0.010, -0.0013], [-0.013, -0.0015]] * 5)
    covariance = np.cov(samples.T)
    errors = np.sqrt(np.diag(covariance))
    text = mariner_card.text + f"\n[uncertainty]\nYv = {errors[0]:.8g}\nNd = {errors[1]:.8g}\n"
    card = parse_card(text, str(ship)).manoeuvring()
    written = by_file_name(card, names, covariance, samples)
    np.testing.assert_array_equal(written.samples, samples * [1, -1])
    covariance_file(ship).write_text(written.as_text())
    own = parse_card(referring(text, ship), str(ship)).manoeuvring()
    draws, _ = draws_of(own, 0)
    members = [draws.member(number) for number in range(200)]
    found = {(member["derivatives.Yv"], member["derivatives.Nd"]) for member in members}
    assert found == {tuple(row) for row in samples.tolist()}
    assert 60 < sum(member["derivatives.Yv"] == -0.010 for member in members) < 140
    assert len({member["derivatives.Nv"] for member in members}) == 200


@pytest.mark.slow
def test_members_without_a_mass_matrix_and_runaways_are_counted(mariner_card: ManoeuvringCard) -> None:
    card = changed(mariner_card, Yvdot=0.02)
    bands = manoeuvre_bands(card, Turn(TWENTY), (200.0, 200.0), EnsembleRequest(40, 1))
    assert 5 < sum(bands.unusable.values()) < 35
    assert any("positive" in notice for notice in bands.notices)
    assert bands.figures["time_90_s"].shown_by <= bands.usable == 40 - sum(bands.unusable.values())


def test_the_chance_of_a_criterion_is_the_share_that_meets_it() -> None:
    values = np.concatenate([np.full(60, 1.0), np.full(30, 3.0), np.full(10, np.nan)])
    found = chance(
        ImoCriterion.judged("c", 1.0, 2.0, "L"),
        Ensemble(105, 0, {"c": np.append(values, [np.nan] * 5)}, None, {"x": 5}),
    )
    assert found.probability_met == pytest.approx(0.6) and found.not_shown == 10
    # Wilson's interval of 60 of 100, as tabled.
    assert found.interval_95 == pytest.approx((0.5020, 0.6906), abs=1e-4)
    assert chance(ImoCriterion.judged("c", 1.0, 2.0, "L"), Ensemble(3, 0, {})).probability_met is None


@pytest.mark.slow
def test_the_chance_of_meeting_a_limit_at_the_median_is_a_half(mariner_card, mariner) -> None:
    criteria = [one for one in imo_criteria(mariner) if one.name == "advance"]
    assert criteria[0].found is not None
    at_median = replace(criteria[0], allowed=criteria[0].found)
    found = stability_bands(mariner_card, [at_median], EnsembleRequest(16, 2))
    (one,) = found.imo
    assert one.probability_met is not None and abs(one.probability_met - 0.5) < 0.35 and found.probability_stable == 1.0
    # Wilson's interval of 16 of 16: from 1/(1 + z^2/n).
    assert found.probability_stable_interval_95 == pytest.approx([1 / (1 + 1.959964**2 / 16), 1.0])
    assert one.band is not None and one.band.p5 < criteria[0].found < one.band.p95


@pytest.mark.slow
def test_slow_motions_alone_give_no_probability_of_stability(mariner_card) -> None:
    roll = "\n[[effects]]\nname = 'roll_coupling'\n[effects.parameters]\nYphi = 0.001\nNphi = 0.02\n"
    found = stability_bands(parse_card(mariner_card.text + roll, "roll.toml"), [], EnsembleRequest(2, 0))
    assert found.probability_stable is found.probability_stable_interval_95 is None
    assert any("motion.phi" in one for one in found.notices)


def test_criteria_of_a_member_are_those_of_the_ship_with_its_numbers(mariner_card, mariner) -> None:
    draws, _ = draws_of(mariner_card, 4)
    found = ensemble(OfCriteria(ShipText.of(mariner_card)), draws, 1)
    for one in imo_criteria(mariner, draws.member(0)):
        if one.found is not None:
            assert found.figures[one.name][0] == pytest.approx(one.found, rel=1e-4), one.name


@pytest.mark.slow
def test_members_beyond_the_card_are_those_whose_own_trials_left_its_range(mariner_card) -> None:
    card = revised(mariner_card, {}, {"model.valid_speed_mps": [6.19, 9.3]}).manoeuvring()
    draws, _ = draws_of(card, 4)
    found = ensemble(OfCriteria(ShipText.of(card)), draws, 6)
    model = build(card)
    expected: dict[str, list[bool]] = {}
    for number in range(6):
        for one in imo_criteria(model, draws.member(number)):
            expected.setdefault(one.name, []).append(one.beyond_card)
    for name, beyond in expected.items():
        if name + BEYOND_CARD_MARK in found.figures:
            assert (found.figures[name + BEYOND_CARD_MARK] > 0).tolist() == beyond, name
    assert 0 < sum(expected["advance"]) < 6
    assert chance(ImoCriterion.judged("advance", 1.0, 9.0, "L"), found).beyond_card == sum(expected["advance"])


def test_all_criteria_together_are_met_by_members_that_meet_each() -> None:
    figures = {"a": np.array([1.0, 1, 3, np.nan, 1]), "b": np.array([1.0, 5, 1, 1, np.nan])}
    found = all_chances({"a": 2.0, "b": 2.0}, Ensemble(5, 0, figures, None, {"x": 1}))
    assert found is not None and found.probability_met == pytest.approx(1 / 4)
    assert found.interval_95 == pytest.approx((0.0456, 0.6994), abs=1e-4)  # of Wilson, 1 of 4
    assert all_chances({}, Ensemble(5, 0, figures)) is None


def test_figures_over_a_criterion_of_both_signs_have_no_band() -> None:
    C = np.array([2.0, 1.0, 0.5, -0.5, -1.0])
    figures = {"criterion_C": C, "K_prime": -1 / C, "T_prime": 1 / C, "T3_s": np.ones(5), "advance_m": C}
    bands, reported = bands_without_poles(Ensemble(5, 0, figures))
    assert set(bands) == {"criterion_C", "T3_s", "advance_m"}
    (line,) = reported
    assert "K prime and T prime" in line and "3 of 5 members have C' above zero" in line
    # Without C' its sign is that of T; where all are on one side there is a band.
    assert "T_prime" not in bands_without_poles(Ensemble(5, 0, {"T_prime": 1 / C}))[0]
    same = {name: values[:3] for name, values in figures.items()}
    assert set(bands_without_poles(Ensemble(3, 0, same))[0]) == set(figures)


def test_what_is_assumed_is_reported(mariner_card: ManoeuvringCard) -> None:
    _, reported = draws_of(mariner_card, 0)
    assert any("2 % of the value is taken" in one for one in reported)
    assert results.TIMES > 100 and Path(mariner_card.source).name == "ship.toml"
