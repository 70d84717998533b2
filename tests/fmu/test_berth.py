"""Driven ships in FMUs: from the berth, ahead, astern, trimmed, and with the orders and surroundings of a harbour."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from fmpy.model_description import read_model_description

from tank2sim.dynamics.model import Model
from tank2sim.fmu.export import write_fmu
from tank2sim.fmu.running import running
from tank2sim.fmu.unpacking import FmuType, UnpackedFmu
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.running import Running

from ..dynamics.effects.ships import N0, TYPICAL, U0, T, ship, values

pytestmark = pytest.mark.slow

KINDS = get_args(FmuType)


@pytest.fixture(scope="module")
def driven() -> Model:
    """The Mariner with propulsion, in a current and a wind."""
    return ship({"current": TYPICAL["current"], "wind": TYPICAL["wind"]})


@pytest.fixture(scope="module", params=[2, pytest.param(3, marks=pytest.mark.slow)])
def unpacked_ship(request, driven: Model, tmp_path_factory) -> UnpackedFmu:
    folder: Path = tmp_path_factory.mktemp("berth")
    write_fmu(driven, folder / "ship.fmu", fmi=request.param)
    with zipfile.ZipFile(folder / "ship.fmu") as archive:
        archive.extractall(folder)
    return UnpackedFmu(folder, read_model_description(str(folder), validate=False))


OUTPUTS = ("motion.u", "motion.v", "motion.r", "motion.psi", "motion.speed", "motion.beta", "motion.sog", "validity")
AT_REST = {"initial.u": 0.0, "current.speed": 0.0, "wind.speed": 0.0, "propeller.speed": 0.0}


@pytest.mark.parametrize("kind", KINDS)
def test_at_the_berth_all_is_at_rest_and_every_derivative_is_a_number(unpacked_ship, driven, kind: FmuType) -> None:
    with running(unpacked_ship, kind) as fmu:
        fmu.initialise(AT_REST)
        if kind == "ModelExchange":
            fmu.update()
        assert fmu.read(OUTPUTS) == pytest.approx([0.0] * len(OUTPUTS), abs=1e-6)
        assert np.isfinite(fmu.read(driven.outputs)).all()
        names = [*(state.derivative for state in driven.states), *driven.outputs]
        unknowns = unpacked_ship.references([name for name in names if name not in driven.state_names])
        knowns = ["rudder.command", "propeller.speed"]
        knowns += driven.state_names if kind == "ModelExchange" else ["derivatives.Yv"]
        for known in knowns:
            slopes = fmu.instance.getDirectionalDerivative(unknowns, unpacked_ship.references([known]), [1.0])
            assert np.isfinite(slopes).all(), known


def test_from_the_berth_ahead_and_then_astern(unpacked_ship) -> None:
    with running(unpacked_ship, "CoSimulation") as fmu:
        fmu.initialise(AT_REST)
        speeds = []
        for place in range(900):
            if place in (0, 300):
                fmu.write({"propeller.speed": N0 if place == 0 else -N0, "rudder.command": 0.2})
            fmu.instance.doStep(currentCommunicationPoint=float(place), communicationStepSize=1.0)
            speeds.append(fmu.read(OUTPUTS))
        motion = np.array(speeds)
    assert np.isfinite(motion).all()
    assert 0.3 * U0 < motion[299, 0] < U0 and motion[299, 3] > 0
    assert motion[-1, 0] < -0.1 * U0 and motion[-1, -1] == 0.0


@pytest.mark.parametrize("share", [1.0, 0.3, 0.0])
def test_a_start_in_steady_motion_is_that_of_the_model(unpacked_ship, driven, share: float) -> None:
    """With propulsion, current and wind."""
    start, inputs = {"initial.trim": 1.0, "initial.u": share * U0}, {"propeller.speed": share * N0, "wind.speed": 5.0}
    expected = Running(Integrator(driven), inputs, start)
    with running(unpacked_ship, "CoSimulation") as fmu:
        fmu.initialise({**start, **inputs})
        assert fmu.read(OUTPUTS[:3]) == pytest.approx([expected.state(name) for name in OUTPUTS[:3]], rel=1e-9)
        before = fmu.read(OUTPUTS[:1])
        fmu.instance.doStep(currentCommunicationPoint=0.0, communicationStepSize=0.1)
        assert fmu.read(OUTPUTS[:1]) == pytest.approx(before, abs=1e-5)


@pytest.mark.parametrize(
    ("name", "value"), [("water.depth", 7.0), ("water.depth", 0.0), ("water.depth", -3.0), ("propeller.speed", 90.0)]
)
def test_no_ship_sails_aground_or_with_revolutions_in_rpm(name: str, value: float, aground: UnpackedFmu) -> None:
    """The draught is 7.468 m, the nominal revolutions 8.8 rad/s."""
    log: list[str] = []
    with running(aground, "CoSimulation", log=log) as fmu, pytest.raises(Exception, match="discard"):
        fmu.initialise({name: value})
    assert len(log) == 1 and name in log[0]


@pytest.fixture(scope="module")
def aground(tmp_path_factory) -> UnpackedFmu:
    folder: Path = tmp_path_factory.mktemp("aground")
    write_fmu(ship({"water_depth": TYPICAL["water_depth"]}), folder / "ship.fmu", fmi=2)
    with zipfile.ZipFile(folder / "ship.fmu") as archive:
        archive.extractall(folder)
    return UnpackedFmu(folder, read_model_description(str(folder), validate=False))


class Lines:
    """What an FMU has logged."""

    def __init__(self, fmu) -> None:
        self.fmu = fmu

    def with_text(self, text: str) -> list[str]:
        return [line for line in self.fmu.log if text in line]


def test_each_cause_of_a_lower_validity_is_logged_once(unpacked_ship) -> None:
    with running(unpacked_ship, "CoSimulation") as fmu:
        fmu.initialise({"rudder.command": 0.6, "wind.speed": 0.0, "current.speed": 0.0})
        for place in range(300):
            fmu.instance.doStep(currentCommunicationPoint=float(place), communicationStepSize=1.0)
            if place == 0:
                assert fmu.read(["validity"]) == [1.0] and not Lines(fmu).with_text("validity_by")
            if place == 200:
                fmu.write({"propeller.speed": -N0})
            validity, *factors = fmu.read(["validity", *FACTORS])
            assert validity == pytest.approx(np.prod(factors), abs=1e-12)
        logged = {name: len(Lines(fmu).with_text(name)) for name in FACTORS}
    assert logged["validity_by.low_speed"] == 1
    assert set(logged.values()) <= {0, 1}


FACTORS = [f"validity_by.{cause}" for cause in ("low_speed", "high_speed", "drift", "yaw_rate", "rudder")]


def test_an_input_beyond_its_bounds_is_refused_or_held_as_a_parameter_says(unpacked_ship) -> None:
    """90 is an order in rpm where rad/s belong."""
    with running(unpacked_ship, "CoSimulation") as fmu:
        fmu.initialise({})
        with pytest.raises(Exception, match="fmi"):
            fmu.write({"propeller.speed": 90.0})
        assert fmu.read(["propeller.speed"]) == pytest.approx([N0])
    with running(unpacked_ship, "CoSimulation") as fmu:
        fmu.initialise({"solver.clamp_inputs": True})
        for order in (90.0, -90.0, 95.0):
            fmu.write({"propeller.speed": order})
            assert fmu.read(["propeller.speed"]) == pytest.approx([np.sign(order) * 3 * N0])
        assert len(Lines(fmu).with_text("propeller.speed = 90 is held at")) == 1
        assert len(Lines(fmu).with_text("is held at")) == 1
        with pytest.raises(Exception, match="fmi"):
            fmu.write({"current.speed": float("nan")})


EFFECTS = ("waves", "other_ship", "twin_orders", "controllable_pitch", "loading")


@pytest.fixture(scope="module")
def harbour() -> Model:
    """The Mariner with all of them."""
    return ship({name: TYPICAL[name] for name in EFFECTS})


@pytest.fixture(scope="module", params=[pytest.param(2, marks=pytest.mark.long), 3])
def harbour_fmu(request, harbour: Model, tmp_path_factory) -> UnpackedFmu:
    folder: Path = tmp_path_factory.mktemp("harbour")
    write_fmu(harbour, folder / "ship.fmu", fmi=request.param)
    with zipfile.ZipFile(folder / "ship.fmu") as archive:
        archive.extractall(folder)
    return UnpackedFmu(folder, read_model_description(str(folder), validate=False))


HARBOUR_ORDERS = (
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
HARBOUR_OUTPUTS = [
    *("waves.heave", "waves.roll", "pose.z", "propeller.speed_starboard", "rudder.angle_port", "validity_by.pitch"),
    *("loading.displacement", "validity_by.loading", "other_ship.clearance", "validity_by.other_ship"),
]


def test_ordered_propellers_pitch_and_seas_are_those_of_the_model(harbour_fmu: UnpackedFmu, harbour: Model) -> None:
    start = {"loading.mean_draught": 0.95 * T, "loading.trim": 0.5}
    truth = Running(Integrator(harbour), HARBOUR_ORDERS[0], start)
    with running(harbour_fmu, "CoSimulation") as fmu:
        fmu.initialise({**start, **HARBOUR_ORDERS[0]})
        for part, orders in enumerate(HARBOUR_ORDERS):
            fmu.write(orders)
            truth.order(orders)
            for step in range(10):
                fmu.instance.doStep(currentCommunicationPoint=5.0 * part + 0.5 * step, communicationStepSize=0.5)
                truth.run(0.5)
        assert fmu.read(SHOWN) == pytest.approx([truth.state(name) for name in SHOWN], rel=1e-7, abs=1e-8)
        at = {name: truth.state(name) for name in harbour.state_names}
        expected = values(harbour, HARBOUR_OUTPUTS, {**at, **start, **HARBOUR_ORDERS[0], **HARBOUR_ORDERS[1]})
        assert fmu.read(HARBOUR_OUTPUTS) == pytest.approx(expected, rel=1e-6, abs=1e-7)
        assert abs(fmu.read(["waves.heave"])[0]) > 0.01
