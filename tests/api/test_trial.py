"""Trials read, and their audit, through the public API."""

from __future__ import annotations

import json

import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.api.trial import fitted_and_held, trial_files
from tests.records.motions import motion, trial


@pytest.fixture
def write(tmp_path):
    def write_csv(name, *, rudder_sign=1.0):
        """A zigzag of 20 deg of rudder as a trial file in degrees, with its first noise stated."""
        signals = motion(duration=300.0)
        record = trial({**signals, "delta_rad": rudder_sign * signals["delta_rad"]})
        columns = {
            "t_s": record.time_s,
            **{
                name.replace("radps", "degps").replace("_rad", "_deg"): np.rad2deg(values) if "rad" in name else values
                for name, values in record.signals.items()
            },
        }
        lines = [",".join(f"{value:.8g}" for value in row) for row in zip(*columns.values(), strict=True)]
        path = tmp_path / name
        path.write_text("\n".join(["# noise: r_degps 0.03", ",".join(columns), *lines]) + "\n")
        return path

    return write_csv


def test_a_trial_is_a_data_frame_in_degrees(write):
    path = write("zigzag.csv")
    record = t2s.read_trial(path)
    assert record.name == "zigzag" and record.path == path
    assert list(record.df.columns) == ["t_s", "delta_deg", "u_mps", "v_mps", "r_degps", "psi_deg", "x_m", "y_m"]
    assert record.df["delta_deg"].max() == pytest.approx(20.0)
    assert record.df["t_s"].iloc[-1] == pytest.approx(300.0)
    heading = np.rad2deg(motion(duration=300.0)["psi_rad"])
    assert np.abs(record.df["psi_deg"] - heading).max() < 1.0  # noise of 0.1 deg
    assert record.noise == {"r_degps": pytest.approx(0.03)}
    assert record.notices == ()


def test_a_time_that_falls_is_refused_with_its_row(write):
    path = write("bad.csv")
    lines = path.read_text().splitlines()
    path.write_text("\n".join([*lines[:100], lines[99], *lines[100:]]) + "\n")
    with pytest.raises(t2s.InputError) as refusal:
        t2s.read_trial(path)
    assert "row" in refusal.value.place and refusal.value.remedy
    assert not t2s.audit(path).passed  # where it is a finding


def test_the_audit_finds_a_rudder_to_port_and_agrees_with_the_json(write):
    bad = write("bad.csv", rudder_sign=-1.0)
    found = t2s.audit([write("good.csv"), bad])
    (finding,) = found.findings.to_dict("records")
    assert (finding["file"], finding["column"], finding["kind"]) == (str(bad), "delta_deg", "fault")
    assert not found.passed and t2s.read_trial(bad.with_name("good.csv")).audit().passed
    content = json.loads(found.to_json())
    assert content["schema"] == "tank2sim/audit/1"
    assert [entry["what"] for entry in content["findings"]] == [finding["what"]]
    first = content["trials"][0]
    assert (first["duration_s"], first["step_s"], first["rows"]) == pytest.approx((300.0, 0.1, 3001))
    noise = found.noise.set_index(["file", "column"])
    assert noise.loc[(str(bad), "r_degps"), "sigma"] == pytest.approx(0.03)
    assert noise.loc[(str(bad), "r_degps"), "stated"] and not noise.loc[(str(bad), "psi_deg"), "stated"]
    assert noise.loc[(str(bad), "psi_deg"), "sigma"] == pytest.approx(0.1, rel=0.1)  # what was added


def test_the_json_has_the_record_to_draw_with_its_peaks_and_the_places_of_findings(write):
    path = write("bad.csv")
    lines = path.read_text().splitlines()
    header = next(place for place, text in enumerate(lines) if text.startswith("t_s"))
    cells = lines[header + 1001].split(",")
    cells[lines[header].split(",").index("u_mps")] = "50.0"
    lines[header + 1001] = ",".join(cells)
    path.write_text("\n".join(lines[: header + 2001] + lines[header + 2051 :]) + "\n")
    found = json.loads(t2s.audit(path).to_json())
    places = {entry["column"]: entry["places_s"] for entry in found["findings"] if entry["places_s"]}
    (spike,), (gap,) = places["u_mps"], places["t_s"]
    assert spike == pytest.approx([100.0, 100.0]) and gap == pytest.approx([199.9, 205.0])
    histories = found["trials"][0]["histories"]
    assert len(histories["t_s"]) <= 420
    assert histories["u_mps"][histories["t_s"].index(100.0)] == 50.0


def test_a_folder_is_for_its_trials(write, tmp_path):
    write("b.csv"), write("a.csv")
    (tmp_path / "notes.csv").write_text("word\nnothing\n")
    found = t2s.audit(tmp_path)
    assert [record.name for record in found.trials] == ["a", "b"]
    assert len(found.findings) == 0 and found.passed


def test_a_missing_file_is_refused(tmp_path):
    for call in (t2s.read_trial, t2s.audit):
        with pytest.raises(t2s.InputError) as refusal:
            call(tmp_path / "none.csv")
        assert refusal.value.source.endswith("none.csv") and refusal.value.problem


@pytest.mark.slow
def test_trials_to_fit_may_be_files_folders_or_records(write, tmp_path, mariner_card):
    path = write("zigzag.csv")
    by_file, _ = fitted_and_held(path, (), mariner_card)
    for given in (tmp_path, t2s.read_trial(path), [t2s.read_trial(path)]):
        fitted, held = fitted_and_held(given, (), mariner_card)
        assert [trial.name for trial in fitted.trials] == ["zigzag"] and held.trials == ()
        assert np.array_equal(fitted.trials[0].signals["r_radps"], by_file.trials[0].signals["r_radps"])
    assert trial_files([t2s.read_trial(path), path]) == [path, path]
    with pytest.raises(t2s.InputError) as refusal:
        fitted_and_held(path, t2s.read_trial(path), mariner_card)  # one record cannot judge itself
    assert refusal.value.source == str(path)


@pytest.mark.parametrize("task", [t2s.find_gap, t2s.identify])
def test_a_task_on_no_trials_is_refused(task) -> None:
    with pytest.raises(t2s.InputError) as refusal:
        task("mariner", [])
    assert refusal.value.source == "trials"
