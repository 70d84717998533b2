"""Comparison of cards of a ship: by coefficient, and by their figures in the standard trials."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from tank2sim.analysis.validation.coefficients import (
    BEYOND_STANDARD_ERRORS,
    SAME,
    CoefficientRow,
    compare_coefficients,
    compare_craft,
    compare_effects,
)
from tank2sim.analysis.validation.standard_trials import (
    MEMBERS,
    TrialShip,
    figure_numbers,
    member_spread,
    members,
    ship_of,
    standard_trials,
)
from tank2sim.arrays import Array
from tank2sim.cards.card import DEFAULT_RELATIVE_ERROR, CraftCard, ManoeuvringCard, SteeredCard
from tank2sim.cards.examination import doubts
from tank2sim.errors import InputError
from tank2sim.marks import ASSUMED, EXTRAPOLATED
from tank2sim.simulation.card_range import Numbers
from tank2sim.simulation.manoeuvres import Manoeuvre
from tank2sim.simulation.run import Run
from tank2sim.simulation.trajectory import Trajectory

SAME_SIZE = 0.03
"""Lengths and breadths that differ by less than this share are of the same ship: definitions differ. Project choice."""


@dataclass(frozen=True, eq=False)
class CardTrack:
    """The path of a card's ship in a trial, at the reference's size: s, m."""

    label: str
    time_s: Array
    x_m: Array
    y_m: Array


@dataclass(frozen=True)
class FigureRow:
    """A figure by all cards at the reference's size.

    Parameters
    ----------
    name : str
        With its unit.
    values, deviations : tuple of float or None
        One for each card, the reference first; None where the run did not show it, or its error is unknown.
    outside : tuple of bool
        True where the run had left the card's range before the figure was reached.
    """

    name: str
    values: tuple[float | None, ...]
    deviations: tuple[float | None, ...]
    outside: tuple[bool, ...] = ()

    def difference(self, place: int) -> float | None:
        """A card's figure less the reference's."""
        value, first = self.values[place], self.values[0]
        return None if value is None or first is None else value - first

    def in_errors(self, place: int) -> float | None:
        """The difference over the root of both variances."""
        apart, deviation, first = self.difference(place), self.deviations[place], self.deviations[0]
        if apart is None or deviation is None or first is None or not math.hypot(deviation, first):
            return None
        return apart / math.hypot(deviation, first)


@dataclass(frozen=True, eq=False)
class TrialComparison:
    """A standard trial by all cards: figures, tracks, and errors."""

    name: str
    figures: tuple[FigureRow, ...]
    tracks: tuple[CardTrack, ...]


@dataclass(frozen=True, eq=False)
class CardComparison:
    """Comparison of cards; the first is the reference.

    Parameters
    ----------
    labels, ships, sources : tuple of str
        Label of each card, its ship, and the source of its numbers.
    coefficients, effects : tuple of CoefficientRow
        Coefficients in the reference's convention (of craft SI), and parameters of the effects and thrusters, SI.
    trials : tuple
    members : int
        Size of the ensembles behind the deviations of the figures.
    notices : tuple of str
    """

    labels: tuple[str, ...]
    ships: tuple[str, ...]
    sources: tuple[str, ...]
    coefficients: tuple[CoefficientRow, ...]
    effects: tuple[CoefficientRow, ...]
    trials: tuple[TrialComparison, ...]
    members: int
    notices: tuple[str, ...] = field(default=())

    @property
    def rows(self) -> tuple[CoefficientRow, ...]:
        """Coefficients and parameters of effects."""
        return (*self.coefficients, *self.effects)

    def in_errors(self, place: int) -> tuple[float, ...]:
        """Differences of a card (1 is the first after the reference) in standard errors, except for :data:`.SAME`."""
        found = [row.differences[place - 1].standard_errors for row in self.rows]
        return tuple(difference for difference in found if difference is not None)

    def same(self, place: int) -> int:
        """Number of coefficients of a card that are identical to the reference's."""
        return sum(row.differences[place - 1].why == SAME for row in self.rows)

    def beyond(self, place: int) -> int:
        """Number of coefficients that differ by more than :data:`.BEYOND` standard errors."""
        return sum(abs(difference) > BEYOND_STANDARD_ERRORS for difference in self.in_errors(place))

    def rms(self, place: int) -> float | None:
        """Root mean square of the differences in standard errors: 1 if they are by chance."""
        found = self.in_errors(place)
        return math.sqrt(sum(difference**2 for difference in found) / len(found)) if found else None

    def as_json(self) -> dict[str, object]:
        """All values; tracks thinned to 200 points."""
        columns = range(1, len(self.labels))
        return {
            "kind": "compare",
            "cards": [
                {"label": label, "ship": ship, "source": source}
                for label, ship, source in zip(self.labels, self.ships, self.sources, strict=True)
            ],
            "summary": [
                {
                    "card": self.labels[place],
                    "compared": len(self.in_errors(place)),
                    "same_number": self.same(place),
                    "beyond_two_standard_errors": self.beyond(place),
                    "rms_standard_errors": self.rms(place),
                }
                for place in columns
            ],
            "coefficients": [row.as_json() for row in self.coefficients],
            "effects": [row.as_json() for row in self.effects],
            "trials": [self._trial_json(trial) for trial in self.trials],
            "members": self.members,
            "notices": list(self.notices),
        }

    def _trial_json(self, trial: TrialComparison) -> dict[str, object]:
        columns = range(1, len(self.labels))
        return {
            "name": trial.name,
            "figures": {
                row.name: {
                    "values": list(row.values),
                    "standard_deviations": list(row.deviations),
                    "outside_card_range": list(row.outside),
                    "differences": [row.difference(place) for place in columns],
                    "differences_standard_errors": [row.in_errors(place) for place in columns],
                }
                for row in trial.figures
            },
            "tracks": [
                {
                    "card": track.label,
                    **{
                        name: values[:: max(1, len(values) // 200)]
                        for name, values in (("t_s", track.time_s), ("x_m", track.x_m), ("y_m", track.y_m))
                    },
                }
                for track in trial.tracks
            ],
        }


def compare_cards(cards: Sequence[SteeredCard], count: int = MEMBERS) -> CardComparison:
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
    craft = _craft_of(cards)
    labels = labels_of(cards)
    ships = [ship_of(card) for card in cards]
    if craft:
        rows, notes = compare_craft(craft), tuple[str, ...]()
    else:
        rows, notes = compare_coefficients([card for card in cards if isinstance(card, ManoeuvringCard)])
    drawn = [members(ship.card, ship.model, count) for ship in ships]
    messages = [f"{label}: {message}" for label, (_, notes) in zip(labels, drawn, strict=True) for message in notes]
    notices, trials = [*_notices(cards, labels), *messages, *notes], []
    for name, manoeuvre in standard_trials(ships).items():
        trial, trouble = _trial(name, manoeuvre, ships, labels, [draws for draws, _ in drawn])
        trials.append(trial)
        notices += trouble
    names = tuple(card.ship.name for card in cards)
    sources = tuple(card.ship.source for card in cards)
    unique = tuple(dict.fromkeys(notices))
    effects = compare_effects(cards, [ship.model for ship in ships])
    return CardComparison(labels, names, sources, rows, effects, tuple(trials), count, unique)


def _craft_of(cards: Sequence[SteeredCard]) -> list[CraftCard]:
    """The cards, if they are of craft of one size; none of ships; a mixture is refused."""
    craft = [card for card in cards if isinstance(card, CraftCard)]
    for card in cards if craft else ():
        if isinstance(card, ManoeuvringCard):
            remedy = "compare craft with craft, and ships with ships"
            raise InputError(card.source, "model.kind", "is of a ship with a rudder, and another card is not", remedy)
        length, reference = card.ship.length_m, craft[0].ship.length_m
        if not math.isclose(length, reference, rel_tol=SAME_SIZE):
            problem = f"is {length:g} m, and that of {craft[0].source} {reference:g} m"
            raise InputError(card.source, "ship.length_m", problem, "compare cards of one craft")
    return craft


def labels_of(cards: Sequence[SteeredCard]) -> tuple[str, ...]:
    """Label of each card: its file's stem, or that of its folder for a bundled one, with a number for duplicates.

    Parameters
    ----------
    cards : sequence of SteeredCard
    """
    stems = []
    for card in cards:
        path = Path(card.source)
        stems.append(path.resolve().parent.name or path.stem if path.name == "ship.toml" else path.stem)
    doubled = {stem for stem in stems if stems.count(stem) > 1}
    return tuple(f"{stem} ({place + 1})" if stem in doubled else stem for place, stem in enumerate(stems))


def differences_of_size(first: SteeredCard, second: SteeredCard, scale: float = 1.0) -> list[str]:
    """Length and breadth of two ships that differ by :data:`SAME_SIZE` or more; `scale` is that of `first`.

    Parameters
    ----------
    first, second : SteeredCard
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


def _trial(
    name: str,
    manoeuvre: Manoeuvre,
    ships: Sequence[TrialShip],
    labels: Sequence[str],
    drawn: Sequence[Sequence[Mapping[str, float]]],
) -> tuple[TrialComparison, list[str]]:
    reference = ships[0].card
    found: list[Numbers] = []
    deviations: list[Numbers] = []
    outside: list[set[str]] = []
    tracks, messages = [], []
    for ship, label, draws in zip(ships, labels, drawn, strict=True):
        ratio = reference.ship.length_m / ship.card.ship.length_m
        start = _start(reference, ship.card)
        run = ship.run(manoeuvre, start)
        if isinstance(run, str):
            messages.append(f"{label}: {name}: {run}")
            found.append({})
            deviations.append({})
            outside.append(set())
            continue
        messages += [
            f"{label}: {name}: {notice}" for notice in run.notices if EXTRAPOLATED in notice or "not show" in notice
        ]
        outside.append(set(run.reading.outside_names))
        found.append(_scaled(figure_numbers(run.figures), ratio))
        # Of each member the numbers alone are kept: the motions of a thousand would fill gigabytes.
        spread = member_spread([_numbers(ship.run(manoeuvre, {**start, **member})) for member in draws])
        deviations.append(_scaled(spread, ratio))
        tracks.append(_track(label, run.trajectory, ratio))
    names = dict.fromkeys(figure for figures in found for figure in figures)
    rows = tuple(
        FigureRow(
            name,
            tuple(figures.get(name) for figures in found),
            tuple(errors.get(name) for errors in deviations),
            tuple(name in beyond for beyond in outside),
        )
        for name in names
    )
    return TrialComparison(name, rows, tuple(tracks)), messages


def _numbers(run: Run | str) -> Numbers:
    """Figures of a run; empty for one that could not be run."""
    return {} if isinstance(run, str) else figure_numbers(run.figures)


def _start(reference: SteeredCard, card: SteeredCard) -> dict[str, float]:
    """Start at the reference's speed at the size of the card's ship, m/s; at the card's own if both are equal except
    for rounding. A craft starts at its own cruising speed or at rest."""
    if isinstance(card, CraftCard):
        return {}
    speed = reference.model.speed_mps * math.sqrt(card.ship.length_m / reference.ship.length_m)
    return {"initial.u": card.model.speed_mps if math.isclose(speed, card.model.speed_mps, rel_tol=1e-6) else speed}


def _scaled(figures: Numbers, ratio: float) -> Numbers:
    return {name: scaled_number(name, value, ratio) for name, value in figures.items()}


def _track(label: str, run: Trajectory, ratio: float) -> CardTrack:
    # To the same course: a card's ship may start at rest on another heading only by its file, never here.
    x, y = run["motion.x"] - run["motion.x"][0], run["motion.y"] - run["motion.y"][0]
    return CardTrack(label, np.sqrt(ratio) * run.t, ratio * x, ratio * y)


def _notices(cards: Sequence[SteeredCard], labels: Sequence[str]) -> list[str]:
    messages = [f"{label}: {doubt}" for card, label in zip(cards, labels, strict=True) for doubt in doubts(card)]
    reference = cards[0]
    for card, label in zip(cards, labels, strict=True):
        ratio = reference.ship.length_m / card.ship.length_m
        if apart := differences_of_size(reference, card, 1 / ratio):
            form = "; ".join(apart)
            messages.append(
                f"{label}: is of another form than {labels[0]} (at its size {form}): two ships are compared"
            )
        elif not math.isclose(ratio, 1.0, rel_tol=SAME_SIZE):
            messages.append(f"{label}: is of another size than {labels[0]}: ships or models of one form are compared")
        present = [name for name, value in card.derivatives.items() if value]
        if assumed := [name for name in present if name not in card.uncertainty]:
            mark = f"{ASSUMED}, not measured ones: " if assumed == present else ""
            share = f"{100 * DEFAULT_RELATIVE_ERROR:g} % of their value is taken"
            messages.append(f"{label}: {mark}{len(assumed)} derivatives state no standard error: {share}")
        if not math.isclose(ratio, 1.0, rel_tol=1e-6):
            messages.append(f"{label}: figures and tracks scaled by Froude's law to a ship {ratio:.4g} times as long")
        speed = _start(reference, card).get("initial.u", card.model.speed_mps)
        if not math.isclose(speed, card.model.speed_mps, rel_tol=1e-3):
            messages.append(f"{label}: its trials begin at the reference's speed, {speed:.4g} m/s at its own size")
        if _effects(card) != _effects(reference):
            effects, expected = (", ".join(_effects(ship)) or "none" for ship in (card, reference))
            messages.append(
                f"{label}: its effects ({effects}) are not the reference's ({expected}); the trials have them"
            )
        engines = [ship.propulsion is None for ship in (card, reference) if isinstance(ship, ManoeuvringCard)]
        if len(set(engines)) > 1:
            messages.append(f"{label}: only one of it and the reference has propulsion: no stop is compared")
    return messages


def _effects(card: SteeredCard) -> list[str]:
    return sorted(effect.name for effect in card.effects)
