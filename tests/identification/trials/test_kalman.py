"""Kalman smoother: its algebra against dense Gaussian algebra, its estimates against ships that gusts push about."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from tank2sim.identification.trials.methods.kalman import KalmanSettings, kalman, task_of
from tank2sim.identification.trials.methods.kalman_pass import (
    Disturbed,
    FilterPass,
    Tangents,
    Variances,
    gains,
    innovation_tangents,
    smooth_states,
    variant_likelihoods,
)
from tank2sim.identification.trials.methods.output_error import OutputErrorSettings, output_error
from tank2sim.identification.trials.problem.estimation_problem import Problem
from tests.identification.trials.pushed_ship import NOISE, PUSH, SEEN, TIME, TRUTH, VALUES, model, pushed_problem

SEEDS = range(5)
NX = 6
"""States of the ship: the random accelerations follow them, then the drifts."""


@pytest.fixture(scope="module")
def pushed():
    """Problems with process noise, the true accelerations, and what the smoother makes of them."""
    made = [pushed_problem(seed) for seed in SEEDS]
    return [(problem, forces, kalman(problem)) for problem, forces in made]


def test_filter_and_smoother_are_those_of_dense_gaussian_algebra():
    rng = np.random.default_rng(0)
    n, nz, ny = 6, 3, 2
    A, C = rng.normal(size=(n, nz, nz)) * 0.6, rng.normal(size=(n, ny, nz))
    process, start = np.array([0.0, 0.3, 0.1]), np.diag([1.0, 2.0, 0.5])
    measurement = np.array([0.2, 0.4])
    y = rng.normal(size=(n, ny))
    # the stack of all states is L w with w = (first state, pushes); the stack of all measurements is C L w + noise
    L = np.zeros((n * nz, n * nz))
    for k in range(n):
        L[k * nz : (k + 1) * nz, k * nz : (k + 1) * nz] = np.eye(nz)
        if k:
            L[k * nz : (k + 1) * nz, : k * nz] = A[k - 1] @ L[(k - 1) * nz : k * nz, : k * nz]
    W = np.diag(np.concatenate([np.diag(start), np.tile(process, n - 1)]))
    big_C = np.zeros((n * ny, n * nz))
    for k in range(n):
        big_C[k * ny : (k + 1) * ny, k * nz : (k + 1) * nz] = C[k]
    P = L @ W @ L.T
    S = big_C @ P @ big_C.T + np.diag(np.tile(measurement, n))
    mean = P @ big_C.T @ np.linalg.solve(S, y.ravel())
    spread = np.sqrt(np.diag(P - P @ big_C.T @ np.linalg.solve(S, big_C @ P)))

    found = gains(A[None], C[None], Variances(process[None], np.tile(measurement, (1, n, 1)), start[None]))
    before, e = np.zeros((n, nz)), np.zeros((n, ny))
    for k in range(n):
        e[k] = y[k] - C[k] @ before[k]
        if k < n - 1:
            before[k + 1] = A[k] @ (before[k] + found.K[0, k] @ e[k])
    white = (found.whitener[0] @ e[..., None])[..., 0]
    density = multivariate_normal(np.zeros(n * ny), S).logpdf(y.ravel()) * -2 - n * ny * np.log(2 * np.pi)
    assert (white**2).sum() + found.log_determinant == pytest.approx(density, rel=1e-9)
    passed = FilterPass(before[None], before[None], e[None], Tangents(A[None], A[None], C[None], C[None]), found, 0.0)
    states, errors = smooth_states(passed)
    np.testing.assert_allclose(states.ravel(), mean, atol=1e-9)
    np.testing.assert_allclose(errors.ravel(), spread, atol=1e-9)


def test_runs_of_different_lengths_say_together_what_each_says_alone():
    rng = np.random.default_rng(1)
    lengths, n, nz, ny, k, variants = (5, 12, 8), 12, 4, 2, 3, 2

    def stacked(*shape):
        values = rng.normal(size=(len(lengths), n, *shape))
        for run, length in enumerate(lengths):
            values[run, length:] = np.nan  # what is in the padding does not matter
        return values

    tangents = Tangents(0.5 * stacked(nz, nz), stacked(nz, k), stacked(ny, nz), stacked(ny, k))
    innovations, after = stacked(ny), stacked(nz)
    process, measurement = rng.uniform(0.1, 0.2, (variants, 3, nz)), rng.uniform(0.1, 0.2, (variants, 3, n, ny))
    start, factors = np.broadcast_to(np.eye(nz), (variants, 3, nz, nz)), rng.uniform(0.2, 0.9, (variants, 3, 1))

    def said(runs, length, of):
        part = np.s_[runs, :length]
        along = Tangents(*(values[part] for values in (tangents.A, tangents.B, tangents.C, tangents.D)))
        noise = Variances(process[:, runs], measurement[:, runs, :length], start[:, runs], of)
        found = gains(along.A, along.C, Variances(noise.process[0], noise.measurement[0], noise.start[0], of))
        likelihood = variant_likelihoods(along, noise, innovations[part], after[part], factors[:, runs])
        return found.log_determinant, *likelihood, innovation_tangents(along, found)

    determinant, cost, information, J = said(slice(None), n, lengths)
    alone = [said(slice(run, run + 1), length, None) for run, length in enumerate(lengths)]
    assert determinant == pytest.approx(sum(one[0] for one in alone))
    np.testing.assert_allclose(cost, sum(one[1] for one in alone))
    np.testing.assert_allclose(information, sum(one[2] for one in alone))
    for run, length in enumerate(lengths):
        np.testing.assert_allclose(J[run, :length], alone[run][3][0])
    assert (J[0, lengths[0] :] == 0).all()


@pytest.mark.slow
def test_derivatives_of_the_innovations_are_those_of_finite_differences(pushed):
    problem = pushed[0][0]
    run = problem.runs[0]
    accelerometer = np.diff(run.column("motion.v"), append=0)[:, None]  # what it shows depends on the parameters too
    seen = (*SEEN, "motion.vdot")
    problem = problem.with_runs((replace(run, seen=seen, measured=np.hstack([run.measured, accelerometer])),))
    task = task_of(problem, drifting=True)
    made = task.first_point(problem.prior_mean).filtered
    disturbed, batch = task.disturbed, task.batch
    case = (np.exp(-batch.steps[0] / np.exp(task.first.time)), batch.steps[:1])

    def whitened(values):  # gains held: the observer alone is run again
        p = problem.parameters(values)
        states = disturbed.predicted(batch.starts[0], batch.inputs[0], batch.measured[0], made.gains.K[0], (p, *case))
        e = batch.measured[0] - disturbed.seen(states, batch.inputs[0], p)
        return states, (made.gains.whitener[0] @ e[..., None])[..., 0]

    states, _ = whitened(problem.prior_mean)
    p = problem.parameters(problem.prior_mean)
    e = batch.measured[0] - disturbed.seen(states, batch.inputs[0], p)
    after = states + (made.gains.K[0] @ e[..., None])[..., 0]
    there = disturbed.tangents(states, after, batch.inputs[0], (p, *case))
    J = innovation_tangents(Tangents(*(x[None] for x in (there.A, there.B, there.C, there.D))), made.gains)
    for place in range(len(TRUTH)):
        step = np.zeros(len(TRUTH))
        step[place] = 1e-4 * problem.prior_mean[place]
        slope = (whitened(problem.prior_mean + step)[1] - whitened(problem.prior_mean - step)[1]) / (2 * step[place])
        np.testing.assert_allclose(J[0, ..., place], slope, atol=1e-5 * np.abs(slope).max())


@pytest.mark.essential
@pytest.mark.slow
def test_intervals_contain_the_truth_as_often_as_they_say(pushed):
    scaled = np.array([(found.values - VALUES) / found.standard_errors for _, _, found in pushed])
    assert 0.85 <= np.mean(np.abs(scaled) < 1.96) <= 1.0
    assert 0.6 < np.sqrt(np.mean(scaled**2)) < 1.3  # neither far too narrow nor far too wide


@pytest.mark.slow
def test_estimates_are_far_better_than_the_prior(pushed):
    away = np.array([(found.values - VALUES) / abs(VALUES) for _, _, found in pushed])
    assert np.all(np.abs(away.mean(axis=0)) < 0.12)  # the prior's mean is 25 % off
    assert np.all(np.abs(away[:, list(TRUTH).index("Nd")]) < 0.08)


@pytest.mark.slow
def test_information_is_what_the_trials_alone_say_whatever_the_prior(pushed):
    problem, _, wide = pushed[0]
    alone = np.sqrt(np.diag(np.linalg.inv(wide.information)))
    sure = replace(problem, prior_mean=wide.values, prior_error=0.3 * alone)  # eleven times what the trials say
    tight = kalman(sure, settings=KalmanSettings(scale_prior=False))
    np.testing.assert_allclose(np.diag(tight.information), np.diag(wide.information), rtol=0.1)


@pytest.mark.essential
@pytest.mark.slow
def test_noise_levels_are_found(pushed):
    process = np.array([[one.deviation for one in found.process_noise.values()] for *_, found in pushed])
    times = np.array([[one.time_s for one in found.process_noise.values()] for *_, found in pushed])
    measurement = np.array([list(found.measurement_noise.values()) for *_, found in pushed])
    np.testing.assert_allclose(process.mean(axis=0), PUSH, rtol=0.1)
    np.testing.assert_allclose(process, np.tile(PUSH, (len(process), 1)), rtol=0.35)  # 680 s say no more
    np.testing.assert_allclose(measurement, np.tile(NOISE, (len(measurement), 1)), rtol=0.12)
    np.testing.assert_allclose(times.mean(axis=0), TIME, rtol=0.3)


@pytest.mark.essential
@pytest.mark.slow
def test_smoothed_accelerations_are_those_that_pushed_the_ship(pushed):
    _, forces, found = pushed[0]
    for true, one in zip(forces, found.smoothed, strict=True):
        for place in range(3):
            assert np.corrcoef(true[:, place], one.states[:, NX + place])[0, 1] > 0.6
        scaled = (one.states[:, NX : NX + 3] - true)[:-1] / one.errors[:-1, NX : NX + 3]
        assert np.all(np.abs(np.sqrt(np.mean(scaled**2, axis=0)) - 1) < 0.35)


@pytest.mark.essential
@pytest.mark.slow
def test_innovations_are_white(pushed):
    for one in pushed[0][2].smoothed:
        np.testing.assert_allclose(np.std(one.innovations, axis=0), 1.0, atol=0.2)
        lagged = [np.corrcoef(one.innovations[1:, place], one.innovations[:-1, place])[0, 1] for place in range(6)]
        assert np.max(np.abs(lagged)) < 0.25


def test_without_process_noise_it_is_output_error():
    problem, _ = pushed_problem(3, push=0 * PUSH)
    found = kalman(problem)
    other = output_error(problem, settings=OutputErrorSettings(coloured=False, scale_prior=False))
    np.testing.assert_allclose((found.values - other.values) / other.standard_errors, 0, atol=0.1)
    np.testing.assert_allclose(np.diag(found.information), np.diag(other.information), rtol=0.05)
    for name, push in zip(("motion.u", "motion.v", "motion.r"), PUSH, strict=True):
        assert found.process_noise[name].deviation < 0.05 * push


@pytest.mark.slow
def test_what_was_not_measured_is_skipped(pushed):
    problem, _, whole = pushed[1]
    runs = []
    for run in problem.runs:
        measured = run.measured.copy()
        measured[40:70] = np.nan
        measured[::3, 4:] = np.nan
        measured[:, SEEN.index("motion.v")] = np.nan
        runs.append(replace(run, measured=measured))
    found = kalman(problem.with_runs(tuple(runs)))
    assert np.all(np.abs(found.values - VALUES) < 3.5 * found.standard_errors)
    assert np.trace(np.linalg.inv(whole.information)) < np.trace(np.linalg.inv(found.information))
    assert np.isnan(found.smoothed[0].innovations[40:70]).all()
    assert np.isfinite(found.smoothed[0].states).all()


@pytest.mark.slow
def test_a_run_says_the_same_next_to_a_longer_one(pushed):
    problem = pushed[0][0]
    long, short = problem.runs[0], problem.runs[1].part(0, 60)
    task = task_of(problem.with_runs((long, short)))
    together = task.first_point(problem.prior_mean).filtered
    alone = [task_of(problem.with_runs((run,))) for run in (long, short)]
    apart = [replace(one, first=task.first).first_point(problem.prior_mean).filtered for one in alone]
    assert together.cost == pytest.approx(sum(one.cost for one in apart), rel=1e-9)


@pytest.mark.slow
def test_white_process_noise_has_no_time_constant(pushed):
    found = kalman(pushed[0][0], settings=KalmanSettings(white=True))
    assert [one.time_s for one in found.process_noise.values()] == [0.0, 0.0, 0.0]
    assert found.cost[-1] > pushed[0][2].cost[-1] + 10  # the pushes of this ship have a memory
    assert np.all(np.abs(found.values - VALUES) < 4 * found.standard_errors)


@pytest.mark.slow
def test_the_drift_of_a_sensor_is_found():
    problem, _ = pushed_problem(5)
    rng, size, time_s = np.random.default_rng(5), 0.02, 20.0
    kept, runs = np.exp(-1 / time_s), []
    for run in problem.runs:
        drift = [size * rng.normal()]
        for _ in run.times[1:]:
            drift.append(kept * drift[-1] + size * np.sqrt(1 - kept**2) * rng.normal())
        measured = run.measured.copy()
        measured[:, SEEN.index("motion.psi")] += drift
        runs.append(replace(run, measured=measured))
    found = kalman(problem.with_runs(tuple(runs)), settings=KalmanSettings(drifting=True))
    assert found.drift["motion.psi"].deviation == pytest.approx(size, rel=0.4)
    assert found.drift["motion.psi"].time_s == pytest.approx(time_s, rel=0.6)
    for name in ("motion.u", "motion.v", "motion.r", "motion.x", "motion.y"):
        assert found.drift[name].deviation < 0.5 * NOISE[SEEN.index(name)]
    assert np.corrcoef(found.smoothed[2].states[:, NX + 3 + SEEN.index("motion.psi")], drift)[0, 1] > 0.9
    assert np.all(np.abs(found.values - VALUES) < 3.5 * found.standard_errors)


@pytest.mark.slow
def test_each_iteration_is_better_and_is_reported(pushed):
    reported = []
    problem: Problem = pushed[0][0]
    found = kalman(problem, start=VALUES, progress=lambda stage, values, cost: reported.append((stage, cost)))
    assert [cost for _, cost in reported] == list(found.cost)
    assert np.all(np.diff(found.cost) < 0) and {stage for stage, _ in reported} == {"kalman"}
    np.testing.assert_allclose((found.values - pushed[0][2].values) / found.standard_errors, 0, atol=0.2)


@pytest.mark.slow
def test_it_can_be_stopped(pushed):
    def stop(*_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        kalman(pushed[0][0], progress=stop)


def test_only_motions_of_the_model_are_pushed():
    assert Disturbed(model(), ("Nd",), SEEN).pushed == ("motion.u", "motion.v", "motion.r")
