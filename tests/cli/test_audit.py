"""``tank2sim audit``: findings on the screen and as JSON, one line for bad input."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

from tank2sim.api.audit import audit
from tank2sim.cli.derived import command_of
from tank2sim.errors import InputError
from tests.records.motions import motion, trial

COMMAND = command_of(audit.verb)


def run(*arguments):
    result = CliRunner().invoke(COMMAND, [str(argument) for argument in arguments])
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result


@pytest.fixture
def write(tmp_path):
    def write_csv(name, change=lambda signals: {}):
        signals = motion(duration=300.0)
        record = trial({**signals, **change(signals)})
        table = [record.time_s, *record.signals.values()]
        heads = ["t_s", *record.signals]
        path = tmp_path / name
        np.savetxt(path, np.column_stack(table), delimiter=",", header=",".join(heads), comments="", fmt="%.8g")
        return path

    return write_csv


def test_findings_stand_on_the_screen_and_in_the_json(write, tmp_path):
    good = write("good.csv")
    bad = write("bad.csv", lambda signals: {"delta_rad": -signals["delta_rad"]})
    result = tmp_path / "result.json"
    shown = run(good, bad, "--json", result)
    assert shown.exit_code == 0
    assert "1 fault found" in shown.output
    assert "delta_rad" in shown.output
    found = json.loads(result.read_text())
    (entry,) = found["findings"]
    assert (entry["file"], entry["column"]) == (str(bad), "delta_rad")
    assert "positive to port" in entry["likely_truth"]
    assert entry["what"]
    first = found["trials"][0]
    assert (first["duration_s"], first["step_s"], first["rows"]) == pytest.approx((300.0, 0.1, 3001))
    assert first["noise"]["u_mps"]["sigma"] == pytest.approx(0.02, rel=0.1)
    assert first["noise"]["u_mps"]["stated"] is False


def test_a_time_that_falls_is_a_finding_and_no_bad_input(write):
    path = write("bad.csv")
    lines = path.read_text().splitlines()
    path.write_text("\n".join([*lines[:100], lines[99], *lines[100:]]) + "\n")
    shown = run(path)
    assert shown.exit_code == 0
    assert "repeated" in " ".join(shown.output.split())


def test_the_json_has_the_record_to_draw_with_its_peaks_and_the_places_of_findings(write, tmp_path):
    path = write("bad.csv")
    lines = path.read_text().splitlines()
    header = next(place for place, text in enumerate(lines) if text.startswith("t_s"))
    column = lines[header].split(",").index("u_mps")
    cells = lines[header + 1001].split(",")
    cells[column] = "50.0"
    lines[header + 1001] = ",".join(cells)
    path.write_text("\n".join(lines[: header + 2001] + lines[header + 2051 :]) + "\n")
    result = tmp_path / "result.json"
    assert run(path, "--json", result).exit_code == 0
    found = json.loads(result.read_text())
    places = {entry["column"]: entry["places_s"] for entry in found["findings"] if entry["places_s"]}
    (spike,), (gap,) = places["u_mps"], places["t_s"]
    assert spike == pytest.approx([100.0, 100.0]) and gap == pytest.approx([199.9, 205.0])
    histories = found["trials"][0]["histories"]
    assert len(histories["t_s"]) <= 420
    assert histories["u_mps"][histories["t_s"].index(100.0)] == 50.0


def test_bad_input_is_refused_and_nothing_is_written(write, tmp_path):
    result = tmp_path / "result.json"
    with pytest.raises(InputError, match="does not exist"):
        run(write("good.csv"), tmp_path / "none.csv", "--json", result)
    assert not result.exists()
    bad = tmp_path / "bad.csv"
    bad.write_text("t_s,delta_deg,u_mps\n0,0,x\n1,0,1\n")
    with pytest.raises(InputError, match="line 2, column u_mps: 'x' is not a number"):
        run(bad)


@pytest.mark.slow
def test_a_page_and_pictures_are_written(write, tmp_path):
    path = write("good.csv")
    assert run(path, "--page", tmp_path / "audit.html", "--plot", tmp_path / "plots").exit_code == 0
    assert (tmp_path / "audit.html").read_text().startswith("<!doctype html>")
    assert {file.name for file in (tmp_path / "plots").iterdir()} == {
        "record_good_csv.png",
        "record_good_csv_2.png",
        "report.html",
    }
    before = path.read_bytes()
    with pytest.raises(InputError) as refusal:
        run(path, "--page", path)
    assert refusal.value.source == str(path)
    assert path.read_bytes() == before
