"""The likelihood of a spread without gain errors: its value by dense matrices, its slopes by differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tank2sim.identification.captive.reduction import reduce_campaign
from tank2sim.identification.captive.regression import _ZeroLikelihood
from tank2sim.records.campaigns import read_campaign
from tests.identification.captive.generator import Campaign, write


@pytest.fixture(scope="module")
def equations(tmp_path_factory):
    path = write(Campaign(seed=11, size="small", rate_hz=5.0), tmp_path_factory.mktemp("spread")).path
    return reduce_campaign(read_campaign(path)).forces["Y"].selection.equations


def dense(equations, noise: float, zeros: np.ndarray) -> float:
    """-2 log of the restricted likelihood (Patterson and Thompson 1971) by the covariance of all rows."""
    same = equations.run_of_row[:, None] == equations.run_of_row
    covariance = noise * np.eye(len(equations.values))
    covariance += same * np.outer(equations.zero, equations.zero) * zeros[equations.run_of_row]
    inverse = np.linalg.inv(covariance)
    prior = equations.prior_rows
    normal = equations.design.T @ inverse @ equations.design + prior.T @ prior
    estimate = np.linalg.solve(normal, equations.design.T @ inverse @ equations.values)
    left = equations.values - equations.design @ estimate
    squares = left @ inverse @ left + np.sum((prior @ estimate) ** 2)
    return float(np.linalg.slogdet(covariance)[1] + np.linalg.slogdet(normal)[1] + squares)


@pytest.mark.slow
def test_the_likelihood_is_that_of_the_dense_covariance(equations):
    random = np.random.default_rng(0)
    usual = float(np.median([root[0, 0] for root in equations.roots])) ** 2
    likelihood = _ZeroLikelihood.of(equations)
    apart = []
    for noise in (0.7, 1.6):
        zeros = usual * random.uniform(0.5, 3.0, len(equations.runs))
        apart.append(likelihood(noise, zeros)[0] - dense(equations, noise, zeros))
    assert apart == pytest.approx([0.0, 0.0], abs=1e-5)


def test_slopes_are_those_of_differences(equations):
    usual = float(np.median([root[0, 0] for root in equations.roots])) ** 2
    zeros = usual * np.random.default_rng(1).uniform(0.5, 3.0, len(equations.runs))
    likelihood, step = _ZeroLikelihood.of(equations), 1e-4
    _, by_noise, by_zeros = likelihood(1.3, zeros)
    difference = likelihood(1.3 + step, zeros)[0] - likelihood(1.3 - step, zeros)[0]
    assert by_noise == pytest.approx(difference / (2 * step), rel=1e-5)
    for place in (0, len(zeros) - 1):
        more, less = zeros.copy(), zeros.copy()
        more[place] *= 1 + step
        less[place] *= 1 - step
        difference = likelihood(1.3, more)[0] - likelihood(1.3, less)[0]
        assert by_zeros[place] * zeros[place] == pytest.approx(difference / (2 * step), rel=1e-3, abs=1e-6)


def test_the_prior_is_in_it(equations):
    usual = float(np.median([root[0, 0] for root in equations.roots])) ** 2
    zeros = np.full(len(equations.runs), usual)
    held = replace(equations, prior={"Yv": 1e-3})
    found = [_ZeroLikelihood.of(each)(1.0, zeros)[0] for each in (held, replace(equations, prior={}))]
    assert found[0] == pytest.approx(dense(held, 1.0, zeros), abs=1e-4)
    assert abs(found[0] - found[1]) > 1.0
