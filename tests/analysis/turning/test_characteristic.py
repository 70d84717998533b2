"""Response to the rudder, nonlinear characteristic and simulated spirals."""

from __future__ import annotations

import math

import control
import numpy as np
import pytest

from tank2sim.analysis.linearisation import straight_course
from tank2sim.analysis.stability.response import FIRST_ORDER, GEAR, HULL, steering_responses
from tank2sim.analysis.stability.straight_line import stability
from tank2sim.analysis.turning.characteristic import steering_characteristic
from tank2sim.analysis.turning.diagram import SteadyTurning, steady_turning
from tank2sim.analysis.turning.spirals import direct_spiral, reverse_spiral
from tests.analysis.turning.cubic_ship import LENGTH_M, N_D, N_RRR, SPEED_MPS, STABLE, UNSTABLE, cubic_ship, rudder_rad


def responses(model):
    found = steering_responses(model, straight_course(model), stability(model).nomoto.dimensional)
    return {one.label: one for one in found}


def test_the_response_is_that_of_nomotos_transfer_function(mariner) -> None:
    found, nomoto = responses(mariner), stability(mariner).nomoto.dimensional
    s = control.tf("s")
    system = nomoto.K_per_s * (1 + nomoto.T3_s * s) / ((1 + nomoto.T1_s * s) * (1 + nomoto.T2_s * s))
    hull = found[HULL]
    np.testing.assert_allclose(hull.response, system(1j * hull.omega_radps), rtol=1e-8)
    with_gear = system / (1 + 1.0 * s)  # the gear of the card lags by 1 s
    np.testing.assert_allclose(found[GEAR].response, with_gear(1j * hull.omega_radps), rtol=1e-8)
    first = nomoto.K_per_s / (1 + 1j * hull.omega_radps * nomoto.T_s)
    np.testing.assert_allclose(found[FIRST_ORDER].response, first, rtol=1e-8)


def test_a_step_comes_to_the_gain_of_a_stable_ship_and_leaves_that_of_an_unstable_one(mariner) -> None:
    hull = responses(mariner)[HULL]
    assert hull.step_per_s[-1] == pytest.approx(hull.gain_per_s, rel=0.01)
    unstable = responses(cubic_ship(UNSTABLE))[HULL]
    assert max(unstable.poles.real) > 0 > unstable.gain_per_s and unstable.step_per_s[-1] > 0


@pytest.mark.parametrize("N_r", [STABLE, UNSTABLE])
def test_norrbin_and_bech_of_a_cubic_ship_are_her_own_coefficients(N_r: float) -> None:
    model = cubic_ship(N_r)
    found = steering_characteristic(steady_turning(model))
    assert found is not None
    time = LENGTH_M / SPEED_MPS
    b1, b3 = -N_r / N_D * time, -N_RRR / N_D * time**3
    np.testing.assert_allclose(found.bech.coefficients, [0, b1, 0, b3], rtol=1e-5, atol=1e-5 * abs(b1))
    np.testing.assert_allclose(
        found.norrbin.coefficients, [0, math.copysign(1, b1), 0, b3 / abs(b1)], rtol=1e-5, atol=1e-5
    )
    assert found.bech.error.largest_deg < 1e-3 and found.norrbin.error.largest_beyond_fit_deg < 1e-3
    assert found.norrbin.K_per_s == pytest.approx(abs(stability(model).nomoto.dimensional.K_per_s), rel=1e-6)


def test_the_error_of_a_cubic_is_reported_where_a_ship_is_none(mariner) -> None:
    found = steering_characteristic(steady_turning(mariner))
    assert found is not None
    bech, norrbin = found.bech.error, found.norrbin.error
    assert found.norrbin.n1 == 1.0 and 0.1 < bech.rms_deg < norrbin.rms_deg < 2
    assert bech.largest_beyond_fit_deg > bech.largest_deg


@pytest.mark.slow
def test_spirals_lie_on_the_diagram_the_reverse_one_on_its_unstable_branch_too() -> None:
    model = cubic_ship(UNSTABLE)
    turning = steady_turning(model)
    direct, reverse = direct_spiral(model, turning), reverse_spiral(model, turning, stability(model).nomoto.dimensional)
    assert reverse is not None and turning.loop is not None
    rate = abs(math.degrees(turning.folds[0].yaw_rate_radps))
    steady, reverse_steady = np.array(direct.steady), np.array(reverse.steady)
    assert steady.mean() > 0.8 and reverse_steady.mean() > 0.8
    assert np.all(np.abs(direct.yaw_rate_degps) > rate)
    assert np.all(direct.distance_to_diagram_degps[steady] < 0.05 * rate)
    held = np.abs(reverse.yaw_rate_degps) < rate
    assert held.sum() >= 2 and reverse_steady[held].all()
    expected = [rudder_rad(UNSTABLE, one) for one in np.radians(reverse.yaw_rate_degps[held])]
    np.testing.assert_allclose(np.radians(reverse.rudder_deg[held]), expected, atol=math.radians(0.02))


def test_a_curve_that_turns_back_between_two_of_its_points_is_used_up_to_there() -> None:
    rate = np.array([-4.0, -5.0, -3.0, -1.0, 0.0, 1.0, 3.0, 5.0, 4.0])
    rows = np.arange(len(rate))
    flat = np.zeros(len(rate))
    turning = SteadyTurning(
        rudder_rad=0.1 * (rows - 4.0),
        yaw_rate_radps=1e-3 * rate,
        speed_mps=flat,
        drift_rad=flat,
        heel_rad=None,
        growth_per_s=flat - 1,
        slope=np.tile([1.0, 1e-2], (len(rate), 1)),
        arc=0.1 * rows,
        straight=4,
        folds=(),
        loop=None,
        ended=("", ""),
        notices=(),
    )
    found = steering_characteristic(turning)
    assert found is not None
    assert found.curve.yaw_rate_degps[[0, -1]] == pytest.approx(np.degrees([-5e-3, 5e-3]))
