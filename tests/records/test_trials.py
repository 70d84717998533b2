"""Reading trials of every format, and what is done to them as a whole."""

import re
from dataclasses import replace

import numpy as np
import pytest

from tank2sim.errors import InputError
from tank2sim.records.reading import looks_like_a_trial, read_trial_file
from tank2sim.records.trials import (
    froude_scaled,
    held_over_gaps,
    mean_wind,
    order_instants,
    rows_in,
    sampling_step,
    window,
    with_signals,
)
from tests.records.motions import motion, trial

GOOD = "t_s,delta_deg,u_mps,r_degps,psi_deg\n0,0,1,0,350\n1,10,2,1,359\n2,-10,3,-1,8\n"


@pytest.fixture
def write(tmp_path):
    def write_text(text, name="run.csv"):
        path = tmp_path / name
        path.write_bytes(text.encode("latin-1"))
        return path

    return write_text


def test_a_csv_is_read_in_si_with_a_continuous_heading(write):
    read = read_trial_file(write("# scale: 45.714\n# noise: u_mps 0.03, psi_deg 0.1\n" + GOOD))
    np.testing.assert_allclose(read.signals["delta_rad"], np.deg2rad([0, 10, -10]))
    np.testing.assert_allclose(read.signals["psi_rad"], np.deg2rad([350, 359, 368]))
    np.testing.assert_allclose(read.signals["r_radps"], np.deg2rad([0, 1, -1]))
    assert read.scale == 45.714
    assert read.noise == pytest.approx({"u_mps": 0.03, "psi_rad": np.deg2rad(0.1)})
    assert read.heading("r_radps") == "r_degps"
    assert read.heading("u_mps") == "u_mps"
    assert sampling_step(read) == 1.0


def test_a_rudder_positive_to_port_is_turned_once(write):
    read = read_trial_file(write("# rudder_sign: port\n" + GOOD.replace("delta_deg", "delta_order_deg")))
    np.testing.assert_allclose(read.signals["delta_order_rad"], np.deg2rad([0, -10, 10]))
    np.testing.assert_allclose(read.signals["r_radps"], np.deg2rad([0, 1, -1]))
    assert any("positive to port" in notice for notice in read.notices)


def test_a_foreign_column_is_left_out_and_named(write):
    read = read_trial_file(write(GOOD.replace("u_mps", "thrust_N")))
    assert "thrust_N" not in read.signals
    assert "thrust_N" in read.notices[0]


def test_all_misspelt_columns_are_in_one_message(write):
    text = GOOD.replace("u_mps,r_degps", "u_m,r_deg,thrust_N").replace(",1,0,", ",1,0,5,")
    text = text.replace(",2,1,", ",2,1,5,").replace(",3,-1,", ",3,-1,5,")
    with pytest.raises(InputError) as refused:
        read_trial_file(write(text))
    assert refused.value.place == "columns u_m, r_deg"
    assert "thrust_N" not in str(refused.value) and "u_mps, r_degps" in refused.value.remedy


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("t_s", "time", "header: there is no column t_s"),
        ("delta_deg", "helm_deg", "header: there is no rudder; add delta_deg"),
        ("r_degps", "r_deg", "column r_deg: is not a signal of a trial; call it as r_degps"),
        ("delta_deg", "delta_order", "column delta_order: is not a signal of a trial; call it as delta_order_deg"),
        ("1,10,2", ",10,2", "line 3, column t_s: is empty"),
        ("1,10,2", "x,10,2", "line 3, column t_s: 'x' is not a number"),
        ("1,10,2", "0,10,2", "row 2, column t_s: 0 does not come after 0 of the row before"),
        ("t_s,", "# rudder_sign: left\nt_s,", "comment rudder_sign: is 'left'"),
        ("t_s,", "# noise: u_mps\nt_s,", "comment noise: 'u_mps' is not understood"),
        ("t_s,", "# noise: u_mps -1\nt_s,", "comment noise: 'u_mps -1' is not understood"),
        ("t_s,", "# noise: v_mps 1\nt_s,", "comment noise: there is no column v_mps"),
        ("t_s,", "# scale: 0\nt_s,", "comment scale: is 0"),
    ],
)
def test_faulty_csvs_are_refused_with_their_place(write, old, new, said):
    assert old in GOOD
    path = write(GOOD.replace(old, new, 1))
    with pytest.raises(InputError, match=re.escape(f"{path}: {said}")):
        read_trial_file(path)


def test_a_trial_of_a_craft_is_refused_with_the_commands_that_take_it(write):
    with pytest.raises(InputError, match="is a trial of a craft with thrusters; identify, validate and gap take it"):
        read_trial_file(write("t_s,psi_deg,order_port,order_starboard\n0,0,0,0\n1,0,0,0\n"))


