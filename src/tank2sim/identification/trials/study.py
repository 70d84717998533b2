"""Study of an identification from trials with what is remarkable of it, and the text of the card found."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TypeVar

import numpy as np

from tank2sim.arrays import Array, Columns, Number, Unbounded
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.cards.reading import changed_text
from tank2sim.dynamics import build
from tank2sim.errors import InputError
from tank2sim.escaping import one_line
from tank2sim.files import BYTE_ORDER_MARK
from tank2sim.identification.trials.assessment.evaluation import (
    Comparison,
    Following,
    Passage,
    comparison_windows,
    misfit,
    pooled,
)
from tank2sim.identification.trials.assessment.identifiability import IdentifiabilityStudy, share_from_trials
from tank2sim.identification.trials.assessment.model_selection import hard_rudder
from tank2sim.identification.trials.identify import Identification
from tank2sim.identification.trials.methods.posterior_sampling import PosteriorSamples
from tank2sim.identification.trials.problem.estimation_problem import scaled_prior
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.identification.trials.problem.problem_from_card import problem_from_card
from tank2sim.identification.trials.problem.water_current import WaterCurrent, card_in
from tank2sim.notices import Level, Notice, caution
from tank2sim.records.signals.columns import SignalName
from tank2sim.records.thinning import drawn_columns
from tank2sim.simulation.manoeuvres import Turn
from tank2sim.simulation.motion_record import OBSERVED_SIGNALS
from tank2sim.simulation.run import simulate
from tank2sim.units import from_si

STOPPED = 0.15
"""Share of its speed below which a ship in a turn has stopped: full hulls keep a third (project choice)."""

WORSE = 1.05
"""An error that grew by less than this factor counts as unchanged (project choice)."""

LACKING = 3.0
"""Factor on the card's standard errors from which a missing effect is the likelier reason (project choice: three
standard errors are rare by chance)."""


def remarks(result: Identification) -> Iterator[Notice]:
    """Notices on the result: manoeuvres, the structure, errors that grew, and the limits of the card."""
    if result.manoeuvres:
        text = "; ".join(f"{name}: {words}" for name, words in result.manoeuvres.items())
        yield Notice(f"recognised, to starboard positive: {text}")
    if result.structures:
        words = "the simplest of those within one standard error of the best"
        yield Notice(f"cross-validation chose the structure {result.structure}: {words}")
    elif result.structure == "card" and result.card.model.kind != "mmg":  # which has one structure
        words = "structure auto cross-validates them, cross_flow extrapolates to turns"
        yield Notice(f"other structures were not tried: {words}")
    yield from _widened(result)
    for words, before, after in result.comparisons:
        old, new = pooled(before.following, "motion.r"), pooled(after.following, "motion.r")
        if new > WORSE * old:
            errors = f"yaw-rate error {100 * old:.3g} % before, {100 * new:.3g} %"
            yield caution(f"WORSE than the card before on the trials {words}: {errors}")
    if result.holdout and (missed := [f"{each.trial} {each.name}" for each in result.holdout.figures if each.missed]):
        yield Notice(f"measured outside the 95 % interval: {', '.join(missed)}")
    yield from _stops(result.card)


def _widened(result: Identification) -> Iterator[Notice]:
    scale = result.estimate.prior_scale
    wide = [f"{group} {factor:.3g} times" for group, factor in sorted(scale.items()) if factor > 1.05]
    if not wide:
        return
    far = max(scale.values()) > LACKING
    doubtful = far and result.started.uncertainty  # assumed errors may be too small
    text = f"the card's standard errors were widened as the trials demand: {', '.join(wide)}; trust_card keeps them"
    yield Notice(text, Level.CAUTION if doubtful else Level.INFO)
    if far:
        yield Notice(
            "coefficients so far from the card may be due to an effect that it lacks: tank2sim gap, with these "
            "trials and the given card, finds which"
        )


def _stops(card: ManoeuvringCard) -> Iterator[Notice]:
    """Trials seldom hold a full turn: simulate a turn to each side with the card."""
    largest, near = hard_rudder(card), "it holds only near the trials"
    for side, word in ((1, "starboard"), (-1, "port")):
        words = caution(f"in a {math.degrees(largest):.0f} deg turn to {word} the model found")
        try:
            speed = simulate(build(card), Turn(side * largest)).trajectory["motion.speed"]
        except InputError:
            yield Notice(f"{words} leaves all bounds: {near}")
            continue
        if speed[-1] < STOPPED * speed[0]:
            yield Notice(f"{words} loses {100 * (1 - speed[-1] / speed[0]):.0f} % of its speed: {near}")


_Compared = TypeVar("_Compared")

SET_KEYS = {"fitted": "fit", "held out": "holdout"}
"""Words for a set of trials to its key in the JSON."""

POSTERIOR_LEVELS = (0.025, 0.25, 0.5, 0.75, 0.975)
"""Levels of the quantiles of a posterior: its median, and the intervals that hold half and 95 % of it."""

FIGURES_ARE = "simulated in closed loop with the card found, from each trial's measured start, rudder rate and lag"
"""Origin of the figures: ``simulate`` uses the card's approach speed and steering gear instead."""

