"""``tank2sim gap FOLDER``: a fleet, ship by ship, which continues an interrupted run."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from tank2sim.api.gap import gap_result
from tank2sim.api.trial import fitted_and_held
from tank2sim.cards import read_card
from tank2sim.cli.console import screen, show_notices, show_result
from tank2sim.cli.progress import showing_stages
from tank2sim.errors import InputError
from tank2sim.executors import PROCESSES, check_executor, executing
from tank2sim.files import json_text, parsed_json, read_text, writable_folder, write_together
from tank2sim.gap.fleet.run_record import NEW, RUN, fleet_run_record, stale, with_results
from tank2sim.gap.fleet.search import (
    Fault,
    ShipTask,
    fault_of_program,
    find_at_once,
    find_in_turn,
    nonlinear_card,
)
from tank2sim.gap.fleet.ships import GAP, Fleet, ShipFolder, fleet_in
from tank2sim.gap.fleet.summary import FleetStudy, ShipSummary, fleet_study, ship_summary
from tank2sim.gap.inference.fit_all import StageReport
from tank2sim.gap.outcome.files import folder_made, put, refuse_early
from tank2sim.gap.outcome.study import GapStudy
from tank2sim.gap.result import Gap
from tank2sim.gap.workflow import GapOptions
from tank2sim.results.gap import GapResult
from tank2sim.results.gap_fleet import FleetResult

JSON, PAGE = "fleet.json", "fleet.html"


@dataclass(frozen=True)
class FleetRequest:
    """Arguments of the command.

    Parameters
    ----------
    folder, output : Path
    options : GapOptions
    executor : str
    again : bool
        Compute also the ships that have results.
    json_file : Path or None
    """

    folder: Path
    output: Path
    options: GapOptions
    executor: str
    again: bool
    json_file: Path | None


@dataclass
class _Course:
    """Progress of a run.

    Parameters
    ----------
    wanted : dict
        Ship's folder to (its record, the reason), of the ships to be computed.
    done : dict
        Ship's folder to the origin of its results.
    faults : dict
        Ship's folder to the reason why it has none.
    notices : list of str
    """

    wanted: dict[ShipFolder, tuple[Mapping[str, object], str]] = field(default_factory=dict)
    done: dict[str, str] = field(default_factory=dict)
    faults: dict[str, str] = field(default_factory=dict)
    notices: list[str] = field(default_factory=list)


def run_fleet(request: FleetRequest) -> int:
    """Compute the missing results, write them ship by ship, and show the fleet; 2 if a ship has no result."""
    check_executor(request.executor)
    fleet = fleet_in(request.folder, request.output)
    refuse_early(request.output, request.json_file, [])
    with folder_made(request.output), showing_stages("looking for earlier results") as progress:
        course = _course(fleet, request)
        _compute(course, request, progress)
        progress("writing the fleet's page")
        result = FleetResult(_study(fleet, course, request.output), linked=True)
        text = result.to_json()
        files = {request.output / JSON: text, request.output / PAGE: result.page()}
        files |= {request.json_file: text} if request.json_file else {}
        write_together(files, inputs=[path for ship in fleet.ships for path in ship.inputs], outputs=[*files])
    _show(result, course, request.output)
    return 2 if course.faults else 0


def _course(fleet: Fleet, request: FleetRequest) -> _Course:
    """Sort the ships into those that have results and those to be computed."""
    course = _Course(faults=dict(fleet.faults))
    for ship in fleet.ships:
        output = request.output / ship.name
        try:
            refuse_early(output, None, ship.inputs)
            if output.exists() and not output.is_dir():
                raise InputError(output, "", "is not a folder, and its results belong there", "give another with -o")
            record = fleet_run_record(ship, request.options)
        except InputError as error:
            course.faults[ship.name] = str(error)
            continue
        why = "asked for again" if request.again else stale(record, output)
        if why:
            course.wanted[ship] = record, why
        else:
            course.done[ship.name] = "taken from the earlier run"
    return course


def _compute(course: _Course, request: FleetRequest, progress: StageReport) -> None:
    """Compute the ships; each is written as soon as it is found."""
    if not course.wanted:
        return
    with _working(request, len(course.wanted)) as (find, executor):
        for ship, found in find(_read(course), request.options, progress, executor):
            progress(f"{ship.folder.name}: writing")
            fault = found if isinstance(found, Fault) else _write(ship, found, course, request.output)
            if fault:
                course.faults[ship.folder.name] = fault.line


Find = Callable[..., Iterator[tuple[ShipTask, Gap | Fault]]]


@contextmanager
def _working(request: FleetRequest, count: int) -> Iterator[tuple[Find, Executor | None]]:
    """Search function and executor for a number of ships.

    For one ship the explanations of its search are distributed over the executor. Of several ships each is one task:
    the search of a ship has sequential parts, during which only one core would be busy.
    """
    local = request.executor == PROCESSES
    workers = request.options.workers or os.cpu_count() or 1
    if local and workers == 1:
        yield find_in_turn, None
        return
    with executing(request.executor, min(workers, count) if count > 1 else workers) as executor:
        yield (find_at_once if count > 1 else find_in_turn), executor


def _read(course: _Course) -> Iterator[ShipTask]:
    """Read the ships to be computed, one after the other."""
    for ship in course.wanted:
        try:
            card = nonlinear_card(read_card(ship.card))
            yield ShipTask(ship, card, *fitted_and_held(ship.trials, ship.holdout, card, report_unused=False))
        except InputError as error:
            course.faults[ship.name] = str(error)


def _write(ship: ShipTask, gap: Gap, course: _Course, output: Path) -> Fault | None:
    """Write a ship's results and their record, all or none; return the fault if there are none."""
    folder = output / ship.folder.name
    record, why = course.wanted[ship.folder]
    try:
        files, notices = gap_result(gap, ship.fitted, ship.held).files(folder)
    except InputError as error:
        return Fault(str(error))
    except OSError:
        raise
    except Exception as error:
        return fault_of_program(error)
    # Written last, after the files that it lists.
    files[folder / RUN] = json_text(with_results(record, files, folder))
    writable_folder(folder)
    tidied = put(files, folder, ship.folder.inputs)
    course.done[folder.name] = "computed" if why == NEW else f"computed: {why}"
    course.notices += [f"{folder.name}: {notice}" for notice in (*notices, *tidied)]
    return None


