"""An FMU driven through given inputs, by fmpy, as a simulator would drive it."""

from __future__ import annotations

import contextlib
import io
import tempfile
from pathlib import Path

from tank2sim.arrays import Array
from tank2sim.dynamics.model import Model
from tank2sim.fmu.manoeuvre import InputSequence
from tank2sim.fmu.running import co_simulate, running
from tank2sim.fmu.unpacking import unpack


def replay(path: Path, run: InputSequence, model: Model) -> dict[str, Array]:
    """Outputs (K + 1,) by name, at the communication points of a run, in Co-Simulation.

    Raises
    ------
    InputError
        The file is not an FMU for this machine.
    """
    with contextlib.redirect_stdout(io.StringIO()), tempfile.TemporaryDirectory(prefix="tank2sim-") as folder:
        unpacked = unpack(Path(path), Path(folder))
        with running(unpacked, "CoSimulation") as fmu:
            rows = co_simulate(fmu, run, model.input_names, model.outputs)
    return dict(zip(model.outputs, rows.T, strict=True))
