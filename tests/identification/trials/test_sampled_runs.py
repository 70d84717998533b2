"""Trials on equal steps: means, orders, gaps, first instants; the rudder by its orders against the path of a gear."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tank2sim.cards import parse_card, read_card
from tank2sim.dynamics import build
from tank2sim.errors import InputError
from tank2sim.identification.trials.methods.output_error import _start
from tank2sim.identification.trials.methods.weak_form import _complete_positions
from tank2sim.identification.trials.problem.problem_from_card import fit_driven_by, problem_from_card
from tank2sim.identification.trials.problem.sampled_runs import (
    SampledRun,
    ordered_rudder,
    prepare,
    rudder_at_start,
    seen_in,
)
from tank2sim.records.trials import Trial
from tests.identification.trials.made_up_ship import model, problem, trial, turn, zigzag


@pytest.fixture(scope="module")
def by_angle():
    return model()


@pytest.fixture(scope="module")
def by_order():
    return model(by_angle=False)


def record(t, **signals):
    return Trial(Path("made_up.csv"), t, signals)


def command(ship, run):
    return run.inputs[:, ship.input_names.index("rudder.command")]


def test_steps_are_whole_numbers_of_samples(by_angle):
    t = np.arange(0, 30, 0.05)
    run = prepare(by_angle, record(t, delta_rad=np.zeros_like(t), r_radps=np.sin(t)), ("motion.r",), step_s=0.22)
    assert run.step_s == pytest.approx(0.2)
    assert run.begin_s == pytest.approx(0.075)  # the middle of the first four samples
    np.testing.assert_allclose(np.diff(run.times), 0.2)


def test_signals_are_averaged_around_their_instant(by_angle):
    t = np.arange(0, 30, 0.05)
    run = prepare(by_angle, record(t, delta_rad=np.zeros_like(t), r_radps=2 + 3 * t), ("motion.r",), step_s=0.2)
    np.testing.assert_allclose(run.column("motion.r"), 2 + 3 * run.times)
    noise = np.random.default_rng(1).standard_normal(len(t))
    run = prepare(by_angle, record(t, delta_rad=np.zeros_like(t), r_radps=noise), ("motion.r",), step_s=0.2)
    assert run.column("motion.r").std() == pytest.approx(0.5, rel=0.2)


def test_a_measured_angle_is_straight_between_samples(by_angle):
    t = np.arange(0, 20, 0.1)
    run = prepare(by_angle, record(t, delta_rad=0.1 * t, r_radps=t), ("motion.r",), step_s=0.2)
    np.testing.assert_allclose(command(by_angle, run)[:-1], 0.1 * (run.times[:-1] + 0.1))


def test_an_order_holds_until_the_next(by_order):
    t = np.arange(0, 20, 0.5)
    order = np.where(t >= 10, 0.3, 0.0)
    run = prepare(by_order, record(t, delta_order_rad=order, r_radps=t), ("motion.r",), step_s=0.5)
    expected = np.where(run.times >= 10 - 1e-9, 0.3, 0.0)
    np.testing.assert_allclose(command(by_order, run)[:-1], expected[:-1], atol=1e-12)
    assert command(by_order, run)[-1] == command(by_order, run)[-2]


def test_an_order_was_given_half_a_row_before_the_one_that_shows_it(by_order):
    t = np.arange(0.0, 40.0)
    trial = record(t, delta_order_rad=np.where(t >= 10.0, 0.3, 0.0), r_radps=0 * t)
    late, before = (
        prepare(by_order, trial, ("motion.r",), step_s=0.25, orders_before=earlier) for earlier in (False, True)
    )
    for run, begin in ((late, 10.0), (before, 9.5)):
        np.testing.assert_allclose(command(by_order, run), np.where(run.times >= begin - 1e-9, 0.3, 0.0), atol=1e-9)


def test_the_measured_angle_goes_before_the_order(by_angle):
    t = np.arange(0, 20, 0.1)
    both = record(t, delta_rad=np.full_like(t, 0.2), delta_order_rad=np.full_like(t, 0.3), r_radps=t)
    np.testing.assert_allclose(command(by_angle, prepare(by_angle, both, ("motion.r",))), 0.2)


def test_short_gaps_are_bridged_and_long_ones_are_not(by_angle):
    t = np.arange(0, 20, 0.1)
    holed = 2.0 * t
    holed[50:53] = np.nan
    holed[100:104] = np.nan
    run = prepare(by_angle, record(t, delta_rad=np.zeros_like(t), r_radps=holed), ("motion.r",), step_s=0.1)
    column = run.column("motion.r")
    assert np.isfinite(column[50:53]).all()
    assert np.isnan(column[101:103]).all()
    known = np.isfinite(column)
    np.testing.assert_allclose(column[known], 2 * run.times[known])


def test_what_was_not_measured_is_nan(by_angle):
    run = prepare(by_angle, trial(zigzag(10), duration=20.0), ("motion.r", "motion.u_ground"))
    assert np.isnan(run.column("motion.u_ground")).all()
    assert np.isnan(run.column("motion.phi")).all()
    assert np.isfinite(run.column("motion.r")).all()


def test_what_is_seen_is_what_model_and_trials_share(by_angle):
    t = np.arange(0, 20, 0.1)
    there = [record(t, delta_rad=t, r_radps=t, phi_rad=t), record(t, delta_rad=t, psi_rad=t)]
    assert seen_in(by_angle, there) == ("motion.r", "motion.psi")


def test_too_short_or_empty_trials_are_refused(by_angle):
    t = np.arange(0, 0.5, 0.1)
    with pytest.raises(InputError, match=r"only 0\.4 s long; leave it out"):
        prepare(by_angle, record(t, delta_rad=t, r_radps=t), ("motion.r",))
    t = np.arange(0, 20, 0.1)
    with pytest.raises(InputError, match="none of the signals to be compared"):
        prepare(by_angle, record(t, delta_rad=t), ("motion.r",))


def test_a_part_begins_at_its_own_time():
    run = problem([trial(turn(20), duration=40.0)]).runs[0]
    part = run.part(10, 60)
    np.testing.assert_allclose(part.times, run.times[10:60])
    np.testing.assert_array_equal(part.measured, run.measured[10:60])
    np.testing.assert_array_equal(part.inputs, run.inputs[10:60])


def test_a_signal_slower_than_the_rows_is_known_at_its_own_samples(by_angle):
    """A receiver of 1 Hz in rows of 5 Hz: kept, and not made into five measurements each."""
    t = np.arange(0, 60, 0.2)
    slow = np.where(np.arange(len(t)) % 5 == 3, 2.0 * t, np.nan)
    slow[100:160] = np.nan
    run = prepare(by_angle, record(t, delta_rad=np.zeros_like(t), x_m=slow, r_radps=t), ("motion.x",), step_s=0.4)
    column = run.column("motion.x")
    known = np.isfinite(column)
    np.testing.assert_allclose(column[known], 2 * run.times[known])
    assert 42 <= known.sum() <= 48
    assert not known[(run.times > 20) & (run.times < 31)].any()


def test_a_signal_as_fast_as_the_steps_is_known_at_each(by_angle):
    t = np.arange(0, 60, 0.2)
    slow = np.where(np.arange(len(t)) % 5 == 3, 2.0 * t, np.nan)
    run = prepare(by_angle, record(t, delta_rad=np.zeros_like(t), x_m=slow), ("motion.x",), step_s=1.0)
    assert np.isfinite(run.column("motion.x")[1:-1]).all()


def test_rows_slower_than_the_steps_asked_for_are_taken_apart(by_angle):
    """A small craft logged at 1 Hz: the model needs shorter steps, and is measured at the rows alone."""
    t = np.arange(0, 60, 1.0)
    run = prepare(by_angle, record(t, delta_rad=0.01 * t, r_radps=3 * t), ("motion.r",), step_s=0.2)
    assert run.step_s == pytest.approx(0.2)
    column = run.column("motion.r")
    known = np.isfinite(column)
    np.testing.assert_allclose(run.times[known], t[: known.sum()], atol=1e-9)
    np.testing.assert_allclose(column[known], 3 * run.times[known])
    np.testing.assert_allclose(command(by_angle, run)[:-1], 0.01 * (run.times[:-1] + 0.1))


HARD_OVER = np.deg2rad(30)
STARTS = {  # yaw rate (rad/s) over the time (s), order, and the rudder's angle at the first instant
    "begins at the execute": (lambda t: 0.01 * (1 - np.exp(-t / 20)) * (t > 3), HARD_OVER, 0.0),
    "to port": (lambda t: -0.01 * (1 - np.exp(-t / 20)), -HARD_OVER, 0.0),
    "begins in the turn": (lambda t: np.full_like(t, 0.01), HARD_OVER, HARD_OVER),
    "weather helm on a straight course": (np.zeros_like, np.deg2rad(4), np.deg2rad(4)),
    "in waves": (lambda t: 0.004 * np.sin(2 * np.pi * t / 8), np.deg2rad(4), np.deg2rad(4)),
    "amidships": (np.zeros_like, 0.0, 0.0),
}


@pytest.mark.parametrize("case", STARTS)
@pytest.mark.parametrize("measured", ["motion.r", "motion.psi"])
def test_the_rudder_of_a_run_by_its_orders_begins_amidships_where_the_ship_does_not_turn_yet(case, measured):
    rate, order, expected = STARTS[case]
    t, noise = np.arange(0.0, 200.0, 0.5), np.random.default_rng(3).standard_normal(400)
    rates = rate(t)
    values = rates + 1e-4 * noise if measured == "motion.r" else np.cumsum(rates) * 0.5 + 1e-4 * noise
    run = SampledRun("a", 0.0, 0.5, np.full((400, 1), order), values[:, None], (measured,))
    assert rudder_at_start(run, run.inputs[:, 0], ship_time=20.0) == pytest.approx(expected)


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


T = np.arange(0.0, 20.0, 0.1)
KNOWN = 1000.0 + 0 * T


def columns() -> dict[str, np.ndarray]:
    """5 m/s ahead and 1 m/s to port on a course of 30 deg."""
    return {
        "motion.u": 5.0 + 0 * T,
        "motion.v": -1.0 + 0 * T,
        "motion.psi": np.radians(30) + 0 * T,
        "motion.x": KNOWN,
        "motion.y": KNOWN,
    }


@pytest.mark.parametrize("missing", [set(), {"motion.x"}, {"motion.y"}, {"motion.x", "motion.y"}])
def test_a_position_that_was_measured_stays_and_one_that_was_not_is_reckoned(missing: set[str]) -> None:
    found = columns()
    _complete_positions(found, missing, 0.1)
    north, east = (5 * np.sqrt(3) / 2 + 1 * 0.5) * T, (5 * 0.5 - 1 * np.sqrt(3) / 2) * T
    for name, reckoned in (("motion.x", north), ("motion.y", east)):
        np.testing.assert_allclose(found[name], reckoned if name in missing else KNOWN, atol=1e-9)


def test_the_first_state_is_what_was_measured_there() -> None:
    asked = problem([trial(zigzag(20), name="zigzag", seed=1, duration=100.0, noise=0.0)], free=("Yv",))
    run, first = asked.runs[0], 250
    state = dict(zip(asked.model.state_names, _start(asked, run, first), strict=True))
    for name in ("motion.u", "motion.v", "motion.r", "motion.psi", "motion.x", "motion.y"):
        if name in run.seen:
            near = run.column(name)[first - 1 : first + 2]
            size = np.ptp(run.column(name))
            assert state[name] == pytest.approx(near.mean(), abs=0.02 * size), name
    assert "motion.v" in run.seen and abs(state["motion.v"]) > 0
