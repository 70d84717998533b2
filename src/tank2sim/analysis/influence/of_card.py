"""Influence coefficients of a ship's card: K % of every number on the card on any manoeuvring figure.

By exact slopes, K = 10 c/F dF/dc, and by the 10 % difference of the paper
(:mod:`tank2sim.analysis.influence.percent`), side by side; and what the standard errors of the card make of each
figure.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tank2sim.analysis.influence.figures import Figure
from tank2sim.analysis.influence.parameters import CardParameter, agreed_by_name, standard_errors_in_words
from tank2sim.analysis.influence.percent import STEP_PERCENT, change_percent, changed_together, combined_percent
from tank2sim.analysis.influence.study import Study
from tank2sim.errors import InputError

Array = NDArray[np.float64]

CURVED = 1.5
"""A slope and a 10 % difference that differ by this factor are told: the figure bends or jumps there (ours)."""

TOLD_FROM = 0.5
"""... where either is at least so many per cent of the figure."""


@dataclass(frozen=True)
class Agreed:
    """An agreed variation: Kc % by parameter, and for each figure what the sum of Kc K / 10 foretells, by exact slopes
    and by 10 % differences, and what computing it directly gives; per cent of the figure."""

    percent: Mapping[str, float]
    foretold: tuple[float, ...]
    foretold_by_difference: tuple[float, ...]
    direct: tuple[float, ...]


@dataclass(frozen=True)
class Influence:
    """Influence coefficients of a card.

    Parameters
    ----------
    ship : str
    figures : tuple of Figure
    values : array (nf,)
        Of the figures.
    parameters : tuple of CardParameter
    slopes : array (nf, k)
        Exact slopes dF/dc.
    difference : array (nf, k)
        K % by the 10 % difference; nan where the changed ship does not show the figure, or the parameter is zero.
    agreed : Agreed or None
    notices : tuple of str
    """

    ship: str
    figures: tuple[Figure, ...]
    values: Array
    parameters: tuple[CardParameter, ...]
    slopes: Array
    difference: Array
    agreed: Agreed | None = None
    notices: tuple[str, ...] = field(default=())

    @property
    def exact(self) -> Array:
        """K % (nf, k) by exact slopes, 10 c/F dF/dc; nan where a figure is zero."""
        c = np.array([one.value for one in self.parameters])
        with np.errstate(divide="ignore", invalid="ignore"):
            found = STEP_PERCENT * c * self.slopes / self.values[:, None]
        return np.where(np.isfinite(found), found, np.nan)

    @property
    def standard_errors(self) -> Array:
        """Standard error of each figure (nf,), by the delta method with independent parameters."""
        found: Array = np.linalg.norm(self._parts, axis=1)
        return found

    @property
    def shares(self) -> Array:
        """Share (nf, k) of each parameter in the variance of each figure; 0 where that is zero."""
        variance = self.standard_errors[:, None] ** 2
        return np.divide(self._parts**2, variance, out=np.zeros_like(self._parts), where=variance > 0)

    @property
    def _parts(self) -> Array:
        errors = np.array([one.standard_error for one in self.parameters])
        found: Array = self.slopes * errors
        return found

    def as_json(self) -> dict[str, object]:
        """``influence_percent``: {figure: {parameter: {exact, difference}}}; ``figures`` with standard errors.

        Parameters have their dotted keys in the card's file, and their values as they stand there.
        """
        exact, errors, shares = self.exact, self.standard_errors, self.shares
        names = [one.key for one in self.parameters]
        rows = range(len(self.figures))
        result: dict[str, object] = {
            "ship": self.ship,
            "figures": {
                self.figures[row].text: {
                    "value": float(self.values[row]),
                    "standard_error": float(errors[row]),
                    "share_of_variance": dict(zip(names, shares[row].tolist(), strict=True)),
                }
                for row in rows
            },
            "parameters": {
                one.key: {
                    "value": one.value * one.factor,
                    "standard_error": one.standard_error * abs(one.factor),
                    "assumed": one.assumed,
                }
                for one in self.parameters
            },
            "influence_percent": {
                self.figures[row].text: {
                    name: {"exact": float(exact[row, k]), "difference": float(self.difference[row, k])}
                    for k, name in enumerate(names)
                }
                for row in rows
            },
        }
        if self.agreed:
            result["agreed"] = self._agreed_as_json(self.agreed)
        return {**result, "notices": list(self.notices)}

    def _agreed_as_json(self, agreed: Agreed) -> dict[str, object]:
        columns = zip(self.figures, agreed.foretold, agreed.foretold_by_difference, agreed.direct, strict=True)
        keys = {one.name: one.key for one in self.parameters}
        return {
            "percent": {keys[name]: percent for name, percent in agreed.percent.items()},
            "figures": {
                figure.text: {"foretold_exact": exact, "foretold_difference": difference, "direct": direct}
                for figure, exact, difference, direct in columns
            },
        }


def influence(study: Study, agreed: Mapping[str, float] | None = None) -> Influence:
    """Influence coefficients of every parameter of a card on the figures of a study.

    Parameters
    ----------
    study : Study
    agreed : mapping, optional
        An agreed variation: Kc %, by names as a user writes them.

    Raises
    ------
    InputError
        `agreed` has a name that is none of the card's parameters.
    """
    values, slopes = study.slopes_at(study.values)
    difference = _differences(study)
    whole = Influence(study.card.ship.name, study.figures, study.base, study.parameters, slopes, difference)
    together = None
    if agreed:
        together = _agreed(study, whole, agreed_by_name(agreed, study.parameters))
    told = [*study.notices, *standard_errors_in_words(study.parameters), *_not_smooth(whole)]
    told += _differing(study, values)
    return Influence(
        whole.ship, whole.figures, whole.values, whole.parameters, slopes, difference, together, tuple(told)
    )


def _differences(study: Study) -> Array:
    found = np.full((len(study.figures), len(study.values)), np.nan)
    for place, value in enumerate(study.values):
        if value == 0:
            continue
        changed = study.values.copy()
        changed[place] *= 1 + STEP_PERCENT / 100
        found[:, place] = _change(study, changed)
    return found


def _change(study: Study, values: Array) -> list[float]:
    """Change of each figure in per cent; nan where the changed ship does not show it."""
    try:
        figures = study.figures_at(values)
    except InputError:  # the changed ship leaves all bounds
        return [math.nan] * len(study.figures)
    return [change_percent(float(new), float(old)) for new, old in zip(figures, study.base, strict=True)]


def _agreed(study: Study, found: Influence, percent: Mapping[str, float]) -> Agreed:
    names = [one.name for one in study.parameters]
    values = dict(zip(names, study.values.tolist(), strict=True))
    changed = changed_together(values, percent)
    direct = _change(study, np.array([changed[name] for name in names]))

    def foretold(K: Array) -> tuple[float, ...]:
        return tuple(combined_percent(dict(zip(names, row.tolist(), strict=True)), percent) for row in K)

    return Agreed(percent, foretold(found.exact), foretold(found.difference), tuple(direct))


def _differing(study: Study, sloped: Array) -> Iterable[str]:
    """A word where the slopes are those of another value than the figure's: the event behind it is not the same."""
    for figure, one, other in zip(study.figures, study.base, sloped, strict=True):
        if not abs(one - other) <= 1e-4 * max(abs(one), 1e-3):
            yield f"{figure.text}: its slopes are not to be trusted, the manoeuvre has no clean event there"


def _not_smooth(found: Influence) -> list[str]:
    told = []
    exact = found.exact
    for row, figure in enumerate(found.figures):
        gone, bent = [], []
        for place, parameter in enumerate(found.parameters):
            slope, step = exact[row, place], found.difference[row, place]
            if parameter.value == 0 or max(abs(slope), abs(step) if math.isfinite(step) else math.inf) < TOLD_FROM:
                continue
            if not math.isfinite(step):
                gone.append(parameter.short)
            elif slope * step <= 0 or not 1 / CURVED < abs(step / slope) < CURVED:
                bent.append(parameter.short)
        if gone:
            told.append(f"{figure.text}: 10 % more of {', '.join(gone)} and the ship does not show it any more")
        if bent:
            told.append(f"{figure.text} is not smooth or strongly curved in {', '.join(bent)}: slope and 10 % disagree")
    return told
