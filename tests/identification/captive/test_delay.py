"""Delays of gauges and models that are turned: found within their errors, taken out, or reported."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, lfilter

from tank2sim.identification.captive.findings import reduction_findings
from tank2sim.identification.captive.reduction import reduce_campaign
from tank2sim.identification.captive.uncertainty_budget import uncertainty_budget
from tank2sim.records.campaigns import read_campaign
from tests.identification.captive.generator import Campaign, write
from tests.marks import first_fast

ACCELERATIONS = ("Yvdot", "Yrdot", "Nvdot", "Nrdot")
DAMPING = ("Yv", "Nv", "Yr", "Nr")


def reduced_with_truth(campaign, folder):
    written = write(campaign, folder)
    return reduce_campaign(read_campaign(written.path)), written


def errors_over(found, written, names):
    derivatives = found.derivatives
    return [(derivatives[name].value - written.derivatives[name]) / derivatives[name].standard_error for name in names]


@first_fast("delay", [-0.05, 0.01, 0.1])
def test_a_delay_is_estimated_within_its_error_and_taken_out(tmp_path, delay):
    found, written = reduced_with_truth(Campaign(seed=21, rate_hz=10.0, force_delay_s=delay), tmp_path)
    (error,) = found.systematic
    assert error.corrected and error.force == "XYN"
    assert abs(found.delay.size - delay) < 3 * found.delay.standard_error
    assert found.delay.alike and found.delay.supported
    assert {(channel.force, channel.motion) for channel in found.delay.channels} == {
        (force, motion) for force in "YN" for motion in ("sway", "yaw")
    }
    for name in (*ACCELERATIONS, *DAMPING):
        derivative = found.derivatives[name]
        assert abs(derivative.value - written.derivatives[name]) < 3.5 * derivative.standard_error, name
    assert 0 < found.derivatives["Nrdot"].type_b["force_delay"] < 2 * found.derivatives["Nrdot"].type_a
    assert "CORRECTED" in reduction_findings(found)[0]


@pytest.mark.slow
@pytest.mark.parametrize("seed", [21, pytest.param(22, marks=pytest.mark.slow)])
def test_a_low_pass_filter_of_the_gauges_is_found_as_its_group_delay(tmp_path, seed):
    """A Butterworth filter of the second order and 2 Hz delays slow signals by sqrt(2)/(2 pi 2 Hz) = 0.1125 s."""
    written = write(Campaign(seed=seed, rate_hz=50.0, size="linear", part_periods=True), tmp_path)
    campaign = read_campaign(written.path)
    numerator, denominator = butter(2, 2.0, fs=50.0)

    def late(values):
        return lfilter(numerator, denominator, values - values[0]) + values[0]

    runs = [replace(run, X_N=late(run.X_N), Y_N=late(run.Y_N), N_Nm=late(run.N_Nm)) for run in campaign.runs]
    found = reduce_campaign(replace(campaign, runs=tuple(runs)))
    (error,) = found.systematic
    assert error.corrected
    assert abs(error.size - np.sqrt(2) / (2 * np.pi * 2.0)) < 3 * error.standard_error
    assert np.max(np.abs(errors_over(found, written, (*ACCELERATIONS, *DAMPING)))) < 3.0


@pytest.mark.slow
def test_without_a_delay_none_is_corrected_and_its_uncertainty_is_in_the_derivatives(tmp_path):
    found, _ = reduced_with_truth(Campaign(seed=21, rate_hz=10.0), tmp_path)
    assert not found.systematic
    assert abs(found.delay.size) < 3 * found.delay.standard_error
    assert found.derivatives["Nrdot"].type_b["force_delay"] > 0
    for name, derivative in found.derivatives.items():
        squares = derivative.type_a**2 + sum(size**2 for size in derivative.type_b.values())
        assert derivative.standard_error == pytest.approx(np.sqrt(squares), rel=1e-12), name


@pytest.mark.slow
def test_a_stated_uncertainty_of_the_delay_takes_the_place_of_the_estimated_one(tmp_path):
    written = write(Campaign(seed=21, rate_hz=10.0), tmp_path)
    written.path.write_text(written.path.read_text().replace("[test]", "[uncertainty]\nforce_delay_s = 0.0\n[test]"))
    found = reduce_campaign(read_campaign(written.path))
    assert "force_delay" not in found.derivatives["Nrdot"].type_b
    assert found.derivatives["Nrdot"].standard_error == found.derivatives["Nrdot"].type_a


def with_memory(campaign, written, kinds, share, time_s):
    """A share of the damping of some kinds of run follows the motion with a time constant: its exact response to a
    sinusoid. The body's inertia has no memory."""
    d, model, test = written.derivatives, campaign.model, campaign.test
    force = 0.5 * test.water_density_kgpm3 * model.length_m**2 * test.speed_mps**2
    changed = []
    for run in campaign.runs:
        late_run = run
        if run.type in kinds:
            omega = run.sheet.frequency_radps
            letter, motion = ("v", run.v_mps) if run.type == "pure_sway" else ("r", run.r_radps * model.length_m)
            prime = motion / test.speed_mps
            rate = np.gradient(prime, run.time_s)
            lag = 1.0 / (1.0 + (omega * time_s) ** 2)
            late = share * (lag * (prime - time_s * rate) - prime)
            late_run = replace(
                run,
                Y_N=run.Y_N + force * d[f"Y{letter}"] * late,
                N_Nm=run.N_Nm + force * model.length_m * d[f"N{letter}"] * late,
            )
        changed.append(late_run)
    return replace(campaign, runs=tuple(changed))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kinds", "share", "time_s", "seed"),
    [
        (("pure_sway",), 0.3, 0.8, 21),
        (("pure_yaw", "yaw_with_drift"), 0.3, 0.8, 22),
        pytest.param(("pure_sway", "pure_yaw", "yaw_with_drift"), 0.3, 0.8, 23, marks=pytest.mark.slow),
        (("pure_sway", "pure_yaw", "yaw_with_drift"), 0.5, 1.5, 21),
        pytest.param(("pure_sway", "pure_yaw", "yaw_with_drift"), 0.5, 1.5, 22, marks=pytest.mark.slow),
        pytest.param(("pure_sway", "pure_yaw", "yaw_with_drift"), 0.5, 1.5, 23, marks=pytest.mark.slow),
    ],
)
def test_memory_of_the_flow_is_not_taken_for_a_delay(tmp_path, kinds, share, time_s, seed):
    written = write(Campaign(seed=seed, rate_hz=10.0), tmp_path)
    found = reduce_campaign(with_memory(read_campaign(written.path), written, kinds, share, time_s))
    assert not any(error.corrected for error in found.systematic), (found.delay, found.systematic)