def _study(fleet: Fleet, course: _Course, output: Path) -> FleetStudy:
    ships = [ship_summary(name, _written(output / name)) for name in course.done]
    ships += [ShipSummary(folder=name, fault=fault) for name, fault in course.faults.items()]
    notices = [f"{path}: holds neither card nor trial, and was passed over" for path in fleet.passed_over]
    return fleet_study(fleet.folder.resolve().name, ships, notices)


def _written(folder: Path) -> GapStudy:
    """The study of the ship with results in a folder; raises InputError if they were changed in the meantime."""
    remedy = "let one run at a time write there, and run it again"
    try:
        return GapResult.read(parsed_json(read_text(folder / GAP), folder / GAP, remedy), str(folder / GAP)).study
    except (InputError, AttributeError):  # the second for JSON without keys
        raise InputError(folder, "", "the results of this ship were changed by another program", remedy) from None


def _show(result: FleetResult, course: _Course, output: Path) -> None:
    show_result(result)
    for name, origin in sorted(course.done.items()):
        screen.print(f"{name}: {origin}", soft_wrap=True, markup=False)
    show_notices([*course.notices, *_without_ship(result.study, output)])
    written = f"{output}: {JSON}, {PAGE}, and the folders of {len(course.done)} of {len(result.study.ships)} ships"
    screen.print(written, soft_wrap=True, markup=False)
    for fault in dict.fromkeys(course.faults[name] for name in sorted(course.faults)):
        names = ", ".join(name for name in sorted(course.faults) if course.faults[name] == fault)
        print(f"tank2sim: {names}: {' '.join(fault.split())}", file=sys.stderr)


def _without_ship(study: FleetStudy, output: Path) -> list[str]:
    """Notices of results of ships that are no longer in the fleet."""
    ships = {ship.folder for ship in study.ships}
    return [
        f"{path.parent} is of an earlier run, and its ship is not in the fleet; it was kept"
        for path in sorted(output.glob(f"*/{RUN}"))
        if path.parent.name not in ships
    ]
