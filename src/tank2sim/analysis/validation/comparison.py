"""Comparison of cards of a ship: by coefficient, and by their figures in the standard trials."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from tank2sim.analysis.ensemble.results import DrawnShips
from tank2sim.analysis.validation.coefficients import (
    BEYOND_STANDARD_ERRORS,
    SAME,
    CoefficientRow,
    compare_coefficients,
    compare_effects,
)
from tank2sim.analysis.validation.standard_trials import (
    TrialShip,
    drawn_ships,
    figure_numbers,
    member_spread,
    members,
    ship_of,
    standard_trials,
)
from tank2sim.arguments import VALIDATION_MEMBERS
from tank2sim.arrays import Array
from tank2sim.cards.card import DEFAULT_RELATIVE_ERROR, SteeredBy, SteeredCard
from tank2sim.cards.examination import doubts
from tank2sim.errors import InputError
from tank2sim.notices import Notice, caution
from tank2sim.simulation.card_range import Numbers
from tank2sim.simulation.manoeuvres import Manoeuvre
from tank2sim.simulation.trajectory import Trajectory

SAME_SIZE = 0.03
"""Lengths and breadths that differ by less than this share are of the same ship: definitions differ. Project choice."""


_TRACK_POINTS = 200
"""Points of a track in the JSON, for charts."""


@dataclass(frozen=True, eq=False, kw_only=True)
class CardTrack:
    """Path of a card's ship in a trial at the reference's size, thinned to draw: s, and m north and east (n,)."""

    card: str
    t_s: Array
    x_m: Array
    y_m: Array


@dataclass(frozen=True, kw_only=True)
class ComparedFigure:
    """A figure by all cards at the reference's size.

    Parameters
    ----------
    values, standard_deviations : tuple of float or None
        One for each card, the reference first; None where the run did not show it, or its error is unknown.
    outside_card_range : tuple of bool
        Whether the run had left the card's range before the figure was reached.
    differences : tuple of float or None
        Each card but the reference less the reference.
    differences_standard_errors : tuple of float or None
        The same over the root of both variances.
    """

    values: tuple[float | None, ...]
    standard_deviations: tuple[float | None, ...]
    outside_card_range: tuple[bool, ...]
    differences: tuple[float | None, ...]
    differences_standard_errors: tuple[float | None, ...]


@dataclass(frozen=True, eq=False, kw_only=True)
class TrialComparison:
    """A standard trial by all cards: figures by name with their unit, and tracks."""

    name: str
    figures: dict[str, ComparedFigure]
    tracks: tuple[CardTrack, ...]


@dataclass(frozen=True, kw_only=True)
class ComparedCard:
    """A card: its label, the name of its ship, the source of its numbers, and whether all their standard errors are
    assumed."""

    label: str
    ship: str
    source: str
    assumed_errors: bool = False


@dataclass(frozen=True, kw_only=True)
class CardSummary:
    """Coefficients of a card next to the reference's.

    Parameters
    ----------
    card : str
        Label.
    compared : int
        Coefficients compared in standard errors.
    same_number : int
        Coefficients identical to the reference's; they are not compared.
    beyond_two_standard_errors : int
        Coefficients that differ by more than :data:`.BEYOND_STANDARD_ERRORS`.
    rms_standard_errors : float or None
        Root mean square of the differences: 1 if they are by chance; None without any.
    """

    card: str
    compared: int
    same_number: int
    beyond_two_standard_errors: int
    rms_standard_errors: float | None


@dataclass(frozen=True, eq=False, kw_only=True)
class CardComparison:
    """Comparison of cards; the first is the reference.

    Parameters
    ----------
    summary : tuple of CardSummary
        One for each card but the reference.
    coefficients, effects : tuple of CoefficientRow
        Coefficients in the reference's convention (those of craft in SI), and parameters of effects and thrusters, SI.
    craft : bool
        Whether thrusters steer all of them.
    members : int
        Size of the ensembles behind the deviations of the figures.
    kind : str
        Always ``compare``.
    drawn : tuple of DrawnShips or None
        Members of each card, with figures at the size of the reference; not part of the JSON.
    """

    cards: tuple[ComparedCard, ...]
    summary: tuple[CardSummary, ...]
    coefficients: tuple[CoefficientRow, ...]
    effects: tuple[CoefficientRow, ...]
    trials: tuple[TrialComparison, ...]
    craft: bool
    members: int
    notices: tuple[Notice, ...]
    kind: str = "compare"
    drawn: Annotated[Any, Field(exclude=True)] = ()

    @property
    def rows(self) -> tuple[CoefficientRow, ...]:
        """Coefficients and parameters of effects."""
        return (*self.coefficients, *self.effects)


def compare_cards(cards: Sequence[SteeredCard], count: int = VALIDATION_MEMBERS) -> CardComparison:
    """Compare cards of a ship, or of ships and models of the same form, at the size of the first, the reference.

    Parameters
    ----------
    cards : sequence of SteeredCard
        Two or more.
    count : int
        Members of the ensemble behind each figure's deviation; 0 for none.

    Raises
    ------
    InputError
        There is only one card, ships and craft are mixed, or craft are not of one size.
    """
    if len(cards) < 2:
        raise InputError("CARD", "", "is one alone", "give two cards or more; the first is the reference")
    steered_by = _refuse_unlike(cards)
    labels = labels_of(cards)
    ships = [ship_of(card) for card in cards]
    rows, notes = compare_coefficients(cards)
    effects = compare_effects(cards, [ship.model for ship in ships])
    drawn = [members(ship.card, ship.model, count) for ship in ships]
    draws = [each for each, _ in drawn]
    trials = [_trial(name, one, ships, labels, draws) for name, one in standard_trials(ships).items()]
    notices = [
        *_notices(cards, labels),
        *(message.of(label) for label, (_, messages) in zip(labels, drawn, strict=True) for message in messages),
        *notes,
        *(trouble for _, troubles, _ in trials for trouble in troubles),
    ]
    return CardComparison(
        cards=tuple(
            ComparedCard(label=label, ship=card.ship.name, source=card.ship.source)
            for label, card in zip(labels, cards, strict=True)
        ),
        summary=tuple(_summary(label, place, (*rows, *effects)) for place, label in enumerate(labels[1:])),
        coefficients=rows,
        effects=effects,
        trials=tuple(trial for trial, *_ in trials),
        craft=steered_by is SteeredBy.THRUSTERS,
        members=count,
        notices=tuple(dict.fromkeys(notices)),
        drawn=tuple(_drawn(card, trials, place) for place, card in enumerate(cards)),
    )


def _drawn(
    card: SteeredCard, trials: Sequence[tuple[TrialComparison, list[Notice], list[Sequence[Numbers]]]], place: int
) -> DrawnShips | None:
    """The members of a card, which has its place in each trial, with their figures; None without members."""
    return drawn_ships(card, {trial.name: by_card[place] for trial, _, by_card in trials})


def _summary(label: str, place: int, rows: Sequence[CoefficientRow]) -> CardSummary:
    """Summary of a card by the place of its differences."""
    differences = [row.differences[place] for row in rows]
    known = [one.standard_errors for one in differences if one.standard_errors is not None]
    return CardSummary(
        card=label,
        compared=len(known),
        same_number=sum(one.why == SAME for one in differences),
        beyond_two_standard_errors=sum(abs(difference) > BEYOND_STANDARD_ERRORS for difference in known),
        rms_standard_errors=math.sqrt(sum(difference**2 for difference in known) / len(known)) if known else None,
    )


def _refuse_unlike(cards: Sequence[SteeredCard]) -> SteeredBy:
    """What steers all cards; ships next to craft, and craft of several sizes, are refused."""
    first = cards[0]
    for card in cards:
        if card.steered_by is not first.steered_by:
            remedy = "compare craft with craft, and ships with ships"
            raise card.fault("model.kind", f"is steered by {card.steered_by}, and another card is not", remedy)
        length, reference = card.ship.length_m, first.ship.length_m
        one_size = card.steered_by is SteeredBy.RUDDER or math.isclose(length, reference, rel_tol=SAME_SIZE)
        if not one_size:
            problem = f"is {length:g} m, and {first.source} has {reference:g} m"
            raise card.fault("ship.length_m", problem, "compare cards of one craft")
    return first.steered_by


def labels_of(cards: Sequence[SteeredCard]) -> tuple[str, ...]:
    """Label of each card: stem of its file, or name of its folder for a bundled one, with a number for duplicates."""
    stems = []
    for card in cards:
        path = Path(card.source)
        stems.append(path.resolve().parent.name or path.stem if path.name == "ship.toml" else path.stem)
    doubled = {stem for stem in stems if stems.count(stem) > 1}
    return tuple(f"{stem} ({place + 1})" if stem in doubled else stem for place, stem in enumerate(stems))


def differences_of_size(first: SteeredCard, second: SteeredCard, scale: float = 1.0) -> list[str]:
    """Length and breadth of two ships that differ by :data:`SAME_SIZE` or more; `scale` belongs to `first`.

    Parameters
    ----------
    scale : float
        Factor on the sizes of `first`.
    """
    found = []
    for what, size, reference in (
        ("length", first.ship.length_m, second.ship.length_m),
        ("breadth", first.ship.beam_m, second.ship.beam_m),
    ):
        if size is not None and reference is not None and not math.isclose(size * scale, reference, rel_tol=SAME_SIZE):
            found.append(f"{what} {reference:.4g} m, and not {size * scale:.4g} m")
    return found


def scaled_number(name: str, value: float, length_ratio: float) -> float:
    """A figure at another size by Froude's law: lengths by the ratio, times and speeds by its root, rates by 1/root."""
    root = math.sqrt(length_ratio)
    return value * {"m": length_ratio, "s": root, "mps": root, "degps": 1 / root}.get(name.rpartition("_")[2], 1.0)