_OBSERVED = {variable: SignalName(signal).file for signal, variable in OBSERVED_SIGNALS.items()}
"""Variable of a model to the column of a trial file that measures it."""

_COLUMNS = {
    "rudder": "delta_deg",
    "motion.psi": "psi_deg",
    "motion.r": "r_degps",
    "motion.speed": "speed_mps",
    "motion.beta": "beta_deg",
    "motion.x": "x_m",
    "motion.y": "y_m",
}
_SAMPLES = 240


@dataclass(frozen=True, kw_only=True)
class ParameterEstimate:
    """A parameter identified from trials: prime or SI, rudder positive to starboard.

    Parameters
    ----------
    value, standard_error : float
    before, before_standard_error : float
        Those of the card given.
    prior_standard_error : float
        As the fit took it: widened where the trials demanded it.
    share_from_trials : float
        Share of the information from the trials: 1 - (variance after / variance before).
    """

    value: Number
    standard_error: Unbounded
    before: Number
    before_standard_error: Unbounded
    prior_standard_error: Unbounded
    share_from_trials: Number


@dataclass(frozen=True, kw_only=True)
class EstimatedCurrent:
    """The current of trials at sea, estimated with the coefficients.

    Parameters
    ----------
    speed_mps, direction_deg : float
        Towards the direction.
    speed_standard_error_mps, direction_standard_error_deg : float
    largest_standard_error_mps : float
        In the direction in which it is known worst.
    determined : bool
        Whether the trials determine it.
    """

    speed_mps: Number
    direction_deg: Number
    speed_standard_error_mps: Unbounded
    direction_standard_error_deg: Unbounded
    largest_standard_error_mps: Unbounded
    determined: bool


@dataclass(frozen=True, kw_only=True)
class CardMisfit:
    """Misfit of the fitted trials, and of those held out (None without any): 1 is noise."""

    fit: Number
    holdout: float | None


@dataclass(frozen=True, kw_only=True)
class IdentificationMisfit(CardMisfit):
    """Misfit of the card found, and `before` of the card given; noise by signal of the model, SI."""

    noise: dict[str, Number]
    before: CardMisfit


@dataclass(frozen=True, kw_only=True)
class WindowError:
    """Root mean square of an error over windows, and of the measured signal, in the unit of the column."""

    rms_error: Unbounded
    rms_signal: Number

    @property
    def relative(self) -> float:
        """The error as a share of the signal; infinite for a signal that is zero."""
        return self.rms_error / self.rms_signal if self.rms_signal else np.inf


@dataclass(frozen=True, kw_only=True)
class TrialErrors:
    """Errors over windows of a trial by column, of the card given and of the card found."""

    trial: str
    before: dict[str, WindowError]
    found: dict[str, WindowError]


