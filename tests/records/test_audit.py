"""The audit: each fault put into a made-up record is found, a clean one raises no alarm; then real records."""

import json
from dataclasses import asdict, replace

import numpy as np
import pytest
from scipy.signal import lfilter
from statsmodels.regression.linear_model import OLS

from tank2sim.records.audit import audit_and_repair, audit_trial, record_noise, repair_trial
from tank2sim.records.audit.rudder import rudder_clock_findings, rudder_response
from tank2sim.records.audit.weak import fit
from tank2sim.records.audit.yaw import yaw_findings
from tank2sim.records.reading import read_trial_file
from tank2sim.records.trials import select_rows
from tank2sim.simulation.manoeuvres import parse_manoeuvre
from tank2sim.simulation.run import simulate
from tests.marks import first_fast
from tests.records.motions import NOISE, NONE, motion, trial

DEG = np.pi / 180
MOTIONS = {kind: motion(kind) for kind in ("zigzag", "turn", "turn_port", "straight")}


def over_ground(m):
    return (m["u_mps"] + 1j * m["v_mps"]) * np.exp(1j * m["psi_rad"])


def moved(m, offset):
    return {"x_m": m["x_m"] + offset.real, "y_m": m["y_m"] + offset.imag}


def late(m, name, seconds):
    return {name: np.interp(m["t_s"] - seconds, m["t_s"], m[name])}


# What is done to the motion (and the noise of what it is done to, which scales along), and what is to be found of it.
FAULTS = {
    "r in rad/s": (lambda m: {"r_radps": m["r_radps"] * DEG}, "r_degps", "rad/s"),
    "psi in radians": (lambda m: {"psi_rad": m["psi_rad"] * DEG}, "psi_deg", "radians"),
    "psi in radians, wrapped": (lambda m: {"psi_rad": m["psi_rad"] % (2 * np.pi) * DEG}, "psi_deg", "radians"),
    "velocities in knots": (
        lambda m: {name: m[name] * 3600 / 1852 for name in ("u_mps", "v_mps")},
        "u_mps, v_mps",
        "knots",
    ),
    "u in knots": (lambda m: {"u_mps": m["u_mps"] * 3600 / 1852}, "u_mps", "knots"),
    "r to port": (lambda m: {"r_radps": -m["r_radps"]}, "r_degps", "positive to port"),
    "psi to port": (lambda m: {"psi_rad": -m["psi_rad"]}, "psi_deg", "positive to port"),
    "psi and r to port": (
        lambda m: {name: -m[name] for name in ("psi_rad", "r_radps")},
        "psi_deg, r_degps",
        "anticlockwise",
    ),
    "v to port": (lambda m: {"v_mps": -m["v_mps"]}, "v_mps", "positive to port"),
    "u and v interchanged": (lambda m: {"u_mps": m["v_mps"], "v_mps": m["u_mps"]}, "u_mps, v_mps", "interchanged"),
    "earth-fixed": (
        lambda m: {"u_mps": over_ground(m).real, "v_mps": over_ground(m).imag},
        "u_mps, v_mps",
        "earth-fixed velocities, along x and y",
    ),
    "earth-fixed, west": (
        lambda m: {"u_mps": over_ground(m).real, "v_mps": -over_ground(m).imag},
        "u_mps, v_mps",
        "earth-fixed velocities, along x and against y",
    ),
    "earth-fixed, interchanged": (
        lambda m: {"u_mps": over_ground(m).imag, "v_mps": over_ground(m).real},
        "u_mps, v_mps",
        "earth-fixed velocities, along y and x",
    ),
    "y to west": (lambda m: {"y_m": -m["y_m"]}, "x_m, y_m", "positive to west"),
    "x and y interchanged": (lambda m: {"x_m": m["y_m"], "y_m": m["x_m"]}, "x_m, y_m", "interchanged"),
    "rudder to port": (lambda m: {"delta_rad": -m["delta_rad"]}, "delta_deg", "positive to port"),
    "rudder in radians": (lambda m: {"delta_rad": m["delta_rad"] * DEG}, "delta_deg", "in radians"),
}
SHRUNK = {"r in rad/s": "r_radps", "psi in radians": "psi_rad", "psi in radians, wrapped": "psi_rad"}


def faulty(kind, change, shrunk=None, **options):
    noise = {**NOISE, shrunk: NOISE[shrunk] * DEG} if shrunk else NOISE
    return trial({**MOTIONS[kind], **change(MOTIONS[kind])}, noise=noise, **options)


def with_kinds(names, kinds):
    """Parameters: each name with one of the kinds of motion, by turns, and with the others in slow tests."""
    return [
        pytest.param(name, kind, marks=() if place % len(kinds) == number else pytest.mark.slow)
        for place, name in enumerate(names)
        for number, kind in enumerate(kinds)
    ]


