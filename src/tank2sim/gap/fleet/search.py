"""What the cards of several ships lack.

Ships that are sought at once are handed to an executor, each as one task: what is sent to it is read here, for those
who compute may see no file of this machine.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import islice

from tank2sim.cards.card import Card, ManoeuvringCard
from tank2sim.errors import InputError
from tank2sim.gap.fleet.ships import ShipFolder
from tank2sim.gap.inference.fit_all import StageReport
from tank2sim.gap.result import Gap
from tank2sim.gap.workflow import GapOptions, run_gap_workflow
from tank2sim.identification.trials.problem.prepare_trials import Measured

AHEAD = 256
"""Ships that are read and handed out before the first of them is done: a bound on memory (project choice)."""


def can_lack(card: Card) -> ManoeuvringCard:
    """The card, if it is one of which a missing effect can be sought.

    Raises
    ------
    InputError
        It is of no ship that manoeuvres, or its equations are linear.
    """
    if not isinstance(card, ManoeuvringCard):
        raise InputError(card.source, "model.kind", "is no ship that manoeuvres", "give an abkowitz card")
    if card.model.kind == "linear":
        remedy = 'set kind = "abkowitz"; what it lacks of the third order is then zero'
        raise InputError(card.source, "model.kind", "is linear, and most effects are no part of such a model", remedy)
    return card


@dataclass(frozen=True, eq=False)
class Sought:
    """A ship as it was read, all that is needed to find what its card lacks.

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
    """Why a ship has no result, in one line."""

    line: str


def found_one_by_one(
    ships: Iterable[Sought], options: GapOptions, progress: StageReport, executor: Executor | None = None
) -> Iterator[tuple[Sought, Gap | Fault]]:
    """What each ship lacks, one after the other.

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

        def told(stage: str, name: str = name) -> None:
            progress(f"{name}: {stage}")

        with _executor_kept(name):
            found = _found(ship, options, told, executor)
        yield ship, found


def found_at_once(
    ships: Iterable[Sought], options: GapOptions, progress: StageReport, executor: Executor
) -> Iterator[tuple[Sought, Gap | Fault]]:
    """What each ship lacks, as of :func:`found_one_by_one`, in the order in which the executor has done with them.

    Each ship is one task of the executor.

    Raises
    ------
    InputError
        The executor is lost.
    """
    waiting: dict[Future[Gap | Fault], Sought] = {}
    for ship in ships:
        waiting[executor.submit(_found_there, ship, options)] = ship
        yield from _done(waiting, None if len(waiting) >= AHEAD else 0.0)
        if waiting:
            progress(_awaited(waiting.values()))
    while waiting:
        progress(_awaited(waiting.values()))
        yield from _done(waiting, None)


def _awaited(ships: Collection[Sought]) -> str:
    some = [one.folder.name for one in islice(ships, 3)]
    return f"{len(ships)} to go: {', '.join(some)}{' ...' if len(ships) > len(some) else ''}"


def _done(waiting: dict[Future[Gap | Fault], Sought], timeout_s: float | None) -> Iterator[tuple[Sought, Gap | Fault]]:
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
        remedy = "give fewer --workers; the same command goes on where this one stopped"
        raise InputError("--executor", "", problem, remedy) from None


def _found_there(ship: Sought, options: GapOptions) -> Gap | Fault:
    """In another process, which has the whole search to itself."""
    return _found(ship, replace(options, workers=1))


def _found(
    ship: Sought, options: GapOptions, progress: StageReport = lambda text: None, executor: Executor | None = None
) -> Gap | Fault:
    try:
        return run_gap_workflow(ship.card, ship.fitted, ship.held, options, progress, executor)
    except InputError as error:
        return Fault(str(error))
    except (BrokenExecutor, CancelledError):
        raise
    except Exception as error:  # one ship at which the program fails does not take the others with it
        return fault_of_program(error)


def fault_of_program(error: Exception) -> Fault:
    """The message about an `error` that no check of the input foresaw."""
    words = " ".join(str(error).split())[:200]
    remedy = "run 'tank2sim gap' with its card and trials alone, and report what it says"
    return Fault(f"a fault of the program, not of yours: {type(error).__name__}: {words}; {remedy}")
