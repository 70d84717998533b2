"""Craft and gliders as FMUs: an input for each order, and the motion of their models."""

from __future__ import annotations

import json
import zipfile

import pytest

from tank2sim.cards import parse_card, read_card
from tank2sim.dynamics import build
from tank2sim.fmu.check import compare_with_model
from tank2sim.fmu.export import write_fmu
from tank2sim.fmu.provenance import documents_of

OTTER = read_card("otter")

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("fmi", [2, 3])
def test_the_fmu_of_a_craft_agrees_with_its_model_lag_dead_band_and_loss_included(fmi: int, tmp_path) -> None:
    text = OTTER.text.replace(
        "ahead_Ns2 = 0.01108",
        "ahead_Ns2 = 0.01108\nspeed_loss_kg = 0.03\ndead_band_radps = 4.0\ntime_constant_s = 0.2",
    )
    card = parse_card(text, "craft.toml")
    model, path = build(card), tmp_path / "craft.fmu"
    write_fmu(model, path, fmi=fmi, documents=documents_of(card))
    report = compare_with_model(path, model=model)
    assert report.passed and (report.validation, report.differences) == ((), ())
    with zipfile.ZipFile(path) as content:
        description = content.read("modelDescription.xml").decode()
        passport = json.loads(content.read("extra/org.tank2sim/passport.json"))
    for name in ("thrusters.port.command", "thrusters.starboard.command", "current.speed"):
        assert f'name="{name}"' in description
    sources = {entry["variable"]: entry for entry in passport["coefficients"]}
    assert "Maritime Robotics" in sources["derivatives.Xu"]["source"]
    assert "Maritime Robotics" in sources["thrusters.port.ahead"]["source"]
    assert sources["derivatives.Xu"]["remark"] == "24.4 kgf at 6 kn"


PROBE = read_card("kulikovsky-velikanov")


@pytest.mark.parametrize("fmi", [2, 3])
def test_the_fmu_of_a_glider_agrees_with_its_model_and_tells_its_sources(fmi, tmp_path) -> None:
    model, path = build(PROBE), tmp_path / "glider.fmu"
    write_fmu(model, path, fmi=fmi, documents=documents_of(PROBE))
    report = compare_with_model(path, model=model)
    assert report.passed and (report.validation, report.differences) == ((), ())
    with zipfile.ZipFile(path) as content:
        description = content.read("modelDescription.xml").decode()
        passport = json.loads(content.read("extra/org.tank2sim/passport.json"))
    for name in ("buoyancy.command", "pitch.command", "roll.command"):
        assert f'name="{name}"' in description
    sources = {one["variable"]: one["source"] for one in passport["coefficients"]}
    assert "Kulikovsky" in sources["glider.lift_slope"]
    assert "12.8 kg" in passport["notices"][0]
