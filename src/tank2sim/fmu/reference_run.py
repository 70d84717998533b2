"""The reference result that an FMU carries: a manoeuvre, and what the CasADi model answered to it.

A ship does a 20/20 zigzag, anything else the steps of every input with which an FMU is checked. Both lie in the FMU as
CSV files in SI: the inputs, which jump where a time is given twice (so FMPy takes them), and the outputs at the
communication points by the very steps of Co-Simulation.
"""

from __future__ import annotations

import hashlib
import io
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tank2sim.arrays import Array
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tank2sim.fmu.manoeuvre import InputSequence, manoeuvre
from tank2sim.fmu.reference import by_scheme
from tank2sim.fmu.templates import render
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.manoeuvres import Turn, Zigzag
from tank2sim.simulation.run import Run, simulate
from tank2sim.simulation.trajectory import Trajectory

EXTRA = "extra/org.tank2sim"
"""Folder of an FMU in which what is the program's own lies (FMI 3.0, 2.5.1: a domain name in reverse)."""

INPUTS_FILE, OUTPUTS_FILE = f"{EXTRA}/reference_in.csv", f"{EXTRA}/reference_out.csv"

LAYERED, LAYERED_VERSION = "extra/org.fmi-standard.fmi-ls-ref", "1.0.0-alpha.1"
"""Folder and version of the FMI Layered Standard References, which says what files of an FMU are for."""

_EXPERIMENT = "reference.exp"  # in the Experiments Format of the Modelica Association (ma-hs-experiments, a draft)

_ZIGZAG = Zigzag(math.radians(20.0), math.radians(20.0))
_TURN = Turn(math.radians(35.0))
_MOST_POINTS = 500  # enough to draw the run by; all steps would make the file larger than the rest of the FMU
_SHIP = ("rudder.command", "motion.psi", "ship.length", "ship.speed", "ship.slowest", "ship.fastest")


@dataclass(frozen=True)
class ReferenceRun:
    """A run, and the answer to it."""

    title: str  # What is done
    run: InputSequence  # Communication points and inputs
    # `input_names`, `output_names`: Names of the columns of the inputs and outputs.
    input_names: tuple[str, ...]
    output_names: tuple[str, ...]
    outputs: Array  # (K + 1, ny): Values at the communication points

    def files(self) -> dict[str, str]:
        """Name in the FMU to the text of its CSV files; 13 digits, so that what is read back differs by 1e-13."""
        table = np.column_stack([self.run.times, self.outputs])
        tables = {
            INPUTS_FILE: _csv(self.input_names, _with_jumps(self.run)),
            OUTPUTS_FILE: _csv(self.output_names, table),
        }
        return {**tables, **self._layered_standard(tables[OUTPUTS_FILE])}

    def _layered_standard(self, answer: str) -> dict[str, str]:
        """The experiment, and the manifest of FMI-LS-REF that names it; `answer` is the text of the outputs."""
        times = self.run.times
        experiment = render(
            "experiments.xml",
            {
                "name": self.title,
                "start": float(times[0]),
                "stop": float(times[-1]),
                "step": float(np.median(np.diff(times))),
                "inputs": f"../../{INPUTS_FILE}",
                "outputs": f"../../{OUTPUTS_FILE}",
            },
        )
        described = (
            (_EXPERIMENT, "application/x-ma-hs-experiments", "experiment/smoke-test", "Run to repeat", experiment),
            (f"../../{OUTPUTS_FILE}", "text/csv", "result", "Outputs of that run, SI", answer),
        )
        related = [
            {
                "source": source,
                "type": kind,
                "role": role,
                "description": description,
                "checksum": hashlib.sha3_256(text.encode("utf-8")).hexdigest(),
            }
            for source, kind, role, description, text in described
        ]
        manifest = render("fmi-ls-manifest.xml", {"version": LAYERED_VERSION, "related": related})
        return {f"{LAYERED}/{_EXPERIMENT}": experiment, f"{LAYERED}/fmi-ls-manifest.xml": manifest}