@dataclass(frozen=True, eq=False, kw_only=True)
class _Sailed:
    """A trial by one card at the reference's size: figures, deviations, those outside the range, track, members."""

    figures: Numbers = field(default_factory=dict)
    deviations: Numbers = field(default_factory=dict)
    outside: tuple[str, ...] = ()
    track: CardTrack | None = None
    messages: Sequence[Notice] = ()
    drawn: Sequence[Numbers] = ()


def _trial(
    name: str,
    manoeuvre: Manoeuvre,
    ships: Sequence[TrialShip],
    labels: Sequence[str],
    drawn: Sequence[Sequence[Mapping[str, float]]],
) -> tuple[TrialComparison, list[Notice], list[Sequence[Numbers]]]:
    reference = ships[0].card
    sailed = [
        _sailed(manoeuvre, ship, reference, label, draws)
        for ship, label, draws in zip(ships, labels, drawn, strict=True)
    ]
    names = dict.fromkeys(figure for one in sailed for figure in one.figures)
    figures = {figure: _compared(figure, sailed) for figure in names}
    messages = [notice.of(name).of(label) for one, label in zip(sailed, labels, strict=True) for notice in one.messages]
    tracks = tuple(one.track for one in sailed if one.track)
    return TrialComparison(name=name, figures=figures, tracks=tracks), messages, [one.drawn for one in sailed]


