"""Bundled ships do what was measured of them, and a hard turn stays within their own range, without a kink."""

from __future__ import annotations

from pathlib import Path

import bundled_ships
import numpy as np
import pytest
import rudder_and_speed

import tank2sim as t2s
from tank2sim.bundled import bundled_cards
from tank2sim.cards import ManoeuvringCard, read_card
from tank2sim.identification.trials.problem.problem_from_card import free_parameters

IDENTIFIED = ("kvlcc2", "esso-osaka")


@pytest.fixture(scope="module")
def errors(data: Path) -> dict[str, dict[str, np.ndarray]]:
    """Ship and pattern of trials, to the errors of each figure: deg, or a share of the measured distance."""
    found: dict[str, dict[str, np.ndarray]] = {}
    for comparison in bundled_ships.COMPARISONS:
        if comparison.ship in IDENTIFIED:
            figures = bundled_ships.figures(comparison)
            names = {figure.name for figure in figures}
            key = f"{comparison.ship} {comparison.pattern.rpartition('/')[0]}"
            found[key] = {
                name: np.array([figure.error for figure in figures if figure.name == name], dtype=float)
                for name in names
            }
    return found


@pytest.mark.essential
@pytest.mark.slow
def test_the_kvlcc2_turns_as_marin_measured_though_that_turn_was_not_fitted(errors) -> None:
    turn = errors["kvlcc2 kvlcc2_marin"]
    for name in ("advance_m", "transfer_m", "tactical_diameter_m"):
        assert np.abs(turn[name]).max() < 0.10, name
    assert np.sqrt(np.mean(turn["overshoot_1_deg"] ** 2)) < 1.0


@pytest.mark.essential
@pytest.mark.slow
def test_the_kvlcc2_overshoots_as_hsva_measured(errors) -> None:
    zigzags = errors["kvlcc2 kvlcc2_hsva"]
    assert len(zigzags["overshoot_1_deg"]) == 7
    assert np.sqrt(np.mean(zigzags["overshoot_1_deg"] ** 2)) < 0.5
    assert np.sqrt(np.mean(zigzags["overshoot_2_deg"] ** 2)) < 2.0


@pytest.mark.essential
@pytest.mark.slow
def test_the_esso_osaka_turns_as_wide_as_its_records(errors) -> None:
    """The advance is 11 % long on average in the wind of the pond."""
    turns = errors["esso-osaka esso_osaka/turning"]
    assert len(turns["tactical_diameter_m"]) == 6
    assert abs(np.mean(turns["tactical_diameter_m"])) < 0.10
    assert abs(np.mean(turns["advance_m"])) < 0.15


@pytest.mark.parametrize(("ship", "model"), [("kvlcc2", "kvlcc2-l7"), ("esso-osaka-ship", "esso-osaka")])
def test_a_ship_and_its_model_move_alike_by_froudes_law(ship: str, model: str) -> None:
    large, small = t2s.load(ship), t2s.load(model)
    lengths = large.card.ship.length_m / small.card.ship.length_m
    turns, zigzags = (t.turn(35).figures for t in (large, small)), (t.zigzag(20, 20).figures for t in (large, small))
    (turn, of_model), (zigzag, zigzag_of_model) = turns, zigzags
    for name in ("advance_m", "transfer_m", "tactical_diameter_m"):
        assert turn[name] / of_model[name] == pytest.approx(lengths, rel=1e-4), name
    assert turn["time_90_s"] / of_model["time_90_s"] == pytest.approx(np.sqrt(lengths), rel=1e-4)
    for name in ("overshoot_1_deg", "overshoot_2_deg"):
        assert zigzag[name] == pytest.approx(zigzag_of_model[name], abs=1e-3), name


@pytest.mark.parametrize("name", IDENTIFIED)
@pytest.mark.parametrize("rudder", [35, -35])
def test_a_hard_turn_stays_in_the_range_of_the_card_and_has_no_kink(name: str, rudder: float) -> None:
    run = t2s.load(name).turn(rudder)
    assert not run.run.reading.notices
    t, drift = run.df.t_s.to_numpy(), np.arctan2(-run.df.v_mps, run.df.u_mps).to_numpy()
    assert np.abs(np.degrees(drift)).max() < 30.0
    ship_time = t2s.load(name).card.ship.length_m / t2s.load(name).card.model.speed_mps
    every = np.arange(0.0, t[-1], 0.1 * ship_time)
    slope = np.gradient(np.interp(every, t, drift), every) * ship_time
    assert np.abs(np.diff(slope)).max() < 0.1  # rad in the time of a length, over a tenth of that time


def test_identified_ships_name_their_trials_and_hold_no_record_of_them() -> None:
    for name in IDENTIFIED:
        card = read_card(name)
        assert isinstance(card, ManoeuvringCard)
        source = card.ship.source or ""
        assert source.startswith("Identified by tank2sim") and ("github.com" in source or "FRT-DS" in source)
        assert card.fitted_trials == () and "t_s" not in card.text
        assert card.covariance is not None or "covariance:" in card.text
    assert {
        "kvlcc2",
        "kvlcc2-l7",
        "esso-osaka-ship",
        "kvlcc2-captive",
        "esso-osaka",
        "esso-osaka-estimated",
        "mariner",
    } <= set(bundled_cards())


def test_the_mariners_rudder_goes_with_the_square_of_speed_where_its_table_is_read_with_the_nominal_speed() -> None:
    """By hand from the printed table: N' by rudder is Nd (1 + 2 Du + Du^2) delta + Nddd delta^3, to port."""
    shares = np.array([1.0, 0.9, 0.8, 0.7])
    delta = np.radians(-10.0)  # the table's rudder is positive to port
    linear, cubic = -139e-5 * delta, 45e-5 * delta**3
    pressure = 0.5 * 1025.0 * 160.93**3
    nominal = pressure * (linear * shares**2 + cubic) / shares**2
    du = 1 - 1 / shares
    instantaneous = pressure * (linear * (1 + du) ** 2 + cubic)
    found = [rudder_and_speed.moments_over_square(name, tuple(shares)) for name in rudder_and_speed.SHIPS]
    np.testing.assert_allclose(found, [instantaneous, nominal], rtol=0.005)
    assert np.ptp(found[1]) < 0.02 * found[1][0] and found[0][-1] < 0.35 * found[0][0]


def test_the_mariner_at_nominal_speed_turns_within_the_imo_diameter_and_overshoots_as_before() -> None:
    turns = {name: t2s.load(name).turn(35).figures["tactical_diameter_lengths"] for name in rudder_and_speed.SHIPS}
    assert turns["mariner-nominal"] == pytest.approx(4.96, abs=0.02) and turns["mariner"] == pytest.approx(
        6.40, abs=0.02
    )
    zigzags = [t2s.load(name).zigzag(10, 10).figures["overshoot_1_deg"] for name in rudder_and_speed.SHIPS]
    assert zigzags[0] == pytest.approx(zigzags[1], abs=0.1)


def test_a_fit_of_the_estimated_esso_osaka_holds_the_published_propeller_astern() -> None:
    """Free within the bounds of the effect they move by several times their value on trials ahead."""
    card = read_card("esso-osaka-estimated")
    assert isinstance(card, ManoeuvringCard)
    free = free_parameters(card)
    assert "wind.sway_coefficient" in free and not [name for name in free if name.startswith("propeller_astern.")]
