"""``tank2sim gap FOLDER``: a fleet, ship by ship, which continues an interrupted run."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from tank2sim.answer.page import render_page
from tank2sim.api.gap import GapResult, misfit_text
from tank2sim.api.gap_files import folder_made, put, refuse_early
from tank2sim.api.result import screen_table
from tank2sim.api.trial import fitted_and_held
from tank2sim.cards import read_card
from tank2sim.cli.console import screen, show_notices, show_table
from tank2sim.cli.progress import showing_stages
from tank2sim.errors import InputError
from tank2sim.executors import PROCESSES, check_executor, executing
from tank2sim.files import json_text, writable_folder, write_together
from tank2sim.gap.fleet.run_record import NEW, RUN, fleet_run_record, stale, with_results
from tank2sim.gap.fleet.search import (
    Fault,
    ShipTask,
    fault_of_program,
    find_at_once,
    find_in_turn,
    nonlinear_card,
)
from tank2sim.gap.fleet.ships import Fleet, ShipFolder, fleet_in
from tank2sim.gap.fleet.summary import FleetSummary, ShipSummary, ship_summary
from tank2sim.gap.inference.fit_all import StageReport
from tank2sim.gap.result import Gap
from tank2sim.gap.workflow import GapOptions
from tank2sim.report.gap.fleet_page import fleet_page

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
        summary = _summary(fleet, course, request.output)
        text = json_text(summary.as_json())
        files = {request.output / JSON: text, request.output / PAGE: render_page(fleet_page(summary))}
        files |= {request.json_file: text} if request.json_file else {}
        write_together(files, inputs=[path for ship in fleet.ships for path in ship.inputs], outputs=[*files])
    _show(summary, course, request.output)
    return 2 if summary.faults else 0


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
        files, notices = GapResult(gap, ship.fitted, ship.held).files(folder)
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


def _summary(fleet: Fleet, course: _Course, output: Path) -> FleetSummary:
    ships = [ship_summary(output / name) for name in course.done]
    ships += [ShipSummary(name, fault=fault) for name, fault in course.faults.items()]
    notices = [f"{path}: holds neither card nor trial, and was passed over" for path in fleet.passed_over]
    ordered = tuple(sorted(ships, key=lambda ship: ship.folder))
    return FleetSummary(fleet.folder.resolve().name, ordered, tuple(notices))


def _show(summary: FleetSummary, course: _Course, output: Path) -> None:
    rows: list[list[object]] = []
    for ship in summary.ships:
        names = " + ".join(str(effect["name"]) for effect in ship.effects) or "-"
        misfits = ["-" if misfit is None else misfit_text(misfit) for misfit in ship.misfits()]
        rows.append([ship.folder, ship.verdict or "no result", names, *misfits, course.done.get(ship.folder, "-")])
    heads = ["ship", "verdict", "effect", "before", "after", "result"]
    title = "Misfit in units of the noise (1 is noise), of trials held out where there are some"
    show_table(screen_table(title, heads, rows, wide=True))
    show_notices([*summary.notices, *course.notices, *_without_ship(summary, output)])
    written = f"{output}: {JSON}, {PAGE}, and the folders of {len(course.done)} of {len(summary.ships)} ships"
    screen.print(written, soft_wrap=True, markup=False)
    for fault in dict.fromkeys(fault.fault for fault in summary.faults):
        names = ", ".join(ship.folder for ship in summary.faults if ship.fault == fault)
        print(f"tank2sim: {names}: {' '.join(fault.split())}", file=sys.stderr)


def _without_ship(summary: FleetSummary, output: Path) -> list[str]:
    """Notices of results of ships that are no longer in the fleet."""
    ships = {ship.folder for ship in summary.ships}
    return [
        f"{path.parent} is of an earlier run, and its ship is not in the fleet; it was kept"
        for path in sorted(output.glob(f"*/{RUN}"))
        if path.parent.name not in ships
    ]
