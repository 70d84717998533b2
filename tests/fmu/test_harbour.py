"""Orders and surroundings of a harbour in co-simulation, next to the same model in Python."""

from __future__ import annotations

import zipfile
from pathlib import Path

import pytest
from fmpy.model_description import read_model_description

from tank2sim.dynamics.model import Model
from tank2sim.fmu.export import write_fmu
from tank2sim.fmu.running import running
from tank2sim.fmu.unpacking import UnpackedFmu
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.running import Running

from ..dynamics.effects.ships import N0, TYPICAL, T, ship, values

pytestmark = pytest.mark.slow

EFFECTS = ("waves", "other_ship", "twin_orders", "controllable_pitch", "loading")


@pytest.fixture(scope="module")
def model() -> Model:
    """The Mariner with all of them."""
    return ship({name: TYPICAL[name] for name in EFFECTS})


@pytest.fixture(scope="module", params=[pytest.param(2, marks=pytest.mark.long), 3])
def unpacked(request, model: Model, tmp_path_factory) -> UnpackedFmu:
    folder: Path = tmp_path_factory.mktemp("harbour")
    write_fmu(model, folder / "ship.fmu", fmi=request.param)
    with zipfile.ZipFile(folder / "ship.fmu") as archive:
        archive.extractall(folder)
    return UnpackedFmu(folder, read_model_description(str(folder), validate=False))


ORDERS = (
    {"propeller.pitch": 0.9, "propeller.starboard_offset": -0.3 * N0, "rudder.port_offset": 0.2},
    {
        "propeller.pitch": -0.5,
        "propeller.starboard_offset": 0.0,
        "waves.height": 3.0,
        "waves.direction": 1.2,
        "other_ship.forward": 30.0,
        "other_ship.starboard": -60.0,
        "other_ship.heading": 0.3,
        "other_ship.speed": 9.0,
    },
)
SHOWN = [
    *("motion.x", "motion.y", "motion.psi", "motion.u", "motion.v", "motion.r"),
    *("propeller.pitch_actual", "rudder.added_port"),
]
OUTPUTS = [
    *("waves.heave", "waves.roll", "pose.z", "propeller.speed_starboard", "rudder.angle_port", "validity_by.pitch"),
    *("loading.displacement", "validity_by.loading", "other_ship.clearance", "validity_by.other_ship"),
]


def test_ordered_propellers_pitch_and_seas_are_those_of_the_model(unpacked: UnpackedFmu, model: Model) -> None:
    start = {"loading.mean_draught": 0.95 * T, "loading.trim": 0.5}
    truth = Running(Integrator(model), ORDERS[0], start)
    with running(unpacked, "CoSimulation") as fmu:
        fmu.initialise({**start, **ORDERS[0]})
        for part, orders in enumerate(ORDERS):
            fmu.write(orders)
            truth.order(orders)
            for step in range(10):
                fmu.instance.doStep(currentCommunicationPoint=5.0 * part + 0.5 * step, communicationStepSize=0.5)
                truth.run(0.5)
        assert fmu.read(SHOWN) == pytest.approx([truth.state(name) for name in SHOWN], rel=1e-7, abs=1e-8)
        at = {name: truth.state(name) for name in model.state_names}
        expected = values(model, OUTPUTS, {**at, **start, **ORDERS[0], **ORDERS[1]})
        assert fmu.read(OUTPUTS) == pytest.approx(expected, rel=1e-6, abs=1e-7)
        assert abs(fmu.read(["waves.heave"])[0]) > 0.01
