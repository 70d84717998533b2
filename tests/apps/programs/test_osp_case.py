"""A ship as the hull of OSP's cases dp-ship and gunnerus-dp: forces, files by their schemas, closed loops."""

from __future__ import annotations

import json
import math
import os
import re
import subprocess
import sys
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from fmpy.fmi2 import FMU2Slave
from fmpy.ssp.ssd import read_ssd
from lxml import etree

import tank2sim as t2s
from tank2sim.apps.programs.osp_case import (
    gunnerus_files,
    gunnerus_groups,
    gunnerus_model,
    hull_model,
    low_speed_damping,
    osp_files,
)
from tank2sim.apps.programs.program_files import ProgramFiles
from tank2sim.bundled import bundled, bundled_cards
from tank2sim.cards import SteeredCard, parse_card, read_card
from tank2sim.dynamics import build
from tank2sim.dynamics.model import Model
from tank2sim.dynamics.simulator_interface import with_external_forces
from tank2sim.errors import InputError
from tank2sim.fmu.interface import interface
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.running import Running
from tests.apps.programs.osp_partners import AXES, PARTNERS, SPACE, THRUST, Controller, initial_values, write_partner
from tests.hostile_text import HOSTILE, hostile_card

STEP_S = 0.04
SHIP = "kvlcc2-mmg"
THRUSTERS = ["Thrust_d[1]", "Thrust_d[2]", "Thrust_d[3]", "input[1]", "input[2]"]
PLACE = ["q[1]", "q[2]", "q[3]"]
GROUPS = "{https://open-simulation-platform.com/OspModelDescription/1.0.1}"


def steered(name: str) -> SteeredCard:
    card = read_card(name)
    assert isinstance(card, SteeredCard)
    return card


@pytest.fixture(scope="module")
def allocation(simulator: Callable[[str], Any]) -> Callable[..., tuple[float, float, float]]:
    """Forces of the thrusters of the case."""
    return simulator("osp/allocation.py").forces  # type: ignore[no-any-return]


def at_rest(model: Model) -> dict[str, float]:
    names = [name for name in model.parameter_names if name.startswith("initial.") and name != "initial.trim"]
    return dict.fromkeys(names, 0.0)


def test_the_thrusters_push_as_the_allocation_of_the_case_says(
    allocation: Callable[..., tuple[float, float, float]],
) -> None:
    card = steered(SHIP)
    model, plain = hull_model(card), with_external_forces(build(card))
    for F1, F2, F3, a1, a2 in ((3e6, 2e6, 1e6, 0.4, -0.7), (1e6, 4e6, -2e6, 2.0, 1.0)):
        X, Y, N = allocation(F1, F2, F3, a1, a2)
        N *= card.ship.length_m / 107  # of places that go with the length
        hull = Running(Integrator(model), dict(zip(THRUSTERS, (F1, F2, F3, a1, a2), strict=True)))
        other = Running(
            Integrator(plain),
            {"propeller.speed": 0.0, "external.X": X, "external.Y": Y, "external.N": N},
            at_rest(plain),
        )
        for running in (hull, other):
            running.run(60.0)
        found, expected = (
            [running.state(f"motion.{name}") for name in ("x", "y", "psi", "u", "v", "r")] for running in (hull, other)
        )
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)
        assert abs(found[2]) > 1e-3


def test_the_hull_lies_still_without_thrust() -> None:
    running = Running(Integrator(hull_model(steered(SHIP))))
    running.run(120.0)
    assert [running.state(f"motion.{name}") for name in ("x", "y", "psi", "u", "v", "r")] == [0.0] * 6


@pytest.fixture(scope="module")
def files() -> ProgramFiles:
    return osp_files(steered(SHIP))


