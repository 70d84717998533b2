"""The rudder's angle by its orders, against the exact path of a gear with a largest rate."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tank2sim.cards import parse_card, read_card
from tank2sim.dynamics import build
from tank2sim.identification.trials.problem.problem_from_card import fit_driven_by, problem_from_card
from tank2sim.identification.trials.problem.sampled_runs import ordered_rudder
from tank2sim.records.trials import Trial

RATE, LAG, OVER = 5.0, 1.0, 20.0
"""Of the Mariner's gear, deg/s and s; and an order, deg."""


@pytest.fixture(scope="module")
def card():
    return read_card("mariner")


def ordered(step: float, given: float, *, begin: float = 0.0) -> Trial:
    """20 deg ordered at a time, shown by the first row after it; a ship that turns from then on."""
    time = np.arange(begin, 60.0, step)
    order = np.where(time >= given, np.deg2rad(OVER), 0.0)
    rate = 0.01 * np.clip((time - given - 2.0) / 20.0, 0.0, 1.0)
    signals = {"delta_order_rad": order, "r_radps": rate, "u_mps": np.full(len(time), 7.5)}
    return Trial(Path("a.csv"), time, signals)


def exact(time: np.ndarray, given: float) -> np.ndarray:
    """At the largest rate until the error is rate times lag, and then an exponential, deg."""
    ramp = (OVER - RATE * LAG) / RATE
    since = np.maximum(time - given, 0.0)
    after = OVER - RATE * LAG * np.exp(-np.maximum(since - ramp, 0.0) / LAG)
    return np.where(since < ramp, RATE * since, after)


@pytest.mark.parametrize("step", [0.1, 0.5, 1.0, 2.0])
def test_the_rudder_leaves_half_a_row_before_the_row_that_shows_its_order(card, step) -> None:
    gear = ordered_rudder(build(card))
    time, angle = gear.angle(ordered(step, 10.0))
    assert np.rad2deg(angle) == pytest.approx(exact(time, 10.0 - 0.5 * step), abs=0.05)


def test_the_rudder_arrives_within_a_gap_of_the_record(card) -> None:
    trial = ordered(0.5, 10.0)
    rows = (trial.time_s < 10.6) | (trial.time_s > 19.0)
    short = replace(
        trial, time_s=trial.time_s[rows], signals={name: values[rows] for name, values in trial.signals.items()}
    )
    time, angle = ordered_rudder(build(card)).angle(short)
    assert np.rad2deg(angle) == pytest.approx(exact(time, 9.75), abs=0.05)


def test_a_record_that_begins_at_its_execute_begins_amidships(card) -> None:
    gear = ordered_rudder(build(card))
    time, angle = gear.angle(ordered(0.5, 10.0, begin=10.0))
    assert np.rad2deg(angle) == pytest.approx(exact(time, 10.0), abs=0.05)
    turning = ordered(0.5, 10.0, begin=10.0)
    turning = replace(turning, signals={**turning.signals, "r_radps": np.full(len(turning.time_s), 0.01)})
    assert np.rad2deg(gear.angle(turning)[1]) == pytest.approx(OVER)


def test_the_model_that_is_fitted_is_driven_by_the_angle_that_the_gear_reaches_in_each_step(card) -> None:
    trial = ordered(1.0, 10.0)
    problem = problem_from_card(card, [trial], "order")
    assert "rudder.angle" not in problem.model.state_names
    (run,) = problem.runs
    angle = np.rad2deg(run.inputs[:, problem.model.input_names.index("rudder.command")])
    middles = run.times + 0.5 * run.step_s
    assert angle[:-2] == pytest.approx(exact(middles, 9.5)[:-2], abs=0.7)  # means over steps with a bend


def test_a_gear_with_a_fault_on_the_card_stays_in_the_model(card) -> None:
    fault = '\n[[effects]]\nname = "rudder_backlash"\n[effects.parameters]\nwidth_deg = 2.0\n'
    faulty = parse_card(card.text + fault, "faulty.toml")
    assert ordered_rudder(build(faulty)) is None and fit_driven_by(faulty, "order") == "order"
    assert fit_driven_by(card, "order") == fit_driven_by(card, "angle") == "angle"