@pytest.mark.parametrize(("name", "kind"), with_kinds(FAULTS, ["zigzag", "turn_port"]))
def test_a_wrong_column_is_named_and_corrected(kind, name):
    change, column, truth = FAULTS[name]
    record = faulty(kind, change, SHRUNK.get(name))
    right, (finding,) = audit_and_repair(record)
    assert (finding.column, finding.kind) == (column, "fault")
    assert finding.safe and finding.repair is not None
    assert truth in finding.likely_truth
    assert any(truth in notice for notice in right.notices) or "rudder" in name
    for signal in ("u_mps", "v_mps", "r_radps", "delta_rad", "x_m", "y_m"):
        expected = MOTIONS[kind][signal]
        spread = 6 * max(NOISE.get(signal, 0.0) * (2 if "knots" in name else 1), 0.02 if "mps" in signal else 0)
        # turning by psi and back adds u times the noise of psi to v
        assert np.max(np.abs(right.signals[signal] - expected)) < spread + 1e-9
    assert not audit_trial(right)


def test_several_faults_at_once_are_distinguished():
    def change(m):
        earth = over_ground(m)
        rest = {"delta_rad": -m["delta_rad"], "r_radps": m["r_radps"] * DEG}
        return {"u_mps": earth.real, "v_mps": earth.imag, **rest}

    findings = audit_trial(faulty("zigzag", change, "r_radps"))
    assert [one.column for one in findings] == ["r_degps", "u_mps, v_mps", "delta_deg"]


@pytest.mark.parametrize("kind", MOTIONS)
def test_a_clean_record_raises_no_alarm(kind):
    for seed in range(2):
        assert audit_trial(trial(MOTIONS[kind], seed=seed)) == ()
    assert audit_trial(trial(MOTIONS[kind], noise=NONE)) == ()


LESSER = {
    "current": (lambda m: moved(m, (0.3 - 0.4j) * m["t_s"]), {"speed_mps": 0.5, "direction_deg": 306.87}, "a current"),
    "log": (lambda m: {name: 1.05 * m[name] for name in ("u_mps", "v_mps")}, {"factor": 1 / 1.05}, "the log reads +"),
    "compass": (lambda m: {"psi_rad": m["psi_rad"] + 3 * DEG}, {"angle_deg": 3.0}, "deg too much"),
    "compass to port": (lambda m: {"psi_rad": m["psi_rad"] - 3 * DEG}, {"angle_deg": -3.0}, "deg too little"),
    "antenna": (
        lambda m: moved(m, (30 - 5j) * np.exp(1j * m["psi_rad"])),
        {"forward_m": 30.0, "starboard_m": -5.0},
        "the antenna is",
    ),
    "gyro": (lambda m: {"r_radps": m["r_radps"] + 0.05 * DEG}, {"bias_degps": 0.05}, "the gyro reads +0.0"),
    "late r": (lambda m: late(m, "r_radps", 2.0), {"lag_s": 2.0}, "r is late by"),
    "very late r": (lambda m: late(m, "r_radps", 25.0), {"lag_s": 25.0}, "r is late by"),
    "late x, y": (lambda m: late(m, "x_m", 3.0) | late(m, "y_m", 3.0), {"delay_s": 3.0}, "x and y are late by"),
}


@pytest.mark.parametrize("name", LESSER)
def test_lesser_faults_are_noted_with_their_size_and_left_as_they_are(name):
    change, expected, truth = LESSER[name]
    record = faulty("zigzag", change)
    right, (finding,) = audit_and_repair(record)
    assert (finding.kind, finding.safe) == ("note", False)
    assert truth in finding.likely_truth
    error = max(value for key, value in finding.evidence.items() if key.startswith("standard_error"))
    for key, value in expected.items():
        tolerance = {"direction_deg": 8.0, "delay_s": 0.2}.get(key, 5 * error)
        assert finding.evidence[key] == pytest.approx(value, abs=tolerance)
    assert right is record
    if finding.repair is not None and name in ("log", "compass", "gyro"):
        assert not audit_trial(finding.repair(record))


def rows(*slices):
    return lambda record: select_rows(record, np.concatenate([np.arange(a, b) for a, b in slices]))


def put(name, change):
    def changed(record):
        values = record.signals[name].copy()
        change(values)
        return replace(record, signals={**record.signals, name: values})

    return changed


def held(begin, end):
    return lambda values: values.__setitem__(slice(begin, end), values[begin])


