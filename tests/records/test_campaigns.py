"""Reading captive campaigns: conventions met at the door, faults reported with their place."""

import math

import numpy as np
import pytest

from tank2sim.errors import InputError
from tank2sim.records.campaigns import read_campaign

MODEL = """[model]
name = "box"
length_m = 4.0
mass_kg = 400.0
yaw_inertia_kgm2 = 420.0
x_G_m = 0.1
[test]
speed_mps = 1.2
force_convention = "{convention}"
{more}
"""
RUN = """[[runs]]
file = "{file}"
type = "{type}"
{more}
"""
HEADER = "t_s,y_m,psi_deg,v_mps,r_degps,speed_mps,delta_deg,X_N,Y_N,N_Nm"
ROWS = "\n".join(f"{0.1 * k:.1f},0,0,-0.1,0,1.2,10,{-5 - k},{3 + k},{2 - k}" for k in range(20))


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "drift.csv").write_text(f"{HEADER}\n{ROWS}\n")
    return tmp_path


def campaign(folder, runs=None, convention="on_gauge", more=""):
    text = MODEL.format(convention=convention, more=more)
    text += RUN.format(file="drift.csv", type="static_drift", more="drift_deg = 4.78") if runs is None else runs
    path = folder / "campaign.toml"
    path.write_text(text)
    return path


def test_angles_and_revolutions_come_in_radians(folder):
    read = read_campaign(campaign(folder, more="propeller_rps = 10.0"))
    run = read.runs[0]
    assert run.delta_rad[0] == pytest.approx(math.radians(10))
    assert run.sheet.drift_rad == pytest.approx(math.radians(4.78))
    assert run.propeller_radps == pytest.approx(20 * math.pi)
    assert run.duration_s == pytest.approx(2.0)


@pytest.mark.parametrize(("convention", "sign"), [("on_gauge", 1), ("on_model", -1), ("hydrodynamic", 1)])
def test_forces_come_in_the_sense_of_the_water(folder, convention, sign):
    read = read_campaign(campaign(folder, convention=convention))
    run = read.runs[0]
    assert (run.X_N[0], run.Y_N[0], run.N_Nm[0]) == (-5 * sign, 3 * sign, 2 * sign)
    assert read.inertia_removed == (convention == "hydrodynamic")


def test_a_rudder_that_is_positive_to_port_changes_its_sign(folder):
    run = read_campaign(campaign(folder, more='rudder_sign = "port"')).runs[0]
    assert run.delta_rad[0] == pytest.approx(-math.radians(10))


def test_missing_velocity_columns_follow_from_sheet_and_position(tmp_path):
    time = np.arange(0, 20, 0.05)
    y = 0.2 * np.sin(time)
    rows = "\n".join(f"{t:.3f},{a:.9f},1,2,3" for t, a in zip(time, y, strict=True))
    (tmp_path / "sway.csv").write_text("t_s,y_m,X_N,Y_N,N_Nm\n" + rows)
    (tmp_path / "drift.csv").write_text("t_s,X_N,Y_N,N_Nm\n0,1,2,3\n1,1,2,3\n")
    runs = RUN.format(file="sway.csv", type="pure_sway", more="")
    runs += RUN.format(file="drift.csv", type="static_drift", more="drift_rad = 0.1")
    sway, drift = read_campaign(campaign(tmp_path, runs)).runs
    np.testing.assert_allclose(sway.v_mps[1:-1], 0.2 * np.cos(time[1:-1]), atol=1e-3)
    np.testing.assert_allclose(drift.v_mps, -1.2 * math.sin(0.1))
    assert np.all(drift.speed_mps == 1.2)


AVERAGES = """[averages]
file = "table.csv"
scaling = "prime"
rudder_sign = "port"
[averages.columns]
drift_deg = "beta"
rudder_deg = "delta"
speed_mps = "U"
X = "X'"
Y = "Y'"
N = "N'"
"""


def test_averages_become_dimensional_with_their_own_speed_and_repeated_rows_count_once(tmp_path):
    table = "no,beta,delta,U,X',Y',N',what\n1,0,5,0.6,-1e-4,2e-3,-1e-3,rudder\n2,6 ,0,1.2,0,4e-3,1e-3,drift\n"
    (tmp_path / "table.csv").write_text(table + "7,6,0,1.2,0,4e-3,1e-3,drift + rudder\n")
    read = read_campaign(campaign(tmp_path, AVERAGES, convention="hydrodynamic"))
    rudder, drift = read.runs
    assert [run.type for run in read.runs] == ["static_rudder", "static_drift"]
    assert rudder.Y_N[0] == pytest.approx(2e-3 * 0.5 * 1000 * 16 * 0.36)
    assert rudder.N_Nm[0] == pytest.approx(-1e-3 * 0.5 * 1000 * 64 * 0.36)
    assert rudder.delta_rad[0] == pytest.approx(-math.radians(5))
    assert drift.v_mps[0] == pytest.approx(-1.2 * math.sin(math.radians(6)))
    assert rudder.name == "table.csv line 2"
    assert "1 of 3 rows" in read.remarks[0]


@pytest.mark.parametrize("force", ["0", "1e-200", "-0"])
def test_a_gauge_that_shows_nothing_in_any_row_of_averages_is_refused_by_its_column(tmp_path, force):
    table = f"beta,delta,U,X',Y',N'\n0,5,0.6,-1e-4,2e-3,{force}\n6,0,1.2,-1e-4,4e-3,{force}\n"
    (tmp_path / "table.csv").write_text(table)
    with pytest.raises(InputError, match=r"table\.csv: column N': is zero in every row"):
        read_campaign(campaign(tmp_path, AVERAGES, convention="hydrodynamic"))


