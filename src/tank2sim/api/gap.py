"""The missing physical effects of models, found by trials: of a ship, and of the ships of a fleet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tank2sim.api.verbs import Progress, Written, verb
from tank2sim.arguments import MOST_EFFECTS, Count, Effects, FalseDiscovery
from tank2sim.bundled import bundled_cards
from tank2sim.notices import Notice

if TYPE_CHECKING:
    import pandas as pd

    from tank2sim.api.trial import TrialRecord
    from tank2sim.dynamics.vessel import Vessel
    from tank2sim.results.gap import GapResult
    from tank2sim.results.gap_fleet import FleetResult

_FOLDER = Written((), "DIR", by_function=True)


def _is_folder(card: str) -> bool:
    return Path(card).is_dir() and card.lower() not in bundled_cards()


@verb(
    "the physical effects that the cards of a fleet lack",
    takes=_is_folder,
    results=(
        "tank2sim.results.gap_fleet:FleetResult",
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
    false_discovery: FalseDiscovery = 0.5,
    again: bool = False,
    executor: str = "processes",
    workers: Count | None = None,
    report: Progress = lambda _: None,
) -> FleetResult | GapResult:
    """Find the missing effects of the ships of a fleet, as :func:`find_gap` finds those of one ship.

    The results of each ship are written as soon as they exist; a search that was stopped goes on where it was.

    Parameters
    ----------
    fleet : path
        Folder with a sub-folder for each ship: its card, its trials next to it, and held-out trials in a sub-folder
        ``holdout``. A folder that holds a card itself is one ship.
    output : path
        Folder for ``fleet.json``, ``fleet.html``, and the results of each ship in a sub-folder of its name.
    effects, without, max_effects, false_discovery
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
    from tank2sim.api.gap_search import FleetRequest, gap_options, search_fleet
    from tank2sim.gap.fleet.ships import ship_alone
    from tank2sim.ship import load

    alone = ship_alone(Path(fleet))
    if alone is None:
        options = gap_options(effects, without, max_effects, false_discovery, workers)
        return search_fleet(FleetRequest(Path(fleet), Path(output), options, executor, again), report)
    found = find_gap(
        load(alone.card),
        alone.trials,
        holdout=alone.holdout,
        output=output,
        effects=effects,
        without=without,
        max_effects=max_effects,
        false_discovery=false_discovery,
        executor=executor,
        workers=workers,
        report=report,
    )
    return replace(found, remarks=(*found.remarks, Notice(f"{fleet} holds a card itself, and was taken for one ship")))


@verb(
    "the physical effect that a card lacks",
    variants={"folder_of_ships": find_gaps},
    name="gap",
    results=("tank2sim.results.gap:GapResult",),
)
def find_gap(
    ship: Vessel,
    trials: str | Path | TrialRecord | pd.DataFrame | Sequence[str | Path | TrialRecord | pd.DataFrame] = (),
    *,
    holdout: str | Path | TrialRecord | pd.DataFrame | Sequence[str | Path | TrialRecord | pd.DataFrame] = (),
    output: str | Annotated[Path, _FOLDER] | None = None,
    effects: Sequence[str] = (),
    without: Sequence[str] = (),
    max_effects: Effects = MOST_EFFECTS,
    false_discovery: FalseDiscovery = 0.5,
    executor: str = "processes",
    workers: Count | None = None,
    report: Progress = lambda _: None,
) -> GapResult:
    """Find the physical effect that a ship lacks to follow free-running trials, add it, and prove it.

    On the command line a folder in place of ship and trials is a fleet (:func:`find_gaps`): each sub-folder is a ship,
    with its card, its trials next to it, and held-out trials in a sub-folder ``holdout``. The results of each ship are
    written as soon as they exist; a search that was stopped goes on where it was. The command ends with exit code 0
    whatever is found, and with 2 if a ship of the fleet could not be judged.

    Parameters
    ----------
    ship : Vessel, Card, str or path
        The ship before these trials, a polynomial or an MMG card.
    trials : path, TrialRecord, DataFrame, or sequence of them
        Trials that name the effect; a folder means the trials in it.
    holdout : path, TrialRecord, DataFrame, or sequence of them
        Trials that only prove the effect.
    output : path, optional
        Folder for ``gap.json``, ``improved.toml``, ``report.html``, ``next_test.csv`` and ``corrected/``, in place of
        those of an earlier search.
    effects : sequence of str
        Look for these alone; by default for the whole library.
    without : sequence of str
        Do not look for these.
    max_effects : int
        Effects named at most.
    false_discovery : float
        Largest probability with which an effect that is named alone may be wrong; otherwise several candidates are
        named.
    executor : str
        Where explanations are fitted: ``processes``, or ``dask://host:port``.
    workers : int, optional
        Processes; by default one for each core.
    report : callable
        Called with the stage that begins.

    Raises
    ------
    InputError
        A file is at fault, a trial is too short, an effect is not known or cannot be tried on this card, or the folder
        cannot be written.
    """
    from tank2sim.api.gap_search import gap_options, search_ship

    options = gap_options(effects, without, max_effects, false_discovery, workers)
    folder = None if output is None else Path(output)
    return search_ship(ship.card, trials, holdout, folder, options, executor, report)