SENSORS = {
    "repeated rows": (rows((0, 100), (99, 200), (199, 4001)), "t_s", "fault", "repeated"),
    "rows in disorder": (rows((0, 1000), (1500, 2000), (1000, 1500), (2000, 4001)), "t_s", "fault", "not in the order"),
    "rounded times": (lambda r: replace(r, time_s=np.round(r.time_s)), "t_s", "fault", "step is uniform, 0.1 s"),
    "a clock set back": (
        lambda r: replace(r, time_s=np.where(r.time_s < 300, r.time_s, r.time_s - 200)),
        "t_s",
        "fault",
        "fall back",
    ),
    "a gap": (rows((0, 1000), (1200, 4001)), "t_s", "note", "about 200 rows were not recorded"),
    "uneven times": (
        lambda r: replace(r, time_s=r.time_s + np.random.default_rng(1).uniform(-0.03, 0.03, len(r.time_s))),
        "t_s",
        "note",
        "uneven",
    ),
    "a noisy sensor stuck": (put("u_mps", held(1000, 1400)), "u_mps", "fault", "stuck"),
    "stuck to the end": (put("r_radps", held(2500, 4001)), "r_degps", "fault", "stuck"),
    "a short outage": (put("psi_rad", held(1000, 1050)), "psi_deg", "note", "stuck"),
    "missing values": (put("v_mps", lambda v: v.__setitem__(slice(500, 600), np.nan)), "v_mps", "note", "not recorded"),
    "spikes": (put("psi_rad", lambda v: v.__iadd__(0.5 * np.isin(np.arange(4001), [300, 900]))), "psi_deg", "note", ""),
    "a sensor not read": (put("v_mps", lambda v: v.fill(0.0)), "v_mps", "fault", "not read"),
}


@pytest.mark.parametrize("name", SENSORS)
def test_faults_of_time_and_sensors_are_found(name):
    change, column, kind, truth = SENSORS[name]
    findings = audit_trial(change(trial(MOTIONS["zigzag"])))
    assert (findings[0].column, findings[0].kind) == (column, kind)
    assert truth in findings[0].likely_truth
    assert len(findings) == 1


@pytest.mark.parametrize("name", ["repeated rows", "rows in disorder", "rounded times"])
def test_a_corrected_time_base_is_the_true_one(name):
    record = trial(MOTIONS["zigzag"])
    right, (finding,) = repair_trial(SENSORS[name][0](record))
    np.testing.assert_allclose(right.time_s, record.time_s, atol=2e-3 * 400)
    np.testing.assert_array_equal(right.signals["x_m"], record.signals["x_m"])
    assert finding.column == "t_s"
    assert right.notices


def test_failed_readings_are_left_out_and_nothing_else():
    right, _ = repair_trial(put("u_mps", held(1000, 1400))(trial(MOTIONS["zigzag"])))
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(right.signals["u_mps"])), np.arange(1001, 1400))


def test_a_coarse_sensor_and_slow_positions_are_no_fault():
    record = trial(MOTIONS["zigzag"])
    coarse = {"psi_rad": np.round(record.signals["psi_rad"] / DEG) * DEG, "x_m": np.round(record.signals["x_m"])}
    assert audit_trial(replace(record, signals={**record.signals, **coarse})) == ()


@pytest.mark.parametrize("count", [2, 5, 8, 30, 200])
def test_a_short_record_is_left_alone(count):
    assert audit_trial(select_rows(trial(MOTIONS["turn"]), np.arange(count))) == ()


@pytest.mark.parametrize("gone", ["psi_rad", "r_radps", "x_m", "v_mps", "delta_rad"])
def test_a_record_without_a_signal_is_judged_by_the_rest(gone):
    record = faulty("zigzag", lambda m: {"delta_rad": -m["delta_rad"]})
    signals = {name: values for name, values in record.signals.items() if name != gone}
    findings = audit_trial(replace(record, signals=signals))
    assert [one.column for one in findings] == ([] if gone == "delta_rad" else ["delta_deg"])


def test_a_rudder_that_stops_before_its_order_is_noted():
    record = trial(MOTIONS["zigzag"])
    order = {"delta_order_rad": 1.5 * record.signals["delta_rad"]}
    (finding,) = audit_trial(replace(record, signals={**record.signals, **order}))
    assert "stays at 20 deg" in finding.what


def test_velocities_over_ground_that_are_through_the_water_are_found():
    m = MOTIONS["turn"]
    record = trial({**m, **moved(m, (0.3 - 0.4j) * m["t_s"])})
    names = {"u_mps": "u_ground_mps", "v_mps": "v_ground_mps"}
    signals = {names.get(name, name): values for name, values in record.signals.items()}
    (finding,) = audit_trial(replace(record, signals=signals))
    assert finding.column == "u_ground_mps, v_ground_mps"
    assert "through the water, in a current of 0.5" in finding.likely_truth


