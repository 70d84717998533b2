"""The SSP package: a ship on the heading that its autopilot keeps, in every engine that reads SSP."""

from __future__ import annotations

import json
import math
import subprocess
import sys
import zipfile
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import fmpy
import numpy as np
import pytest
from fmpy.ssp.simulation import simulate_ssp
from fmpy.ssp.ssd import read_ssd
from fmpy.validation import validate_fmu
from scipy.integrate import solve_ivp

from tank2sim.analysis.heading.designs import design_heading
from tank2sim.dynamics.model import Model
from tank2sim.fmu.export import ExportedFmu
from tank2sim.fmu.ssp import ship_with_autopilot
from tank2sim.simulation.scheme import runge_kutta_step
from tests.fmu.driving import ShipFmu
from tests.fmu.engines import reason_to_skip

from ..cli.command_line import refused, tank2sim

STEP_S, END_S = 0.5, 900.0
COURSE = math.radians(20.0)


@pytest.fixture(scope="module")
def run(mariner_ssp: Path) -> np.ndarray:
    """A change of course by 20 deg in fmpy."""
    order = SimpleNamespace(parameters=[SimpleNamespace(name="autopilot.heading.command", value=COURSE)])
    return simulate_ssp(str(mariner_ssp), stop_time=END_S, step_size=STEP_S, parameter_set=order)


class Joined:
    """The ship and its autopilot in one right-hand side."""

    def __init__(self, ship: Model):
        self.ship, self.pilot = ship, design_heading(ship).autopilot
        self.p, self.pilot_p = ship.parameter_values(), self.pilot.parameter_values()
        self.rudder = ship.input_names.index("rudder.command")
        self.seen = [ship.state_names.index(name) for name in ("motion.psi", "motion.r")]
        self.start = np.append(np.array(ship.initial(self.p)).ravel(), 0.0)

    def order(self, x: np.ndarray) -> tuple[list[float], float]:
        given = [*x[self.seen], COURSE]
        return given, float(self.pilot.output(x[-1:], given, self.pilot_p)[0])

    def inputs(self, order: float) -> np.ndarray:
        u = self.ship.input_values()
        u[self.rudder] = order
        return u

    def rate(self, _: float, x: np.ndarray) -> np.ndarray:
        given, order = self.order(x)
        moved = np.array(self.ship.rhs(x[:-1], self.inputs(order), self.p)).ravel()
        return np.append(moved, float(self.pilot.rhs(x[-1:], given, self.pilot_p)))


@pytest.mark.slow
def test_the_package_is_valid(mariner_ssp: Path, tmp_path: Path) -> None:
    description = read_ssd(str(mariner_ssp))  # holds it against the schema of SSP 1.0
    assert [part.name for part in description.system.elements] == ["ship", "autopilot"]
    joints = {(c.startElement, c.startConnector, c.endElement, c.endConnector) for c in description.system.connections}
    assert joints == {
        ("autopilot", "rudder.command", "ship", "rudder.command"),
        ("ship", "motion.psi", "autopilot", "motion.psi"),
        ("ship", "motion.r", "autopilot", "motion.r"),
    }
    with zipfile.ZipFile(mariner_ssp) as archive:
        assert archive.namelist() == ["SystemStructure.ssd", "resources/autopilot.fmu", "resources/ship.fmu"]
        archive.extractall(tmp_path)
    assert validate_fmu(str(tmp_path / "resources" / "autopilot.fmu")) == []


def test_a_course_change_settles_without_an_error_that_stays(run: np.ndarray) -> None:
    heading = np.degrees(run["ship.motion.psi"])
    assert heading[-1] == pytest.approx(20.0, abs=0.1)
    assert heading.max() < 22.0
    # The rudder that holds the course is not amidships (Y0, N0): the integral holds it.
    assert abs(math.degrees(run["ship.rudder.angle"][-1])) > 0.05


def test_it_agrees_with_the_closed_loop_without_communication_steps(mariner: Model, run: np.ndarray) -> None:
    loop = Joined(mariner)
    times = run["time"] + STEP_S  # fmpy writes what was found at the end of a step next to its beginning
    truth = solve_ivp(loop.rate, (0, times[-1]), loop.start, "LSODA", t_eval=times, rtol=1e-8, atol=1e-10)
    heading = truth.y[loop.seen[0]]
    # Signals are a communication step or two old: 0.5 s in a loop of 24 s.
    assert np.degrees(np.abs(run["ship.motion.psi"] - heading)).max() < 0.35
    assert np.degrees(abs(run["ship.motion.psi"][-1] - heading[-1])) < 0.01


def test_it_is_to_the_digit_the_exchange_of_two_models(mariner: Model, run: np.ndarray) -> None:
    loop, count = Joined(mariner), 400
    steps = round(STEP_S / mariner.step_s)
    assert steps * mariner.step_s == pytest.approx(STEP_S)
    ship, pilot = runge_kutta_step(mariner), runge_kutta_step(loop.pilot)
    x, z = loop.start[:-1], loop.start[-1:]
    order, seen, found = 0.0, [0.0, 0.0], []
    for _ in range(count):
        given = [*seen, COURSE]
        for _ in range(steps):
            x = np.array(ship(x, loop.inputs(order), loop.p, mariner.step_s)).ravel()
            z = np.array(pilot(z, given, loop.pilot_p, mariner.step_s)).ravel()
        order, seen = float(loop.pilot.output(z, given, loop.pilot_p)[0]), list(x[loop.seen])
        found.append(seen[0])
    np.testing.assert_allclose(run["ship.motion.psi"][:count], found, rtol=0, atol=1e-9)