def test_a_wind_of_negative_speed_is_refused(write):
    path = write(GOOD.replace("u_mps", "wind_speed_mps").replace("0,0,1,", "0,0,-1,"))
    with pytest.raises(InputError, match="column wind_speed_mps: has negative values"):
        read_trial_file(path)


def test_a_time_that_falls_is_let_through_to_the_audit(write):
    read = read_trial_file(write(GOOD.replace("1,10,2", "0,10,2")), rising=False)
    np.testing.assert_array_equal(read.time_s, [0, 0, 2])


HSVA = " HSVA, experimental data CPMC\n KVLCC2\n Z10\xb0/10\xb0\n Time series\n" + "".join(
    f"  {0.05 * k:.9f}  {k}.5  .2  3.0  1.1  .05  2.0  .3  -10.0  10.0  40.  1.0\n" for k in range(4)
)
MARIN = "MARIN(Maritime Research Institute Netherlands)\nZig-zag for KVLCC2 : 10 / -10\n\n" + "".join(
    f"{0.135 * k:.2E}\t{k:.2E}\t0.00E+00\t0.1E+00\t3.00E+00\t7.9E+00\t1.0E-02\t0.00E+00\t2.0E-01\t-1.0E+01\t9.0E+01\n"
    for k in range(2000)
)


def test_a_record_of_hsva_is_read_at_model_scale(write):
    read = read_trial_file(write(HSVA, "Z.dat"))
    assert read.scale == 45.714
    np.testing.assert_allclose(read.time_s, [0, 0.05, 0.10, 0.15])
    expected = {"x_m": 0.5, "y_m": 0.2, "psi_rad": np.deg2rad(3), "u_mps": 1.1, "v_mps": 0.05, "r_radps": np.deg2rad(2)}
    expected |= {"delta_rad": np.deg2rad(10), "n_radps": 20 * np.pi}
    assert {name: values[0] for name, values in read.signals.items()} == pytest.approx(expected)


def test_repeating_times_of_marin_become_a_uniform_base_and_this_is_said(write):
    read = read_trial_file(write(MARIN, "Z.dat"))
    assert read.scale == 45.714
    np.testing.assert_allclose(read.time_s, 0.135 * np.arange(2000), rtol=1e-3)
    assert np.ptp(np.diff(read.time_s)) < 1e-9
    assert any("uniform step" in notice for notice in read.notices)
    assert read.signals["delta_rad"][0] == pytest.approx(np.deg2rad(10))
    assert read.signals["n_radps"][0] == pytest.approx(3 * np.pi)


def test_a_sample_lost_from_a_record_of_marin_is_not_papered_over(write):
    lines = MARIN.split("\n")
    path = write("\n".join(lines[:300] + lines[340:]), "Z.dat")
    with pytest.raises(InputError, match=r"line \d+, column t_s: the times do not rise"):
        read_trial_file(path)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (HSVA.replace("HSVA,", "SSPA,"), "line 1: is not a record of MARIN or HSVA"),
        (HSVA.replace(" 1.5 ", " x "), "line 6, column x_m: 'x' is not a number"),
        (HSVA.replace(" 1.5 ", " "), "line 6: there are 11 cells for 12 columns"),
        (HSVA[:100], "has no rows of measured values"),
    ],
)
def test_faulty_dat_files_are_refused_with_their_place(write, text, said):
    path = write(text, "Z.dat")
    with pytest.raises(InputError, match=re.escape(said)):
        read_trial_file(path)


def test_a_record_of_the_esso_osaka_may_hold_nan(write):
    header = "t [s],x_position_mid [m],u_velo [m/s],y_position_mid [m],vm_velo [m/s],psi_hat [rad],r_angvelo [rad/s],"
    header += "n_prop [rps],delta_rudder [rad],wind_velo_relative_mid [m/s],wind_dir_relative_mid [rad],"
    header += "wind_velo_true [m/s],wind_dir_true [rad]\n"
    rows = ["0,1,2,3,4,6.2,.1,10,.2,1,2,3,4", "0.1,1,NaN,3,4,0.1,.1,-10,.2,1,2,3,4", "0.2,1,,3,4,0.2,.1,10,.2,1,2,3,4"]
    read = read_trial_file(write(header + "\n".join(rows)))
    np.testing.assert_array_equal(np.isnan(read.signals["u_mps"]), [False, True, True])
    np.testing.assert_allclose(read.signals["psi_rad"], [6.2, 0.1 + 2 * np.pi, 0.2 + 2 * np.pi])
    np.testing.assert_allclose(read.signals["n_radps"], 2 * np.pi * np.array([10, -10, 10]))
    assert read.signals["delta_rad"][0] == 0.2
    assert read.signals["wind_direction_rad"][0] == 4
    with pytest.raises(InputError, match=re.escape("line 3, column delta_rudder [rad]: 'x' is not a number")):
        read_trial_file(write(header + "\n".join(rows).replace("-10,.2", "-10,x")))
    with pytest.raises(InputError, match=re.escape("there is not one column vm_velo [m/s]")):
        read_trial_file(write((header + "\n".join(rows)).replace("vm_velo", "v")))


