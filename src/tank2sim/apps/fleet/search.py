"""The missing effects of several ships.

For a parallel search each ship is one task of an executor. Its files are read here, for a worker may have no access to
the files of this machine.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import islice

from tank2sim.apps.fleet.ships import ShipFolder
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.errors import ArgumentError, InputError
from tank2sim.gap.inference.fit_all import StageReport
from tank2sim.gap.result import Gap
from tank2sim.gap.workflow import GapOptions, run_gap_workflow
from tank2sim.identification.trials.problem.prepare_trials import Measured

AHEAD = 256
"""Ships that are read and handed out before the first of them is done: a bound on memory (project choice)."""


@dataclass(frozen=True, eq=False)
class ShipTask:
    """A ship with its data read: the input of the search for its missing effect.

    Parameters
    ----------
    folder : ShipFolder
    card : ManoeuvringCard
    fitted, held : Measured
    """

    folder: ShipFolder
    card: ManoeuvringCard
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
