"""The library of an FMU as a simulator meets it: life, modes, misuse, values that are not finite, saved states."""

from __future__ import annotations

import contextlib
import ctypes
import io
import math
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import fmpy
import fmpy.fmi2
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from scipy.optimize import fsolve

from tank2sim.dynamics.model import Model
from tank2sim.fmu.running import running
from tests.fmu.driving import (
    DISCARD,
    ERROR,
    STATES,
    FmuFile,
    Instantiate,
    Slave,
    Status,
    Unpacked,
    begun,
    by_casadi,
    steps,
    time_of,
)

# ---- what the library exports ----


@pytest.mark.skipif(sys.platform != "linux", reason="reads the symbols of an ELF library with nm")
def test_library_exports_the_functions_of_the_header_and_nothing_else(fmi: int, unpacked: Unpacked) -> None:
    header = (Path(fmpy.__file__).parent / "c-code" / f"fmi{fmi}Functions.h").read_text()
    declared = set(re.findall(rf"FMI{fmi}_Export\s+\w+TYPE\s+(\w+);", header))
    (library,) = unpacked("hull", fmi).folder.glob("binaries/*/*.so")
    listed = subprocess.run(["nm", "-D", "--defined-only", library], capture_output=True, text=True, check=True).stdout
    assert {line.split()[-1] for line in listed.splitlines()} == declared
    assert len(declared) > 40


# ---- life ----


def test_two_instances_at_once_do_not_disturb_each_other(hull: Model, slave: Slave) -> None:
    one = slave(rudder__command=0.2)
    other = slave(rudder__command=-0.3)
    for place in range(50):
        for fmu in (one, other):
            fmu.instance.doStep(currentCommunicationPoint=place * 0.1, communicationStepSize=0.1)
    assert one.read(STATES) == pytest.approx(by_casadi(hull, 50, 0.1, rudder__command=0.2), rel=1e-12, abs=1e-14)
    assert other.read(STATES) == pytest.approx(by_casadi(hull, 50, 0.1, rudder__command=-0.3), rel=1e-12, abs=1e-14)


def test_instances_in_threads_do_not_disturb_each_other(hull: Model, slave: Slave) -> None:
    orders = [0.02 * place for place in range(8)]
    fleet = [slave(rudder__command=order) for order in orders]
    with ThreadPoolExecutor(len(fleet)) as threads:  # calls into a library do not hold Python's lock
        found = list(threads.map(lambda fmu: steps(fmu, 50, 2.0), fleet))
    alone = [steps(slave(rudder__command=order), 50, 2.0) for order in orders]
    assert found == alone


def test_an_instance_can_be_made_again_and_again(slave: Slave) -> None:
    results = {tuple(steps(slave(rudder__command=0.1), 3)) for _ in range(50)}
    assert len(results) == 1


def test_reset_brings_back_the_start_values(fmi: int, instantiate: Instantiate) -> None:
    fmu = instantiate("hull", fmi, "CoSimulation")
    fmu.write({"initial.u": 3.0, "derivatives.drag": 0.1})
    disturbed = steps(begun(fmu, rudder__command=0.1), 20)
    fmu.instance.reset()
    fresh = instantiate("hull", fmi, "CoSimulation")
    again = steps(begun(fmu), 20)
    assert again == steps(begun(fresh), 20)
    assert again != disturbed


def test_an_instance_is_refused_for_another_token(fmi: int, unpacked: Unpacked) -> None:
    right = unpacked("hull", fmi)
    wrong = SimpleNamespace(**{name: getattr(right.description, name) for name in ("fmiVersion", "coSimulation")})
    wrong.guid = "{00000000-1111-2222-3333-444444444444}"
    with pytest.raises(Exception, match="instantiate"), running(replace(right, description=wrong), "CoSimulation"):
        pass


# ---- integration ----


@pytest.mark.parametrize(
    ("size", "count"), [(1.0, 10), (0.7, 7), (0.30000000000000004, 3), (1.1, 11), (0.25, 3), (0.05, 1)]
)
def test_a_communication_step_is_divided_into_the_fewest_equal_steps(
    size: float, count: int, hull: Model, slave: Slave
) -> None:
    found = steps(slave(rudder__command=0.3), 1, size)
    assert found == pytest.approx(by_casadi(hull, count, size / count, rudder__command=0.3), rel=1e-14, abs=1e-16)
    wrong = by_casadi(hull, count + 1, size / (count + 1), rudder__command=0.3)
    assert found != pytest.approx(wrong, rel=1e-14, abs=1e-16)


