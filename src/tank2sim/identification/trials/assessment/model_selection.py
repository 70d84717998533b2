"""Model selection by information criteria, and by the prediction of manoeuvres held out of the fit.

Among models that predict alike the simplest is taken: the rule of one standard error (Breiman et al. 1984,
Classification and Regression Trees, 3.4.3; Hastie, Tibshirani and Friedman 2009, 7.10).

Choices by the trials: the card's own terms of the hull or cross-flow drag, output error or the Kalman filter.

Beyond the trials a polynomial may be anything; cross-flow drag is bounded by the physics of separated flow. Where the
trials hardly distinguish the two, the turns with hard rudder may still differ, and the choice says so.

Output error takes the model's motion as exact: its residuals are noise of the sensors. Gusts and waves push the ship
off that motion, and leave residuals far above the noise that hang together over many samples; output error would take
them for coefficients, and the filter-error method is the right one (Maine and Iliff 1981, SIAM J. Appl. Math. 41; Klein
and Morelli 2006, Aircraft System Identification, chapter 6; Jategaonkar 2015, Flight Vehicle System Identification,
chapter 5). Errors of the model leave such residuals as well. The place of the trials distinguishes the two: a basin has
no weather.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from tank2sim.arrays import Array
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.dynamics import build
from tank2sim.dynamics.effects import undisturbed_inputs
from tank2sim.errors import InputError
from tank2sim.identification.trials.assessment.evaluation import pooled, replay_error
from tank2sim.identification.trials.assessment.identifiability import refuse_unseen
from tank2sim.identification.trials.methods.equation_error import equation_error
from tank2sim.identification.trials.methods.weak_form import WeakForm, sensor_noise
from tank2sim.identification.trials.options import IdentificationOptions
from tank2sim.identification.trials.problem.estimation_problem import Estimate, Problem, scaled_prior
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.identification.trials.problem.problem_from_card import (
    card_with_estimate,
    problem_from_card,
    with_captive,
    with_correlations,
)
from tank2sim.identification.trials.problem.sampled_runs import SampledRun
from tank2sim.identification.trials.problem.structures import STRUCTURES
from tank2sim.notices import Notice, caution
from tank2sim.records.signals.columns import SignalName
from tank2sim.records.trials import RUDDERS
from tank2sim.simulation.manoeuvres import Turn
from tank2sim.simulation.motion_record import OBSERVED_SIGNALS
from tank2sim.simulation.run import simulate

FARTHEST = 4
"""One run in this many, of the largest amplitudes, is held out to test extrapolation (project choice)."""

RESAMPLINGS = 1000
"""Random weights of folds over which predictive weights are averaged (project choice: 0.01 of a weight)."""

TrialEstimator = Callable[[Problem], Estimate]
Score = Callable[[Problem, Estimate], float]
"""``score(problem of the held-out runs, estimate) -> error``, the smaller the better."""


@dataclass(frozen=True)
class Criteria:
    """Information criteria, the smaller the better; to compare models of the same runs."""

    # `aic`, `bic`: Akaike (1974) and Schwarz (1978): -2 log likelihood + 2 k, + k log n
    aic: float
    bic: float
    samples: float  # n, number of independent residuals with the same information as these coloured ones
    # k, effective number that the trials determine: a parameter held by the prior counts less than one
    parameters: float


def criteria(problem: Problem, estimate: Estimate, samples: float | None = None) -> Criteria:
    """Information criteria from the weak form's residuals, which are comparable between models of the same runs.

    `problem`: Prior and runs. `estimate`: By any method. `samples`: n, by default from the residuals of this model;
    give every model the n of the first, or differences in n exceed those in fit.
    """
    form = WeakForm(problem)
    residuals = form.at(estimate.values).residuals
    series = [residuals[piece] for piece in form.pieces]
    prior = scaled_prior(problem, estimate.prior_scale)
    scaled = estimate.information * np.outer(prior, prior)
    kept = np.trace(np.linalg.solve(scaled + problem.known, problem.known))
    return criteria_of(series, float(len(prior) - kept), samples)


def criteria_of(series: Sequence[Array], parameters: float, samples: float | None = None) -> Criteria:
    """Information criteria of Gaussian residuals: `series` of pieces (n, m) without gaps, covariance unknown.

    -2 log likelihood is n log det of the residuals' covariance; n is `samples`, by default :func:`effective_samples`.
    """
    every = np.concatenate(series)
    n = effective_samples(series) if samples is None else samples
    deviance = n * float(np.linalg.slogdet(every.T @ every / len(every))[1])
    return Criteria(deviance + 2 * parameters, deviance + parameters * math.log(n), n, parameters)


def effective_samples(series: Sequence[Array]) -> float:
    """Number of independent residuals with the same information: N / (1 + 2 sum of autocorrelations).

    The sum ends at the first that is not positive (Geyer 1992, Statistical Science 7). `series` are pieces (n, m); the
    m components are taken together, each in units of its own deviation.
    """
    from scipy.signal import correlate  # slow to import

    every = np.concatenate(series)
    size = np.sqrt(np.mean(every**2, axis=0))
    sums = np.zeros(max(map(len, series)))
    for piece in series:
        for column in (piece / np.where(size > 0, size, 1.0)).T:
            sums[: len(piece)] += correlate(column, column, method="fft")[len(piece) - 1 :]  # by lag, from 0
    correlations = sums[1:] / sums[0]
    positive = np.cumprod(correlations > 0, dtype=bool)
    return float(max(1.0, len(every) / (1 + 2 * correlations[positive].sum())))


@dataclass(frozen=True)
class HeldOutFold:
    """A fit without some of the runs, and its error on them."""

    held_out: tuple[str, ...]  # Names of the runs
    error: float  # Error on them, by the score; inf where the fit or the prediction failed
    values: Array  # (k,): Estimates without them, empty where the fit failed


@dataclass(frozen=True)
class CrossValidation:
    """Prediction of manoeuvres held out of the fit."""

    single: tuple[HeldOutFold, ...]  # Each run held out once, in the order of the runs
    extrapolation: HeldOutFold  # The runs of largest amplitude held out together

    @property
    def errors(self) -> Array:
        """Errors of all folds (runs + 1,), extrapolation last."""
        return np.array([*(fold.error for fold in self.single), self.extrapolation.error])


def cross_validate(
    problem: Problem, estimator: TrialEstimator, score: Score, executor: Executor | None = None
) -> CrossValidation:
    """Hold out one run at a time, and then the runs of largest amplitude together.

    `estimator`: ``estimator(problem) -> Estimate``, a function of a module, or a partial of one, for an executor of
    processes, and so is `score`: ``score(problem, estimate) -> float``, where the problem has the
    held-out runs. `executor`: By default the folds run in sequence in this process. Raises InputError: The problem has
    fewer than two runs.
    """
    runs = problem.runs
    if len(runs) < 2:
        raise InputError(runs[0].origin, "", "is the only run", "cross-validation needs two runs at least")
    groups = [*((place,) for place in range(len(runs))), farthest(runs)]
    tasks = [(problem, group, estimator, score) for group in groups]
    *single, last = (map if executor is None else executor.map)(_fold, tasks)
    return CrossValidation(tuple(single), last)


def farthest(runs: Sequence[SampledRun]) -> tuple[int, ...]:
    """Indices of the runs of largest amplitude, one in :data:`FARTHEST` and one at least.

    Amplitude: the 95th percentile of the absolute yaw rate, or of the heading's slope where it was not measured.
    """
    amplitudes = []
    for run in runs:
        rate = run.column("motion.r")
        if np.isnan(rate).all():
            rate = np.gradient(run.column("motion.psi"), run.step_s)
        amplitudes.append(0.0 if np.isnan(rate).all() else float(np.nanpercentile(np.abs(rate), 95)))
    count = max(1, len(runs) // FARTHEST)
    return tuple(sorted(np.argsort(amplitudes, kind="stable")[::-1][:count].tolist()))


def simplest(candidates: Mapping[str, CrossValidation]) -> str:
    """Name of the simplest model whose errors are not significantly larger than the best model's.

    `candidates`: Name to cross-validation over the same runs, from the simplest model to the one with most parameters.

    The best model has the least mean error over all folds. A simpler model is as good if the mean of its paired
    differences from the best is within one standard error of that mean; pairs cancel the difficulty of each fold.
    """
    if not candidates:
        raise ValueError("the mapping has no candidates")
    errors = {name: candidate.errors for name, candidate in candidates.items()}
    best = min(errors, key=lambda name: float(np.mean(errors[name])))

    def as_good(name: str) -> bool:
        difference = errors[name] - errors[best]
        if name == best or not np.isfinite(difference).all():
            return name == best
        return bool(difference.mean() <= difference.std(ddof=1) / math.sqrt(len(difference)))

    return next(name for name in errors if as_good(name))


def predictive_weights(candidates: Mapping[str, CrossValidation], samples: Sequence[float]) -> dict[str, float]:
    """Weight of each model by its predictions of the runs held out one at a time; they add up to 1.

    The predictive log density of fold f is -n_f log(error), up to a constant: the density of n_f Gaussian residuals
    whose variance is what it turns out to be. With few folds a sum over them claims too much, so that the weights
    (Akaike's) are averaged over random weights of the folds, the Bayesian bootstrap: pseudo-BMA+ of Yao, Vehtari,
    Simpson and Gelman (2018), Bayesian Analysis 13, (7) to (10).

    `candidates`: Name to cross-validation over the same runs. `samples`: n_f, number of independent residuals in each
    run.
    """
    names = list(candidates)
    errors = np.array([[fold.error for fold in candidates[name].single] for name in names])
    density = -np.asarray(samples) * np.log(np.where(np.isfinite(errors), errors, 1e6))
    folds = np.random.default_rng(0).dirichlet(np.ones(len(samples)), RESAMPLINGS) * len(samples)
    scores = folds @ density.T
    weights = np.exp(scores - scores.max(axis=1, keepdims=True))
    weights /= weights.sum(axis=1, keepdims=True)
    return dict(zip(names, weights.mean(axis=0).tolist(), strict=True))


def yaw_rate_error(problem: Problem, estimate: Estimate) -> float:
    """A score: error of the yaw rate over free-running windows, as a share of it (:mod:`.evaluation`)."""
    spreads = np.nanstd(np.concatenate([run.measured for run in problem.runs]), axis=0)
    weights = {name: float(spread) or 1.0 for name, spread in zip(problem.seen, spreads, strict=True)}
    return pooled(replay_error(problem, estimate.values, weights, whole=False), "motion.r")


def _fold(task: tuple[Problem, tuple[int, ...], TrialEstimator, Score]) -> HeldOutFold:
    problem, group, estimator, score = task
    held_out = tuple(run for place, run in enumerate(problem.runs) if place in group)
    fitted = tuple(run for place, run in enumerate(problem.runs) if place not in group)
    names = tuple(run.name for run in held_out)
    try:
        estimate = estimator(problem.with_runs(fitted))
        error = float(score(problem.with_runs(held_out), estimate))
    except (InputError, np.linalg.LinAlgError):
        return HeldOutFold(names, math.inf, np.empty(0))
    return HeldOutFold(names, error if math.isfinite(error) else math.inf, estimate.values)


STRONGLY = 1.0
"""Difference of the Bayesian information criterion for each independent sample by which the card's own terms must be
better: residuals that are smaller by a factor e in generalised variance. On measured trials model error, which the
criterion takes for noise, shifts it by up to 0.2; on trials of a ship that has the card's terms it is 59 (project
choice: between the two)."""

HARD_RUDDER = math.radians(35.0)
"""Rudder of the turns that two structures are compared by: as in the turning test of IMO resolution MSC.137(76)."""

NEARLY_HARD = 0.9
"""Share of that rudder from which a trial shows what a hard turn does (project choice)."""

DIFFERENT_TURN = 0.1
"""Share by which the tactical diameters of two structures may differ (project choice: twice what is asked of a
prediction)."""


def structure_by_evidence(
    card: ManoeuvringCard, trials: Measured, options: IdentificationOptions, holdout: Measured | None = None
) -> tuple[str, tuple[Notice, ...]]:
    """Name of the structure, and a notice: cross-flow drag, or the card's own terms if the trials prefer them strongly.

    Both are fitted by equation error. Terms of the card are preferred if their Bayesian information criterion is less
    by more than :data:`STRONGLY` for each independent sample. Where that hardly distinguishes the two, each is fitted
    without one trial at a time, and the card's terms are taken if they predict the trials left out better, by more than
    one standard error of the difference (:func:`.simplest`). Else cross-flow drag is the better guess beyond the
    trials: it is bounded by the physics of separated flow where a polynomial is not. If the hard turns of the two
    differ, and none was held out to judge by, a notice is marked.
    """
    if card.model.kind != "abkowitz":
        return "card", ()
    try:
        of_card, given, problem = _by_equation_error("card", card, trials, options)
        drag, with_drag, problem_of_drag = _by_equation_error("cross_flow", card, trials, options, of_card.samples)
    except (InputError, np.linalg.LinAlgError):  # no velocities to compare by, or a card that cannot have the structure
        return "card", ()
    difference = (of_card.bic - drag.bic) / of_card.samples
    if difference < -STRONGLY:
        return "card", ()
    undecided = abs(difference) < STRONGLY
    taken = "card" if undecided and _predicts_better(problem, problem_of_drag) else "cross_flow"
    by = f"(BIC {difference:+.2g} for each independent sample, strong below -{STRONGLY:g})"
    chosen = (
        "structure: the card's own third-order terms, which predict trials that were left out better than cross-flow "
        f"drag {by}; structure cross_flow takes that"
        if taken == "card"
        else "structure: cross-flow drag in place of the card's own third-order terms, which the trials do not prefer "
        f"strongly {by}; structure card keeps them"
    )
    in_doubt = undecided and _hardest_rudder(holdout) < NEARLY_HARD * HARD_RUDDER
    return taken, (Notice(chosen), *(_turns_in_doubt(given, with_drag, taken) if in_doubt else ()))


def _by_equation_error(
    name: str, card: ManoeuvringCard, trials: Measured, options: IdentificationOptions, samples: float | None = None
) -> tuple[Criteria, ManoeuvringCard, Problem]:
    """Criteria, card and problem of a structure that is fitted by equation error."""
    started = STRUCTURES[name].start(card)
    posed = posed_in(card, started, trials, options)
    posed = posed.without(refuse_unseen(posed))
    estimate = equation_error(posed)
    return criteria(posed, estimate, samples), card_with_estimate(started, estimate), posed


def _hardest_rudder(trials: Measured | None) -> float:
    """Largest angle or order of the rudder in trials, rad; 0 without any."""
    others = trials.trials if trials else ()
    rudders = [trial.signals[name] for trial in others for name in RUDDERS if name in trial.signals]
    return max((float(np.nanmax(np.abs(angles))) for angles in rudders), default=0.0)


def _predicts_better(of_card: Problem, drag: Problem) -> bool:
    """Whether the card's own terms predict trials that were left out of the fit better than cross-flow drag does."""
    if len(of_card.runs) < 2:
        return False
    problems = {"cross_flow": drag, "card": of_card}
    with ThreadPoolExecutor(os.cpu_count()) as threads:  # most of the work is machine code: threads run in parallel
        found = {
            name: cross_validate(posed, equation_error, yaw_rate_error, threads) for name, posed in problems.items()
        }
    return simplest(found) == "card"


