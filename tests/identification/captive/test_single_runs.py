"""One run by itself: Fourier coefficients with honest errors, averaged cycle, repeats; against known records."""

import math
from typing import get_args

import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.api.captive_run import SHORT_TYPES, RunName
from tank2sim.records.campaign_form import RUN_TYPES
from tests.identification.captive.generator import Campaign, write
from tests.identification.captive.made_runs import COEFFICIENTS, FREQUENCY, RATE, SPEED, oscillation

FORCES = {"X": "X_N", "Y": "Y_N", "N": "N_Nm"}


def truth(force, order):
    return COEFFICIENTS[FORCES[force]].get(order, (0.0, 0.0))


def test_coefficients_without_noise_are_exact(tmp_path):
    (run,) = t2s.reduce_runs(oscillation(tmp_path, noise=0.0), type="pure_yaw").runs
    for force in FORCES:
        for order in range(6):
            found = run.coefficient(force, order)
            assert (found.cosine, found.sine) == pytest.approx(truth(force, order), abs=2e-5)
            assert found.unit == ("N m" if force == "N" else "N")
    assert run.coefficient("r", 1).cosine == pytest.approx(RATE, rel=1e-7)
    assert run.coefficient("speed", 0).cosine == pytest.approx(SPEED)
    assert run.frequency_radps == pytest.approx(FREQUENCY, rel=1e-6)


def test_amplitude_and_phase_are_those_of_the_coefficients(tmp_path):
    (run,) = t2s.reduce_runs(oscillation(tmp_path, noise=0.0), type="pure_yaw").runs
    found = run.coefficient("Y", 1)
    assert found.amplitude == pytest.approx(math.hypot(25.0, 7.0), rel=1e-6)
    assert found.phase_rad == pytest.approx(math.atan2(-7.0, 25.0), abs=1e-6)  # 25 cos - 7 sin = a cos(wt - phase)


def test_errors_of_coefficients_amplitudes_and_phases_are_honest(tmp_path):
    ratios = []
    for number in range(40):
        (run,) = t2s.reduce_runs(oscillation(tmp_path, f"{number}.csv", noise=0.5), type="pure_yaw").runs
        for force in FORCES:
            for order in (0, 1, 3):
                found, (cosine, sine) = run.coefficient(force, order), truth(force, order)
                ratios.append((found.cosine - cosine) / found.cosine_error)
                if order:
                    ratios.append((found.sine - sine) / found.sine_error)
        found = run.coefficient("Y", 1)
        ratios.append((found.amplitude - math.hypot(25.0, 7.0)) / found.amplitude_error)
        ratios.append((found.phase_rad - math.atan2(-7.0, 25.0)) / found.phase_error_rad)
    assert 0.92 < np.mean(np.abs(ratios) < 1.96) < 0.98
    assert np.std(ratios) == pytest.approx(1.0, abs=0.15)


def test_the_averaged_cycle_is_the_force_over_the_phase_and_its_scatter_the_noise(tmp_path):
    result = t2s.reduce_runs(oscillation(tmp_path, noise=0.5, periods=30.2), type="pure_yaw")
    cycle = result.cycle()
    phase = np.radians(cycle["phase_deg"].to_numpy())
    true = sum(a * np.cos(n * phase) + b * np.sin(n * phase) for n, (a, b) in COEFFICIENTS["N_Nm"].items())
    assert np.abs(cycle["N_fit"] - true).max() < 0.15
    assert np.sqrt(np.mean((cycle["N_mean"] - true) ** 2)) == pytest.approx(0.5 / np.sqrt(37), rel=0.3)
    assert np.sqrt(np.mean(cycle["N_deviation"] ** 2)) == pytest.approx(0.5, rel=0.05)
    assert result.runs[0].residual_rms["N"] == pytest.approx(0.5, rel=0.05)


def test_the_averaged_cycle_shows_what_the_harmonics_lack(tmp_path):
    file = oscillation(tmp_path, noise=0.0, periods=20.2)
    table = np.loadtxt(file, delimiter=",", skiprows=1)
    header = file.read_text().splitlines()[0]
    phase = FREQUENCY * table[:, 0] + 1.1
    table[:, header.split(",").index("X_N")] += 0.8 * np.cos(7 * phase)
    np.savetxt(file, table, delimiter=",", header=header, comments="", fmt="%.9g")
    cycle = t2s.reduce_runs(file, type="pure_yaw").cycle()
    seventh = 0.8 * np.cos(7 * np.radians(cycle["phase_deg"]))
    assert np.abs(cycle["X_mean"] - cycle["X_fit"] - seventh).max() < 0.1


