"""Directional and adjoint derivatives of the library against finite differences and against each other."""

from __future__ import annotations

import ctypes
from collections.abc import Callable

import numpy as np
import pytest

from tank2sim.arrays import Array
from tank2sim.dynamics.model import Model
from tank2sim.fmu.running import RunningFmu
from tests.fmu.driving import Instantiate, Status

ERROR = 3
TRIM = pytest.mark.parametrize("trim", [False, True])
STATE = {"motion.x": 3.0, "motion.y": 1.0, "motion.psi": 0.7, "motion.u": 6.0, "motion.v": -0.5, "motion.r": 0.02}
INPUTS = {"rudder.command": 0.15, "propeller.speed": 1.2}
REAL_INPUTS = ["rudder.command", "propeller.speed"]


def at_a_point(fmu: RunningFmu) -> RunningFmu:
    """In continuous time, at a state where every term counts."""
    fmu.initialise(INPUTS)
    fmu.update()
    states = [*STATE.values(), 0.12]
    fmu.instance.setContinuousStates((ctypes.c_double * 7)(*states), 7)
    return fmu


def directional(fmu: RunningFmu, unknowns: list[str], knowns: list[str]) -> Array:
    """Jacobian (unknowns, knowns), one directional derivative a column."""
    columns = []
    for known in knowns:
        references = fmu.unpacked.references(unknowns), fmu.unpacked.references([known])
        columns.append(fmu.instance.getDirectionalDerivative(*references, [1.0]))
    return np.array(columns).T


def adjoint(fmu: RunningFmu, unknowns: list[str], knowns: list[str]) -> Array:
    """The same Jacobian, one adjoint derivative a row."""
    rows = []
    for unknown in unknowns:
        references = fmu.unpacked.references([unknown]), fmu.unpacked.references(knowns)
        rows.append(fmu.instance.getAdjointDerivative(*references, [1.0], nSensitivity=len(knowns)))
    return np.array(rows)


def unknown_names(model: Model) -> list[str]:
    return [*dict.fromkeys([*(state.derivative for state in model.states), *model.outputs])]


def real_parameters(model: Model) -> list[str]:
    return [parameter.name for parameter in model.parameters if not parameter.boolean]


def by_differences(evaluate: Callable[[str, float], list[float]], knowns: list[str], values: list[float]) -> Array:
    columns = []
    for known, value in zip(knowns, values, strict=True):
        width = 1e-6 * max(1.0, abs(value))
        above, below = (np.array(evaluate(known, value + sign * width)) for sign in (1, -1))
        columns.append((above - below) / (2 * width))
    return np.array(columns).T


def by_writing(fmu: RunningFmu, unknowns: list[str], knowns: list[str]) -> Array:
    """The same by writing each known and reading the unknowns."""
    values = fmu.read(knowns)

    def evaluate(known: str, value: float) -> list[float]:
        fmu.write({known: value})
        answer = fmu.read(unknowns)
        fmu.write({known: values[knowns.index(known)]})
        return answer

    return by_differences(evaluate, knowns, values)


def assert_close(found: Array, expected: Array) -> None:
    scale = np.maximum(np.abs(expected).max(axis=1, keepdims=True), 1e-3)
    np.testing.assert_allclose(found / scale, expected / scale, atol=2e-7)


def test_directional_derivatives_are_those_of_finite_differences(
    fmi: int, hull: Model, instantiate: Instantiate
) -> None:
    fmu = at_a_point(instantiate("hull", fmi, "ModelExchange"))
    unknowns = unknown_names(hull)
    knowns = [*hull.state_names, *REAL_INPUTS, *(p.name for p in hull.parameters if p.tunable)]
    values = fmu.read(knowns)
    states = (ctypes.c_double * 7)(*values[:7])

    def evaluate(known: str, value: float) -> list[float]:
        changed = list(states)
        if known in hull.state_names:
            changed[hull.state_names.index(known)] = value
        else:
            fmu.instance.enterEventMode()
            fmu.write({known: value})
            fmu.update()
        fmu.instance.setContinuousStates((ctypes.c_double * 7)(*changed), 7)
        answer = fmu.read(unknowns)
        if known not in hull.state_names:
            fmu.instance.enterEventMode()
            fmu.write({known: values[knowns.index(known)]})
            fmu.update()
        fmu.instance.setContinuousStates(states, 7)
        return answer

    expected = by_differences(evaluate, knowns, values)
    found = directional(fmu, unknowns, knowns)
    assert np.count_nonzero(expected) > 30
    assert_close(found, expected)


