"""Results of an ensemble of a ship: a manoeuvre, stability with the IMO criteria, and figures by name."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np

from tank2sim.analysis.ensemble.draws import draws_of
from tank2sim.analysis.ensemble.questions import (
    BEYOND_CARD_MARK,
    OfCriteria,
    OfFigures,
    OfManoeuvre,
    ShipText,
    signals_with_bands,
)
from tank2sim.analysis.ensemble.steering import Grid, SteeringBands, steering_bands
from tank2sim.analysis.ensemble.steps import STEP_TOLERANCE, TRIED_MEMBERS, fastest_pace
from tank2sim.analysis.ensemble.tails import Tail, tails
from tank2sim.analysis.stability.imo import ImoCriterion
from tank2sim.analysis.stability.straight_line import answering_states
from tank2sim.arrays import Array
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.dynamics import build
from tank2sim.errors import InputError
from tank2sim.simulation.bands import STILL_RUNNING, Band, BandOverTime, TrackBand, figure_bands, history_bands
from tank2sim.simulation.ensemble import KEPT, Draws, Ensemble, Question, ensemble
from tank2sim.simulation.lane_figures import USUAL_PACE
from tank2sim.simulation.manoeuvres import Manoeuvre
from tank2sim.units import in_words

TIMES = 201
"""Times of the bands of histories and tracks, over the run of the card itself (project choice)."""

STRAIGHT = ("criterion_C", "K_prime", "T_prime", "T_s", "T3_s")
"""Figures of the straight course that have bands."""

POLES = ("K_per_s", "K_prime", "T_s", "T1_s", "T_prime")
"""Figures with C' in the denominator: where it changes its sign they pass through infinity, and quantiles over members
on both sides are meaningless."""


@dataclass(frozen=True)
class EnsembleRequest:
    """Request for an ensemble: number of members, and seed."""

    members: int
    seed: int = 0


@dataclass(frozen=True, eq=False)
class Members:
    """Members of an ensemble: number, seed, unusable members with the reason, and notices."""

    members: int
    seed: int
    unusable: Mapping[str, int]
    notices: tuple[str, ...]

    @property
    def usable(self) -> int:
        """Number of usable members."""
        return self.members - sum(self.unusable.values())

    def as_json(self) -> dict[str, object]:
        """The JSON form."""
        return {
            "members": self.members,
            "seed": self.seed,
            "usable": self.usable,
            "unusable": dict(self.unusable),
            "notices": list(self.notices),
        }


@dataclass(frozen=True, eq=False)
class ManoeuvreBands:
    """Bands of a manoeuvre: of its figures, of signals at `times_s` (n,), and of the track.

    `steps_s` are the integration steps of the first :data:`tank2sim.simulation.ensemble.KEPT` members, whose histories
    are kept, and of all later ones, `single_precision` whether these are integrated in single precision.
    """

    asked: Members
    figures: Mapping[str, Band]
    times_s: Array
    histories: Mapping[str, BandOverTime]
    track: TrackBand | None
    steps_s: tuple[float, float]
    single_precision: bool

    def as_json(self) -> dict[str, object]:
        """The JSON form."""
        return {
            **self.asked.as_json(),
            "steps_s": self.steps_s,
            "single_precision": self.single_precision,
            "figures": {name: band.as_json() for name, band in self.figures.items()},
            "t_s": self.times_s,
            "histories": {name: band.as_json() for name, band in self.histories.items()},
            "track": self.track and self.track.as_json(),
        }


@dataclass(frozen=True)
class Chance:
    """Probability that a criterion is met.

    Parameters
    ----------
    criterion : ImoCriterion
        The criterion, with the value of the card's ship.
    met : float or None
        Share of all usable members that meet it; None if no member shows it.
    between : tuple or None
        95 % interval of that probability, by the number of members (Wilson 1927, J. Amer. Stat. Assoc. 22).
    undecided : int
        Usable members whose trial does not show it; they count as not meeting it.
    band : Band or None
        Band of the figures found.
    beyond : int
        Usable members whose trial left the card's range before it was known; they count by what was found.
    tail : Tail, optional
        The probability of not meeting it by importance sampling, where fewer than
        :data:`tank2sim.analysis.ensemble.tails.FEW_FAILING` members fail.
    """

    criterion: ImoCriterion
    met: float | None
    between: tuple[float, float] | None
    undecided: int
    band: Band | None
    beyond: int = 0
    tail: Tail | None = None

    def as_json(self) -> dict[str, object]:
        """The JSON form."""
        found = self.criterion
        return {
            "name": found.name,
            "allowed": found.allowed,
            "unit": found.unit,
            "probability_met": self.met,
            "interval_95": self.between,
            "not_shown": self.undecided,
            "beyond_card": self.beyond,
            "band": self.band and self.band.as_json(),
            "tail": self.tail and self.tail.as_json(),
        }


@dataclass(frozen=True)
class ChanceOfAll:
    """Probability that all criteria are met that have a probability and are judged within the card's range.

    Parameters
    ----------
    names : tuple of str
        Names of these criteria.
    met, between, tail
        As in :class:`Chance`.
    """

    names: tuple[str, ...]
    met: float
    between: tuple[float, float]
    tail: Tail | None = None

    def as_json(self) -> dict[str, object]:
        """The JSON form."""
        return {
            "criteria": list(self.names),
            "probability_met": self.met,
            "interval_95": self.between,
            "tail": self.tail and self.tail.as_json(),
        }


@dataclass(frozen=True, eq=False)
class StabilityBands:
    """Bands of the straight course at the card's speed, and the probabilities of stability, of each criterion and of
    all criteria together."""

    asked: Members
    figures: Mapping[str, Band]
    stable: float | None
    stable_between: tuple[float, float] | None
    chances: tuple[Chance, ...]
    curves: SteeringBands | None = None
    all_met: ChanceOfAll | None = None

    def as_json(self) -> dict[str, object]:
        """The JSON form."""
        return {
            **self.asked.as_json(),
            "figures": {name: band.as_json() for name, band in self.figures.items()},
            "probability_stable": self.stable,
            "probability_stable_interval_95": self.stable_between,
            "imo": [chance.as_json() for chance in self.chances],
            "imo_all": self.all_met and self.all_met.as_json(),
            "curves": self.curves and self.curves.as_json(),
        }


@dataclass(frozen=True, eq=False)
class FigureBands:
    """Bands of figures by name, and the standard deviation of each over the members."""

    asked: Members
    figures: Mapping[str, Band]
    deviations: Mapping[str, float]

    def as_json(self) -> dict[str, object]:
        """The JSON form."""
        figures = {
            name: {**band.as_json(), "standard_deviation": self.deviations[name]} for name, band in self.figures.items()
        }
        return {**self.asked.as_json(), "figures": figures}


def manoeuvre_bands(
    card: ManoeuvringCard,
    manoeuvre: Manoeuvre,
    run_s: tuple[float | None, float],
    request: EnsembleRequest,
    executor: Executor | None = None,
) -> ManoeuvreBands:
    """Bands of a manoeuvre; `run_s` is the requested duration, and that of the card's own run."""
    draws, notices = draws_of(card, request.seed)
    times = np.linspace(0.0, run_s[1], TIMES)
    question = OfManoeuvre(ShipText.of(card), manoeuvre, run_s[0], times)
    model = build(card)
    if request.members > KEPT:
        notices.append(f"bands of tracks and histories are of the first {KEPT} members; figures are of all")
        question = replace(question, pace=fastest_pace(question, draws))
    steps = model.step_s, question.pace.step_factor * model.step_s
    if question.pace != USUAL_PACE:
        single = " in single precision" if question.pace.single else ""
        notices.append(
            f"integration steps are {steps[0]:.3g} s for the first {KEPT} members and {steps[1]:.3g} s{single} for the "
            f"others: no figure of the first {TRIED_MEMBERS} changes by more than {100 * STEP_TOLERANCE:g} %"
        )
    found = _ensemble(card, question, draws, request.members, executor)
    shown, histories, track = history_bands(found, times, tuple(signals_with_bands(model)))
    if 0 < len(shown) < len(times):
        share = f"{100 * STILL_RUNNING:g} % of the members"
        notices.append(f"bands over time end at {shown[-1]:.4g} s, up to which {share} run; figures are of all")
    if track is not None and track.count < len(shown):
        last = shown[track.count - 1]
        share = f"{100 * STILL_RUNNING:g} % of the members"
        notices.append(f"the band of the track ends at {last:.4g} s, where fewer than {share} reach it")
    return ManoeuvreBands(
        _members(found, notices), figure_bands(found), shown, histories, track, steps, question.pace.single
    )