def test_speed_over_ground_in_knots_is_found():
    record = trial(MOTIONS["turn"])
    sog = np.hypot(record.signals["u_mps"], record.signals["v_mps"]) * 3600 / 1852
    (finding,) = audit_trial(replace(record, signals={**record.signals, "sog_mps": sog}))
    assert (finding.column, finding.likely_truth) == ("sog_mps", "it is in knots")


@pytest.mark.parametrize("seed", range(3))
def test_white_noise_is_estimated_to_a_few_per_cent_in_spite_of_spikes(seed):
    record = trial(MOTIONS["zigzag"], seed=seed)
    record.signals["u_mps"][::200] += 5.0
    estimated = record_noise(record)
    for name, sigma in NOISE.items():
        assert estimated[name] == pytest.approx(sigma, rel=0.08)
    assert record_noise(replace(record, noise={"u_mps": 0.5}))["u_mps"] == 0.5


def test_a_finding_becomes_one_entry_a_column():
    change, _, _ = FAULTS["earth-fixed"]
    (finding,) = audit_trial(faulty("turn", change))
    assert [entry.column for entry in finding.entries] == ["u_mps", "v_mps"]
    assert {entry.what for entry in finding.entries} == {finding.what}


@pytest.mark.slow
def test_kvlcc2_velocities_are_found_to_be_earth_fixed(data):
    """On each record of HSVA and MARIN, and nothing else is called a fault."""
    files = sorted(data.glob("data/kvlcc2_*/*.dat"))
    assert files, "the folder holds no record"
    for file in files:
        record = read_trial_file(file)
        right, findings = audit_and_repair(record)
        (finding,) = [one for one in findings if one.kind == "fault"]
        assert finding.column == "u_mps, v_mps", file
        assert "earth-fixed" in finding.likely_truth
        assert any("turned to body axes" in notice for notice in right.notices)
        assert np.nanmedian(right.signals["u_mps"]) > 0.5
        # a ship in a turn drifts outward: v against r
        turning = np.abs(right.signals["r_radps"]) > np.quantile(np.abs(right.signals["r_radps"]), 0.7)
        assert np.corrcoef(right.signals["v_mps"][turning], right.signals["r_radps"][turning])[0, 1] < -0.8


@pytest.mark.slow
def test_the_esso_osaka_is_right_as_it_is(data):
    files = sorted(data.glob("data/esso_osaka/*/*.csv"))
    assert files, "the folder holds no record"
    for file in files:
        assert [one for one in audit_trial(read_trial_file(file)) if one.kind == "fault"] == [], file


@pytest.mark.slow
def test_hidden_effects_of_the_gap_cases_are_measured_and_a_clean_one_is_clean(data):
    expected = {1: ("speed_mps", 0.5288), 5: ("bias_degps", 0.02792), 8: ("speed_mps", 0.4699)}
    for case in range(1, 9):
        for name in ("zigzag20_20", "turn35_stbd", "accel"):
            findings = audit_trial(read_trial_file(data / f"data/gap_cases/case_{case}/{name}.csv"))
            if case not in expected:
                assert findings == (), (case, name)
                continue
            key, value = expected[case]
            (finding,) = findings
            assert finding.kind == "note"
            error = max(entry for key, entry in finding.evidence.items() if key.startswith("standard_error"))
            assert finding.evidence[key] == pytest.approx(value, abs=4 * error)


@pytest.mark.parametrize(("unit", "name"), [(60.0, "minutes"), (3600.0, "hours")])
@pytest.mark.parametrize("kind", ["zigzag", "turn"])
def test_time_in_another_unit_is_distinguished_from_a_rate_in_another_unit(unit, name, kind):
    right = trial(motion(kind))
    wrong = replace(right, time_s=right.time_s / unit)
    (finding,) = [one for one in audit_trial(wrong) if one.kind == "fault"]
    assert finding.columns == ("t_s",) and name in finding.likely_truth
    np.testing.assert_allclose(repair_trial(wrong)[0].time_s, right.time_s)


