"""A ship's FMU in engines that are not of this project: run as a program, because a library can end its process.

Reads a :class:`Task` as JSON from the standard input, and writes the outputs after each step as JSON to the file that
is its argument; what the engine says goes where it says it. Nothing of the project is imported.
"""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

Rows = list[list[float]]


@dataclass(frozen=True)
class Task:
    """What to run.

    Parameters
    ----------
    engine : str
        One of :data:`ENGINES`.
    fmu, fmi, identifier, token
        The file, its version of FMI, and what instantiation asks for.
    references : dict
        Names to value references.
    start : dict
        Parameters to set before initialisation.
    orders : list of dict
        Inputs for each step; Booleans are bool.
    outputs, states : list of str
        What to read after each step; the continuous states.
    step : float
        Communication step, s.
    """

    engine: str
    fmu: str
    fmi: int
    identifier: str
    token: str
    references: dict[str, int]
    start: dict[str, float]
    orders: list[dict[str, float | bool]]
    outputs: list[str]
    states: list[str]
    step: float

    def at(self, names: list[str]) -> list[int]:
        return [self.references[name] for name in names]


def libcosimpy(task: Task) -> Rows:
    """The engine of the Open Simulation Platform: inputs are overrides, outputs what an observer saw last.

    A second ship sails next to the one that is read, with neither start values nor orders.
    """
    from libcosimpy.CosimEnums import CosimVariableType
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimManipulator import CosimManipulator
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    log_output_level(CosimLogLevel.WARNING)
    execution = CosimExecution.from_step_size(round(task.step * 1e9))
    ship, other = (execution.add_local_slave(CosimLocalSlave(task.fmu, name)) for name in ("ship", "other"))
    orders, observer = CosimManipulator.create_override(), CosimObserver.create_last_value()
    done = [ship >= 0, other >= 0, execution.add_manipulator(orders), execution.add_observer(observer)]
    done += [execution.real_initial_value(ship, task.references[name], value) for name, value in task.start.items()]
    there = {(v.name.decode(), v.reference, CosimVariableType(v.type)) for v in execution.slave_variables(ship)}
    done += [(name, task.references[name], CosimVariableType.REAL) in there for name in task.outputs]
    rows = []
    for order in task.orders:
        for name, value in order.items():
            write = orders.slave_boolean_values if isinstance(value, bool) else orders.slave_real_values
            done.append(write(ship, task.at([name]), [value]))
        done.append(execution.step())
        rows.append(list(observer.last_real_values(ship, task.at(task.outputs))))
    return rows if all(done) else []


def ecospy(task: Task) -> Rows:
    """The ecos engine: variables by name.

    A second ship sails next to the one that is read, with neither start values nor orders; and both have sailed before,
    and were reset.
    """
    from ecospy import EcosLib, EcosSimulation, EcosSimulationStructure

    EcosLib.set_log_level("warn")
    rows = []
    with EcosSimulationStructure() as structure:
        for name in ("ship", "other"):
            structure.add_model(name, task.fmu)
        structure.add_parameter_set("start", {f"ship::{name}": float(value) for name, value in task.start.items()})
        with EcosSimulation(structure=structure, step_size=task.step) as simulation:
            _require(simulation.init(parameter_set="start"), EcosLib.get_last_error)
            simulation.set_real("ship::rudder.command", 0.5)
            simulation.step(100)
            simulation.reset()
            _require(simulation.init(parameter_set="start"), EcosLib.get_last_error)
            for order in task.orders:
                for name, value in order.items():
                    write = simulation.set_bool if isinstance(value, bool) else simulation.set_real
                    write(f"ship::{name}", value)
                simulation.step()
                rows.append([simulation.get_real(f"ship::{name}") for name in task.outputs])
            simulation.terminate()
    return rows


def _require(done: bool, why: Callable[[], str]) -> None:
    if not done:
        raise RuntimeError(why())


def fmuloader(task: Task) -> Rows:
    """Co-Simulation by bare calls of FMI."""
    rows = []
    with _loaded(task, "co_simulation") as (ship, read, write):
        for place, order in enumerate(task.orders):
            _order(task, ship, write, order)
            ship.do_step(place * task.step, task.step)
            rows.append(read(task.at(task.outputs)))
        ship.terminate()
    return rows