def stability_bands(
    card: ManoeuvringCard,
    criteria: Sequence[ImoCriterion],
    request: EnsembleRequest,
    executor: Executor | None = None,
    curves: tuple[float | None, Grid] | None = None,
) -> StabilityBands:
    """Bands of the straight course at the card's speed, the probabilities of the IMO `criteria`, and on request bands
    of `curves`: at a speed (None: the card's), on a grid."""
    draws, messages = draws_of(card, request.seed)
    question = OfCriteria(ShipText.of(card))
    trials = _ensemble(card, question, draws, request.members, executor)
    messages.append("an ensemble is judged at the card's speed")
    try:
        straight = _ensemble(card, OfFigures(ShipText.of(card), STRAIGHT), draws, request.members, executor)
    except InputError as error:
        straight = Ensemble(request.members, request.seed, {})
        messages.append(f"no bands of the straight course: {error.problem}")
    chances = tuple(chance(criterion, trials) for criterion in criteria)
    limits = {
        one.criterion.name: one.criterion.allowed
        for one in chances
        if one.met is not None and not one.criterion.beyond_card
    }
    each, of_any, about = tails(question, draws, trials, limits, executor)
    messages += about
    chances = tuple(replace(one, tail=each.get(one.criterion.name)) for one in chances)
    messages += _counted(chances, trials.usable)
    together = all_chances(limits, trials)
    unseen = answering_states(build(card))
    if unseen:
        messages.append(
            "no probability of stability: the figures of the members are those of slow motions, which "
            f"{', '.join(unseen)} follow at once"
        )
    stable, between = (None, None) if unseen else _stable(straight)
    bands, through = bands_without_poles(straight)
    messages += through
    drawn = steering_bands(ShipText.of(card), draws, request.members, curves, executor) if curves else None
    messages += drawn.notices if drawn else ()
    together = together and replace(together, tail=of_any)
    return StabilityBands(_members(trials, messages), bands, stable, between, chances, drawn, together)


