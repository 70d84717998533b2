"""From a card and trials to a better card, with what the trials can and cannot tell."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from tank2sim.arrays import Array
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.dynamics import build
from tank2sim.errors import InputError
from tank2sim.identification.trials.assessment.comparison import Comparison, compare_card, noise_of
from tank2sim.identification.trials.assessment.evaluation import replay_error
from tank2sim.identification.trials.assessment.identifiability import Identifiability, identifiability, refuse_unseen
from tank2sim.identification.trials.assessment.model_selection import (
    Criteria,
    CrossValidation,
    cross_validate,
    simplest,
    yaw_rate_error,
)
from tank2sim.identification.trials.assessment.other_ship import other_ship
from tank2sim.identification.trials.assessment.prediction_intervals import (
    FittedProblem,
    bootstrapped,
    criteria_or_none,
    held_out,
)
from tank2sim.identification.trials.methods.equation_error import equation_error
from tank2sim.identification.trials.methods.kalman import kalman
from tank2sim.identification.trials.methods.output_error import OutputErrorSettings, output_error
from tank2sim.identification.trials.methods.posterior import scaled_prior
from tank2sim.identification.trials.methods.recursive import recursive
from tank2sim.identification.trials.problem.estimation_problem import Estimate, Problem, SearchReport, silent
from tank2sim.identification.trials.problem.picklable import portable
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.identification.trials.problem.problem_from_card import answered, problem_from_card, with_range
from tank2sim.identification.trials.problem.structures import AUTO, STRUCTURES
from tank2sim.records.trials import Trial
from tank2sim.simulation.recorded import recorded

PIECE = 5.0
"""Length of the pieces of output error, in L/u0: on the KVLCC2 30 s of model time, in which the model's error stays
small against the motion; shorter pieces see less of what the derivatives do, longer ones run away when unstable."""

LEAST_PIECE = 0.5
"""Shortest piece, in L/u0: in less the state hardly answers the rudder, and there are more initial states than data."""

WHOLE_RUN_MISFIT = 3.0
"""Whole runs are fitted when the model follows them, too: to this many times the noise, in every signal (project
choice)."""

TRIAL_METHODS: tuple[str, ...] = ("output_error", "equation_error", "kalman", "recursive")


@dataclass(frozen=True)
class IdentificationOptions:
    """How trials are fitted.

    Parameters
    ----------
    method : str
        One of :data:`TRIAL_METHODS`.
    structure : str
        One of :data:`tank2sim.identification.trials.problem.structures.STRUCTURES`, or :data:`.structures.AUTO`.
    inertia : bool
        Estimate acceleration derivatives, too.
    piece_s : float, optional
        Length of the pieces of output error, s; by default :data:`PIECE`.
    scale_prior : bool
        Let the trials tell how far the card's standard errors may be trusted.
    members : int
        Simulations from which the intervals of the figures of trials held out are taken; 0 for none.
    bootstrap : int
        Members of a parametric bootstrap of the estimates; 0 for none.
    hold : tuple of str
        Derivatives (``Xuuu``) and parameters of effects (``wind.yaw_coefficient``) that stay as the card has them.
    force : bool
        Fit trials also where they look like those of another ship (:mod:`.other_ship`).
    """

    method: str = "output_error"
    structure: str = "card"
    inertia: bool = False
    piece_s: float | None = None
    scale_prior: bool = True
    members: int = 100
    bootstrap: int = 0
    hold: tuple[str, ...] = ()
    force: bool = False


@dataclass(frozen=True, eq=False)
class Identification:
    """What came of trials.

    Parameters
    ----------
    started : ManoeuvringCard
        The card from which the estimate began: that given, in the structure asked for.
    card : ManoeuvringCard
        With the estimates and their standard errors.
    problem : Problem
        What was asked of the trials to fit.
    estimate : Estimate
    identifiability : Identifiability
    noise : mapping
        Standard deviation of measurement noise by variable, from the files or estimated: the unit of misfit.
    fit, holdout : Comparison
        The new card against the trials it was fitted to, and against those it was not (None: there are none).
    before, before_holdout : Comparison
        The card that was given, against the same.
    structure : str
        Of the model: the one asked for, or chosen.
    manoeuvres : mapping
        Trial to what it was recognised as, in words.
    forced : tuple of str
        What speaks against the trials being of the card's ship, where they were fitted all the same.
    structures : mapping
        Cross-validation of each structure that was tried: none, unless the choice was left to it.
    criteria : Criteria or None
        Information criteria of the fit, to compare with those of another model of the same trials; None where the
        velocities for them were not measured.
    bootstrap : array (members, k) or None
        Estimates from trials that were simulated again with the estimate (:mod:`.prediction`), where asked for.
    notices : tuple of str
    """

    started: ManoeuvringCard
    card: ManoeuvringCard
    problem: Problem
    estimate: Estimate
    identifiability: Identifiability
    noise: Mapping[str, float]
    fit: Comparison
    holdout: Comparison | None
    before: Comparison
    before_holdout: Comparison | None
    structure: str
    structures: Mapping[str, CrossValidation]
    criteria: Criteria | None
    bootstrap: Array | None
    manoeuvres: Mapping[str, str]
    forced: tuple[str, ...]
    notices: tuple[str, ...]


def identify_trials(
    card: ManoeuvringCard,
    trials: Measured,
    holdout: Measured | None = None,
    options: IdentificationOptions | None = None,
    progress: SearchReport = silent,
    executor: Executor | None = None,
) -> Identification:
    """Estimate the coefficients of a card from free-running trials.

    Parameters
    ----------
    card : ManoeuvringCard
        What is known of the ship; its standard errors say how well.
    trials, holdout : Measured
        Trials to fit, and trials only to compare with.
    options : IdentificationOptions, optional
    progress : callable
        Called with each better estimate. A KeyboardInterrupt ends the search with the best so far.
    executor : concurrent.futures.Executor, optional
        For the fits of cross-validation and bootstrap, and the simulations behind intervals.

    Raises
    ------
    InputError
        The trials look like those of another ship than the card's, or of two, do not excite what is to be estimated,
        lack signals that are needed, or are driven otherwise than those held out.
    """
    options = options or IdentificationOptions()
    try:
        return _identified(card, trials, holdout, options, (progress, executor))
    except np.linalg.LinAlgError:
        names = ", ".join(trial.name for trial in trials.trials)
        remedy = "add runs in which rudder, yaw, sway and speed change, or hold terms (--hold)"
        raise InputError(names, "", "excites too little to estimate anything", remedy) from None


def _identified(
    card: ManoeuvringCard,
    trials: Measured,
    holdout: Measured | None,
    options: IdentificationOptions,
    how: tuple[SearchReport, Executor | None],
) -> Identification:
    progress, executor = how
    tried = cross_validated(card, trials, options, executor) if options.structure == AUTO else {}
    structure = simplest(tried) if tried else options.structure
    started = STRUCTURES[structure].start(card)
    problem = problem_from_card(started, trials.trials, trials.driven_by, inertia=options.inertia, hold=options.hold)
    unseen = refuse_unseen(problem)
    problem = problem.without(unseen)
    against = other_ship(problem_from_card(card, trials.trials, trials.driven_by))  # not in a structure that knows less
    if against and not options.force:
        names = ", ".join(trial.name for trial in trials.trials)
        problem_told = f"not trials of the ship of {card.source}: {'; '.join(against)}"
        raise InputError(names, "", problem_told, "give the card and the trials of one ship, or --force")
    estimate = estimated(problem, options, progress)
    improved = with_range(answered(started, estimate), problem)
    whole = started.model.valid_speed_mps is None
    answer = FittedProblem(problem, estimate, improved, whole)
    noise = noise_of(trials, problem)
    result = identifiability(problem, estimate)
    held = holdout if holdout is not None and holdout.trials else None
    return Identification(
        started=started,
        card=improved,
        problem=problem,
        estimate=estimate,
        identifiability=result,
        noise=noise,
        fit=compare_card(improved, trials, estimate.noise, whole=whole),
        holdout=held_out(answer, held, options.members, executor) if held else None,
        before=compare_card(card, trials, estimate.noise),
        before_holdout=compare_card(card, held, estimate.noise) if held else None,
        structure=structure,
        structures=tried,
        criteria=criteria_or_none(answer),
        bootstrap=bootstrapped(
            answer, trials.driven_by, partial(_in_pieces, options=options), options.bootstrap, executor
        ),
        forced=against,
        manoeuvres=_manoeuvres(improved, (*trials.trials, *(held.trials if held else ()))),
        notices=(
            *trials.notices,
            *(held.notices if held else ()),
            *_told(card),
            *_told_unseen(unseen),
            *estimate.notices,
        ),
    )


def _manoeuvres(card: ManoeuvringCard, trials: Sequence[Trial]) -> dict[str, str]:
    model = build(card)
    known = {trial.name: recorded(trial, model) for trial in trials}
    return {name: what.words for name, what in known.items() if what is not None}


def estimated(problem: Problem, options: IdentificationOptions, progress: SearchReport = silent) -> Estimate:
    """The estimate by the method asked for; output error begins at what equation error found, if that is better."""
    if options.method == "kalman":
        return kalman(problem, progress=progress)
    if options.method == "recursive":
        return _recursive(problem, options, progress)
    if options.method == "equation_error":
        return equation_error(problem, progress=progress)
    length = options.piece_s or PIECE * problem.ship_time
    if length < LEAST_PIECE * problem.ship_time:
        least = LEAST_PIECE * problem.ship_time
        raise InputError(
            "--piece", "", f"is {length:g} s", f"{least:.3g} s or more ({LEAST_PIECE:g} L/u0) tell anything"
        )
    settings = OutputErrorSettings(piece_s=length, scale_prior=options.scale_prior)
    in_pieces = output_error(problem, _start(problem), settings, progress)
    if in_pieces.notices or not _follows_whole_runs(problem, in_pieces):
        return in_pieces
    return output_error(problem, in_pieces.values, replace(settings, piece_s=None), progress)


def cross_validated(
    card: ManoeuvringCard, trials: Measured, options: IdentificationOptions, executor: Executor | None = None
) -> dict[str, CrossValidation]:
    """Each structure fitted without some of the trials, and its yaw-rate error on them."""
    results = {}
    for name, structure in STRUCTURES.items():
        started = structure.start(card)
        problem = problem_from_card(
            started, trials.trials, trials.driven_by, inertia=options.inertia, hold=options.hold
        )
        asked = portable(problem, started, trials.driven_by)
        results[name] = cross_validate(asked, partial(_in_pieces, options=options), yaw_rate_error, executor)
    return results


def _in_pieces(problem: Problem, options: IdentificationOptions) -> Estimate:
    """What a fold is fitted by: pieces only, and fewer rounds, for it is compared with its like."""
    if options.method != "output_error":
        return estimated(problem, options)
    length = options.piece_s or PIECE * problem.ship_time
    return output_error(
        problem, _start(problem), OutputErrorSettings(length, scale_prior=options.scale_prior, rounds=3)
    )


def _start(problem: Problem) -> Array | None:
    """Values from which output error begins: those of the weak form, which needs no start; None without velocities."""
    try:
        return equation_error(problem).values
    except InputError:
        return None


def _recursive(problem: Problem, options: IdentificationOptions, progress: SearchReport) -> Estimate:
    """The recursive estimator, which takes its prior as it is: widened first by what the weak form says of it."""
    if not options.scale_prior:
        return recursive(problem, progress=progress)
    scale = equation_error(problem).prior_scale
    widened = replace(problem, prior_error=scaled_prior(problem, scale))
    return replace(recursive(widened, progress=progress), prior_scale=scale)


def _follows_whole_runs(problem: Problem, estimate: Estimate) -> bool:
    results = replay_error(problem, estimate.values, estimate.noise)
    limits = {name: WHOLE_RUN_MISFIT * deviation for name, deviation in estimate.noise.items()}
    return all(error <= limits[name] for result in results for name, error in result.whole.items())


def _told_unseen(names: Sequence[str]) -> Sequence[str]:
    if not names:
        return ()
    text = ", ".join(name.removeprefix("derivatives.") for name in names)
    return (f"the trials show nothing of {text}: held as the card has them",)


def _told(card: ManoeuvringCard) -> Sequence[str]:
    if card.uncertainty:
        return ()
    return ("the card states no uncertainty: 2 % of each derivative is taken, and widened as the trials demand",)
