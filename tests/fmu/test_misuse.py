"""An FMU that is called wrongly: an error and one line in the log for each call, never a crash, and nothing changed."""

from __future__ import annotations

import ctypes
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import fmpy
import pytest

from tests.fmu.driving import (
    DISCARD,
    ERROR,
    STATES,
    Instantiate,
    Slave,
    Status,
    Unpacked,
    begun,
    steps,
    time_of,
    untyped,
)


def test_calls_out_of_turn_end_in_error_with_one_line_each(fmi: int, instantiate: Instantiate, status: Status) -> None:
    fmu = instantiate("hull", fmi, "CoSimulation")
    calls: list[Callable[[], Any]] = [
        lambda: fmu.instance.doStep(0.0, 0.1),
        fmu.instance.exitInitializationMode,
        fmu.instance.terminate,
    ]
    assert [status(call) for call in calls] == [ERROR] * 3
    begun(fmu)
    calls = [
        fmu.instance.enterInitializationMode,
        lambda: fmu.instance.doStep(0.5, 0.1),
        lambda: fmu.instance.doStep(0.0, 0.0),
        lambda: fmu.instance.doStep(0.0, -0.1),
        lambda: fmu.instance.doStep(0.0, math.nan),
        lambda: fmu.instance.doStep(math.nan, 0.1),
        lambda: fmu.instance.doStep(0.0, 1e300),
    ]
    assert [status(call) for call in calls] == [ERROR] * 7
    assert len(fmu.log) == 10
    fmu.instance.terminate()
    assert status(fmu.write, {"rudder.command": 0.1}) == ERROR
    assert status(fmu.instance.doStep, 0.0, 0.1) == ERROR
    fmu.instance.reset()
    assert steps(begun(fmu), 1)[3] == pytest.approx(7.0, abs=0.1)


def test_no_step_goes_past_the_stop_time(fmi: int, instantiate: Instantiate, status: Status) -> None:
    fmu = instantiate("hull", fmi, "CoSimulation")
    if fmi == 2:
        fmu.instance.setupExperiment(startTime=2.0, stopTime=3.0)
        fmu.instance.enterInitializationMode()
    else:
        fmu.instance.enterInitializationMode(startTime=2.0, stopTime=3.0)
    fmu.instance.exitInitializationMode()
    assert status(fmu.instance.doStep, 2.0, 1.1) == ERROR
    assert status(fmu.instance.doStep, 2.0, 1.0) == 0
    if fmi == 2:  # where the experiment need not be set up again
        fmu.instance.reset()
        fmu.instance.enterInitializationMode()
        fmu.instance.exitInitializationMode()
        assert status(fmu.instance.doStep, 0.0, 5.0) == 0


def test_kinds_are_not_mixed_up(fmi: int, instantiate: Instantiate) -> None:
    slave, model = instantiate("hull", fmi, "CoSimulation"), instantiate("hull", fmi, "ModelExchange")
    begun(slave)
    begun(model)
    do_step = getattr(untyped(slave), f"fmi{fmi}DoStep")
    enter = getattr(untyped(slave), f"fmi{fmi}EnterContinuousTimeMode")
    assert enter(ctypes.c_void_p(slave.instance.component)) == ERROR
    do_step.argtypes = [ctypes.c_void_p, ctypes.c_double, ctypes.c_double, ctypes.c_int, *[ctypes.c_void_p] * 4]
    assert do_step(model.instance.component, 0.0, 0.1, 0, None, None, None, None) == ERROR
    assert (len(slave.log), len(model.log)) == (1, 1)


def test_null_pointers_and_unknown_references_end_in_error(fmi: int, slave: Slave) -> None:
    fmu = slave()
    dll, c = untyped(fmu), ctypes.c_void_p(fmu.instance.component)
    real = "Real" if fmi == 2 else "Float64"
    one, n = (ctypes.c_uint * 1)(4), ctypes.c_size_t(1)
    value, extra = (ctypes.c_double * 1)(), ([] if fmi == 2 else [n])
    for far in (10_000, 4_294_967_295):
        assert getattr(dll, f"fmi{fmi}Get{real}")(c, (ctypes.c_uint * 1)(far), n, value, *extra) == ERROR
        assert getattr(dll, f"fmi{fmi}Set{real}")(c, (ctypes.c_uint * 1)(far), n, value, *extra) == ERROR
    for verb in ("Get", "Set"):
        assert getattr(dll, f"fmi{fmi}{verb}{real}")(c, None, n, value, *extra) == ERROR
        assert getattr(dll, f"fmi{fmi}{verb}{real}")(c, one, n, None, *extra) == ERROR
        assert getattr(dll, f"fmi{fmi}{verb}{real}")(None, one, n, value, *extra) == ERROR
        assert getattr(dll, f"fmi{fmi}{verb}Boolean")(c, one, n, value, *extra) == ERROR
        assert getattr(dll, f"fmi{fmi}{verb}String")(c, one, n, value, *extra) == ERROR
        assert (
            getattr(dll, f"fmi{fmi}{verb}{real}")(c, None, ctypes.c_size_t(0), None, *[ctypes.c_size_t(0)][: fmi - 2])
            == 0
        )
    assert getattr(dll, f"fmi{fmi}GetFMU{'s' if fmi == 2 else 'S'}tate")(c, None) == ERROR
    getattr(dll, f"fmi{fmi}FreeInstance")(None)
    assert all(line for line in fmu.log)


