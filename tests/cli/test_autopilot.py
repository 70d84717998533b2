"""``tank2sim autopilot`` as a user calls it."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path

import pytest

from .command_line import refused, tank2sim


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A PID for the Mariner with a track, an FMU and a page."""
    folder = tmp_path_factory.mktemp("autopilot")
    (folder / "track.csv").write_text("x_m,y_m\n0,0\n3000,0\n5000,2000\n")
    files = ["--track", "track.csv", "--export", "ap.fmu", "-o", "page.html", "--json", "ap.json"]
    # Towards 3.9 m/s the polynomial of this card loses its rudder.
    speeds = ["--set", "model.valid_speed_mps=[3.9, 9.3]"]
    ended = tank2sim("autopilot", "mariner", *speeds, *files, cwd=folder)
    assert ended.returncode == 0, ended.stderr
    assert "Margins" in ended.stdout and "Cross-track" in ended.stdout and "ap.fmu: FMI 2" in ended.stdout
    return folder


@pytest.mark.slow
def test_the_json_has_gains_margins_and_the_closed_loop(result: Path) -> None:
    reported = json.loads((result / "ap.json").read_text())
    assert reported["gains"]["Kp"] == pytest.approx(1.18)
    design, *others = reported["margins"]
    assert design["phase_margin_deg"] == pytest.approx(96.5, abs=0.5)
    assert design["gain_margin_dB"] is None and design["stable"] is True
    assert len(others) == 4 and design["speed_mps"] == pytest.approx(7.718, abs=1e-3)
    changes = reported["closed_loop"]["course_changes"]
    assert changes["large"]["overshoot_deg"] < changes["large without anti-windup"]["overshoot_deg"]
    assert reported["closed_loop"]["largest_steps"]["within_rate_deg"] == pytest.approx(5.0 / 1.18, rel=0.01)
    assert set(reported["track"]) == {"line of sight", "with integral"}
    assert reported["weather"]["wind_from_deg"] == 45.0
    assert any("3.9 m/s" in notice["text"] for notice in reported["notices"])


@pytest.mark.slow
def test_what_is_wrong_is_reported_in_one_line_and_nothing_is_written(tmp_path: Path) -> None:
    (tmp_path / "track.csv").write_text("x_m,y_m\n0,0\n0,0\n")
    (tmp_path / "short.csv").write_text("x_m,y_m\n0,0\n2,0\n0,9000\n")
    wrong = {
        ("wilinski-zellman",): "has no rudder",
        ("mariner", "--speed", "30"): "outside the range",
        ("mariner", "--track", "track.csv"): "same place",
        ("mariner", "--track", "none.csv"): "does not exist",
        ("mariner", "--track", "short.csv"): "short.csv: leg 1: is 2 m",
        ("mariner", "--course-change", "0"): "is 0",
        ("mariner", "--verify"): "needs --export",
        ("mariner", "--design", "fuzzy"): "fuzzy",
        ("nothing",): "nothing",
        ("mariner", "--set", "derivatives.Nd=139e-5", "--set", "derivatives.Yd=-278e-5"): "wrong way",
    }
    for arguments, words in wrong.items():
        refused(tank2sim("autopilot", *arguments, "--json", "x.json", cwd=tmp_path), words)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["short.csv", "track.csv"]


@pytest.mark.skipif(importlib.util.find_spec("slycot") is not None, reason="slycot is installed")
def test_the_robust_design_says_what_to_install(tmp_path: Path) -> None:
    refused(tank2sim("autopilot", "mariner", "--design", "robust", cwd=tmp_path), "pip install 'tank2sim[robust]'")


@pytest.mark.slow
def test_a_tanker_that_is_unstable_is_steered_and_verified_together_with_her_fmu(tmp_path: Path) -> None:
    more = ["--export", "ap.fmu", "--fmi", "3", "--verify", "--json", "ap.json", "--wave-yaw", "0.1", "--seed", "5"]
    ended = tank2sim("autopilot", "kvlcc2-captive", "--design", "lqr", *more, cwd=tmp_path)
    assert ended.returncode == 0, ended.stderr
    reported = json.loads((tmp_path / "ap.json").read_text())
    assert reported["export"]["co_simulation"]["order"] == pytest.approx(1.0, abs=0.1)
    assert reported["margins"][0]["gain_margin_down"] > 0.05
    assert reported["weather"]["seed"] == 5 and reported["weather"]["wave_yaw_deg"] == pytest.approx(0.1)