@pytest.mark.parametrize("blank", [",,,,,,,,,,,,", "nan" + 12 * ",nan", " , ,,,,,,,,,,,"])
def test_blank_rows_at_the_end_of_an_esso_osaka_record_are_no_rows(tmp_path, data, blank):
    whole = data / "data/esso_osaka/zigzag/zigzag_31-Jul-2020_13_04_24.csv"
    lines = whole.read_text(encoding="latin-1").splitlines()[:50]
    for end, rows in (("blank", [*lines, blank, "", blank]), ("whole", lines)):
        (tmp_path / f"{end}.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    blank_end, known = (read_trial_file(tmp_path / f"{end}.csv") for end in ("blank", "whole"))
    np.testing.assert_array_equal(blank_end.time_s, known.time_s)
    np.testing.assert_array_equal(blank_end.signals["r_radps"], known.signals["r_radps"])
    (tmp_path / "inside.csv").write_text("\n".join([*lines[:20], blank, *lines[20:]]) + "\n", encoding="utf-8")
    with pytest.raises(InputError, match="row 20 has no time"):
        read_trial_file(tmp_path / "inside.csv")


def test_wind_of_the_esso_osaka_is_where_it_comes_from(data):
    """The true wind, less the ship's own, is the relative one: both directions are where the wind comes from."""
    read = read_trial_file(data / "data/esso_osaka/turning/turn_14-Sep-2020_13_39_32.csv")
    s = read.signals
    air = -s["wind_speed_mps"] * np.exp(1j * s["wind_direction_rad"])
    relative = -(air * np.exp(-1j * s["psi_rad"]) - (s["u_mps"] + 1j * s["v_mps"]))
    given = s["wind_rel_speed_mps"] * np.exp(1j * s["wind_rel_direction_rad"])
    assert np.sqrt(np.mean(np.abs(relative - given) ** 2)) < 0.005
    ahead = s["u_mps"] > 0.15
    assert np.corrcoef(s["delta_rad"][ahead], s["r_radps"][ahead])[0, 1] > 0.9


@pytest.mark.slow
def test_every_real_record_is_read(data):
    files = [*data.glob("data/kvlcc2_*/*.dat"), *data.glob("data/esso_osaka/*/*.csv")]
    assert files, "the folders hold no record"
    for file in files:
        read = read_trial_file(file)
        assert np.all(np.diff(read.time_s) > 0)
        assert {"u_mps", "v_mps", "r_radps", "psi_rad", "x_m", "y_m", "delta_rad", "n_radps"} <= set(read.signals)


def test_froude_scaling_keeps_every_number_without_dimension():
    small = trial(motion(duration=60.0))
    large = froude_scaled(small, 25.0)
    np.testing.assert_allclose(large.time_s, 5 * small.time_s)
    factors = {"u_mps": 5, "v_mps": 5, "r_radps": 0.2, "psi_rad": 1, "x_m": 25, "y_m": 25, "delta_rad": 1}
    for name, factor in factors.items():
        np.testing.assert_allclose(large.signals[name], factor * small.signals[name])
    back = froude_scaled(large, 1 / 25.0)
    np.testing.assert_allclose(back.signals["r_radps"], small.signals["r_radps"])
    for wrong in (0.0, -1.0, np.inf, np.nan):
        with pytest.raises(ValueError, match="ratio of lengths"):
            froude_scaled(small, wrong)


def test_stated_noise_is_scaled_as_its_signal(write):
    read = froude_scaled(read_trial_file(write("# noise: u_mps 0.03, r_degps 0.1\n" + GOOD)), 4.0)
    assert read.noise == pytest.approx({"u_mps": 0.06, "r_radps": np.deg2rad(0.05)})


def test_a_window_holds_both_its_ends():
    part = window(trial(motion(duration=60.0)), 10.0, 20.0)
    assert (part.time_s[0], part.time_s[-1]) == pytest.approx((10.0, 20.0))
    assert all(len(values) == 101 for values in part.signals.values())
    with pytest.raises(InputError, match="has no two rows between 70 s and 80 s"):
        window(part, 70.0, 80.0)


def test_the_mean_wind_is_a_mean_of_vectors_over_the_samples_of_all_trials(write):
    rows = "t_s,delta_deg,r_degps,wind_speed_mps,wind_direction_deg\n0,0,0,3,90\n1,0,0,4,0\n2,0,0,,0\n3,0,0,9,\n"
    windy = read_trial_file(write(rows))
    calm = replace(windy, signals={"delta_rad": windy.signals["delta_rad"]})
    assert mean_wind([windy, calm]) == pytest.approx((2.5, np.arctan2(3, 4)))
    opposite = replace(
        windy, signals=windy.signals | {"wind_direction_rad": windy.signals["wind_direction_rad"] + np.pi}
    )
    assert mean_wind([windy, opposite])[0] == pytest.approx(0, abs=1e-12)
    assert mean_wind([calm]) is None


def test_changed_signals_leave_the_others_and_say_so(write):
    before = read_trial_file(write("# noise: u_mps 0.03\n" + GOOD))
    after = with_signals(before, {"u_mps": None, "r_radps": 2 * before.signals["r_radps"]}, "changed")
    assert "u_mps" not in after.signals
    assert after.noise == {}
    assert after.notices[-1] == "changed"
    np.testing.assert_array_equal(after.signals["psi_rad"], before.signals["psi_rad"])
    np.testing.assert_array_equal(after.signals["r_radps"], 2 * before.signals["r_radps"])


@pytest.mark.parametrize(
    ("comment", "right"),
    [
        ("# rudder-sign: port", "rudder_sign"),
        ("# Rudder_Sign: port", "rudder_sign"),
        ("# rudder sign: port", "rudder_sign"),
        ("# rudder_sign = port", "rudder_sign"),
        ("# ruddersign: port", "rudder_sign"),
        ("# Scale: 45.7", "scale"),
        ("# scales: 45.7", "scale"),
        ("# nois: u_mps 0.03", "noise"),
        ("# NOISE: u_mps 0.03", "noise"),
    ],
)
def test_a_comment_that_resembles_a_key_is_refused_with_its_spelling(tmp_path, comment, right):
    path = tmp_path / "run.csv"
    path.write_text(f"{comment}\nt_s,delta_deg,u_mps\n0,0,5\n1,0,5\n")
    with pytest.raises(InputError, match=f"'# {right}: ...'"):
        read_trial_file(path)


@pytest.mark.parametrize(
    "comment",
    [
        *("# source: a pond", "# note: wind 3 m/s", "# a zigzag 20/20, run 3", "# noise was heard from the bow"),
        *("# see https://example.org/noise", "# ship: a tanker", "# scale 1:25 model", "# model: wood"),
    ],
)
def test_free_text_stays_allowed(tmp_path, comment):
    path = tmp_path / "run.csv"
    path.write_text(f"{comment}\nt_s,delta_deg,u_mps\n0,5,5\n1,5,5\n")
    assert read_trial_file(path).scale is None


@pytest.mark.parametrize("name", ["run.csv", "run.dat", "RUN.CSV"])
@pytest.mark.parametrize("mark", ["", "\xef\xbb\xbf", "# a comment\n"])
def test_what_a_folder_takes_for_a_trial_is_read_as_one(write, name, mark):
    path = write(mark + GOOD, name)
    assert looks_like_a_trial(path) and len(read_trial_file(path).time_s) == 3


def test_what_no_format_recognises_is_refused_by_the_format_of_its_ending(write):
    for name, text, problem in (
        ("run.dat", "0 1 2\n", "its first line names neither"),
        ("run.csv", "time,delta_deg\n0,1\n1,1\n", "there is no column t_s"),
    ):
        path = write(text, name)
        assert not looks_like_a_trial(path)
        with pytest.raises(InputError) as refusal:
            read_trial_file(path)
        assert refusal.value.source == str(path) and problem in refusal.value.problem


def test_an_order_was_given_within_the_interval_before_the_row_that_shows_it():
    time = np.array([2.0, 3.0, 7.0, 7.5])
    np.testing.assert_allclose(order_instants(time), [2.0, 2.5, 5.0, 7.25])
    np.testing.assert_allclose(order_instants(time, np.array([0.0, 0.25, 1.0])), [2.0, 2.0, 4.0, 7.5])


def test_an_order_holds_over_gaps_and_the_first_from_the_beginning():
    order = np.array([np.nan, 0.1, np.nan, np.nan, -0.2, np.nan])
    np.testing.assert_array_equal(held_over_gaps(order), [0.1, 0.1, 0.1, 0.1, -0.2, -0.2])


@pytest.mark.parametrize(("step_s", "rows"), [(0.05, 1), (0.1, 1), (0.3, 3), (3 * 0.1 - 1e-9, 3), (0.29, 2)])
def test_whole_rows_in_a_step_are_counted_also_by_rounded_steps(step_s, rows):
    assert rows_in(step_s, 0.1) == rows