def _turns_in_doubt(of_card: ManoeuvringCard, drag: ManoeuvringCard, taken: str) -> Sequence[Notice]:
    """A caution if the turns of two structures that the trials do not distinguish are different ones."""
    rudder = hard_rudder(drag)
    sizes = [_tactical_diameter(each, rudder) for each in (of_card, drag)]
    if not any(np.isfinite(sizes)) or abs(sizes[0] / sizes[1] - 1) < DIFFERENT_TURN:
        return ()
    texts = [f"{size:.2f} L" if np.isfinite(size) else "none" for size in sizes]
    mine, other = (", taken", "") if taken == "card" else ("", ", taken")
    return (
        caution(
            "the trials hardly distinguish two structures of the hull, whose tactical diameters with "
            f"{math.degrees(rudder):.0f} deg of rudder are {texts[1]} (cross-flow drag{other}) and {texts[0]} (the "
            f"card's own terms{mine}): fit or hold out a turn with as much rudder"
        ),
    )


def hard_rudder(card: ManoeuvringCard) -> float:
    """:data:`HARD_RUDDER`, or the largest angle of the card's gear if that is less, rad."""
    gear = card.steering_gear
    return min(HARD_RUDDER, gear.max_angle_rad if gear is not None and gear.max_angle_rad else HARD_RUDDER)