@pytest.fixture(scope="module")
def folder(files: ProgramFiles, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("osp")
    for name, content in files.files.items():
        (path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


@pytest.mark.slow
def test_the_fmu_has_the_names_of_the_case_and_starts_at_zero(folder: Path) -> None:
    described = fmpy.read_model_description(str(folder / "hull.fmu"))
    assert described.modelName == "hull" and described.fmiVersion == "2.0" and described.coSimulation is not None
    assert described.variableNamingConvention == "structured"
    variables = {one.name: one for one in described.modelVariables}
    assert all(variables[name].causality == "input" and float(variables[name].start) == 0.0 for name in THRUSTERS)
    assert all(variables[name].causality == "output" for name in PLACE)
    assert float(variables["propeller.speed"].start) == 0.0
    assert fmpy.supported_platforms(str(folder / "hull.fmu"))


@pytest.mark.slow
def test_groups_are_those_of_the_case_by_position(folder: Path) -> None:
    root = etree.parse(folder / "hull_OspModelDescription.xml").getroot()
    (groups,) = root
    assert [group.get("name") for group in groups] == ["position", "thrust", "azimuthAngle"]
    members = {group.get("name"): [one.get("ref") for one in group.iter(f"{GROUPS}Variable")] for group in groups}
    assert members == {"position": PLACE, "thrust": THRUSTERS[:3], "azimuthAngle": THRUSTERS[3:]}
    sizes = {group.get("name"): [len(part) for part in group if len(part)] for group in groups}
    assert sizes["position"] == sizes["thrust"] == [2, 1]  # as the groups of the allocation and of the observer
    names = [one.get("name") for one in root.iter() if one.get("name")]
    assert len(names) == len(set(names))


@pytest.mark.slow
def test_both_systems_have_the_same_connections_and_every_variable_of_the_case_once(folder: Path) -> None:
    root = etree.parse(folder / "OspSystemStructure.xml").getroot()
    assert [one.tag.removeprefix(SPACE) for one in root] == [
        *("StartTime", "BaseStepSize", "Algorithm", "Simulators", "Functions", "Connections"),
    ]
    assert float(root.find(f"{SPACE}BaseStepSize").text) == STEP_S
    factors = {one.get("name"): float(one.get("factor")) for one in root.iter(f"{SPACE}LinearTransformation")}
    joints = set()
    for one in root.iter(f"{SPACE}VariableConnection"):
        start, end = ((part.get("simulator"), part.get("name")) for part in one)
        joints.add((*start, *end, None))
    signals = [list(one) for one in root.iter(f"{SPACE}SignalConnection")]
    for first, second in zip(signals[::2], signals[1::2], strict=True):
        assert first[1].get("function") == second[0].get("function")
        assert (first[1].get("name"), second[0].get("name")) == ("in", "out")
        ends = [(part.get("simulator"), part.get("name")) for part in (first[0], second[1])]
        joints.add((*ends[0], *ends[1], factors[first[1].get("function")]))
    package = folder / "case.ssp"
    with zipfile.ZipFile(package, "w") as archive:
        archive.write(folder / "SystemStructure.ssd", "SystemStructure.ssd")
    described = read_ssd(str(package))  # held against the schema of SSP 1.0
    same = {
        (one.startElement, one.startConnector, one.endElement, one.endConnector) for one in described.system.connections
    }
    assert same == {joint[:4] for joint in joints}
    ends = [joint[2:4] for joint in joints]
    wanted = {"Thrust Allocation": "ThMPC", "Observer": "NLPobserver", "DP Controller": "DPController"}
    heard = {(name, one) for name, fmu in wanted.items() for one in PARTNERS[fmu][0]} | {
        ("Ship", one) for one in THRUSTERS
    }
    assert len(ends) == len(set(ends)) and set(ends) == heard


@pytest.mark.slow
def test_gains_go_with_mass_and_inertia_and_places_with_the_length(files: ProgramFiles) -> None:
    card, system = steered(SHIP), str(files.files["OspSystemStructure.xml"])
    density = card.environment.water_density_kgpm3
    mass = density * (312600 + 0.223 * 0.5 * 320**2 * 20.8)  # volume and m_y' of the KVLCC2, as published
    gains = initial_values(system, "DP Controller")
    assert gains["Kpx"] == pytest.approx(2e4 * mass / 3.31e6, rel=0.01)
    assert gains["Kdx"] / gains["Kpx"] == pytest.approx(25, rel=1e-4)
    assert gains["Kdpsi"] / gains["Kppsi"] == pytest.approx(1e9 / 1.5e8, rel=1e-4)
    assert initial_values(system, "Thrust Allocation")["x1"] == pytest.approx(-45 * card.ship.length_m / 107, rel=1e-4)


@pytest.fixture
def hull(folder: Path, tmp_path: Path) -> Iterator[tuple[FMU2Slave, dict[str, int]]]:
    """The FMU of the hull, running."""
    described = fmpy.read_model_description(str(folder / "hull.fmu"))
    unit = FMU2Slave(
        guid=described.guid,
        unzipDirectory=fmpy.extract(str(folder / "hull.fmu"), str(tmp_path / "hull")),
        modelIdentifier=described.coSimulation.modelIdentifier,
        instanceName="Ship",
    )
    unit.instantiate()
    unit.setupExperiment(startTime=0.0)
    unit.enterInitializationMode()
    unit.exitInitializationMode()
    yield unit, {one.name: one.valueReference for one in described.modelVariables}
    unit.terminate()
    unit.freeInstance()


@pytest.mark.slow
def test_a_controller_with_the_written_gains_moves_the_hull_along_its_reference(
    files: ProgramFiles, hull: tuple[FMU2Slave, dict[str, int]]
) -> None:
    unit, places = hull
    system = str(files.files["OspSystemStructure.xml"])
    controller = Controller(system)
    reference, rate, worst = np.zeros(3), np.zeros(3), np.zeros(3)
    goal, before = np.array([20.0, -10.0, 0.5]), np.zeros(3)
    asked, heard = [places[name] for name in THRUSTERS], [places[name] for name in PLACE]
    for k in range(round(600 / STEP_S)):
        time = k * STEP_S
        now = np.array(unit.getReal(heard))
        aim = goal * min(1.0, time / 200)
        rate = (aim - reference) / 30
        reference = reference + STEP_S * rate
        speed, before = (now - before) / STEP_S, now
        worst = np.maximum(worst, np.abs(reference - now))
        unit.setReal(asked, controller.step(reference - now, rate - speed, now[2], time, STEP_S))
        unit.doStep(time, STEP_S)
    assert np.all(np.abs(now - goal) < [0.3, 0.3, 0.01]), now
    assert np.all(worst < [3.0, 3.0, 0.05]), worst


_LIBCOSIM = """
import json, sys
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimObserver import CosimObserver
run = (CosimExecution.from_osp_config_file(osp_path=sys.argv[1]) if sys.argv[2] == "osp"
       else CosimExecution.from_ssp_file(ssp_path=sys.argv[1]))
places = {info.name.decode(): info.index for info in run.slave_infos()}
observer = CosimObserver.create_last_value()
run.add_observer(observer)
run.step(250)
found = {}
for simulator, names in json.loads(sys.argv[3]).items():
    known = {one.name.decode(): one.reference for one in run.slave_variables(places[simulator])}
    found[simulator] = observer.last_real_values(places[simulator], [known[name] for name in names])
print("FOUND", json.dumps(found))
"""


@pytest.mark.slow
@pytest.mark.parametrize("form", ["osp", "ssp"])
def test_the_engine_of_osp_runs_the_whole_case_with_stand_ins(form: str, files: ProgramFiles, folder: Path) -> None:
    pytest.importorskip("libcosimpy", reason="libcosimpy is not installed")
    for name in PARTNERS:
        if not (folder / f"{name}.fmu").exists():
            write_partner(name, folder)
    asked = {
        "Ship": PLACE + THRUSTERS,
        "Observer": [f"{name}[{place}]" for name in ("y", "tau") for place in (1, 2, 3)],
        "DP Controller": [f"K{kind}{axis}" for kind in "pdi" for axis in AXES],
        "Thrust Allocation": ["x1", "y1", "x2", "y2", "x3", "uFmax"],
    }
    command = [sys.executable, "-c", _LIBCOSIM, str(folder), form, json.dumps(asked)]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False, env=dict(os.environ))
    lines = [line for line in ended.stdout.splitlines() if line.startswith("FOUND ")]
    assert lines, ended.stderr[-1500:]
    found = {name: dict(zip(asked[name], values, strict=True)) for name, values in json.loads(lines[0][6:]).items()}
    assert [found["Ship"][name] for name in THRUSTERS] == [
        THRUST[name] for name in ("F1c", "F2c", "F3c", "alpha1", "alpha2")
    ]
    orders = dict(zip(THRUSTERS, (3e5, 2e5, 1e5, 0.3, -0.2), strict=True))
    running = Running(Integrator(hull_model(steered(SHIP))), orders)
    running.run(250 * STEP_S)
    expected = [running.state(f"motion.{name}") for name in AXES]
    # The orders arrive a step late in some orders of the simulators.
    assert [found["Ship"][name] for name in PLACE] == pytest.approx(expected, rel=0.02)
    system = str(files.files["OspSystemStructure.xml"])
    for name in ("DP Controller", "Thrust Allocation"):
        for key, value in initial_values(system, name).items():
            if key in found[name]:
                assert found[name][key] == value
    gains, heard = initial_values(system, "DP Controller"), found["Observer"]
    assert heard["tau[1]"] / 4e5 * gains["Kpx"] == pytest.approx(2e4, rel=1e-4)
    assert heard["tau[3]"] / 6e6 * gains["Kppsi"] == pytest.approx(1.5e8, rel=1e-4)


def refused(card: SteeredCard) -> InputError:
    with pytest.raises(InputError) as found:
        osp_files(card)
    return found.value


def test_a_ship_whose_engine_cannot_be_stopped_is_refused() -> None:
    assert refused(steered("mariner")).place == "propulsion"


def test_damping_is_that_of_calm_water() -> None:
    ship = t2s.load("kvlcc2")
    windy, calm = (
        ship.replace(
            {
                "effects": [
                    {"name": "cross_flow_drag", "parameters": {"drag_coefficient": 0.65}},
                    {"name": "wind", "parameters": {"speed_mps": speed, "direction_deg": 90.0}},
                ]
            }
        ).card
        for speed in (10.0, 0.0)
    )
    assert isinstance(windy, SteeredCard) and isinstance(calm, SteeredCard)
    found = low_speed_damping(windy, hull_model(windy))
    assert found == pytest.approx(low_speed_damping(calm, hull_model(calm)))


def test_a_hull_without_damping_at_low_speed_is_refused() -> None:
    text = bundled_cards()["otter"].read_text(encoding="utf-8")
    text = re.sub(r"(?m)^(Yv|Yvabsv) = \S+", r"\1 = -0.01", text[: text.index("[[effects]]")])
    card = parse_card(text, "bare.toml")
    assert isinstance(card, SteeredCard)
    fault = refused(card)
    assert fault.place == "derivatives" and "sway" in fault.problem


@pytest.mark.slow
def test_no_text_of_a_card_comes_into_the_systems(files: ProgramFiles, tmp_path: Path) -> None:
    path = hostile_card(tmp_path / "ship.toml", bundled("models") / SHIP / "ship.toml", "".join(HOSTILE))
    other = osp_files(read_card(str(path)))
    for name in files.files:
        if not name.endswith(".fmu"):
            assert other.files[name] == files.files[name]
    (tmp_path / "hull.fmu").write_bytes(other.files["hull.fmu"])  # type: ignore[arg-type]
    described: Any = fmpy.read_model_description(str(tmp_path / "hull.fmu"))
    assert described.modelName == "hull"
    assert math.isfinite(float(described.defaultExperiment.stopTime))


MOTION = [f"motion.{name}" for name in ("x", "y", "psi", "u", "v", "r")]


@pytest.fixture(scope="module")
def card() -> SteeredCard:
    card = read_card("kvlcc2-mmg")
    assert isinstance(card, SteeredCard)
    return card


def test_thrust_and_waves_push_in_the_axes_of_the_ship(card: SteeredCard) -> None:
    plain = with_external_forces(build(card))
    orders = {"propeller.speed": 0.0, "external.X": 3e6, "external.Y": -1e6, "external.N": 2e8}
    rest = {name: 0.0 for name in plain.parameter_names if name.startswith("initial.") and name != "initial.trim"}
    expected = Running(Integrator(plain), orders, rest)
    found = Running(
        Integrator(gunnerus_model(card)),
        {"Thrust[1]": 2e6, "Wave_Forces[1]": 1e6, "Thrust[2]": -1e6, "Wave_Forces[6]": 2e8, "Thrust[3]": 1e9},
    )
    for running in (expected, found):
        running.run(60.0)
    np.testing.assert_allclose(
        [found.state(name) for name in MOTION], [expected.state(name) for name in MOTION], rtol=1e-9, atol=1e-12
    )


def test_a_ship_at_rest_in_the_water_goes_with_the_current_of_its_axes(card: SteeredCard) -> None:
    model = gunnerus_model(card)
    running = Running(
        Integrator(model), {"Current_Velocity[1]": 0.3, "Current_Velocity[2]": -0.2}, {"initial.psi": math.pi / 2}
    )
    running.run(100.0)
    assert running.state("motion.x") == pytest.approx(20.0)  # to port of a ship that heads east is north
    assert running.state("motion.y") == pytest.approx(30.0)
    assert running.state("motion.u") == running.state("motion.v") == 0.0


def test_groups_have_six_members_or_those_of_the_plane_in_order(card: SteeredCard) -> None:
    groups = {group.name: group for group in gunnerus_groups(interface(gunnerus_model(card)))}
    assert list(groups) == [
        *("thrust", "wave_forces", "current_velocity", "position_6dof", "position_3dof"),
        *("velocity_6dof", "velocity_3dof", "acceleration_6dof", "acceleration_3dof"),
    ]
    for name, group in groups.items():
        members = [[variable.name[-3:] for variable, _ in part.variables] for part in group.groups]
        plane = [["[1]", "[2]"], ["[6]"]]
        assert members == (plane if name.endswith("3dof") else [["[1]", "[2]", "[3]"], ["[4]", "[5]", "[6]"]])


@pytest.mark.slow
def test_the_fmu_has_the_name_and_the_variables_of_the_case(card: SteeredCard, tmp_path: Path) -> None:
    files = gunnerus_files(card).files
    for name, content in files.items():
        (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    described = fmpy.read_model_description(str(tmp_path / "VesselModel.fmu"))
    assert described.modelName == "VesselModel" and described.coSimulation is not None
    variables = {one.name: one for one in described.modelVariables}
    root = etree.parse(tmp_path / "VesselModel_OspModelDescription.xml").getroot()
    for one in root.iter(f"{GROUPS}Variable"):
        assert variables[one.get("ref")].causality in ("input", "output")
        assert variables[one.get("ref")].unit == one.get("unit")
    result = fmpy.simulate_fmu(
        str(tmp_path / "VesselModel.fmu"),
        stop_time=100.0,
        output_interval=0.1,
        fmi_type="CoSimulation",
        start_values={"Thrust[6]": 1e8, "Current_Velocity[1]": 0.1},
        output=["Vessel_Position[1]", "Vessel_Position[6]", "Vessel_Velocity[1]"],
    )
    assert result["Vessel_Position[6]"][-1] > 1e-3
    assert result["Vessel_Position[1]"][-1] == pytest.approx(10.0, abs=0.5)
    assert result["Vessel_Velocity[1]"][0] == pytest.approx(0.1)
