"""Fit for a training simulator: start anywhere and again, tune while running, see where the ship is."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from scipy.integrate import solve_ivp

from tank2sim.cards import ManoeuvringCard, parse_card
from tank2sim.dynamics import build
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tank2sim.fmu.interface import interface
from tank2sim.fmu.running import RunningFmu, running
from tank2sim.fmu.unpacking import unpack
from tank2sim.simulation.manoeuvres import Turn
from tank2sim.simulation.run import simulate
from tests.fmu.driving import ShipFmu

TUNED = {"derivatives.Nr": -0.004, "derivatives.Xu": -0.004}
COMMAND = math.radians(20.0)


@pytest.fixture
def start(mariner_fmu: ShipFmu, tmp_path: Path) -> Iterator[Callable[[int, str], RunningFmu]]:
    """Instances of the Mariner (FMI version, kind), freed after the test."""
    with ExitStack() as stack:

        def make(fmi: int, kind: str) -> RunningFmu:
            unpacked = unpack(mariner_fmu(fmi), tmp_path / f"{fmi}")
            return stack.enter_context(running(unpacked, kind))  # type: ignore[arg-type]

        yield make


def initialise(fmu: RunningFmu, values: dict[str, float]) -> None:
    fmu.write(values)
    fmu.initialise({"rudder.command": COMMAND})


ANYWHERE = {
    "initial.x": 1200.0,
    "initial.y": -340.0,
    "initial.psi": math.radians(217.0),
    "initial.u": 5.5,
    "initial.v": -0.3,
    "initial.r": 0.004,
    "initial.rudder_angle": math.radians(-12.0),
    "origin.latitude": math.radians(54.4),
    "origin.longitude": math.radians(18.6),
}


def test_a_ship_starts_anywhere_and_again(fmi: int, start: Callable[[int, str], RunningFmu]) -> None:
    fmu = start(fmi, "CoSimulation")
    shown = ["motion.x", "motion.y", "motion.psi", "motion.u", "motion.v", "motion.r", "rudder.angle"]
    runs = []
    for values in (ANYWHERE, ANYWHERE | {"initial.x": 0.0}, ANYWHERE):
        initialise(fmu, values)
        assert fmu.read(shown) == [values[name] for name in list(ANYWHERE)[:7]]
        latitude, longitude = fmu.read(["position.latitude", "position.longitude"])
        assert latitude == pytest.approx(math.radians(54.4) + values["initial.x"] / 6.383e6, abs=2e-7)
        assert longitude == pytest.approx(math.radians(18.6) - 340.0 / 6.392e6 / math.cos(latitude), abs=2e-7)
        for step in range(20):
            fmu.instance.doStep(currentCommunicationPoint=0.5 * step, communicationStepSize=0.5)
        runs.append(fmu.read(shown))
        fmu.instance.terminate()
        fmu.instance.reset()
    assert runs[0] == runs[2]
    assert runs[1][0] == pytest.approx(runs[0][0] - 1200.0)
    assert runs[1][1:] == pytest.approx(runs[0][1:])


def continued(model: Model, x: np.ndarray, times: tuple[float, float], changed: dict[str, float]) -> np.ndarray:
    """States at the end, integrated by LSODA with other parameters."""
    u, p = model.input_values({"rudder.command": COMMAND}), model.parameter_values(changed)

    def rate(_: float, state: np.ndarray) -> np.ndarray:
        return np.array(model.rhs(state, u, p)).ravel()

    result: np.ndarray = solve_ivp(rate, times, x, "LSODA", rtol=1e-11, atol=1e-12).y[:, -1]
    return result


def test_tuned_derivatives_act_at_once_in_co_simulation(
    fmi: int, mariner: Model, start: Callable[[int, str], RunningFmu]
) -> None:
    fmu = start(fmi, "CoSimulation")
    initialise(fmu, {})
    for step in range(40):
        fmu.instance.doStep(currentCommunicationPoint=step, communicationStepSize=1.0)
    before = fmu.read(["motion.udot", "motion.rdot"])
    x = np.array(fmu.read(mariner.state_names))
    fmu.write(TUNED)
    u, p = mariner.input_values({"rudder.command": COMMAND}), mariner.parameter_values(TUNED)
    rates = dict(zip(mariner.state_names, np.array(mariner.rhs(x, u, p)).ravel(), strict=True))
    after = fmu.read(["motion.udot", "motion.rdot"])
    assert after == pytest.approx([rates["motion.u"], rates["motion.r"]], rel=1e-12)
    assert min(abs(np.array(after) / before - 1)) > 0.01
    for step in range(40, 80):
        fmu.instance.doStep(currentCommunicationPoint=step, communicationStepSize=1.0)
    expected = continued(mariner, x, (40.0, 80.0), TUNED)
    np.testing.assert_allclose(fmu.read(mariner.state_names), expected, rtol=2e-7, atol=1e-7)
    assert not np.allclose(expected, continued(mariner, x, (40.0, 80.0), {}), rtol=1e-3)


def test_tuned_derivatives_act_at_once_in_model_exchange(
    fmi: int, mariner: Model, start: Callable[[int, str], RunningFmu]
) -> None:
    fmu = start(fmi, "ModelExchange")
    initialise(fmu, {})
    fmu.update()
    x = np.array(fmu.read(mariner.state_names))
    fmu.instance.enterEventMode()
    fmu.write(TUNED)
    fmu.update()
    u, p = mariner.input_values({"rudder.command": COMMAND}), mariner.parameter_values(TUNED)
    rates = fmu.read([state.derivative for state in mariner.states])
    np.testing.assert_allclose(rates, np.array(mariner.rhs(x, u, p)).ravel(), rtol=1e-12, atol=1e-15)


def test_what_a_bridge_shows_is_an_output_with_its_display_unit(mariner: Model) -> None:
    shown = {
        "position.latitude": "deg",
        "position.longitude": "deg",
        "motion.psi": "deg",
        "motion.r": "deg/min",  # rate of turn
        "motion.speed": "knots",  # through the water
        "motion.sog": "knots",
        "motion.cog": "deg",
        "motion.beta": "deg",
        "rudder.angle": "deg",
    }
    described = interface(mariner).by_name
    assert {name: described[name].display_unit for name in shown} == shown
    assert {described[name].causality for name in shown} == {"output"}


def test_orders_and_surroundings_are_inputs_where_the_card_has_them(mariner_card: ManoeuvringCard) -> None:
    added = """