def test_repeats_that_differ_are_named_and_those_that_do_not_are_not(tmp_path):
    same = [oscillation(tmp_path, name) for name in ("a.csv", "b.csv", "c.csv")]
    result = t2s.reduce_runs(same, type="pure_yaw")
    assert len(result.repeats) == 33
    assert sum(row.chance < 0.01 for row in result.repeats) <= 2
    other = [*same, oscillation(tmp_path, "d.csv", change=0.5)]
    differs = [row for row in t2s.reduce_runs(other, type="pure_yaw").repeats if row.chance < 1e-6]
    assert [(row.signal, row.order, row.part) for row in differs] == [("Y", 1, "cos")]
    assert differs[0].deviation == pytest.approx(0.25, rel=0.1)  # one of four by 0.5


def test_runs_of_different_tests_are_not_compared(tmp_path):
    made = write(Campaign(seed=3, size="linear", rate_hz=5.0), tmp_path)
    files = [made.path.parent / name for name in ("yaw_00.csv", "yaw_01.csv")]
    result = t2s.reduce_runs(files, campaign=made.path)
    assert not result.repeats and any("different tests" in notice for notice in result.notices)


def test_the_inertia_of_the_model_is_removed_with_a_campaign(tmp_path):
    made = write(Campaign(seed=3, size="linear", rate_hz=5.0, noise=0.0, zero_error=0.0, vibration=False), tmp_path)
    file = made.path.parent / "yaw_00.csv"
    (run,) = t2s.reduce_runs(file, campaign=made.path).runs
    ship, d = made.ship, made.derivatives
    q, length, speed = ship.force_N, ship.length_m, ship.speed_mps
    rate, omega = run.coefficient("r", 1).cosine, run.frequency_radps
    assert run.coefficient("N_water", 1).cosine == pytest.approx(q * length * d["Nr"] * rate * length / speed, rel=1e-4)
    acceleration = -rate * omega * length**2 / speed**2
    assert run.coefficient("N_water", 1).sine == pytest.approx(q * length * d["Nrdot"] * acceleration, rel=1e-3)
    assert run.derivatives.values["Nrdot"] == pytest.approx(d["Nrdot"], rel=1e-3)
    recorded = q * length * d["Nrdot"] * acceleration + ship.yaw_inertia_kgm2 * rate * omega
    assert run.coefficient("N", 1).sine == pytest.approx(recorded, rel=1e-3)


@pytest.mark.parametrize(
    ("name", "type_name", "kind"),
    [
        ("drift_+04.csv", "drift", "static_drift"),
        ("rudder_+10.csv", "rudder", "static_rudder"),
        ("drift_+00.csv", "straight", "static_drift"),
        ("sway_00.csv", "pure_sway", "pure_sway"),
        ("sway_00.csv", None, "pure_sway"),
        ("both_+08_-20.csv", "combined", "drift_and_rudder"),
        ("yawdrift_01_+04.csv", "combined", "yaw_with_drift"),
    ],
)
def test_every_type_of_run_is_reduced(made_campaign, name, type_name, kind):
    (run,) = t2s.reduce_runs(made_campaign.path.parent / name, type=type_name, campaign=made_campaign.path).runs
    assert run.type == kind
    assert not run.faults
    assert bool(run.cycles) == kind.startswith(("pure", "yaw"))


@pytest.fixture(scope="module")
def made_campaign(tmp_path_factory):
    return write(Campaign(seed=3, rate_hz=5.0), tmp_path_factory.mktemp("made"))


def test_what_is_missing_is_asked_for(tmp_path):
    file = oscillation(tmp_path)
    for options, source in (
        ({}, "type"),
        ({"type": "yaw"}, "type"),
        ({"type": "pure_yaw", "force_convention": "mine"}, "force_convention"),
    ):
        with pytest.raises(t2s.InputError) as error:
            t2s.reduce_runs(file, **options)
        assert error.value.source == source
    text = file.read_text().splitlines()
    bare = tmp_path / "bare.csv"
    bare.write_text("\n".join(",".join(line.split(",")[:3] + line.split(",")[4:]) for line in text))
    with pytest.raises(t2s.InputError, match="speed"):
        t2s.reduce_runs(bare, type="pure_yaw")
    assert t2s.reduce_runs(bare, type="pure_yaw", speed_mps=SPEED).runs
    with pytest.raises(t2s.InputError, match="does not oscillate"):
        t2s.reduce_runs(file, type="straight").cycle()


def test_forces_on_the_model_have_the_other_sign(tmp_path):
    file = oscillation(tmp_path, noise=0.0)
    (run,) = t2s.reduce_runs(file, type="pure_yaw", force_convention="on_model").runs
    assert run.coefficient("Y", 1).cosine == pytest.approx(-25.0, abs=1e-4)


def test_each_type_of_a_campaign_is_a_type_of_a_single_run() -> None:
    assert set(get_args(RunName)) == {*RUN_TYPES, *SHORT_TYPES, "combined"}
