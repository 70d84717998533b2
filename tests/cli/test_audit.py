"""``tank2sim audit``: findings on the screen and as JSON, one line for bad input."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

from tank2sim.api.audit import audit
from tank2sim.cli.derived import command_of
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
