"""Identification of a better card from a card and trials, with the identifiability of its parameters."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from threadpoolctl import threadpool_limits

from tank2sim.arrays import Array
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.cards.examination import doubts
from tank2sim.dynamics import build
from tank2sim.errors import ArgumentError, InputError
from tank2sim.identification.trials.assessment.evaluation import (
    Comparison,
    compare_card,
    noise_of,
    or_none,
    replay_error,
)
from tank2sim.identification.trials.assessment.identifiability import (
    IdentifiabilityStudy,
    identifiability,
    refuse_unseen,
)
from tank2sim.identification.trials.assessment.model_selection import (
    Criteria,
    CrossValidation,
    MethodChoice,
    choose_method,
    criteria,
    cross_validate,
    posed_in,
    predictive_weights,
    signal_residuals,
    simplest,
    structure_by_evidence,
    yaw_rate_error,
)
from tank2sim.identification.trials.assessment.other_ship import far_from_card, not_of_ship, other_ship
from tank2sim.identification.trials.assessment.prediction_intervals import Fit, bootstrap, compare_held_out, generators
from tank2sim.identification.trials.methods.equation_error import equation_error
from tank2sim.identification.trials.methods.kalman import KalmanSettings, kalman
from tank2sim.identification.trials.methods.output_error import OutputErrorSettings, output_error
from tank2sim.identification.trials.methods.posterior_sampling import PosteriorSamples, check_sampler, sample_posterior
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
from tank2sim.identification.trials.problem.prepare_trials import Measured, coarse_rows
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

METHOD_WORDS = {"kalman": ("the Kalman filter", "output_error"), "output_error": ("output error", "kalman")}
"""Method that a choice takes, to its name in words and the other method."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Identification(Fit):
    """Result of an identification."""

    identifiability: IdentifiabilityStudy
    # Standard deviation of measurement noise by variable, stated in the files or estimated: the unit of misfit
    noise: Mapping[str, float]
    # Comparison of the new card with the fitted trials, and with the held-out trials (None without any)
    fit: Comparison
    holdout: Comparison | None
    # The same for the given card
    before: Comparison
    before_holdout: Comparison | None
    structure: str  # Structure of the model, as requested or chosen
    # Cross-validation of each structure; empty unless it is :data:`.options.AUTO` or :data:`.options.AVERAGE`
    structures: Mapping[str, CrossValidation]
    # Weight of each structure in the intervals of held-out trials; empty unless it is :data:`.options.AVERAGE`
    weights: Mapping[str, float]
    # For comparison with another model of the same trials; None where the velocities were not measured
    criteria: Criteria | None
    posterior: PosteriorSamples | None  # On request; values and covariance of the estimate then come from it
    bootstrap: Array | None  # (members, k): Estimates from trials simulated with the estimate, on request
    manoeuvres: Mapping[str, str]  # Trial to a description of the recognised manoeuvre
    forced: tuple[str, ...]  # Evidence that the trials are not of the card's ship, where the fit was forced
    notices: tuple[Notice, ...]

    @property
    def comparisons(self) -> tuple[tuple[str, Comparison, Comparison], ...]:
        """The given and the new card on the trials "fitted" and, if there are any, on those "held out"."""
        fitted = "fitted", self.before, self.fit
        if self.holdout is None or self.before_holdout is None:
            return (fitted,)
        return fitted, ("held out", self.before_holdout, self.holdout)


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
    held = holdout if holdout is not None and holdout.trials else None
    try:
        # Small matrices: threads of the linear algebra library wait for each other, and runs have their own threads.
        with threadpool_limits(limits=1, user_api="blas"):
            return _identified(card, _Asked(trials, options, progress), held, executor)
    except np.linalg.LinAlgError:
        names = ", ".join(trial.name for trial in trials.trials)
        remedy = "add runs in which rudder, yaw, sway and speed change, or hold terms"
        raise InputError(names, "", "excites too little to estimate anything", remedy) from None


@dataclass(frozen=True, eq=False)
class _Asked:
    """The problem that is fitted, and the options."""

    trials: Measured
    options: IdentificationOptions
    progress: SearchReport = silent
    drifts: bool = False  # Whether the trials are in a current that is not known