def named_bands(
    card: ManoeuvringCard, figures: Sequence[str], request: EnsembleRequest, executor: Executor | None = None
) -> FigureBands:
    """Bands of figures by name (:mod:`tank2sim.analysis.influence.figures`)."""
    draws, notices = draws_of(card, request.seed)
    found = _ensemble(card, OfFigures(ShipText.of(card), tuple(figures)), draws, request.members, executor)
    bands, through = bands_without_poles(found)
    notices += through
    deviations = {name: float(np.nanstd(found.figures[name], ddof=1)) for name in bands} if request.members > 1 else {}
    deviations = {name: deviations.get(name, math.nan) for name in bands}
    for name, band in bands.items():
        if band.shown < found.usable:
            notices.append(f"{name}: {found.usable - band.shown} of {request.members} members do not show it")
    return FigureBands(_members(found, notices), bands, deviations)


def bands_without_poles(found: Ensemble) -> tuple[dict[str, Band], list[str]]:
    """Bands of figures by name, except for those of :data:`POLES` that pass through infinity, with notices on these."""
    bands = figure_bands(found)
    poles = [name for name in POLES if name in bands]
    if not poles:
        return bands, []
    judged = found.figures.get("criterion_C")
    signs = {name: np.sign(found.figures[name] if judged is None else judged) for name in poles}
    gone = [name for name in poles if (signs[name] > 0).any() and (signs[name] < 0).any()]
    if not gone:
        return bands, []
    usable, words = found.usable, " and ".join(in_words(name)[0] for name in gone)
    above = int(np.sum(signs[gone[0]] > 0))
    text = f"no band of {words}: {above} of {usable} members have C' above zero, the others below, and between these "
    return {name: band for name, band in bands.items() if name not in gone}, [f"{text}they go through infinity"]


