"""Recursive estimator: it ends where the batch ends, its path narrows honestly, and it says what settled."""

import numpy as np
import pytest

from tank2sim.identification.trials.methods.kalman import kalman
from tank2sim.identification.trials.methods.recursive import RecursiveSettings, recursive
from tests.identification.trials.pushed_ship import TRUTH, VALUES, pushed_problem


@pytest.fixture(scope="module")
def problem():
    return pushed_problem(3)[0]


@pytest.fixture(scope="module")
def found(problem):
    return recursive(problem, settings=RecursiveSettings(passes=4))


def test_it_converges_to_the_batch_estimate(problem, found):
    batch = kalman(problem)
    np.testing.assert_allclose((found.values - batch.values) / batch.standard_errors, 0, atol=0.15)
    np.testing.assert_allclose(np.diag(found.information), np.diag(batch.information), rtol=0.1)
    np.testing.assert_allclose(found.standard_errors, batch.standard_errors, rtol=0.2)


def test_one_pass_comes_near(problem, found):
    once = recursive(problem, settings=RecursiveSettings(passes=1))
    assert np.mean(((once.values - VALUES) / problem.prior_error) ** 2) < 0.5 * 0.25  # the prior is half an error off
    assert abs(once.values[list(TRUTH).index("Nd")] / TRUTH["Nd"] - 1) < 0.1


@pytest.mark.slow
def test_intervals_contain_the_truth_as_often_as_they_say():
    each = [recursive(pushed_problem(seed)[0], settings=RecursiveSettings(passes=2)) for seed in range(3)]
    scaled = np.array([(one.values - VALUES) / one.standard_errors for one in each])
    assert 0.85 <= np.mean(np.abs(scaled) < 1.96) <= 1.0


def test_path_begins_near_the_prior_and_narrows(problem, found):
    k = len(TRUTH)
    assert found.path.shape == found.path_errors.shape == (len(found.times_s), k) == (len(found.runs), k)
    assert found.times_s[-1] == pytest.approx(sum(len(run.measured) * run.step_s for run in problem.runs))
    assert np.all(found.path_errors[0] > 0.2 * problem.prior_error)  # the rudder has moved once
    assert np.all(found.path_errors[-1] < 0.6 * found.path_errors[0])
    np.testing.assert_array_equal(found.path[-1], found.values)
    np.testing.assert_allclose(found.path_errors[-1], found.standard_errors)
    scaled = (found.path - VALUES) / found.path_errors
    assert np.mean(np.abs(scaled) < 1.96) > 0.8  # at all times, not only at the end


@pytest.mark.slow
def test_forgetting_widens_and_follows_the_last_run(problem, found):
    forgetful = recursive(problem, settings=RecursiveSettings(forgetting=0.8))
    assert np.all(forgetful.standard_errors > found.standard_errors)
    assert np.all(forgetful.standard_errors <= 1.001 * problem.prior_error)  # the prior is not forgotten


def test_a_slower_gain_forgets_the_beginning():
    gains = [RecursiveSettings(power=0.7).kept(number) for number in (2, 10, 100)]
    assert gains[0] < gains[1] < gains[2] < 1
    assert RecursiveSettings().kept(7) == pytest.approx(1.0)
    # Robbins and Monro: what is kept makes the weight of the newest block t**-power of the whole
    total = 0.0
    for number in range(1, 31):
        total = RecursiveSettings(power=0.7).kept(number) * total + 1.0
    assert 1 / total == pytest.approx(30**-0.7)


@pytest.mark.slow
def test_progress_is_reported_and_can_stop(problem):
    reported = []
    recursive(
        problem, settings=RecursiveSettings(passes=1), progress=lambda stage, values, cost: reported.append(stage)
    )
    assert reported == ["recursive"] * 3

    def stop(*_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        recursive(problem, progress=stop)


@pytest.mark.parametrize(
    "wrong", [{"forgetting": 0.0}, {"forgetting": 1.1}, {"power": 0.5}, {"block": 0.0}, {"passes": 0}]
)
def test_settings_out_of_range_are_refused(wrong):
    with pytest.raises(ValueError, match="is"):
        RecursiveSettings(**wrong)