def _tactical_diameter(card: ManoeuvringCard, rudder: float) -> float:
    """In lengths, in still water; nan if the ship does not turn round."""
    model = build(card)
    try:
        run = simulate(model, Turn(rudder), inputs=undisturbed_inputs(model))
    except InputError:  # a polynomial that drives itself out of all bounds
        return math.nan
    size = run.figures["tactical_diameter_lengths"]
    return float(size) if isinstance(size, float) else math.nan


def posed_in(
    card: ManoeuvringCard, started: ManoeuvringCard, trials: Measured, options: IdentificationOptions
) -> Problem:
    """The problem of a card that was started in a structure, with the correlations of the card's own coefficients."""
    problem = problem_from_card(started, trials.trials, trials.driven_by, inertia=options.inertia, hold=options.hold)
    return with_captive(with_correlations(problem, card), started, trials.captive)


ABOVE_NOISE = 2.0
"""Residuals of whole runs of this many times the sensor's white noise are not that noise (project choice: on made-up
voyages those of the heading are 1.1 times without wind or drift of the sensors, 1.9 times with their drift, 2.3 to 8
times in wind; the filter nests output error, so that it is the smaller mistake)."""

MANY_SAMPLES = 3.0
"""Samples over which residuals of pieces hang together, if they are not white (project choice)."""

