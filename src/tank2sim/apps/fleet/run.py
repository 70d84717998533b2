"""Searches for missing effects of the ships of a fleet, each written as soon as it is found."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from itertools import islice
from pathlib import Path
from typing import Any

from tank2sim.api.trial import fitted_and_held
from tank2sim.apps.fleet.result import FleetResult
from tank2sim.apps.fleet.ships import Fleet, ShipFolder, fleet_in
from tank2sim.apps.fleet.summary import FleetStudy, ShipSummary, fleet_study, ship_summary
from tank2sim.arguments import PROCESSES
from tank2sim.cards import read_card
from tank2sim.cards.card import SteeredCard
from tank2sim.errors import ArgumentError, InputError
from tank2sim.executors import check_executor, executing
from tank2sim.files import folder_made, json_text, parsed_json, read_text, writable_folder, write_together
from tank2sim.gap.inference.fit_all import StageReport
from tank2sim.gap.outcome.files import GAP, put, refuse_early
from tank2sim.gap.outcome.study import GapStudy
from tank2sim.gap.result import Gap
from tank2sim.gap.workflow import GapOptions, nonlinear_card, run_gap_workflow
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.notices import Notice
from tank2sim.results.gap import GapResult, gap_result
from tank2sim.version import __version__

AHEAD = 256
"""Ships that are read and handed out before the first of them is done: a bound on memory (project choice)."""


RUN = "run.json"
"""File next to ``gap.json``."""

_FORMAT = "tank2sim-run/1"


NEW = "not computed before"

_RESULTS = "its results were changed"

_WORDS = {
    "format": "its record is of another form",
    "tank2sim": "computed by another version",
    "card": "the card was changed",
    "trials": "the trials were changed",
    "holdout": "the trials held out were changed",
    "options": "the options were changed",
}


_JSON, _PAGE = "fleet.json", "fleet.html"


@dataclass(frozen=True)
class FleetRequest:
    """A search over a fleet.

    Parameters
    ----------
    folder, output : Path
        Of the ships, and of the results.
    options : GapOptions
    executor : str
    again : bool
        Compute also the ships that have results.
    """

    folder: Path
    output: Path
    options: GapOptions
    executor: str
    again: bool


@dataclass
class _Course:
    """Progress of a search over a fleet.

    Parameters
    ----------
    wanted : dict
        Ships to be computed, each with its record and the reason.
    done : dict
        Name of a ship to the origin of its results.
    faults : dict
        Name of a ship to the reason why it has no results.
    notices : list of Notice
    """

    wanted: dict[ShipFolder, tuple[Mapping[str, object], str]] = field(default_factory=dict)
    done: dict[str, str] = field(default_factory=dict)
    faults: dict[str, str] = field(default_factory=dict)
    notices: list[Notice] = field(default_factory=list)


def search_fleet(request: FleetRequest, report: StageReport) -> FleetResult:
    """Compute the missing results of a fleet, write each ship as soon as it is found, then the fleet.

    Parameters
    ----------
    request : FleetRequest
    report : callable
        Called with the ship and the stage that begins.

    Raises
    ------
    InputError
        As :func:`.find_gaps`.
    """
    check_executor(request.executor)
    output = request.output
    fleet = fleet_in(request.folder, output)
    inputs = tuple(path for ship in fleet.ships for path in ship.inputs)
    with folder_made(output):
        report("looking for earlier results")
        course = _course(fleet, request)
        _compute(course, request, report)
        report("writing the fleet's page")
        result = FleetResult(_study(fleet, course, output), linked=True)
        files: dict[Path, str | bytes] = {output / _JSON: result.to_json(), output / _PAGE: result.page()}
        write_together(files, inputs=inputs)
    remarks = (*course.notices, *_without_ship(result.study, output))
    origins = dict(sorted(course.done.items()))
    return replace(result, origins=origins, remarks=remarks, inputs=inputs, written=tuple(files))


def _course(fleet: Fleet, request: FleetRequest) -> _Course:
    """Sort the ships into those that have results and those to be computed."""
    course = _Course(faults=dict(fleet.faults))
    for ship in fleet.ships:
        output = request.output / ship.name
        try:
            refuse_early(output, ship.inputs)
            if output.exists() and not output.is_dir():
                raise InputError(output, "", "is not a folder, and its results belong there", "give another folder")
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


def _compute(course: _Course, request: FleetRequest, report: StageReport) -> None:
    """Compute the ships; each is written as soon as it is found."""
    if not course.wanted:
        return
    with _working(request, len(course.wanted)) as (find, executor):
        for ship, found in find(_read(course), request.options, report, executor):
            report(f"{ship.folder.name}: writing")
            fault = found if isinstance(found, Fault) else _write(ship, found, course, request)
            if fault:
                course.faults[ship.folder.name] = fault.line


@contextmanager
def _working(request: FleetRequest, number: int) -> Iterator[tuple[Find, Executor | None]]:
    """Search function and executor for a number of ships.

    For one ship the explanations of its search are distributed over the executor. Each of several ships is one task:
    the search of a ship has sequential parts, during which only one core would be busy.
    """
    local = request.executor == PROCESSES
    workers = request.options.workers or os.cpu_count() or 1
    if local and workers == 1:
        yield find_in_turn, None
        return
    with executing(request.executor, min(workers, number) if number > 1 else workers) as executor:
        yield (find_at_once if number > 1 else find_in_turn), executor


def _read(course: _Course) -> Iterator[ShipTask]:
    """Read the ships to be computed, one after the other."""
    for ship in course.wanted:
        try:
            card = nonlinear_card(read_card(ship.card))
            yield ShipTask(ship, card, *fitted_and_held(ship.trials, ship.holdout, card, report_unused=False))
        except InputError as error:
            course.faults[ship.name] = str(error)


def _write(ship: ShipTask, gap: Gap, course: _Course, request: FleetRequest) -> Fault | None:
    """Write a ship's results and their record, all or none; return the fault if there are none."""
    folder = request.output / ship.folder.name
    record, why = course.wanted[ship.folder]
    try:
        files, notices = gap_result(gap, ship.fitted, ship.held, force=request.options.force).files(folder)
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
    course.notices += [notice.of(folder.name) for notice in (*notices, *tidied)]
    return None


