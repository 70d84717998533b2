"""``tank2sim gap FOLDER``: a fleet, ship by ship, which goes on where an earlier run was stopped."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from tank2sim.api.gap import GapResult, misfit_text
from tank2sim.api.gap_files import folder_made, put, refuse_early
from tank2sim.api.trial import fitted_and_held
from tank2sim.cards import read_card
from tank2sim.cli.console import screen, show_notices, show_table
from tank2sim.cli.progress import showing_stages
from tank2sim.errors import InputError
from tank2sim.executors import PROCESSES, check_executor, executing
from tank2sim.files import json_text, writable_folder, write_together
from tank2sim.gap.fleet.run_record import NEW, RUN, fleet_run_record, stale, with_results
from tank2sim.gap.fleet.search import Fault, Sought, can_lack, fault_of_program, found_at_once, found_one_by_one
from tank2sim.gap.fleet.ships import Fleet, ShipFolder, fleet_in
from tank2sim.gap.fleet.summary import FleetTold, ShipTold, ship_told
from tank2sim.gap.inference.fit_all import StageReport
from tank2sim.gap.result import Gap
from tank2sim.gap.workflow import GapOptions
from tank2sim.report.gap.fleet_page import fleet_page
from tank2sim.report.kit.page import render_page

JSON, PAGE = "fleet.json", "fleet.html"


@dataclass(frozen=True)
class FleetRequest:
    """What the command was given.

    Parameters
    ----------
    folder, output : Path
    options : GapOptions
    executor : str
    again : bool
        Compute also what is there.
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
    """How far a run is.

    Parameters
    ----------
    wanted : dict
        Ship's folder to (its record, why it is computed), of those that are to be computed.
    done : dict
        Ship's folder to how its results came about.
    faults : dict
        Ship's folder to why it has none.
    notices : list of str
    """

    wanted: dict[ShipFolder, tuple[Mapping[str, object], str]] = field(default_factory=dict)
    done: dict[str, str] = field(default_factory=dict)
    faults: dict[str, str] = field(default_factory=dict)
    notices: list[str] = field(default_factory=list)


def run_fleet(asked: FleetRequest) -> int:
    """Compute what is not computed yet, write it ship by ship, and show the fleet; 2 if a ship has no result."""
    check_executor(asked.executor)
    fleet = fleet_in(asked.folder, asked.output)
    refuse_early(asked.output, asked.json_file, [])
    with folder_made(asked.output), showing_stages("looking for what is computed") as progress:
        course = _course(fleet, asked)
        _compute(course, asked, progress)
        progress("writing the fleet's page")
        told = _told(fleet, course, asked.output)
        text = json_text(told.as_json())
        files = {asked.output / JSON: text, asked.output / PAGE: render_page(fleet_page(told))}
        files |= {asked.json_file: text} if asked.json_file else {}
        write_together(files, inputs=[path for ship in fleet.ships for path in ship.inputs], outputs=[*files])
    _show(told, course, asked.output)
    return 2 if told.faults else 0


def _course(fleet: Fleet, asked: FleetRequest) -> _Course:
    """What is computed already, and what is not."""
    course = _Course(faults=dict(fleet.faults))
    for ship in fleet.ships:
        output = asked.output / ship.name
        try:
            refuse_early(output, None, ship.inputs)
            if output.exists() and not output.is_dir():
                raise InputError(output, "", "is no folder, and its results belong there", "give another with -o")
            record = fleet_run_record(ship, asked.options)
        except InputError as error:
            course.faults[ship.name] = str(error)
            continue
        why = "asked for again" if asked.again else stale(record, output)
        if why:
            course.wanted[ship] = record, why
        else:
            course.done[ship.name] = "taken from the earlier run"
    return course


