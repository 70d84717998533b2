"""Samples of a posterior: against differences of its density, and against the normal distribution of a linear fit."""

from dataclasses import replace

import numpy as np
import pytest

from tank2sim.identification.trials.methods.output_error import OutputErrorSettings, output_error
from tank2sim.identification.trials.methods.posterior_sampling import (
    LARGEST_R_HAT,
    LogPosterior,
    sample_posterior,
)
from tests.identification.trials.made_up_ship import TRUTH, gusts, problem, trial, turn, zigzag

FREE = ("Xu", "Yv", "Yd", "Nv", "Nr", "Nd")


def fitted(**more):
    rudders = {"zigzag": zigzag(20), "turn": turn(-30)}
    trials = [trial(rudder, name=name, duration=100.0, step=0.5, **more) for name, rudder in rudders.items()]
    posed = problem(trials, free=FREE)
    return posed, output_error(posed, settings=OutputErrorSettings(piece_s=50.0))


@pytest.fixture(scope="module")
def quiet():
    return fitted()


@pytest.fixture(scope="module")
def few(quiet):
    """Few draws, with the seed 7."""
    return sample_posterior(*quiet, draws=10, seed=7)


@pytest.mark.parametrize("robust", [False, True])
@pytest.mark.parametrize("coloured", [False, True])
def test_the_gradient_is_the_slope_of_the_density(quiet, robust: bool, coloured: bool) -> None:
    posed, estimate = quiet
    if coloured:
        noise = tuple(replace(white, phi=0.9, psi=0.4) for white in estimate.motion.noise)
        estimate = replace(estimate, motion=replace(estimate.motion, noise=noise))
    density = LogPosterior(posed, estimate, robust=robust)
    z = np.random.default_rng(3).standard_normal(len(FREE))
    step = 1e-5 * np.eye(len(FREE))
    slopes = [(density(z + along) - density(z - along)) / 2e-5 for along in step]
    value, gradient = density.with_gradient(z)
    assert value == pytest.approx(density(z), rel=1e-12)
    np.testing.assert_allclose(gradient, slopes, rtol=1e-4, atol=1e-4 * np.abs(slopes).max())


def test_missing_samples_do_not_count(quiet) -> None:
    posed, estimate = quiet
    runs = []
    for run in posed.runs:
        measured = run.measured.copy()
        measured[30:50, 2] = np.nan
        runs.append(replace(run, measured=measured))
    density = LogPosterior(posed.with_runs(tuple(runs)), estimate, robust=False)
    z = 0.5 * np.ones(len(FREE))
    slopes = [(density(z + along) - density(z - along)) / 2e-5 for along in 1e-5 * np.eye(len(FREE))]
    np.testing.assert_allclose(density.with_gradient(z)[1], slopes, rtol=1e-4, atol=1e-4 * np.abs(slopes).max())


@pytest.mark.parametrize(
    "sampler", [pytest.param("nuts", marks=pytest.mark.slow), pytest.param("ensemble", marks=pytest.mark.long)]
)
def test_of_a_precise_record_the_posterior_is_the_normal_distribution_of_the_fit(quiet, sampler: str) -> None:
    """So little noise that the model is linear within it: mean and covariance are those of linear least squares."""
    posed, estimate = quiet
    samples = sample_posterior(posed, estimate, sampler, 200, robust=False)
    prior = posed.prior_precision(
        posed.prior_error * np.array([estimate.prior_scale.get(g, 1.0) for g in posed.groups])
    )
    linear = np.linalg.inv(estimate.information + prior)
    errors = np.sqrt(np.diag(linear))
    assert samples.r_hat.max() < 1.05
    assert samples.effective.min() > 150
    assert np.all(np.abs(samples.mean - estimate.values) < 0.3 * errors)
    np.testing.assert_allclose(np.sqrt(np.diag(samples.covariance)), errors, rtol=0.25)
    correlation, expected = (
        matrix / np.sqrt(np.outer(np.diag(matrix), np.diag(matrix))) for matrix in (samples.covariance, linear)
    )
    np.testing.assert_allclose(correlation, expected, atol=0.2)


@pytest.mark.slow
def test_the_truth_lies_within_the_samples(quiet) -> None:
    samples = sample_posterior(*quiet, draws=40, robust=False)
    away = (samples.mean - [TRUTH[name] for name in FREE]) / np.sqrt(np.diag(samples.covariance))
    assert np.abs(away).max() < 3.5
    assert 0.3 < np.sqrt(np.mean(away**2)) < 1.8


@pytest.mark.slow
def test_residuals_that_hold_together_widen_the_samples() -> None:
    """Gusts for minutes: the noise model calls them noise of every second, the blocks of time do not."""
    posed, estimate = fitted(force=gusts(201, 0.5, (2e-5, 1e-4, 2e-5), 20.0, seed=3), noise=0.2)
    narrow, wide = (sample_posterior(posed, estimate, draws=60, robust=robust) for robust in (False, True))
    wider = np.diag(wide.covariance) / np.diag(narrow.covariance)
    assert wider.min() > 0.5 and np.median(wider) > 1.5  # of so few draws, a variance is off by a quarter
    assert np.linalg.det(wide.covariance) > 10 * np.linalg.det(narrow.covariance)


def test_draws_stay_within_the_bounds_of_the_model(quiet) -> None:
    posed, estimate = quiet
    density = LogPosterior(posed, estimate)
    density.lowest = estimate.values - 0.5 * estimate.standard_errors
    density.highest = estimate.values + np.inf
    draws = np.random.default_rng(0).standard_normal((50, len(FREE)))
    values = np.array([density.values(z) for z in draws])
    assert np.all(values >= density.lowest)
    assert np.all(values.min(axis=0) < density.lowest + 0.3 * estimate.standard_errors)
    step = 1e-6 * np.eye(len(FREE))
    for z in draws[:3]:
        slopes = [(density(z + along) - density(z - along)) / 2e-6 for along in step]
        np.testing.assert_allclose(density.with_gradient(z)[1], slopes, rtol=1e-3, atol=1e-3 * np.abs(slopes).max())


@pytest.mark.slow
def test_the_seed_fixes_the_samples(quiet, few) -> None:
    np.testing.assert_array_equal(few.values, sample_posterior(*quiet, draws=10, seed=7).values)
    assert not np.array_equal(few.values, sample_posterior(*quiet, draws=10, seed=8).values)


@pytest.mark.slow
def test_few_draws_are_marked(few) -> None:
    assert not few.converged
    assert few.effective.min() < 400 or few.r_hat.max() > LARGEST_R_HAT
    assert few.notices[0].startswith("NOT CONVERGED")
