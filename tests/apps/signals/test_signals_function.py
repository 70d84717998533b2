"""Signals of trials through the public API: statistics in the units of the file, spectra, filters."""

from __future__ import annotations

import numpy as np
import pytest

import tank2sim as t2s


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    """1000 s of a heading rate that is a sine of 0.05 Hz and 2 deg/s about 0.5 deg/s, with noise of 0.1 deg/s."""
    time = 0.5 * np.arange(2000)
    rate = 0.5 + 2.0 * np.sin(2 * np.pi * 0.05 * time) + 0.1 * np.random.default_rng(3).standard_normal(2000)
    rows = np.column_stack([time, np.full(2000, 5.0), rate])
    file = tmp_path_factory.mktemp("signals") / "sine.csv"
    np.savetxt(file, rows, delimiter=",", header="t_s,delta_deg,r_degps", comments="", fmt="%.8g")
    return file


def test_statistics_are_in_the_units_of_the_file(path):
    rows = t2s.signals(path).statistics.set_index("column")
    assert rows.loc["r_degps", "mean"] == pytest.approx(0.5, abs=0.01)
    assert rows.loc["r_degps", "standard_deviation"] == pytest.approx(np.hypot(np.sqrt(2), 0.1), rel=0.01)
    assert rows.loc["r_degps", "peak_hz"] == pytest.approx(0.05, rel=0.1)
    assert rows.loc["delta_deg", "mean"] == pytest.approx(5.0) and rows.loc["r_degps", "unit"] == "deg/s"
    assert np.isnan(rows.loc["delta_deg", "correlation_time_s"])  # constant


def test_the_spectrum_has_the_variance_of_the_signal(path):
    found = t2s.signals(path, "r_degps")
    spectrum = found.spectrum("r_degps")
    area = np.trapezoid(spectrum["density"], spectrum["frequency_hz"])
    assert area == pytest.approx(2.01, rel=0.1)
    assert (spectrum["low"] < spectrum["density"]).all() and (spectrum["density"] < spectrum["high"]).all()
    with pytest.raises(LookupError, match="r_degps"):
        found.spectrum("u_mps")


def test_a_filter_removes_the_sine_and_the_trial_is_written_elsewhere(path, tmp_path):
    found = t2s.read_trial(path).signals(["r_degps"], filter="lowpass:0.01")
    assert found.filtered is not None
    after = found.filtered.df["r_degps"][400:1600]
    assert after.mean() == pytest.approx(0.5, abs=0.02) and after.std() < 0.1
    found.filtered.to_csv(tmp_path / "filtered.csv")
    again = t2s.read_trial(tmp_path / "filtered.csv").df
    assert np.allclose(again["r_degps"], found.filtered.df["r_degps"], equal_nan=True)
    with pytest.raises(t2s.InputError) as refusal:
        found.filtered.to_csv(path)
    assert refusal.value.source == str(path) and refusal.value.remedy
    assert t2s.signals(path).filtered is None


@pytest.mark.parametrize(
    ("options", "source"),
    [
        ({"columns": ["phi_deg"]}, "sine.csv"),
        ({"filter": "lowpass:0.1"}, "filter"),
        ({"columns": ["r"], "filter": "nothing:1"}, "filter"),
        ({"columns": ["r"], "filter": "decimate:2"}, "columns"),
    ],
)
def test_bad_input_is_refused_with_place_and_remedy(path, options, source):
    with pytest.raises(t2s.InputError) as refusal:
        t2s.signals(path, **options)
    assert refusal.value.source.endswith(source) and refusal.value.problem and refusal.value.remedy
