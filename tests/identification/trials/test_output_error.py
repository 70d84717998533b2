"""Output error: against ships that were integrated without tank2sim."""

from dataclasses import replace

import numpy as np
import pytest

from tank2sim.identification.trials.methods.equation_error import equation_error
from tank2sim.identification.trials.methods.output_error import INTERRUPTED, OutputErrorSettings, output_error
from tests.identification.trials.made_up_ship import (
    NOISE,
    TRUTH,
    gusts,
    problem,
    trial,
    turn,
    zigzag,
)

FREE = ("Xu", "Xvr", "Yv", "Yr", "Yd", "Nv", "Nr", "Nd")
EXACT = np.array([TRUTH[name] for name in FREE])
PIECES = OutputErrorSettings(piece_s=60.0)


def pair(seed=0, duration=150.0, **more):
    rudders = {"zigzag": zigzag(20), "turn": turn(-30)}
    return [
        trial(rudder, name=name, seed=10 * seed + place, duration=duration, **more)
        for place, (name, rudder) in enumerate(rudders.items())
    ]


@pytest.fixture(scope="module")
def noisy():
    return pair()


@pytest.fixture(scope="module")
def found(noisy):
    return output_error(problem(noisy, free=FREE), settings=PIECES)


def test_with_hardly_any_noise_the_coefficients_come_back():
    asked = problem(pair(noise=0.01, duration=100.0), free=FREE)
    answer = output_error(asked, settings=replace(PIECES, rounds=2))
    np.testing.assert_allclose(answer.values, EXACT, rtol=5e-3)


def test_standard_errors_hold_under_sensor_noise():
    off = []
    for seed in range(3):
        answer = output_error(problem(pair(seed), free=FREE, seed=seed), settings=PIECES)
        off.append((answer.values - EXACT) / answer.standard_errors)
    assert 0.6 < np.sqrt(np.mean(np.square(off))) < 1.5


def test_noise_of_the_sensors_is_found(found):
    names = {"motion.u": "u_mps", "motion.r": "r_radps", "motion.psi": "psi_rad", "motion.x": "x_m"}
    for name, signal in names.items():
        assert found.noise[name] == pytest.approx(NOISE[signal], rel=0.15)


def test_whole_runs_and_pieces_agree(noisy, found):
    whole = output_error(problem(noisy, free=FREE), settings=OutputErrorSettings())
    assert np.all(np.abs(whole.values - found.values) < 3 * found.standard_errors)
    assert np.all(whole.standard_errors < 1.5 * found.standard_errors)


def test_the_start_does_not_matter(noisy, found):
    asked = problem(noisy, free=FREE)
    near = output_error(asked, start=equation_error(asked).values, settings=PIECES)
    assert np.all(np.abs(near.values - found.values) < 0.1 * found.standard_errors)


def test_port_and_starboard_are_mirrors(noisy, found):
    odd = ("v_mps", "r_radps", "psi_rad", "y_m", "delta_rad")
    mirrored = [
        replace(one, signals={name: -values if name in odd else values for name, values in one.signals.items()})
        for one in noisy
    ]
    other = output_error(problem(mirrored, free=FREE), settings=PIECES)
    np.testing.assert_allclose(other.values, found.values, rtol=1e-5)


def test_what_is_known_for_sure_stays_as_it_is(noisy):
    asked = problem(noisy, free=FREE)
    error = np.where(np.array(FREE) == "Yr", 1e-9, asked.prior_error)
    sure = replace(asked, prior_error=error, prior_mean=np.where(error == 1e-9, EXACT, asked.prior_mean))
    answer = output_error(sure, settings=replace(PIECES, scale_prior=False))
    place = FREE.index("Yr")
    assert answer.values[place] == pytest.approx(EXACT[place], abs=1e-8)
    assert answer.standard_errors[place] == pytest.approx(1e-9, rel=0.05)


def test_a_prior_that_is_too_sure_is_widened(noisy):
    asked = problem(noisy, free=FREE)
    sure = replace(asked, prior_error=0.05 * asked.prior_error)
    widened = output_error(sure, settings=PIECES)
    assert max(widened.prior_scale.values()) > 3
    held = output_error(sure, settings=replace(PIECES, scale_prior=False))
    away = [np.abs(one.values / EXACT - 1)[-3:].max() for one in (widened, held)]
    assert away[0] < away[1]


def test_each_step_is_reported_and_an_interruption_keeps_the_best(noisy):
    reported = []

    def watch(stage, values, cost):
        reported.append((values.copy(), cost))
        if len(reported) == 2:
            raise KeyboardInterrupt

    answer = output_error(problem(noisy, free=FREE), settings=PIECES, progress=watch)
    assert reported[1][1] < reported[0][1]
    np.testing.assert_array_equal(answer.values, reported[1][0])
    assert INTERRUPTED in answer.notices
    assert np.isfinite(answer.standard_errors).all()


def test_a_gap_is_passed_over(noisy, found):
    holed = {name: values.copy() for name, values in noisy[0].signals.items()}
    for name in ("r_radps", "x_m"):
        holed[name][300:350] = np.nan
    answer = output_error(problem([replace(noisy[0], signals=holed), noisy[1]], free=FREE), settings=PIECES)
    assert np.all(np.abs(answer.values - found.values) < 2 * found.standard_errors)


@pytest.mark.long
def test_standard_errors_hold_under_coloured_forces_and_model_error():
    """Gusts, and a ship with a term that the fitted model has not: 95 % intervals about the mean of all fits."""
    answers = []
    truth = {**TRUTH, "Nvvr": 1.5 * TRUTH["Nvvr"]}
    for seed in range(12):
        rng = np.random.default_rng(seed)
        trials = [
            trial(
                rudder,
                seed=10 * seed + place,
                duration=240.0,
                truth=truth,
                force=gusts(1201, 0.2, (5e-6, 3e-5, 8e-6), 15.0, 10 * seed + place),
            )
            for place, rudder in enumerate(
                [zigzag(rng.uniform(10, 25), rng.uniform(35, 60)), zigzag(-10, 40.0), turn(rng.uniform(-30, -15))]
            )
        ]
        asked = problem(trials, free=("Yv", "Yr", "Yd", "Nv", "Nr", "Nd"), seed=seed)
        answers.append(output_error(asked, equation_error(asked).values, PIECES))
    values = np.array([answer.values for answer in answers])
    errors = np.array([answer.standard_errors for answer in answers])
    inside = np.abs(values - values.mean(axis=0)) < 1.96 * errors
    assert inside.mean() >= 0.85
