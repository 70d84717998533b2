"""Coefficients identified from free-running trials."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from tank2sim.analysis.ensemble.draws import by_file_name
from tank2sim.api.trial import TrialPaths, fitted_and_held
from tank2sim.arguments import Count, DrawsOfChain, PositiveArgument, SmallEnsemble, checked
from tank2sim.cards import Card, parse_card
from tank2sim.dynamics.vessel import Vessel, as_vessel
from tank2sim.errors import InputError
from tank2sim.executors import PROCESSES, check_executor, executing
from tank2sim.identification.captive.reduction import ReductionOptions, reduce_campaign
from tank2sim.identification.trials.identify import Identification, identify_trials
from tank2sim.identification.trials.methods.posterior_sampling import DRAWS_OF_CHAIN
from tank2sim.identification.trials.options import BY_RESIDUALS, TRIAL_METHODS, IdentificationOptions
from tank2sim.identification.trials.problem.captive_tests import CaptiveRuns
from tank2sim.identification.trials.problem.estimation_problem import SearchReport, silent
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.identification.trials.problem.signatures import with_fitted_trials
from tank2sim.identification.trials.problem.structures import AUTO, AVERAGE, BY_EVIDENCE, STRUCTURES
from tank2sim.identification.trials.study import identified_card_text, study_identification
from tank2sim.records.campaigns import read_campaign
from tank2sim.results.identification import IdentificationResult


@checked
def identify(
    card: Vessel | Card | str | Path,
    trials: TrialPaths,
    *,
    holdout: TrialPaths = (),
    method: str = BY_RESIDUALS,
    structure: str = BY_EVIDENCE,
    campaign: str | Path | None = None,
    inertia: bool = False,
    piece_s: PositiveArgument | None = None,
    trust_card: bool = False,
    hold: Sequence[str] = (),
    force: bool = False,
    members: SmallEnsemble = 100,
    bootstrap: SmallEnsemble = 0,
    posterior: str = "",
    draws: DrawsOfChain = DRAWS_OF_CHAIN,
    executor: str = PROCESSES,
    workers: Count | None = None,
    progress: SearchReport = silent,
) -> IdentificationResult:
    """Identify the coefficients of a ship from free-running trials.

    Parameters
    ----------
    card : Vessel, Card, str or path
        What is known of the ship beforehand; its standard errors say how well.
    trials, holdout : path, TrialRecord, or sequence of them
        Trials to fit, and trials only to compare with; a folder means the trials in it.
    method : str
        ``output_error``, ``equation_error``, ``kalman`` or ``recursive``; ``residuals``: the Kalman filter for trials
        at sea in which output error leaves more than the noise of the sensors, else output error.
    structure : str
        One of :data:`tank2sim.identification.trials.problem.structures.STRUCTURES`; ``auto``: by cross-validation;
        ``average``: intervals of all structures, weighted by their predictions, with the card of the best;
        ``evidence``: cross-flow drag, unless the trials prefer the card's own terms very strongly by the Bayesian
        information criterion.
    campaign : path, optional
        ``campaign.toml`` of captive tests with a model of the ship, fitted together with the trials: its forces,
        Froude-scaled, with the gain of each force, of the rudder, an offset of X and the moment's reference point
        uncertain between tank and ship.
    inertia : bool
        Estimate acceleration derivatives, too.
    piece_s : float, optional
        Length of the pieces of output error, s; by default 5 L/u0.
    trust_card : bool
        Take the card's standard errors as they are.
    hold : sequence of str
        Derivatives or parameters of effects that stay as the card has them.
    force : bool
        Fit trials also where they look like another ship's; the result is marked.
    members : int
        Simulations behind the intervals of the figures of held-out trials.
    bootstrap : int
        Sets of trials simulated again with the estimate and fitted, for its scatter.
    posterior : str
        ``nuts``: sample the posterior by the no-U-turn sampler; ``ensemble``: by an ensemble of walkers. Estimates,
        their covariance and all intervals are then those of the samples, which the card carries next to it; about 2 min
        for 20 coefficients. Needs ``tank2sim[posterior]``.
    draws : int
        Draws of each of the sampler's four chains.
    executor : str
        ``processes`` or ``dask://host:port``.
    workers : int, optional
        Processes for cross-validation and bootstrap.
    progress : callable
        Called with stage, values and cost of each better estimate.

    Raises
    ------
    InputError
        A file is at fault, the trials are not of the card's ship, or they do not determine the coefficients.
    """
    for name, value, known in (
        ("method", method, TRIAL_METHODS),
        ("structure", structure, (*STRUCTURES.names(), AUTO, AVERAGE, BY_EVIDENCE)),
    ):
        if value not in known:
            raise InputError(name, "", f"{value!r} is not known", f"there are: {', '.join(known)}")
    ship = as_vessel(card).manoeuvring()
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
    fitted, held = fitted_and_held(trials, holdout, ship)
    if campaign is not None:
        fitted = replace(fitted, captive=captive_runs(campaign))
    with _computing(options, executor, workers, held=bool(held.trials)) as pool:
        found = identify_trials(ship, fitted, held, options, progress, pool)
    return IdentificationResult(study_identification(ship, found, fitted, held), _card(found, fitted), found)


def _card(found: Identification, fitted: Measured) -> Card:
    """The card found, with the covariance of its estimates."""
    captive = fitted.captive
    tank = [f"{len(captive.runs)} captive tests of {captive.campaign.path.name}"] if captive else []
    text = identified_card_text(found, [*(trial.name for trial in fitted.trials), *tank])
    text = with_fitted_trials(text, "the card found", fitted.trials)
    estimate = found.estimate
    covariance = by_file_name(found.card, estimate.free, estimate.covariance, estimate.samples)
    return replace(parse_card(text, "the card found"), covariance=covariance)


def captive_runs(campaign: str | Path) -> CaptiveRuns:
    """The reduced runs of a campaign, rudder tests at other speeds included.

    Raises
    ------
    InputError
        The campaign is at fault, see :func:`tank2sim.reduce`.
    """
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
    """For cross-validation and bootstrap; a cluster for the intervals of what is held out, too."""
    on_this_machine = check_executor(executor) == PROCESSES
    several = options.structure in (AUTO, AVERAGE)
    if not on_this_machine and not (several or options.bootstrap or (held and options.members)):
        remedy = f"give --structure {AUTO}, --bootstrap N or --holdout TRIAL, too"
        raise InputError("--executor", "", "has nothing to do", remedy)
    if on_this_machine and not several and not options.bootstrap:
        yield None
        return
    with executing(executor, workers) as pool:
        yield pool
