"""``tank2sim tow`` as a user gives it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tank2sim.cards import read_card
from tests.cli.command_line import refused, tank2sim

TOWS = str(Path(__file__).parents[4] / "models/wilinski-zellman/tows.csv")


def test_a_force_that_varies_and_a_known_mass(tmp_path) -> None:
    arguments = (
        "--force-N",
        "11.63,0.001",
        "--total-mass-kg",
        "2800",
        "--terms",
        "B3",
        "--json",
        "t.json",
        "-o",
        "body.toml",
    )
    result = tank2sim("tow", TOWS, *arguments, cwd=tmp_path)
    assert result.returncode == 0 and "T = 11.63 + 0.001 t N" in result.stdout, result.stderr
    found = json.loads((tmp_path / "t.json").read_text())
    assert found["methods"]["qr"]["estimates"]["total_mass_kg"] == 2800
    assert found["force_N"] == pytest.approx(11.655)
    assert read_card(tmp_path / "body.toml").surge.total_mass_kg == 2800


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--force-N", "11.63,fast"], ["--force", "fast"]),
        (["--force-N", "1,-1"], ["--force", "50 s"]),
        (["--total-mass-kg", "0"], ["--total-mass-kg"]),
        (["--length-m", "-3"], ["--length-m"]),
    ],
)
def test_bad_input_ends_in_one_line_and_exit_2(tmp_path, arguments, words) -> None:
    refused(tank2sim("tow", TOWS, *arguments, cwd=tmp_path), *words)
    assert not list(tmp_path.iterdir())
