"""``tank2sim log``: a folder of trials, a channels file which makes the next run unattended, and a result."""

from __future__ import annotations

import json
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import tank2sim as t2s
from tank2sim.apps.logs.channels import channels_text, read_channels
from tank2sim.apps.logs.result import LogResult
from tests.apps.logs.made_logs import T0, frame, nmea_lines
from tests.cli.command_line import refused, tank2sim
from tests.marks import first_fast


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    frame().to_csv(tmp_path / "voyage.csv", index=False)
    return tmp_path


def entries(path: Path) -> list[dict]:
    return tomllib.loads(path.read_text(encoding="utf-8"))["channels"]


def test_a_folder_of_trials_channels_and_json(folder) -> None:
    found = tank2sim("log", "voyage.csv", "-o", "voyage", "--json", "log.json", cwd=folder)
    assert found.returncode == 0, found.stderr
    assert {path.name for path in (folder / "voyage").iterdir()} == {
        "01_zigzag_+20.csv",
        "02_turn_+25.csv",
        "channels.toml",
    }
    result = json.loads((folder / "log.json").read_text(encoding="utf-8"))
    assert [stretch["kind"] for stretch in result["stretches"]] == ["steady", "zigzag", "steady", "turn", "steady"]
    assert result["begins_utc"] == "2023-11-14T22:13:20.000Z"


def test_the_page_names_all_trials_however_many(folder) -> None:
    tank2sim("log", "voyage.csv", "-o", "voyage", "--json", "log.json", cwd=folder)
    found = json.loads((folder / "log.json").read_text(encoding="utf-8"))
    zigzag = next(stretch for stretch in found["stretches"] if stretch["kind"] == "zigzag")
    files = [f"{place:02d}_zigzag_{5 + place:+d}.csv" for place in range(19)]
    found["stretches"] = [{**zigzag, "file": name} for name in files]
    result = LogResult.read(found, "log.json")
    assert all(f"{5 + place:+d}" in " ".join(result.headline) for place in range(19))
    chart = next(section for section in result.sections if section.heading == "Map").charts[0]
    assert "8 of 19" in chart.caption


def test_trials_go_on_to_audit_and_signals(folder) -> None:
    tank2sim("log", "voyage.csv", "-o", "voyage", cwd=folder)
    for command in ("audit", "signals"):
        found = tank2sim(command, "voyage/02_turn_+25.csv", cwd=folder)
        assert found.returncode == 0, found.stderr


@pytest.mark.essential
@pytest.mark.slow
def test_trials_go_on_to_identify_and_gap(data, tmp_path) -> None:
    source = data / "data" / "logs" / "ship_21" / "voyage.csv"
    if not source.is_file():
        pytest.skip(f"made-up logs are missing: no {source}")
    assert tank2sim("log", str(source), "-o", "voyage", cwd=tmp_path).returncode == 0
    zigzag, turn = (next((tmp_path / "voyage").glob(f"*{name}*")) for name in ("zigzag", "turn_-35"))
    arguments = ["mariner", str(zigzag), "--holdout", str(turn), "--method", "equation_error", "--members", "0"]
    found = tank2sim("identify", *arguments, "-o", "card.toml", cwd=tmp_path)
    assert found.returncode == 0, found.stderr
    options = ["--effects", "current", "--max-effects", "1", "--workers", "1"]
    found = tank2sim("gap", "mariner", str(turn), "-o", "gap", *options, cwd=tmp_path)
    assert found.returncode == 0, found.stderr


def test_the_channels_file_of_the_folder_is_taken_as_it_is(folder) -> None:
    tank2sim("log", "voyage.csv", "-o", "voyage", cwd=folder)
    path = folder / "voyage" / "channels.toml"
    first = (folder / "voyage" / "02_turn_+25.csv").read_text(encoding="utf-8")
    again = tank2sim("log", "voyage.csv", "-o", "voyage", cwd=folder)
    assert again.returncode == 0 and (folder / "voyage" / "02_turn_+25.csv").read_text(encoding="utf-8") == first
    turned = 'stream = "rudder_deg"\nunit = "deg"\nsign = 1'
    changed = path.read_text(encoding="utf-8").replace(turned, turned.replace("sign = 1", "sign = -1"))
    path.write_text(changed, encoding="utf-8")
    found = tank2sim("log", "voyage.csv", "-o", "voyage", cwd=folder)
    assert found.returncode == 0 and (folder / "voyage" / "02_turn_-25.csv").is_file()
    assert "removed" in found.stdout and not (folder / "voyage" / "02_turn_+25.csv").exists()
    assert path.read_text(encoding="utf-8") == changed


def test_channels_say_what_content_cannot(folder) -> None:
    """Scale, offset and delay of a rudder recorded as pulses of a servo, 0.7 s late, to port."""
    table = frame()
    table["servo"] = (1500 - 400 * table.pop("rudder_deg") / 35).round(2)
    table.to_csv(folder / "voyage.csv", index=False)
    entries = [
        {"quantity": "rudder_angle", "stream": "servo", "unit": "deg", "sign": -1, "scale": 35 / 400, "offset": 1500},
        {"quantity": "heading", "stream": "heading_deg", "unit": "deg", "delay_s": 0.75},
        {"quantity": "yaw_rate", "stream": "rot_deg_min", "unit": "deg/min"},
    ]
    lines = ['format = "tank2sim-channels/1"']
    for entry in entries:
        lines += ["[[channels]]", *(f"{key} = {json.dumps(value)}" for key, value in entry.items())]
    (folder / "mine.toml").write_text("\n".join(lines), encoding="utf-8")
    result = t2s.log(folder / "voyage.csv", channels=folder / "mine.toml")
    rudder = result.voyage.series["rudder_angle"]
    assert np.allclose(np.degrees(rudder.values), frame().rudder_deg, atol=1e-3)
    assert result.voyage.series["heading"].time_s[0] == pytest.approx(T0 - 0.75, abs=1e-3)
    assert [stretch.kind.value for stretch in result.found if stretch.kind.excites] == ["zigzag", "turn"]


