"""Sections of a log's result hold the channels and stretches of its study."""

from __future__ import annotations

from pathlib import Path

import pytest

import tank2sim as t2s
from tank2sim.apps.logs.result import LogResult
from tests.apps.logs.made_logs import frame


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> LogResult:
    path = tmp_path_factory.mktemp("log") / "voyage.csv"
    frame().to_csv(path, index=False)
    return t2s.log(path)


def test_tables_and_charts_hold_channels_and_stretches(result) -> None:
    tables = {table.caption: table.df for table in result.tables}
    assert tables["Stretches"]["stretch"].to_list() == result.stretches["kind"].to_list()
    assert tables["Stretches"]["file"].dropna().to_list() == ["01_zigzag_+20.csv", "02_turn_+25.csv"]
    used = result.channels[result.channels["use"]]
    assert tables["Channels in use"]["stream"].to_list() == used["stream"].to_list()
    assert list(result.charts()) == ["map", "logged_signals"]
    assert "2 trials are cut out: zigzag +20, turn +25." in result.headline[1]


def test_a_result_read_from_its_json_has_no_trials_to_write(result) -> None:
    again = LogResult.read(result.to_dict(), "log.json")
    assert again.files("voyage") == {} and Path("voyage/channels.toml") in result.files("voyage")


def test_a_trial_of_several_stretches_of_a_craft_is_one(data, tmp_path) -> None:
    found = t2s.log(data / "data" / "logs" / "usv_22" / "voyage.csv")
    files = [path.name for path in found.save(tmp_path) if path.suffix == ".csv"]
    listed = [one.file for one in found.study.stretches if one.file]
    assert len(listed) > len(files) == len(set(listed)) and set(listed) == set(files)
    assert found.key_figures[0].value == len(files)
    assert found.charts()["map"].to_dict()
    for name in files:
        rows = [line for line in (tmp_path / name).read_text().splitlines() if not line.startswith("#")][1:]
        lasts = sum(one.duration_s for one in found.study.stretches if one.file == name)
        assert float(rows[-1].split(",")[0]) > lasts - 1.0
