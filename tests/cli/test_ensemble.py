"""``--members``: bands in the JSON, the same for the same seed, from the covariance that reduce writes."""

from __future__ import annotations

import importlib.util
import json
import math

import numpy as np
import pytest

from tank2sim.cards import read_card
from tank2sim.cards.covariance_reading import read_covariance
from tests.cli.command_line import refused, tank2sim

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