def _sailed(
    manoeuvre: Manoeuvre, ship: TrialShip, reference: SteeredCard, label: str, draws: Sequence[Mapping[str, float]]
) -> _Sailed:
    ratio, start = reference.ship.length_m / ship.card.ship.length_m, _start(reference, ship.card)
    run = ship.run(manoeuvre, start)
    if isinstance(run, str):
        return _Sailed(messages=[Notice(run)])
    drawn = [_scaled(figures, ratio) for figures in ship.member_figures(manoeuvre, draws, start)]
    return _Sailed(
        figures=_scaled(figure_numbers(run.figures), ratio),
        deviations=member_spread(drawn),
        drawn=drawn,
        outside=run.reading.outside_names,
        track=_track(label, run.trajectory, ratio),
        messages=[*run.reading.notices, *run.missing],
    )


def _compared(figure: str, sailed: Sequence[_Sailed]) -> ComparedFigure:
    values = np.array([one.figures.get(figure, math.nan) for one in sailed])
    deviations = np.array([one.deviations.get(figure, math.nan) for one in sailed])
    differences, both = values[1:] - values[0], np.hypot(deviations[1:], deviations[0])
    in_errors = np.divide(differences, both, out=np.full(len(both), math.nan), where=both > 0)
    return ComparedFigure(
        values=_known(values),
        standard_deviations=_known(deviations),
        outside_card_range=tuple(figure in one.outside for one in sailed),
        differences=_known(differences),
        differences_standard_errors=_known(in_errors),
    )