def test_a_channels_file_comes_back_as_it_was_written(folder) -> None:
    found = t2s.log(folder / "voyage.csv").voyage.channels
    (folder / "channels.toml").write_text(channels_text(found), encoding="utf-8")
    again = read_channels(folder / "channels.toml")
    keys = ("quantity", "stream", "unit", "sign", "scale", "offset", "delay_s", "use")
    assert [[getattr(channel, key) for key in keys] for channel in again.channels] == [
        [getattr(channel, key) for key in keys] for channel in found.channels
    ]


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("tank2sim-channels/1", "tank2sim-channels/9", "format"),
        ('quantity = "heading"', 'quantity = "headings"', "did you mean heading?"),
        ('unit = "deg/min"', 'unit = "knots"', "is not a unit of yaw_rate"),
        ("sign = 1", "sign = 3", "write 1 or -1"),
        ("sign = 1", "sing = 1", "did you mean sign?"),
        ('stream = "rudder_deg"', 'stream = "ruder"', "no stream is called ruder"),
        ('quantity = "cog"', 'quantity = "heading"', "is in use twice"),
        ("[[channels]]", "[[channels", "correct the TOML"),
    ],
)
def test_a_wrong_channels_file_is_refused_and_nothing_is_written(folder, old, new, problem) -> None:
    tank2sim("log", "voyage.csv", "-o", "voyage", cwd=folder)
    text = (folder / "voyage" / "channels.toml").read_text(encoding="utf-8")
    assert old in text
    (folder / "wrong.toml").write_text(text.replace(old, new, 1), encoding="utf-8")
    refused(tank2sim("log", "voyage.csv", "-o", "other", "--channels", "wrong.toml", cwd=folder), problem)
    assert not (folder / "other").exists()


def test_a_log_without_a_rudder_gives_its_channels_and_says_so_first(folder) -> None:
    table = frame().drop(columns="rudder_deg")
    table["battery_V"] = 12.6
    table.to_csv(folder / "voyage.csv", index=False)
    found = tank2sim("log", "voyage.csv", "-o", "voyage", cwd=folder)
    assert found.returncode == 0 and found.stdout.splitlines()[0].startswith("CHECK: no rudder")
    assert [path.name for path in (folder / "voyage").iterdir()] == ["channels.toml"]


def test_two_logs_of_one_voyage_are_joined(folder) -> None:
    pytest.importorskip("pynmea2")
    lines = [line for line in nmea_lines() if "RSA" not in line]
    (folder / "bridge.nmea").write_text("\n".join(lines) + "\n", encoding="ascii")
    frame()[["utc", "rudder_deg"]].to_csv(folder / "rudder.csv", index=False)
    found = tank2sim("log", "bridge.nmea", "rudder.csv", "-o", "voyage", cwd=folder)
    assert found.returncode == 0, found.stderr
    streams = {entry["quantity"]: entry["stream"] for entry in entries(folder / "voyage" / "channels.toml")}
    assert (streams["rudder_angle"], streams["heading"]) == ("rudder: rudder_deg", "bridge: HDT.heading")
    assert len(list((folder / "voyage").glob("*turn*"))) == 1


def test_bad_input_is_refused_in_one_line(folder) -> None:
    refused(tank2sim("log", "none.csv", "-o", "voyage", cwd=folder), "none.csv", "does not exist")
    (folder / "empty.nmea").write_bytes(b"")
    refused(tank2sim("log", "empty.nmea", "-o", "voyage", cwd=folder), "is empty")
    refused(tank2sim("log", "voyage.csv", cwd=folder), "--output")
    assert not (folder / "voyage").exists()


@first_fast("ahead_s", [7.5, -20.0])
def test_clocks_of_two_logs_that_differ_are_marked(folder, ahead_s) -> None:
    pytest.importorskip("pynmea2")
    (folder / "bridge.nmea").write_text("\n".join(nmea_lines()) + "\n", encoding="ascii")
    table = frame()[["utc", "heading_deg", "rudder_deg"]]
    moments = pd.to_datetime(table["utc"]) + pd.Timedelta(seconds=ahead_s)
    table = table.assign(utc=moments.dt.strftime("%Y-%m-%dT%H:%M:%S.%fZ"))
    table.to_csv(folder / "second.csv", index=False)
    result = t2s.log([folder / "bridge.nmea", folder / "second.csv"])
    (found,) = [finding for finding in result.voyage.findings if "the clock of second" in finding.text]
    assert found.kind == "fault" and found.evidence["shift_s"] == pytest.approx(ahead_s, abs=0.6)
    table = table.assign(utc=frame()["utc"])
    table.to_csv(folder / "second.csv", index=False)
    assert not any("clock" in mark for mark in t2s.log([folder / "bridge.nmea", folder / "second.csv"]).cautions)


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


def test_without_a_stretch_there_is_no_empty_table(result) -> None:
    none = replace(result, study=replace(result.study, stretches=()))
    assert all(table.rows for section in none.sections for table in section.tables)
    assert "Stretches" not in [section.heading for section in none.sections]
