"""Verb ``find_gap``: the missing physical effect of a model, by trials."""

from __future__ import annotations

import importlib
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from tank2sim.api.trial import TrialPaths, fitted_and_held
from tank2sim.arguments import Count, Effects, NumberArgument, checked
from tank2sim.cards import Card, ManoeuvringCard
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.dynamics.vessel import Vessel, as_vessel
from tank2sim.errors import InputError
from tank2sim.executors import PROCESSES, check_executor, executing, processes_to_begin
from tank2sim.gap.fleet.search import nonlinear_card
from tank2sim.gap.inference.fit_all import StageReport
from tank2sim.gap.outcome.export import gap_study
from tank2sim.gap.result import Gap
from tank2sim.gap.search.model_choice import SUREST
from tank2sim.gap.workflow import MOST_EFFECTS, GapOptions
from tank2sim.gap.workflow import run_gap_workflow as run_workflow
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.identification.trials.problem.signatures import fitted_as
from tank2sim.results.gap import GapResult

SUREST_WRONG = round(1 - SUREST, 9)
"""Probability with which even the surest name may be wrong."""


@checked
def find_gap(
    card: Vessel | Card | str | Path,
    trials: TrialPaths,
    *,
    holdout: TrialPaths = (),
    effects: Sequence[str] = (),
    without: Sequence[str] = (),
    max_effects: Effects = MOST_EFFECTS,
    false_discovery: NumberArgument = 0.5,
    executor: str = PROCESSES,
    workers: Count | None = None,
    progress: StageReport = lambda text: None,
) -> GapResult:
    """Find the physical effect that a model lacks to follow free-running trials, add it, and prove it.

    Parameters
    ----------
    card : Vessel, Card, str or path
        The ship as it is known (an ``abkowitz`` card).
    trials, holdout : path or sequence of paths
        Trials that name the effect, and trials that only prove it; a folder means the trials in it.
    effects, without : sequence of str
        Look for these alone; do not look for these. By default the whole library.
    max_effects : int
        Effects named at most, 1 to 4.
    false_discovery : float
        Largest probability with which a name that is given alone may be wrong, 0.01 to 0.5; what is less sure is one of
        several candidates.
    executor : str
        ``processes`` or ``dask://host:port``.
    workers : int, optional
        Processes; by default one for each core.
    progress : callable
        Called with the stage that begins.

    Raises
    ------
    InputError
        A file is at fault, a trial is too short, an effect is not known or cannot be tried on this card, or an option
        is out of its range.
    """
    ship = nonlinear_card(as_vessel(card).card)
    options = gap_options(effects, without, max_effects, workers, false_discovery)
    with _workers(executor, workers) as pool:
        fitted, held = fitted_and_held(trials, holdout, ship, report_unused=False)  # a search uses them
        fitted = replace(fitted, notices=(*fitted.notices, *identified_from(ship, fitted)))
        return gap_result(run_workflow(ship, fitted, held, options, progress, pool), fitted, held)


def gap_result(gap: Gap, fitted: Measured, held: Measured) -> GapResult:
    """Return the result of a search with its trials."""
    files = {trial.name: trial.path.name for trial in (*fitted.trials, *held.trials)}
    return GapResult(gap_study(gap, files), gap, fitted, held)


def identified_from(card: ManoeuvringCard, fitted: Measured) -> list[str]:
    """A notice if the card was identified from some of these trials: its coefficients may hold what is missing.

    Parameters
    ----------
    card : ManoeuvringCard
    fitted : Measured
        Trials that name the effect.
    """
    names = [trial.name for trial in fitted.trials if fitted_as(card, trial) is not None]
    if not names:
        return []
    return [
        f"{card.source} was fitted to {', '.join(names)}: its coefficients may hold a part of what is missing. "
        "Give gap the card as it was before these trials, and identify on the improved card afterwards"
    ]


@checked
def gap_options(
    effects: Sequence[str] = (),
    without: Sequence[str] = (),
    max_effects: Effects = MOST_EFFECTS,
    workers: Count | None = None,
    false_discovery: NumberArgument = 0.5,
) -> GapOptions:
    """Options of the search. Raises InputError for an effect that is not known, or a number out of its range.

    Parameters
    ----------
    effects, without, max_effects, workers, false_discovery
        As of :func:`find_gap`.
    """
    for option, names in (("--effects", effects), ("--without", without)):
        if isinstance(names, str):
            raise InputError(option, "", f"is the text {names!r}", f"give a list of names: [{names!r}]")
        for name in names:
            if EFFECTS.get(name) is None:
                raise InputError(option, "", f"{name!r} is not an effect", EFFECTS.remedy(name))
    if not SUREST_WRONG <= false_discovery <= 0.5:
        problem = f"is {false_discovery:g}: no name is surer than {1 - SUREST_WRONG:g}, and half is a guess"
        raise InputError("--false-discovery", "", problem, f"give {SUREST_WRONG:g} to 0.5")
    return GapOptions(
        tuple(effects) or None, tuple(without), max_effects, workers=workers, false_discovery=false_discovery
    )


@contextmanager
def _workers(executor: str, workers: int | None) -> Iterator[Executor | None]:
    """The cluster, or processes of this machine, which load what they need while the trials are read; None for one."""
    local = check_executor(executor) == PROCESSES
    count = processes_to_begin(workers)
    if local and count == 1:
        yield None
        return
    with executing(executor, count) as pool:
        for _ in range(count if local else 0):
            pool.submit(importlib.import_module, "tank2sim.gap.workflow")
        yield pool
