"""Missing effects of the ships of a fleet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tank2sim.api.verbs import Progress, Written, verb
from tank2sim.arguments import FALSE_DISCOVERY, MOST_EFFECTS, Count, Effects, FalseDiscovery
from tank2sim.bundled import bundled_cards
from tank2sim.notices import Notice

if TYPE_CHECKING:
    from tank2sim.apps.fleet.result import FleetResult
    from tank2sim.results.gap import GapResult

_FOLDER = Written((), "DIR", by_function=True)


def _is_folder(card: str) -> bool:
    return Path(card).is_dir() and card.lower() not in bundled_cards()


@verb(
    "the physical effects that the cards of a fleet lack",
    takes=_is_folder,
    name="gap.folder_of_ships",
    results=(
        "tank2sim.apps.fleet.result:FleetResult",
        "tank2sim.results.gap:GapResult",
    ),
)
def find_gaps(
    fleet: str | Path,
    output: str | Annotated[Path, _FOLDER],
    *,
    effects: Sequence[str] = (),
    without: Sequence[str] = (),
    max_effects: Effects = MOST_EFFECTS,
    false_discovery: FalseDiscovery = FALSE_DISCOVERY,
    force: bool = False,
    black_box: bool = False,
    again: bool = False,
    executor: str = "processes",
    workers: Count | None = None,
    report: Progress = lambda _: None,
) -> FleetResult | GapResult:
    """Find the missing effects of the ships of a fleet, as :func:`find_gap` does for one ship.

    The results of each ship are written as soon as they exist; a search that was stopped goes on where it was.

    Parameters
    ----------
    fleet : path
        Folder with a sub-folder for each ship: its card, its trials next to it, and held-out trials in a sub-folder
        ``holdout``. A folder that holds a card itself is one ship.
    output : path
        Folder for ``fleet.json``, ``fleet.html``, and the results of each ship in a sub-folder of its name.
    effects, without, max_effects, false_discovery, force, black_box
        As of :func:`find_gap`.
    again : bool
        Compute all ships of a folder, also those with valid results of an earlier search.
    executor, workers
        As of :func:`find_gap`; several ships are computed at once, each in one process.
    report : callable
        Called with the ship and the stage that begins.

    Raises
    ------
    InputError
        The folder holds no ship, or the results cannot be written. The faults of single ships are in the result.
    """
    from tank2sim.api.gap import find_gap
    from tank2sim.api.gap_search import gap_options
    from tank2sim.apps.fleet.run import FleetRequest, search_fleet
    from tank2sim.apps.fleet.ships import ship_alone
    from tank2sim.dynamics.vessel import as_vessel

    alone = ship_alone(Path(fleet))
    if alone is None:
        options = gap_options(effects, without, max_effects, false_discovery, workers, force=force, black_box=black_box)
        return search_fleet(FleetRequest(Path(fleet), Path(output), options, executor, again), report)
    found = find_gap(
        as_vessel(alone.card),
        alone.trials,
        holdout=alone.holdout,
        output=output,
        effects=effects,
        without=without,
        max_effects=max_effects,
        false_discovery=false_discovery,
        force=force,
        black_box=black_box,
        executor=executor,
        workers=workers,
        report=report,
    )
    return replace(found, remarks=(*found.remarks, Notice(f"{fleet} holds a card itself, and was taken for one ship")))
