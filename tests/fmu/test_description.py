"""modelDescription.xml: valid, with units, starts and dependencies that are those of the model."""

from __future__ import annotations

import ctypes
import math
import zipfile
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from fmpy.validation import validate_fmu
from lxml import etree

from tank2sim.dynamics.model import Model
from tank2sim.fmu.interface import interface
from tank2sim.fmu.running import RunningFmu
from tests.fmu.driving import FmuFile, Instantiate, Unpacked

NAMES = pytest.mark.parametrize("name", ["hull", "body", "gain"])


@NAMES
def test_the_description_is_valid(name: str, fmi: int, fmu_file: FmuFile) -> None:
    assert validate_fmu(str(fmu_file(name, fmi))) == []


@NAMES
def test_variables_are_those_of_the_model(name: str, fmi: int, unpacked: Unpacked, models: dict[str, Model]) -> None:
    model, variables = models[name], {v.name: v for v in unpacked(name, fmi).description.modelVariables}
    for declared in (*model.inputs, *model.parameters):
        found = variables[declared.name]
        assert found.causality == ("input" if declared in model.inputs else "parameter")
        if declared.boolean:
            assert (found.type, found.start) == ("Boolean", "true" if declared.start else "false")
        else:
            assert float(found.start) == declared.start
    for variable in (*model.states, *model.quantities):
        assert (variable.name in variables) or variable.name not in model.outputs
        if variable.name in variables:
            found = variables[variable.name]
            assert (found.causality == "output") is (variable.name in model.outputs)
            assert (found.unit, found.displayUnit) == (variable.unit, variable.display_unit)
            assert (found.initial, found.start) == ("calculated", None)
    for parameter in model.parameters:
        assert variables[parameter.name].variability == ("tunable" if parameter.tunable else "fixed")


def test_each_rate_names_its_state(fmi: int, unpacked: Unpacked, models: dict[str, Model]) -> None:
    by_rate = {v.name: v.derivative.name for v in unpacked("hull", fmi).description.modelVariables if v.derivative}
    assert by_rate == {state.derivative: state.name for state in models["hull"].states}
    # The rate of the body's position is a state, which FMI lets be a derivative only once: it gets a variable.
    body = {v.name: v.derivative.name for v in unpacked("body", fmi).description.modelVariables if v.derivative}
    assert body == {"der(motion.x)": "motion.x", "motion.udot": "motion.u"}


@pytest.mark.parametrize(
    ("unit", "shown", "value", "expected"),
    [("rad", "deg", math.pi, 180.0), ("m/s", "knots", 1852.0, 3600.0), ("rad/s", "rpm", 2 * math.pi, 60.0)],
)
def test_display_units_convert_as_they_should(
    fmi: int, unit: str, shown: str, value: float, expected: float, unpacked: Unpacked
) -> None:
    units = {u.name: u for u in unpacked("hull", fmi).description.unitDefinitions}
    (display,) = (d for d in units[unit].displayUnits if d.name == shown)
    assert float(display.factor) * value + float(display.offset or 0) == pytest.approx(expected)


def test_units_have_their_base_units(fmi: int, unpacked: Unpacked) -> None:
    root = etree.parse(str(unpacked("hull", fmi).folder / "modelDescription.xml")).getroot()
    bases = {unit.get("name"): dict(unit.find("BaseUnit").attrib) for unit in root.iter("Unit")}
    assert bases["N.m"] == {"kg": "1", "m": "2", "s": "-2"}
    assert bases["rad/s2"] == {"rad": "1", "s": "-2"}
    assert bases["m/s"] == {"m": "1", "s": "-1"}


def test_abilities_are_declared(fmi: int, unpacked: Unpacked) -> None:
    root = etree.parse(str(unpacked("hull", fmi).folder / "modelDescription.xml")).getroot()
    state, plural = ("FMUstate", "") if fmi == 2 else ("FMUState", "s")
    promised = [f"canGetAndSet{state}", f"canSerialize{state}", f"providesDirectionalDerivative{plural}"]
    if fmi == 3:
        promised.append("providesAdjointDerivatives")
    for kind in ("ModelExchange", "CoSimulation"):
        attributes = root.find(kind).attrib
        assert {attributes[name] for name in promised} == {"true"}
        assert attributes["canBeInstantiatedOnlyOncePerProcess"] == "false"
    assert root.find("CoSimulation").get("canHandleVariableCommunicationStepSize") == "true"
    assert root.get("variableNamingConvention") == "structured"


# ---- dependencies ----


def changed(before: list[float], after: list[float], names: list[str]) -> set[str]:
    return {name for name, one, other in zip(names, before, after, strict=True) if one != other}


def declared(unknowns: Any, known: str) -> set[str]:
    return {u.variable.name for u in unknowns if known in {d.name for d in u.dependencies}}


def kinds_of(unknowns: Any) -> dict[tuple[str, str], str]:
    kinds = {}
    for unknown in unknowns:
        for known, kind in zip(unknown.dependencies, unknown.dependenciesKind, strict=True):
            kinds[unknown.variable.name, known.name] = kind
    return kinds