@dataclass(frozen=True, kw_only=True)
class PredictedFigure:
    """A figure of a trial.

    Parameters
    ----------
    trial, figure : str
        The figure with its unit.
    measured : float
    before, predicted : float or None
        By the card given and by the card found; None where the simulation did not reach it.
    error : float or None
        Predicted less measured.
    interval_95 : (float, float) or None
        Expected interval of the figure, for held-out trials.
    """

    trial: str
    figure: str
    measured: float
    before: float | None
    predicted: float | None
    error: float | None
    interval_95: tuple[Unbounded, Unbounded] | None

    def share_or_error(self, value: float | None) -> float:
        """A predicted value less the measured one; for distances as a share of it; NaN where not reached."""
        if value is None:
            return np.nan
        difference = value - self.measured
        return difference / self.measured if self.figure.endswith("_m") else difference


@dataclass(frozen=True, kw_only=True)
class StructureErrors:
    """Cross-validation of a structure.

    Parameters
    ----------
    errors : tuple of float
        Yaw-rate error of each trial held out as a share, then of those of largest amplitude held out together.
    left_out : tuple of tuple of str
        Trials held out for each error.
    weight : float or None
        Weight in the intervals; None unless structures are averaged.
    """

    errors: tuple[Unbounded, ...]
    left_out: tuple[tuple[str, ...], ...]
    weight: float | None


@dataclass(frozen=True, kw_only=True)
class SampledParameter:
    """A sampled parameter: R-hat, effective sample size, and its values at the levels of the quantiles."""

    r_hat: Unbounded
    effective_sample_size: Unbounded
    quantiles: tuple[Number, ...]


@dataclass(frozen=True, kw_only=True)
class PosteriorStudy:
    """Samples of the posterior.

    Parameters
    ----------
    sampler : str
    chains, draws, simulations : int
        Draws of all chains together.
    converged : bool
    quantile_levels : tuple of float
    parameters : dict
        By name.
    """

    sampler: str
    chains: int
    draws: int
    simulations: int
    converged: bool
    quantile_levels: tuple[float, ...]
    parameters: dict[str, SampledParameter]


@dataclass(frozen=True, kw_only=True)
class BootstrapStudy:
    """Standard deviation of the estimates over sets of trials simulated again, by parameter."""

    members: int
    standard_errors: dict[str, Number]


@dataclass(frozen=True, eq=False, kw_only=True)
class TrialMotions:
    """Columns of a trial as measured, and as simulated by the card given (`before`) and by the card found.

    Each has its own ``t_s``, thinned to draw; empty where a motion left all bounds.
    """

    trial: str
    measured: Columns
    before: Columns
    found: Columns


@dataclass(frozen=True, eq=False, kw_only=True)
class CardReplay(TrialMotions):
    """Motions of a fitted or held-out trial; `closed_loop`: steered as the manoeuvre asks, not by the record."""

    held_out: bool
    closed_loop: bool


