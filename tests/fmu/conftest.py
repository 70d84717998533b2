"""Small models with everything an FMU must cope with, and one FMU of each exported once for all tests."""

from __future__ import annotations

import contextlib
import math
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import casadi as ca
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.model_description import read_model_description

from tank2sim.cards import ManoeuvringCard
from tank2sim.dynamics import build
from tank2sim.dynamics.model import Input, Model, Parameter, Quantity, State
from tank2sim.dynamics.simulator_interface import with_simulator_interface
from tank2sim.files import write_whole
from tank2sim.fmu.export import ExportedFmu, write_fmu
from tank2sim.fmu.provenance import documents_of
from tank2sim.fmu.running import RunningFmu, running
from tank2sim.fmu.ssp import ship_with_autopilot
from tank2sim.fmu.unpacking import UnpackedFmu
from tests.fmu.driving import Instantiate, Slave, begun


def tunable(name: str, start: float, unit: str = "1") -> Parameter:
    return Parameter(name=name, unit=unit, description=f"Coefficient {name}", start=start, nominal=abs(start) or 1)


def fixed(name: str, start: float, unit: str = "1", boolean: bool = False) -> Parameter:
    return Parameter(name=name, unit=unit, description=f"Fixed {name}", start=start, tunable=False, boolean=boolean)


def state(name: str, unit: str, derivative: str, start: ca.SX | float, **more: Any) -> State:
    return State(name=name, unit=unit, description=f"State {name}", derivative=derivative, start=start, **more)


def quantity(name: str, unit: str, value: ca.SX | float) -> Quantity:
    return Quantity(name=name, unit=unit, description=f"Quantity {name}", value=ca.SX(value))


def steered_hull(name: str = "Test hull") -> Model:
    """A hull with linear sway and yaw, quadratic surge, a rate-limited rudder that can fail, and a steady motion."""
    inputs = (
        Input(
            "rudder.command",
            "rad",
            "Rudder order, + to starboard",
            minimum=-0.6,
            maximum=0.6,
            display_unit="deg",
            nominal=0.3,
        ),
        Input("propeller.speed", "rad/s", "Revolutions", start=1.0, display_unit="rpm"),
        Input("steering.failed", "1", "True: the rudder stays where it is", boolean=True),
    )
    order, revolutions, failed = (variable.symbol for variable in inputs)
    parameters = (
        tunable("derivatives.drag", 0.002),
        tunable("derivatives.thrust", 0.1),
        tunable("derivatives.Yv", -0.12),
        tunable("derivatives.Yr", -0.9),
        tunable("derivatives.Nv", -0.002),
        tunable("derivatives.Nr", -0.11),
        tunable("derivatives.Nd", 0.012),
        tunable("derivatives.Nvvv", -0.003),
        fixed("steering.max_rate", math.radians(5.0), "rad/s"),
        fixed("initial.psi", 0.1, "rad"),
        fixed("initial.u", 7.0, "m/s"),
        fixed("initial.trim", 0.0, boolean=True),
    )
    p = {parameter.name: parameter.symbol for parameter in parameters}
    d = {name.removeprefix("derivatives."): symbol for name, symbol in p.items()}
    states = (
        state("motion.x", "m", "motion.xdot", 0.0, nominal=100.0),
        state("motion.y", "m", "motion.ydot", 0.0, nominal=100.0),
        state("motion.psi", "rad", "motion.psidot", p["initial.psi"], display_unit="deg"),
        state("motion.u", "m/s", "motion.udot", p["initial.u"], steady=True, display_unit="knots", nominal=7.0),
        state("motion.v", "m/s", "motion.vdot", 0.0, steady=True),
        state("motion.r", "rad/s", "motion.rdot", 0.0, steady=True, display_unit="deg/min", nominal=0.01),
        state("rudder.angle", "rad", "rudder.rate", 0.0, trim=order, display_unit="deg", nominal=0.3),
    )
    _, _, psi, u, v, r, delta = (variable.symbol for variable in states)
    limit = p["steering.max_rate"]
    yaw = d["Nv"] * v + d["Nr"] * r + d["Nd"] * delta * u / 7 + d["Nvvv"] * v**3
    quantities = (
        quantity("motion.xdot", "m/s", u * ca.cos(psi) - v * ca.sin(psi)),
        quantity("motion.ydot", "m/s", u * ca.sin(psi) + v * ca.cos(psi)),
        quantity("motion.psidot", "rad/s", r),
        quantity("motion.udot", "m/s2", d["thrust"] * revolutions - d["drag"] * u * ca.fabs(u) + 0.3 * v * r),
        quantity("motion.vdot", "m/s2", d["Yv"] * v + d["Yr"] * r * u / 7 + 0.05 * delta),
        quantity("motion.rdot", "rad/s2", yaw),
        quantity("rudder.rate", "rad/s", ca.fmax(-limit, ca.fmin(limit, order - delta)) * (1 - failed)),
        quantity("motion.speed", "m/s", ca.sqrt(u**2 + v**2)),
        quantity("motion.beta", "rad", -ca.asin(v / ca.sqrt(u**2 + v**2))),
        quantity("force.N", "N.m", 1e6 * d["Nd"] * delta),
        quantity("rudder.demand", "rad", order - delta),
    )
    return Model(
        name=name,
        description="A steered hull for tests",
        states=states,
        inputs=inputs,
        parameters=parameters,
        quantities=quantities,
        outputs=(
            *("motion.x", "motion.y", "motion.psi", "motion.u", "motion.v", "motion.r", "motion.speed", "motion.beta"),
            *("motion.udot", "motion.rdot", "rudder.angle", "force.N", "rudder.demand"),
        ),
        step_s=0.1,
    )


