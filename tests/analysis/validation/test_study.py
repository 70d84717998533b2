"""Validation: a trial of the ship herself is validated, one of another ship is refuted, and U_val is what it says."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tank2sim.analysis.validation.standard_trials import ship_of
from tank2sim.analysis.validation.study import ComparisonOutcome, Validated, made_card, validate_card, verify
from tank2sim.cards import revised
from tank2sim.dynamics import build
from tank2sim.records.trials import Trial
from tank2sim.simulation.manoeuvres import Turn, Zigzag
from tank2sim.simulation.run import simulate

pytestmark = pytest.mark.slow

NOISE = {"u_mps": 0.02, "v_mps": 0.02, "r_radps": 2e-4, "psi_rad": 1e-3, "x_m": 0.5, "y_m": 0.5}


def trial_of(card, name: str, manoeuvre, seed: int = 0) -> Trial:
    run = simulate(build(card), manoeuvre).trajectory
    times = np.arange(-20.0, run.t[-1], 0.5)
    rng = np.random.default_rng(seed)
    signals = {}
    for signal, deviation in NOISE.items():
        variable = "motion." + signal.rpartition("_")[0]
        values = np.interp(times, run.t, run[variable])
        if signal == "x_m":
            values += np.minimum(times, 0.0) * run["motion.u"][0]
        signals[signal] = values + deviation * rng.standard_normal(len(times))
    signals["delta_rad"] = np.where(times < 0, 0.0, np.interp(times, run.t, run["rudder.angle"]))
    return Trial(Path(f"{name}.csv"), times, signals, noise=NOISE)


def read_once_a_second(trial: Trial, offset: float) -> Trial:
    """The rudder's order in place of its angle, in rows a second apart that begin `offset` after one of the trial.

    The order is the sign of the rudder's motion: it changes where the rudder begins to move.
    """
    times = np.arange(trial.time_s[0] + 1.0 + offset, trial.time_s[-1], 1.0)
    angle, size = trial.signals["delta_rad"], np.max(np.abs(trial.signals["delta_rad"]))
    moves = np.abs(np.diff(angle)) > 1e-4
    order = np.zeros(len(angle))
    for row in range(1, len(angle)):
        order[row] = math.copysign(size, angle[row] - angle[row - 1]) if moves[row - 1] else order[row - 1]
    shown = order[np.searchsorted(trial.time_s, times, side="right") - 1]
    signals = {
        name: np.interp(times, trial.time_s, values) for name, values in trial.signals.items() if name != "delta_rad"
    }
    return replace(trial, time_s=times, signals={**signals, "delta_order_rad": shown})


@pytest.fixture(scope="module")
def trials(mariner_card):
    manoeuvres = {"turn": Turn(math.radians(20)), "zigzag": Zigzag(math.radians(20), math.radians(20))}
    return [trial_of(mariner_card, name, one) for name, one in manoeuvres.items()]


def test_a_trial_of_the_ship_herself_is_validated(mariner_card, trials) -> None:
    found = validate_card(mariner_card, trials, 12)
    assert len(found.figures) == 9
    # 2 % of each coefficient is assumed: that is what u_input is of
    assert all(one.outcome is ComparisonOutcome.VALIDATED for one in found.figures if one.name != "overshoot_2_deg"), [
        (one.name, one.error, one.uncertainty) for one in found.figures
    ]
    for one in found.figures:
        assert one.numerical < 0.05 * one.uncertainty
        assert one.error == pytest.approx(one.simulated - one.measured)
    assert any("lower bound" in notice for notice in found.notices)


def test_a_trial_of_a_ship_with_another_rudder_is_refuted(mariner_card, trials) -> None:
    rudder = 0.6 * mariner_card.derivatives["Nd"]
    found = validate_card(revised(mariner_card, {"Nd": (rudder, 0.02 * rudder)}), trials[:1], 8)
    rows = {one.name: one for one in found.figures}
    assert rows["advance_m"].outcome is ComparisonOutcome.REFUTED and rows["advance_m"].error > 0
    assert "not validated" in found.verdict


def test_without_members_nothing_is_known_of_the_inputs_and_no_figure_is_judged(mariner_card, trials) -> None:
    found = validate_card(mariner_card, trials[1:], 0)
    assert found.figures and all(
        one.outcome is ComparisonOutcome.OPEN and one.uncertainty is None for one in found.figures
    )


@pytest.mark.parametrize("once_a_second", [False, True])
def test_the_errors_of_an_exact_card_are_as_large_as_the_uncertainty_of_the_data(mariner_card, once_a_second) -> None:
    """Where only orders are known, once a second, the ship goes 2 m on average before the row that shows the order."""
    ratios = []
    manoeuvres = {"turn": Turn(math.radians(20)), "zigzag": Zigzag(math.radians(20), math.radians(20))}
    for seed, offset in enumerate((0.1, 0.35, 0.6, 0.85)):
        records = [trial_of(mariner_card, name, manoeuvre, seed) for name, manoeuvre in manoeuvres.items()]
        if once_a_second:
            records = [read_once_a_second(record, offset) for record in records]
        ratios += [figure.error / figure.data for figure in validate_card(mariner_card, records, 0).figures]
    assert len(ratios) == 36
    assert 0.3 < np.sqrt(np.mean(np.square(ratios))) < 1.5, ratios
    assert np.max(np.abs(ratios)) < 5.0


def test_repeats_enter_the_uncertainty_of_the_data(mariner_card, trials) -> None:
    again = trial_of(mariner_card, "again", Turn(math.radians(20.4)), seed=1)
    alone, repeated, both = (
        {figure.trial: figure for figure in validate_card(mariner_card, those, 0).figures if figure.name == "advance_m"}
        for those in (trials[:1], [again], [trials[0], again])
    )
    between = (alone["turn"].measured - repeated["again"].measured) / math.sqrt(2)  # deviation of one of two runs
    assert both["turn"].data == pytest.approx(math.hypot(alone["turn"].data, between))
    assert abs(between) > alone["turn"].data and both["turn"].inputs is None


def test_the_validation_uncertainty_is_twice_the_root_of_the_squares() -> None:
    one = Validated("t", "turn", "advance_m", 100.0, 108.0, numerical=1.0, inputs=2.0, data=2.0)
    assert one.uncertainty == pytest.approx(6.0) and one.outcome is ComparisonOutcome.REFUTED
    assert replace(one, simulated=105.0).outcome is ComparisonOutcome.VALIDATED
    assert replace(one, simulated=105.0, required_percent=5.0).outcome is ComparisonOutcome.UNCERTAIN
    assert replace(one, inputs=None).outcome is ComparisonOutcome.OPEN
    assert replace(one, simulated=None).outcome is ComparisonOutcome.REFUTED
    assert replace(one, simulated=105.0, made_card=True).outcome is ComparisonOutcome.FITTED
    assert replace(one, made_card=True).outcome is ComparisonOutcome.REFUTED


def test_the_step_hardly_matters_and_a_coarse_one_does(mariner_card) -> None:
    ship = ship_of(mariner_card)
    fine, _ = verify(ship, 0)
    coarse_model = replace(ship.model, step_s=20 * ship.model.step_s)
    coarse, _ = verify(replace(ship, model=coarse_model, integrator=type(ship.integrator)(coarse_model)), 0)
    own, rough = ({(one.trial, one.name): one for one in rows} for rows in (fine, coarse))
    key = ("zigzag 20/20", "overshoot_1_deg")
    assert own[key].U_num < 1e-3 < rough[key].U_num
    assert own[key].deviation is None


def test_without_a_trial_nothing_is_validated(mariner_card) -> None:
    assert validate_card(mariner_card, []).verdict.startswith("not validated")


def test_trials_that_made_a_card_are_known_by_its_source(mariner_card, trials) -> None:
    how = "PMM tests of a turn; identified by tank2sim (output_error, cross_flow) from zigzag, Z_35_05"
    own = replace(mariner_card, ship=mariner_card.ship.model_copy(update={"source": how}))
    assert made_card(own, "zigzag") and made_card(own, "Z_35_05")
    assert not any(made_card(own, name) for name in ("turn", "zig", "Z_35", "35_05", "Z_35_05_b"))
    found = validate_card(own, trials, 0)
    assert ComparisonOutcome.VALIDATED not in {one.outcome for one in found.figures if one.trial == "zigzag"}
    assert all(not one.made_card for one in found.figures if one.trial == "turn")
    assert any("zigzag: the card was identified from this trial" in notice for notice in found.notices)
