"""Trials side by side: block means, times, paddings and gaps, and a motion moved to the exact one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from tank2sim.dynamics.model import Model
from tank2sim.gap.inference.batch import (
    BLOCKS_PER_SHIP_TIME,
    FINE_PER_SHIP_TIME,
    MEASURED_STATES,
    MeasuredBatch,
    _smooth,
    batch_trials,
)
from tank2sim.records.trials import Trial
from tests.identification.trials import made_up_ship

SHIP_TIME = made_up_ship.LENGTH / made_up_ship.SPEED
STARTS = {"u_mps": 5.0, "v_mps": 0.2, "r_radps": 0.01, "psi_rad": -0.3, "x_m": 20.0, "y_m": -5.0}
SLOPES = {"u_mps": -0.01, "v_mps": 0.02, "r_radps": 1e-4, "psi_rad": 0.02, "x_m": 4.0, "y_m": 1.5}
WAVES = dict(zip(STARTS, (0.3, 0.2, 0.01, 0.1, 3.0, 2.0), strict=True))
PERIOD = 40.0


@pytest.fixture(scope="module")
def model() -> Model:
    return made_up_ship.model()


def ramp(name: str, t: np.ndarray) -> np.ndarray:
    return STARTS[name] + SLOPES[name] * t


def wave(name: str, t: np.ndarray) -> np.ndarray:
    return STARTS[name] + WAVES[name] * np.sin(2 * np.pi * t / PERIOD)


def record(
    kind, *, name: str = "a", step: float = 0.5, duration: float = 150.0, begin: float = 0.0, noise=0.0
) -> Trial:
    """A record that is no ship's; its rudder goes up steadily."""
    t = begin + np.arange(0, duration + step / 2, step)
    rng = np.random.default_rng(2)
    signals = {name: kind(name, t) + noise * WAVES[name] * rng.standard_normal(len(t)) for name in STARTS}
    signals["delta_rad"] = 0.002 * t
    return Trial(Path(f"{name}.csv"), t, signals)


def order_of(motion: MeasuredBatch) -> list[str]:
    return [
        {variable: signal for signal, variable in zip(STARTS, MEASURED_STATES, strict=True)}[name]
        for name in motion.seen
    ]


@pytest.mark.parametrize("step", [0.5, 0.1, 0.03, 1.0, 2.5])
def test_a_ramp_has_its_value_in_the_middle_of_each_block(model: Model, step: float) -> None:
    motion = batch_trials(model, [record(ramp, step=step, begin=7.0)], SHIP_TIME)
    times = motion.times[0]
    assert motion.fine % 2 == 1
    assert np.diff(times) == pytest.approx(motion.block_s)
    assert times[0] - motion.block_s / 2 == pytest.approx(7.0, abs=motion.block_s)
    for place, name in enumerate(order_of(motion)):
        assert motion.measured[0, :, place] == pytest.approx(ramp(name, times))
    between = times[:-1] + motion.block_s / 2
    for place, name in enumerate(STARTS):
        assert motion.middles[0, :, place] == pytest.approx(ramp(name, times), rel=1e-6)
        assert motion.block_states[0, :, place] == pytest.approx(ramp(name, between), rel=1e-6)
        assert motion.in_blocks(motion.states)[0, :, place] == pytest.approx(ramp(name, times), rel=1e-6)
    rudder = model.input_names.index("rudder.command")
    assert motion.block_inputs[0, :, rudder] == pytest.approx(0.002 * between)


def test_blocks_and_steps_follow_the_ship(model: Model) -> None:
    coarse = batch_trials(model, [record(ramp, step=0.02)], SHIP_TIME)
    assert SHIP_TIME / coarse.step_s == pytest.approx(FINE_PER_SHIP_TIME)
    assert SHIP_TIME / coarse.block_s == pytest.approx(BLOCKS_PER_SHIP_TIME, rel=0.05)
    assert batch_trials(model, [record(ramp, step=4.0, duration=400.0)], SHIP_TIME).fine == 1


def test_a_wave_has_its_mean_over_each_block(model: Model) -> None:
    motion = batch_trials(model, [record(wave, step=0.1)], SHIP_TIME)
    w, times, h = 2 * np.pi / PERIOD, motion.times[0], motion.step_s
    # the mean of `fine` samples of a sine about its middle one: a Dirichlet kernel
    kept = np.sin(w * h * motion.fine / 2) / (motion.fine * np.sin(w * h / 2))
    for place, name in enumerate(order_of(motion)):
        assert motion.measured[0, :, place] == pytest.approx(STARTS[name] + kept * WAVES[name] * np.sin(w * times))
    found, inside = motion.states[0], slice(40, -40)
    fine = motion.begin_s[0] + h * np.arange(len(found))
    for place, name in enumerate(STARTS):  # smoothing rounds by less than 1 %
        assert found[inside, place] == pytest.approx(wave(name, fine)[inside], abs=0.01 * WAVES[name])