def test_oscillations_at_one_frequency_show_no_delay_and_say_what_it_would_do(tmp_path):
    found, _ = reduced_with_truth(
        Campaign(seed=21, rate_hz=10.0, frequency_parameters=(0.05,), force_delay_s=0.03), tmp_path
    )
    assert found.delay is None
    (sentence,) = [text for text in reduction_findings(found) if "whether the forces lag" in text]
    assert "10 ms would change Yvdot by" in sentence


@pytest.mark.slow
def test_a_delay_that_sway_alone_shows_is_reported_and_not_corrected(tmp_path):
    """Memory of the flow in sway would look the same."""
    written = write(Campaign(seed=21, rate_hz=10.0, force_delay_s=0.03), tmp_path)
    campaign = read_campaign(written.path)
    yaws = {run.name for run in campaign.runs if run.type in ("pure_yaw", "yaw_with_drift")}
    found = reduce_campaign(campaign.without(yaws))
    assert found.delay is not None and not found.delay.supported
    (error,) = [error for error in found.systematic if error.source == "force_delay"]
    assert not error.corrected
    assert abs(error.size - 0.03) < 4 * error.standard_error
    derivative = found.derivatives["Yvdot"]
    assert derivative.type_b["force_delay"] > 3 * derivative.type_a
    assert abs(derivative.value - written.derivatives["Yvdot"]) < 1.96 * derivative.standard_error


FEW, MANY = (range(200, 206), 0.88, 1.0), (range(200, 220), 0.90, 0.985)


