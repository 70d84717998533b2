"""Every fault of a run is reported by name, and the rest is reduced when asked to go on."""

import functools
import re
from dataclasses import replace

import numpy as np
import pytest

from tank2sim.errors import InputError
from tank2sim.identification.captive.harmonics import reduced_run
from tank2sim.identification.captive.reduction import ReductionOptions, reduce_campaign
from tank2sim.identification.captive.run_faults import record_faults, reduced_faults
from tank2sim.records.campaigns import read_campaign
from tests.identification.captive.generator import NOISE_SHARE, Campaign, plan, ship, write
from tests.marks import first_fast

CASES = {
    "saturated": ("sway_02", "gauge Y: is constant at its .* saturated"),
    "step": ("drift_+04", "gauge Y: its zero steps by"),
    "degrees": ("yaw_02", "column r_radps: reaches .* cannot be"),
    "short": ("sway_11", "has 0.7. of a period"),
    "wrong type": ("yaw_12", "has type pure_sway"),
    "missing": ("rudder_+10", "the file does not exist"),
}
SOME_SOUND = ("drift_-04", "rudder_+20", "sway_01", "yaw_01")


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    written = write(Campaign(seed=2, rate_hz=10.0), tmp_path_factory.mktemp("sound"))
    return read_campaign(written.path)


@pytest.fixture(scope="module")
def without(sound):
    """What the campaign gives without a run of a name; reduced once."""
    return functools.cache(lambda name: reduce_campaign(sound.without({name})))


def run_of(campaign, name):
    return next(run for run in campaign.runs if run.name == f"{name}.csv")


def reported(campaign, run):
    """Everything reported of one run."""
    found = list(record_faults(campaign, run))
    return " | ".join(str(fault) for fault in found or reduced_faults(reduced_run(run)))


def test_sound_runs_have_no_fault(sound):
    assert not [reported(sound, run) for run in sound.runs if reported(sound, run)]


@pytest.mark.parametrize(("fault", "name", "message"), [(fault, *case) for fault, case in CASES.items()])
def test_a_fault_is_reported_with_the_name_of_its_run(tmp_path, fault, name, message):
    campaign = Campaign(seed=2, rate_hz=10.0, faults={name: fault})
    planned = [run for run in plan(campaign, ship(campaign)) if run.name in {name, *SOME_SOUND}]
    path = write(campaign, tmp_path, planned).path
    with pytest.raises(InputError, match=message) as error:
        reduce_campaign(read_campaign(path))
    assert f"{name}.csv" in str(error.value)
    assert "keep_going=True" in str(error.value)


@pytest.mark.slow
def test_the_rest_is_reduced_when_asked_to_go_on(tmp_path):
    faults = {name: fault for fault, (name, _) in CASES.items()}
    written = write(Campaign(seed=2, rate_hz=10.0, faults=faults), tmp_path)
    reduction = reduce_campaign(read_campaign(written.path, keep_going=True), ReductionOptions(keep_going=True))
    assert len(reduction.faults) == len(CASES)
    assert len(reduction.runs) == len(written.runs) - len(CASES)
    for name in ("Yv", "Nr", "Yvdot"):
        found = reduction.derivatives[name]
        assert abs(found.value - written.derivatives[name]) < 4 * found.standard_error


@pytest.mark.parametrize(
    ("name", "changes", "message"),
    [
        ("sway_02", lambda run: {"v_mps": 1.3 * run.v_mps}, "v_mps: is 1.3 times the rate of change of y_m"),
        ("sway_02", lambda run: {"v_mps": -run.v_mps}, "v_mps: has the opposite sign of the rate of change of y_m"),
        ("yaw_02", lambda run: {"psi_rad": np.roll(run.psi_rad, 40)}, "r_radps: is .* deg out of phase"),
        ("drift_+08", lambda run: {"v_mps": -run.v_mps}, "has a drift angle of -8 deg by its v, and 8 deg"),
        ("drift_+08", lambda run: {"Y_N": 1000 * run.Y_N}, "column Y_N: reaches .* no hull has; give it in N"),
        ("drift_+08", lambda run: {"speed_mps": 100 * run.speed_mps}, "speed_mps: has a mean of"),
        ("drift_+08", lambda run: {"delta_rad": run.delta_rad + 2.0}, "column delta_rad: reaches 2, which cannot be"),
        ("rudder_+10", lambda run: {"delta_rad": -run.delta_rad}, "delta_rad: is -10 deg, and 10 deg by the sheet"),
        ("rudder_+10", lambda run: {"r_radps": run.r_radps + 0.05}, "has type static_rudder, but the model moves"),
        ("drift_+08", lambda run: {"time_s": run.time_s + 3 * (run.time_s > 5)}, "column t_s: has a gap of 3.1 s"),
    ],
)
def test_records_that_cannot_be(sound, name, changes, message):
    run = run_of(sound, name)
    assert not reported(sound, run)
    assert re.search(message, reported(sound, replace(run, **changes(run))))


def test_a_plateau_of_a_coarse_digital_gauge_is_not_saturation(sound):
    run = run_of(sound, "sway_02")
    step = np.ptp(run.Y_N) / 12
    assert "saturated" not in reported(sound, replace(run, Y_N=np.round(run.Y_N / step) * step))