def test_a_rudder_order_holds_within_the_step(model: Model) -> None:
    """The step of an order at 60 s stands in the mean of its own fine step and in none before."""
    trial = record(ramp, step=0.5)
    ordered = {name: values for name, values in trial.signals.items() if name != "delta_rad"}
    ordered["delta_order_rad"] = np.where(trial.time_s >= 60.0, 0.3, 0.0)
    by_order = made_up_ship.model(by_angle=False)
    motion = batch_trials(by_order, [Trial(trial.path, trial.time_s, ordered)], SHIP_TIME)
    order = motion.inputs[0, :, by_order.input_names.index("rudder.command")]
    begins = motion.begin_s[0] + motion.step_s * np.arange(len(order))
    assert order == pytest.approx(np.where(begins > 60.0 - 1e-6, 0.3, 0.0))


def test_a_shorter_run_is_padded_and_the_padding_counts_nothing(model: Model) -> None:
    short, long = record(wave, name="short", duration=80.0, begin=100.0), record(wave, name="long")
    both = batch_trials(model, [short, long], SHIP_TIME)
    alone = batch_trials(model, [short], SHIP_TIME)
    count = int(alone.lengths[0])
    assert both.names == ("short", "long") and both.blocks == both.lengths[1] > both.lengths[0] == count
    assert both.measured[0, :count] == pytest.approx(alone.measured[0], nan_ok=True)
    assert both.times[0, :count] == pytest.approx(alone.times[0]) and both.times[0, 0] > 100 > both.times[1, 0]
    assert both.states[0, : count * both.fine] == pytest.approx(alone.states[0])
    assert np.isnan(both.measured[0, count:]).all() and not np.isnan(both.measured[1]).any()
    assert both.inside.sum(axis=1) == pytest.approx(both.lengths)
    assert np.isfinite(both.states).all() and np.isfinite(both.inputs).all()


def test_a_block_with_a_long_gap_is_not_measured(model: Model) -> None:
    trial = record(ramp)
    gone = (trial.time_s > 60.0) & (trial.time_s < 75.0)
    gappy = Trial(
        trial.path, trial.time_s, {**trial.signals, "r_radps": np.where(gone, np.nan, trial.signals["r_radps"])}
    )
    motion = batch_trials(model, [gappy], SHIP_TIME)
    lost = np.isnan(motion.measured[0])
    place, times = motion.seen.index("motion.r"), motion.times[0]
    half = motion.block_s / 2
    inside, outside = (times > 60 - half) & (times < 75 + half), (times < 60 - half - 0.5) | (times > 75 + half + 0.5)
    assert lost[inside, place].all() and not lost[outside, place].any()
    assert not np.delete(lost, place, axis=1).any()
    assert np.isfinite(motion.states).all()


@pytest.mark.parametrize("steps", [(0.2, 0.5), (0.2, 0.25), (0.1, 0.15), (1.0, 0.3)])
def test_trials_that_sample_differently_keep_their_times(model: Model, steps: tuple[float, float]) -> None:
    trials = [record(wave, name=str(step), step=step) for step in steps]
    motion = batch_trials(model, trials, SHIP_TIME)
    rudder = model.input_names.index("rudder.command")
    for run in range(2):
        count = motion.lengths[run]
        times = motion.times[run, :count]
        assert abs(times[-1] + motion.block_s / 2 - 150.0) < 1.6 * motion.block_s
        between = times[:-1] + motion.block_s / 2
        assert motion.block_inputs[run, : count - 1, rudder] == pytest.approx(0.002 * between, abs=5e-5)  # 25 ms
        for place, name in enumerate(order_of(motion)):
            assert motion.measured[run, :count, place] == pytest.approx(wave(name, times), abs=0.03 * WAVES[name])


@pytest.mark.parametrize(("step", "readings"), [(0.5, 1), (0.1, 1), (0.025, 4)])
def test_noise_is_that_of_a_mean_over_the_readings_in_a_block(model: Model, step: float, readings: int) -> None:
    motion = batch_trials(model, [record(wave, step=step, noise=0.1, duration=400.0)], SHIP_TIME)
    assert motion.averaged == pytest.approx(readings, rel=0.01)
    for place, name in enumerate(order_of(motion)):
        assert motion.noise[place] == pytest.approx(0.1 * WAVES[name] / np.sqrt(motion.fine * readings), rel=0.1)


