"""A ship as the hull of OSP's case gunnerus-dp: six-vectors in body axes, groups by position, a current of its own."""

from __future__ import annotations

import math
from pathlib import Path

import fmpy
import numpy as np
import pytest
from lxml import etree

from tank2sim.apps.programs.osp_case import gunnerus_files, gunnerus_groups, gunnerus_model
from tank2sim.cards import SteeredCard, read_card
from tank2sim.dynamics import build
from tank2sim.dynamics.simulator_interface import with_external_forces
from tank2sim.fmu.interface import interface
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.running import Running

GROUPS = "{https://open-simulation-platform.com/OspModelDescription/1.0.1}"
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