[propulsion]
nominal_rpm = 84.0
Xnn = 77e-5
[[effects]]
name = "current"
parameters = { speed_mps = 0.5, direction_deg = 90.0 }
[[effects]]
name = "wind"
parameters = { speed_mps = 8.0, direction_deg = 200.0 }
"""
    model = build(parse_card(mariner_card.text + added, "x.toml"))
    inputs = {one.name: one.start for one in interface(model).with_causality("input")}
    assert inputs == pytest.approx(
        {
            "rudder.command": 0.0,
            "steering.failed": 0.0,
            "propeller.speed": 84.0 * 2 * math.pi / 60,
            "current.speed": 0.5,
            "current.direction": math.pi / 2,
            "wind.speed": 8.0,
            "wind.direction": math.radians(200.0),
        }
    )
    # A current to east carries a ship that heads north to starboard over the ground: its course is not its heading.
    p = model.parameter_values({"initial.u": 0.5})
    shown = dict(
        zip(model.outputs, np.array(model.output(model.initial(p), model.input_values(), p)).ravel(), strict=True)
    )
    assert math.degrees(shown["motion.cog"]) == pytest.approx(45.0)
    assert shown["motion.sog"] == pytest.approx(math.hypot(0.5, 0.5))
    assert shown["motion.speed"] == pytest.approx(0.5)


def test_a_rudder_order_past_the_stops_is_held_there_and_one_in_degrees_is_refused(
    fmi: int, start: Callable[[int, str], RunningFmu]
) -> None:
    fmu = start(fmi, "CoSimulation")
    initialise(fmu, {})
    fmu.write({"rudder.command": math.radians(60.0)})
    for step in range(40):
        fmu.instance.doStep(currentCommunicationPoint=0.5 * step, communicationStepSize=0.5)
    assert fmu.read(["rudder.angle"]) == [pytest.approx(math.radians(40.0), abs=1e-3)]
    with pytest.raises(FMICallException):
        fmu.write({"rudder.command": 35.0})
    assert fmu.read(["rudder.command"]) == [math.radians(60.0)]


@pytest.mark.slow
def test_revolutions_in_rpm_where_rad_per_s_belong_are_refused(mariner_card: ManoeuvringCard) -> None:
    text = mariner_card.text + "\n[propulsion]\nnominal_rpm = 90.0\nXnn = 77e-5\n"
    model = build(parse_card(text, "ship.toml"))
    lowest, highest = interface(model).by_name["propeller.speed"].accepted or (0.0, 0.0)
    assert lowest < -math.radians(6 * 90.0) < math.radians(6 * 90.0 * 1.2) < highest < 90.0
    nominal = interface(model).by_name["propulsion.nominal_speed"]
    assert 0 < nominal.minimum < nominal.start < nominal.maximum
    with pytest.raises(InputError) as caught:
        simulate(model, Turn(0.5), inputs={"propeller.speed": 90.0})
    assert caught.value.place == "propeller.speed"