def chance(criterion: ImoCriterion, found: Ensemble) -> Chance:
    """The probability of a criterion, from the values of the members."""
    values = found.figures.get(criterion.name, np.zeros(0))
    shown = values[np.isfinite(values)]
    if not len(shown):
        return Chance(criterion, None, None, found.usable, None)
    count = int(np.sum(shown <= criterion.allowed))
    met, ends = _share(count, found.usable)
    beyond = int(np.sum(found.figures.get(criterion.name + BEYOND_CARD_MARK, np.zeros(0)) > 0))
    return Chance(criterion, met, ends, found.usable - len(shown), figure_bands(found)[criterion.name], beyond)


def _counted(chances: Sequence[Chance], usable: int) -> list[str]:
    """Notices on members without a figure, and on those beyond the card's range."""
    lost, left = (
        ", ".join(f"{one.criterion.name} {count} of {usable}" for one, count in counts if one.met is not None and count)
        for counts in ([(one, one.undecided) for one in chances], [(one, one.beyond) for one in chances])
    )
    lines = [f"members that do not show a figure count as not meeting its criterion: {lost}"] if lost else []
    if left:
        lines.append(f"members that left the card's range before a figure was known count by what was found: {left}")
    if any(one.met is not None for one in chances) and all(
        one.criterion.beyond_card for one in chances if one.met is not None
    ):
        lines.append("no probability of the criteria together: the trials of the card itself leave its range")
    return lines


def all_chances(limits: Mapping[str, float], found: Ensemble) -> ChanceOfAll | None:
    """The probability that members meet all of the criteria with these limits; None without one."""
    if not limits:
        return None
    with np.errstate(invalid="ignore"):
        met = np.all([found.figures[name] <= allowed for name, allowed in limits.items()], axis=0)
    return ChanceOfAll(tuple(limits), *_share(int(np.sum(met)), found.usable))


def _share(count: int, of: int) -> tuple[float, tuple[float, float]]:
    """The share of `of` members, and Wilson's interval of 95 %."""
    from scipy.stats import binomtest  # slow to load

    between = binomtest(count, of).proportion_ci(0.95, method="wilson")
    return count / of, (float(between.low), float(between.high))


def _stable(straight: Ensemble) -> tuple[float, tuple[float, float]] | tuple[None, None]:
    """Share of members whose modes of sway and yaw both decay (C' and T1 + T2 are positive), and its interval."""
    if not straight.figures or not straight.usable:
        return None, None
    total = straight.figures["T_s"] + straight.figures["T3_s"]
    with np.errstate(invalid="ignore"):
        count = int(np.sum((straight.figures["criterion_C"] > 0) & (total > 0)))
    return _share(count, straight.usable)


def _ensemble(
    card: ManoeuvringCard, question: Question, draws: Draws, members: int, executor: Executor | None
) -> Ensemble:
    """The members. Raises InputError if not one of them is a ship that can be simulated."""
    found = ensemble(question, draws, members, executor)
    shown = found.histories is not None or any(np.isfinite(values).any() for values in found.figures.values())
    if found.bad.all() or not shown:
        reason = next(iter(found.unusable), "none shows a figure")
        problem = f"not one of {members} ships drawn from it can be simulated ({reason})"
        raise card.fault("uncertainty", problem, "correct the standard errors, or the covariance")
    return found


def _members(found: Ensemble, messages: Sequence[str]) -> Members:
    return Members(found.members, found.seed, found.unusable, (*messages, *found.notices))
