"""Identification of a better card from a card and trials, with the identifiability of its parameters."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from threadpoolctl import threadpool_limits

from tank2sim.arrays import Array
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.cards.examination import doubts
from tank2sim.dynamics import build
from tank2sim.errors import ArgumentError, InputError
from tank2sim.identification.trials.assessment.evaluation import Comparison, compare_card, noise_of, replay_error
from tank2sim.identification.trials.assessment.identifiability import Identifiability, identifiability, refuse_unseen
from tank2sim.identification.trials.assessment.model_selection import (
    Criteria,
    CrossValidation,
    cross_validate,
    predictive_weights,
    simplest,
    yaw_rate_error,
)
from tank2sim.identification.trials.assessment.other_ship import far_from_card, not_of_ship, other_ship
from tank2sim.identification.trials.assessment.prediction_intervals import (
    FittedProblem,
    WeightedFit,
    bootstrap_estimates,
    compare_held_out,
    criteria_or_none,
)
from tank2sim.identification.trials.assessment.structure_choice import (
    MethodChoice,
    choose_method,
    posed_in,
    signal_residuals,
    structure_by_evidence,
)
from tank2sim.identification.trials.methods.equation_error import equation_error
from tank2sim.identification.trials.methods.kalman import KalmanSettings, kalman
from tank2sim.identification.trials.methods.output_error import OutputErrorSettings, output_error
from tank2sim.identification.trials.methods.posterior_sampling import (
    PosteriorSamples,
    check_sampler,
    sample_posterior,
)
from tank2sim.identification.trials.options import (
    AUTO,
    AVERAGE,
    BY_EVIDENCE,
    BY_RESIDUALS,
    PIECE,
    IdentificationOptions,
)
from tank2sim.identification.trials.problem.captive_tests import CaptiveRuns
from tank2sim.identification.trials.problem.estimation_problem import Estimate, Problem, SearchReport, silent
from tank2sim.identification.trials.problem.picklable import portable
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.identification.trials.problem.problem_from_card import (
    card_with_estimate,
    lowered_bound_notice,
    polynomial_over_trials,
    problem_from_card,
    with_range,
)
from tank2sim.identification.trials.problem.structures import STRUCTURES
from tank2sim.identification.trials.problem.water_current import (
    WaterCurrent,
    at_sea,
    card_in,
    current_alone,
    of_unknown_current,
    with_current,
    without_current,
)
from tank2sim.notices import Notice, caution
from tank2sim.records.trials import Trial
from tank2sim.simulation.recorded import recorded

LEAST_PIECE = 0.5
"""Shortest piece, in L/u0: in less the state hardly responds to the rudder, and initial states outnumber the data."""

LEAST_WEIGHT = 0.02
"""Structures of less weight are left out of an average: of 100 members they would be one or two (project choice)."""

WHOLE_RUN_MISFIT = 3.0
"""Largest error, over the noise of every signal, of a model that is fitted to whole runs, too (project choice)."""

_NO_UNCERTAINTY = Notice(
    "the card states no uncertainty: 2 % of each derivative is taken, and widened as the trials demand"
)

METHOD_WORDS = {"kalman": ("the Kalman filter", "output_error"), "output_error": ("output error", "kalman")}
"""Method that a choice takes, to its name in words and the other method."""


@dataclass(frozen=True, eq=False)
class Identification:
    """Result of an identification."""

    started: ManoeuvringCard  # The start card of the estimate: the given card in the requested structure
    card: ManoeuvringCard  # With the estimates and their standard errors
    problem: Problem  # The problem of the fitted trials
    estimate: Estimate
    identifiability: Identifiability
    # Standard deviation of measurement noise by variable, stated in the files or estimated: the unit of misfit
    noise: Mapping[str, float]
    # `fit`, `holdout`: Comparison of the new card with the fitted trials, and with the held-out trials (None
    # without any)
    fit: Comparison
    holdout: Comparison | None
    # `before`, `before_holdout`: The same for the given card
    before: Comparison
    before_holdout: Comparison | None
    structure: str  # Structure of the model, as requested or chosen
    # Cross-validation of each structure; empty unless the structure is :data:`.options.AUTO` or
    # :data:`.options.AVERAGE`
    structures: Mapping[str, CrossValidation]
    # Weight of each structure in the intervals of held-out trials; empty unless it is :data:`.options.AVERAGE`
    weights: Mapping[str, float]
    # Information criteria of the fit, for comparison with another model of the same trials; None where the
    # velocities were not measured
    criteria: Criteria | None
    # On request; values and covariance of the estimate are then its means and covariance
    posterior: PosteriorSamples | None
    # (members, k): Estimates from trials simulated with the estimate (:mod:`.prediction_intervals`), on request
    bootstrap: Array | None
    manoeuvres: Mapping[str, str]  # Trial to a description of the recognised manoeuvre
    forced: tuple[str, ...]  # Evidence that the trials are not of the card's ship, where the fit was forced
    notices: tuple[Notice, ...]
    # Estimated with the coefficients; None where the card or a sensor states it, and in a basin. All cards have
    # it.
    current: WaterCurrent | None = None
    choice: MethodChoice | None = None  # Choice of the method, and its reason; None where the options name the method

    @property
    def comparisons(self) -> tuple[tuple[str, Comparison, Comparison], ...]:
        """The given and the new card on the trials "fitted" and, if there are any, on those "held out"."""
        fitted = "fitted", self.before, self.fit
        if self.holdout is None or self.before_holdout is None:
            return (fitted,)
        return fitted, ("held out", self.before_holdout, self.holdout)


_OF_ONE_SHIP = "give the card and the trials of one ship, in the same units and signs, or force the fit"


def identify_trials(
    card: ManoeuvringCard,
    trials: Measured,
    holdout: Measured | None = None,
    options: IdentificationOptions | None = None,
    progress: SearchReport = silent,
    executor: Executor | None = None,
) -> Identification:
    """Estimate the coefficients of a card from free-running trials, alone or together with captive tests.

    `card`: Prior of the ship: values and standard errors. `trials`, `holdout`: Trials to fit, and trials for comparison
    only. `progress`: Called with each better estimate. A KeyboardInterrupt ends the search with the best estimate so
    far. `executor`: For the fits of cross-validation and bootstrap, and the simulations behind intervals. Raises
    InputError: The captive tests are of another ship, or the method is not output error; the trials look like those of
    another ship than the card's, or of two ships, do not excite the estimated parameters, lack necessary signals, or
    are driven by another rudder signal than the held-out trials.
    """
    options = options or IdentificationOptions()
    try:
        # Small matrices: threads of the linear algebra library wait for each other, and runs have their own threads.
        with threadpool_limits(limits=1, user_api="blas"):
            return _identified(card, trials, holdout, options, progress, executor)
    except np.linalg.LinAlgError:
        names = ", ".join(trial.name for trial in trials.trials)
        remedy = "add runs in which rudder, yaw, sway and speed change, or hold terms"
        raise InputError(names, "", "excites too little to estimate anything", remedy) from None


def _identified(
    card: ManoeuvringCard,
    trials: Measured,
    holdout: Measured | None,
    options: IdentificationOptions,
    progress: SearchReport,
    executor: Executor | None,
) -> Identification:
    _refuse_options(card, trials, options)
    given, card = card, polynomial_over_trials(card, trials.trials)
    drifts = of_unknown_current(card, trials.trials)
    if drifts:
        card = card_in(card, _first_current(card, trials))
    chosen = _choose_structure(card, trials, options, holdout, executor)
    structure = chosen.name
    evidence = other_ship(problem_from_card(card, trials.trials, trials.driven_by))  # in the structure of the card
    if evidence and not options.force:
        raise not_of_ship(card, trials, evidence, _OF_ONE_SHIP)
    fit = _fitted(card, structure, trials, options, progress, drifts=drifts)
    evidence += far_from_card(fit.fitted.problem, fit.fitted.estimate)
    if evidence and not options.force:
        raise not_of_ship(card, trials, evidence, _OF_ONE_SHIP)
    started, fitted, current = fit.started, fit.fitted, fit.current
    card = card if current is None else card_in(card, current)
    samples = None
    if options.posterior:
        samples = sample_posterior(fitted.problem, fitted.estimate, options.posterior, options.draws)
        fitted = _with_samples(fitted, started, samples)
    problem, estimate, improved = fitted.problem, fitted.estimate, fitted.card
    noise = noise_of(trials, problem)
    result = identifiability(problem, estimate)
    held = holdout if holdout is not None and holdout.trials else None
    average = [
        WeightedFit(fitted if name == structure else _fitted(card, name, trials, options, drifts=drifts).fitted, weight)
        for name, weight in chosen.weights.items()
    ]
    return Identification(
        started=started,
        card=improved,
        problem=problem,
        estimate=estimate,
        identifiability=result,
        noise=noise,
        fit=compare_card(improved, trials, estimate.noise, whole=fitted.whole),
        holdout=compare_held_out(fitted, held, options.members, executor, average) if held else None,
        before=compare_card(card, trials, estimate.noise),
        before_holdout=compare_card(card, held, estimate.noise) if held else None,
        structure=structure,
        structures=chosen.structures,
        weights=chosen.weights,
        criteria=criteria_or_none(fitted),
        posterior=samples,
        bootstrap=bootstrap_estimates(
            fitted, trials.driven_by, partial(_in_pieces, options=options), options.bootstrap, executor
        ),
        forced=evidence,
        manoeuvres=_manoeuvres(improved, (*trials.trials, *(held.trials if held else ()))),
        current=current,
        choice=fit.choice,
        notices=_notices((given, card, improved), trials, held, chosen, fit, samples),
    )


def _notices(
    cards: tuple[ManoeuvringCard, ManoeuvringCard, ManoeuvringCard],
    trials: Measured,
    held: Measured | None,
    chosen: _ChosenStructure,
    fit: _Fit,
    samples: PosteriorSamples | None,
) -> tuple[Notice, ...]:
    """All notices of an identification; `cards` are the given card, the card of the fit and the card found."""
    given, card, improved = cards
    return (
        *dict.fromkeys((*doubts(given), *doubts(improved))),
        *trials.notices,
        *(held.notices if held else ()),
        *lowered_bound_notice(given, card),
        *(() if card.uncertainty else (_NO_UNCERTAINTY,)),
        *_captive_notice(card, trials.captive),
        *chosen.notices,
        *_unseen_notice(fit.unseen),
        *_current_notice(fit.current),
        *_choice_notice(fit.choice),
        *(samples.notices if samples is not None and samples.converged else ()),
        *fit.fitted.estimate.notices,
    )


def _refuse_options(card: ManoeuvringCard, trials: Measured, options: IdentificationOptions) -> None:
    """Raise ArgumentError for options that do not go together, or not with the card or captive tests."""
    if trials.captive is not None and not _by_output_error(options):
        remedy = "leave the method out, or fit the card that reduce makes of the campaign"
        raise ArgumentError("campaign", "", f"{options.method} fits trials alone", remedy)
    if options.posterior:
        check_sampler(options.posterior)
        if not _by_output_error(options):
            raise ArgumentError("posterior", "", f"{options.method} has no density to sample", "leave the method out")
    if card.model.kind == "mmg" and options.structure not in ("card", BY_EVIDENCE):
        problem_text = f"{options.structure} is a structure of a polynomial, and {card.source} is an MMG card"
        remedy = "leave it out, or fit the card that convert makes of this one"
        raise ArgumentError("structure", "", problem_text, remedy)


@dataclass(frozen=True, eq=False)
class _ChosenStructure:
    """Structure of the fit, cross-validation and weights of all where asked for, and notices of the choice."""

    name: str
    structures: Mapping[str, CrossValidation] = field(default_factory=dict)
    weights: Mapping[str, float] = field(default_factory=dict)
    notices: tuple[Notice, ...] = ()


def _choose_structure(
    card: ManoeuvringCard,
    trials: Measured,
    options: IdentificationOptions,
    holdout: Measured | None,
    executor: Executor | None,
) -> _ChosenStructure:
    if options.structure == BY_EVIDENCE:
        name, notices = structure_by_evidence(card, trials, options, holdout)
        return _ChosenStructure(name, notices=notices)
    if options.structure not in (AUTO, AVERAGE):
        return _ChosenStructure(options.structure)
    structures = cross_validate_structures(card, trials, options, executor)
    if options.structure == AUTO:
        return _ChosenStructure(simplest(structures), structures)
    weights = _kept_weights(card, trials, options, structures)
    heaviest = max(weights, key=weights.__getitem__)
    return _ChosenStructure(heaviest, structures, weights, (Notice(_average_in_words(weights)),))


def _manoeuvres(card: ManoeuvringCard, trials: Sequence[Trial]) -> dict[str, str]:
    model = build(card)
    known = {trial.name: recorded(trial, model) for trial in trials}
    return {name: manoeuvre.words for name, manoeuvre in known.items() if manoeuvre is not None}


def _by_output_error(options: IdentificationOptions) -> bool:
    return options.method in (BY_RESIDUALS, "output_error")


def estimate_parameters(problem: Problem, options: IdentificationOptions, progress: SearchReport = silent) -> Estimate:
    """The estimate by the method of the options, output error for :data:`BY_RESIDUALS`."""
    if options.method == "kalman":
        return _filtered(problem, options, progress)
    if options.method == "equation_error":
        return equation_error(problem, progress=progress)
    return _over_whole_runs(problem, _over_pieces(problem, options, progress), options, progress)


def _filtered(problem: Problem, options: IdentificationOptions, progress: SearchReport) -> Estimate:
    return kalman(problem, settings=KalmanSettings(scale_prior=options.scale_prior), progress=progress)


def _over_pieces(problem: Problem, options: IdentificationOptions, progress: SearchReport) -> Estimate:
    """Output error in pieces, which starts at the estimate of equation error."""
    length = options.piece_s or PIECE * problem.ship_time
    if length < LEAST_PIECE * problem.ship_time:
        least = LEAST_PIECE * problem.ship_time
        raise ArgumentError("piece_s", "", f"is {length:g} s", f"give {least:.3g} s or more ({LEAST_PIECE:g} L/u0)")
    settings = OutputErrorSettings(piece_s=length, scale_prior=options.scale_prior)
    return output_error(problem, _start(problem), settings, progress)


def _over_whole_runs(
    problem: Problem, in_pieces: Estimate, options: IdentificationOptions, progress: SearchReport
) -> Estimate:
    """Output error over whole runs where the estimate in pieces follows them; else that estimate."""
    if in_pieces.notices or not _follows_whole_runs(problem, in_pieces):
        return in_pieces
    settings = OutputErrorSettings(scale_prior=options.scale_prior)
    return output_error(problem, in_pieces.values, settings, progress)


def _estimate_and_choice(
    problem: Problem, trials: Measured, options: IdentificationOptions, progress: SearchReport
) -> tuple[Estimate, MethodChoice | None]:
    """The estimate, and the choice of its method where the options leave it open."""
    if options.method != BY_RESIDUALS:
        return estimate_parameters(problem, options, progress), None
    in_pieces = _over_pieces(problem, options, progress)
    choice = _choice(problem, in_pieces, trials, options)
    if choice.method == "kalman" and not in_pieces.notices:
        filtered = _filtered(problem, options, progress)
        if np.isfinite([*filtered.cost[-1:], *filtered.values, *filtered.standard_errors]).all():
            return filtered, choice
        choice = MethodChoice("output_error", "the Kalman filter diverged on these trials")
    return _over_whole_runs(problem, in_pieces, options, progress), choice


def _choice(problem: Problem, in_pieces: Estimate, trials: Measured, options: IdentificationOptions) -> MethodChoice:
    if not at_sea(trials.trials):
        reason = (
            "no trial has a geographic position or a velocity over the ground, by which it would be known to be at sea"
        )
        return MethodChoice("output_error", reason)
    for given, words in (
        (trials.captive is not None, "captive tests are fitted together with the trials"),
        (bool(options.posterior), "the posterior is sampled from its density"),
        (options.piece_s is not None, "the length of its pieces was given"),
    ):
        if given:
            return MethodChoice("output_error", words)
    return choose_method(signal_residuals(problem, in_pieces))


def cross_validate_structures(
    card: ManoeuvringCard, trials: Measured, options: IdentificationOptions, executor: Executor | None = None
) -> dict[str, CrossValidation]:
    """Cross-validation of each structure by its yaw-rate error on held-out trials."""
    results = {}
    for name, structure in STRUCTURES.items():
        started = structure.start(card)
        problem = posed_in(card, started, trials, options)
        posed = portable(problem, started, trials.driven_by)
        results[name] = cross_validate(posed, partial(_in_pieces, options=options), yaw_rate_error, executor)
    return results


@dataclass(frozen=True, eq=False)
class _Fit:
    """The start card, parameters that the trials do not show, the fit, the current and the choice of the method."""

    started: ManoeuvringCard
    unseen: tuple[str, ...]
    fitted: FittedProblem
    current: WaterCurrent | None
    choice: MethodChoice | None


def _fitted(
    card: ManoeuvringCard,
    structure: str,
    trials: Measured,
    options: IdentificationOptions,
    progress: SearchReport = silent,
    *,
    drifts: bool,
) -> _Fit:
    """A fit in a structure, with a current of its own if the water `drifts` and the method can estimate it."""
    started = STRUCTURES[structure].start(card)
    problem = posed_in(card, started, trials, options)
    unseen = refuse_unseen(problem) if trials.captive is None else ()  # what trials do not show, the tank may
    problem = problem.without(unseen)
    current = None
    if drifts and options.method != "equation_error":
        joint, choice = _estimate_and_choice(with_current(problem), trials, options, progress)
        estimate, current = without_current(joint, started)
        started = card_in(started, current)
        problem = posed_in(card, started, trials, options).without(unseen)
    else:
        estimate, choice = _estimate_and_choice(problem, trials, options, progress)
    improved = with_range(card_with_estimate(started, estimate), problem)
    fitted = FittedProblem(problem, estimate, improved, started.model.valid_speed_mps is None)
    return _Fit(started, unseen, fitted, current, choice)


def _first_current(card: ManoeuvringCard, trials: Measured) -> WaterCurrent:
    """The current by the card's own coefficients; what they do not explain counts as random accelerations."""
    problem = current_alone(problem_from_card(card, trials.trials, trials.driven_by))
    return without_current(kalman(problem, settings=KalmanSettings(scale_prior=False)), card)[1]


