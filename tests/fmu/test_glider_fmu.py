"""The glider as an FMU: inputs buoyancy, pitch and roll, and the motion of its model."""

from __future__ import annotations

import json
import zipfile

import pytest

from tank2sim.cards import read_card
from tank2sim.dynamics import build
from tank2sim.fmu.check import compare_with_model
from tank2sim.fmu.export import write_fmu
from tank2sim.fmu.provenance import documents_of

PROBE = read_card("kulikovsky-velikanov")

pytestmark = pytest.mark.slow


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
