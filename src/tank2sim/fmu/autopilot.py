"""The FMU of a heading autopilot, and a ship's FMU steered by it: the smallest master that joins the two."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tank2sim.analysis.heading.piloted import CoSimulated, StepError
from tank2sim.analysis.heading.runs import HeadingLoop
from tank2sim.arrays import Array
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tank2sim.fmu.export import ExportedFmu, make_fmu, named_after
from tank2sim.fmu.libraries import ProgressReport
from tank2sim.fmu.platforms import Platform
from tank2sim.fmu.provenance import Documents, ValueOrigin
from tank2sim.fmu.running import RunningFmu, running
from tank2sim.fmu.unpacking import unpack

_COMMANDED = "heading.command"


@dataclass(frozen=True, eq=False)
class SteeredRun:
    """Two FMUs together, at their communication points (n,): s, rad, and each order (n,) by its name, SI."""

    time_s: Array
    heading_rad: Array
    orders: Mapping[str, Array]


def make_autopilot_fmu(
    autopilot: Model,
    source: str,
    *,
    fmi: int = 2,
    file: Path | None = None,
    platforms: Sequence[Platform] | None = None,
    report: ProgressReport = lambda _: None,
) -> ExportedFmu:
    """The FMU of an autopilot, which says how it was found.

    Its inputs (``motion.psi``, ``motion.r``, ``heading.command``, and of a craft ``motion.u`` and ``speed.command``)
    and its orders are called as the signals of the ship's FMU. Other parameters and errors are those of
    :func:`tank2sim.fmu.export.make_fmu`.

    `source`: how it was found, in a sentence. `file`: where it goes: its modelName is the name of the file.
    """
    tuned = (parameter.name for parameter in autopilot.parameters if parameter.name.startswith("autopilot."))
    documents = Documents(source=source, origins={name: ValueOrigin(source) for name in tuned})
    documents = named_after(documents, file) if file else documents
    return make_fmu(autopilot, fmi=fmi, documents=documents, platforms=platforms, report=report)


def co_simulate_heading(
    ship: Path, autopilot: Path, heading_rad: float, *, step_s: float, duration_s: float
) -> SteeredRun:
    """Co-simulate a ship and an autopilot through FMPy: one change of the ordered heading at t = 0.

    At each communication point the autopilot hears the motion of the ship, and the ship its orders, which it holds
    for the step; then both go on. An order is half a step old on average, so that the error falls in proportion to the
    step. Both may be of FMI 2.0 or 3.0.

    `ship`, `autopilot`: FMUs. What the autopilot orders are its outputs called ``*.command``, what it hears its inputs
    ``motion.*``. `step_s`, `duration_s`: communication step, and length of the run, a whole number of steps. Raises
    InputError: a file is not an FMU that runs here, offers no Co-Simulation, or lacks a signal of the two.
    """
    count = round(duration_s / step_s)
    time = np.asarray(step_s * np.arange(count + 1), dtype=np.float64)
    heading = np.empty(count + 1)
    with ExitStack() as stack:
        pilot, signals = _opened(stack, autopilot, ())
        if _COMMANDED not in signals:
            raise _lacking(autopilot, _COMMANDED)
        seen = [name for name in signals if name.startswith("motion.")]
        ordered = [name for name, causality in signals.items() if name.endswith(".command") and causality == "output"]
        hull, _ = _opened(stack, ship, [*seen, *ordered])
        hull.initialise({})
        pilot.initialise({_COMMANDED: heading_rad})
        orders = np.empty((count + 1, len(ordered)))
        for place, instant in enumerate(time):
            heard = hull.read(seen)
            pilot.write(dict(zip(seen, heard, strict=True)))
            heading[place], orders[place] = heard[seen.index("motion.psi")], pilot.read(ordered)
            if place == count:
                break
            pilot.instance.doStep(currentCommunicationPoint=instant, communicationStepSize=step_s)
            hull.write(dict(zip(ordered, orders[place], strict=True)))
            hull.instance.doStep(currentCommunicationPoint=instant, communicationStepSize=step_s)
    return SteeredRun(time, heading, dict(zip(ordered, orders.T, strict=True)))


def _opened(stack: ExitStack, path: Path, names: Sequence[str]) -> tuple[RunningFmu, dict[str, str]]:
    """An FMU that runs, and its signals with their causality."""
    folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="tank2sim-")))
    unpacked = unpack(path, folder)
    known = {variable.name: variable.causality for variable in unpacked.description.modelVariables}
    for name in names:
        if name not in known:
            raise _lacking(path, name)
    if "CoSimulation" not in unpacked.kinds:
        raise InputError(path, "", "offers no Co-Simulation", _REMEDY)
    signals = {name: causality for name, causality in known.items() if causality in ("input", "output")}
    return stack.enter_context(running(unpacked, "CoSimulation")), signals


_REMEDY = "give the FMU of a ship, and the FMU of an autopilot for it"


def _lacking(path: Path, name: str) -> InputError:
    return InputError(path, "", f"has no {name}", _REMEDY)


def loop_difference(
    ship: Model, autopilot: Model, fmus: tuple[Path, Path], heading_rad: float, *, steps_s: Sequence[float]
) -> CoSimulated:
    """Hold the co-simulation of two FMUs against the closed loop simulated as one model.

    `ship`, `autopilot`: what the FMUs are of. `fmus`: FMU of the ship and FMU of the autopilot. `heading_rad`: change
    of course. `steps_s`: communication steps to try, whole numbers of the models' steps, two at least.
    """
    values = {parameter.name: parameter.start for parameter in ship.parameters}
    longest = max(steps_s)
    duration = longest * round(20 * values["ship.length"] / values["ship.speed"] / longest)
    direct = HeadingLoop(ship, autopilot).run({"heading.command": heading_rad}, duration)
    errors = {}
    for step in steps_s:
        run = co_simulate_heading(*fmus, heading_rad, step_s=step, duration_s=duration)
        errors[step] = _difference(run, direct.t, direct["motion.psi"])
    steps = sorted(errors)
    order = np.log(errors[steps[-1]] / errors[steps[0]]) / np.log(steps[-1] / steps[0])
    return CoSimulated(tuple(StepError(step, errors[step]) for step in steps), float(order))


def _difference(run: SteeredRun, time: Array, heading: Array) -> float:
    return float(np.degrees(np.abs(run.heading_rad - np.interp(run.time_s, time, heading)).max()))


def verify_together(ship: Model, autopilot: Model, made: ExportedFmu) -> CoSimulated:
    """The agreement of an autopilot's FMU with a ship's of the same version of FMI, on a change of course by 20 deg.

    Communication steps are 2, 4, 10 and 20 steps of the ship's integration. Raises as :func:`loop_difference`.
    """
    steps = [count * ship.step_s for count in (20, 10, 4, 2)]
    with tempfile.TemporaryDirectory(prefix="tank2sim-") as folder:
        paths = Path(folder) / "ship.fmu", Path(folder) / "autopilot.fmu"
        paths[0].write_bytes(make_fmu(ship, fmi=made.fmi).content)
        paths[1].write_bytes(made.content)
        return loop_difference(ship, autopilot, paths, math.radians(20.0), steps_s=steps)
