"""Errors of a figure that are on one side in more trials than by chance: the sign test.

A figure is validated where its error hides in its uncertainty, and a model that errs to the same side in every trial
passes each comparison. Without such an error either sign is as probable in each trial, and the number k of the rarer
sign of n errors is binomial:

    p = min(1, 2 P(K <= k)),   K ~ B(n, 1/2)

(Conover 1999, Practical Nonparametric Statistics, 3.4). The figures of turns are one family, figures of zigzags
another: their probabilities follow Holm (1979, Scand. J. Statist. 6) over the figures of the family whose number of
trials can reach the level at all (Tarone 1990, Biometrics 46).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.stats import binom

from tank2sim.notices import Notice, caution
from tank2sim.units import in_words

SIGN_LEVEL = 0.05
"""Probability, after correction, below which a one-sided error is reported."""


class FigureError(Protocol):
    """A measured figure of a trial with the error of its simulation."""

    @property
    def name(self) -> str:
        """Figure with its unit."""

    @property
    def measured(self) -> float:
        """As measured."""

    @property
    def error(self) -> float | None:
        """Simulated less measured; None where the simulation did not reach it."""


@dataclass(frozen=True, kw_only=True)
class OneSidedError:
    """A figure that is simulated too large, or too small, in nearly all trials.

    Parameters
    ----------
    name : str
        Figure with its unit.
    trials, same_side : int
        Trials with an error, and those with an error on the commoner side.
    mean_error : float
        Mean of simulated less measured, in the unit of the name.
    mean_percent : float
        The same in per cent of the mean measured figure.
    sign_probability : float
        Two-sided probability of the sign test, for this figure alone.
    probability : float
        The same corrected for the number of figures (Holm).
    """

    name: str
    trials: int
    same_side: int
    mean_error: float
    mean_percent: float
    sign_probability: float
    probability: float

    @property
    def notice(self) -> Notice:
        """The finding in a sentence."""
        words, unit = in_words(self.name)
        side = "large" if self.mean_error > 0 else "small"
        size = f"{self.mean_error:+.3g} {unit}".rstrip()
        return caution(
            f"{words} is simulated too {side} in {self.same_side} of {self.trials} trials, on average by {size} "
            f"({self.mean_percent:+.2g} %): by chance with a probability of {self.probability:.2g} (sign test, Holm). "
            "Single comparisons do not show it"
        )


def one_sided_errors(figures: Sequence[FigureError], families: Sequence[Sequence[str]]) -> tuple[OneSidedError, ...]:
    """The figures with errors to one side, the most significant first.

    Parameters
    ----------
    figures : sequence of FigureError
        Of all trials; those without an error, or with an error of zero, are left out.
    families : sequence of sequence of str
        Names of the figures that are corrected for together.
    """
    found = [error for names in families for error in _of_family(figures, names)]
    return tuple(sorted(found, key=lambda error: error.probability))


def _of_family(figures: Sequence[FigureError], names: Sequence[str]) -> list[OneSidedError]:
    groups = {
        name: [(figure.error, figure.measured) for figure in figures if figure.name == name and figure.error]
        for name in names
    }
    possible = _testable({name: len(errors) for name, errors in groups.items()})
    alone = {name: _sign_probability(np.array(groups[name])[:, 0]) for name in possible}
    found, least = [], 0.0
    for rank, name in enumerate(sorted(alone, key=lambda each: alone[each])):
        least = max(least, min(1.0, (len(alone) - rank) * alone[name]))
        errors, measured = np.array(groups[name]).T
        above, mean, size = int(np.sum(errors > 0)), float(np.mean(errors)), abs(float(np.mean(measured)))
        if least >= SIGN_LEVEL or mean * (2 * above - len(errors)) <= 0:  # one error outweighs the others
            continue
        found.append(
            OneSidedError(
                name=name,
                trials=len(errors),
                same_side=max(above, len(errors) - above),
                mean_error=mean,
                mean_percent=100 * mean / size if size else math.nan,
                sign_probability=alone[name],
                probability=least,
            )
        )
    return found


def _sign_probability(errors: np.ndarray) -> float:
    """Two-sided probability of so few errors of the rarer sign."""
    above = int(np.sum(errors > 0))
    return min(1.0, 2 * float(binom.cdf(min(above, len(errors) - above), len(errors), 0.5)))


def _testable(counts: Mapping[str, int]) -> list[str]:
    """Figures with trials enough to reach the level, corrected for as many as there are of them (Tarone)."""
    for number in range(1, len(counts) + 1):
        able = [name for name, count in counts.items() if number * 2.0 ** (1 - count) < SIGN_LEVEL]
        if len(able) <= number:
            return able
    return []
