"""Single oscillation runs against the formulas (4.4) of paper 2 and its like for yaw, written out here."""

from dataclasses import replace

import numpy as np
import pytest

from tank2sim.identification.captive.harmonics import moderated, reduced_run
from tank2sim.identification.captive.oscillation import cubic_findings, cubics, oscillations
from tank2sim.records.campaigns import read_campaign

LENGTH, MASS, INERTIA, X_G, SPEED, RHO = 4.0, 400.0, 420.0, 0.1, 1.2, 1000.0
SWAY = {"Yv": -250.0, "Yvdot": -330.0, "Nv": -300.0, "Nvdot": 25.0, "Yvvv": -900.0, "Nvvv": 200.0}
YAW = {"Yr": 90.0, "Yrdot": -30.0, "Nr": -420.0, "Nrdot": -310.0, "Yrrr": 200.0, "Nrrr": -150.0}
SCALE = 0.5 * RHO


def prime(name, value):
    arm = 1 if name[0] == "N" else 0
    if name.endswith("dot"):
        return value / (SCALE * LENGTH ** (3 + arm + (name[1] == "r")))
    power = len(name) - 1
    turning = power if name[1] == "r" else 0
    return value / (SCALE * LENGTH ** (2 + arm + turning) * SPEED ** (2 - power))


def folder(tmp_path, convention, amplitudes=(0.1, 0.2)):
    sign = {"on_model": 1.0, "on_gauge": -1.0, "hydrodynamic": -1.0}[convention]
    own = 0.0 if convention == "hydrodynamic" else 1.0
    text = f"""[model]
name = "made up"
length_m = {LENGTH}
mass_kg = {MASS}
yaw_inertia_kgm2 = {INERTIA}
x_G_m = {X_G}
[test]
speed_mps = {SPEED}
force_convention = "{convention}"
"""
    for n, amplitude in enumerate(amplitudes):
        frequency = 0.6 + 0.2 * n
        time = np.arange(0, 5 * 2 * np.pi / frequency, 0.05)
        cos, sin, zero = np.cos(frequency * time), np.sin(frequency * time), np.zeros_like(time)
        v, a = amplitude * cos, -amplitude * frequency * sin
        Y = own * MASS * a - SWAY["Yvdot"] * a - SWAY["Yv"] * v - SWAY["Yvvv"] * v**3
        N = own * MASS * X_G * a - SWAY["Nvdot"] * a - SWAY["Nv"] * v - SWAY["Nvvv"] * v**3
        rows = {"sway": (amplitude / frequency * sin, zero, v, zero, Y + 3.0 + 0.02 * time, N - 1.0)}
        Y = own * MASS * (SPEED * v + X_G * a) - YAW["Yrdot"] * a - YAW["Yr"] * v - YAW["Yrrr"] * v**3
        N = own * (INERTIA * a + MASS * X_G * SPEED * v) - YAW["Nrdot"] * a - YAW["Nr"] * v - YAW["Nrrr"] * v**3
        rows["yaw"] = (zero, amplitude / frequency * sin, zero, v, Y, N)
        for kind, (y, psi, v_, r, Y_, N_) in rows.items():
            name = f"{kind}_{n}.csv"
            table = np.column_stack([time, y, psi, v_, r, zero + SPEED, zero, zero, sign * Y_, sign * N_])
            header = "t_s,y_m,psi_rad,v_mps,r_radps,speed_mps,delta_rad,X_N,Y_N,N_Nm"
            np.savetxt(tmp_path / name, table, "%.12g", ",", header=header, comments="")
            text += f'[[runs]]\nfile = "{name}"\ntype = "pure_{kind}"\n'
    (tmp_path / "campaign.toml").write_text(text)
    return read_campaign(tmp_path / "campaign.toml")


