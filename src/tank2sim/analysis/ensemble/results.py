"""Results of an ensemble of a ship: a manoeuvre, stability with the IMO criteria, and figures by name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from tank2sim.analysis.ensemble.draws import draws_of
from tank2sim.analysis.ensemble.questions import (
    BEYOND_CARD_MARK,
    STEP_TOLERANCE,
    TRIED_MEMBERS,
    OfCriteria,
    OfFigures,
    OfManoeuvre,
    ShipText,
    fastest_pace,
    signals_with_bands,
)
from tank2sim.analysis.ensemble.steering import Grid, SteeringBands, steering_bands
from tank2sim.analysis.ensemble.tails import Tail, tails
from tank2sim.analysis.stability.imo import ImoCriterion
from tank2sim.analysis.stability.straight_line import answering_states
from tank2sim.arrays import Array
from tank2sim.cards.card import SteeredCard
from tank2sim.dynamics import build
from tank2sim.dynamics.card_parameters import card_parameters, study_model
from tank2sim.errors import InputError
from tank2sim.notices import Notice
from tank2sim.simulation.bands import STILL_RUNNING, Band, BandOverTime, TrackBand, band_of, figure_bands, history_bands
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
class DrawnShips:
    """The ships of an ensemble, to be listed one by one. They are drawn again for it, not stored.

    Parameters
    ----------
    figures : mapping
        Name to the figure of each of the n ships (n,); nan where a ship does not show it.
    usable : array (n,)
        False for a ship that cannot be simulated.
    """

    card: SteeredCard
    draws: Draws
    figures: Mapping[str, Array]
    usable: NDArray[np.bool_]

    def coefficients(self) -> dict[str, Array]:
        """Drawn numbers (n,) by the dotted keys of the card, in the conventions of its file."""
        numbers = {parameter.name: parameter for parameter in card_parameters(self.card, study_model(self.card))}
        values = self.draws.members(0, len(self.usable)).values
        drawn = (numbers[name] for name in self.draws.names)
        return {number.key: number.factor * column for number, column in zip(drawn, values.T, strict=True)}


@dataclass(frozen=True, eq=False, kw_only=True)
class Members:
    """Members of an ensemble: number, seed, usable ones, unusable ones by their reason, notices, and whether all
    standard errors are assumed.

    `drawn` are the ships themselves (:class:`DrawnShips`). They are not part of the JSON: a result that was read from
    its JSON has none.
    """

    members: int
    seed: int
    usable: int
    unusable: dict[str, int]
    notices: tuple[Notice, ...]
    assumed_errors: bool = False
    drawn: Annotated[Any, Field(exclude=True)] = None


@dataclass(frozen=True, eq=False, kw_only=True)
class ManoeuvreBands(Members):
    """Bands of a manoeuvre: of its figures, of signals at `t_s` (n,), and of the track.

    `steps_s` are the integration steps of the first :data:`tank2sim.simulation.ensemble.KEPT` members, whose histories
    are kept, and of all later ones, `single_precision` whether these are integrated in single precision.
    """

    figures: dict[str, Band]
    t_s: Array
    histories: dict[str, BandOverTime]
    track: TrackBand | None
    steps_s: tuple[float, float]
    single_precision: bool


@dataclass(frozen=True, kw_only=True)
class Chance:
    """Probability that a criterion is met.

    Parameters
    ----------
    name, allowed, unit : str, float, str
        The criterion, and its largest allowed value.
    probability_met : float or None
        Share of all usable members that meet it; None if no member shows it.
    interval_95 : tuple or None
        95 % interval of that probability, by the number of members (Wilson 1927, J. Amer. Stat. Assoc. 22).
    not_shown : int
        Usable members whose trial does not show it; they count as not meeting it.
    beyond_card : int
        Usable members whose trial left the card's range before it was known; they count by the value found.
    band : Band or None
        Band of the values found.
    tail : Tail, optional
        The probability of not meeting it by importance sampling, where fewer than
        :data:`tank2sim.analysis.ensemble.tails.FEW_FAILING` members fail.
    """

    name: str
    allowed: float
    unit: str
    probability_met: float | None
    interval_95: tuple[float, float] | None
    not_shown: int
    beyond_card: int = 0
    band: Band | None = None
    tail: Tail | None = None


@dataclass(frozen=True, kw_only=True)
class ChanceOfAll:
    """Probability that all criteria are met that have a probability and are judged within the card's range.

    Parameters
    ----------
    criteria : tuple of str
        Their names.
    probability_met, interval_95, tail
        As in :class:`Chance`.
    """

    criteria: tuple[str, ...]
    probability_met: float
    interval_95: tuple[float, float]
    tail: Tail | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class StabilityBands(Members):
    """Bands of the straight course at the card's speed, and the probabilities of stability (`probability_stable`, with
    its 95 % interval), of each criterion (`imo`) and of all criteria together; `curves` where they were requested."""

    figures: dict[str, Band]
    probability_stable: float | None
    probability_stable_interval_95: tuple[float, float] | None
    imo: tuple[Chance, ...]
    imo_all: ChanceOfAll | None
    curves: SteeringBands | None


@dataclass(frozen=True, eq=False, kw_only=True)
class FigureBands(Members):
    """Bands of figures by name."""

    figures: dict[str, Band]


def manoeuvre_bands(
    card: SteeredCard,
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
        notices.append(Notice(f"bands of tracks and histories are of the first {KEPT} members; figures are of all"))
        question = replace(question, pace=fastest_pace(question, draws))
    steps = model.step_s, question.pace.step_factor * model.step_s
    if question.pace != USUAL_PACE:
        single = " in single precision" if question.pace.single else ""
        notices.append(
            Notice(
                f"integration steps are {steps[0]:.3g} s for the first {KEPT} members, {steps[1]:.3g} s{single} for "
                f"the others: no figure of the first {TRIED_MEMBERS} changes by more than {100 * STEP_TOLERANCE:g} %"
            )
        )
    found = _ensemble(card, question, draws, request.members, executor)
    shown, histories, track = history_bands(found, times, tuple(signals_with_bands(model)))
    if 0 < len(shown) < len(times):
        share = f"{100 * STILL_RUNNING:g} % of the members"
        notices.append(Notice(f"bands over time end at {shown[-1]:.4g} s, up to which {share} run; figures are of all"))
    if track is not None and track.count < len(shown):
        last = shown[track.count - 1]
        share = f"{100 * STILL_RUNNING:g} % of the members"
        notices.append(Notice(f"the band of the track ends at {last:.4g} s, where fewer than {share} reach it"))
    return ManoeuvreBands(
        **_members(card, draws, found, notices),
        figures=figure_bands(found),
        t_s=shown,
        histories=histories,
        track=track,
        steps_s=steps,
        single_precision=question.pace.single,
    )


def stability_bands(
    card: SteeredCard,
    criteria: Sequence[ImoCriterion],
    request: EnsembleRequest,
    executor: Executor | None = None,
    curves: tuple[float | None, Grid] | None = None,
) -> StabilityBands:
    """Bands of the straight course at the card's speed, the probabilities of the IMO `criteria`, and on request bands
    of `curves`: at a speed (None: the card's), on a grid."""
    draws, messages = draws_of(card, request.seed)
    ship = ShipText.of(card)
    trials = _ensemble(card, OfCriteria(ship), draws, request.members, executor)
    messages.append(Notice("an ensemble is judged at the card's speed"))
    straight, about = _straight(card, draws, request, executor)
    messages += about
    chances = tuple(chance(criterion, trials) for criterion in criteria)
    judged = [one for one in chances if one.probability_met is not None]
    beyond = {criterion.name for criterion in criteria if criterion.beyond_card}
    limits = {one.name: one.allowed for one in judged if one.name not in beyond}
    each, of_any, about = tails(OfCriteria(ship), draws, trials, limits, executor)
    messages += [*about, *_counted(judged, trials.usable)]
    if judged and not limits:
        messages.append(
            Notice("no probability of the criteria together: the trials of the card itself leave its range")
        )
    together = all_chances(limits, trials)
    stable, between, about = _stable(card, straight)
    bands, through = bands_without_poles(straight)
    messages += [*about, *through]
    drawn = None
    if curves:
        drawn, about = steering_bands(ship, draws, request.members, curves, executor)
        messages += about
    return StabilityBands(
        **_members(card, draws, trials, messages, straight.figures),
        figures=bands,
        probability_stable=stable,
        probability_stable_interval_95=between,
        imo=tuple(replace(one, tail=each.get(one.name)) for one in chances),
        imo_all=together and replace(together, tail=of_any),
        curves=drawn,
    )


def _straight(
    card: SteeredCard, draws: Draws, request: EnsembleRequest, executor: Executor | None
) -> tuple[Ensemble, list[Notice]]:
    """Figures of the straight course; none, with the reason, where the card's ship does not show them."""
    try:
        return _ensemble(card, OfFigures(ShipText.of(card), STRAIGHT), draws, request.members, executor), []
    except InputError as error:
        none = Ensemble(request.members, request.seed, {})
        return none, [Notice(f"no bands of the straight course: {error.problem}")]


def growth_bands(
    card: SteeredCard, question: Question, request: EnsembleRequest, executor: Executor | None = None
) -> StabilityBands:
    """Bands of the figures of a `question`, and the probability that its ``growth_per_s`` (1/s) is negative.

    Parameters
    ----------
    question : Question
        Each usable member shows ``growth_per_s``, the real part of the least damped mode.
    """
    draws, messages = draws_of(card, request.seed)
    found = _ensemble(card, question, draws, request.members, executor)
    stable, between = _share(int(np.sum(found.figures["growth_per_s"] < 0)), found.usable)
    return StabilityBands(
        **_members(card, draws, found, messages),
        figures=figure_bands(found),
        probability_stable=stable,
        probability_stable_interval_95=between,
        imo=(),
        imo_all=None,
        curves=None,
    )


def named_bands(
    card: SteeredCard, figures: Sequence[str], request: EnsembleRequest, executor: Executor | None = None
) -> FigureBands:
    """Bands of figures by name (:mod:`tank2sim.analysis.influence.figures`)."""
    draws, notices = draws_of(card, request.seed)
    found = _ensemble(card, OfFigures(ShipText.of(card), tuple(figures)), draws, request.members, executor)
    bands, through = bands_without_poles(found)
    notices += through
    for name, band in bands.items():
        if band.shown_by < found.usable:
            notices.append(
                Notice(f"{name}: {found.usable - band.shown_by} of {request.members} members do not show it")
            )
    return FigureBands(**_members(card, draws, found, notices), figures=bands)


def bands_without_poles(found: Ensemble) -> tuple[dict[str, Band], list[Notice]]:
    """Bands of figures by name, except for those of :data:`POLES` that pass through infinity, with notices on these."""
    bands, figures = figure_bands(found), found.figures
    judges = {name: figures.get("criterion_C", figures[name]) for name in POLES if name in bands}
    gone = [name for name, values in judges.items() if (values > 0).any() and (values < 0).any()]
    if not gone:
        return bands, []
    words, above = " and ".join(in_words(name)[0] for name in gone), int(np.sum(judges[gone[0]] > 0))
    text = f"no band of {words}: {above} of {found.usable} members have C' above zero, the others below"
    left = {name: band for name, band in bands.items() if name not in gone}
    return left, [Notice(f"{text}, and between these they go through infinity")]


def chance(criterion: ImoCriterion, found: Ensemble) -> Chance:
    """The probability of a criterion, from the values of the members."""
    values = found.figures.get(criterion.name, np.zeros(0))
    shown = values[np.isfinite(values)]
    unknown = Chance(
        name=criterion.name,
        allowed=criterion.allowed,
        unit=criterion.unit,
        probability_met=None,
        interval_95=None,
        not_shown=found.usable,
    )
    if not len(shown):
        return unknown
    met, ends = _share(int(np.sum(shown <= criterion.allowed)), found.usable)
    return replace(
        unknown,
        probability_met=met,
        interval_95=ends,
        not_shown=found.usable - len(shown),
        beyond_card=int(np.sum(found.figures.get(criterion.name + BEYOND_CARD_MARK, np.zeros(0)) > 0)),
        band=band_of(values),
    )


def _counted(chances: Sequence[Chance], usable: int) -> list[Notice]:
    """Notices on members without a figure, and on those beyond the card's range."""
    lost = ", ".join(f"{one.name} {one.not_shown} of {usable}" for one in chances if one.not_shown)
    left = ", ".join(f"{one.name} {one.beyond_card} of {usable}" for one in chances if one.beyond_card)
    lines = [f"members that do not show a figure count as not meeting its criterion: {lost}"] if lost else []
    if left:
        lines.append(f"members that left the card's range before a figure was known count by the value found: {left}")
    return [Notice(text) for text in lines]


def all_chances(limits: Mapping[str, float], found: Ensemble) -> ChanceOfAll | None:
    """The probability that members meet all of the criteria with these limits; None without one."""
    if not limits:
        return None
    with np.errstate(invalid="ignore"):
        met = np.all([found.figures[name] <= allowed for name, allowed in limits.items()], axis=0)
    share, between = _share(int(np.sum(met)), found.usable)
    return ChanceOfAll(criteria=tuple(limits), probability_met=share, interval_95=between)


def _share(count: int, of: int) -> tuple[float, tuple[float, float]]:
    """The share of `of` members, and Wilson's interval of 95 %."""
    from scipy.stats import binomtest  # slow to load

    between = binomtest(count, of).proportion_ci(0.95, method="wilson")
    return count / of, (float(between.low), float(between.high))


def _stable(card: SteeredCard, straight: Ensemble) -> tuple[float | None, tuple[float, float] | None, list[Notice]]:
    """Share of members whose modes of sway and yaw both decay (C' and T1 + T2 are positive), its interval, notices."""
    if unseen := answering_states(build(card)):
        text = "no probability of stability: the figures of the members describe slow motions, which "
        return None, None, [Notice(f"{text}{', '.join(unseen)} follow at once")]
    if not straight.figures or not straight.usable:
        return None, None, []
    total = straight.figures["T_s"] + straight.figures["T3_s"]
    with np.errstate(invalid="ignore"):
        count = int(np.sum((straight.figures["criterion_C"] > 0) & (total > 0)))
    return *_share(count, straight.usable), []


def _ensemble(card: SteeredCard, question: Question, draws: Draws, members: int, executor: Executor | None) -> Ensemble:
    """The members. Raises InputError if not one of them is a ship that can be simulated."""
    found = ensemble(question, draws, members, executor)
    shown = found.histories is not None or any(np.isfinite(values).any() for values in found.figures.values())
    if found.bad.all() or not shown:
        reason = next(iter(found.unusable), "none shows a figure")
        problem = f"not one of {members} ships drawn from it can be simulated ({reason})"
        raise card.fault("uncertainty", problem, "correct the standard errors, or the covariance")
    return found


def _members(
    card: SteeredCard,
    draws: Draws,
    found: Ensemble,
    messages: Sequence[Notice],
    further: Mapping[str, Array] | None = None,
) -> dict[str, Any]:
    """Fields of :class:`Members`; `further` are figures of the same members from another evaluation."""
    return {
        "members": found.members,
        "seed": found.seed,
        "usable": found.members - sum(found.unusable.values()),
        "unusable": dict(found.unusable),
        "notices": (*messages, *found.notices),
        "assumed_errors": draws.assumed,
        "drawn": DrawnShips(card, draws, {**found.figures, **(further or {})}, ~found.bad),
    }
