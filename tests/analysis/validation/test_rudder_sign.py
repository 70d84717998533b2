"""A derivative by the rudder has one sign in every command: that of the (first) card as its file has it."""

from __future__ import annotations

import json
import sys
import tomllib

import pytest

from tank2sim.bundled import bundled_cards
from tank2sim.cli import main


@pytest.mark.slow
@pytest.mark.parametrize(("ship", "other"), [("mariner", "kvlcc2-captive"), ("kvlcc2-captive", "mariner")])
def test_compare_and_influence_show_the_rudder_derivatives_of_the_card(ship, other, tmp_path, monkeypatch) -> None:
    stated = tomllib.loads(bundled_cards()[ship].read_text())["derivatives"]
    runs = {
        "compare": ["compare", ship, other, "--members", "0"],
        "influence": ["influence", ship, "--figures", "criterion_C"],
    }
    found = {}
    for name, arguments in runs.items():
        monkeypatch.setattr(sys, "argv", ["tank2sim", *arguments, "--json", str(tmp_path / "x.json")])
        with pytest.raises(SystemExit) as end:
            main()
        assert end.value.code == 0
        found[name] = json.loads((tmp_path / "x.json").read_text())
    rows = {row["name"]: row["cards"] for row in found["compare"]["coefficients"]}
    for derivative in ("Yd", "Nd", "Nddd", "Ydu", "Xdd", "Nv"):
        assert rows[derivative][0]["value"] == pytest.approx(stated[derivative])
        assert found["influence"]["parameters"][f"derivatives.{derivative}"]["value"] == pytest.approx(
            stated[derivative]
        )
    # the other card's file has the other sign: turned to that of the first
    assert rows["Nd"][1]["value"] * stated["Nd"] > 0
