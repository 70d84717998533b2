"""How the tests drive an FMU, and what the model itself answers."""

from __future__ import annotations

import ctypes
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from tank2sim.dynamics.model import Model
from tank2sim.fmu.running import RunningFmu
from tank2sim.fmu.unpacking import UnpackedFmu
from tank2sim.simulation.scheme import runge_kutta_step

OK, DISCARD, ERROR = 0, 2, 3
STATES = [f"motion.{name}" for name in ("x", "y", "psi", "u", "v", "r")] + ["rudder.angle"]

FmuFile = Callable[[str, int], Path]
ShipFmu = Callable[[int], Path]
Unpacked = Callable[[str, int], UnpackedFmu]
Instantiate = Callable[..., RunningFmu]
Slave = Callable[..., RunningFmu]
Status = Callable[..., int]
"""Fixtures of ``conftest.py``: FMU of a small model, of the Mariner, unpacked; instances, one of the hull, statuses."""


def begun(fmu: RunningFmu, **inputs: float) -> RunningFmu:
    """Through initialisation, with these inputs (a dot written as two underscores)."""
    fmu.initialise({name.replace("__", "."): value for name, value in inputs.items()})
    return fmu


def steps(fmu: RunningFmu, count: int, size: float = 0.1, begin: float = 0.0) -> list[float]:
    for place in range(count):
        fmu.instance.doStep(currentCommunicationPoint=begin + place * size, communicationStepSize=size)
    return fmu.read(STATES)


def time_of(fmu: RunningFmu) -> float:
    """Time of an instance: value reference 0, which FMI 2 does not have in its description."""
    read = fmu.instance.getReal if fmu.unpacked.fmi == 2 else fmu.instance.getFloat64
    return float(read([0])[0])


def untyped(fmu: RunningFmu) -> ctypes.CDLL:
    """The same library without FMPy's checks of argument types, to hand it what FMPy would not."""
    return ctypes.CDLL(fmu.instance.dll._name)


def by_casadi(model: Model, count: int, size: float, **inputs: float) -> list[float]:
    """States after `count` steps of the scheme, from the model."""
    step, x, p = runge_kutta_step(model), model.initial(model.parameter_values()), model.parameter_values()
    u = model.input_values({name.replace("__", "."): value for name, value in inputs.items()})
    for _ in range(count):
        x = step(x, u, p, size)
    return [float(value) for value in np.array(x).ravel()]


def rewritten(source: Path, target: Path, change: Callable[[str, bytes], bytes]) -> Path:
    """An FMU with other contents of its files."""
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(target, "w") as new:
        for entry in old.infolist():
            new.writestr(entry, change(entry.filename, old.read(entry)))
    return target