def test_of_trials_that_sample_differently_each_has_the_noise_of_its_means(model: Model) -> None:
    """0.6 s hold 24 readings or 1, of which the block of one step is the mean."""
    steps = (0.025, 0.6)
    trials = [record(wave, name=str(step), step=step, noise=0.1, duration=600.0) for step in steps]
    motion = batch_trials(model, trials, SHIP_TIME)
    assert motion.averaged == pytest.approx([24, 1])
    for run, readings in enumerate(motion.averaged):
        for place, name in enumerate(order_of(motion)):
            expected = 0.1 * WAVES[name] / np.sqrt(motion.fine * readings)
            assert motion.noise[place] * np.sqrt(motion.noise_shares[run]) == pytest.approx(expected, rel=0.15), name


def test_a_signal_without_noise_still_has_one(model: Model) -> None:
    trial = record(ramp)
    still = Trial(trial.path, trial.time_s, {**trial.signals, "v_mps": np.zeros(len(trial.time_s))})
    assert np.all(batch_trials(model, [still], SHIP_TIME).noise > 0)


# -- a motion moved ------------------------------------------------------------------------------------------------

A = np.zeros((6, 6))
A[:3, :3] = [[-0.05, 0.0, 0.02], [0.0, -0.2, -0.3], [0.0, 0.1, -0.4]]
A[3, 2] = A[4, 0] = A[5, 1] = 1.0
FINE, STEP, BLOCKS = 5, 0.2, 12


def push(t: np.ndarray) -> np.ndarray:
    """Known forces; that in yaw kicks between two fine steps."""
    return np.stack([0.3 + 0 * t, 0.2 * np.sin(t / 2), np.where(t % 4 < 2, 0.1, -0.1), 0 * t, 0 * t, 0 * t], axis=-1)


def test_a_rounded_motion_is_moved_to_the_exact_one_between_the_blocks() -> None:
    n = FINE * BLOCKS
    times = STEP * np.arange(n)
    lacking = np.array([0.0, 0.05, 0.0, 0.0, 0.0, 0.0])
    starts = [np.array([3.0, 0.1, 0.0, 0.3, 0.0, 0.0]), np.array([4.0, 0.0, 0.1, 0.0, 9.0, 0.0])]
    true = np.array(
        [
            solve_ivp(
                lambda t, x: A @ x + push(np.array(t)) + lacking, (0, times[-1]), start, t_eval=times, max_step=0.02
            ).y.T
            for start in starts
        ]
    )
    sizes = np.array([0.1, 0.1, 0.02, 0.02, 0.5, 0.5])
    rounded = true + sizes * np.sin(times[:, None] / 1.5 + np.arange(6))
    count = np.array([BLOCKS, BLOCKS])
    zeros = np.zeros((2, n - 1, 0))
    motion = MeasuredBatch(
        ("a", "b"),
        MEASURED_STATES,
        STEP,
        FINE,
        np.zeros(2),
        count,
        rounded,
        zeros,
        np.zeros((2, BLOCKS, 6)),
        sizes,
        np.zeros(2),
        np.zeros(2, dtype=bool),
    )
    away = (true - rounded)[:, FINE // 2 :: FINE]
    halfway = 0.5 * (rounded[:, 1:] + rounded[:, :-1])
    lack = halfway @ A.T + push(times[:-1] + STEP / 2) - np.diff(rounded, axis=1) / STEP
    transition = np.tile(expm(A * STEP * FINE), (2, BLOCKS - 1, 1, 1))
    moved = motion.shift(away, transition, lack, np.tile(lacking, (2, BLOCKS - 1, 1)))
    inside = slice(FINE // 2, n - FINE // 2)
    remaining = np.abs(moved.states - true)[:, inside].max(axis=(0, 1)) / sizes
    assert np.all(remaining < 0.02)
    assert moved.middles == pytest.approx(true[:, FINE // 2 :: FINE])
    straight = motion.shift(away, transition, 0 * lack, np.zeros((2, BLOCKS - 1, 6)))
    assert np.abs(straight.states - true)[:, inside].max() > 5 * np.abs(moved.states - true)[:, inside].max()


def test_positions_are_smoothed_over_three_tenths_of_the_time_of_a_length_and_velocities_are_not() -> None:
    """43 steps to a length are 12.9: a cubic through 13 places keeps 375/2145 of the variance of white noise."""
    states = np.random.default_rng(1).standard_normal((10000, 6))
    found = _smooth(states, 43.0)
    np.testing.assert_array_equal(found[:, :3], states[:, :3])
    np.testing.assert_allclose(found[:, 3:].var(axis=0), 375 / 2145, rtol=0.05)
    np.testing.assert_array_equal(_smooth(states, 12.0), states)
