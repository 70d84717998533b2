"""Sections and charts of the result of signals hold the numbers of its study."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tank2sim.apps.signals.result import SignalsResult
from tank2sim.apps.signals.study import SignalSettings, SignalsStudy, analyse, filtered
from tank2sim.records.signals.filtering import savitzky_golay
from tank2sim.records.signals.sampling import even_series
from tests.records.signals.made import first_order, nomoto, trial


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