def test_velocities_of_the_opposite_sign_are_a_fault():
    right = trial(motion("zigzag"))
    signals = {**right.signals, "u_mps": -right.signals["u_mps"], "v_mps": -right.signals["v_mps"]}
    found = [one for one in audit_trial(replace(right, signals=signals)) if one.kind == "fault"]
    assert [one.likely_truth for one in found] == ["both are of the opposite sign"]


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("every", [5, 10, 20])
def test_the_side_of_the_rudder_is_reported_by_a_turn_recorded_from_its_execute(every, sign, mariner) -> None:
    run = simulate(mariner, parse_manoeuvre("turn:35"), duration_s=300.0).trajectory
    names = {"delta_rad": "rudder.angle", "u_mps": "motion.u", "r_radps": "motion.r", "psi_rad": "motion.psi"}
    signals = {"t_s": run.t[::every], **{name: np.asarray(run[of])[::every] for name, of in names.items()}}
    noise = {"u_mps": 0.03, "r_radps": np.radians(0.01), "psi_rad": np.radians(0.1)}
    record = trial({**signals, "delta_rad": sign * signals["delta_rad"]}, noise=noise)
    assert np.sign(rudder_response(record)) == sign


def scaled(**factors):
    def change(m):
        return {name: m[name] * factor for name, factor in factors.items()}

    return change


DEPENDENT = {
    "rudder in radians to port": (scaled(delta_rad=-DEG), ["delta_deg", "delta_deg"]),
    "r in rad/s to port": (scaled(r_radps=-DEG), ["r_degps", "r_degps"]),
    "psi in radians to port": (scaled(psi_rad=-DEG), ["psi_deg", "psi_deg"]),
    "psi and r in radians": (scaled(psi_rad=DEG, r_radps=DEG), ["psi_deg", "r_degps"]),
    "psi, r and rudder in radians": (
        scaled(psi_rad=DEG, r_radps=DEG, delta_rad=DEG),
        ["psi_deg", "r_degps", "delta_deg"],
    ),
    "velocities in knots, v to port": (scaled(u_mps=3600 / 1852, v_mps=-3600 / 1852), ["u_mps, v_mps", "v_mps"]),
    "positions in km, y to west": (scaled(x_m=1e-3, y_m=-1e-3), ["x_m, y_m", "x_m, y_m"]),
    "positions in km": (scaled(x_m=1e-3, y_m=1e-3), ["x_m, y_m"]),
    "positions in feet": (scaled(x_m=1 / 0.3048, y_m=1 / 0.3048), ["x_m, y_m"]),
    "positions in nautical miles": (scaled(x_m=1 / 1852, y_m=1 / 1852), ["x_m, y_m"]),
}


@pytest.mark.parametrize(("name", "kind"), with_kinds(DEPENDENT, ["zigzag", "turn", "turn_port"]))
def test_faults_that_depend_on_each_other_are_repaired_one_after_the_other(kind, name):
    change, columns = DEPENDENT[name]
    true, changed = MOTIONS[kind], change(MOTIONS[kind])
    shrink = {of: abs(np.median(changed[of][true[of] != 0] / true[of][true[of] != 0])) for of in changed}
    noise = {of: value * shrink.get(of, 1.0) for of, value in NOISE.items()}
    record = trial({**true, **changed}, noise=noise)
    right, findings = audit_and_repair(record)
    assert [one.column for one in findings] == columns
    for signal in ("delta_rad", "r_radps", "psi_rad", "u_mps", "v_mps", "x_m", "y_m"):
        # half a knot's third digit of the speed, six times the noise of the rest
        np.testing.assert_allclose(right.signals[signal], true[signal], atol=6 * NOISE.get(signal, 0.0) + 1e-9)
    assert not audit_trial(right)


UNKNOWN = {
    "a clock twice too fast": (lambda m: {"t_s": 2.0 * m["t_s"]}, "t_s"),
    "a clock twice too slow": (lambda m: {"t_s": 0.5 * m["t_s"]}, "t_s"),
    "r at 1.5 times": (scaled(r_radps=1.5), "r_degps, psi_deg"),
    "velocities at 1.3 times": (scaled(u_mps=1.3, v_mps=1.3), "u_mps, v_mps, x_m, y_m"),
    "velocities at twice": (scaled(u_mps=2.0, v_mps=2.0), "u_mps, v_mps, x_m, y_m"),
    "positions at 0.7 times": (scaled(x_m=0.7, y_m=0.7), "u_mps, v_mps, x_m, y_m"),
}


@pytest.mark.parametrize("kind", ["zigzag", "turn"])
@pytest.mark.parametrize("name", UNKNOWN)
def test_a_factor_of_no_unit_is_a_fault_and_left_alone(kind, name):
    change, column = UNKNOWN[name]
    record = trial({**MOTIONS[kind], **change(MOTIONS[kind])})
    right, (finding,) = audit_and_repair(record)
    assert (finding.column, finding.kind, finding.open, finding.safe) == (column, "fault", True, False)
    assert right is record


def test_without_a_rate_of_turn_half_the_speed_is_not_knots():
    m = MOTIONS["zigzag"]
    record = trial({name: values for name, values in {**m, "t_s": 2.0 * m["t_s"]}.items() if name != "r_radps"})
    (finding,) = audit_trial(record)
    assert finding.open and "knots" in finding.likely_truth