@pytest.mark.parametrize(
    ("change", "place", "reported"),
    [
        (("length_m = 4.0", "lenght_m = 4.0"), "model.lenght_m", "did you mean length_m"),
        (("length_m = 4.0", "length_m = -4.0"), "model.length_m", "at least 0.01"),
        (("mass_kg = 400.0", ""), "model.mass_kg", "is missing"),
        (('"on_gauge"', '"gauge"'), "test.force_convention", "on_model"),
        (("speed_mps = 1.2", 'speed_mps = "fast"'), "test.speed_mps", "a number was expected"),
        (('type = "static_drift"', 'type = "drift"'), "runs.0.type", "static_drift"),
        (("drift_deg = 4.78", "drift_deg = 4.78\ndrift_rad = 0.1"), "runs.0.drift_rad", "twice, also as drift_deg"),
        (("drift_deg = 4.78", "drift_deg = 478"), "runs.0.drift_deg", "below 90"),
        (("x_G_m = 0.1", "x_G_m = nan"), "model.x_G_m", "finite"),
        (("[test]", "[test"), "line 7", ""),
        (("length_m = 4.0", f"length_m = {'[' * 5000}{']' * 5000}"), "campaign.toml", "nested too deeply"),
        (("length_m = 4.0", f"length_m = {'1' * 5000}"), "campaign.toml", "thousands of digits"),
    ],
)
def test_a_fault_of_the_file_is_reported_with_its_key(folder, change, place, reported):
    path = campaign(folder)
    path.write_text(path.read_text().replace(*change))
    with pytest.raises(InputError) as fault:
        read_campaign(path)
    assert place in str(fault.value)
    assert reported in str(fault.value)


def test_missing_files_and_bad_cells_are_reported_together_by_run(folder):
    (folder / "bad.csv").write_text(f"{HEADER}\n0,0,0,0,0,1.2,0,x,1,1\n")
    runs = RUN.format(file="drift.csv", type="static_drift", more="")
    runs += RUN.format(file="gone.csv", type="pure_sway", more="")
    runs += RUN.format(file="bad.csv", type="static_drift", more="")
    path = campaign(folder, runs)
    with pytest.raises(InputError, match=r"gone\.csv.*does not exist.*bad\.csv.*line 2, column X_N.*keep_going=True"):
        read_campaign(path)
    read = read_campaign(path, keep_going=True)
    assert [run.name for run in read.runs] == ["drift.csv"]
    assert len(read.faults) == 2


def test_files_that_are_all_missing_are_counted(folder):
    runs = "".join(RUN.format(file=f"run_{number:03}.csv", type="static_drift", more="") for number in range(1, 205))
    with pytest.raises(InputError, match=r"run_001\.csv.*203 more.*run_204\.csv") as fault:
        read_campaign(campaign(folder, runs))
    assert len(str(fault.value)) < 400


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (('drift_deg = "beta"', 'drift_deg = "beta"\ndrift_rad = "beta"'), "columns.drift_rad: .* also as drift_deg"),
        (
            ('drift_deg = "beta"', 'drift_deg = "beta"\nyaw_rate_prime = "r"\nyaw_rate_degps = "r"'),
            "columns.yaw_rate_degps: .* also as yaw_rate_prime",
        ),
        (
            ('drift_deg = "beta"', 'drift_deg = "beta"\npropeller_rpm = "n"\npropeller_rps = "n"'),
            "columns.propeller_rps: .* also as propeller_rpm",
        ),
        (('drift_deg = "beta"', 'drift_deg = "beta"\nheel_deg = "nope"'), "columns.heel_deg: the table has no"),
        (('drift_deg = "beta"', 'drift_deg = "beta"\nheel_deg = 3'), "columns.heel_deg"),
        (('drift_deg = "beta"', 'drift_deg = "n"'), "line 2: drift_deg is 180.*; correct"),
        (('drift_deg = "beta"', 'drift_rad = "n"'), "line 2: drift_rad is 180.*; .*drift_deg"),
    ],
)
def test_a_fault_of_the_columns_of_averages_names_them_as_the_file_does(tmp_path, change, words):
    (tmp_path / "table.csv").write_text("beta,delta,U,X',Y',N',n,r\n0,5,0.6,-1e-4,2e-3,1e-3,180,0\n")
    assert change[0] in AVERAGES
    with pytest.raises(InputError, match=words):
        read_campaign(campaign(tmp_path, AVERAGES.replace(*change), convention="hydrodynamic"))


def test_a_campaign_needs_runs_or_averages_and_not_both(folder):
    with pytest.raises(InputError, match="has no run"):
        read_campaign(campaign(folder, ""))
    both = RUN.format(file="drift.csv", type="static_drift", more="") + AVERAGES
    with pytest.raises(InputError, match="has both"):
        read_campaign(campaign(folder, both))


def test_the_public_table_of_averages_is_read_as_it_is(data):
    read = read_campaign(data / "data" / "kvlcc2_captive_hmri" / "campaign.toml")
    assert len(read.runs) == 63
    assert {run.type for run in read.runs} == {"static_drift", "static_rudder", "drift_and_rudder"}
    drifts = [run for run in read.runs if run.type == "static_drift"]
    largest = max(drifts, key=lambda run: run.sheet.drift_rad or 0.0)
    assert largest.Y_N[0] / float(read.scales.force) == pytest.approx(1.6637e-2)
    assert largest.v_mps[0] < 0 < largest.Y_N[0]