def _identified(
    card: ManoeuvringCard, asked: _Asked, held: Measured | None, executor: Executor | None
) -> Identification:
    trials, options = asked.trials, asked.options
    _refuse_options(card, trials, options)
    given, card = card, polynomial_over_trials(card, trials.trials)
    asked = replace(asked, drifts=of_unknown_current(card, trials.trials))
    if asked.drifts:
        card = _in_first_current(card, trials)
    structure, structures, weights, chosen = _choose_structure(card, asked, held, executor)
    fit, evidence = _fitted_to_own_trials(card, structure, asked)
    card = card if fit.current is None else card_in(card, fit.current)
    fit, samples = _with_samples(fit, options)
    silently = replace(asked, progress=silent)
    average = [
        (fit if name == structure else _fitted(card, name, silently), weight) for name, weight in weights.items()
    ]
    every = [*trials.trials, *(held.trials if held else ())]
    return Identification(
        **vars(fit),
        identifiability=identifiability(fit.problem, fit.estimate),
        noise=noise_of(trials, fit.problem),
        fit=compare_card(fit.card, trials, fit.estimate.noise, whole=fit.whole),
        holdout=compare_held_out(fit, held, options.members, executor, average) if held else None,
        before=compare_card(card, trials, fit.estimate.noise),
        before_holdout=compare_card(card, held, fit.estimate.noise) if held else None,
        structure=structure,
        structures=structures,
        weights=weights,
        criteria=or_none(criteria, fit.problem, fit.estimate),
        posterior=samples,
        bootstrap=_bootstrapped(fit, options, executor),
        forced=evidence,
        manoeuvres=_manoeuvres(fit.card, every),
        notices=(
            *dict.fromkeys((*doubts(given), *doubts(fit.card))),
            *coarse_rows(every, card),
            *trials.notices,
            *(held.notices if held else ()),
            *lowered_bound_notice(given, card),
            *_fit_notices(card, trials.captive, chosen, fit),
            *(samples.notices if samples is not None and samples.converged else ()),
            *fit.estimate.notices,
        ),
    )


def _in_first_current(card: ManoeuvringCard, trials: Measured) -> ManoeuvringCard:
    """The card in the current by its own coefficients; what these do not explain counts as random accelerations."""
    problem = current_alone(problem_from_card(card, trials.trials, trials.driven_by))
    still = kalman(problem, settings=KalmanSettings(scale_prior=False))
    return card_in(card, without_current(still, card)[1])


def _bootstrapped(fit: Fit, options: IdentificationOptions, executor: Executor | None) -> Array | None:
    """Estimates from simulated trials; None if they were not asked for, or without velocities."""
    disturbances = fit.disturbances() if options.bootstrap else None
    if disturbances is None:
        return None
    again = partial(_in_pieces, options=options)
    return bootstrap(fit.problem, fit.estimate, again, disturbances, generators(options.bootstrap), executor)


def _manoeuvres(card: ManoeuvringCard, trials: Sequence[Trial]) -> dict[str, str]:
    """Trial to its recognised manoeuvre in words."""
    recognised = ((trial.name, recorded(trial, build(card))) for trial in trials)
    return {name: manoeuvre.words for name, manoeuvre in recognised if manoeuvre is not None}


def _fitted_to_own_trials(card: ManoeuvringCard, structure: str, asked: _Asked) -> tuple[Fit, tuple[str, ...]]:
    """The fit, and the evidence that the trials are of another ship, which raises unless the fit is forced."""
    trials, force = asked.trials, asked.options.force
    evidence = other_ship(problem_from_card(card, trials.trials, trials.driven_by))  # in the structure of the card
    if not evidence or force:
        fit = _fitted(card, structure, asked)
        evidence += far_from_card(fit.problem, fit.estimate)
        if not evidence or force:
            return fit, evidence
    remedy = "give the card and the trials of one ship, in the same units and signs, or force the fit"
    raise not_of_ship(card, trials, evidence, remedy)


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