@pytest.mark.parametrize("convention", ["on_model", "on_gauge", "hydrodynamic"])
def test_one_run_gives_the_printed_formulas_with_zero_error_and_drift_of_the_zero(tmp_path, convention):
    campaign = folder(tmp_path, convention)
    for row in oscillations(campaign, [reduced_run(run) for run in campaign.runs]):
        known = SWAY if row.letter == "v" else YAW
        amplitude = row.amplitude * SPEED / (1 if row.letter == "v" else LENGTH)
        for name, value in row.values.items():
            expected = known[name]
            if not name.endswith("dot"):  # first harmonic of the cube
                expected += 0.75 * known[name + 2 * row.letter] * amplitude**2
            assert value == pytest.approx(prime(name, expected), rel=1e-5)
        for name, (value, _) in row.third.items():
            assert value == pytest.approx(prime(name, known[name]), rel=1e-5)


def test_frequency_and_amplitude_are_reported_in_prime_and_by_the_waves(tmp_path):
    campaign = folder(tmp_path, "on_model")
    row = oscillations(campaign, [reduced_run(campaign.runs[0])])[0]
    assert row.frequency_radps == pytest.approx(0.6)
    assert row.amplitude == pytest.approx(0.1 / SPEED)
    assert row.reduced_frequency == pytest.approx(0.6 * LENGTH / SPEED)
    assert row.frequency_parameter == pytest.approx(0.6 * SPEED / 9.80665)


def test_the_third_order_is_found_from_the_third_harmonic_and_from_the_amplitude_alike(tmp_path):
    campaign = folder(tmp_path, "on_gauge", amplitudes=(0.1, 0.2, 0.3, 0.4))
    # all at one frequency: the amplitude alone makes the difference
    rows = oscillations(campaign, [reduced_run(run) for run in campaign.runs])
    rows = [replace(row, frequency_radps=0.6) for row in rows]
    found = {cubic.name: cubic for cubic in cubics(rows)}
    for name, value in (SWAY | YAW).items():
        if len(name) == 4:
            assert found[name].from_third_harmonic[0] == pytest.approx(prime(name, value), rel=1e-4)
            assert found[name].from_amplitude[0] == pytest.approx(prime(name, value), rel=1e-4)


def test_two_ways_to_a_third_order_term_that_differ_are_reported(tmp_path):
    campaign = folder(tmp_path, "on_gauge", amplitudes=(0.1, 0.2, 0.3))
    rows = [replace(row, frequency_radps=0.6) for row in oscillations(campaign, list(map(reduced_run, campaign.runs)))]
    skewed = [replace(row, values={k: v * (1 + abs(row.amplitude)) for k, v in row.values.items()}) for row in rows]
    assert not cubic_findings(cubics(rows))
    assert any("Yvvv is" in reported and "by the amplitude" in reported for reported in cubic_findings(cubics(skewed)))


def test_moderated_densities_are_alike_where_runs_are(tmp_path):
    campaign = folder(tmp_path, "on_gauge", amplitudes=(0.1, 0.2, 0.3))
    rng = np.random.default_rng(1)
    noisy = [replace(run, Y_N=run.Y_N + rng.standard_normal(len(run.Y_N))) for run in campaign.runs]
    before = [reduced_run(run) for run in noisy]
    after = moderated(before)
    scatter = [np.std([np.log(run.fits["Y"].density[0]) for run in runs]) for runs in (before, after)]
    assert scatter[1] < 0.5 * scatter[0]
    assert after[0].fits["Y"].density[0] == pytest.approx(1.0, rel=0.1)


def test_a_noisier_run_stays_noisier(tmp_path):
    campaign = folder(tmp_path, "on_gauge", amplitudes=(0.1, 0.2, 0.3))
    rng = np.random.default_rng(1)
    sizes = [1.0, 1.0, 1.0, 1.0, 1.0, 20.0]
    runs = [
        replace(run, Y_N=run.Y_N + size * rng.standard_normal(len(run.Y_N)))
        for run, size in zip(campaign.runs, sizes, strict=True)
    ]
    after = moderated([reduced_run(run) for run in runs])
    assert after[-1].fits["Y"].density[0] > 100 * after[0].fits["Y"].density[0]
