"""The search for the missing effect of a ship, written into a folder."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from tank2sim.api.trial import fitted_and_held, trial_files
from tank2sim.cards import Card, SteeredBy, SteeredCard
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.errors import ArgumentError
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
    executor: Executor | None,
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
    executor : Executor, optional
        Where explanations are fitted; by default in this process.
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
    with nullcontext() if output is None else folder_made(output):
        fitted, held = fitted_and_held(trials, holdout, ship, report_unused=False)  # a search uses them
        fitted = replace(fitted, notices=(*fitted.notices, *identified_from(ship, fitted)))
        gap = run_gap_workflow(ship, fitted, held, options, report, executor)
        result = gap_result(gap, fitted, held, force=options.force)
        if output is None:
            return result
        report("writing")
        return result.written_to(output)


def identified_from(card: SteeredCard, fitted: Measured) -> list[Notice]:
    """A notice if the card was identified from some of the fitted trials.

    Parameters
    ----------
    card : SteeredCard
    fitted : Measured
        Trials that name the effect.
    """
    if card.steered_by is SteeredBy.THRUSTERS:
        return []
    names = [trial.name for trial in fitted.trials if fitted_as(card.manoeuvring(), trial) is not None]
    if not names:
        return []
    return [
        Notice(
            f"{card.source} was fitted to {', '.join(names)}: its coefficients may hold a part of the missing effect. "
            "Give gap the card as it was before these trials, and identify on the improved card afterwards"
        )
    ]
