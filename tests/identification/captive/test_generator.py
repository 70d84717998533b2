"""The generator is itself held against formulas of paper 2 that it does not use, and against physics."""

import math
import tomllib
from dataclasses import replace

import numpy as np
import pytest

from tests.identification.captive.generator import (
    DENSITY,
    Campaign,
    Motion,
    disturbances,
    gauge_forces,
    hydrodynamic_forces,
    motion,
    plan,
    ship,
    write,
)

QUIET = Campaign(seed=5, noise=0.0, zero_error=0.0, size="linear")


def record(campaign, name):
    """Motion and gauge forces of a run, without noise."""
    model = ship(campaign)
    run = next(run for run in plan(campaign, model) if run.name == name)
    m = motion(campaign, model, run, np.random.default_rng(0))
    return model, run, m, gauge_forces(campaign, model, m)


def in_phase_and_quadrature(values, phase):
    """A and B of A cos + B sin, over whole periods."""
    return 2 * np.mean(values * np.cos(phase)), 2 * np.mean(values * np.sin(phase))


@pytest.mark.parametrize("convention", ["on_model", "on_gauge"])
def test_pure_sway_gives_its_derivatives_back_by_the_printed_formulas(convention):
    campaign = replace(QUIET, force_convention=convention, rate_hz=100.0)
    model, run, m, (_, Y, N) = record(campaign, "sway_11")
    sign = {"on_model": 1.0, "on_gauge": -1.0}[convention]
    speed_amplitude = run.frequency * run.amplitude
    Y_A, Y_B = in_phase_and_quadrature(sign * Y, run.frequency * m.t)
    N_A, N_B = in_phase_and_quadrature(sign * N, run.frequency * m.t)
    L, U, d = model.length_m, model.speed_mps, model.derivatives
    found = {
        "Yv": -Y_A / speed_amplitude / (0.5 * DENSITY * L**2 * U),
        "Nv": -N_A / speed_amplitude / (0.5 * DENSITY * L**3 * U),
        "Yvdot": (model.mass_kg + Y_B / (speed_amplitude * run.frequency)) / (0.5 * DENSITY * L**3),
        "Nvdot": (model.mass_kg * model.x_G_m + N_B / (speed_amplitude * run.frequency)) / (0.5 * DENSITY * L**4),
    }
    scale = {"Y": abs(d["Yv"]), "N": abs(d["Nv"])}
    for name, value in found.items():
        assert value == pytest.approx(d[name], abs=2e-3 * scale[name[0]]), name


def test_pure_yaw_gives_its_derivatives_back():
    campaign = replace(QUIET, rate_hz=100.0)
    model, run, m, (_, Y, N) = record(campaign, "yaw_11")
    Y_A, Y_B = in_phase_and_quadrature(Y, run.frequency * m.t)
    N_A, N_B = in_phase_and_quadrature(N, run.frequency * m.t)
    L, U, d, r, w = model.length_m, model.speed_mps, model.derivatives, run.amplitude, run.frequency
    mass, x_G = model.mass_kg, model.x_G_m
    found = {
        "Yr": (mass * U - Y_A / r) / (0.5 * DENSITY * L**3 * U),
        "Nr": (mass * x_G * U - N_A / r) / (0.5 * DENSITY * L**4 * U),
        "Yrdot": (mass * x_G + Y_B / (r * w)) / (0.5 * DENSITY * L**4),
        "Nrdot": (model.yaw_inertia_kgm2 + N_B / (r * w)) / (0.5 * DENSITY * L**5),
    }
    for name, value in found.items():
        assert value == pytest.approx(d[name], abs=3e-3 * abs(d["Nr"])), name


def test_a_static_table_has_the_linear_slopes_and_signs_of_a_ship():
    model, _, _, (_, Y, N) = record(replace(QUIET, force_convention="hydrodynamic"), "drift_+02")
    assert Y[0] > 0 and N[0] > 0  # flow from port pushes to starboard and turns the bow away
    assert Y[0] / model.force_N == pytest.approx(-model.derivatives["Yv"] * math.sin(math.radians(2)))
    _, _, _, (_, Y, N) = record(replace(QUIET, force_convention="hydrodynamic"), "rudder_+10")
    assert N[0] > 0 > Y[0]  # a rudder to starboard turns to starboard


def test_mirrored_motions_have_mirrored_forces_without_single_screw_asymmetry():
    campaign = Campaign(seed=9, size="small")
    model = ship(campaign)
    run = next(run for run in plan(campaign, model) if run.name == "yawdrift_02_+10")
    m = motion(campaign, model, run, np.random.default_rng(0))
    mirrored = replace(m, **{name: -getattr(m, name) for name in "y psi v r v_dot r_dot rudder".split()})
    there, back = gauge_forces(campaign, model, m), gauge_forces(campaign, model, mirrored)
    np.testing.assert_allclose(there, np.array([1, -1, -1])[:, None] * back, rtol=1e-12)
    lopsided = ship(replace(campaign, asymmetry=True))
    uneven = gauge_forces(campaign, lopsided, m)[1] + gauge_forces(campaign, lopsided, mirrored)[1]
    np.testing.assert_allclose(uneven, -2 * lopsided.derivatives["Y0"] * model.force_N, rtol=1e-9)