def test_every_function_answers_a_missing_instance_with_error(
    fmi: int, unpacked: Unpacked, instantiate: Instantiate
) -> None:
    header = (Path(fmpy.__file__).parent / "c-code" / f"fmi{fmi}Functions.h").read_text()
    dll = untyped(instantiate("hull", fmi, "CoSimulation"))
    for name in re.findall(rf"FMI{fmi}_Export\s+\w+TYPE\s+(\w+);", header):
        if not re.search("Instantiate|GetVersion|GetTypesPlatform|FreeInstance", name):
            assert getattr(dll, name)(*[None] * 10) == ERROR, name


def test_functions_for_what_the_model_has_none_of_say_so(instantiate: Instantiate) -> None:
    fmu = begun(instantiate("hull", 3, "CoSimulation"))
    c = ctypes.c_void_p(fmu.instance.component)
    names = ("GetIntervalDecimal", "GetClock", "EnterConfigurationMode", "EvaluateDiscreteStates", "EnterStepMode")
    one, value = (ctypes.c_uint * 1)(4), (ctypes.c_double * 1)()
    for name in names:
        assert getattr(untyped(fmu), f"fmi3{name}")(c, one, ctypes.c_size_t(1), value, value) == ERROR
    assert len(fmu.log) == len(names)


def test_the_log_names_the_argument_and_the_variable(fmi: int, slave: Slave) -> None:
    fmu = slave()
    dll, c, n = untyped(fmu), ctypes.c_void_p(fmu.instance.component), ctypes.c_size_t(1)
    real, integer, last = ("Real", "Integer", []) if fmi == 2 else ("Float64", "Int32", [n])
    one, name = (ctypes.c_uint * 1)(*fmu.unpacked.references(["motion.psi"])), "motion.psi"
    assert getattr(dll, f"fmi{fmi}Get{real}")(c, one, n, None, *last) == ERROR
    assert re.fullmatch(rf"fmi{fmi}Get{real}: values? is a null pointer", fmu.log[-1])
    assert getattr(dll, f"fmi{fmi}Get{integer}")(c, one, n, (ctypes.c_int * 1)(), *last) == ERROR
    assert name in fmu.log[-1]
    assert getattr(dll, f"fmi{fmi}Set{real}")(c, one, n, (ctypes.c_double * 1)(), *last) == ERROR
    assert name in fmu.log[-1]
    assert len(fmu.log) == 3


@pytest.mark.parametrize("value", [1e300, -1e300, 1e-300, 5e-324])
def test_huge_and_tiny_inputs_and_coefficients_do_no_harm(value: float, status: Status, slave: Slave) -> None:
    fmu = slave(rudder__command=0.1)
    before = steps(fmu, 3)
    for name in ("rudder.command", "propeller.speed", "derivatives.Yv", "derivatives.drag"):
        kept = fmu.read([name])[0]
        if status(fmu.write, {name: value}) == DISCARD:  # beyond what a parameter may be
            assert abs(value) > 1 and name in fmu.log[-1] and fmu.read([name]) == [kept]
            continue
        if status(fmu.instance.doStep, *(time_of(fmu), 0.1)) != 0:
            assert fmu.read(STATES) == before
        assert all(math.isfinite(state) for state in fmu.read(STATES))
        before = fmu.read(STATES)
        fmu.write({name: kept})


def test_parameters_keep_to_their_bounds(status: Status, slave: Slave) -> None:
    fmu = slave()
    (described,) = [v for v in fmu.unpacked.description.modelVariables if v.name == "derivatives.Yv"]
    low, high, start = (float(text) for text in (described.min, described.max, described.start))
    for value, taken in ((low, True), (high, True), (1.001 * low, False), (1.001 * high, False)):
        fmu.write({"derivatives.Yv": start})
        assert status(fmu.write, {"derivatives.Yv": value}) == (0 if taken else DISCARD)
        assert fmu.read(["derivatives.Yv"]) == [value if taken else start]
    assert "derivatives.Yv" in fmu.log[-1] and f"{low:g} and {high:g}" in fmu.log[-1]


def test_an_instance_of_no_kind_is_refused(instantiate: Instantiate) -> None:
    fmu = instantiate("hull", 2, "CoSimulation")
    make = untyped(fmu).fmi2Instantiate
    make.restype = ctypes.c_void_p
    token = fmu.unpacked.description.guid.encode()
    assert make(b"one", 7, token, None, ctypes.byref(fmu.instance.callbacks), 0, 0) is None


# ---- log ----


def test_the_log_can_be_chosen_by_category(status: Status, slave: Slave) -> None:
    fmu = slave()
    fmu.instance.setDebugLogging(False, ["logStatusError"])
    assert status(fmu.instance.terminate) == 0
    assert status(fmu.instance.terminate) == ERROR
    assert fmu.log == []
    fmu.instance.setDebugLogging(True, ["logStatusError"])
    assert status(fmu.instance.terminate) == ERROR
    assert len(fmu.log) == 1
    assert "Terminate" in fmu.log[0]
    assert status(fmu.instance.setDebugLogging, True, ["logNothingOfTheKind"]) == ERROR


def test_a_message_is_text_whatever_it_holds(fmi: int, instantiate: Instantiate, status: Status) -> None:
    fmu = instantiate("hull", fmi, "CoSimulation")
    assert status(fmu.instance.setDebugLogging, True, ["%s%n #r1# ł"]) == ERROR
    # The logger of FMI 2 takes a format, where these signs are written twice.
    assert ("%%s%%n ##r1## ł" if fmi == 2 else "%s%n #r1# ł") in fmu.log[0]
    assert status(fmu.instance.setDebugLogging, True, ["x" * 5000]) == ERROR
    assert len(fmu.log[1]) < 1000