def changed(campaign, name, **columns):
    """The campaign with one run's columns changed by functions of the run."""
    runs = [
        replace(run, **{key: change(run) for key, change in columns.items()}) if run.name == f"{name}.csv" else run
        for run in campaign.runs
    ]
    return replace(campaign, runs=tuple(runs))


@first_fast(
    "name, column, change, message",
    [
        ("sway_01", "Y_N", lambda run: 0 * run.Y_N, "gauge Y: reads 0 while the model oscillates .* dead"),
        pytest.param(
            *("yaw_01", "N_Nm", lambda run: 0 * run.N_Nm + 3.0, "gauge N: reads 3 while the model oscillates .* dead"),
            marks=pytest.mark.slow,
        ),
        pytest.param(
            *("drift_+08", "Y_N", lambda run: 0 * run.Y_N + 3.0, "gauge Y: reads 3 from end to end .* dead"),
            marks=pytest.mark.slow,
        ),
        ("drift_+08", "X_N", lambda run: 0 * run.X_N, "gauge X: reads 0 from end to end .* dead"),
        pytest.param(
            *("sway_00", "Y_N", lambda run: run.Y_N / 1000, "gauge Y: contradicts the other runs: its harmonics"),
            marks=pytest.mark.slow,
        ),
        ("yaw_01", "N_Nm", lambda run: -run.N_Nm, "gauge N: contradicts the other runs: its harmonics"),
        ("rudder_+20", "Y_N", lambda run: -run.Y_N, "gauge Y: contradicts the other runs: its mean"),
        pytest.param(
            *("drift_-04", "N_Nm", lambda run: run.N_Nm / 1000, "gauge N: contradicts the other runs: its mean"),
            marks=pytest.mark.slow,
        ),
    ],
)
def test_one_bad_run_among_sound_ones_is_reported_and_left_out(sound, without, name, column, change, message):
    faulty = changed(sound, name, **{column: change})
    with pytest.raises(InputError, match=message) as error:
        reduce_campaign(faulty)
    assert error.value.source == f"{name}.csv"
    rest = reduce_campaign(faulty, ReductionOptions(keep_going=True))
    assert [fault.source for fault in rest.faults] == [f"{name}.csv"]
    alone = without(f"{name}.csv")
    assert {n: d.value for n, d in rest.derivatives.items()} == {n: d.value for n, d in alone.derivatives.items()}


@first_fast(
    "seed",
    [
        *(30, 31),
        *(pytest.param(one, marks=pytest.mark.slow) for one in range(32, 36)),
        *(pytest.param(one, marks=pytest.mark.long) for one in range(36, 60)),
    ],
)
def test_no_run_of_a_sound_campaign_is_at_fault(tmp_path, seed):
    kinds = [
        {},
        {"correlation_time_s": 2.0, "zero_drift": 2.0},
        {"speed_fluctuation": 0.02, "sheet_error": 0.04, "part_periods": True, "asymmetry": True},
        {"size": "linear"},
        {"noise": 0.0, "zero_error": 0.0},
        {"noise": 1e-3, "zero_error": 1e-3},
    ]
    path = write(Campaign(seed=seed, rate_hz=5.0, **kinds[seed % len(kinds)]), tmp_path).path
    assert not reduce_campaign(read_campaign(path)).faults


@pytest.mark.slow
@pytest.mark.parametrize("times_noise", [1.0, 2.0, 4.0])
def test_coarse_gauges_are_not_saturated_or_dead(tmp_path, times_noise):
    written = write(Campaign(seed=5), tmp_path)
    step = times_noise * NOISE_SHARE * written.ship.force_N
    coarse = read_campaign(written.path)
    for run in coarse.runs:
        columns = {"X_N": step, "Y_N": step, "N_Nm": 0.3 * step * written.ship.length_m}
        readings = {key: np.round(getattr(run, key) / size) * size for key, size in columns.items()}
        assert not reported(coarse, replace(run, **readings))


def test_a_steady_gauge_at_the_end_of_its_range_is_saturated(sound):
    run = run_of(sound, "drift_+08")
    assert "saturated" in reported(sound, replace(run, Y_N=np.minimum(run.Y_N, np.quantile(run.Y_N, 0.3))))


def test_one_steady_run_shows_no_derivative_but_the_resistance(sound):
    for name in ("drift_+00", "drift_+08", "rudder_+20"):
        reduction = reduce_campaign(sound.without({run.name for run in sound.runs} - {f"{name}.csv"}))
        assert set(reduction.derivatives) == {"X0"}
        choices = {choice.name: choice.reason for choice in reduction.forces["N"].selection.choices}
        assert choices["N0"] == choices["Nv"] == "not excited"


@pytest.mark.parametrize("side", [1, -1])
def test_a_sway_faster_than_the_model_is_a_fault_of_its_run(sound, side):
    """sin(drift) beyond 1: no angle, and no crash either."""
    run = run_of(sound, "drift_+04")
    fast = reduced_run(replace(run, v_mps=run.v_mps * 0 + side * 1.5 * run.speed_mps))
    found = " | ".join(str(fault) for fault in reduced_faults(fast))
    assert f"drift_+04.csv: column v_mps: has a drift angle of {-90 * side} deg" in found