def test_a_seed_of_several_knowns_sums_their_columns(fmi: int, hull: Model, instantiate: Instantiate) -> None:
    fmu = at_a_point(instantiate("hull", fmi, "ModelExchange"))
    unknowns, knowns = unknown_names(hull), ["motion.u", "rudder.command", "derivatives.Nd", "motion.u"]
    seed = [0.5, -2.0, 3.0, 0.25]
    references = fmu.unpacked.references(unknowns), fmu.unpacked.references(knowns)
    found = fmu.instance.getDirectionalDerivative(*references, seed)
    assert found == pytest.approx(directional(fmu, unknowns, knowns) @ np.array(seed), rel=1e-12, abs=1e-12)


def test_adjoint_derivatives_are_the_directional_ones_transposed(hull: Model, instantiate: Instantiate) -> None:
    fmu = at_a_point(instantiate("hull", 3, "ModelExchange"))
    knowns = [*hull.state_names, *REAL_INPUTS, *real_parameters(hull), "solver.max_step", "time"]
    expected = directional(fmu, unknown_names(hull), knowns)
    assert np.count_nonzero(expected) > 40
    np.testing.assert_allclose(adjoint(fmu, unknown_names(hull), knowns), expected, rtol=1e-12, atol=1e-12)


def at_a_communication_point(fmu: RunningFmu) -> RunningFmu:
    """In Co-Simulation, in a turn with the rudder still under way."""
    fmu.initialise(INPUTS)
    for place in range(25):
        fmu.instance.doStep(currentCommunicationPoint=0.1 * place, communicationStepSize=0.1)
    fmu.write({"rudder.command": 0.1})
    return fmu


def test_derivatives_at_communication_points_are_by_inputs_and_tunable_parameters(
    fmi: int, hull: Model, instantiate: Instantiate
) -> None:
    fmu = at_a_communication_point(instantiate("hull", fmi, "CoSimulation"))
    unknowns, knowns = unknown_names(hull), [*REAL_INPUTS, *(p.name for p in hull.parameters if p.tunable)]
    found = directional(fmu, unknowns, knowns)
    assert np.count_nonzero(found) > 8
    assert_close(found, by_writing(fmu, unknowns, knowns))
    if fmi == 3:
        np.testing.assert_allclose(adjoint(fmu, unknowns, knowns), found, rtol=1e-12, atol=1e-12)


def test_a_seed_that_is_not_finite_is_discarded(fmi: int, instantiate: Instantiate, status: Status) -> None:
    fmu = at_a_communication_point(instantiate("hull", fmi, "CoSimulation"))
    references = fmu.unpacked.references(["motion.udot"]), fmu.unpacked.references(["propeller.speed"])
    assert status(fmu.instance.getDirectionalDerivative, *references, [np.nan]) == 2
    if fmi == 3:
        assert status(lambda: fmu.instance.getAdjointDerivative(*references, [np.inf], nSensitivity=1)) == 2
    assert all("the seed of" in line for line in fmu.log)
    assert len(fmu.log) == fmi - 1


def initialising(fmu: RunningFmu, trim: bool) -> RunningFmu:
    fmu.write({"initial.trim": float(trim), "initial.u": 6.5})
    if fmu.unpacked.fmi == 2:
        fmu.instance.setupExperiment(startTime=0.0)
    fmu.instance.enterInitializationMode()
    fmu.write(INPUTS)
    return fmu


@TRIM
@pytest.mark.parametrize("kind", ["ModelExchange", "CoSimulation"])
def test_derivatives_during_initialisation_go_through_the_initial_states(
    fmi: int, kind: str, trim: bool, hull: Model, instantiate: Instantiate
) -> None:
    fmu = initialising(instantiate("hull", fmi, kind), trim)
    unknowns = [*unknown_names(hull), "motion.x", "motion.v"]
    knowns = [*REAL_INPUTS, *real_parameters(hull)]
    expected = by_writing(fmu, unknowns, knowns)
    found = directional(fmu, unknowns, knowns)
    speed = unknowns.index("motion.speed")
    assert (found[speed, knowns.index("initial.u")] == pytest.approx(1.0)) is not trim
    assert_close(found, expected)
    if fmi == 3:
        np.testing.assert_allclose(adjoint(fmu, unknowns, knowns), found, rtol=1e-12, atol=1e-12)


def test_derivatives_of_what_is_no_unknown_are_refused(fmi: int, instantiate: Instantiate, status: Status) -> None:
    fmu = initialising(instantiate("hull", fmi, "ModelExchange"), False)
    for unknown, known in (
        ("rudder.command", "initial.u"),
        ("motion.speed", "steering.failed"),
        ("motion.speed", "motion.u"),
        ("motion.speed", "force.N"),
    ):
        references = fmu.unpacked.references([unknown]), fmu.unpacked.references([known])
        assert status(fmu.instance.getDirectionalDerivative, *references, [1.0]) == ERROR
    assert len(fmu.log) == 4