def test_dependencies_while_running_are_those_that_a_change_shows(
    fmi: int, hull: Model, instantiate: Instantiate
) -> None:
    fmu = instantiate("hull", fmi, "ModelExchange")
    fmu.initialise({"rudder.command": 0.15, "propeller.speed": 1.2})
    fmu.update()
    description = fmu.unpacked.description
    unknowns = [*description.outputs, *description.derivatives]
    names = [unknown.variable.name for unknown in unknowns]
    states = [3.0, 1.0, 0.7, 6.0, -0.5, 0.02, 0.12]

    def values(states: list[float], inputs: dict[str, float]) -> list[float]:
        fmu.instance.enterEventMode()
        fmu.write({"rudder.command": 0.15, "propeller.speed": 1.2, "steering.failed": 0.0} | inputs)
        fmu.update()
        fmu.instance.setContinuousStates((ctypes.c_double * 7)(*states), 7)
        return fmu.read(names)

    before = values(states, {})
    for place, state in enumerate(hull.state_names):
        moved = [value + 1e-3 * (other == place) for other, value in enumerate(states)]
        assert changed(before, values(moved, {}), names) == declared(unknowns, state), state
    for name, value in (("rudder.command", 0.151), ("propeller.speed", 1.3), ("steering.failed", 1.0)):
        assert changed(before, values(states, {name: value}), names) == declared(unknowns, name), name


def test_dependencies_say_whether_a_factor_is_constant(fmi: int, unpacked: Unpacked) -> None:
    description = unpacked("hull", fmi).description
    kinds = kinds_of([*description.outputs, *description.derivatives])
    assert kinds["rudder.demand", "rudder.command"] == "constant"
    assert kinds["motion.udot", "propeller.speed"] == "tunable"
    assert kinds["motion.udot", "motion.u"] == "dependent"
    assert kinds["rudder.rate", "steering.failed"] == "dependent"
    assert kinds["motion.psidot", "motion.r"] == "constant"


def shown_at_the_start(fmu: RunningFmu, model: Model, trim: bool) -> set[tuple[str, str]]:
    """Initial unknowns that change when an input or a parameter does, with it."""
    unknowns = fmu.unpacked.description.initialUnknowns
    names, knowns = [unknown.variable.name for unknown in unknowns], [*model.input_names, *model.parameter_names]
    fmu.write({"initial.trim": float(trim), "rudder.command": 0.2, "propeller.speed": 1.2})
    before, shown = fmu.read(names), set()
    for known, value in zip(knowns, fmu.read(knowns), strict=True):
        fmu.write({known: 1.0 - value if fmu.unpacked.boolean(known) else value * 1.01 + 0.001})
        found = changed(before, fmu.read(names), names)
        fmu.write({known: value})
        assert found <= declared(unknowns, known), known
        shown |= {(name, known) for name in found}
    return shown


GUESSES = ("initial.u", "initial.v", "initial.r")


def test_initial_dependencies_are_those_that_a_change_shows(fmi: int, hull: Model, instantiate: Instantiate) -> None:
    fmu = instantiate("hull", fmi, "ModelExchange")
    shown = shown_at_the_start(fmu, hull, False) | shown_at_the_start(fmu, hull, True)
    unknowns = fmu.unpacked.description.initialUnknowns
    assert {unknown.variable.name for unknown in unknowns} == {
        *hull.state_names,
        *hull.outputs,
        *(state.derivative for state in hull.states),
    }
    stated = {(u.variable.name, d.name) for u in unknowns for d in u.dependencies}
    # Steady motion hides what its rates, all zero, depend on; so the states are looked at. Of the first guess of a
    # steady motion it keeps rounding errors at most, so that a state is not held against the guess of another.
    looked_at = {
        (state, known)
        for state in hull.state_names
        for known in (*hull.input_names, *hull.parameter_names)
        if known not in GUESSES or state.removeprefix("motion.") == known.removeprefix("initial.")
    }
    assert stated & looked_at == shown & looked_at


def test_dependencies_of_the_trimmed_start_include_its_inputs(unpacked: Unpacked) -> None:
    unknowns = unpacked("hull", 3).description.initialUnknowns
    assert "motion.u" in declared(unknowns, "rudder.command")
    assert "motion.psi" not in declared(unknowns, "rudder.command")
    assert declared(unknowns, "initial.psi") == {"motion.psi", "motion.xdot", "motion.ydot"}


# ---- the interface itself ----


def test_value_references_stand_in_blocks(hull: Model) -> None:
    described = interface(hull)
    assert [variable.reference for variable in described.variables] == list(range(len(described.variables)))
    assert [len(block) for block in described.blocks] == [
        7,
        3,
        12,
        7,
        4 + 2,
        2,
    ]  # two event indicators among the outputs
    assert described.variables[described.trim_switch].name == "initial.trim"


def test_names_that_fmi_would_refuse_are_a_fault_of_the_program(hull: Model) -> None:
    bad = replace(hull.parameters[0], name="two words")
    with pytest.raises(ValueError, match="structured name"):
        interface(hull.extend(bad))


def test_the_file_unpacks_to_plain_names(fmi: int, fmu_file: FmuFile) -> None:
    with zipfile.ZipFile(fmu_file("hull", fmi)) as archive:
        names = archive.namelist()
    assert names[0] == "modelDescription.xml"
    assert not [name for name in names if name.startswith((".", "/")) or "\\" in name]
    assert names[1:] == sorted(names[1:])
    assert np.all([not name.endswith("/") for name in names])