def test_a_sign_that_no_other_column_tells_is_not_chosen():
    m = MOTIONS["zigzag"]
    record = trial({"t_s": m["t_s"], "delta_rad": 0.0 * m["t_s"], "r_radps": -m["r_radps"], "psi_rad": m["psi_rad"]})
    (finding,) = audit_trial(record)
    assert (finding.column, finding.open) == ("r_degps, psi_deg", True)


def test_a_heading_to_port_without_rate_and_velocities_does_not_turn_the_rudder():
    m = MOTIONS["zigzag"]
    kept = {name: m[name] for name in ("t_s", "delta_rad", "x_m", "y_m")}
    record = trial({**kept, "psi_rad": -m["psi_rad"]})
    assert audit_trial(record)[0].column == "psi_deg, x_m, y_m"
    np.testing.assert_array_equal(repair_trial(record)[0].signals["delta_rad"], m["delta_rad"])


@pytest.mark.parametrize("name", ["psi_rad", "r_radps", "delta_rad"])
@pytest.mark.parametrize("count", [12, 60])
def test_many_spikes_are_left_out_though_some_lie_close_together(name, count):
    record = trial(MOTIONS["turn"])
    rng = np.random.default_rng(3)
    struck = np.sort(rng.choice(np.arange(5, 3995, 4), count, replace=False))
    record.signals[name][struck] += np.deg2rad(40) * rng.choice([-1, 1], count)
    right, (finding,) = audit_and_repair(record)
    assert finding.evidence["spikes"] == count
    assert np.flatnonzero(np.isnan(right.signals[name])).tolist() == struck.tolist()


@pytest.mark.parametrize(("row", "value"), [(0, -1.7e9), (2000, 1.7e9), (4000, 1.7e9), (4000, 1e15)])
def test_a_stray_time_is_named_and_its_row_left_out(row, value):
    record = trial(MOTIONS["zigzag"])
    times = record.time_s.copy()
    times[row] = value
    right, findings = audit_and_repair(replace(record, time_s=times))
    assert findings[0].columns == ("t_s",) and findings[0].evidence["first_row"] == row + 1
    np.testing.assert_array_equal(right.time_s, np.delete(record.time_s, row))


def test_two_recordings_in_one_file_are_not_chosen_between():
    record = trial(MOTIONS["zigzag"])
    times = np.where(np.arange(4001) < 3790, record.time_s, record.time_s + 1e6)
    (finding,) = audit_trial(replace(record, time_s=times))
    assert finding.columns == ("t_s",) and finding.open


@pytest.mark.parametrize("every", [2, 5])
@pytest.mark.parametrize("name", ["psi in radians", "rudder in radians", "velocities in knots", "v to port"])
def test_columns_recorded_less_often_are_judged_as_others(every, name):
    change, column, truth = FAULTS[name]
    record = faulty("zigzag", change, SHRUNK.get(name))
    slow = np.arange(4001) % every > 0
    for signal in ("psi_rad", "u_mps", "v_mps", "x_m", "y_m"):
        record.signals[signal][slow] = np.nan
    faults = [one for one in audit_trial(record) if one.kind == "fault"]
    assert [one.column for one in faults] == [column]
    assert truth in faults[0].likely_truth


def smooth_rudder(m, late_s):
    """The rudder of a motion by a gear of 2.5 deg/s, and the yaw of a ship of second order that follows it."""
    t = m["t_s"]
    order = np.deg2rad(20) * np.sign(np.sin(2 * np.pi * (t - 20) / 120)) * (t > 20)
    rudder, r, lagging, psi = (np.zeros_like(t) for _ in range(4))
    for k in range(1, len(t)):
        h = t[k] - t[k - 1]
        rudder[k] = rudder[k - 1] + np.clip(order[k - 1] - rudder[k - 1], -np.deg2rad(2.5) * h, np.deg2rad(2.5) * h)
        # T1 T2 r'' + (T1 + T2) r' + r = K (delta + T3 delta'), with T1, T2, T3 = 40, 6, 12 s, as a sum of two lags
        lagging[k] = lagging[k - 1] + h / 6 * (rudder[k - 1] - lagging[k - 1])
        driven = 2.0 * rudder[k - 1] - 1.0 * lagging[k - 1]
        r[k] = r[k - 1] + h / 40 * (0.08 * driven - r[k - 1])
        psi[k] = psi[k - 1] + h * r[k]
    shown = np.interp(t - late_s, t, rudder)
    noise = {"r_radps": np.deg2rad(0.02), "psi_rad": np.deg2rad(0.1)}
    return trial({"t_s": t, "delta_rad": shown, "r_radps": r, "psi_rad": psi}, noise=noise)


