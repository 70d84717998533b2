"""Our FMU beside its peers, in one run: the same ship by hand in C, by PythonFMU and by CasADi's own exporter.

From C: one step of Co-Simulation against the Runge-Kutta step written by hand (``fmu_step.py``), and one evaluation of
the right-hand side in Model Exchange against CasADi's FMU (``DaeBuilder.export_fmu``), which cannot co-simulate.
Through FMPy: one step of Co-Simulation against a slave of PythonFMU with numpy, whose library needs a Python around it.
Export: the time until the FMU can run here. A peer that is not installed is skipped. Peers must agree to 1e-9.

    pip install tank2sim[peers]
    python benchmarks/fmu_peers.py
"""

from __future__ import annotations

import contextlib
import importlib.util
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from unittest import mock

import casadi as ca
import fmpy
import numpy as np
from fmu_step import AGREEMENT, AIM, library_of, measure, ship_numbers

from tank2sim.cards import read_card
from tank2sim.dynamics import Model, build
from tank2sim.fmu.export import ExportedFmu, write_fmu
from tank2sim.fmu.running import RunningFmu, running
from tank2sim.fmu.unpacking import unpack
from tank2sim.native.compiler import FLAGS, require_compiler

HERE = Path(__file__).parent / "fmu_peers"
HEADERS = Path(fmpy.__file__).parent / "c-code"
STEP, HALF_PERIOD, ORDER = 0.1, 50.0, 0.35
STATES = ["motion.x", "motion.y", "motion.psi", "motion.u", "motion.v", "motion.r", "rudder.angle"]
REPETITIONS, EVALUATIONS = 21, 100_000
STEPS_IN_PYTHON, TURNS = 1000, 9
EXPORTS = 3
PYTHONFMU, CASADI = "PythonFMU with numpy", "CasADi's export_fmu"


def reason_to_skip(peer: str) -> str:
    """Why a peer cannot be measured here; empty if it can."""
    if peer == PYTHONFMU and importlib.util.find_spec("pythonfmu") is None:
        return "pythonfmu is not installed (the extra 'peers')"
    if peer == CASADI and not hasattr(ca.DaeBuilder, "compile_fmu"):  # its exporter wrote something else before 3.8
        return f"the exporter of CasADi {ca.CasadiMeta.version()} is another one: 3.8 is needed"
    return ""


def told(peer: str) -> bool:
    """Whether a peer can be measured; if not, prints why."""
    reason = reason_to_skip(peer)
    if reason:
        print(f"  {peer}: skipped, {reason}")
    return not reason


def timed(action: Callable[[], object]) -> tuple[float, float]:
    """Medians of the seconds that an action takes, and of those of a core, its compilers' with them."""
    taken, used = [], []
    for _ in range(EXPORTS):
        begun, before = time.perf_counter(), sum(os.times()[:4])
        action()
        taken.append(time.perf_counter() - begun)
        used.append(sum(os.times()[:4]) - before)
    return statistics.median(taken), statistics.median(used)


