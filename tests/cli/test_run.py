"""``tank2sim run``: files written whole, one line for a fault."""

import csv
import json

import pytest

from tests.cli.command_line import refused, tank2sim
from tests.identification.captive.generator import Campaign, write
from tests.identification.captive.made_runs import oscillation


def test_a_run_gives_coefficients_cycle_page_and_json(tmp_path):
    file = oscillation(tmp_path)
    out = {name: tmp_path / name for name in ("h.csv", "c.csv", "p.html", "r.json")}
    done = tank2sim(
        "run", file.name, "--type", "pure_yaw", "-o", "h.csv", "--cycle", "c.csv", "--page", "p.html", "--json",
        "r.json", cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader(out["h.csv"].open()))
    (first,) = [row for row in rows if (row["signal"], row["order"]) == ("Y", "1")]
    assert float(first["cos"]) == pytest.approx(25.0, abs=0.1) and float(first["sin"]) == pytest.approx(-7.0, abs=0.1)
    assert 0 < float(first["cos_error"]) < 0.05
    assert len(list(csv.DictReader(out["c.csv"].open()))) == 72
    assert json.loads(out["r.json"].read_text())["runs"][0]["periods"] == 4
    assert "Averaged cycle" in out["p.html"].read_text() and "Fourier coefficients" in out["p.html"].read_text()


def test_reduce_writes_the_uncertainty_budget(tmp_path):
    made = write(Campaign(seed=3, size="linear", rate_hz=5.0), tmp_path / "made")
    done = tank2sim("reduce", str(made.path), "--budget", "budget.csv", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    rows = {row["name"]: row for row in csv.DictReader((tmp_path / "budget.csv").open())}
    assert {"Yv", "Yvdot", "Nrdot"} <= rows.keys()
    for row in rows.values():
        shares = [float(value) for key, value in row.items() if key not in ("name", "value", "combined", "expanded")]
        assert sum(shares) == pytest.approx(1.0, abs=1e-4)
        assert float(row["expanded"]) == pytest.approx(2 * float(row["combined"]), rel=1e-4)


def test_a_steady_run_has_no_cycle_and_nothing_is_written(tmp_path):
    file = oscillation(tmp_path)
    refused(tank2sim("run", file.name, "--type", "straight", "-o", "h.csv", "--cycle", "c.csv", cwd=tmp_path), "cycle")
    assert not (tmp_path / "h.csv").exists()
