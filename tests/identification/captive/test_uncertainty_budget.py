"""The uncertainty budget adds up by cause; the likelihood of a spread by dense matrices and differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tank2sim.identification.captive.reduction import reduce_campaign
from tank2sim.identification.captive.regression import _ZeroLikelihood
from tank2sim.identification.captive.uncertainty_budget import (
    BUDGET_SOURCES,
    blockage_speed,
    regression_parts,
    sources_not_stated,
    uncertainty_budget,
)
from tank2sim.records.campaigns import read_campaign
from tests.identification.captive.generator import Campaign, write
from tests.marks import first_fast

SOUND = Campaign(seed=7, rate_hz=5.0)
STATED = """[uncertainty]
calibration_relative = 0.002
alignment_deg = 0.05
rudder_deg = 0.1
speed_relative = 0.001
mass_relative = 0.003
yaw_inertia_relative = 0.01
force_delay_s = 0.001
blockage_relative = 0.004
[tank]
breadth_m = 10.0
depth_m = 5.0
"""


def budget_of(campaign, folder, stated=""):
    written = write(campaign, folder)
    written.path.write_text(written.path.read_text().replace("[test]", f"{stated}[test]", 1))
    reduction = reduce_campaign(read_campaign(written.path))
    return reduction, uncertainty_budget(reduction).derivatives


@pytest.fixture(scope="module")
def stated(tmp_path_factory):
    return budget_of(SOUND, tmp_path_factory.mktemp("stated"), STATED)


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    return budget_of(SOUND, tmp_path_factory.mktemp("sound"))


@pytest.fixture(scope="module")
def gains(tmp_path_factory):
    return budget_of(replace(SOUND, gain_error=0.01), tmp_path_factory.mktemp("gains"))


@pytest.fixture(scope="module")
def delay(tmp_path_factory):
    return budget_of(replace(SOUND, size="linear", force_delay_s=0.03), tmp_path_factory.mktemp("delay"))


@first_fast("campaign", ["gains", "delay"])
def test_parts_add_up_to_the_standard_errors(request, campaign):
    reduction, rows = request.getfixturevalue(campaign)
    assert rows.keys() == reduction.derivatives.keys()
    for name, row in rows.items():
        assert row.combined == pytest.approx(reduction.derivatives[name].standard_error, rel=1e-6), name
        assert row.expanded == pytest.approx(2 * row.combined)
        assert sum(row.shares.values()) == pytest.approx(1.0)
        assert tuple(row.parts) == tuple(BUDGET_SOURCES)


def test_parts_of_the_regression_are_the_covariances_by_brute_force(gains):
    """Weights and covariances written out as full matrices."""
    reduction, _ = gains
    result = reduction.forces["Y"]
    used, spread = result.selection.equations, result.solution.spread
    rows = used.run_of_row
    same = rows[:, None] == rows[None, :]
    zeros, weights = spread.zeros(used)[rows], spread.weights or spread
    of_zero = np.outer(used.zero, used.zero) * same
    weighting = np.linalg.inv(weights.noise * np.eye(len(rows)) + weights.zeros(used)[rows] * of_zero)
    prior = used.prior_rows
    inverse = np.linalg.inv(used.design.T @ weighting @ used.design + prior.T @ prior)
    estimator = inverse @ used.design.T @ weighting
    causes = {
        "random": spread.noise * np.eye(len(rows)),
        "repeatability": zeros * of_zero,
        "calibration": spread.gain_variance * np.outer(used.gauge, used.gauge) * same,
    }
    found = regression_parts(result.selection, result.solution)
    assert spread.gain_variance > 0
    for cause, covariance in causes.items():
        expected = result.selection.widening**2 * np.einsum("ij,jk,ik->i", estimator, covariance, estimator)
        assert found[cause] == pytest.approx(expected, rel=1e-5, abs=1e-9 * expected.max()), cause


def test_each_stated_error_is_at_its_source(stated):
    reduction, rows = stated
    assert not sources_not_stated(reduction)
    derivatives = reduction.derivatives
    assert rows["Yvdot"].parts["inertia"] == pytest.approx(derivatives["Yvdot"].type_b["mass_relative"])
    both = np.hypot(derivatives["Y0"].type_b["alignment_rad"], derivatives["Y0"].type_b["rudder_rad"])
    assert rows["Y0"].parts["alignment"] == pytest.approx(both)
    assert rows["Nrdot"].parts["timing"] == pytest.approx(derivatives["Nrdot"].type_b["force_delay_s"])
    assert rows["Yd"].parts["blockage"] == pytest.approx(derivatives["Yd"].type_b["blockage_relative"])
    # forces on a rudder go with the square of the speed: 0.4 % of speed is 0.8 % of Y_d
    assert rows["Yd"].parts["blockage"] == pytest.approx(0.008 * abs(rows["Yd"].value), rel=0.05)
    assert rows["Yd"].parts["speed"] == pytest.approx(0.002 * abs(rows["Yd"].value), rel=0.05)


@pytest.mark.slow
def test_more_noise_is_in_the_random_part_and_more_zero_error_in_repeatability(tmp_path, sound):
    _, quiet = sound
    _, loud = budget_of(replace(SOUND, noise=5.0), tmp_path / "loud")
    _, offset = budget_of(replace(SOUND, zero_error=5.0), tmp_path / "offset")
    assert loud["Yvdot"].parts["random"] > 3 * quiet["Yvdot"].parts["random"]
    assert offset["Yd"].parts["repeatability"] > 3 * quiet["Yd"].parts["repeatability"]
    assert offset["Yvdot"].parts["random"] < 1.5 * quiet["Yvdot"].parts["random"]


def test_what_is_not_stated_is_listed_and_blockage_follows_schuster(sound, stated):
    reduction, _ = sound
    assert "calibration_relative" in sources_not_stated(reduction)
    assert "force_delay_s" not in sources_not_stated(reduction)  # the oscillations show it
    of = reduction.campaign
    assert blockage_speed(of.model, of.tank, of.test) is None
    model, speed = stated[0].campaign.model, stated[0].campaign.test.speed_mps
    share = model.beam_m * model.draught_m / 50.0
    expected = share / (1 - share - speed**2 / (stated[0].campaign.test.gravity_mps2 * 5.0))
    of = stated[0].campaign
    assert blockage_speed(of.model, of.tank, of.test) == pytest.approx(expected)


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
