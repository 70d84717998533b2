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


def test_repeats_enter_the_uncertainty_of_the_data(mariner_card, trials) -> None:
    again = trial_of(mariner_card, "again", Turn(math.radians(20.3)), seed=1)
    alone, both = (validate_card(mariner_card, those, 0).figures[0] for those in (trials[:1], [trials[0], again]))
    assert alone.name == both.name == "advance_m"
    assert both.data > 2 * alone.data and both.inputs is None


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
    assert own[key].numerical < 1e-3 < rough[key].numerical
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