def _choose_structure(
    card: ManoeuvringCard, asked: _Asked, held: Measured | None, executor: Executor | None
) -> tuple[str, dict[str, CrossValidation], dict[str, float], tuple[Notice, ...]]:
    """Structure of the fit, cross-validation and weights of all where asked for, and notices of the choice."""
    trials, options = asked.trials, asked.options
    if options.structure == BY_EVIDENCE:
        name, notices = structure_by_evidence(card, trials, options, held)
        return name, {}, {}, notices
    if options.structure not in (AUTO, AVERAGE):
        return options.structure, {}, {}, ()
    estimator, found = partial(_in_pieces, options=options), {}
    for name, structure in STRUCTURES.items():
        problem = posed_in(card, structure.start(card), trials, options)
        found[name] = cross_validate(problem, estimator, yaw_rate_error, executor)
    if options.structure == AUTO:
        return simplest(found), found, {}, ()
    problem = posed_in(card, card, trials, options)
    # A window of a run counts as a sample.
    samples = [max(1.0, (run.times[-1] - run.times[0]) / (PIECE * problem.ship_time)) for run in problem.runs]
    kept = {name: each for name, each in predictive_weights(found, samples).items() if each >= LEAST_WEIGHT}
    weights = {name: weight / sum(kept.values()) for name, weight in kept.items()}
    falling = sorted(weights, key=weights.__getitem__)[::-1]
    shares = ", ".join(f"{name} {100 * weights[name]:.0f} %" for name in falling)
    words = "intervals cover all methods, the card is from the first"
    notice = Notice(f"average over structures by their predictions: {shares}; {words}")
    return max(weights, key=weights.__getitem__), found, weights, (notice,)


def _by_output_error(options: IdentificationOptions) -> bool:
    return options.method in (BY_RESIDUALS, "output_error")


def estimate_parameters(
    problem: Problem, options: IdentificationOptions, progress: SearchReport = silent, trials: Measured | None = None
) -> tuple[Estimate, MethodChoice | None]:
    """The estimate, and the choice of its method where `options` leave it open and `trials` show which is right."""
    choice = None
    if options.method == "equation_error":
        return equation_error(problem, progress=progress), None
    filtering = KalmanSettings(scale_prior=options.scale_prior)
    if options.method == "kalman":
        return kalman(problem, settings=filtering, progress=progress), None
    settings = _pieces(problem, options)
    found = output_error(problem, _start(problem), settings, progress)
    if options.method == BY_RESIDUALS and trials is not None:
        choice = _choose_method(problem, found, options, trials)
        if choice.method == "kalman" and not found.notices:
            filtered = kalman(problem, settings=filtering, progress=progress)
            if np.isfinite([*filtered.cost[-1:], *filtered.values, *filtered.standard_errors]).all():
                return filtered, choice
            choice = MethodChoice("output_error", "the Kalman filter diverged on these trials")
    if not found.notices and _follows_whole_runs(problem, found):
        found = output_error(problem, found.values, OutputErrorSettings(scale_prior=options.scale_prior), progress)
    return found, choice


def _pieces(problem: Problem, options: IdentificationOptions) -> OutputErrorSettings:
    """Settings of output error in pieces."""
    length, least = options.piece_s or PIECE * problem.ship_time, LEAST_PIECE * problem.ship_time
    if length < least:
        raise ArgumentError("piece_s", "", f"is {length:g} s", f"give {least:.3g} s or more ({LEAST_PIECE:g} L/u0)")
    return OutputErrorSettings(piece_s=length, scale_prior=options.scale_prior)


def _choose_method(
    problem: Problem, in_pieces: Estimate, options: IdentificationOptions, trials: Measured
) -> MethodChoice:
    basin = "no trial has a geographic position or a velocity over the ground, by which it would be known to be at sea"
    for given, words in (
        (not at_sea(trials.trials), basin),
        (trials.captive is not None, "captive tests are fitted together with the trials"),
        (bool(options.posterior), "the posterior is sampled from its density"),
        (options.piece_s is not None, "the length of its pieces was given"),
    ):
        if given:
            return MethodChoice("output_error", words)
    return choose_method(signal_residuals(problem, in_pieces))


