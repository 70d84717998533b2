"""An FMU driven in a process of its own, because a library can end the process that loads it."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from fmpy.model_description import read_model_description

from tank2sim.arrays import Array
from tank2sim.fmu.manoeuvre import InputSequence
from tank2sim.fmu.running import co_simulate, exchange, running
from tank2sim.fmu.unpacking import FmuType, UnpackedFmu

_LONGEST_S = 900.0
_ENTRY = "import sys; from tank2sim.fmu.process import drive_in_process; drive_in_process(*sys.argv[1:])"


@dataclass(frozen=True, kw_only=True)
class Drive:
    """Drive for an FMU, and the names of the inputs, outputs (ny) and parameters (np) to write and read."""

    kind: FmuType
    run: InputSequence
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    parameters: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class ProcessResult:
    """Results of such a run."""

    parameters: Array | None = None  # (np,): Values after instantiation; None if it did not come so far
    outputs: Array | None = None  # (K + 1, ny): Values at the communication points; None if it did not come so far
    problem: str = ""  # What went wrong, in one line; empty if nothing


def drive_apart(unpacked: UnpackedFmu, drive: Drive) -> ProcessResult:
    """Drive an FMU in a process of its own. Whatever the library does there is part of the answer, never raised."""
    with tempfile.TemporaryDirectory(prefix="tank2sim-") as name:
        task, answer = Path(name, "task.npz"), Path(name, "answer.npz")
        names: dict[str, Any] = {
            key: np.array(getattr(drive, key), dtype=str) for key in ("inputs", "outputs", "parameters")
        }
        np.savez(task, times=drive.run.times, held=drive.run.inputs, **names)
        command = [sys.executable, "-P", "-c", _ENTRY, str(unpacked.folder), drive.kind, str(task), str(answer)]
        try:
            code = _run_alone(command, os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))})
        except subprocess.TimeoutExpired:
            return ProcessResult(problem=f"the library did not come to an end in {_LONGEST_S:g} s")
        if code != 0 or not answer.exists():
            return ProcessResult(problem=f"the library ended the process that ran it ({_end(code)})")
        with np.load(answer) as found:
            return ProcessResult(
                parameters=found.get("parameters"), outputs=found.get("outputs"), problem=str(found["problem"])
            )


def _run_alone(command: list[str], environment: dict[str, str]) -> int:
    """Run a command in its own process group, which ends with it; TimeoutExpired if it takes longer than allowed."""
    nothing = subprocess.DEVNULL  # a pipe would be held open by a process that the library has started
    new_session = os.name == "posix"
    with subprocess.Popen(
        command, env=environment, stdin=nothing, stdout=nothing, stderr=nothing, start_new_session=new_session
    ) as process:
        try:
            return process.wait(_LONGEST_S)
        finally:
            _end_group(process)


def _end_group(process: subprocess.Popen[bytes]) -> None:
    """End a process and those that it started, also if it has ended itself."""
    if os.name == "posix":
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(process.pid, signal.SIGKILL)
    else:
        kill = ["taskkill", "/F", "/T", "/PID", str(process.pid)]
        subprocess.run(kill, capture_output=True, check=False)


def drive_in_process(folder: str, kind: FmuType, task: str, answer: str) -> None:
    """Drive the FMU in `folder` as the file `task` says and write what came of it to the file `answer`."""
    drive = {"ModelExchange": exchange, "CoSimulation": co_simulate}[kind]
    found: dict[str, Any] = {}
    log: list[str] = []
    problem = ""
    with np.load(task) as given:
        run = InputSequence(given["times"], given["held"])
        inputs, outputs, parameters = (given[key].tolist() for key in ("inputs", "outputs", "parameters"))
    try:
        unpacked = UnpackedFmu(Path(folder), read_model_description(folder, validate=False))
        with running(unpacked, kind, log=log) as fmu:
            found["parameters"] = np.array(fmu.read(parameters))
            found["outputs"] = drive(fmu, run, inputs, outputs)
    except Exception as error:  # fmpy and ctypes raise many kinds, Exception itself among them
        words = f"{error} {' '.join(log)}".replace(f"{folder}{os.sep}", "")
        problem = " ".join(words.split()) or type(error).__name__
    np.savez(answer, problem=np.array(problem), **found)


def _end(code: int) -> str:
    try:
        return signal.Signals(-code).name
    except ValueError:
        return f"exit code {code}"
