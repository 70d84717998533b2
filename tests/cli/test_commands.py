"""Commands as a user gives them: exit codes, one line of error, files whole or not at all."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.cli.command_line import refused, tank2sim

VEHICLE = "wilinski-zellman"


def test_simulate_writes_what_is_asked(tmp_path) -> None:
    result = tank2sim(
        *("simulate", "Mariner", "--manoeuvre", "zigzag:20/20", "-o", "run.csv", "--plot", "run.png"),
        *("--json", "run.json"),
        cwd=tmp_path,
    )
    assert result.returncode == 0, result.stderr
    figures = json.loads((tmp_path / "run.json").read_text())["figures"]
    assert len(figures["overshoots_deg"]) == 4
    assert (tmp_path / "run.png").read_bytes().startswith(b"\x89PNG")
    again = tank2sim("simulate", "mariner", "--manoeuvre", "file:run.csv", cwd=tmp_path)
    refused(again, "run.csv", "not an order")  # a trial has more than orders, and says which column


@pytest.mark.slow
def test_set_changes_a_value_in_the_cards_conventions(tmp_path) -> None:
    setting = "model.yaw_rate_terms=hydrodynamic"
    result = tank2sim("stability", "mariner", "--set", setting, "--json", "s.json", cwd=tmp_path)
    assert json.loads((tmp_path / "s.json").read_text())["stability_criterion"]["stable"] is False, result.stderr


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["simulate", "mariner"], ["--manoeuvre"]),
        (["simulate", "titanic", "--manoeuvre", "turn:35"], ["titanic", "mariner"]),
        (["simulate", "mariner", "--manoeuvre", "turn:200"], ["turn:200"]),
        (["simulate", "mariner", "--manoeuvre", "turn:35", "--set", "Yv"], ["--set", "KEY=VALUE"]),
        (["simulate", "mariner", "--manoeuvre", "turn:35", "--set", "ship.length_m=-1"], ["ship.length_m"]),
        (["simulate", "mariner", "--manoeuvre", "turn:35", "--duration", "nan"], ["--duration"]),
        (["simulate", "wilinski-zellman", "--manoeuvre", "turn:35"], ["rudder"]),
        (["stability", "wilinski-zellman"], ["rudder"]),
        (["simulate", "mariner", "--manoeuvre", "file:none.csv"], ["none.csv"]),
        (["fly"], ["fly"]),
    ],
)
def test_bad_input_ends_in_one_line_and_exit_2(tmp_path, arguments, words) -> None:
    refused(tank2sim(*arguments, cwd=tmp_path), *words)
    assert not list(tmp_path.iterdir())


def test_if_one_file_cannot_be_written_none_is(tmp_path) -> None:
    arguments = ["simulate", "mariner", "--manoeuvre", "turn:35", "-o", "run.csv", "--json", "missing/run.json"]
    refused(tank2sim(*arguments, cwd=tmp_path), "missing/run.json", "cannot be written")
    assert not list(tmp_path.iterdir())


@pytest.mark.essential
@pytest.mark.slow
def test_export_and_check_agree_and_a_wrong_card_fails(tmp_path) -> None:
    assert tank2sim("export", "mariner", "-o", "m.fmu", "--fmi", "3", cwd=tmp_path).returncode == 0
    right = tank2sim("check", "m.fmu", "--json", "c.json", cwd=tmp_path)
    assert right.returncode == 0 and "passed" in right.stdout
    assert max(json.loads((tmp_path / "c.json").read_text())["max_error"].values()) < 1e-6
    text = (Path(__file__).parents[2] / "models/mariner/ship.toml").read_text()
    (tmp_path / "other.toml").write_text(text.replace("Nd = -139e-5", "Nd = 139e-5"))
    wrong = tank2sim("check", "m.fmu", "--card", "other.toml", cwd=tmp_path)
    assert wrong.returncode == 1 and "FAILED" in wrong.stdout and not wrong.stderr


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["export", "mariner"], ["-o"]),
        (["export", "mariner", "-o", "x.fmu", "--fmi", "1"], ["--fmi"]),
        (["export", "mariner", "-o", "x.fmu", "--platforms", "amiga"], ["--platforms", "amiga"]),
        pytest.param(
            ["export", VEHICLE, "-o", "missing/x.fmu"], ["missing/x.fmu", "cannot be written"], marks=pytest.mark.slow
        ),
        pytest.param(
            ["export", VEHICLE, "-o", "x.fmu", "--json", "missing/x.json"],
            ["missing/x.json", "cannot be written"],
            marks=pytest.mark.slow,
        ),
        (["check", "none.fmu"], ["none.fmu"]),
        (["tow", "none.csv"], ["none.csv"]),
        (["demo", "-o", "/proc/demo"], ["/proc/demo"]),
    ],
)
def test_bad_input_to_fmu_commands_ends_in_one_line(tmp_path, arguments, words) -> None:
    refused(tank2sim(*arguments, cwd=tmp_path), *words)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("arguments", [["export", "mariner", "-o", "x.fmu"], ["demo", "-o", "demo"]])
def test_without_a_compiler_nothing_is_written(tmp_path, arguments) -> None:
    refused(tank2sim(*arguments, cwd=tmp_path, CC="no-such-compiler"), "compiler")
    assert not [path for path in tmp_path.rglob("*") if path.is_file()]


@pytest.mark.essential
@pytest.mark.slow
def test_tow_writes_a_card_that_exports(tmp_path) -> None:
    tows = str(Path(__file__).parents[2] / "models/wilinski-zellman/tows.csv")
    result = tank2sim("tow", tows, "--force-N", "11.63", "--mass-kg", "2243", "--json", "t.json", cwd=tmp_path)
    assert result.returncode == 0 and "condition" in result.stdout and "--terms B3" in result.stdout
    methods = json.loads((tmp_path / "t.json").read_text())["methods"]
    assert {"paper", "qr"} <= set(methods) and "condition" in methods["paper"]
    assert tank2sim("tow", tows, "--terms", "B3", "-o", "v.toml", cwd=tmp_path).returncode == 0
    assert tank2sim("export", "v.toml", "-o", "v.fmu", cwd=tmp_path).returncode == 0
    assert tank2sim("check", "v.fmu", cwd=tmp_path).returncode == 0