def _fitted(card: ManoeuvringCard, structure: str, asked: _Asked) -> Fit:
    """A fit in a structure, with a current of its own if the water drifts and the method can estimate it."""
    trials, options = asked.trials, asked.options
    started = STRUCTURES[structure].start(card)
    problem = posed_in(card, started, trials, options)
    unseen = refuse_unseen(problem) if trials.captive is None else ()  # what trials do not show, the tank may
    problem, current = problem.without(unseen), None
    if asked.drifts and options.method != "equation_error":
        joint, choice = estimate_parameters(with_current(problem), options, asked.progress, trials)
        estimate, current = without_current(joint, started)
        started = card_in(started, current)
        problem = posed_in(card, started, trials, options).without(unseen)
    else:
        estimate, choice = estimate_parameters(problem, options, asked.progress, trials)
    improved = with_range(card_with_estimate(started, estimate), problem)
    return Fit(started, unseen, problem, estimate, improved, current, choice)


def _with_samples(fit: Fit, options: IdentificationOptions) -> tuple[Fit, PosteriorSamples | None]:
    """The fit with the posterior, if asked for, in place of the estimate and its covariance; and its samples."""
    if not options.posterior:
        return fit, None
    samples = sample_posterior(fit.problem, fit.estimate, options.posterior, options.draws)
    estimate = replace(fit.estimate, values=samples.mean, covariance=samples.covariance, samples=samples.flat)
    card = with_range(card_with_estimate(fit.started, estimate), fit.problem)
    return replace(fit, estimate=estimate, card=card), samples


def _in_pieces(problem: Problem, options: IdentificationOptions) -> Estimate:
    """The estimate of a fold: pieces only and fewer rounds, which is enough for a comparison of folds."""
    if not _by_output_error(options):
        return estimate_parameters(problem, options)[0]
    return output_error(problem, _start(problem), replace(_pieces(problem, options), rounds=3))


def _start(problem: Problem) -> Array | None:
    """Start values of output error, from the weak form, which needs none itself; None without velocities."""
    found = or_none(equation_error, problem)
    return None if found is None else found.values


def _follows_whole_runs(problem: Problem, estimate: Estimate) -> bool:
    results = replay_error(problem, estimate.values, estimate.noise, windows=False)
    limits = {name: WHOLE_RUN_MISFIT * deviation for name, deviation in estimate.noise.items()}
    return all(error <= limits[name] for result in results for name, error in result.whole.items())


def _fit_notices(
    card: ManoeuvringCard, captive: CaptiveRuns | None, chosen: Sequence[Notice], fit: Fit
) -> Iterator[Notice]:
    """Notices of the prior, the captive tests, the structure, the current and the method."""
    if not card.uncertainty:
        words = "the card states no uncertainty: 2 % of each derivative is taken, and widened as the trials demand"
        yield Notice(words)
    if captive is not None:
        times = card.ship.length_m / captive.campaign.model.length_m
        words = f"{captive.campaign.path}: {len(captive.runs)} captive tests are fitted together with the trials"
        yield Notice(f"{words}, scaled by Froude's law to a ship {times:.4g} times as long")
    yield from chosen
    if fit.unseen:
        text = ", ".join(name.removeprefix("derivatives.") for name in fit.unseen)
        yield Notice(f"the trials show nothing of {text}: held as the card has them")
    if fit.current is not None:
        speed_error, direction_error = fit.current.errors
        if not fit.current.determined:
            yield undetermined_notice(fit.current)
        yield Notice(
            f"a current of {fit.current.speed_mps:.2f} ± {speed_error:.2g} m/s towards "
            f"{math.degrees(fit.current.direction_rad):.0f} ± {math.degrees(direction_error):.2g} deg was estimated "
            "with the coefficients: the card has it as its effect current; leave that out for still water"
        )
    if fit.choice is not None:
        name, other = METHOD_WORDS[fit.choice.method]
        yield Notice(f"method: {name}, because {fit.choice.reason}; method {other} takes the other")


def undetermined_notice(current: WaterCurrent) -> Notice:
    """A caution that the trials do not determine the current."""
    return caution(
        f"the trials do not determine the current (to {current.standard_error_mps:.2g} m/s in one direction): "
        "coefficients and figures may hold a part of it; add speed through the water or a full turn, or give the card "
        "its effect current"
    )