@pytest.mark.parametrize(
    ("delay", "seeds", "least", "most"),
    [
        *(pytest.param(delay, *MANY, marks=pytest.mark.long) for delay in (-0.03, 0.0, 0.0015, 0.03)),
        *(pytest.param(delay, *FEW, marks=pytest.mark.slow) for delay in (0.0, 0.03)),
    ],
)
def test_intervals_cover_the_truth_with_any_delay(tmp_path, delay, seeds, least, most):
    """The bounds of few campaigns are wider, as chance makes them."""
    ratios, of_delay = [], []
    for seed in seeds:
        found, written = reduced_with_truth(
            Campaign(seed=seed, rate_hz=10.0, force_delay_s=delay), tmp_path / str(seed)
        )
        ratios += errors_over(found, written, (*ACCELERATIONS, *DAMPING))
        of_delay.append((found.delay.size - delay) / found.delay.standard_error)
    covered = np.mean(np.abs(ratios) < 1.96)
    assert least <= covered <= most, covered
    # Of normal errors of size 1 the spread of 20 lies within 0.6 to 1.5, and that of 6 within 0.3 to 1.75.
    low, high = (0.6, 1.5) if len(seeds) == 20 else (0.3, 1.75)
    assert low < np.std(of_delay) < high and np.abs(np.mean(of_delay)) < 4 / np.sqrt(len(of_delay))


def turned(folder, angle_deg, seed=7, stated="", **changes):
    """A campaign whose recorded drift is less than the true one by an angle, and the truth behind it."""
    written = write(Campaign(seed=seed, rate_hz=5.0, **changes), folder)
    written.path.write_text(written.path.read_text().replace("[test]", f"{stated}[test]", 1))
    campaign = read_campaign(written.path)
    shift = math.sin(math.radians(angle_deg))
    runs = tuple(replace(run, v_mps=run.v_mps + shift * run.speed_mps) for run in campaign.runs)
    return reduce_campaign(replace(campaign, runs=runs)), written


@first_fast("angle_deg", [0.4, -0.4])
def test_a_model_that_is_turned_shows_its_angle_in_both_forces(tmp_path, angle_deg):
    found, _ = turned(tmp_path, angle_deg)
    estimate = found.alignment
    assert estimate.shown
    assert abs(estimate.angle_rad - math.radians(angle_deg)) < 4 * estimate.standard_error_rad
    assert any("turned by" in sentence for sentence in reduction_findings(found))
    for name in ("Y0", "N0"):  # both are zero in truth
        derivative = found.derivatives[name]
        assert abs(derivative.value) < 1.96 * derivative.standard_error
        assert abs(derivative.value) > 4 * derivative.type_a
    rows = uncertainty_budget(found).derivatives
    assert rows["Y0"].shares["alignment"] > 0.8
    assert rows["Y0"].combined == pytest.approx(found.derivatives["Y0"].standard_error)


@pytest.mark.slow
def test_a_stated_alignment_takes_the_place_of_the_one_shown(tmp_path):
    found, _ = turned(tmp_path, 0.4, stated="[uncertainty]\nalignment_deg = 0.5\n")
    assert "alignment" not in found.derivatives["Y0"].type_b
    shifts = found.derivatives["Y0"].value / found.derivatives["Y0"].type_b["alignment_rad"]
    assert abs(shifts) == pytest.approx(0.4 / 0.5, rel=0.15)  # Y0 is all of 0.4 deg
    assert not any("turned by" in sentence for sentence in reduction_findings(found))


@pytest.mark.slow
def test_an_aligned_model_shows_none_and_its_error_is_honest(tmp_path):
    ratios = []
    for seed in range(20, 24):
        found, _ = turned(tmp_path / str(seed), 0.0, seed, size="linear")
        assert not found.alignment.shown
        assert "alignment" not in found.derivatives["Y0"].type_b
        ratios.append(found.alignment.angle_rad / found.alignment.standard_error_rad)
    assert 0.17 < np.std(ratios) < 1.7  # as 98 % of the spreads of 4 normal errors of size 1


@pytest.mark.slow
@pytest.mark.parametrize("seed", [7, 8, 9])
def test_a_single_screw_is_not_taken_for_a_turned_model(tmp_path, seed):
    found, _ = turned(tmp_path, 0.0, seed, asymmetry=True)
    assert not found.alignment.shown
    assert "alignment" not in found.derivatives["Y0"].type_b
