"""Running an FMU through FMPy: the same run as Co-Simulation and as Model Exchange, FMI 2.0 or 3.0."""

from __future__ import annotations

import contextlib
import io
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import fmpy.fmi2
import fmpy.fmi3
import numpy as np
from fmpy.sundials import CVodeSolver

from tank2sim.arrays import Array
from tank2sim.fmu.manoeuvre import InputSequence
from tank2sim.fmu.unpacking import FmuType, UnpackedFmu, unpack

if TYPE_CHECKING:  # the processes that drive an FMU import this module, and would wait for CasADi
    from tank2sim.dynamics.model import Model

_TOLERANCE = 1e-10
_MOST_SOLVER_STEPS = 1_000_000


@dataclass
class RunningFmu:
    """An instance in FMPy, spoken to alike in both versions of FMI; its log is kept."""

    unpacked: UnpackedFmu
    instance: Any
    log: list[str] = field(default_factory=list)

    @property
    def _calls(self) -> tuple[Callable[..., Any], Callable[..., Any]]:
        if self.unpacked.fmi == 2:
            return self.instance.getReal, self.instance.setReal
        return self.instance.getFloat64, self.instance.setFloat64

    def read(self, names: Sequence[str]) -> list[float]:
        """Values of variables; Booleans as 0 and 1."""
        values: dict[str, float] = {}
        for boolean, call in ((False, self._calls[0]), (True, self.instance.getBoolean)):
            chosen = [name for name in names if self.unpacked.boolean(name) is boolean]
            values |= dict(zip(chosen, call(self.unpacked.references(chosen)) if chosen else (), strict=True))
        return [float(values[name]) for name in names]

    def write(self, values: dict[str, float], *, discrete: bool = True) -> None:
        """Set variables; Boolean ones only if `discrete`."""
        real = {name: float(value) for name, value in values.items() if not self.unpacked.boolean(name)}
        boolean = {name: bool(value) for name, value in values.items() if name not in real}
        if real:
            self._calls[1](self.unpacked.references(list(real)), list(real.values()))
        if boolean and discrete:
            self.instance.setBoolean(self.unpacked.references(list(boolean)), list(boolean.values()))

    def initialise(self, inputs: dict[str, float]) -> None:
        """From instantiation into the first mode of simulation, with these inputs."""
        if self.unpacked.fmi == 2:
            self.instance.setupExperiment(startTime=0.0)
        self.instance.enterInitializationMode()
        self.write(inputs)
        self.instance.exitInitializationMode()

    def update(self) -> None:
        """Leave event mode for continuous time (Model Exchange)."""
        if self.unpacked.fmi == 2:
            self.instance.newDiscreteStates()
        else:
            self.instance.updateDiscreteStates()
        self.instance.enterContinuousTimeMode()


@contextmanager
def running(
    unpacked: UnpackedFmu, kind: FmuType, *, logging: bool = False, log: list[str] | None = None
) -> Iterator[RunningFmu]:
    """An instance of an FMU, freed at the end whatever happens; what it logs is added to `log`, if given."""
    interface = unpacked.description.modelExchange if kind == "ModelExchange" else unpacked.description.coSimulation
    classes: dict[tuple[int, FmuType], Any] = {
        (2, "ModelExchange"): fmpy.fmi2.FMU2Model,
        (2, "CoSimulation"): fmpy.fmi2.FMU2Slave,
        (3, "ModelExchange"): fmpy.fmi3.FMU3Model,
        (3, "CoSimulation"): fmpy.fmi3.FMU3Slave,
    }
    instance = classes[unpacked.fmi, kind](
        guid=unpacked.description.guid,
        unzipDirectory=str(unpacked.folder),
        modelIdentifier=interface.modelIdentifier,
        instanceName="check",
    )
    run = RunningFmu(unpacked, instance, [] if log is None else log)

    def record(*arguments: Any) -> None:
        run.log.append(arguments[-1].decode("utf-8", "replace"))

    if unpacked.fmi == 2:
        callbacks = fmpy.fmi2.fmi2CallbackFunctions()
        callbacks.logger = fmpy.fmi2.fmi2CallbackLoggerTYPE(record)
        callbacks.allocateMemory = fmpy.fmi2.fmi2CallbackAllocateMemoryTYPE(fmpy.calloc)
        callbacks.freeMemory = fmpy.fmi2.fmi2CallbackFreeMemoryTYPE(fmpy.free)
        instance.instantiate(callbacks=callbacks, loggingOn=logging)
    else:
        instance.instantiate(logMessage=record, loggingOn=logging)
    try:
        yield run
    finally:
        instance.freeInstance()