def _study(fleet: Fleet, course: _Course, output: Path) -> FleetStudy:
    ships = [ship_summary(name, _written(output / name)) for name in course.done]
    ships += [ShipSummary(folder=name, fault=fault) for name, fault in course.faults.items()]
    notices = [Notice(f"{path}: holds neither card nor trial, and was passed over") for path in fleet.passed_over]
    return fleet_study(fleet.folder.resolve().name, ships, notices)


def _written(folder: Path) -> GapStudy:
    """The study of the ship with results in a folder; raises InputError if another program changed them."""
    remedy = "let one run at a time write there, and run it again"
    try:
        return GapResult.read(parsed_json(read_text(folder / GAP), folder / GAP, remedy), str(folder / GAP)).study
    except (InputError, AttributeError):  # the second for JSON without keys
        raise InputError(folder, "", "the results of this ship were changed by another program", remedy) from None


def _without_ship(study: FleetStudy, output: Path) -> list[Notice]:
    """Notices of results whose ships are no longer in the fleet."""
    ships = {ship.folder for ship in study.ships}
    return [
        Notice(f"{path.parent} is of an earlier run, and its ship is not in the fleet; it was kept")
        for path in sorted(output.glob(f"*/{RUN}"))
        if path.parent.name not in ships
    ]


def fleet_run_record(ship: ShipFolder, options: GapOptions) -> dict[str, object]:
    """All on which a result depends: files by the SHA-256 of their bytes, options, version of the program.

    The number and place of the processes is not part of it.

    Raises
    ------
    InputError
        A file cannot be read.
    """
    return {
        "format": _FORMAT,
        "tank2sim": __version__,
        "card": _sums([ship.card]),
        "trials": _sums(ship.trials),
        "holdout": _sums(ship.holdout),
        "options": {
            "effects": None if options.effects is None else list(options.effects),
            "without": list(options.without),
            "force": options.force,
            "black_box": options.black_box,
            "max_effects": options.max_effects,
            "false_discovery": options.false_discovery,
        },
    }


def with_results(record: Mapping[str, object], contents: Mapping[Path, str | bytes], folder: Path) -> dict[str, object]:
    """The record of a run that wrote these files into its folder."""
    files = {path.relative_to(folder).as_posix(): sum_of(content) for path, content in contents.items()}
    return {**record, "files": dict(sorted(files.items()))}


def stale(record: Mapping[str, object], folder: Path) -> str:
    """Reason why the files in a folder are not the results of this record; empty if they are.

    The files of the result are compared, too: a run that was killed between two of them leaves the record of the run
    before, and a user may have changed one. Without a record it is :data:`NEW`.
    """
    earlier = _earlier(folder / RUN)
    if earlier is None:
        return NEW
    for key, words in _WORDS.items():
        if earlier.get(key) != record[key]:
            return words
    results = earlier.get("files")
    if not isinstance(results, dict) or not results:
        return _RESULTS
    for name, digest in results.items():
        try:
            if sum_of((folder / name).read_bytes()) != digest:
                return _RESULTS
        except OSError:
            return _RESULTS
    return ""


def sum_of(content: str | bytes) -> str:
    """SHA-256 of the bytes of a file's content, in hexadecimal."""
    return hashlib.sha256(content.encode("utf-8") if isinstance(content, str) else content).hexdigest()


