"""The physical effect that the model of a ship lacks, found by trials."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tank2sim.api.verbs import Progress, Written, verb
from tank2sim.arguments import FALSE_DISCOVERY, MOST_EFFECTS, Count, Effects, FalseDiscovery

if TYPE_CHECKING:
    import pandas as pd

    from tank2sim.api.trial import TrialRecord
    from tank2sim.dynamics.vessel import Vessel
    from tank2sim.results.gap import GapResult

_FOLDER = Written((), "DIR", by_function=True)


@verb(
    "the physical effect that a card lacks",
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
    false_discovery: FalseDiscovery = FALSE_DISCOVERY,
    force: bool = False,
    black_box: bool = False,
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
        The vessel before these trials: a polynomial or an MMG card, or a craft with thrusters.
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
    force : bool
        Write the improved card even if it cannot do a turn or zigzag that the given card does, or follows a held-out
        trial clearly worse.
    black_box : bool
        Fit as many linear coefficients as the effect has parameters, for comparison, and replay the trials with them.
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
    from tank2sim.executors import executing_beside

    # What fits the explanations is imported there while this process imports the rest and reads the trials.
    with executing_beside(executor, workers, "tank2sim.gap.inference.fit_all") as pool:
        from tank2sim.api.gap_search import gap_options, search_ship

        options = gap_options(effects, without, max_effects, false_discovery, workers, force=force, black_box=black_box)
        folder = None if output is None else Path(output)
        return search_ship(ship.card, trials, holdout, folder, options, pool, report)