def _with_samples(fitted: FittedProblem, started: ManoeuvringCard, samples: PosteriorSamples) -> FittedProblem:
    """The fit with means, covariance and samples of the posterior in place of the estimate and its covariance."""
    mean, covariance = samples.mean, samples.covariance
    estimate = replace(fitted.estimate, values=mean, covariance=covariance, samples=samples.flat)
    card = with_range(card_with_estimate(started, estimate), fitted.problem)
    return replace(fitted, estimate=estimate, card=card)


def _kept_weights(
    card: ManoeuvringCard, trials: Measured, options: IdentificationOptions, structures: Mapping[str, CrossValidation]
) -> dict[str, float]:
    """Weights of the structures, those below :data:`LEAST_WEIGHT` left out; a window of a run counts as a sample."""
    problem = posed_in(card, card, trials, options)
    samples = [max(1.0, (run.times[-1] - run.times[0]) / (PIECE * problem.ship_time)) for run in problem.runs]
    weights = predictive_weights(structures, samples)
    kept = {name: weight for name, weight in weights.items() if weight >= LEAST_WEIGHT}
    return {name: weight / sum(kept.values()) for name, weight in kept.items()}


def _average_in_words(weights: Mapping[str, float]) -> str:
    shares = ", ".join(f"{name} {100 * weights[name]:.0f} %" for name in sorted(weights, key=weights.__getitem__)[::-1])
    words = "intervals are of all, the card is that of the first"
    return f"average over structures by their predictions: {shares}; {words}"