def fmuloader_exchange(task: Task) -> Rows:
    """Model Exchange by bare calls of FMI, integrated here by classical Runge-Kutta steps."""
    rows = []
    with _loaded(task, "model_exchange") as (ship, read, write):
        count = len(task.states)
        rates = ship.get_derivatives if task.fmi == 2 else ship.get_continuous_state_derivatives

        def rate(time: float, states: list[float]) -> list[float]:
            ship.set_time(time)
            ship.set_continuous_states(states)
            return rates(count)

        def moved(states: list[float], slope: list[float], duration: float) -> list[float]:
            return [x + duration * k for x, k in zip(states, slope, strict=True)]

        _event_over(task, ship)
        for place, order in enumerate(task.orders):
            if place == 0 or order != task.orders[place - 1]:
                ship.enter_event_mode()
                _order(task, ship, write, order)
                _event_over(task, ship)
            begin, h, x = place * task.step, task.step, ship.get_continuous_states(count)
            k1 = rate(begin, x)
            k2 = rate(begin + h / 2, moved(x, k1, h / 2))
            k3 = rate(begin + h / 2, moved(x, k2, h / 2))
            k4 = rate(begin + h, moved(x, k3, h))
            slope = [(a + 2 * b + 2 * c + d) / 6 for a, b, c, d in zip(k1, k2, k3, k4, strict=True)]
            ship.set_continuous_states(moved(x, slope, h))
            ship.completed_integrator_step()
            rows.append(read(task.at(task.outputs)))
        ship.terminate()
    return rows


@contextmanager
def _loaded(task: Task, kind: str) -> Iterator[tuple[Any, Callable[..., Any], Callable[..., Any]]]:
    """An instance in fmuloader after initialisation, with its calls to read and write numbers; freed at the end."""
    from fmuloader.fmi2 import Fmi2Slave, Fmi2Type
    from fmuloader.fmi3 import Fmi3Slave

    ship: Any
    if task.fmi == 2:
        ship = Fmi2Slave(task.fmu, model_identifier=task.identifier)
        ship.instantiate("ship", Fmi2Type[kind.upper()], guid=task.token)
        ship.setup_experiment()
        read, write = ship.get_real, ship.set_real
    else:
        ship = Fmi3Slave(task.fmu, model_identifier=task.identifier)
        getattr(ship, f"instantiate_{kind}")("ship", instantiation_token=task.token)
        read, write = ship.get_float64, ship.set_float64
    try:
        write(task.at(list(task.start)), list(task.start.values()))
        ship.enter_initialization_mode()
        ship.exit_initialization_mode()
        yield ship, read, write
    finally:
        ship.free_instance()


def _order(task: Task, ship: Any, write: Callable[..., Any], order: dict[str, float | bool]) -> None:
    for name, value in order.items():
        (ship.set_boolean if isinstance(value, bool) else write)(task.at([name]), [value])


def _event_over(task: Task, ship: Any) -> None:
    (ship.new_discrete_states if task.fmi == 2 else ship.update_discrete_states)()
    ship.enter_continuous_time_mode()


def reason_to_skip(module: str) -> str:
    """Why an engine cannot run on this machine: it, or a library of the system that it needs, is missing; else ""."""
    if importlib.util.find_spec(module) is None:
        return f"{module} is not installed (the extra 'engines')"
    done = subprocess.run([sys.executable, "-c", f"import {module}"], capture_output=True, text=True, check=False)
    missing = [line for line in done.stderr.splitlines() if "cannot open shared object file" in line]
    return f"{module}: {missing[-1]}" if done.returncode and missing else ""


ENGINES = {run.__name__: run for run in (libcosimpy, ecospy, fmuloader, fmuloader_exchange)}

if __name__ == "__main__":
    given = Task(**json.load(sys.stdin))
    Path(sys.argv[1]).write_text(json.dumps(ENGINES[given.engine](given)), encoding="utf-8")