def _sums(paths: Iterable[Path]) -> dict[str, str]:
    sums = {}
    for path in paths:
        try:
            sums[path.name] = sum_of(path.read_bytes())
        except OSError as error:
            raise InputError(path, "", f"cannot be read ({error.strerror})", "check its permissions") from None
    return sums


def _earlier(path: Path) -> dict[str, Any] | None:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return None
    return content if isinstance(content, dict) else None


@dataclass(frozen=True, eq=False)
class ShipTask:
    """A ship with its data read: the input of the search for its missing effect.

    Parameters
    ----------
    folder : ShipFolder
    card : SteeredCard
    fitted, held : Measured
    """

    folder: ShipFolder
    card: SteeredCard
    fitted: Measured
    held: Measured


@dataclass(frozen=True)
class Fault:
    """Reason why a ship has no result, in one line."""

    line: str


def find_in_turn(
    ships: Iterable[ShipTask], options: GapOptions, progress: StageReport, executor: Executor | None = None
) -> Iterator[tuple[ShipTask, Gap | Fault]]:
    """Find the missing effect of each ship, one after the other.

    Parameters
    ----------
    ships : iterable of Sought
        Read as they are needed.
    options : GapOptions
    progress : callable
        Called with each stage of each ship.
    executor : Executor, optional
        For the explanations of each ship; by default they are fitted in this process, or in others of this machine.

    Raises
    ------
    InputError
        The executor is lost.
    """
    for ship in ships:
        name = ship.folder.name

        def report(stage: str, name: str = name) -> None:
            progress(f"{name}: {stage}")

        with _executor_kept(name):
            found = _find(ship, options, report, executor)
        yield ship, found


def find_at_once(
    ships: Iterable[ShipTask], options: GapOptions, progress: StageReport, executor: Executor
) -> Iterator[tuple[ShipTask, Gap | Fault]]:
    """Find the missing effect of each ship as :func:`find_in_turn`, in the order in which the executor completes them.

    Each ship is one task of the executor.

    Raises
    ------
    InputError
        The executor is lost.
    """
    waiting: dict[Future[Gap | Fault], ShipTask] = {}
    for ship in ships:
        waiting[executor.submit(_find_in_worker, ship, options)] = ship
        yield from _done(waiting, None if len(waiting) >= AHEAD else 0.0)
        if waiting:
            progress(_awaited(waiting.values()))
    while waiting:
        progress(_awaited(waiting.values()))
        yield from _done(waiting, None)


def _awaited(ships: Collection[ShipTask]) -> str:
    names = [ship.folder.name for ship in islice(ships, 3)]
    return f"{len(ships)} to go: {', '.join(names)}{' ...' if len(ships) > len(names) else ''}"


def _done(
    waiting: dict[Future[Gap | Fault], ShipTask], timeout_s: float | None
) -> Iterator[tuple[ShipTask, Gap | Fault]]:
    for future in wait(waiting, timeout_s, FIRST_COMPLETED).done:
        ship = waiting.pop(future)
        with _executor_kept(ship.folder.name):
            try:
                found = future.result()
            except InputError as error:  # of the cluster: this ship was too much for each worker that tried
                found = Fault(str(error))
        yield ship, found


@contextmanager
def _executor_kept(name: str) -> Iterator[None]:
    try:
        yield
    except (BrokenExecutor, CancelledError):
        problem = f"a worker was lost while {name} was sought (is there memory enough for all workers?)"
        remedy = "give fewer workers; the same search goes on where this one stopped"
        raise ArgumentError("executor", "", problem, remedy) from None


def _find_in_worker(ship: ShipTask, options: GapOptions) -> Gap | Fault:
    """Find a ship's missing effect in a worker, in one process."""
    return _find(ship, replace(options, workers=1))


def _find(
    ship: ShipTask, options: GapOptions, progress: StageReport = lambda text: None, executor: Executor | None = None
) -> Gap | Fault:
    try:
        return run_gap_workflow(ship.card, ship.fitted, ship.held, options, progress, executor)
    except InputError as error:
        return Fault(str(error))
    except (BrokenExecutor, CancelledError):
        raise
    except Exception as error:  # a failure of the program at one ship does not stop the others
        return fault_of_program(error)


def fault_of_program(error: Exception) -> Fault:
    """The message about an `error` that no check of the input foresaw."""
    words = " ".join(str(error).split())[:200]
    remedy = "run 'tank2sim gap' with its card and trials alone, and report its message"
    return Fault(f"a fault of the program, not of yours: {type(error).__name__}: {words}; {remedy}")


Find = Callable[..., Iterator[tuple[ShipTask, Gap | Fault]]]
