"""``tank2sim convert`` writes what it says, whole or not at all."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tank2sim.cards import read_card
from tests.cli.command_line import refused, tank2sim


@pytest.mark.slow
def test_an_mmg_ship_becomes_a_polynomial_with_its_errors(tmp_path: Path) -> None:
    done = tank2sim(
        "convert", "kvlcc2-l7-mmg", "--to", "abkowitz", "-o", "ship.toml", "--json", "made.json", cwd=tmp_path
    )
    assert done.returncode == 0 and "tactical_diameter_m" in done.stdout
    assert read_card(tmp_path / "ship.toml").model.kind == "abkowitz"
    made = json.loads((tmp_path / "made.json").read_text())
    assert made["schema"] == "tank2sim/convert/1" and made["to"] == "abkowitz"
    assert len(made["figures"]) == 32 and set(made["fit"]["residuals_percent"]) == {"X", "Y", "N"}


def test_conventions_are_those_asked_for(tmp_path: Path) -> None:
    options = ("--scaling", "prime_ii", "--rudder-sign", "port", "--set", "ship.notes=again")
    done = tank2sim("convert", "mariner", "--to", "abkowitz", "-o", "ship.toml", *options, cwd=tmp_path)
    assert done.returncode == 0
    text = (tmp_path / "ship.toml").read_text()
    assert 'scaling = "prime_ii"' in text and 'rudder_sign = "port"' in text and "again" in text


def test_bad_requests_are_one_line_and_write_nothing(tmp_path: Path) -> None:
    for arguments, word in (
        (("mariner", "--to", "mmg"), "model.kind"),
        (("mariner", "--to", "matlab"), "--to"),
        (("mariner", "--to", "abkowitz", "--scaling", "bis"), "displacement_kg"),
        (("kvlcc2-mmg", "--to", "mss", "--origin", "3"), "--to"),
        (("nowhere", "--to", "mss"), "nowhere"),
    ):
        refused(tank2sim("convert", *arguments, "-o", "made", cwd=tmp_path), word)
        assert not (tmp_path / "made").exists()
    refused(tank2sim("convert", "mariner", "--to", "mss", "-o", "no/made.m", cwd=tmp_path), "no")
