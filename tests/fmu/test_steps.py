"""Communication steps: very short and varying ones, what happens inside them (FMI 3), rates of outputs after them."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import fmpy.fmi3
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tank2sim.dynamics.model import Model
from tank2sim.fmu.export import write_fmu
from tank2sim.fmu.running import RunningFmu, running
from tank2sim.fmu.unpacking import unpack
from tests.fmu.conftest import quantity, state, tunable
from tests.fmu.driving import (
    ERROR,
    STATES,
    Instantiate,
    Slave,
    Status,
    Unpacked,
    begun,
    by_casadi,
    steps,
    time_of,
    untyped,
)
from tests.fmu.saved_state import restore, saved
from tests.marks import first_fast

# ---- sizes ----


def test_a_thousand_steps_of_a_microsecond_are_one_of_a_millisecond(slave: Slave) -> None:
    many, one = (slave(rudder__command=0.3) for _ in range(2))
    for fmu in (many, one):
        steps(fmu, 1000, 0.1)  # far from 0, where a microsecond is near what a time can tell
    assert steps(many, 1000, 1e-6, begin=100.0) == pytest.approx(steps(one, 1, 1e-3, begin=100.0), rel=1e-12)
    assert time_of(many) == pytest.approx(100.001, abs=1e-12)


def exactly_by(hull: Model, until: float, command: float) -> list[float]:
    """States at a time, by another integrator."""
    u, p = hull.input_values({"rudder.command": command}), hull.parameter_values()
    start = np.array(hull.initial(p)).ravel()
    truth = solve_ivp(lambda _, x: np.array(hull.rhs(x, u, p)).ravel(), (0.0, until), start, rtol=1e-11, atol=1e-12)
    return [float(value) for value in truth.y[:, -1]]


def test_steps_of_any_sizes_follow_the_equations(hull: Model, slave: Slave) -> None:
    fmu, now = slave(rudder__command=0.05), 0.0
    for size in (1e-6, 0.3, 1e-4, 2.7, 0.05, 1e-5, 1.0):
        fmu.instance.doStep(currentCommunicationPoint=now, communicationStepSize=size)
        now += size
    assert fmu.read(STATES) == pytest.approx(exactly_by(hull, now, 0.05), rel=1e-6, abs=1e-7)


def test_a_step_too_short_to_change_the_time_is_refused(status: Status, slave: Slave) -> None:
    fmu = slave()
    steps(fmu, 10)
    assert status(fmu.instance.doStep, 1.0, 1e-20) == ERROR
    assert len(fmu.log) == 1


def test_a_clock_that_adds_up_in_32_bits_is_accepted(slave: Slave) -> None:
    fmu = slave(rudder__command=0.1)
    exact = slave(rudder__command=0.1)
    now = np.float32(0.0)
    for _ in range(3000):
        fmu.instance.doStep(currentCommunicationPoint=float(now), communicationStepSize=0.1)
        now += np.float32(0.1)
    assert fmu.read(STATES) == pytest.approx(steps(exact, 3000), rel=1e-9)


@pytest.mark.parametrize("clock", [999.9, 1000.1], ids=["repeated", "left out"])
def test_a_step_repeated_or_left_out_is_refused_however_late(clock: float, status: Status, slave: Slave) -> None:
    fmu = slave()
    steps(fmu, 100, 10.0)
    before = fmu.read(STATES)
    assert status(fmu.instance.doStep, clock, 0.1) == ERROR
    assert fmu.read(STATES) == before


# ---- what only parameters determine ----


def decaying() -> Model:
    """dv/dt = -(k/m)^2 v: the factor is calculated when a parameter is set, not in every step."""
    k, m = tunable("k", 2.0), tunable("m", 4.0)
    v = state("v", "m/s", "vdot", 1.0)
    return Model(
        name="Decay",
        description="Exponential decay",
        states=(v,),
        parameters=(k, m),
        quantities=(quantity("vdot", "m/s2", -((k.symbol / m.symbol) ** 2) * v.symbol),),
        outputs=("v",),
        step_s=0.01,
    )


@first_fast("fmi", [2, 3])
def test_a_parameter_tuned_while_running_reaches_what_only_parameters_determine(fmi: int, tmp_path: Path) -> None:
    write_fmu(decaying(), tmp_path / "decay.fmu", fmi=fmi)
    with running(unpack(tmp_path / "decay.fmu", tmp_path / "decay"), "CoSimulation") as fmu:
        fmu.write({"m": 2.0})
        begun(fmu)
        fmu.instance.doStep(0.0, 1.0)
        assert fmu.read(["v"]) == pytest.approx([math.exp(-1.0)], rel=1e-6)
        state_then = fmu.instance.getFMUstate() if fmi == 2 else fmu.instance.getFMUState()
        fmu.write({"k": 4.0})
        fmu.instance.doStep(1.0, 1.0)
        assert fmu.read(["v"]) == pytest.approx([math.exp(-5.0)], rel=1e-6)
        (fmu.instance.setFMUstate if fmi == 2 else fmu.instance.setFMUState)(state_then)
        fmu.instance.doStep(1.0, 1.0)
        assert fmu.read(["v", "k"]) == pytest.approx([math.exp(-2.0), 2.0], rel=1e-6)
        (fmu.instance.freeFMUstate if fmi == 2 else fmu.instance.freeFMUState)(state_then)
        fmu.instance.reset()
        begun(fmu)
        fmu.instance.doStep(0.0, 1.0)
        assert fmu.read(["v"]) == pytest.approx([math.exp(-0.25)], rel=1e-6)


# ---- derivatives of outputs by time ----


def output_derivatives(fmu: RunningFmu, names: list[str], order: int = 1) -> list[float]:
    call = getattr(fmu.instance, "getRealOutputDerivatives", None) or fmu.instance.getOutputDerivatives
    return [float(value) for value in call(fmu.unpacked.references(names), [order] * len(names))]


def test_output_derivatives_are_the_rates_at_which_outputs_change(hull: Model, slave: Slave) -> None:
    fmu = slave(rudder__command=0.3)
    steps(fmu, 20)
    names = list(hull.outputs)
    width = 1e-5
    before = saved(fmu)
    values = []
    for _ in range(3):
        values.append(np.array(fmu.read(names)))
        fmu.instance.doStep(time_of(fmu), width)
    restore(fmu, before)
    found = np.array(output_derivatives(fmu, names))
    forward = (-3 * values[0] + 4 * values[1] - values[2]) / (2 * width)
    scale = np.maximum(np.abs(values[0]), 1)
    assert np.abs(found).min() > 0
    np.testing.assert_allclose(found / scale, forward / scale, atol=1e-8)
    assert output_derivatives(fmu, ["motion.u", "motion.psi"]) == fmu.read(["motion.udot", "motion.r"])


def test_output_derivatives_of_other_orders_or_of_no_output_are_refused(status: Status, slave: Slave) -> None:
    fmu = slave()
    for names, order in ((["motion.u"], 2), (["motion.u"], 0), (["rudder.command"], 1), (["initial.u"], 1)):
        assert status(output_derivatives, fmu, names, order) == ERROR
        assert names[0] in fmu.log[-1]
    assert len(fmu.log) == 4
    assert fmu.unpacked.description.coSimulation.maxOutputDerivativeOrder == 1


# ---- intermediate update (FMI 3) ----


@dataclass
class Watcher:
    """A simulator that looks into communication steps; `act` may ask for an early return by giving its time."""

    act: Callable[[RunningFmu, float], float | None] = lambda fmu, now: None
    fmu: RunningFmu | None = None
    times: list[float] = field(default_factory=list)
    may_end: list[bool] = field(default_factory=list)

    def __call__(self, _environment: Any, now: float, may_set: bool, may_get: bool, finished: bool, may_end: bool,
                 asked: Any, at: Any) -> None:  # fmt: skip
        assert self.fmu is not None
        assert may_set and may_get and finished
        self.times.append(now)
        self.may_end.append(bool(may_end))
        time = self.act(self.fmu, now)
        asked[0] = time is not None
        if time is not None:
            at[0] = time


@pytest.fixture
def watched(unpacked: Unpacked) -> Any:
    """Make an FMI 3 slave with an intermediate update; freed after the test."""
    with ExitStack() as stack:

        def make(watcher: Watcher, early: bool = True, required: tuple[str, ...] = ()) -> RunningFmu:
            folder = unpacked("hull", 3)
            slave = fmpy.fmi3.FMU3Slave(
                instanceName="watched",
                guid=folder.description.guid,
                unzipDirectory=str(folder.folder),
                modelIdentifier=folder.description.coSimulation.modelIdentifier,
            )
            watcher.fmu = fmu = RunningFmu(folder, slave)
            slave.instantiate(
                earlyReturnAllowed=early,
                intermediateUpdate=watcher,
                requiredIntermediateVariables=folder.references(list(required)),
                logMessage=lambda _e, _s, _c, message: fmu.log.append(message.decode()),
            )
            stack.callback(slave.freeInstance)
            return fmu

        yield make


def test_a_watched_step_is_the_same_step(hull: Model, watched: Any, instantiate: Instantiate) -> None:
    seen: list[list[float]] = []
    watcher = Watcher(lambda fmu, now: seen.append(fmu.read(["motion.psi", "motion.speed", "time"])))
    fmu = begun(watched(watcher, required=("motion.psi", "rudder.command")), rudder__command=0.3)
    plain = begun(instantiate("hull", 3, "CoSimulation"), rudder__command=0.3)
    assert fmu.instance.doStep(0.0, 1.0) == (False, False, False, 1.0)
    assert fmu.read(STATES) == steps(plain, 1, 1.0)
    assert watcher.times == pytest.approx([0.1 * k for k in range(1, 11)], abs=1e-15)
    assert watcher.may_end == [True] * 9 + [False]
    psi = STATES.index("motion.psi")
    expected = [by_casadi(hull, k, 0.1, rudder__command=0.3)[psi] for k in range(1, 11)]
    assert [row[0] for row in seen] == pytest.approx(expected, rel=1e-12, abs=1e-15)
    assert [row[2] for row in seen] == watcher.times


def test_inputs_set_in_an_intermediate_update_act_from_there(watched: Any, instantiate: Instantiate) -> None:
    def steer(fmu: RunningFmu, now: float) -> None:
        if math.isclose(now, 0.5):
            fmu.write({"rudder.command": -0.2})

    fmu = begun(watched(Watcher(steer)), rudder__command=0.3)
    fmu.instance.doStep(0.0, 1.0)
    plain = begun(instantiate("hull", 3, "CoSimulation"), rudder__command=0.3)
    steps(plain, 5)
    plain.write({"rudder.command": -0.2})
    assert fmu.read(STATES) == pytest.approx(steps(plain, 5, begin=0.5), rel=1e-14, abs=1e-16)


@pytest.mark.parametrize(("asked", "reached"), [(0.35, 0.35), (0.0, 0.3), (math.nan, 0.3), (0.3, 0.3), (0.65, 0.65)])
def test_an_early_return_is_honoured(asked: float, reached: float, hull: Model, watched: Any) -> None:
    fmu = begun(watched(Watcher(lambda fmu, now: asked if math.isclose(now, 0.3) else None)), rudder__command=0.3)
    _, _, early, last = fmu.instance.doStep(0.0, 1.0)
    assert early
    assert last == pytest.approx(reached, abs=1e-12)
    assert fmu.read(["time"]) == [last]
    assert fmu.read(STATES) == pytest.approx(exactly_by(hull, last, 0.3), rel=1e-9, abs=1e-9)
    fmu.instance.doStep(last, 1.0 - last)
    assert fmu.read(["time"]) == pytest.approx([1.0])


def test_an_early_return_that_is_not_allowed_is_not_made(watched: Any) -> None:
    watcher = Watcher(lambda fmu, now: now)
    fmu = begun(watched(watcher, early=False))
    assert fmu.instance.doStep(0.0, 1.0) == (False, False, False, 1.0)
    assert watcher.may_end == [False] * 10


def test_what_harms_a_step_is_refused_inside_it(watched: Any, status: Status) -> None:
    found: list[int] = []

    def misuse(fmu: RunningFmu, now: float) -> None:
        calls: list[Callable[[], Any]] = [
            lambda: fmu.instance.doStep(now, 0.1),
            fmu.instance.reset,
            fmu.instance.terminate,
            fmu.instance.getFMUState,
            lambda: fmu.write({"derivatives.Yv": 0.1}),
            lambda: fmu.write({"steering.failed": 1.0}),
        ]
        found.extend(status(call) for call in calls)
        untyped(fmu).fmi3FreeInstance(fmpy.fmi3.fmi3Instance(fmu.instance.component))

    fmu = begun(watched(Watcher(misuse)), rudder__command=0.3)
    fmu.instance.doStep(0.0, 0.1)
    assert found == [ERROR] * 6
    assert len(fmu.log) == 7
    assert fmu.read(["derivatives.Yv", "steering.failed", "time"]) == [-0.12, 0.0, 0.1]


@pytest.mark.parametrize("required", ["derivatives.Yv", "steering.failed", "time"])
def test_what_cannot_change_inside_a_step_cannot_be_required(required: str, watched: Any) -> None:
    with pytest.raises(Exception, match="instantiate"):
        watched(Watcher(), required=(required,))
    described = ElementTree.parse(watched(Watcher()).unpacked.folder / "modelDescription.xml")
    shown = {one.get("name") for one in described.iterfind("ModelVariables/*[@intermediateUpdate='true']")}
    assert {"motion.psi", "motion.u", "motion.udot", "rudder.command", "force.N"} <= shown
    assert required not in shown
