"""Frequency, whole periods and smooth histories of a run, from its record alone."""

import numpy as np
import pytest

from tank2sim.errors import InputError
from tank2sim.identification.captive.motion import measured_frequency, run_motion
from tank2sim.records.campaign_form import RunSheet
from tank2sim.records.captive_record import CaptiveRun


def sway(frequency=0.7, amplitude=0.1, duration=60.0, phase=0.4, noise=0.0, said=0.5):
    time = np.arange(0.0, duration, 0.05)
    rng = np.random.default_rng(3)
    zero = np.zeros_like(time)
    y = amplitude * np.sin(frequency * time + phase) + noise * rng.standard_normal(len(time))
    v = amplitude * frequency * np.cos(frequency * time + phase) + noise * rng.standard_normal(len(time))
    return CaptiveRun(
        name="sway.csv",
        type="pure_sway",
        sheet=RunSheet(file="sway.csv", type="pure_sway", frequency_radps=said),
        time_s=time,
        v_mps=v,
        r_radps=zero,
        speed_mps=zero + 1.2,
        delta_rad=zero,
        X_N=zero,
        Y_N=zero,
        N_Nm=zero,
        y_m=y,
        psi_rad=zero,
    )


@pytest.mark.parametrize("frequency", [0.25, 0.7, 2.3])
@pytest.mark.parametrize("duration", [41.3, 60.0])
def test_the_frequency_is_that_of_the_motion_and_not_of_the_sheet(frequency, duration):
    assert measured_frequency(sway(frequency, duration=duration)) == pytest.approx(frequency, rel=1e-9)


def test_the_frequency_survives_noise():
    assert measured_frequency(sway(noise=0.02)) == pytest.approx(0.7, rel=1e-3)


def test_whole_periods_are_kept_and_time_begins_at_the_greatest_velocity():
    motion = run_motion(sway(0.7, duration=50.0))
    assert motion.periods == 5
    assert len(motion.time_s) * 0.05 == pytest.approx(5 * 2 * np.pi / 0.7, abs=0.03)
    np.testing.assert_allclose(motion.v_mps, 0.07 * np.cos(0.7 * motion.time_s), atol=1e-9)
    np.testing.assert_allclose(motion.vdot_mps2, -0.049 * np.sin(0.7 * motion.time_s), atol=1e-9)


def test_a_record_that_ends_a_sample_short_still_has_its_last_period():
    assert run_motion(sway(0.7, duration=6 * 2 * np.pi / 0.7)).periods == 6


def test_less_than_a_period_is_refused_with_the_name_of_the_run():
    with pytest.raises(InputError, match=r"sway\.csv: has 0\.[67]\d of a period.*one whole period"):
        run_motion(sway(0.1, duration=40.0))


def test_a_run_that_does_not_oscillate_is_refused():
    with pytest.raises(InputError, match=r"column v_mps: does not change"):
        run_motion(sway(amplitude=0.0))


@pytest.mark.parametrize("periods", [1.0, 1.02, 1.3])
def test_one_whole_period_is_enough(periods):
    motion = run_motion(sway(0.7, duration=periods * 2 * np.pi / 0.7, noise=1e-4))
    assert motion.periods == 1
    assert motion.frequency_radps == pytest.approx(0.7, rel=5e-3)
