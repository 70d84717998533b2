"""Runs of the yaw rig under its controllers, against papers.md 3.5 and what a digital controller does."""

from dataclasses import replace

import numpy as np
import pytest
from alyshev_rigs import ELLIPSOID_T1, SHIP_T1, SHIP_T2

from tank2sim.apps.rigs.yaw.programme import PAPER_PROGRAMME, dissipation_from_work, inertia_from_work
from tank2sim.apps.rigs.yaw.simulation import AdaptiveController, Measuring, TunedController, run_yaw_rig
from tank2sim.errors import InputError

EXACT = Measuring(encoder=False)
START = TunedController(inertia_kgm2=0.0505)


@pytest.fixture(scope="module")
def ellipsoid():
    return run_yaw_rig(ELLIPSOID_T1, PAPER_PROGRAMME, START, EXACT)


def last_pair(run, rig, *, reference):
    """lambda661 of (1) and B + D of (2), 1e-4 SI, from the last pair."""
    works, ends = [], []
    for begin, end in run.programme.pairs()[-1]:
        t = np.linspace(begin, end, 2001)
        own = run.programme.at(t).rate_radps if reference else np.interp(t, run.time_s, run.true_rate_radps)
        works.append(0.051 * np.trapezoid(own * np.interp(t, run.time_s, run.current_A), t))
        ends.append(own[[0, -1]])
    return 1e4 * (inertia_from_work(*works, *ends[0]) - rig.inertia_kgm2), 1e4 * dissipation_from_work(*works)


@pytest.mark.parametrize(
    ("rig", "actual", "programmed", "lost", "error"),
    [
        (ELLIPSOID_T1, 298.3, 287.8, (8.40, 8.47), 0.0081),
        pytest.param(SHIP_T1, 279.7, 270.0, (12.04, 12.18), 0.0106, marks=pytest.mark.slow),
        pytest.param(SHIP_T2, 502.8, 488.6, (16.75, 16.98), 0.0103, marks=pytest.mark.slow),
    ],
)
def test_controller_4_gives_the_papers_table(rig, actual, programmed, lost, error):
    run = run_yaw_rig(rig, PAPER_PROGRAMME, START, EXACT)
    for reference, value, dissipation in ((False, actual, lost[0]), (True, programmed, lost[1])):
        found = last_pair(run, rig, reference=reference)
        assert found[0] == pytest.approx(value, abs=1.0)
        assert found[1] == pytest.approx(dissipation, abs=0.02)
    settled = run.time_s > 4 * PAPER_PROGRAMME.period_s
    assert np.abs(run.error_rad[settled]).max() == pytest.approx(error, abs=3e-4)


def test_gains_settle_at_inertia_and_friction_over_lag(ellipsoid):
    gains = ellipsoid.gains[-1]
    assert gains["K_D"] == pytest.approx(0.0505 / (0.055 * 0.051), rel=0.05)
    assert abs(gains["K_D"] / ellipsoid.gains[-2]["K_D"] - 1) < 1e-3
    assert 0.2 < gains["K_P"] / gains["K_D"] < 0.7  # a2 of the linearised friction, not the 0.1 a1 of the start


def test_first_gains_as_printed_are_exchanged():
    right, printed = START.first_gains(0.055, 0.051), replace(START, as_printed=True).first_gains(0.055, 0.051)
    assert right == printed[::-1]
    assert right[1] == pytest.approx(0.0505 / (0.055 * 0.051)) and right[0] == pytest.approx(0.1 * right[1])


def test_the_encoder_counts_whole_pulses_and_never_ahead(ellipsoid):
    run = run_yaw_rig(ELLIPSOID_T1, replace(PAPER_PROGRAMME, humps=1), START)
    pulse = 2 * np.pi / 3000
    counts = run.angle_rad / pulse
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-9)
    assert np.all((run.true_angle_rad - run.angle_rad >= -1e-12) & (run.true_angle_rad - run.angle_rad < pulse))


def test_turning_to_port_is_the_mirror_image(ellipsoid):
    port = run_yaw_rig(
        ELLIPSOID_T1, replace(PAPER_PROGRAMME, max_rate_radps=-PAPER_PROGRAMME.max_rate_radps), START, EXACT
    )
    np.testing.assert_allclose(port.true_angle_rad, -ellipsoid.true_angle_rad, atol=1e-9)
    np.testing.assert_allclose(port.current_A, -ellipsoid.current_A, atol=1e-9)


def test_a_rig_that_saturates_the_motor_says_when():
    weak = ELLIPSOID_T1.model_copy(update={"max_current_A": 0.1})
    with pytest.raises(InputError, match=r"saturates the motor, first at \d+\.\d{3} s .* 0\.1 A is available"):
        run_yaw_rig(weak, PAPER_PROGRAMME, START, EXACT)
    run = run_yaw_rig(weak, PAPER_PROGRAMME, START, EXACT, allow_saturation=True)
    assert run.saturation and 0.5 < run.saturation.first_s < 4.5
    assert np.abs(run.true_current_A).max() <= 0.1


def test_tuning_as_printed_takes_the_wrong_limits_for_the_inertia():
    printed = replace(START, as_printed=True, inertia_kgm2=0.03)
    run = run_yaw_rig(ELLIPSOID_T1, replace(PAPER_PROGRAMME, humps=2), printed, EXACT, allow_saturation=True)
    right = 0.0505 / (0.055 * 0.051)
    assert abs(run.gains[-1]["K_D"] / right - 1) > 0.1  # the motor works against the water there, and does not brake


@pytest.mark.slow
def test_the_adaptive_controller_raises_its_gain_until_the_error_is_small():
    run = run_yaw_rig(ELLIPSOID_T1, PAPER_PROGRAMME, AdaptiveController(), EXACT, allow_saturation=True)
    assert 40 < run.memory[1] < 70  # papers.md 3.5: about 50 to 65
    assert np.abs(run.error_rad[run.time_s > 4 * PAPER_PROGRAMME.period_s]).max() < 0.015


def test_noise_is_that_asked_for_and_the_same_again():
    noisy = Measuring(current_noise_A=0.01, seed=3)
    one, again = (run_yaw_rig(ELLIPSOID_T1, replace(PAPER_PROGRAMME, humps=1), START, noisy) for _ in range(2))
    assert np.std(one.current_A - one.true_current_A) == pytest.approx(0.01, rel=0.05)
    np.testing.assert_array_equal(one.current_A, again.current_A)