_ECOS = """
import sys
from ecospy import EcosSimulation
with EcosSimulation(ssp_path=sys.argv[1], step_size=float(sys.argv[2])) as run:
    run.init()
    run.set_real("autopilot::heading.command", float(sys.argv[3]))
    run.step(1800)
    print("heading", run.get_real("ship::motion.psi"))
"""

_LIBCOSIM = """
import sys
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimManipulator import CosimManipulator
from libcosimpy.CosimObserver import CosimObserver
run = CosimExecution.from_ssp_file(ssp_path=sys.argv[1], step_size=int(float(sys.argv[2]) * 1e9))
names = {info.name.decode(): info.index for info in run.slave_infos()}
def reference(slave, name):
    variables = run.slave_variables(names[slave])
    return next(one.reference for one in variables if one.name.decode() == name)
manipulator, observer = CosimManipulator.create_override(), CosimObserver.create_last_value()
run.add_manipulator(manipulator), run.add_observer(observer)
pilot, ship = reference("autopilot", "heading.command"), reference("ship", "motion.psi")
manipulator.slave_real_values(names["autopilot"], [pilot], [float(sys.argv[3])])
run.step(1800)
print("heading", observer.last_real_values(names["ship"], [ship])[0])
"""


def every_input(mariner: Model, made: Path) -> bytes:
    exported = ExportedFmu(content=made.read_bytes(), fmi=2, model_identifier="x", token="", platforms=())
    return ship_with_autopilot(mariner, exported, every_input=True)


@pytest.mark.slow
def test_every_input_may_be_a_connector(mariner: Model, mariner_fmu: ShipFmu, tmp_path: Path, run: np.ndarray) -> None:
    package = tmp_path / "open.ssp"
    package.write_bytes(every_input(mariner, mariner_fmu(2)))
    description = read_ssd(str(package))  # holds it against the schema of SSP 1.0
    assert len(description.system.connections) == 3
    with zipfile.ZipFile(package) as archive:
        archive.extractall(tmp_path)
    for part in description.system.elements:
        variables = fmpy.read_model_description(str(tmp_path / "resources" / f"{part.name}.fmu")).modelVariables
        shown = {(one.causality, one.name) for one in variables if one.causality in ("input", "output")}
        assert shown == {(one.kind, one.name) for one in part.connectors}
        assert ("input", "external.Y") in shown or part.name == "autopilot"
    if not reason_to_skip("libcosimpy"):
        command = [sys.executable, "-c", _LIBCOSIM, str(package), str(STEP_S), str(COURSE)]
        ended = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
        heading = float(next(line.split()[1] for line in ended.stdout.splitlines() if line.startswith("heading")))
        assert heading == pytest.approx(run["ship.motion.psi"][-1], abs=math.radians(0.02))


def test_all_connectors_are_those_of_a_package(tmp_path: Path) -> None:
    refused(tank2sim("export", "mariner", "-o", "m.fmu", "--ssp-inputs", cwd=tmp_path), "--ssp-inputs")


@pytest.mark.slow
@pytest.mark.parametrize(("engine", "script"), [("ecospy", _ECOS), ("libcosimpy", _LIBCOSIM)])
def test_other_engines_come_to_the_same_heading(engine: str, script: str, mariner_ssp: Path, run: np.ndarray) -> None:
    if reason := reason_to_skip(engine):
        pytest.skip(reason)
    command = [sys.executable, "-c", script, str(mariner_ssp), str(STEP_S), str(COURSE)]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    words = [line.split()[1] for line in ended.stdout.splitlines() if line.startswith("heading")]
    assert words, f"{engine} ended with {ended.returncode}: {ended.stderr[-500:]}"
    assert math.degrees(float(words[0])) == pytest.approx(math.degrees(run["ship.motion.psi"][-1]), abs=0.02)


@pytest.mark.slow
def test_the_command_writes_the_package_next_to_the_fmu(tmp_path: Path) -> None:
    ended = tank2sim("export", "kvlcc2-captive", "-o", "k.fmu", "--ssp", "k.ssp", "--json", "k.json", cwd=tmp_path)
    assert ended.returncode == 0, ended.stderr
    assert json.loads((tmp_path / "k.json").read_text())["ssp"] == "k.ssp"
    with zipfile.ZipFile(tmp_path / "k.ssp") as archive:
        assert archive.read("resources/ship.fmu") == (tmp_path / "k.fmu").read_bytes()


@pytest.mark.slow
def test_what_has_no_rudder_has_no_autopilot(tmp_path: Path) -> None:
    refused(tank2sim("export", "wilinski-zellman", "-o", "w.fmu", "--ssp", "w.ssp", cwd=tmp_path), "has no rudder")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_names_of_a_card_cannot_break_the_package(mariner: Model, tmp_path: Path) -> None:
    name = "*/ ../../x \x00\x07 ]]> <a b='\"'> & C:\\NUL 船 \ud800 {{ 7 }}"
    ship = replace(mariner, name=name, description=name)
    made = ExportedFmu(content=b"", fmi=2, model_identifier="x", token="", platforms=())
    (tmp_path / "x.ssp").write_bytes(ship_with_autopilot(ship, made))
    with zipfile.ZipFile(tmp_path / "x.ssp") as archive:
        assert archive.namelist() == ["SystemStructure.ssd", "resources/autopilot.fmu", "resources/ship.fmu"]
    assert "船" in read_ssd(str(tmp_path / "x.ssp")).name
