from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tank2sim.answer.charts.picture import chart_specification
from tank2sim.api.signals import FilteredSignal, SignalsResult
from tank2sim.records.signals.analysis import SignalSettings, analyse
from tank2sim.records.signals.filtering import savitzky_golay
from tank2sim.records.signals.requests import parse_filter
from tank2sim.records.signals.sampling import even_series
from tank2sim.report.signals.page import signals_charts, signals_page, trial_labels
from tests.records.signals.made import first_order, nomoto, trial


@pytest.fixture(scope="module")
def measured():
    rudder = np.repeat(0.2 * first_order(2, 1.0, 200), 10)
    return trial(0.1 * np.arange(2000), delta_rad=rudder, r_radps=nomoto(rudder, 0.1, 0.08, 3.0), n_radps=np.ones(2000))


def test_the_page_has_the_tests_and_every_chart(measured):
    analyses = [analyse(measured, SignalSettings())]
    before = even_series(measured, "r_radps")
    filtered = savitzky_golay(before, 11, 3)
    applied = FilteredSignal(parse_filter("savgol:11,3"), before, filtered, filtered.effect.sentence, measured)
    found = SignalsResult(analyses, applied).to_dict()
    charts = signals_charts(found)
    assert set(charts) == {
        *(("made", f"{name}_{kind}") for name in ("delta", "r") for kind in ("density", "autocorrelation", "spectrum")),
        ("made", "histories"),
        ("made", "cross_correlation"),
        ("made", "transfer"),
        ("filter", "response"),
        ("filter", "signal"),
    }
    page = signals_page(found)
    drawn = [illustration.chart for section in page.sections for illustration in section.charts]
    assert [chart_specification(chart) for chart in drawn] == list(map(chart_specification, charts.values()))
    tables = {table.caption: table for section in page.sections for table in section.tables}
    constant = [row for row in tables["Signals"].rows if row[0] == "propeller speed"]
    assert constant[0][-1] == "constant"
    assert [row[0] for row in tables["Tests"].rows] == ["rudder angle", "yaw rate"]
    assert "no phase shift" in page.sections[0].text
    captions = {illustration.caption for section in page.sections for illustration in section.charts}
    assert any("95 % confidence interval" in caption for caption in captions)


def test_files_of_one_name_get_names_of_their_own(measured):
    found = SignalsResult([analyse(measured, SignalSettings(columns=["r"]))] * 2).to_dict()
    assert trial_labels(found["trials"]) == ["made_1", "made_2"]
    assert len(signals_charts(found)) == 8
    assert sum(len(section.charts) for section in signals_page(found).sections) == 8


def test_a_trial_whose_name_begins_as_another_keeps_its_own_charts(measured):
    analyses = [
        analyse(replace(measured, path=Path(name)), SignalSettings(columns=["r"])) for name in ("a.csv", "a_b.csv")
    ]
    page = signals_page(SignalsResult(analyses).to_dict())
    assert [len(section.charts) for section in page.sections] == [1, 1, 3, 3]
