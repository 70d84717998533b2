"""``tank2sim guess``: card, page and JSON, and refusals that write nothing."""

from __future__ import annotations

import json

import jsonschema
import pytest

import tank2sim as t2s
from tank2sim.native.lanes import widest_lanes
from tests.cli.command_line import refused, tank2sim
from tests.marks import first_fast

pytestmark = pytest.mark.skipif(widest_lanes() == 0, reason="needs a C compiler")

SHIP = ("guess", "--length", "160", "--beam", "23.2", "--draught", "7.5", "--block", "0.6", "--speed", "15")


@pytest.mark.essential
@pytest.mark.slow
def test_a_guess_writes_card_page_and_json(tmp_path) -> None:
    files = ("-o", "ship.toml", "--page", "g.html", "--json", "g.json")
    result = tank2sim(
        *SHIP, "--turn35", "advance_m=560 tactical_diameter_m=650+-20", "--members", "150", *files, cwd=tmp_path
    )
    assert result.returncode == 0, result.stderr
    found = json.loads((tmp_path / "g.json").read_text())
    jsonschema.validate(found, t2s.json_schema("guess"))
    assert found["figures"]["tactical_diameter_m@35"]["standard_error"] == 20.0
    assert (tmp_path / "ship.covariance.json").exists() and "guess" in (tmp_path / "g.html").read_text()
    again = tank2sim("simulate", "ship.toml", "--manoeuvre", "turn:35", "--members", "20", cwd=tmp_path)
    assert again.returncode == 0, again.stderr
    assert "samples of the posterior" in " ".join(again.stdout.split())


@first_fast(
    "given, named",
    [
        ("advance_m=x", "advance_m=x"),
        ("advance_m=56", "advance_m=56"),
        ("tactical_diameter_m=6500", "tactical_diameter_m=6500"),
    ],
)
def test_figures_of_no_ship_are_refused_and_nothing_is_written(tmp_path, given: str, named: str) -> None:
    refused(tank2sim(*SHIP, "--turn35", given, "--members", "150", "-o", "ship.toml", cwd=tmp_path), named)
    assert not list(tmp_path.iterdir())