_SIGNALS = {variable: signal for signal, variable in OBSERVED_SIGNALS.items()}


@dataclass(frozen=True)
class MethodChoice:
    """A chosen method: ``output_error`` or ``kalman``, and why, in a sentence."""

    method: str
    reason: str


@dataclass(frozen=True)
class SignalResidual:
    """Residuals of output error in one signal."""

    name: str  # Variable of the model
    above_noise: float  # Root mean square over whole runs, over the standard deviation of the sensor's white noise
    # Samples after which the autocorrelation in pieces of the runs has fallen to 1/e; 0 for white residuals
    samples: float

    @property
    def of_process(self) -> bool:
        """Whether they are above the sensor's noise and hang together."""
        return self.above_noise > ABOVE_NOISE and self.samples > MANY_SAMPLES


def signal_residuals(problem: Problem, estimate: Estimate) -> tuple[SignalResidual, ...]:
    """Residuals of output error in each seen signal, of runs simulated from their first state.

    `estimate`: By output error, with its `motion`.
    """
    assert estimate.motion is not None
    white = np.sqrt(np.mean([sensor_noise(problem, run) ** 2 for run in problem.runs], axis=0))
    runs = replay_error(problem, estimate.values, estimate.noise)
    found = []
    for name, sensor, noise in zip(problem.seen, white, estimate.motion.noise, strict=True):
        errors = [run.whole[name] for run in runs if name in run.whole]
        error = float(np.sqrt(np.mean(np.square(errors)))) if errors else 0.0
        above = error / sensor if sensor > 0 else (np.inf if error else 0.0)
        found.append(SignalResidual(name, float(above), noise.correlated_samples))
    return tuple(found)


def choose_method(residuals: Sequence[SignalResidual]) -> MethodChoice:
    """The Kalman filter where residuals of output error at sea are of the process, else output error.

    Examples
    --------
    >>> choose_method([SignalResidual("motion.r", 1.1, 40.0), SignalResidual("motion.psi", 6.0, 40.0)]).method
    'kalman'
    >>> choose_method([SignalResidual("motion.psi", 6.0, 0.0)]).method
    'output_error'
    """
    process = [residual for residual in residuals if residual.of_process]
    if not process:
        return MethodChoice("output_error", "its residuals are the noise of the sensors")
    worst = max(process, key=lambda residual: residual.above_noise)
    size, name = f"{worst.above_noise:.2g}", SignalName(_SIGNALS[worst.name]).words
    return MethodChoice(
        "kalman",
        f"what output error leaves in the {name} is {size} times the sensor's noise and hangs together over "
        f"{worst.samples:.0f} samples, as gusts and waves leave it",
    )