def reference_run(model: Model) -> tuple[ReferenceRun | None, dict[str, Run]]:
    """The reference run of a model, and standard manoeuvres of a ship: zigzag 20/20 and turning circle, 35 deg.

    The run is None, and manoeuvres are missing, where the motion leaves all bounds.
    """
    if not all(name in model for name in _SHIP):
        return _answered("steps of every input", manoeuvre(model), model), {}
    runs: dict[str, Run] = {}
    run = None
    integrator = Integrator(model, compiled=False)  # compiling would take longer than the runs
    try:
        zigzag = simulate(model, _ZIGZAG, integrator=integrator)
        runs["zigzag_20_20"] = zigzag
        run = _answered("zigzag 20/20", _at_points(zigzag.trajectory), model)
        runs["turn_35"] = simulate(model, _TURN, integrator=integrator)
    except InputError:  # the motion leaves all bounds: the passport says what is missing
        pass
    return run, runs


def read_reference(folder: Path) -> ReferenceRun | None:
    """The reference result in an unpacked FMU; None if it carries none.

    Raises InputError: the files are damaged.
    """
    inputs, outputs = folder / INPUTS_FILE, folder / OUTPUTS_FILE
    if not (inputs.is_file() and outputs.is_file()):
        return None
    input_names, given = _read(inputs)
    output_names, answered = _read(outputs)
    times = answered[:, 0]
    # The last row that is not later than the beginning of a step holds over the step.
    held = given[np.searchsorted(given[:, 0], times[:-1], side="right") - 1, 1:]
    return ReferenceRun("reference result", InputSequence(times, held), input_names, output_names, answered[:, 1:])


def _answered(title: str, run: InputSequence, model: Model) -> ReferenceRun | None:
    outputs = by_scheme(model, run)
    names = model.input_names, model.outputs
    return ReferenceRun(title, run, *names, outputs) if np.isfinite(outputs).all() else None


def _at_points(trajectory: Trajectory) -> InputSequence:
    """The orders of a run at communication points of equal distance, and at those where an order is given."""
    step, end = trajectory.model.step_s, float(trajectory.t[-1])
    distance = step * math.ceil(end / step / _MOST_POINTS)
    changes = trajectory.t[1:][(np.diff(trajectory.u, axis=0) != 0).any(axis=1)]
    grid = distance * np.arange(math.ceil(end / distance), dtype=float)
    points: Array = np.unique(np.concatenate([grid, changes, [end]]))
    points = np.asarray(points[np.append(True, np.diff(points) > 1e-6 * step)])
    rows = np.searchsorted(trajectory.t, points[:-1] + 1e-9 * step, side="right") - 1
    return InputSequence(points, trajectory.u[rows])


def _with_jumps(run: InputSequence) -> Array:
    """Rows of time and inputs at the ends of each stretch over which the inputs are held."""
    ends = [(run.times[point], run.inputs[first]) for first, behind in run.pieces() for point in (first, behind)]
    return np.array([[time, *row] for time, row in ends])


def _csv(names: tuple[str, ...], table: Array) -> str:
    text = io.StringIO()
    text.write(",".join(["time", *names]) + "\n")
    np.savetxt(text, table, fmt="%.14g", delimiter=",")
    return text.getvalue()


def _read(path: Path) -> tuple[tuple[str, ...], Array]:
    try:
        header, *rows = path.read_text(encoding="ascii").splitlines()
        names = tuple(header.split(",")[1:])
        table = np.array([[float(cell) for cell in row.split(",")] for row in rows]).reshape(len(rows), len(names) + 1)
    except ValueError as error:  # also text that is not ASCII
        raise InputError(path, "", f"is not a table of numbers ({error})", "export the FMU again") from None
    if len(table) < 2 or not np.isfinite(table).all():
        raise InputError(path, "", "is not a table of finite numbers", "export the FMU again")
    return names, table