def _in_pieces(problem: Problem, options: IdentificationOptions) -> Estimate:
    """The estimate of a fold: pieces only and fewer rounds, which is enough for a comparison of folds."""
    if not _by_output_error(options):
        return estimate_parameters(problem, options)
    length = options.piece_s or PIECE * problem.ship_time
    return output_error(
        problem, _start(problem), OutputErrorSettings(length, scale_prior=options.scale_prior, rounds=3)
    )


def _start(problem: Problem) -> Array | None:
    """Start values of output error: those of the weak form, which needs none itself; None without velocities."""
    try:
        return equation_error(problem).values
    except InputError:
        return None


def _follows_whole_runs(problem: Problem, estimate: Estimate) -> bool:
    results = replay_error(problem, estimate.values, estimate.noise, windows=False)
    limits = {name: WHOLE_RUN_MISFIT * deviation for name, deviation in estimate.noise.items()}
    return all(error <= limits[name] for result in results for name, error in result.whole.items())


def _captive_notice(card: ManoeuvringCard, captive: CaptiveRuns | None) -> Sequence[Notice]:
    if captive is None:
        return ()
    times = card.ship.length_m / captive.campaign.model.length_m
    words = f"{captive.campaign.path}: {len(captive.runs)} captive tests are fitted together with the trials"
    return (Notice(f"{words}, scaled by Froude's law to a ship {times:.4g} times as long"),)