@pytest.mark.parametrize("late_s", [3.0, 4.0, 5.0])
def test_a_rudder_that_is_late_is_noted_and_left_as_it_is(late_s):
    record = smooth_rudder(MOTIONS["zigzag"], late_s)
    (finding,) = audit_trial(record)
    assert (finding.column, finding.kind, finding.safe) == ("delta_deg", "note", False)
    assert finding.evidence["delay_s"] == pytest.approx(late_s, abs=1.5)
    assert repair_trial(record)[0] is record


@pytest.mark.parametrize("seed", range(6))
def test_a_helm_that_answers_the_yaw_of_gusts_has_no_late_rudder(tmp_path, seed):
    """A 20/20 zigzag at 1 Hz in gusts: the phase of the loop is no delay of a clock."""
    rng, step, order = np.random.default_rng(seed), 0.1, 0.0
    psi = rate = delta = gust = 0.0
    rows = []
    for k in range(9000):
        if k == 600:
            order = np.radians(20)
        if psi * np.sign(order) > np.radians(20):
            order = -order
        delta += np.clip(order - delta, -np.radians(2.5) * step, np.radians(2.5) * step)
        gust += -gust * step / 8 + 0.01 * np.sqrt(2 * step / 8) * rng.normal()
        rate += step * (0.05 * delta - rate + gust) / 12
        psi += step * rate
        rows.append((k * step, np.degrees(delta), np.degrees(rate), np.degrees(psi), 6.0))
    table = np.array(rows[::10])
    table[:, 1:4] += rng.normal(size=(len(table), 3)) * [0.1, 0.02, 0.1]
    path = tmp_path / "trial.csv"
    np.savetxt(path, table, delimiter=",", header="t_s,delta_deg,r_degps,psi_deg,u_mps", comments="")
    assert rudder_clock_findings(read_trial_file(path)) == []


@pytest.mark.parametrize("late_s", [0.0, -1.0, -3.0])
def test_a_rudder_that_is_not_late_is_not_noted(late_s):
    assert audit_trial(smooth_rudder(MOTIONS["zigzag"], late_s)) == ()


def test_velocities_through_the_water_named_over_ground_are_not_to_be_used():
    m = MOTIONS["zigzag"]
    named = {{"u_mps": "u_ground_mps", "v_mps": "v_ground_mps"}.get(name, name): values for name, values in m.items()}
    (finding,) = audit_trial(trial({**named, **moved(m, (0.3 - 0.4j) * m["t_s"])}))
    assert finding.open and finding.columns == ("u_ground_mps", "v_ground_mps")


@pytest.mark.slow
def test_no_pattern_of_empty_cells_and_times_breaks_the_audit():
    """Seeded: columns at lower rates, in bursts, at one end or in a few rows; times with jumps, repeats and strays."""
    rng = np.random.default_rng(20)
    whole = select_rows(trial(MOTIONS["zigzag"]), np.arange(0, 4001, 8))
    for _ in range(200):
        count = int(rng.choice([2, 3, 9, 40, 500]))
        record = select_rows(whole, np.arange(count))
        rows = np.arange(count)
        kept = rng.random(len(record.signals)) < 0.8
        kept[0] = True
        signals = {name: values for (name, values), keep in zip(record.signals.items(), kept, strict=True) if keep}
        for name, values in signals.items():
            patterns = (
                rows % rng.integers(2, 12) > 0,
                rng.random(count) < rng.random(),
                rows > rng.integers(count),
                rows != rng.integers(count),
                rows % 50 < 25,
            )
            empty = patterns[rng.integers(len(patterns))] if rng.random() < 0.6 else rows < 0
            empty[rng.integers(count)] = False
            signals[name] = np.where(empty, np.nan, values)
        times = record.time_s.copy()
        struck = rng.integers(count, size=rng.integers(4))
        times[struck] = rng.choice([1.7e9, -1e12, 0.0, times[-1] * 3, 1e300], size=len(struck))
        slow = replace(record, time_s=times * rng.choice([1.0, 1e-6, 1e6]), signals=signals)
        right, findings = audit_and_repair(slow)
        assert len(right.time_s) <= count
        json.dumps([asdict(entry) for one in findings for entry in one.entries])


