"""The search for the missing effect of a ship, written into a folder."""

from __future__ import annotations

import importlib
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from tank2sim.api.trial import fitted_and_held, trial_files
from tank2sim.arguments import PROCESSES
from tank2sim.cards import Card, ManoeuvringCard
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.errors import ArgumentError
from tank2sim.executors import check_executor, executing, processes_to_begin
from tank2sim.files import folder_made
from tank2sim.gap.inference.fit_all import StageReport
from tank2sim.gap.outcome.files import refuse_early
from tank2sim.gap.workflow import GapOptions, nonlinear_card, run_gap_workflow
from tank2sim.identification.trials.problem.prepare_trials import Measured, fitted_as
from tank2sim.notices import Notice
from tank2sim.results.gap import GapResult, gap_result

if TYPE_CHECKING:
    from tank2sim.api.trial import TrialPaths


def gap_options(
    effects: Sequence[str],
    without: Sequence[str],
    max_effects: int,
    false_discovery: float,
    workers: int | None,
    *,
    force: bool = False,
    black_box: bool = False,
) -> GapOptions:
    """Options of the search. Raises ArgumentError for an effect that is not known.

    Parameters
    ----------
    effects, without, max_effects, false_discovery, workers, force, black_box
        As of :func:`.find_gap`.
    """
    for argument, names in (("effects", effects), ("without", without)):
        for name in names:
            if EFFECTS.get(name) is None:
                raise ArgumentError(argument, "", f"{name!r} is not an effect", EFFECTS.remedy(name))
    return GapOptions(tuple(effects) or None, tuple(without), max_effects, workers, false_discovery, force, black_box)


def search_ship(
    card: Card,
    trials: TrialPaths,
    holdout: TrialPaths,
    output: Path | None,
    options: GapOptions,
    executor: str,
    report: StageReport,
) -> GapResult:
    """Find the missing effect of a ship, and write it into a folder.

    Parameters
    ----------
    card : Card
    trials, holdout : paths
        As of :func:`.find_gap`.
    output : Path, optional
    options : GapOptions
    executor : str
        One of :data:`.EXECUTOR_FORMS`.
    report : callable
        Called with the stage that begins.

    Raises
    ------
    InputError
        As :func:`.find_gap`.
    """
    ship = nonlinear_card(card)
    if output is not None:
        refuse_early(output, [Path(ship.source), *trial_files(trials), *trial_files(holdout, "holdout")])
    with nullcontext() if output is None else folder_made(output), _workers(executor, options.workers) as pool:
        fitted, held = fitted_and_held(trials, holdout, ship, report_unused=False)  # a search uses them
        fitted = replace(fitted, notices=(*fitted.notices, *identified_from(ship, fitted)))
        gap = run_gap_workflow(ship, fitted, held, options, report, pool)
        result = gap_result(gap, fitted, held, force=options.force)
        if output is None:
            return result
        report("writing")
        return result.written_to(output)


def identified_from(card: ManoeuvringCard, fitted: Measured) -> list[Notice]:
    """A notice if the card was identified from some of the fitted trials.

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
        Notice(
            f"{card.source} was fitted to {', '.join(names)}: its coefficients may hold a part of the missing effect. "
            "Give gap the card as it was before these trials, and identify on the improved card afterwards"
        )
    ]


@contextmanager
def _workers(executor: str, workers: int | None) -> Iterator[Executor | None]:
    """The cluster, or processes of this machine that import the workflow while trials are read; None for one."""
    local = check_executor(executor) == PROCESSES
    number = processes_to_begin(workers)
    if local and number == 1:
        yield None
        return
    with executing(executor, number) as pool:
        for _ in range(number if local else 0):
            pool.submit(importlib.import_module, "tank2sim.gap.workflow")
        yield pool
