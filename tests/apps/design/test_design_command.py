"""``tank2sim design`` as a user gives it."""

import csv
import json
import re

import pytest

from tests.cli.command_line import refused, tank2sim

FAST = ("--figures", "steady_radius_m@20", "--members", "0")


@pytest.mark.slow
def test_a_campaign_is_written_as_plan_template_and_json(tmp_path):
    result = tank2sim(
        *("design", "esso-osaka", *FAST, "--hours", "4", "--largest", "12/25/0.6"),
        *("-o", "plan.csv", "--campaign", "campaign.toml", "--json", "d.json", "--page", "d.html"),
        cwd=tmp_path,
    )
    assert result.returncode == 0, result.stderr
    found = json.loads((tmp_path / "d.json").read_text(encoding="utf-8"))
    rows = list(csv.DictReader((tmp_path / "plan.csv").open(encoding="utf-8")))
    assert len(rows) == len(found["runs"]) and found["hours_used"] <= 4
    assert [float(row["drift_deg"]) for row in rows] == [run["drift_deg"] for run in found["runs"]]
    assert result.stdout.startswith("CHECK: the hours, 4 h")
    assert "\nCHECK: ASSUMED standard errors of the gauges" in result.stdout
    reach = {"drift_deg": 12.0, "rudder_deg": 25.0, "yaw_rate_prime": 0.6}
    assert {key: found["model"][key] for key in reach} == pytest.approx(reach)
    assert max(abs(run["drift_deg"]) for run in found["runs"]) <= 12.0 + 1e-6
    sway = next(kind for kind in found["kinds"] if kind["type"] == "pure sway")
    assert sway["drift"] is None and sway["rudder"] is None
    assert not re.search(r"<td[^>]*>\s*</td>", (tmp_path / "d.html").read_text(encoding="utf-8"))
    missing = tank2sim("reduce", "campaign.toml", cwd=tmp_path)
    refused(missing, "run_001.csv")


@pytest.mark.essential
@pytest.mark.slow
def test_a_trial_is_written_with_its_orders(tmp_path):
    result = tank2sim(
        *("design", "mariner", "--figures", "steady_radius_m@20", "--trial", "--minutes", "8"),
        *("--sensors", "r_degps=0.02", "psi_deg=0.2", "u_mps=0.02", "-o", "trial.csv", "--orders", "orders"),
        *("--json", "d.json"),
        cwd=tmp_path,
    )
    assert result.returncode == 0, result.stderr
    found = json.loads((tmp_path / "d.json").read_text(encoding="utf-8"))
    assert {row["orders"] for row in found["manoeuvres"]} == {path.name for path in (tmp_path / "orders").iterdir()}
    assert found["sensors"] == {"r_degps": 0.02, "psi_deg": 0.2, "u_mps": 0.02} and found["minutes_used"] <= 8


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--hours", "0"), ("--hours",)),
        (("--trial", "--hours", "3"), ("--hours", "--trial")),
        (("--minutes", "3"), ("--minutes", "--trial")),
        (("--trial", "--sensors", "r_degps=x"), ("--sensors", "r_degps=x")),
        (("--tank", "none.toml"), ("none.toml",)),
        (("--largest", "12/35"), ("--largest", "12/35")),
        (("--largest", "12/35/nan"), ("--largest",)),
        (("--carriage-length", "nan"), ("--carriage-length",)),
    ],
)
def test_bad_options_are_refused_in_a_line(tmp_path, arguments, words):
    fast = FAST[:2] if "--trial" in arguments else FAST
    result = tank2sim("design", "esso-osaka", *fast, *arguments, "-o", "plan.csv", cwd=tmp_path)
    refused(result, *words)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("option", ["--campaign", "--json"])
def test_one_file_for_two_outputs_is_refused_before_the_work(tmp_path, option, monkeypatch):
    monkeypatch.setattr("tank2sim.apps.design.planning.planned_campaign", None)
    result = tank2sim("design", "esso-osaka", *FAST, "--hours", "2", "-o", "p", option, "p", cwd=tmp_path)
    refused(result, "p:", "two outputs")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_a_plan_in_the_place_of_orders_is_refused(tmp_path):
    (tmp_path / "orders").mkdir()
    trial = ("--figures", "steady_radius_m@20", "--trial", "--minutes", "8", "--orders", "orders")
    result = tank2sim("design", "mariner", *trial, "-o", "orders/orders_01.csv", cwd=tmp_path)
    refused(result, "orders_01.csv", "two outputs")
    assert list((tmp_path / "orders").iterdir()) == []


@pytest.mark.parametrize(
    ("sensors", "words"),
    [
        (("psi_deg=0.0000000001",), ("psi_deg", "0.0002 to 200")),
        (("x_m=1e9",), ("x_m", "0.001 to 1e+03")),
        (("r_degps=0.02", "r_degps=0.03"), ("r_degps", "once")),
    ],
)
def test_sensors_that_are_none_or_given_twice_are_refused(tmp_path, sensors, words):
    result = tank2sim("design", "esso-osaka", *FAST[:2], "--trial", "--sensors", *sensors, cwd=tmp_path)
    refused(result, "--sensors", *words)