def test_time_lands_exactly_on_communication_points(slave: Slave) -> None:
    fmu = slave()
    now = 0.0
    for size in (0.1, 0.37, 1.0, 0.013, 2.5):
        fmu.instance.doStep(currentCommunicationPoint=now, communicationStepSize=size)
        now += size
        assert time_of(fmu) == now


def test_the_largest_step_is_a_parameter(fmi: int, hull: Model, instantiate: Instantiate, status: Status) -> None:
    fmu = instantiate("hull", fmi, "CoSimulation")
    assert status(fmu.write, {"solver.max_step": 0.0}) == DISCARD
    fmu.write({"solver.max_step": 0.5})
    assert steps(begun(fmu, rudder__command=0.3), 1, 1.0) == pytest.approx(
        by_casadi(hull, 2, 0.5, rudder__command=0.3), rel=1e-14, abs=1e-16
    )
    assert status(fmu.write, {"solver.max_step": 0.1}) == ERROR


def test_initial_parameters_determine_the_states(fmi: int, instantiate: Instantiate) -> None:
    fmu = instantiate("hull", fmi, "CoSimulation")
    fmu.write({"initial.u": 5.5, "initial.psi": -1.0})
    assert begun(fmu).read(["motion.u", "motion.psi", "motion.speed"]) == [5.5, -1.0, 5.5]


# ---- steady motion ----


def steady_motion(model: Model, order: float) -> list[float]:
    """u, v, r at which the accelerations vanish, found by scipy from the model's right-hand side."""
    u, p = model.input_values({"rudder.command": order}), model.parameter_values()

    def residual(motion: Any) -> Any:
        return np.array(model.rhs([0, 0, 0, *motion, order], u, p)).ravel()[3:6]

    return [float(value) for value in fsolve(residual, [7.0, 0.0, 0.0], xtol=1e-13)]


def test_trim_starts_in_steady_motion_with_the_inputs_given(fmi: int, hull: Model, instantiate: Instantiate) -> None:
    fmu = instantiate("hull", fmi, "CoSimulation", logging=True)
    fmu.write({"initial.trim": 1.0, "initial.psi": 0.5})
    begun(fmu, rudder__command=0.25)
    expected = steady_motion(hull, 0.25)
    assert abs(expected[2]) > 0.01
    assert fmu.read(["motion.u", "motion.v", "motion.r"]) == pytest.approx(expected, rel=1e-9)
    assert fmu.read(["rudder.angle", "motion.psi"]) == [0.25, 0.5]
    assert fmu.read(["motion.udot", "motion.rdot", "rudder.demand"]) == pytest.approx([0, 0, 0], abs=1e-12)
    assert any("steady motion found" in line for line in fmu.log)


def test_trim_that_finds_nothing_warns_and_starts_untrimmed(fmi: int, instantiate: Instantiate) -> None:
    fmu = instantiate("hull", fmi, "CoSimulation")
    fmu.write({"initial.trim": 1.0, "derivatives.drag": 0.0, "initial.u": 6.0})  # no speed balances the thrust
    begun(fmu, rudder__command=0.1)
    assert fmu.read(["motion.u", "motion.v", "rudder.angle"]) == [6.0, 0.0, 0.0]
    assert [line for line in fmu.log if "no steady motion" in line]


# ---- values that are not finite ----


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_an_input_that_is_not_finite_is_discarded(value: float, status: Status, slave: Slave) -> None:
    fmu = slave(rudder__command=0.1)
    assert status(fmu.write, {"propeller.speed": 2.0, "rudder.command": value}) == DISCARD
    assert fmu.read(["rudder.command", "propeller.speed"]) == [0.1, 1.0]
    assert len(fmu.log) == 1
    assert "rudder.command" in fmu.log[0]


def test_a_simulator_that_only_asks_whether_to_go_on_ends(fmi: int, fmu_file: FmuFile) -> None:
    """FMPy repeats a discarded step until the FMU says that it has ended."""
    start = {"derivatives.thrust": 1e308, "propeller.speed": 1e3}
    with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(FMICallException):
        result = fmpy.simulate_fmu(
            str(fmu_file("hull", fmi)), stop_time=5.0, start_values=start, fmi_type="CoSimulation"
        )
        assert result["time"][-1] < 5.0


@pytest.mark.parametrize(("input_name", "beyond"), [("propeller.speed", 1e9), ("rudder.command", 35.0)])
def test_an_input_beyond_its_bounds_is_discarded_and_changes_nothing(
    input_name: str, beyond: float, status: Status, slave: Slave
) -> None:
    fmu = slave()
    before = fmu.read([input_name])
    assert status(fmu.write, {input_name: beyond}) == DISCARD
    assert fmu.read([input_name]) == before
    assert len(fmu.log) == 1 and input_name in fmu.log[0]


