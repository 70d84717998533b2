"""A ship guessed from dimensions and figures: its card, what the figures settle, and what is predicted."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import tomlkit

from tank2sim.analysis.ensemble.draws import by_file_name
from tank2sim.apps.guess.conditioning import FIGURE_KEYS, FIGURES, GivenFigure, GuessMembers, conditioned
from tank2sim.apps.guess.prior import SHIP_OF_MODEL_M, ShipDimensions, prior_card
from tank2sim.arrays import Array
from tank2sim.cards import ManoeuvringCard, parse_card
from tank2sim.dynamics.card_parameters import CardParameter, card_parameters, study_model
from tank2sim.errors import ArgumentError, close_name
from tank2sim.notices import Notice, caution
from tank2sim.simulation.bands import Band, band_of

TRIAL_ERROR, OVERSHOOT_ERROR_DEG = 0.05, 1.0
"""Standard errors of figures that come without: of a turn's distances relative to themselves, and of an overshoot, deg.
Project choice: what repeated sea trials differ by."""

KEPT_SAMPLES = 500
"""Members that the covariance next to the card keeps as samples. Project choice: a file of half a megabyte."""

_OTHER_UNITS = {
    "m": {"yards": 0.9144, "feet": 0.3048, "cables": 185.2, "nautical miles": 1852.0},
    "deg": {"rad": math.degrees(1.0)},
}
"""Other units of figures, in that of the guess."""

SETTLED = 0.7
"""Ratio of the standard errors of a number with and without the figures below which they settle it. Project choice:
half of its variance is gone."""


@dataclass(frozen=True, kw_only=True)
class GuessedFigure:
    """A manoeuvring figure in its `unit`: as given, with its standard error, and its bands over the ships of these
    dimensions (`by_dimensions`) and over the ships found."""

    unit: str
    given: float | None
    standard_error: float | None
    by_dimensions: Band
    found: Band


@dataclass(frozen=True, kw_only=True)
class GuessedNumber:
    """A number of the card: mean and standard error over the ships of these dimensions, and over the ships found.

    It is `settled` where the standard error falls below :data:`SETTLED` of the former one.
    """

    by_dimensions: float
    by_dimensions_standard_error: float
    value: float
    standard_error: float
    settled: bool


@dataclass(frozen=True, eq=False, kw_only=True)
class GuessStudy:
    """A guessed ship.

    Parameters
    ----------
    ship : str
        Its name.
    dimensions : dict
        Fields of :class:`.ShipDimensions`.
    members, seed : int
        Ships drawn, and the seed of the draws.
    figures : dict
        Key of :data:`.FIGURE_KEYS` to what is known of the figure.
    parameters : dict
        Name on the card to what is known of the number, prime.
    next_figures : dict
        Figures not given, to the mean share of the variance of all figures not given that each would take away; the
        most helpful first.
    notices : tuple of Notice
    """

    ship: str
    dimensions: dict[str, float]
    members: int
    seed: int
    figures: dict[str, GuessedFigure]
    parameters: dict[str, GuessedNumber]
    next_figures: dict[str, float]
    notices: tuple[Notice, ...]


def figure_unit(key: str) -> str:
    """Unit of a figure by its key."""
    return FIGURE_KEYS[key][1].rpartition("_")[2]


def default_error(name: str, value: float) -> float:
    """Standard error of a figure (``advance_m``) that comes without."""
    return OVERSHOOT_ERROR_DEG if name.startswith("overshoot") else TRIAL_ERROR * value


def parse_figures(manoeuvre: str, text: str) -> list[GivenFigure]:
    """Figures of an option: ``advance_m=970 tactical_diameter_m=980+-30``, the standard error after ``+-``.

    Raises
    ------
    InputError
        A name is not that of a figure of the manoeuvre or is given twice, or a number is not positive.
    """
    names, found = FIGURES[manoeuvre], {}
    for part in text.split():
        name, _, number = part.partition("=")
        matched = re.fullmatch(r"(\d+(?:\.\d*)?|\.\d+)(?:(?:\+-|±)(\d+(?:\.\d*)?|\.\d+))?", number)
        if name not in names:
            raise ArgumentError(manoeuvre, part, "is not a figure of this manoeuvre", close_name(name, names))
        if matched is None:
            raise ArgumentError(manoeuvre, part, "cannot be read", f"give {name}=..., with +-ERROR if known")
        if name in found:
            raise ArgumentError(manoeuvre, part, "is given twice", "give each figure once")
        value = float(matched[1])
        error = default_error(name, value) if matched[2] is None else float(matched[2])
        if value <= 0 or error <= 0:
            raise ArgumentError(manoeuvre, part, "is not positive", "figures and their standard errors are above zero")
        found[name] = GivenFigure(manoeuvre, name, value, error)
    return list(found.values())


def guess_ship(
    ship: ShipDimensions, given: Sequence[GivenFigure], name: str, members: int, seed: int
) -> tuple[GuessStudy, ManoeuvringCard]:
    """A ship from its dimensions and figures: the study, and the card, which has a covariance with samples.

    Parameters
    ----------
    ship : ShipDimensions
    given : sequence of GivenFigure
    name : str
        Name of the ship on the card.
    members : int
        Ships of the prior.
    seed : int

    Raises
    ------
    InputError
        As :func:`tank2sim.apps.guess.conditioning.conditioned`.
    """
    prior = prior_card(ship, name)
    found = conditioned(prior, given, members, seed)
    return study_members(ship, name, given, found, members, seed), _card_of(prior, found)


def study_members(
    ship: ShipDimensions, name: str, given: Sequence[GivenFigure], found: GuessMembers, members: int, seed: int
) -> GuessStudy:
    """The study of members that were found.

    Parameters
    ----------
    ship, name, given, members, seed
        As of :func:`guess_ship`.
    found : GuessMembers
    """
    by_key = {figure.key: figure for figure in given}
    figures = {}
    for key, before in found.before.items():
        figure = by_key.get(key)
        figures[key] = GuessedFigure(
            unit=figure_unit(key),
            given=figure.value if figure else None,
            standard_error=figure.standard_error if figure else None,
            by_dimensions=band_of(before),
            found=band_of(found.after[key]),
        )
    return GuessStudy(
        ship=name,
        dimensions=vars(ship),
        members=members,
        seed=seed,
        figures=figures,
        parameters=_parameters(found),
        next_figures=_next_figures(found, by_key),
        notices=(*_of_model(ship), *_outside(figures), *_notices(given, members, members - len(found.prior))),
    )


def _parameters(found: GuessMembers) -> dict[str, GuessedNumber]:
    numbers = {}
    for name, before, after in zip(found.draws.names, found.prior.T, found.posterior.T, strict=True):
        prior_error, error = float(before.std()), float(after.std())
        numbers[name.removeprefix("derivatives.")] = GuessedNumber(
            by_dimensions=float(before.mean()),
            by_dimensions_standard_error=prior_error,
            value=float(after.mean()),
            standard_error=error,
            settled=error < SETTLED * prior_error,
        )
    return numbers


def _next_figures(found: GuessMembers, given: Mapping[str, GivenFigure]) -> dict[str, float]:
    """:attr:`GuessStudy.next_figures`: by the covariance of the logarithms, each figure with its usual error."""
    logs = {key: np.log(values) for key, values in found.after.items() if key not in given}
    gains = {}
    for key, values in logs.items():
        median = float(np.median(found.after[key]))
        error = default_error(FIGURE_KEYS[key][1], median) / median
        variance = float(values.var()) + error**2
        shares = [float(np.cov(values, other)[0, 1] ** 2 / variance / other.var()) for other in logs.values()]
        gains[key] = float(np.mean(shares))
    return dict(sorted(gains.items(), key=lambda item: -item[1]))


def _outside(figures: Mapping[str, GuessedFigure]) -> Iterator[Notice]:
    """Figures outside what nine of ten ships of these dimensions show, or the guess, by more than their errors."""
    for key, figure in figures.items():
        if figure.given is None or figure.standard_error is None:
            continue
        value, error, unit = figure.given, figure.standard_error, figure.unit
        before, after = figure.by_dimensions, figure.found
        if all(band.p5 - error <= value <= band.p95 + error for band in (before, after)):
            continue
        units = [
            f"if that is in {name}: {value * factor:.4g} {unit}"
            for name, factor in _OTHER_UNITS[unit].items()
            if before.p5 <= value * factor <= before.p95
        ]
        yield (
            caution(
                f"{key} is {value:g} {unit}, and nine of ten ships of these dimensions and speed "
                f"have {before.p5:.4g} to {before.p95:.4g} (the guess {after.p5:.4g} to {after.p95:.4g})"
                f"{'; ' + ', '.join(units) if units else '; check it, the dimensions and the speed'}."
            )
        )


def _of_model(ship: ShipDimensions) -> Iterator[Notice]:
    """The scale effects and the gear that are assumed of a model."""
    if ship.scale == 1.0:
        return
    yield caution(
        f"{ship.length_m:g} m is the length of a model: the formulas were made for ships, whose friction, wake and "
        "loading of the propeller a model does not have; the rudder turns as fast as the gear of a ship of "
        f"{SHIP_OF_MODEL_M:g} m does by Froude's law, in fresh water. State the gear on the card if it is another"
    )


def _notices(given: Sequence[GivenFigure], members: int, lost: int) -> Iterator[Notice]:
    """Limits of every guess, ships that were left out, and standard errors that were assumed."""
    yield Notice(
        "a guess: the model (third order, cross-flow drag, rudder in the slipstream), deep and calm water, and "
        "figures of one loading are taken for granted"
    )
    yield Notice(
        "rudder, surge and third-order terms have no published regression here: their prior is about what three "
        "ships have"
    )
    if lost:
        yield Notice(f"{lost} of {members} ships of these dimensions do not come round and were left out")
    if any(figure.standard_error == default_error(figure.name, figure.value) for figure in given):
        yield Notice(
            f"standard errors of figures given without: {100 * TRIAL_ERROR:g} % of distances, "
            f"{OVERSHOOT_ERROR_DEG:g} deg of overshoots"
        )


def _card_of(prior: ManoeuvringCard, found: GuessMembers) -> ManoeuvringCard:
    """The prior card with means, standard errors and covariance of the members."""
    document = tomlkit.parse(prior.text)
    keys = {parameter.name: parameter for parameter in card_parameters(prior, study_model(prior))}
    chosen: list[CardParameter] = [keys[name] for name in found.draws.names]
    matrix: Array = np.cov(found.posterior.T)
    for parameter, mean, variance in zip(chosen, found.posterior.mean(axis=0), np.diag(matrix), strict=True):
        section, *rest = parameter.key.split(".")
        at: Any = document[section]
        errors: Any = document["uncertainty"]
        if section == "effects":
            effect = at[int(rest[0])]
            at, errors, rest = effect["parameters"], effect["uncertainty"], rest[2:]
        comment = at[rest[0]].trivia.comment
        at[rest[0]] = float(f"{mean * parameter.factor:.6g}")
        errors[rest[0]] = float(f"{math.sqrt(variance) * abs(parameter.factor):.5g}")
        if comment:
            at[rest[0]].comment(comment.removeprefix("#").strip())
    card = parse_card(tomlkit.dumps(document), prior.source)
    assert isinstance(card, ManoeuvringCard)
    samples = found.posterior[:KEPT_SAMPLES]
    return replace(card, covariance=by_file_name(card, found.draws.names, matrix, samples))