def voyage(fmu: RunningFmu, steps: int) -> tuple[float, list[float]]:
    """A zigzag of a new instance through FMPy: seconds a step, and the states at the end."""
    fmu.initialise({})
    do_step, taken = fmu.instance.doStep, 0.0
    for first in range(0, steps, round(HALF_PERIOD / STEP)):
        fmu.write({"rudder.command": ORDER if (first * STEP // HALF_PERIOD) % 2 == 0 else -ORDER})
        times = [place * STEP for place in range(first, min(steps, first + round(HALF_PERIOD / STEP)))]
        begun = time.thread_time()  # of a core: what else the machine does is not measured
        for moment in times:
            do_step(currentCommunicationPoint=moment, communicationStepSize=STEP)
        taken += time.thread_time() - begun
    return taken / steps, fmu.read(STATES)


def through_fmpy(files: dict[str, Path], folder: Path) -> tuple[dict[str, float], dict[str, list[float]]]:
    """Median seconds a step of each FMU, by turns, and its states after the last."""
    fmus = {name: unpack(file, folder / f"{file.stem}-unpacked") for name, file in files.items()}
    times: dict[str, list[float]] = {name: [] for name in fmus}
    states = {}
    for _ in range(TURNS):
        for name, fmu in fmus.items():
            with running(fmu, "CoSimulation") as instance:
                taken, states[name] = voyage(instance, STEPS_IN_PYTHON)
                times[name].append(taken)
    return {name: statistics.median(column) for name, column in times.items()}, states


def differ(a: Sequence[float], b: Sequence[float]) -> float:
    x, y = np.array(a), np.array(b)
    return float(np.max(np.abs(x - y) / (1 + np.abs(x))))


def python_slave(model: Model, folder: Path) -> Path:
    """The ship by PythonFMU."""
    from pythonfmu import FmuBuilder

    numbers = folder / "ship.txt"
    numbers.write_text("\n".join(repr(number) for number in ship_numbers(model)), encoding="utf-8")
    built: Path = FmuBuilder.build_FMU(HERE / "mariner_slave.py", folder, project_files=[numbers])
    return built


def casadi_library(model: Model, folder: Path) -> tuple[Path, str, int]:
    """The ship by CasADi's exporter, compiled as ours: its library, its token and the reference of the order."""
    ship = ca.DaeBuilder("casadi_mariner")
    x = [ship.add(state.name, "local", "continuous", {}) for state in model.states]
    u = [ship.add(i.name, "input", "continuous", {"start": float(i.start)}) for i in model.inputs]
    p = [ship.add(q.name, "parameter", "tunable", {"start": float(q.start)}) for q in model.parameters]
    rates = model.rhs(ca.vertcat(*x), ca.vertcat(*u), ca.vertcat(*p))
    for place, state in enumerate(x):
        ship.eq(ship.der(state), rates[place])
    with contextlib.chdir(folder):
        files = ship.export_fmu({"no_warning": True, "with_serialization": False})
        sources = [name for name in files if name.endswith(".c")]
        library = folder / "casadi_mariner.so"
        compiler = [*require_compiler("the benchmark"), *FLAGS, "-shared", "-fPIC", "-w", f"-I{HEADERS}"]
        subprocess.run([*compiler, *sources, "-o", str(library), "-lm"], check=True)
        description = fmpy.model_description.read_model_description(str(folder), validate=False)
    (order,) = (v.valueReference for v in description.modelVariables if v.name == "rudder.command")
    return library, description.instantiationToken, order


def right_hand_sides(ours: tuple[ExportedFmu, int], theirs: tuple[Path, str, int], folder: Path) -> dict[str, object]:
    """Nanoseconds an evaluation of ours and theirs, their largest difference, and what theirs says to doStep."""
    driver, (fmu, order) = folder / "exchange", ours
    compiler = [*require_compiler("the benchmark"), *FLAGS, f"-I{HEADERS}"]
    subprocess.run([*compiler, str(HERE / "exchange.c"), "-o", str(driver), "-ldl", "-lm"], check=True)
    words = [library_of(fmu, folder), fmu.token, order, *theirs, REPETITIONS, EVALUATIONS]
    done = subprocess.run([str(driver), *map(str, words)], check=True, capture_output=True, text=True)
    *lines, difference, answer = done.stdout.splitlines()
    rows = [[float(word) for word in line.split()] for line in lines]
    a, b = (statistics.median(column) for column in zip(*rows, strict=True))
    ratio = statistics.median(row[1] / row[0] for row in rows)
    return {"ours_ns": a, "casadi_ns": b, "ratio": ratio, "difference": float(difference), "co_simulation": answer}


def step_in_c(folder: Path) -> dict[str, float]:
    times, difference = measure(folder)
    hand, fmi2, fmi3, *_ = (statistics.median(column) for column in zip(*times, strict=True))
    ratios = [statistics.median(row[place] / row[0] for row in times) for place in (1, 2)]
    found = {"hand_ns": hand, "fmi2_ns": fmi2, "fmi3_ns": fmi3, "fmi2_ratio": ratios[0], "fmi3_ratio": ratios[1]}
    print("One step of 0.1 s, called from C")
    print(f"  written by hand          {hand:9.1f} ns")
    print(f"  fmi2DoStep               {fmi2:9.1f} ns   {ratios[0]:.3f} times (aim {AIM})")
    print(f"  fmi3DoStep               {fmi3:9.1f} ns   {ratios[1]:.3f} times (aim {AIM})")
    return {**found, "difference": difference}


def step_in_python(model: Model, folder: Path) -> dict[str, float]:
    files = {f"ours, FMI {fmi}": folder / f"mariner{fmi}.fmu" for fmi in (2, 3)}
    print("One step of 0.1 s, called through FMPy")
    if told(PYTHONFMU):
        files[PYTHONFMU] = python_slave(model, folder)
    times, states = through_fmpy(files, folder)
    first, *_ = files
    for name, seconds in times.items():
        print(f"  {name:24} {seconds * 1e6:9.2f} us   {seconds / times[first]:.2f} times")
    found = {name: seconds * 1e6 for name, seconds in times.items()}
    return {**found, "difference": max(differ(states[first], other) for other in states.values())}


def evaluations(model: Model, folder: Path) -> dict[str, object]:
    print("One evaluation of the right-hand side in Model Exchange (FMI 3), called from C")
    if not told(CASADI):
        return {"difference": 0.0}
    fmu = write_fmu(model, folder / "exchange.fmu", fmi=3)
    (order,) = unpack(folder / "exchange.fmu", folder / "exchange-unpacked").references(["rudder.command"])
    found = right_hand_sides((fmu, order), casadi_library(model, folder), folder)
    print(f"  ours                     {found['ours_ns']:9.1f} ns")
    print(f"  {CASADI:24} {found['casadi_ns']:9.1f} ns   {found['ratio']:.2f} times ours")
    print(f"  its Co-Simulation: {found['co_simulation']}")
    return found


def anew(model: Model, fmu: Path, fmi: int) -> None:
    """Our export with nothing in the cache of compiled libraries."""
    with tempfile.TemporaryDirectory() as cache, mock.patch.dict(os.environ, {"XDG_CACHE_HOME": cache}):
        write_fmu(model, fmu, fmi=fmi)


def exports(model: Model, folder: Path) -> dict[str, tuple[float, float]]:
    actions: dict[str, Callable[[], object]] = {
        "ours, FMI 2": lambda: anew(model, folder / "timed2.fmu", 2),
        "ours, FMI 3": lambda: anew(model, folder / "timed3.fmu", 3),
        "ours, FMI 2, again": lambda: write_fmu(model, folder / "timed2.fmu", fmi=2),  # its library is kept
        CASADI: lambda: casadi_library(model, folder),
        PYTHONFMU: lambda: python_slave(model, folder),  # nothing is compiled: the library is PythonFMU's own
    }
    print("Export for this machine, from the model to what can run")
    found = {name: timed(action) for name, action in actions.items() if told(name)}
    for name, (seconds, of_a_core) in found.items():
        print(f"  {name:24} {seconds:9.2f} s    {of_a_core:.2f} s of a core")
    return found


def main() -> int:
    model = build(read_card("mariner"))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        in_c = step_in_c(folder)
        in_python = step_in_python(model, folder)
        exchange = evaluations(model, folder)
        export = exports(model, folder)
    figures = {"in_c": in_c, "through_fmpy": in_python, "right_hand_side": exchange, "export": export}
    differences = [float(str(part["difference"])) for part in (in_c, in_python, exchange)]
    print(f"Largest difference of the results: {max(differences):.1e} relative (must be below {AGREEMENT})")
    if len(sys.argv) > 1:
        Path(sys.argv[1]).write_text(json.dumps(figures, indent=2), encoding="utf-8")
    return 0 if max(differences) < AGREEMENT and max(in_c["fmi2_ratio"], in_c["fmi3_ratio"]) <= AIM else 1


if __name__ == "__main__":
    sys.exit(main())