def test_a_step_to_states_that_no_ship_has_is_discarded(fmi: int, status: Status, slave: Slave) -> None:
    fmu = slave(rudder__command=0.1)
    before = steps(fmu, 10)
    fmu.write({"derivatives.thrust": 1e3, "propeller.speed": 1e3})
    assert status(fmu.instance.doStep, 1.0, 0.1) == DISCARD
    assert fmu.read(STATES) == before
    assert time_of(fmu) == 1.0
    (reported,) = fmu.log
    assert "motion." in reported and "leaves all bounds" in reported
    assert reported.endswith("derivatives.thrust = 1000")  # 10 000 times its start value, the revolutions 1000 times
    if fmi == 2:  # FMPy does not hand on what fmi3DoStep says of it
        assert fmu.instance.getBooleanStatus(fmpy.fmi2.fmi2Terminated)
    fmu.write({"propeller.speed": 1.0, "derivatives.thrust": 0.1})
    undisturbed = slave(rudder__command=0.1)
    assert steps(fmu, 5, begin=1.0) == steps(undisturbed, 15)


def test_an_output_or_a_rate_that_is_not_finite_is_discarded(
    fmi: int, instantiate: Instantiate, status: Status
) -> None:
    fmu = begun(instantiate("hull", fmi, "ModelExchange"))
    fmu.instance.enterEventMode() if fmi == 2 else None
    states = (ctypes.c_double * 7)(0, 0, 0, 1e200, 0, 0, 0)  # the drag goes with the square of the speed
    fmu.instance.enterContinuousTimeMode()
    fmu.instance.setContinuousStates(states, 7)
    assert status(fmu.read, ["motion.udot"]) == DISCARD
    rates = (ctypes.c_double * 7)()
    get = fmu.instance.getDerivatives if fmi == 2 else fmu.instance.getContinuousStateDerivatives
    assert status(get, rates, 7) == DISCARD
    assert fmu.read(["motion.rdot"]) == [0.0]
    assert all("motion.udot" in line for line in fmu.log)


def test_a_start_that_is_not_finite_does_not_end_the_initialisation(
    fmi: int, instantiate: Instantiate, status: Status
) -> None:
    fmu = instantiate("hull", fmi, "ModelExchange")
    assert status(fmu.write, {"initial.u": math.nan}) == DISCARD
    begun(fmu)
    fmu.instance.enterContinuousTimeMode()
    states = (ctypes.c_double * 7)(*([0.0] * 3 + [math.nan] + [0.0] * 3))
    assert status(fmu.instance.setContinuousStates, states, 7) == DISCARD
    assert fmu.read(["motion.u"]) == [7.0]


# ---- what may be set when ----


def test_parameters_and_inputs_can_be_set_when_fmi_allows_it(
    fmi: int, instantiate: Instantiate, status: Status
) -> None:
    fmu = begun(instantiate("hull", fmi, "ModelExchange"))
    fmu.write({"derivatives.Yv": -0.13, "rudder.command": 0.1, "steering.failed": 1.0})  # event mode
    assert status(fmu.write, {"initial.u": 6.0}) == ERROR
    assert status(fmu.write, {"initial.trim": 1.0}) == ERROR
    fmu.instance.enterContinuousTimeMode()
    fmu.write({"rudder.command": 0.2})
    assert status(fmu.write, {"derivatives.Yv": -0.14}) == ERROR
    assert status(fmu.write, {"steering.failed": 0.0}) == ERROR
    assert status(fmu.write, {"motion.u": 1.0}) == ERROR
    assert fmu.read(["derivatives.Yv", "rudder.command", "steering.failed"]) == [-0.13, 0.2, 1.0]
    assert len(fmu.log) == 5


def test_tunable_parameters_act_from_the_next_step(slave: Slave) -> None:
    fmu, plain = (slave(rudder__command=0.2) for _ in range(2))
    assert steps(fmu, 5) == steps(plain, 5)
    fmu.write({"derivatives.Nd": 0.024})
    assert fmu.read(["force.N"])[0] == pytest.approx(2 * plain.read(["force.N"])[0])
    assert steps(fmu, 5, begin=0.5)[5] > steps(plain, 5, begin=0.5)[5]


def test_a_failed_gear_holds_the_rudder(slave: Slave) -> None:
    fmu = slave(rudder__command=0.3)
    held = steps(fmu, 10)[6]
    fmu.write({"steering.failed": 1.0, "rudder.command": -0.3})
    assert steps(fmu, 10, begin=1.0)[6] == held
    assert held > 0
