"""Forces from outside: once on the right-hand side, about midships, and nothing when they are zero."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from fmpy.model_description import read_model_description

import tank2sim as t2s
from tank2sim.analysis.linearisation import OperatingPoint, state_space
from tank2sim.dynamics.model import Model
from tank2sim.dynamics.simulator_interface import external_inputs, with_external_forces
from tank2sim.errors import InputError
from tank2sim.fmu.running import running
from tank2sim.fmu.unpacking import FmuType, UnpackedFmu

from .effects.ships import TYPICAL, L, forces, ship, values

MANY = ("wind", "current", "shallow_water", "cross_flow_drag", "added_sway_mass", "roll_coupling", "flow_memory")
STILL = {"motion.u": 0.0, "propeller.speed": 0.0, "wind.speed": 0.0}
AHEAD = {"motion.u": 6.5, "motion.v": -0.4, "motion.r": 0.006, "rudder.angle": 0.2}
LINE = {"X": 2e5, "Y": -3e5, "N": 4e6, "x": 60.0, "y": -9.0}
ACCELERATIONS = ["motion.udot", "motion.vdot", "motion.rdot"]


@pytest.fixture(scope="module", params=[(), MANY], ids=["plain", "effects"])
def bare(request) -> Model:
    return ship({name: TYPICAL[name] for name in request.param})


def at(model: Model, place: dict[str, float], **line: float) -> dict[str, float]:
    return {name: value for name, value in (place | external_inputs(line)).items() if name in model}


def test_ship_at_rest_accelerates_by_force_over_mass_with_added_mass() -> None:
    """Mariner: m' = 798e-5, Xudot' = -42e-5 (Chislett and Strom-Tejsen 1965), and rho L^3/2."""
    model = with_external_forces(ship())
    mass = (798e-5 + 42e-5) * 0.5 * 1025.0 * L**3
    rest = values(model, ["motion.udot"], at(model, STILL))
    pushed = values(model, ["motion.udot"], at(model, STILL, X=1e5))
    assert (pushed - rest)[0] == pytest.approx(1e5 / mass, rel=1e-9)


@pytest.mark.parametrize("place", [STILL, AHEAD], ids=["at rest", "ahead"])
def test_force_at_a_point_adds_its_moment_about_midships_once(bare: Model, place: dict[str, float]) -> None:
    model = with_external_forces(bare)
    added = forces(model, at(model, place, **LINE)) - forces(bare, at(bare, place))
    expected = [2e5, -3e5, 4e6 + 60.0 * -3e5 - -9.0 * 2e5]
    np.testing.assert_allclose(added, expected, rtol=1e-7)


def test_accelerations_are_those_of_the_mass_matrix(bare: Model) -> None:
    model = with_external_forces(bare)
    names = [f"inertia.{name}" for name in ("surge", "sway", "sway_yaw", "yaw_sway", "yaw")]
    surge, sway, sway_yaw, yaw_sway, yaw = values(model, names, at(model, AHEAD))
    change = values(model, ACCELERATIONS, at(model, AHEAD, **LINE)) - values(model, ACCELERATIONS, at(model, AHEAD))
    matrix = [[surge, 0, 0], [0, sway, sway_yaw], [0, yaw_sway, yaw]]
    np.testing.assert_allclose(matrix @ change, [2e5, -3e5, -12.2e6], rtol=1e-6)


def test_zero_forces_change_no_rate_to_the_bit(bare: Model) -> None:
    model = with_external_forces(bare)
    x = np.array([at(bare, AHEAD).get(name, 0.0) for name in bare.state_names])
    found, before = (np.array(each.rhs(x, each.input_values(), each.parameter_values())) for each in (model, bare))
    assert np.array_equal(found, before)


def test_linearisation_has_the_inverse_mass_as_gain() -> None:
    model = with_external_forces(ship())
    x = np.array([6.0 if name == "motion.u" else 0.0 for name in model.state_names])
    point = OperatingPoint(x, model.input_values(), model.parameter_values())
    linear = state_space(model, point, states=["motion.u"], inputs=["external.X"], outputs=["motion.u"])
    assert linear.B[0, 0] == pytest.approx(1 / (840e-5 * 0.5 * 1025.0 * L**3), rel=1e-9)


def test_simulation_without_forces_is_the_same_and_a_tug_turns_the_ship() -> None:
    mariner = t2s.load("mariner")
    plain, zero, tug = (
        mariner.simulate("turn:1", duration_s=60.0, external=given)
        for given in (None, {"X": 0.0}, {"Y": 3e5, "x": 70.0})
    )
    assert np.array_equal(plain.run.trajectory["motion.u"], zero.run.trajectory["motion.u"])
    assert tug.run.trajectory["motion.psi"][-1] - plain.run.trajectory["motion.psi"][-1] > 0.01


def test_unknown_force_and_a_force_on_an_ensemble_are_refused() -> None:
    mariner = t2s.load("mariner")
    with pytest.raises(InputError):
        mariner.simulate("turn:10", external={"K": 1.0})
    with pytest.raises(InputError):
        mariner.simulate("turn:10", external={"X": 1.0}, members=3)


@pytest.mark.slow
@pytest.mark.parametrize("fmi", [pytest.param(2, marks=pytest.mark.slow), 3])
def test_fmu_has_the_inputs_and_accelerates_as_the_model(fmi: int, tmp_path: Path) -> None:
    mariner = t2s.load("mariner")
    mariner.to_fmu(tmp_path / "ship.fmu", fmi=fmi)
    assert t2s.check_fmu(tmp_path / "ship.fmu").passed
    with zipfile.ZipFile(tmp_path / "ship.fmu") as archive:
        archive.extractall(tmp_path)
    unpacked = UnpackedFmu(tmp_path, read_model_description(str(tmp_path), validate=False))
    model = with_external_forces(mariner.model)
    place = {"motion.u": 6.0}
    expected = values(model, ACCELERATIONS, at(model, place, **LINE))
    for kind in get_args(FmuType):
        with running(unpacked, kind) as fmu:
            fmu.initialise({"initial.u": 6.0, **external_inputs(LINE)})
            if kind == "ModelExchange":
                fmu.update()
            np.testing.assert_allclose(fmu.read(ACCELERATIONS), expected, rtol=1e-12)


def test_the_point_of_a_force_is_apart_from_the_force_also_without_case() -> None:
    assert external_inputs({"X": 1.0, "x": 2.0, "y": 3.0}) == {
        **{"external.X": 1.0, "external.point_x": 2.0, "external.point_y": 3.0}
    }
    assert external_inputs({"K": 4.0, "z": -5.0}, rolls=True) == {"external.K": 4.0, "external.point_z": -5.0}
    for name in ("K", "z", "point_x", "XX"):
        with pytest.raises(InputError, match=f"external: {name}: is not an external force"):
            external_inputs({name: 1.0})
