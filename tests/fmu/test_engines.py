"""One zigzag in engines of others: they must take the FMU without complaint, and all come to the same numbers."""

from __future__ import annotations

import dataclasses
import json
import logging
import re
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tank2sim.bundled import bundled_cards
from tank2sim.dynamics import Model
from tank2sim.fmu.manoeuvre import InputSequence
from tank2sim.fmu.running import co_simulate, running
from tank2sim.fmu.unpacking import UnpackedFmu, unpack
from tank2sim.simulation.scheme import runge_kutta_step
from tests.fmu import engines
from tests.fmu.descriptions import whole_description
from tests.fmu.driving import ShipFmu
from tests.marks import first_fast

STEP, STEPS = 0.1, 1000
AGREEMENT = 1e-12
"""Of an output's range in the run: the engines add up time in different ways, and the last bits follow."""

OUTPUTS = [f"motion.{name}" for name in ("x", "y", "psi", "u", "v", "r", "speed", "beta", "rdot")]
OUTPUTS += ["rudder.angle", "force.X", "force.N"]
START = {"initial.u": 6.5, "initial.psi": 0.3, "initial.x": -250.0}

# What an engine says of every FMU, by its own fault. FMI Library wants a start value of the independent variable, which
# the standard forbids (its issue 21); fmi4c asks for the version before it has loaded the library.
OWN_FAULTS = {
    "libcosimpy": r".*\[FMI Library: FMI2XML\] Start attribute is required for this causality, variability and .*",
    "ecospy": r'Function "fmi3GetVersion" is not provided by this FMU\.|Loading FMI version [23]\.\.\.',
}
RUNS = [
    ("libcosimpy", 2),  # its FMI 3 ends the process, with any FMU
    *((engine, fmi) for engine in ("ecospy", "fmuloader", "fmuloader_exchange") for fmi in (2, 3)),
]


