"""``signals`` as a command and a function: statistics, spectra and filters of files, and what its result holds."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import tank2sim as t2s
from tank2sim.apps.signals.command import signals
from tank2sim.apps.signals.result import SignalsResult
from tank2sim.apps.signals.study import SignalSettings, SignalsStudy, analyse, filtered
from tank2sim.cli.derived import command_of
from tank2sim.errors import InputError
from tank2sim.records.reading import read_trial_file
from tank2sim.records.signals.filtering import savitzky_golay
from tank2sim.records.signals.sampling import even_series
from tests.records.signals.made import first_order, nomoto, trial

COMMAND = command_of(signals.verb)


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    """300 s of a rudder in steps, a yaw rate of K 0.08 1/s and T 3 s with noise, a heading; written by hand."""
    random = np.random.default_rng(8)
    rudder = np.repeat(random.uniform(-20, 20, 400), random.integers(5, 40, 400))[:3000]
    rate, a = np.zeros(3000), np.exp(-0.1 / 3.0)
    for row in range(1, 3000):
        rate[row] = a * rate[row - 1] + 0.08 * (1 - a) * rudder[row - 1]
    heading = 100 + 0.1 * np.cumsum(rate)
    noisy = rate + 0.05 * random.standard_normal(3000)
    rows = np.column_stack([0.1 * np.arange(3000), rudder, np.full(3000, 84.0), noisy, heading])
    file = tmp_path_factory.mktemp("signals") / "steps.csv"
    lines = [",".join(f"{value:.6g}" for value in row) for row in rows]
    comments = ["# scale: 45.714", "# noise: r_degps 0.05, psi_deg 0.1"]
    file.write_text("\n".join([*comments, "t_s,delta_deg,n_rpm,r_degps,psi_deg", *lines]) + "\n")
    return file


def run(*arguments):
    result = CliRunner(env={"COLUMNS": "160"}).invoke(COMMAND, [str(argument) for argument in arguments])
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result


def test_table_and_json_have_each_column_in_the_units_of_the_file(path, tmp_path):
    shown = run(path, "--json", tmp_path / "found.json")
    assert shown.exit_code == 0
    for word in ("delta_deg", "r_degps", "psi_deg", "constant", "stationary", "corr."):
        assert word in shown.output
    (trial,) = json.loads((tmp_path / "found.json").read_text())["trials"]
    values = read_trial_file(path).signals
    column = trial["columns"]["r_degps"]
    assert column["unit"] == "deg/s"
    assert column["standard_deviation"] == pytest.approx(np.rad2deg(np.std(values["r_radps"])))
    spectrum = column["spectrum"]
    area = np.sum(spectrum["density"]) * spectrum["frequency_hz"][0]
    assert area == pytest.approx(column["standard_deviation"] ** 2, rel=0.2)
    density = column["probability_density"]
    assert np.trapezoid(density["density"], density["values"]) == pytest.approx(1.0, abs=0.01)
    assert trial["columns"]["n_rpm"]["constant"] is True
    assert trial["columns"]["n_rpm"]["mean"] == pytest.approx(84.0)
    steering = trial["rudder_to_yaw_rate"]
    assert np.hypot(*steering["transfer"]["response"][1]) == pytest.approx(0.08, rel=0.2)
    assert steering["cross_correlation"]["lag_of_largest_s"] > 0


@pytest.mark.parametrize("name", ["r_degps", "r_radps", "r"])
def test_one_column_by_any_of_its_names(path, name):
    shown = run(path, "--columns", name).output
    assert "r_degps" in shown
    assert "psi_deg" not in shown


def test_a_column_that_is_not_there_is_refused(path):
    with pytest.raises(InputError, match=r"column phi_deg: is not in the trial; give one of delta_deg"):
        run(path, "--columns", "phi_deg")


def test_a_filter_whose_trial_is_not_written_says_how_to_write_it(path, tmp_path):
    said = "the filtered trial is not written: add -o FILTERED.csv"
    assert said in run(path, "--columns", "r", "--filter", "lowpass:0.3").output
    assert said not in run(path, "--columns", "r", "--filter", "lowpass:0.3", "-o", tmp_path / "o.csv").output
    assert said not in run(path).output


def test_a_filtered_column_takes_the_place_of_the_measured_one(path, tmp_path):
    out = tmp_path / "filtered.csv"
    shown = run(path, "--columns", "r", "--filter", "lowpass:0.3,causal", "-o", out)
    assert "delays 0.15 Hz by" in shown.output
    before, after = read_trial_file(path), read_trial_file(out)
    assert "r_degps filtered by lowpass:0.3,causal: delays 0.15 Hz" in out.read_text().splitlines()[1]
    assert np.std(np.diff(after.signals["r_radps"])) < 0.4 * np.std(np.diff(before.signals["r_radps"]))
    for name in ("delta_rad", "n_radps", "psi_rad"):
        assert np.allclose(after.signals[name], before.signals[name], rtol=1e-9, atol=1e-12)
    assert np.allclose(after.time_s, before.time_s)
    assert after.scale == before.scale
    assert dict(after.noise) == {"psi_rad": pytest.approx(np.deg2rad(0.1))}


def test_detrending_and_smoothing_write_trials_too(path, tmp_path):
    for text in ("detrend:1", "savgol:11,3", "spline:0.5", "bandpass:0.01,0.5"):
        assert "no phase shift" in run(path, "--columns", "r", "--filter", text, "-o", tmp_path / "o.csv").output
        assert read_trial_file(tmp_path / "o.csv").signals["r_radps"].shape == (3000,)


def test_decimation_thins_the_whole_trial(path, tmp_path):
    out = tmp_path / "thin.csv"
    run(path, "--filter", "decimate:5", "-o", out)
    before, after = read_trial_file(path), read_trial_file(out)
    assert np.allclose(after.time_s, before.time_s[::5])
    # What is left of the noise, 0.05 deg/s times the root of 0.8/5, makes up this difference.
    error = np.rad2deg(np.std((after.signals["psi_rad"] - before.signals["psi_rad"][::5])[20:-20]))
    assert error < 0.02
    assert set(after.signals) == set(before.signals)


def test_the_measured_trial_is_never_overwritten(path, tmp_path):
    text = path.read_text()
    for options, match in ((["-o", path], "would be overwritten"), (["--json", path], "ends in .csv")):
        with pytest.raises(InputError, match=match):
            run(path, "--columns", "r", "--filter", "lowpass:0.3", *options)
    with pytest.raises(InputError, match="two outputs"):
        run(path, "--columns", "r", "--filter", "lowpass:0.3", "-o", tmp_path / "a", "--json", tmp_path / "a")
    assert path.read_text() == text


@pytest.mark.parametrize(
    ("options", "words"),
    [(["-o", "x.csv"], "needs a filter"), (["--filter", "lowpass:0.3"], "must be named"),
     (["--columns", "r", "--filter", "lowpass:77"], "not between"),
     (["--columns", "r", "--filter", "x"], "not a filter"),
     (["--columns", "r", "--filter", "decimate:2"], "leave the column out"), (["--segment", "900"], "not a length")],
)  # fmt: skip
def test_what_does_not_fit_is_refused_in_one_line(path, options, words):
    with pytest.raises(InputError, match=words):
        run(path, *options)


def test_a_column_with_a_long_gap_is_left_out_with_a_notice_or_refused_by_name(path, tmp_path):
    lines = path.read_text().splitlines()
    gappy = tmp_path / "gappy.csv"
    cut = [line if not 1000 <= n < 1100 else ",".join([*line.split(",")[:-1], ""]) for n, line in enumerate(lines)]
    gappy.write_text("\n".join(cut) + "\n")
    assert "psi_deg is left out: it has no value from" in run(gappy).output
    with pytest.raises(InputError, match=r"gappy.csv: column psi_deg: has no value from .* allow it by max_gap_s"):
        run(gappy, "--columns", "psi")
    assert "interpolated by straight lines" in run(gappy, "--columns", "psi", "--max-gap", "12").output


def test_measured_trials_of_every_kind(data, tmp_path):
    files = [
        data / "data/kvlcc2_hsva/HSVA_CPMC_KVLCC2_Z_20_10_S.dat",
        *sorted((data / "data/esso_osaka/zigzag").glob("*.csv"))[:1],
    ]
    if not all(file.exists() for file in files):
        pytest.skip("the measured trials are missing")
    shown = run(*files, "--columns", "r", "--columns", "delta").output
    assert shown.count("rudder angle to yaw rate: correlation") == 2


@pytest.fixture(scope="module")
def sine(tmp_path_factory):
    """1000 s of a heading rate that is a sine of 0.05 Hz and 2 deg/s about 0.5 deg/s, with noise of 0.1 deg/s."""
    time = 0.5 * np.arange(2000)
    rate = 0.5 + 2.0 * np.sin(2 * np.pi * 0.05 * time) + 0.1 * np.random.default_rng(3).standard_normal(2000)
    rows = np.column_stack([time, np.full(2000, 5.0), rate])
    file = tmp_path_factory.mktemp("signals") / "sine.csv"
    np.savetxt(file, rows, delimiter=",", header="t_s,delta_deg,r_degps", comments="", fmt="%.8g")
    return file


def test_statistics_are_in_the_units_of_the_file(sine):
    rows = t2s.signals(sine).statistics.set_index("column")
    assert rows.loc["r_degps", "mean"] == pytest.approx(0.5, abs=0.01)
    assert rows.loc["r_degps", "standard_deviation"] == pytest.approx(np.hypot(np.sqrt(2), 0.1), rel=0.01)
    assert rows.loc["r_degps", "peak_hz"] == pytest.approx(0.05, rel=0.1)
    assert rows.loc["delta_deg", "mean"] == pytest.approx(5.0) and rows.loc["r_degps", "unit"] == "deg/s"
    assert np.isnan(rows.loc["delta_deg", "correlation_time_s"])  # constant


def test_the_spectrum_has_the_variance_of_the_signal(sine):
    found = t2s.signals(sine, "r_degps")
    spectrum = found.spectrum("r_degps")
    area = np.trapezoid(spectrum["density"], spectrum["frequency_hz"])
    assert area == pytest.approx(2.01, rel=0.1)
    assert (spectrum["low"] < spectrum["density"]).all() and (spectrum["density"] < spectrum["high"]).all()
    with pytest.raises(LookupError, match="r_degps"):
        found.spectrum("u_mps")


def test_a_filter_removes_the_sine_and_the_trial_is_written_elsewhere(sine, tmp_path):
    found = t2s.read_trial(sine).signals(["r_degps"], filter="lowpass:0.01")
    assert found.filtered is not None
    after = found.filtered.df["r_degps"][400:1600]
    assert after.mean() == pytest.approx(0.5, abs=0.02) and after.std() < 0.1
    found.filtered.to_csv(tmp_path / "filtered.csv")
    again = t2s.read_trial(tmp_path / "filtered.csv").df
    assert np.allclose(again["r_degps"], found.filtered.df["r_degps"], equal_nan=True)
    with pytest.raises(t2s.InputError) as refusal:
        found.filtered.to_csv(sine)
    assert refusal.value.source == str(sine) and refusal.value.remedy
    assert t2s.signals(sine).filtered is None


@pytest.mark.parametrize(
    ("options", "source"),
    [
        ({"columns": ["phi_deg"]}, "sine.csv"),
        ({"filter": "lowpass:0.1"}, "filter"),
        ({"columns": ["r"], "filter": "nothing:1"}, "filter"),
        ({"columns": ["r"], "filter": "decimate:2"}, "columns"),
    ],
)
def test_bad_input_is_refused_with_place_and_remedy(sine, options, source):
    with pytest.raises(t2s.InputError) as refusal:
        t2s.signals(sine, **options)
    assert refusal.value.source.endswith(source) and refusal.value.problem and refusal.value.remedy


@pytest.fixture(scope="module")
def measured():
    rudder = np.repeat(0.2 * first_order(2, 1.0, 200), 10)
    return trial(0.1 * np.arange(2000), delta_rad=rudder, r_radps=nomoto(rudder, 0.1, 0.08, 3.0), n_radps=np.ones(2000))


@pytest.fixture(scope="module")
def result(measured):
    before = even_series(measured, "r_radps")
    applied = filtered("savgol:11,3", "r_degps filtered", before, savitzky_golay(before, 11, 3))
    return SignalsResult(SignalsStudy(trials=(analyse(measured, SignalSettings()),), filter=applied))


def test_the_sections_have_the_tests_and_every_chart(result):
    assert list(result.charts()) == [
        "filter_response",
        "filter_signal",
        "made_histories",
        "made_transfer",
        "made_cross_correlation",
        *(f"made_{name}_{kind}" for name in ("delta", "r") for kind in ("density", "autocorrelation", "spectrum")),
    ]
    statistics, tests = result.tables
    constant = statistics.df.set_index("column").loc["n_rpm"]
    assert constant["stationarity"] == "constant" and float(constant["mean"]) == pytest.approx(9.549, rel=1e-3)
    assert tests.df["signal"].to_list() == ["rudder angle", "yaw rate"]
    assert [table.caption for table in result.screen_tables] == ["made"]


def test_files_of_one_name_get_names_of_their_own(measured):
    found = SignalsResult(SignalsStudy(trials=(analyse(measured, SignalSettings(columns=["r"])),) * 2))
    assert [section.heading for section in found.sections[:2]] == ["made_1", "made_2"]
    assert len(found.charts()) == 8


def test_a_trial_whose_name_begins_as_another_keeps_its_own_charts(measured):
    settings = SignalSettings(columns=["r"])
    trials = tuple(analyse(replace(measured, path=Path(name)), settings) for name in ("a.csv", "a_b.csv"))
    sections = SignalsResult(SignalsStudy(trials=trials)).sections
    assert [len(section.charts) for section in sections] == [1, 1, 3, 3]