def coasting_body() -> Model:
    """Surge without inputs and without trim; the derivative of its position is its other state."""
    drag, start = tunable("drag", 0.05), fixed("initial.u", 2.0, "m/s")
    position = state("motion.x", "m", "motion.u", 0.0)
    speed = state("motion.u", "m/s", "motion.udot", start.symbol)
    return Model(
        name="Body",
        description="A body that slows down",
        states=(position, speed),
        parameters=(drag, start),
        quantities=(quantity("motion.udot", "m/s2", -drag.symbol * speed.symbol**2),),
        outputs=("motion.x", "motion.u"),
        step_s=0.2,
    )


def gain() -> Model:
    """No states at all, and no parameters: an output that follows its input."""
    order = Input("command", "rad", "Order")
    return Model(
        name="Gain",
        description="Twice the input",
        inputs=(order,),
        quantities=(quantity("answer", "rad", 2 * order.symbol),),
        outputs=("answer",),
        step_s=0.5,
    )


MODELS: dict[str, Callable[[], Model]] = {"hull": steered_hull, "body": coasting_body, "gain": gain}


@pytest.fixture(scope="session")
def models() -> dict[str, Model]:
    """The small models: a hull with everything, a body without inputs, a gain without states or parameters."""
    return {name: make() for name, make in MODELS.items()}


@pytest.fixture(scope="session")
def hull(models: dict[str, Model]) -> Model:
    return models["hull"]


@pytest.fixture(scope="session")
def fmu_file(models: dict[str, Model], session_folder: Path) -> Callable[[str, int], Path]:
    """The FMU of a small model in a version of FMI, exported once; whoever needs it first writes it, whole."""

    def file(name: str, fmi: int) -> Path:
        path = session_folder / f"{name}{fmi}.fmu"
        if not path.exists():
            write_fmu(models[name], path, fmi=fmi)
        return path

    return file


@pytest.fixture(scope="session")
def mariner(mariner_card: ManoeuvringCard) -> Model:
    """The model of which FMUs of this ship are made."""
    return with_simulator_interface(build(mariner_card))


@pytest.fixture(scope="session")
def mariner_fmu(mariner: Model, mariner_card: ManoeuvringCard, session_folder: Path) -> Callable[[int], Path]:
    """The FMU of a bundled ship in a version of FMI, with all that its card says, exported once."""

    def file(fmi: int) -> Path:
        path = session_folder / f"mariner{fmi}.fmu"
        if not path.exists():
            write_fmu(mariner, path, fmi=fmi, documents=documents_of(mariner_card))
        return path

    return file


@pytest.fixture(scope="session")
def mariner_ssp(mariner: Model, mariner_fmu: Callable[[int], Path], session_folder: Path) -> Path:
    """The SSP package of the same ship, FMI 2."""
    path = session_folder / "mariner.ssp"
    if not path.exists():
        content = mariner_fmu(2).read_bytes()
        made = ExportedFmu(content=content, fmi=2, model_identifier="mariner2", token="", platforms=())
        write_whole(path, ship_with_autopilot(mariner, made))
    return path


@pytest.fixture(scope="session")
def unpacked(
    fmu_file: Callable[[str, int], Path], tmp_path_factory: pytest.TempPathFactory
) -> Callable[[str, int], UnpackedFmu]:
    """The same, unpacked once."""
    made: dict[tuple[str, int], UnpackedFmu] = {}

    def folder(name: str, fmi: int) -> UnpackedFmu:
        if (name, fmi) not in made:
            target = tmp_path_factory.mktemp(f"{name}{fmi}")
            with zipfile.ZipFile(fmu_file(name, fmi)) as archive:
                archive.extractall(target)
            made[name, fmi] = UnpackedFmu(target, read_model_description(str(target), validate=False))
        return made[name, fmi]

    return folder


@pytest.fixture
def instantiate(unpacked: Callable[[str, int], UnpackedFmu]) -> Iterator[Callable[..., RunningFmu]]:
    """Make an instance (name of the model, FMI version, kind), which is freed after the test."""
    with contextlib.ExitStack() as stack:

        def make(name: str, fmi: int, kind: str, **more: Any) -> RunningFmu:
            return stack.enter_context(running(unpacked(name, fmi), kind, **more))  # type: ignore[arg-type]

        yield make


@pytest.fixture(scope="session", params=[2, 3])
def fmi(request: pytest.FixtureRequest) -> int:
    """Both versions of FMI: a test that takes this runs with each."""
    version: int = request.param
    return version


@pytest.fixture
def slave(fmi: int, instantiate: Instantiate) -> Slave:
    """Make an instance of the hull for Co-Simulation that has begun with these inputs (a dot as two underscores)."""
    return lambda **inputs: begun(instantiate("hull", fmi, "CoSimulation"), **inputs)


@pytest.fixture
def status() -> Callable[..., int]:
    """The status with which a call through FMPy ends: 0 OK or Warning, 2 Discard, 3 Error."""

    def call(function: Callable[..., Any], *arguments: Any) -> int:
        try:
            function(*arguments)
        except FMICallException as error:
            return int(error.status)
        return 0

    return call