@dataclass(frozen=True, eq=False, kw_only=True)
class IdentificationStudy:
    """Coefficients identified from free-running trials.

    Parameters
    ----------
    ship, method, structure : str
    method_reason : str or None
        None where the options name the method.
    current : EstimatedCurrent or None
        None where the card or a sensor states it, and in a basin.
    forced : tuple of str
        Evidence that the trials are not of the card's ship, where the fit was forced.
    manoeuvres : dict
        Trial to its recognised manoeuvre in words.
    derivatives, effects : dict
        Estimates by name; parameters of effects with their effect's name.
    effects_of_card : tuple of str
    misfit : IdentificationMisfit
    yaw_rate_error_over_windows : dict
        ``fit`` and ``holdout`` (None without any) to the share by trial, and of ``all``.
    errors_over_windows : dict
        ``fit`` and ``holdout`` to the trials.
    figures_are : str
        Origin of the figures.
    figures : dict
        ``fit`` and ``holdout`` to figures of turns and zigzags.
    structures : dict
        Cross-validation by structure; empty unless asked for.
    criteria : dict or None
        Information criteria ``aic`` and ``bic``, and the ``samples`` and ``parameters`` behind them.
    posterior : PosteriorStudy or None
    bootstrap : BootstrapStudy or None
    residual_noise : dict
        Standard deviation of the residuals by signal of the model, SI.
    prior_scale : dict
        Factor on the standard errors of the card by group of parameters.
    cost : tuple of float
    identifiability : IdentifiabilityStudy
    notices : tuple of Notice
        Changes to the data and marks; all that limits the result.
    replays : tuple of CardReplay
    """

    ship: str
    method: str
    method_reason: str | None
    current: EstimatedCurrent | None
    structure: str
    forced: tuple[str, ...]
    manoeuvres: dict[str, str]
    derivatives: dict[str, ParameterEstimate]
    effects: dict[str, ParameterEstimate]
    effects_of_card: tuple[str, ...]
    misfit: IdentificationMisfit
    yaw_rate_error_over_windows: dict[str, dict[str, Number] | None]
    errors_over_windows: dict[str, tuple[TrialErrors, ...]]
    figures_are: str
    figures: dict[str, tuple[PredictedFigure, ...]]
    structures: dict[str, StructureErrors]
    criteria: dict[str, Number] | None
    posterior: PosteriorStudy | None
    bootstrap: BootstrapStudy | None
    residual_noise: dict[str, Number]
    prior_scale: dict[str, Number]
    cost: tuple[Number, ...]
    identifiability: IdentifiabilityStudy
    notices: tuple[Notice, ...]
    replays: tuple[CardReplay, ...]

    @property
    def parameters(self) -> dict[str, ParameterEstimate]:
        """Derivatives and parameters of effects by name, in the order of the estimate."""
        every = {**self.derivatives, **self.effects}
        return {name: every[name] for name in self.identifiability.parameters}


def study_identification(
    before: ManoeuvringCard, result: Identification, fitted: Measured, held: Measured
) -> IdentificationStudy:
    """Study of an identification.

    `before`: The card given. `fitted`, `held`: Trials that were fitted and held out; they are replayed by both cards.
    """
    estimate, known = result.estimate, result.identifiability
    parameters = _parameters(result)
    forced = [caution(f"FORCED: {'; '.join(result.forced)}")] if result.forced else []
    unfinished = [] if result.posterior is None or result.posterior.converged else result.posterior.notices
    return IdentificationStudy(
        ship=result.card.ship.name,
        method=estimate.method,
        method_reason=None if result.choice is None else result.choice.reason,
        current=None if result.current is None else _current(result.current),
        structure=result.structure,
        forced=result.forced,
        manoeuvres=dict(result.manoeuvres),
        derivatives={
            name.partition(".")[2]: entry for name, entry in parameters.items() if name.startswith("derivatives.")
        },
        effects={name: entry for name, entry in parameters.items() if not name.startswith("derivatives.")},
        effects_of_card=tuple(effect.name for effect in result.card.effects),
        misfit=_misfit(result),
        yaw_rate_error_over_windows={
            "fit": _yaw_rate_errors(result.fit),
            "holdout": _yaw_rate_errors(result.holdout) if result.holdout else None,
        },
        errors_over_windows=_by_set(result, _errors_over_windows),
        figures_are=FIGURES_ARE,
        figures=_by_set(result, _figures),
        structures={
            name: StructureErrors(
                errors=tuple(structure.errors.tolist()),
                left_out=tuple(tuple(fold.held_out) for fold in (*structure.single, structure.extrapolation)),
                weight=result.weights.get(name, 0.0) if result.weights else None,
            )
            for name, structure in result.structures.items()
        },
        criteria=None if result.criteria is None else asdict(result.criteria),
        posterior=None if result.posterior is None else _posterior(result.posterior),
        bootstrap=_bootstrap(result),
        residual_noise=dict(estimate.noise),
        prior_scale=dict(estimate.prior_scale),
        cost=tuple(map(float, estimate.cost)),
        identifiability=known,
        notices=tuple(dict.fromkeys((*unfinished, *forced, *result.notices, *known.notices, *remarks(result)))),
        replays=_replays(before, result, fitted, held),
    )