def test_impulse_of_all_forces_is_the_change_of_momentum_of_a_rigid_body():
    """(3.1) against Newton in earth-fixed axes: the centre of gravity's momentum and the moment about it."""
    campaign = replace(Campaign(seed=3, force_convention="on_model"), surge="resolved")
    model = ship(campaign)
    t = np.linspace(0, 20, 200001)
    r, r_dot = 0.1 * np.cos(0.4 * t), -0.04 * np.sin(0.4 * t)
    psi = 0.25 * np.sin(0.4 * t)
    u, u_dot = 1.2 + 0.1 * np.sin(0.3 * t), 0.03 * np.cos(0.3 * t)
    v, v_dot = 0.2 * np.cos(0.7 * t), -0.14 * np.sin(0.7 * t)
    m = Motion(t, 0 * t, psi, v, r, np.hypot(u, v), u, u_dot, v_dot, r_dot, 0 * t)
    X, Y, N = gauge_forces(campaign, model, m) + hydrodynamic_forces(model, m)
    north, east = X * np.cos(psi) - Y * np.sin(psi), X * np.sin(psi) + Y * np.cos(psi)
    v_G = v + model.x_G_m * r
    momentum_north = model.mass_kg * (u * np.cos(psi) - v_G * np.sin(psi))
    momentum_east = model.mass_kg * (u * np.sin(psi) + v_G * np.cos(psi))
    inertia_G = model.yaw_inertia_kgm2 - model.mass_kg * model.x_G_m**2
    for force, momentum in (
        (north, momentum_north),
        (east, momentum_east),
        (N - model.x_G_m * Y, inertia_G * r),
    ):
        assert np.sum(force[1:] + force[:-1]) * (t[1] - t[0]) / 2 == pytest.approx(
            momentum[-1] - momentum[0], abs=1e-6 * np.ptp(momentum)
        )


@pytest.mark.parametrize("surge", ["carriage", "resolved"])
@pytest.mark.parametrize("name", ["sway_02", "yaw_02", "yawdrift_02_+10", "drift_+08"])
def test_velocities_and_accelerations_belong_together(surge, name):
    campaign = Campaign(seed=4, speed_fluctuation=0.01, surge=surge, part_periods=True, rate_hz=200.0)
    _, _, m, _ = record(campaign, name)
    for value, rate in ((m.v, m.v_dot), (m.r, m.r_dot), (m.u, m.u_dot), (m.psi, m.r)):
        np.testing.assert_allclose(np.gradient(value, m.t)[1:-1], rate[1:-1], atol=2e-4)
    if surge == "resolved":
        np.testing.assert_allclose(m.u**2 + m.v**2, m.speed**2)


def test_noise_has_the_stated_size_correlation_and_zero_error():
    model, t = ship(QUIET), np.arange(0, 400, 0.05)
    campaign = Campaign(seed=1, vibration=False, correlation_time_s=0.5, zero_error=0.0)
    noise = disturbances(campaign, model, t, np.random.default_rng(1))
    usual = 1.8e-4 * model.force_N
    assert noise.std(axis=1) == pytest.approx([usual, usual, 0.3 * model.length_m * usual], rel=0.1)
    later = np.corrcoef(noise[1, :-10], noise[1, 10:])[0, 1]  # half a second later
    assert later == pytest.approx(0.5 * math.exp(-1), abs=0.08)
    zeros = [
        disturbances(Campaign(seed=1, noise=0.0), model, t, np.random.default_rng(k))[1].mean() for k in range(400)
    ]
    assert np.std(zeros) == pytest.approx(usual / 6, rel=0.12)


def test_a_campaign_is_written_as_the_sheet_says_and_again_the_same(tmp_path):
    faults = {"sway_00": "missing", "yaw_00": "short", "sway_11": "wrong type"}
    campaign = replace(QUIET, noise=1.0, sheet_error=0.02, part_periods=True, faults=faults)
    written = write(campaign, tmp_path / "one")
    again = write(campaign, tmp_path / "two")
    sheet = tomllib.loads(written.path.read_text())
    assert [run["file"] for run in sheet["runs"]] == [f"{run.name}.csv" for run in written.runs]
    missing = [run["file"] for run in sheet["runs"] if not (written.path.parent / run["file"]).exists()]
    assert missing == ["sway_00.csv"]
    assert {run["file"]: run["type"] for run in sheet["runs"]}["sway_11.csv"] == "pure_yaw"
    rows = len(np.genfromtxt(tmp_path / "one" / "yaw_00.csv", delimiter=",", skip_header=1))
    period = 2 * math.pi / next(run.frequency for run in sheet_runs(sheet) if run.name == "yaw_00")
    assert rows / campaign.rate_hz < period
    assert (tmp_path / "one" / "yaw_11.csv").read_bytes() == (again.path.parent / "yaw_11.csv").read_bytes()
    on_sheet = next(run for run in sheet_runs(sheet) if run.name == "yaw_11").frequency
    true = next(run for run in written.runs if run.name == "yaw_11").frequency
    assert 0 < abs(on_sheet / true - 1) < 0.03


def sheet_runs(sheet):
    class Entry:
        def __init__(self, run):
            self.name, self.frequency = run["file"].removesuffix(".csv"), run.get("frequency_radps", 0.0)

    return [Entry(run) for run in sheet["runs"]]
