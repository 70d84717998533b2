"""Commands as a user gives them: exit codes, one line of error, files whole or not at all, bands and sheets."""

from __future__ import annotations

import importlib.util
import json
import math
from pathlib import Path

import numpy as np
import pytest

from tank2sim.cards import read_card
from tank2sim.cards.covariance_reading import read_covariance
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


TURN = ("simulate", "mariner", "--manoeuvre", "turn:20", "--duration", "300")


def test_bands_of_a_manoeuvre_are_the_same_for_the_same_seed(tmp_path) -> None:
    found = []
    for seed in ("1", "1", "2"):
        result = tank2sim(*TURN, "--members", "20", "--seed", seed, "--json", "s.json", cwd=tmp_path)
        assert result.returncode == 0, result.stderr
        assert "Ensemble of 20" in result.stdout and "2 % of the value is taken" in " ".join(result.stdout.split())
        found.append(json.loads((tmp_path / "s.json").read_text())["ensemble"])
    one, same, other = found
    assert one == same and one["figures"] != other["figures"]
    band, own = one["figures"]["advance_m"], json.loads((tmp_path / "s.json").read_text())["figures"]["advance_m"]
    assert band["p5"] < band["p50"] < band["p95"] and band["p5"] < own < band["p95"] and band["shown_by"] == 20
    assert len(one["t_s"]) == len(one["histories"]["psi_deg"]["p95"]) == len(one["track"]["middle_m"]) > 100
    assert one["usable"] == 20 and one["unusable"] == {}


def test_a_cluster_without_an_ensemble_and_no_executor_are_refused(tmp_path) -> None:
    refused(tank2sim(*TURN, "--executor", "threads", cwd=tmp_path), "--executor", "dask://host:port")
    if importlib.util.find_spec("distributed"):
        refused(tank2sim(*TURN, "--executor", "dask://127.0.0.1:1", cwd=tmp_path), "--executor", "members")
    refused(tank2sim(*TURN, "--members", "1", cwd=tmp_path), "--members", "2 or more")


@pytest.mark.slow
def test_reduce_writes_the_covariance_and_simulate_draws_from_it(data, tmp_path) -> None:
    campaign = data / "data" / "pmm_synthetic_11" / "campaign.toml"
    result = tank2sim("reduce", str(campaign), "-o", "ship.toml", "--fill", "clarke1983", cwd=tmp_path)
    if result.returncode:  # the campaign gives no beam or draught
        result = tank2sim("reduce", str(campaign), "-o", "ship.toml", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    card = read_card(tmp_path / "ship.toml")
    known = read_covariance(card)
    assert known is not None and "derivatives.Yv" in known.names
    errors = np.sqrt(np.diag(known.matrix))
    for name, error in zip(known.names, errors, strict=True):
        assert math.isclose(error, card.uncertainty[name.partition(".")[2]], rel_tol=6e-3)
    result = tank2sim("simulate", "ship.toml", "--manoeuvre", "turn:10", "--members", "4", cwd=tmp_path)
    assert result.returncode == 0 and "as the covariance next to the card says" in " ".join(result.stdout.split())
    (tmp_path / "ship.covariance.json").unlink()
    refused(tank2sim("simulate", "ship.toml", "--manoeuvre", "turn:10", "--members", "4", cwd=tmp_path), "is missing")


def test_a_seed_without_an_ensemble_and_a_word_for_its_size_are_refused(tmp_path) -> None:
    refused(tank2sim("stability", "mariner", "--seed", "3", cwd=tmp_path), "--seed", "without members")
    refused(tank2sim("stability", "mariner", "--members", "abc", cwd=tmp_path), "--members", "abc", "whole number")


def test_orders_of_a_poster_are_pairs_of_name_and_number(tmp_path) -> None:
    orders = ("--order", "Full ahead=600", "--order", "Half ahead=450")
    result = tank2sim("poster", "esso-osaka-estimated", *orders, "-o", "w.html", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    assert "Half ahead" in (tmp_path / "w.html").read_text()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["compare", "mariner"], "two cards"),
        (["compare", "mariner", "wilinski-zellman"], "model.kind"),
        (["poster", "wilinski-zellman", "-o", "w.html"], "model.kind"),
        (["poster", "mariner", "-o", "w.html", "--order", "Half ahead"], "NAME=NUMBER"),
        (["pilotcard", "mariner", "-o", "w.html", "--order", "Half ahead=-3"], "NAME=RPM"),
        (["pilotcard", "mariner", "-o", "w.html", "--order", "Full astern=60"], "order astern"),
        (["poster", "esso-osaka-estimated", "-o", "w.html", "--order", "Full=7000000"], "beyond 1,200 revolutions"),
        (["poster", "esso-osaka-estimated", "-o", "w.html", "--order", f"{'x' * 30}=500"], "no room"),
        (["poster", "mariner", "-o", "w.html", "--ballast", "kvlcc2-captive"], "length 320 m"),
        (["poster", "mariner", "-o", "w.html", "--ballast", "mariner"], "ship.draught_m"),
        (["pilotcard", "mariner"], "--page"),
        (["validate", "mariner", "nothing.csv", "-o", "v.html"], "nothing.csv"),
    ],
)
def test_bad_input_is_refused_in_one_line_and_nothing_is_written(tmp_path, arguments, words) -> None:
    refused(tank2sim(*arguments, cwd=tmp_path), words)
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_validate_tells_each_figure_of_a_real_trial(tmp_path, data) -> None:
    trials = data / "data" / "kvlcc2_marin" / "MARIN_FREE_KVLCC2_zz_10_m.dat"
    arguments = ["validate", "kvlcc2-captive", str(trials), "--members", "0", "-o", "v.html", "--json", "v.json"]
    result = tank2sim(*arguments, cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    found = json.loads((tmp_path / "v.json").read_text())
    rows = {one["name"]: one for one in found["figures"]}
    assert rows["overshoot_1_deg"]["measured"] == pytest.approx(9.4, abs=0.3)
    assert all(one["numerical"] < 0.01 for one in rows.values())
    assert sum(found["counts"].values()) == len(rows) == 4
    page = (tmp_path / "v.html").read_text()
    assert "Replays" in page and "Source of the coefficients" in page


@pytest.mark.slow
def test_a_criterion_beyond_the_card_is_neither_met_nor_probable(tmp_path) -> None:
    result = tank2sim("stability", "kvlcc2-captive", "--no-spirals", "--members", "3", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    for caption in ("IMO MSC.137(76), worse side", "Probability of each IMO criterion"):
        _, _, shown = result.stdout.partition(caption)
        row = next(row for row in shown.splitlines() if "tactical" in row)
        assert "beyond" in row and not {"passed", "yes", "1"} & set(row.split()), caption
    assert "IMO criteria together are met" not in result.stdout
