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
from tank2sim.analysis.guess.conditioning import FIGURE_KEYS, FIGURES, GivenFigure, GuessMembers, conditioned
from tank2sim.analysis.guess.prior import ShipDimensions, prior_card
from tank2sim.arrays import Array
from tank2sim.cards import ManoeuvringCard, parse_card
from tank2sim.dynamics.card_parameters import CardParameter, card_parameters, study_model
from tank2sim.errors import InputError
from tank2sim.marks import CHECK
from tank2sim.simulation.bands import QUANTILES

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


@dataclass(frozen=True, eq=False)
class Guess:
    """A guessed ship.

    Parameters
    ----------
    ship : ShipDimensions
    given : tuple of GivenFigure
    found : GuessMembers
        The members before and after.
    prior, card : ManoeuvringCard
        The cards by the dimensions alone, and with the figures; the latter has a covariance with samples.
    members, seed : int
    """

    ship: ShipDimensions
    given: tuple[GivenFigure, ...]
    found: GuessMembers
    prior: ManoeuvringCard
    card: ManoeuvringCard
    members: int
    seed: int

    @property
    def notices(self) -> tuple[str, ...]:
        """Limits of the guess."""
        lost = self.members - len(self.found.prior)
        messages = [*self._outside()]
        messages += [
            "a guess: the model (third order, cross-flow drag, rudder in the slipstream), deep and calm water, and "
            "figures of one loading are taken for granted",
            "rudder, surge and third-order terms have no published regression here: their prior is about what three "
            "ships have",
        ]
        if lost:
            messages.append(f"{lost} of {self.members} ships of these dimensions do not come round and were left out")
        errors = [figure for figure in self.given if figure.standard_error == default_error(figure.word, figure.value)]
        if errors:
            messages.append(
                f"standard errors of figures given without: {100 * TRIAL_ERROR:g} % of distances, "
                f"{OVERSHOOT_ERROR_DEG:g} deg of overshoots"
            )
        return tuple(messages)

    def _outside(self) -> Iterator[str]:
        """Figures outside what nine of ten ships of these dimensions show, or the guess, by more than their errors."""
        for figure in self.given:
            before, after = (_quantiles(figures[figure.key]) for figures in (self.found.before, self.found.after))
            error = figure.standard_error
            if all(each["p5"] - error <= figure.value <= each["p95"] + error for each in (before, after)):
                continue
            unit = figure_unit(figure.key)
            units = [
                f"if that is in {name}: {figure.value * factor:.4g} {unit}"
                for name, factor in _OTHER_UNITS[unit].items()
                if before["p5"] <= figure.value * factor <= before["p95"]
            ]
            yield (
                f"{CHECK} {figure.key} is {figure.value:g} {unit}, and nine of ten ships of these dimensions and speed "
                f"have {before['p5']:.4g} to {before['p95']:.4g} (the guess {after['p5']:.4g} to {after['p95']:.4g})"
                f"{'; ' + ', '.join(units) if units else '; check it, the dimensions and the speed'}."
            )

    def as_json(self) -> dict[str, object]:
        """The JSON form."""
        given = {figure.key: figure for figure in self.given}
        figures = {}
        for key in FIGURE_KEYS:
            entry = given.get(key)
            figures[key] = {
                "unit": figure_unit(key),
                "given": entry and entry.value,
                "standard_error": entry and entry.standard_error,
                "by_dimensions": _quantiles(self.found.before[key]),
                "found": _quantiles(self.found.after[key]),
            }
        return {
            "ship": self.card.ship.name,
            "dimensions": vars(self.ship),
            "members": self.members,
            "seed": self.seed,
            "figures": figures,
            "parameters": {name: dict(zip(_NUMBERS, row, strict=True)) for name, row in self.parameters.items()},
            "next_figures": self.next_figures,
        }

    @property
    def parameters(self) -> dict[str, tuple[float, float, float, float, bool]]:
        """Name to mean and standard error by the dimensions alone, with the figures, and whether they settle it."""
        rows = {}
        for name, before, after in zip(self.found.draws.names, self.found.prior.T, self.found.posterior.T, strict=True):
            errors = float(before.std()), float(after.std())
            numbers = float(before.mean()), errors[0], float(after.mean()), errors[1]
            rows[name.removeprefix("derivatives.")] = (*numbers, errors[1] < SETTLED * errors[0])
        return rows

    @property
    def next_figures(self) -> dict[str, float]:
        """Figures not given, to the mean share of the variance of all figures not given that each would take away, with
        the errors of those given without; the most helpful first. By the covariance of the logarithms."""
        known = {figure.key for figure in self.given}
        keys = [key for key in FIGURE_KEYS if key not in known]
        logs = {key: np.log(self.found.after[key]) for key in keys}
        gains = {}
        for key in keys:
            median = float(np.median(self.found.after[key]))
            error = default_error(FIGURE_KEYS[key][1], median) / median
            variance = float(logs[key].var()) + error**2
            shares = [float(np.cov(logs[key], other)[0, 1] ** 2 / variance / other.var()) for other in logs.values()]
            gains[key] = float(np.mean(shares))
        return dict(sorted(gains.items(), key=lambda item: -item[1]))


_NUMBERS = ("by_dimensions", "by_dimensions_standard_error", "value", "standard_error", "settled")


def figure_unit(key: str) -> str:
    """Unit of a figure by its key."""
    manoeuvre, word = FIGURE_KEYS[key]
    return FIGURES[manoeuvre][word].rpartition("_")[2]


def default_error(word: str, value: float) -> float:
    """Standard error of a figure that comes without, by the word of its option."""
    return OVERSHOOT_ERROR_DEG if word in ("first", "second") else TRIAL_ERROR * value


def parse_figures(manoeuvre: str, text: str) -> list[GivenFigure]:
    """Figures of an option: ``advance=970 tactical=980+-30``, the standard error after ``+-``.

    Raises
    ------
    InputError
        A word is not a figure of the manoeuvre or is given twice, or a number is not positive.
    """
    option, words, found = f"--{manoeuvre}", FIGURES[manoeuvre], {}
    for part in text.split():
        word, _, number = part.partition("=")
        matched = re.fullmatch(r"(\d+(?:\.\d*)?|\.\d+)(?:(?:\+-|±)(\d+(?:\.\d*)?|\.\d+))?", number)
        if word not in words or matched is None:
            example = " ".join(f"{name}=..." for name in words)
            raise InputError(option, part, "cannot be read", f"give {example}, in m or deg, with +-ERROR if known")
        if word in found:
            raise InputError(option, part, "is given twice", "give each figure once")
        value = float(matched[1])
        error = default_error(word, value) if matched[2] is None else float(matched[2])
        if value <= 0 or error <= 0:
            raise InputError(option, part, "is not positive", "figures and their standard errors are above zero")
        found[word] = GivenFigure(manoeuvre, word, value, error)
    return list(found.values())


def guess_ship(ship: ShipDimensions, given: Sequence[GivenFigure], name: str, members: int, seed: int) -> Guess:
    """A ship from its dimensions and figures.

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
        As :func:`tank2sim.analysis.guess.conditioning.conditioned`.
    """
    prior = prior_card(ship, name)
    found = conditioned(prior, given, members, seed)
    return Guess(ship, tuple(given), found, prior, _card_of(prior, found), members, seed)


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


def _quantiles(values: Array) -> Mapping[str, float]:
    low, middle, high = (float(value) for value in np.quantile(values, QUANTILES))
    return {"p5": low, "p50": middle, "p95": high}