def _current_notice(current: WaterCurrent | None) -> Sequence[Notice]:
    if current is None:
        return ()
    speed_error, direction_error = current.errors
    words = f"a current of {current.speed_mps:.2f} ± {speed_error:.2g} m/s towards "
    words += (
        f"{math.degrees(current.direction_rad):.0f} ± {math.degrees(direction_error):.2g} deg was estimated with the "
    )
    words += "coefficients: the card has it as its effect current; leave that out for still water"
    notice = Notice(words)
    return (notice,) if current.determined else (undetermined_notice(current), notice)


def undetermined_notice(current: WaterCurrent) -> Notice:
    """A caution that the trials do not determine the current."""
    return caution(
        f"the trials do not determine the current (to {current.standard_error_mps:.2g} m/s in one direction): "
        "coefficients and figures may hold a part of it; add speed through the water or a full turn, or give the card "
        "its effect current"
    )


def _choice_notice(choice: MethodChoice | None) -> Sequence[Notice]:
    if choice is None:
        return ()
    name, other = METHOD_WORDS[choice.method]
    return (Notice(f"method: {name}, because {choice.reason}; method {other} takes the other"),)


def _unseen_notice(names: Sequence[str]) -> Sequence[Notice]:
    if not names:
        return ()
    text = ", ".join(name.removeprefix("derivatives.") for name in names)
    return (Notice(f"the trials show nothing of {text}: held as the card has them"),)