def _current(current: WaterCurrent) -> EstimatedCurrent:
    speed_error, direction_error = current.errors
    return EstimatedCurrent(
        speed_mps=current.speed_mps,
        direction_deg=float(np.degrees(current.direction_rad)),
        speed_standard_error_mps=float(speed_error),
        direction_standard_error_deg=float(np.degrees(direction_error)),
        largest_standard_error_mps=current.standard_error_mps,
        determined=bool(current.determined),
    )


def _parameters(result: Identification) -> dict[str, ParameterEstimate]:
    problem, estimate = result.problem, result.estimate
    columns = {
        "value": estimate.values,
        "standard_error": estimate.standard_errors,
        "before": problem.prior_mean,
        "before_standard_error": problem.prior_error,
        "prior_standard_error": scaled_prior(problem, estimate.prior_scale),
        "share_from_trials": share_from_trials(problem, estimate),
    }
    return {
        name: ParameterEstimate(**{key: float(column[place]) for key, column in columns.items()})
        for place, name in enumerate(estimate.free)
    }


def _misfit(result: Identification) -> IdentificationMisfit:
    pairs = (result.fit, result.before), (result.holdout, result.before_holdout)
    fit, holdout = ([misfit(each, result.noise) if each else None for each in pair] for pair in pairs)
    assert fit[0] is not None and fit[1] is not None
    before = CardMisfit(fit=fit[1], holdout=holdout[1])
    return IdentificationMisfit(fit=fit[0], holdout=holdout[0], noise=dict(result.noise), before=before)


def _yaw_rate_errors(comparison: Comparison) -> dict[str, Number]:
    runs = {run.name: run.relative("motion.r") for run in comparison.following if "motion.r" in run.windows}
    return {**runs, "all": pooled(comparison.following, "motion.r")}


def _by_set(
    result: Identification, compare: Callable[[Comparison, Comparison], tuple[_Compared, ...]]
) -> dict[str, tuple[_Compared, ...]]:
    """Comparisons of both cards by ``fit`` and ``holdout``; empty for a set without trials."""
    found = {SET_KEYS[word]: compare(before, now) for word, before, now in result.comparisons}
    return {key: found.get(key, ()) for key in SET_KEYS.values()}


def _errors_over_windows(before: Comparison, found: Comparison) -> tuple[TrialErrors, ...]:
    def errors(following: Following) -> dict[str, WindowError]:
        pairs = {_OBSERVED[name]: pair for name, pair in following.windows.items()}
        return {
            column: WindowError(rms_error=float(from_si(column, error)), rms_signal=float(from_si(column, size)))
            for column, (error, size) in pairs.items()
        }

    pairs = zip(before.following, found.following, strict=True)
    return tuple(TrialErrors(trial=new.name, before=errors(old), found=errors(new)) for old, new in pairs)


def _figures(before: Comparison, found: Comparison) -> tuple[PredictedFigure, ...]:
    given = {(figure.trial, figure.name): figure.predicted for figure in before.figures}
    return tuple(
        PredictedFigure(
            trial=figure.trial,
            figure=figure.name,
            measured=figure.measured,
            before=given.get((figure.trial, figure.name)),
            predicted=figure.predicted,
            error=None if figure.predicted is None else figure.predicted - figure.measured,
            interval_95=None if figure.interval is None else (float(figure.interval[0]), float(figure.interval[1])),
        )
        for figure in found.figures
    )