def co_simulate(fmu: RunningFmu, run: InputSequence, inputs: Sequence[str], outputs: Sequence[str]) -> Array:
    """Outputs (K + 1, ny) at the communication points of a Co-Simulation."""
    fmu.initialise(dict(zip(inputs, run.inputs[0], strict=True)))
    rows = [fmu.read(outputs)]
    held = run.inputs[0]
    for place, (begin, end) in enumerate(zip(run.times[:-1], run.times[1:], strict=True)):
        if (run.inputs[place] != held).any():
            held = run.inputs[place]
            fmu.write(dict(zip(inputs, held, strict=True)))
        fmu.instance.doStep(currentCommunicationPoint=begin, communicationStepSize=end - begin)
        rows.append(fmu.read(outputs))
    return np.array(rows)


def exchange(fmu: RunningFmu, run: InputSequence, inputs: Sequence[str], outputs: Sequence[str]) -> Array:
    """Outputs (K + 1, ny) at the communication points of a Model Exchange, integrated by FMPy's CVode."""
    fmu.initialise(dict(zip(inputs, run.inputs[0], strict=True)))
    fmu.update()
    rows = [fmu.read(outputs)]
    solver = _solver(fmu)
    for first, behind in run.pieces():
        if first > 0:
            fmu.instance.enterEventMode()
            fmu.write(dict(zip(inputs, run.inputs[first], strict=True)))
            fmu.update()
            solver.reset(run.times[first])
        for begin, end in zip(run.times[first:behind], run.times[first + 1 : behind + 1], strict=True):
            _solve(fmu, solver, begin, end)
            rows.append(fmu.read(outputs))
    return np.array(rows)


def _solve(fmu: RunningFmu, solver: Any, begin: float, end: float) -> None:
    """From `begin` to `end`, again from each place where an event indicator changes sign."""
    time_s = begin
    while time_s < end:
        event, _, time_s = solver.step(time_s, end)
        fmu.instance.setTime(time_s)
        if event:
            fmu.instance.enterEventMode()
            fmu.update()
            solver.reset(time_s)


class _NoInputs:
    def apply(self, time: float) -> None:
        """Inputs change between the solver's runs only."""


def _solver(fmu: RunningFmu) -> Any:
    instance, description = fmu.instance, fmu.unpacked.description
    return CVodeSolver(
        nx=description.numberOfContinuousStates,
        nz=description.numberOfEventIndicators,
        get_x=instance.getContinuousStates,
        set_x=instance.setContinuousStates,
        get_dx=instance.getDerivatives if fmu.unpacked.fmi == 2 else instance.getContinuousStateDerivatives,
        get_z=instance.getEventIndicators,
        get_nominals=instance.getNominalsOfContinuousStates,
        set_time=instance.setTime,
        input=_NoInputs(),
        startTime=0.0,
        relativeTolerance=_TOLERANCE,
        maxNumSteps=_MOST_SOLVER_STEPS,
    )


def replay(path: Path, run: InputSequence, model: Model) -> dict[str, Array]:
    """Outputs (K + 1,) by name, at the communication points of a run, in Co-Simulation.

    Raises InputError: the file is not an FMU for this machine.
    """
    with contextlib.redirect_stdout(io.StringIO()), tempfile.TemporaryDirectory(prefix="tank2sim-") as folder:
        unpacked = unpack(Path(path), Path(folder))
        with running(unpacked, "CoSimulation") as fmu:
            rows = co_simulate(fmu, run, model.input_names, model.outputs)
    return dict(zip(model.outputs, rows.T, strict=True))