def zigzag() -> list[dict[str, float | bool]]:
    """Orders of each step: 20 deg to each side by turns; the gear fails while the rudder is on its way across."""
    times = [place * STEP for place in range(STEPS)]
    sides = [0.35 if int(time // 25) % 2 == 0 else -0.35 for time in times]
    return [
        {"rudder.command": side, "steering.failed": 52 <= time < 60} for time, side in zip(times, sides, strict=True)
    ]


@pytest.fixture(scope="module")
def by_fmpy(
    mariner_fmu: ShipFmu, tmp_path_factory: pytest.TempPathFactory
) -> Callable[[int], tuple[UnpackedFmu, np.ndarray]]:
    """The FMU unpacked, and its outputs (K, ny) after each step in FMPy."""
    made: dict[int, tuple[UnpackedFmu, np.ndarray]] = {}

    def run(fmi: int) -> tuple[UnpackedFmu, np.ndarray]:
        if fmi not in made:
            unpacked = unpack(mariner_fmu(fmi), tmp_path_factory.mktemp(f"mariner{fmi}"))
            inputs = ["rudder.command", "steering.failed"]
            orders = np.array([[order[name] for name in inputs] for order in zigzag()], dtype=float)
            with running(unpacked, "CoSimulation") as fmu:
                fmu.write(START)
                rows = co_simulate(fmu, InputSequence(np.arange(STEPS + 1) * STEP, orders), inputs, OUTPUTS)
            made[fmi] = unpacked, rows[1:]
        return made[fmi]

    return run


@pytest.fixture(scope="module")
def by_the_model(mariner: Model) -> np.ndarray:
    """The same outputs (K, ny) from the model itself, by the same scheme."""
    model, rows = mariner, []
    step, parameters = runge_kutta_step(model), model.parameter_values(START)
    state = model.initial(parameters)
    for order in zigzag():
        inputs = model.input_values({name: float(value) for name, value in order.items()})
        state = step(state, inputs, parameters, STEP)
        answers = dict(zip(model.outputs, np.array(model.output(state, inputs, parameters)).ravel(), strict=True))
        rows.append([answers[name] for name in OUTPUTS])
    return np.array(rows)


def disagreement(found: np.ndarray, expected: np.ndarray) -> float:
    """The largest difference, relative to the range of its output in the run."""
    assert found.shape == expected.shape
    return float(np.max(np.abs(found - expected) / np.ptp(expected, axis=0)))


def require(module: str) -> None:
    if reason := engines.reason_to_skip(module):
        pytest.skip(reason)


def run_in(engine: str, unpacked: UnpackedFmu, path: Path, answer: Path) -> tuple[np.ndarray, list[str]]:
    """The zigzag in an engine: its outputs (K, ny), and what it said."""
    description = unpacked.description
    states = [entry.variable.derivative.name for entry in description.derivatives]
    task = engines.Task(
        engine=engine,
        fmu=str(path),
        fmi=unpacked.fmi,
        identifier=description.coSimulation.modelIdentifier,
        token=description.guid,
        references={variable.name: variable.valueReference for variable in description.modelVariables},
        start=START,
        orders=zigzag(),
        outputs=OUTPUTS,
        states=states,
        step=STEP,
    )
    done = subprocess.run(
        [sys.executable, engines.__file__, str(answer)],
        input=json.dumps(dataclasses.asdict(task)),
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    said = (done.stdout + done.stderr).splitlines()
    assert done.returncode == 0, f"{engine} ended with {done.returncode}: {said}"
    fault = OWN_FAULTS.get(engine)
    rows = np.array(json.loads(answer.read_text(encoding="utf-8")))
    return rows, [line for line in said if line.strip() and not (fault and re.fullmatch(fault, line.strip()))]


@first_fast("fmi", [2, 3])
def test_the_zigzag_of_fmpy_is_that_of_the_model(
    fmi: int, by_the_model: np.ndarray, by_fmpy: Callable[[int], Any]
) -> None:
    _, rows = by_fmpy(fmi)
    assert disagreement(rows, by_the_model) < AGREEMENT


@pytest.mark.slow
@pytest.mark.parametrize(("engine", "fmi"), RUNS)
def test_other_engines_come_to_the_same_numbers_without_complaint(
    engine: str, fmi: int, mariner_fmu: ShipFmu, by_fmpy: Callable[[int], Any], tmp_path: Path
) -> None:
    require(engine.removesuffix("_exchange"))
    unpacked, expected = by_fmpy(fmi)
    rows, said = run_in(engine, unpacked, mariner_fmu(fmi), tmp_path / "rows.json")
    assert said == []
    assert disagreement(rows, expected) < AGREEMENT


def found_by_the_toolbox(path: Path, caplog: pytest.LogCaptureFixture) -> list[str]:
    """What all checks of FMU Manipulation Toolbox complain of."""
    from fmu_manipulation_toolbox.checker import get_checkers
    from fmu_manipulation_toolbox.operations import FMU

    caplog.clear()
    with FMU(path) as opened, caplog.at_level(logging.INFO, "fmu_manipulation_toolbox"):
        for checker in get_checkers():
            opened.apply_operation(checker())
    return [record.getMessage() for record in caplog.records if record.levelno >= logging.WARNING]


def described(text: str, path: Path) -> Path:
    """An archive with a description alone, which is all that the toolbox reads."""
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", text)
    return path


@pytest.mark.slow
def test_the_manipulation_toolbox_finds_nothing(
    fmi: int, mariner_fmu: ShipFmu, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    require("fmu_manipulation_toolbox")
    assert found_by_the_toolbox(mariner_fmu(fmi), caplog) == []
    for ship in (*bundled_cards(), "autopilot"):
        text = whole_description(ship, fmi)
        assert found_by_the_toolbox(described(text, tmp_path / f"{ship}.fmu"), caplog) == []
    spoilt = text.replace('causality="input"', 'causality="output"', 1)
    assert found_by_the_toolbox(described(spoilt, tmp_path / "spoilt.fmu"), caplog) != []
