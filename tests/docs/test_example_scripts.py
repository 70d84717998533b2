"""Every tutorial also is a short script that runs, and the made-up trials have the truth that they claim."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import tank2sim as t2s

from .examples import MANUAL

SCRIPTS = MANUAL / "examples"
WRITTEN = {
    "autopilot": ["stability.html", "ap.html", "ap.fmu", "tuned.toml"],
    "bridge": ["poster.html", "pilot.html", "steer.html", "zigzag.html", "report.html", "compare.html"],
    "glider_and_yaw_rig": ["glide.html", "glider.fmu", "ship.toml"],
    "sea_trials": ["report/report.html", "report/report.pdf", "report/form.html", "report/full-load.toml"],
    "simulator": ["mariner.fmu", "ship.fmu", "mariner.ssp"],
    "towing_tank": ["vehicle.fmu", "model.toml", "model.covariance.json", "from_tank.toml"],
    "trials": ["found.toml", "identified.html", "gap/improved.toml"],
}


def make_trials(truth: str, folder: Path) -> None:
    subprocess.run([sys.executable, SCRIPTS / "make_trials.py", folder, truth], check=True, timeout=120)


def test_every_tutorial_has_a_script_of_less_than_60_lines() -> None:
    assert {page.stem for page in (MANUAL / "tutorials").glob("*.md")} == set(WRITTEN)
    for name in WRITTEN:
        assert len((SCRIPTS / f"{name}.py").read_text(encoding="utf-8").splitlines()) < 60


@pytest.mark.long
@pytest.mark.parametrize("name", WRITTEN)
def test_the_script_runs_and_writes(name: str, tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, SCRIPTS / f"{name}.py"], cwd=tmp_path, capture_output=True, text=True, check=False, timeout=280
    )
    assert done.returncode == 0, done.stderr
    assert [file for file in WRITTEN[name] if not (tmp_path / file).is_file()] == []


@pytest.mark.slow
def test_identification_finds_the_truth_of_the_made_up_trials(tmp_path: Path) -> None:
    make_trials("damping", tmp_path)
    fit = t2s.identify("mariner", [tmp_path / "zigzag.csv", tmp_path / "turn.csv"], hold=["Xuuu"], members=0)
    found = fit.ship.derivatives.loc["Nr"]
    assert abs(found["value"] - -174e-5) < 3 * found["standard_error"] < 5e-5


@pytest.mark.slow
def test_the_made_up_trials_differ_by_a_current_of_half_a_metre_a_second_to_the_east(tmp_path: Path) -> None:
    make_trials("current", tmp_path)
    head, *rows = (tmp_path / "turn.csv").read_text(encoding="utf-8").splitlines()
    columns = dict(zip(head.split(","), zip(*(map(float, row.split(",")) for row in rows), strict=True), strict=True))
    orders = {key: columns[key] for key in ("t_s", "delta_order_deg")}
    still = t2s.load("mariner").steer(orders, duration_s=columns["t_s"][-1]).df
    assert columns["y_m"][-1] - still.y_m.iloc[-1] == pytest.approx(0.5 * columns["t_s"][-1], abs=2.0)
    assert columns["x_m"][-1] - still.x_m.iloc[-1] == pytest.approx(0.0, abs=2.0)