def _posterior(samples: PosteriorSamples) -> PosteriorStudy:
    quantiles = np.quantile(samples.flat, POSTERIOR_LEVELS, axis=0).T
    return PosteriorStudy(
        sampler=samples.sampler,
        chains=len(samples.values),
        draws=len(samples.flat),
        simulations=int(samples.simulations),
        converged=samples.converged,
        quantile_levels=POSTERIOR_LEVELS,
        parameters={
            name.removeprefix("derivatives."): SampledParameter(
                r_hat=float(r_hat), effective_sample_size=float(effective), quantiles=tuple(values.tolist())
            )
            for name, r_hat, effective, values in zip(
                samples.free, samples.r_hat, samples.effective, quantiles, strict=True
            )
        },
    )


def _bootstrap(result: Identification) -> BootstrapStudy | None:
    if result.bootstrap is None:
        return None
    errors = np.std(result.bootstrap, axis=0, ddof=1).tolist()
    return BootstrapStudy(
        members=len(result.bootstrap), standard_errors=dict(zip(result.estimate.free, errors, strict=True))
    )


def _replays(
    before: ManoeuvringCard, result: Identification, fitted: Measured, held: Measured
) -> tuple[CardReplay, ...]:
    """Every trial, whole, next to both cards in the same current."""
    given = before if result.current is None else card_in(before, result.current)
    found: list[CardReplay] = []
    for held_out, group in ((False, fitted), (True, held)):
        if group.trials:
            passages = []
            for card in (given, result.card):
                problem = problem_from_card(card, group.trials, group.driven_by, whole=True)
                passages.append(comparison_windows(problem, card, group.trials, result.estimate.noise))
            found += (card_replay(*pair, held_out=held_out) for pair in zip(*passages, strict=True))
    return tuple(found)


def card_replay(before: Passage, found: Passage, *, held_out: bool) -> CardReplay:
    """Columns of a measurement and of its simulations by two cards, each over its own time, thinned for a chart."""
    return CardReplay(
        trial=found.name,
        measured=_columns(found.time_s, found.measured),
        before=_columns(before.model_time_s, before.simulated),
        found=_columns(found.model_time_s, found.simulated),
        held_out=held_out,
        closed_loop=bool(found.closed_loop),
    )


def _columns(time_s: Array, signals: Mapping[str, Array]) -> Columns:
    if not len(time_s):
        return {}
    columns = {_COLUMNS[name]: from_si(_COLUMNS[name], 1.0) * values for name, values in signals.items()}
    return drawn_columns({"t_s": time_s, **columns}, _SAMPLES)


def pooled_error(trials: Sequence[TrialErrors], card: str) -> float:
    """Error of the yaw rate over windows of all trials together, as a share of it; NaN if no ship yaws.

    `card`: ``before`` or ``found``.
    """
    every = (getattr(trial, card) for trial in trials)
    errors = [errors["r_degps"] for errors in every if "r_degps" in errors]
    return pooled([Following("", {"r": (error.rms_error, error.rms_signal)}, {}) for error in errors], "r")


def identified_card_text(result: Identification, trials: list[str]) -> str:
    """Text of the card found, with the names of the trials in its source."""
    card = result.card
    origin = f"identified by tank2sim ({result.estimate.method}, {result.structure}) from {', '.join(trials)}"
    if result.forced:
        origin = f"FORCED, although not of this ship by the rudder's moment: {origin}"
    changes: dict[str, object] = {"ship.source": f"{card.ship.source}; {origin}"}
    if card.ship.notes:
        changes["ship.notes"] = f"Before it was {origin}: {card.ship.notes}"
    head = f"# {one_line(origin[0].upper() + origin[1:])}.\n"
    head += "# Comments below are of the card before, except keys marked as identified.\n"
    text = changed_text(card.text, card.source, changes)
    mark = BYTE_ORDER_MARK if text.startswith(BYTE_ORDER_MARK) else ""
    return mark + head + text.removeprefix(mark)
