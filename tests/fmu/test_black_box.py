"""An FMU without sources shows no coefficient and moves like the one with them."""

from __future__ import annotations

import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from click.testing import CliRunner

import tank2sim as t2s
from tank2sim.api.fmu import make_fmu_file
from tank2sim.cli.derived import command_of
from tank2sim.dynamics import build

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def fmus(tmp_path_factory: pytest.TempPathFactory) -> dict[bool, Path]:
    folder, ship = tmp_path_factory.mktemp("fmus"), t2s.load("mariner")
    paths = {sources: folder / f"{'open' if sources else 'closed'}.fmu" for sources in (True, False)}
    for sources, path in paths.items():
        ship.to_fmu(path, fmi=2, sources=sources)
    return paths


def test_no_file_of_it_names_or_holds_a_coefficient(fmus: dict[bool, Path]) -> None:
    card = t2s.load("mariner").manoeuvring()
    values = [f"{abs(value):.6g}" for value in card.derivatives.values() if value]
    with zipfile.ZipFile(fmus[False]) as archive:
        names = archive.namelist()
        texts = {name: archive.read(name) for name in names}
    assert not [name for name in names if name.startswith(("sources/", "resources/")) or name.endswith(".c")]
    for name, content in texts.items():
        assert b"derivatives." not in content, name
        if not name.startswith("binaries/") and not name.endswith((".png", ".csv")):  # the reference run is motion
            read = content.decode("utf-8")
            assert not [value for value in values if len(value) > 7 and value in read], name
    described = fmpy.read_model_description(str(fmus[False]))
    left = {variable.name for variable in described.modelVariables if variable.causality == "parameter"}
    assert left and all(name.startswith(("initial.", "origin.", "solver.")) for name in left)
    assert b"SourceFiles" not in texts["modelDescription.xml"]


def test_it_moves_like_the_one_with_sources(fmus: dict[bool, Path]) -> None:
    orders = np.array([(0.0, 0.0), (10.0, 0.3)], dtype=[("time", float), ("rudder.command", float)])
    shown = ["motion.x", "motion.y", "motion.psi", "motion.u", "validity"]
    runs = [
        fmpy.simulate_fmu(str(path), stop_time=200.0, output_interval=10.0, input=orders, output=shown)
        for path in fmus.values()
    ]
    for name in shown:
        assert runs[1][name] == pytest.approx(runs[0][name], rel=1e-9, abs=1e-9)
    assert runs[0]["motion.psi"][-1] > 1.0


def test_it_is_checked_against_a_card_and_repeats_its_reference(fmus: dict[bool, Path]) -> None:
    alone, compared = t2s.check_fmu(fmus[False]), t2s.check_fmu(fmus[False], t2s.load("mariner"))
    assert alone.passed and not alone.study.compared
    assert compared.passed and compared.study.compared
    other = t2s.load("mariner", {"derivatives.Nr": -0.003})
    assert not t2s.check_fmu(fmus[False], other).passed


def test_constants_leave_the_equations_as_they_are() -> None:
    model = build(t2s.load("mariner").card)
    fixed = model.with_constants(model.parameter_names)
    assert fixed.parameter_names == ()
    parameters = model.parameter_values()
    states = np.array(model.initial(parameters)).ravel()
    states[model.state_names.index("motion.r")] = 0.01
    inputs = model.input_values()
    expected = np.array(model.rhs(states, inputs, parameters)).ravel()
    assert np.array(fixed.rhs(states, inputs, [])).ravel() == pytest.approx(expected, rel=1e-12, abs=1e-15)


def test_the_command_takes_the_option(tmp_path: Path) -> None:
    path = tmp_path / "closed.fmu"
    done = CliRunner().invoke(command_of(make_fmu_file.verb), ["mariner", "-o", str(path), "--no-sources"])
    assert done.exit_code == 0
    assert not [name for name in zipfile.ZipFile(path).namelist() if name.startswith("sources/")]