def _known(values: Array) -> tuple[float | None, ...]:
    return tuple(None if math.isnan(value) else value for value in values.tolist())


def _start(reference: SteeredCard, card: SteeredCard) -> dict[str, float]:
    """Start at the reference's speed at the size of the card's ship, m/s; at the card's own if both are equal except
    for rounding. A craft starts at its own cruising speed or at rest."""
    if card.steered_by is SteeredBy.THRUSTERS:
        return {}
    speed = reference.model.speed_mps * math.sqrt(card.ship.length_m / reference.ship.length_m)
    return {"initial.u": card.model.speed_mps if math.isclose(speed, card.model.speed_mps, rel_tol=1e-6) else speed}


def _scaled(figures: Numbers, ratio: float) -> Numbers:
    return {name: scaled_number(name, value, ratio) for name, value in figures.items()}


def _track(label: str, run: Trajectory, ratio: float) -> CardTrack:
    # To the same course: a card's ship may start at rest on another heading only by its file, never here.
    x, y = run["motion.x"] - run["motion.x"][0], run["motion.y"] - run["motion.y"][0]
    every = max(1, len(x) // _TRACK_POINTS)
    time = np.sqrt(ratio) * run.t
    return CardTrack(card=label, t_s=time[::every], x_m=ratio * x[::every], y_m=ratio * y[::every])


def _notices(cards: Sequence[SteeredCard], labels: Sequence[str]) -> list[Notice]:
    named = list(zip(cards, labels, strict=True))
    found = [doubt.of(label) for card, label in named for doubt in doubts(card)]
    return found + [
        notice.of(label)
        for card, label in named
        for notice in (
            *_about_size(card, cards[0], labels[0]),
            *_about_errors(card),
            *_about_trials(card, cards[0]),
        )
    ]


def _about_size(card: SteeredCard, reference: SteeredCard, label: str) -> list[Notice]:
    ratio = reference.ship.length_m / card.ship.length_m
    if apart := differences_of_size(reference, card, 1 / ratio):
        form = "; ".join(apart)
        return [Notice(f"is of another form than {label} (at its size {form}): two ships are compared")]
    if math.isclose(ratio, 1.0, rel_tol=SAME_SIZE):
        return []
    return [Notice(f"is of another size than {label}: ships or models of one form are compared")]


def _about_errors(card: SteeredCard) -> list[Notice]:
    present = [name for name, value in card.derivatives.items() if value]
    assumed = [name for name in present if name not in card.uncertainty]
    if not assumed:
        return []
    share = f"{100 * DEFAULT_RELATIVE_ERROR:g} % of their value is taken"
    text = f"{len(assumed)} derivatives state no standard error: {share}"
    return [caution(f"standard errors are ASSUMED: {text}") if assumed == present else Notice(text)]


def _about_trials(card: SteeredCard, reference: SteeredCard) -> list[Notice]:
    """What differs in the trials: size, speed, effects and engine."""
    ratio = reference.ship.length_m / card.ship.length_m
    speed = _start(reference, card).get("initial.u", card.model.speed_mps)
    effects, expected = (sorted(effect.name for effect in ship.effects) for ship in (card, reference))
    texts = {
        f"figures and tracks scaled by Froude's law to a ship {ratio:.4g} times as long": not math.isclose(
            ratio, 1.0, rel_tol=1e-6
        ),
        f"its trials begin at the reference's speed, {speed:.4g} m/s at its own size": not math.isclose(
            speed, card.model.speed_mps, rel_tol=1e-3
        ),
        f"its effects ({', '.join(effects) or 'none'}) are not the reference's ({', '.join(expected) or 'none'}); the "
        "trials have them": effects != expected,
        "only one of it and the reference has propulsion: no stop is compared": (card.propulsion is None)
        != (reference.propulsion is None),
    }
    return [Notice(text) for text, holds in texts.items() if holds]
