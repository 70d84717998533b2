"""Coefficients identified from free-running trials of a ship, or of a craft with thrusters."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING

from tank2sim.api.verbs import Output, Progress, verb
from tank2sim.arguments import Count, DrawsOfChain, SmallEnsemble, refuse_set
from tank2sim.errors import ArgumentError, InputError, close_name
from tank2sim.files import CARD
from tank2sim.identification.trials.options import (
    AUTO,
    AVERAGE,
    BY_EVIDENCE,
    BY_RESIDUALS,
    DRAWS_OF_CHAIN,
    STRUCTURE_WORDS,
    IdentificationOptions,
    Sampler,
    TrialMethod,
)
from tank2sim.quantities import Duration

if TYPE_CHECKING:
    from concurrent.futures import Executor

    import pandas as pd

    from tank2sim.api.trial import TrialRecord
    from tank2sim.arrays import Array
    from tank2sim.cards import Card, SteeredCard
    from tank2sim.dynamics.vessel import Vessel
    from tank2sim.identification.trials.identify import Identification
    from tank2sim.identification.trials.problem.captive_tests import CaptiveRuns
    from tank2sim.identification.trials.problem.estimation_problem import SearchReport
    from tank2sim.identification.trials.problem.prepare_trials import Measured
    from tank2sim.records.trials import Trial
    from tank2sim.results.craft_identification import CraftIdentificationResult
    from tank2sim.results.identification import IdentificationResult


def _card_files(result: IdentificationResult | CraftIdentificationResult, path: Path) -> dict[Path, str | bytes]:
    return result.card.files(path) if result.card else {}


@verb(
    "coefficients from free-running trials",
    Output("-o", CARD, "Write the card found.", _card_files, "CARD.toml"),
    choices={"structure": STRUCTURE_WORDS},
    results=(
        "tank2sim.results.identification:IdentificationResult",
        "tank2sim.results.craft_identification:CraftIdentificationResult",
    ),
)
def identify(
    ship: Vessel,
    trials: str | Path | TrialRecord | pd.DataFrame | Sequence[str | Path | TrialRecord | pd.DataFrame],
    *,
    holdout: str | Path | TrialRecord | pd.DataFrame | Sequence[str | Path | TrialRecord | pd.DataFrame] = (),
    method: TrialMethod = BY_RESIDUALS,
    structure: str = BY_EVIDENCE,
    campaign: str | Path | None = None,
    inertia: bool = False,
    piece_s: Duration | None = None,
    trust_card: bool = False,
    hold: Sequence[str] = (),
    force: bool = False,
    members: SmallEnsemble = 100,
    bootstrap: SmallEnsemble = 0,
    posterior: Sampler | None = None,
    draws: DrawsOfChain = DRAWS_OF_CHAIN,
    executor: str = "processes",
    workers: Count | None = None,
    report: Progress = lambda _: None,
) -> IdentificationResult | CraftIdentificationResult:
    """Identify the coefficients of a ship, or of a craft with thrusters, from free-running trials.

    The standard errors of the card are the prior. Trials are CSV, SIMMAN ``.dat`` or Esso Osaka CSV files. A craft
    takes `trials` and `holdout` alone: CSV files with position, heading and the revolutions ``n_<name>_rpm`` of each
    thruster, as :func:`.log` cuts them; current and mean wind are estimated for each trial.

    Parameters
    ----------
    ship : Vessel, Card, str or path
        The ship before the trials; its standard errors say how well each coefficient is known.
    trials : path, TrialRecord, DataFrame, or sequence of them
        Trials to fit; a folder means the trials in it.
    holdout : path, TrialRecord, DataFrame, or sequence of them
        Trials to compare with and not to fit.
    method : str
        How to fit; ``residuals`` is ``kalman`` for trials at sea that show gusts or waves, else ``output_error``.
    structure : str
        Terms of the model: one of these, or a structure of an installed package.
    campaign : path, optional
        ``campaign.toml`` of captive tests with a model of the ship, to be fitted together with the trials.
    inertia : bool
        Estimate acceleration derivatives, too.
    piece_s : float, optional
        Length of the pieces of output error, s; by default 5 L/u0.
    trust_card : bool
        Keep the card's standard errors, even if the trials require wider ones.
    hold : sequence of str
        Derivatives and parameters of effects that keep the card's values.
    force : bool
        Fit trials that look like another ship's, too; result and card are then marked.
    members : int
        Simulations behind the intervals of the figures of held-out trials.
    bootstrap : int
        Sets of trials that are simulated with the estimate and fitted again, for the scatter of the estimates.
    posterior : str, optional
        Sample the posterior, by the no-U-turn sampler or an ensemble of walkers. The card carries the samples, and
        estimates and intervals are theirs. Needs ``tank2sim[posterior]``; about 2 min for 20 coefficients.
    draws : int
        Draws of each of the sampler's four chains.
    executor : str
        Where cross-validation, bootstrap and intervals are computed: ``processes``, or ``dask://host:port``.
    workers : int, optional
        Processes; by default one for each core.
    report : callable
        Called with stage, step and cost of each better estimate. An interrupt keeps the best so far.

    Raises
    ------
    InputError
        A file is at fault, the trials are not of this ship, or they do not determine the coefficients.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import tank2sim as t2s
    >>> otter, folder = t2s.load("otter"), Path(tempfile.mkdtemp())
    >>> for name in ("straight:600", "spin:400", "difference:300"):
    ...     rows = otter.simulate(name, duration_s=10).df[::40]
    ...     rows.to_csv(folder / f"{name.partition(':')[0]}.csv", index=False)
    >>> found = t2s.identify(otter, folder)
    >>> abs(found.card.thrusters[0].ahead_Ns2 / 0.01108 - 1) < 0.05
    True
    """
    given = dict(locals())
    from tank2sim.api.trial import fitted_and_held, trials_of
    from tank2sim.cards import SteeredBy
    from tank2sim.identification.trials.identify import identify_trials
    from tank2sim.identification.trials.problem.structures import STRUCTURES
    from tank2sim.identification.trials.study import study_identification
    from tank2sim.records.trials import distinctly_named
    from tank2sim.results.identification import IdentificationResult

    progress = _step_report(report)
    steered = ship.steered()
    if steered.steered_by is SteeredBy.THRUSTERS:
        taken = {"ship", "trials", "holdout", "report"}
        refuse_set(identify, given, "is not for a craft with thrusters", taken=taken)
        to_fit, to_predict = distinctly_named(
            trials_of(trials, thrusters=steered.thrusters),
            trials_of(holdout, "holdout", thrusters=steered.thrusters),
        )
        return identify_craft(steered, to_fit, to_predict, progress)
    card = ship.manoeuvring()
    if structure not in (known := (*STRUCTURES.names(), AUTO, AVERAGE, BY_EVIDENCE)):
        raise ArgumentError("structure", "", f"{structure!r} is not known", close_name(structure, known))
    options = IdentificationOptions(
        method=method,
        structure=structure,
        inertia=inertia,
        piece_s=piece_s,
        scale_prior=not trust_card,
        members=members,
        bootstrap=bootstrap,
        hold=tuple(hold),
        force=force,
        posterior=posterior,
        draws=draws,
    )
    fitted, held = fitted_and_held(trials, holdout, card)
    if campaign is not None:
        fitted = replace(fitted, captive=captive_runs(campaign))
    with _computing(options, executor, workers, held=bool(held.trials)) as pool:
        found = identify_trials(card, fitted, held, options, progress, pool)
    return IdentificationResult(study_identification(card, found, fitted, held), _card(found, fitted), found)


def identify_craft(
    card: SteeredCard, fitted: Sequence[Trial], held: Sequence[Trial], progress: SearchReport | None = None
) -> CraftIdentificationResult:
    """Identify hull and thrust curves of a craft with thrusters from trials with position, heading and revolutions.

    `card`: mass and places of the thrusters are taken as exact, all else with the stated standard errors or wide ones;
    `fitted`, `held`: trials to fit, and trials only to predict (:func:`.read_craft_trial`); `progress`: called with
    each better estimate. Raises InputError: a file is at fault, or a trial is given twice.
    """
    import numpy as np
    from threadpoolctl import threadpool_limits

    from tank2sim.analysis.ensemble.draws import by_file_name
    from tank2sim.identification.craft.card import estimated_numbers, identified_craft
    from tank2sim.identification.craft.fit import FreePrediction, fit_craft, predict_free
    from tank2sim.identification.craft.order_response import order_responses
    from tank2sim.identification.craft.problem import craft_driven_by, craft_problem
    from tank2sim.identification.craft.study import study_craft
    from tank2sim.identification.trials.problem.estimation_problem import silent
    from tank2sim.records.same_record import refuse_copies
    from tank2sim.results.craft_identification import CraftIdentificationResult

    if not fitted:
        raise ArgumentError("trials", "", "is empty", "give trials, or a folder with CSV files")
    read = [*fitted, *held]
    alike = (*refuse_copies(fitted), *refuse_copies(fitted, held))
    problem, driven_by = craft_problem(card, read), craft_driven_by(card, read)
    runs = problem.runs
    # A step of the search may be one to an unstable craft. Threads of the linear algebra only wait for each other.
    with np.errstate(all="ignore"), threadpool_limits(limits=1, user_api="blas"):
        fit = fit_craft(problem.with_runs(runs[: len(fitted)]), progress or silent)
        predictions = predict_free(fit, runs[len(fitted) :]) if held else []
    responses = order_responses(card, fitted)
    names = [run.name for run in runs[len(fitted) :]]
    found = identified_craft(card, fit, responses)
    estimated = estimated_numbers(card, fit)
    places = list(estimated.values())
    covariance = by_file_name(found, list(estimated), fit.estimate.covariance[np.ix_(places, places)])
    held_out: dict[str, FreePrediction | None] = dict.fromkeys(names)
    held_out |= {prediction.run.name: prediction for prediction in predictions}
    study = study_craft(card, found, fit, held_out, responses, driven_by)
    study = replace(study, notices=(*alike, *study.notices))
    return CraftIdentificationResult(study, replace(found, covariance=covariance), fit, tuple(predictions))


def _step_report(report: Progress) -> SearchReport:
    """The report of a search: a line for each better estimate."""
    steps = count(1)

    def progress(stage: str, values: Array, cost: float) -> None:
        report(f"{stage}: step {next(steps)}, cost {cost:.6g} (Ctrl-C keeps the best so far)")

    return progress


def _card(found: Identification, fitted: Measured) -> Card:
    """The card found, with the covariance of its estimates."""
    from tank2sim.analysis.ensemble.draws import by_file_name
    from tank2sim.cards import parse_card
    from tank2sim.identification.trials.problem.prepare_trials import with_fitted_trials
    from tank2sim.identification.trials.study import identified_card_text

    captive = fitted.captive
    tank = [f"{len(captive.runs)} captive tests of {captive.campaign.path.name}"] if captive else []
    text = identified_card_text(found, [*(trial.name for trial in fitted.trials), *tank])
    text = with_fitted_trials(text, "the card found", fitted.trials)
    estimate = found.estimate
    covariance = by_file_name(found.card, estimate.free, estimate.covariance, estimate.samples)
    return replace(parse_card(text, "the card found"), covariance=covariance)


def captive_runs(campaign: str | Path) -> CaptiveRuns:
    """The reduced runs of a campaign, with rudder tests at other speeds; InputError if it is at fault or at a heel."""
    from tank2sim.identification.captive.reduction import ReductionOptions, reduce_campaign
    from tank2sim.identification.trials.problem.captive_tests import CaptiveRuns
    from tank2sim.records.campaigns import read_campaign

    read = read_campaign(campaign)
    if heeled := next((run.name for run in read.runs if run.heel_rad), ""):
        raise InputError(
            campaign, "runs", f"{heeled} is at a heel", "identify takes captive tests upright: leave it out"
        )
    return CaptiveRuns(read, reduce_campaign(read, ReductionOptions(off_speed=True)).runs)


@contextmanager
def _computing(
    options: IdentificationOptions, executor: str, workers: int | None, *, held: bool
) -> Iterator[Executor | None]:
    """Executor for cross-validation and bootstrap; a cluster also computes the intervals of held-out trials."""
    from tank2sim.arguments import PROCESSES
    from tank2sim.executors import check_executor, executing

    on_this_machine = check_executor(executor) == PROCESSES
    several = options.structure in (AUTO, AVERAGE)
    if not on_this_machine and not (several or options.bootstrap or (held and options.members)):
        remedy = f"give structure {AUTO}, bootstrap or holdout, too"
        raise ArgumentError("executor", "", "has nothing to do", remedy)
    if on_this_machine and not several and not options.bootstrap:
        yield None
        return
    with executing(executor, workers) as pool:
        yield pool