@pytest.mark.parametrize("manoeuvre", ["turn:35", "turn:-20"])
def test_the_sign_of_a_rudder_in_radians_is_judged_on_its_degrees(manoeuvre, mariner) -> None:
    """A turn recorded from its execute: read as it stands, its small rudder seems to turn the ship to port."""
    run = simulate(mariner, parse_manoeuvre(manoeuvre), duration_s=600.0).trajectory
    names = {"delta_rad": "rudder.angle", "r_radps": "motion.r", "psi_rad": "motion.psi"}
    signals = {name: np.asarray(run[of])[::5] for name, of in names.items()}
    noise = {"r_radps": np.radians(0.01), "psi_rad": np.radians(0.1)}
    record = trial({"t_s": run.t[::5], **signals, "delta_rad": DEG * signals["delta_rad"]}, noise=noise)
    assert [(one.column, one.likely_truth.split()[-1]) for one in audit_trial(record)] == [("delta_deg", "degrees")]
    np.testing.assert_allclose(repair_trial(record)[0].signals["delta_rad"], signals["delta_rad"])


def three_digits(degrees):
    """As ``%.3g`` prints: to 1 deg from 100 deg on, to 0.1 deg from 10 deg on."""
    unit = 10.0 ** (np.floor(np.log10(np.abs(degrees) + 1e-300)) - 2)
    return np.round(degrees / unit) * unit


def gentle(heading, amplitude, step):
    """A slow zigzag of `amplitude` deg about a heading, deg, and the course of a ship that does otherwise."""
    t = np.arange(0.0, 400.0, step)
    psi = heading + amplitude * np.sin(2 * np.pi * t / 120)
    rate = amplitude * 2 * np.pi / 120 * np.cos(2 * np.pi * t / 120)
    other = amplitude * 2 * np.pi / 75 * np.cos(2 * np.pi * t / 75 + 1)
    return t, psi, rate, other


@first_fast("step", [0.1, 1.0])
@pytest.mark.parametrize("heading", [0.0, 99.0, 200.0])
def test_a_heading_printed_with_three_digits_is_the_motion_of_its_rate(heading, step):
    for amplitude in (1.0, 2.0, 4.0):
        t, psi, rate, _ = gentle(heading, amplitude, step)
        signals = {"psi_rad": three_digits(psi) * DEG, "r_radps": rate * DEG, "delta_rad": 0.1 * np.sign(rate)}
        found = audit_trial(trial({"t_s": t, **signals}, noise={"r_radps": 0.005 * DEG}))
        assert not [one for one in found if "same motion" in one.what], (amplitude, found)


@pytest.mark.parametrize("heading", [0.0, 200.0])
def test_another_motion_is_found_behind_a_rounded_heading(heading):
    t, psi, _, other = gentle(heading, 8.0, 1.0)
    signals = {"psi_rad": three_digits(psi) * DEG, "r_radps": other * DEG, "delta_rad": 0.1 * np.sign(other)}
    found = audit_trial(trial({"t_s": t, **signals}, noise={"r_radps": 0.005 * DEG}))
    assert [one for one in found if "same motion" in one.what and one.kind == "fault"]


def test_errors_of_a_regression_are_those_of_newey_and_west():
    """As statsmodels has them, of residuals that are moving averages."""
    rng = np.random.default_rng(1)
    design = rng.normal(size=(80, 3))
    target = design @ [1.0, -2.0, 0.5] + np.convolve(rng.normal(size=85), np.ones(6) / 3, "valid")
    found = fit(target, list(design.T))
    plain = OLS(target, design, hasconst=False).fit()
    robust = plain.get_robustcov_results(cov_type="HAC", maxlags=4, use_correction=True)
    assert found is not None
    assert found.values == pytest.approx(plain.params, rel=1e-9)
    assert found.errors == pytest.approx(np.maximum(plain.bse, robust.bse), rel=1e-9)


@pytest.mark.parametrize(("memory_s", "size_degps"), [(15.0, 0.03), (60.0, 0.02), (60.0, 0.03)])
def test_slow_drifts_of_a_straight_run_are_no_late_sensor(memory_s: float, size_degps: float) -> None:
    """Few slow swings are alike at some lag by chance."""
    t = np.arange(0.0, 500.0, 0.5)
    fades = np.exp(-0.5 / memory_s)
    for seed in range(20):
        shocks = np.random.default_rng(seed).standard_normal(len(t) + 400)
        r = lfilter([size_degps * DEG * np.sqrt(1 - fades**2)], [1, -fades], shocks)[400:]
        straight = {
            "t_s": t,
            "u_mps": np.full(len(t), 7.7),
            "v_mps": 0 * t,
            "r_radps": r,
            "psi_rad": 0.5 * np.cumsum(r),
        }
        record = trial(straight, seed=seed, noise={"r_radps": 0.1 * DEG, "psi_rad": 0.1 * DEG})
        assert not [one for one in yaw_findings(record) if "lag_s" in one.evidence], seed