def _compute(course: _Course, asked: FleetRequest, progress: StageReport) -> None:
    """Compute the ships that are wanted; each is written as soon as it is found."""
    if not course.wanted:
        return
    with _working(asked, len(course.wanted)) as (find, executor):
        for ship, found in find(_read(course), asked.options, progress, executor):
            progress(f"{ship.folder.name}: writing")
            fault = found if isinstance(found, Fault) else _write(ship, found, course, asked.output)
            if fault:
                course.faults[ship.folder.name] = fault.line


Find = Callable[..., Iterator[tuple[Sought, Gap | Fault]]]


@contextmanager
def _working(asked: FleetRequest, count: int) -> Iterator[tuple[Find, Executor | None]]:
    """How the ships are sought, and by whom.

    One ship alone has the explanations of its search spread over the executor. Of several, each is one task: the
    search of a ship has parts that nothing else can be done next to, and then one of several cores is busy.
    """
    here = asked.executor == PROCESSES
    workers = asked.options.workers or os.cpu_count() or 1
    if here and workers == 1:
        yield found_one_by_one, None
        return
    with executing(asked.executor, min(workers, count) if count > 1 else workers) as executor:
        yield (found_at_once if count > 1 else found_one_by_one), executor


def _read(course: _Course) -> Iterator[Sought]:
    """The ships that are wanted, one after the other."""
    for ship in course.wanted:
        try:
            card = can_lack(read_card(ship.card))
            yield Sought(ship, card, *fitted_and_held(ship.trials, ship.holdout, card))
        except InputError as error:
            course.faults[ship.name] = str(error)


def _write(ship: Sought, gap: Gap, course: _Course, output: Path) -> Fault | None:
    """Write a ship's results and their record, whole or not at all; tells why if there are none."""
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
    # The last to be written: what it tells of is there.
    files[folder / RUN] = json_text(with_results(record, files, folder))
    writable_folder(folder)
    tidied = put(files, folder, ship.folder.inputs)
    course.done[folder.name] = "computed" if why == NEW else f"computed: {why}"
    course.notices += [f"{folder.name}: {notice}" for notice in (*notices, *tidied)]
    return None


def _told(fleet: Fleet, course: _Course, output: Path) -> FleetTold:
    ships = [ship_told(output / name) for name in course.done]
    ships += [ShipTold(name, fault=told) for name, told in course.faults.items()]
    notices = [f"{path}: holds neither card nor trial, and was passed over" for path in fleet.passed_over]
    ordered = tuple(sorted(ships, key=lambda one: one.folder))
    return FleetTold(fleet.folder.resolve().name, ordered, tuple(notices))


def _show(told: FleetTold, course: _Course, output: Path) -> None:
    rows: list[list[object]] = []
    for ship in told.ships:
        names = " + ".join(str(effect["name"]) for effect in ship.effects) or "-"
        misfits = ["-" if one is None else misfit_text(one) for one in ship.misfits()]
        rows.append([ship.folder, ship.verdict or "no result", names, *misfits, course.done.get(ship.folder, "-")])
    heads = ["ship", "verdict", "effect", "before", "after", "result"]
    title = "Misfit in units of the noise (1 is noise), of trials held out where there are some"
    show_table(title, heads, rows, wide=True)
    show_notices([*told.notices, *course.notices, *_without_ship(told, output)])
    written = f"{output}: {JSON}, {PAGE}, and the folders of {len(course.done)} of {len(told.ships)} ships"
    screen.print(written, soft_wrap=True, markup=False)
    for fault in dict.fromkeys(fault.fault for fault in told.faults):
        names = ", ".join(one.folder for one in told.faults if one.fault == fault)
        print(f"tank2sim: {names}: {' '.join(fault.split())}", file=sys.stderr)


def _without_ship(told: FleetTold, output: Path) -> list[str]:
    """Results of a ship that is no longer in the fleet."""
    ships = {ship.folder for ship in told.ships}
    return [
        f"{path.parent} is of an earlier run: there is no such ship now; it was left"
        for path in sorted(output.glob(f"*/{RUN}"))
        if path.parent.name not in ships
    ]
