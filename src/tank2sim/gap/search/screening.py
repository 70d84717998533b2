"""Every effect and every pair at once, from one pass of the filter at one noise.

Each effect is evaluated at one or several sizes and shapes (its *variants*); the contribution of each to the motion is
a column, or one for each of its amplitudes. With the card's coefficients projected out (Schur complement), the gain of
any set of columns follows from one Gram matrix.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, product

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from tank2sim.arrays import Array
from tank2sim.gap.inference.fit import ExplanationFit
from tank2sim.gap.inference.hypothesis import Hypothesis
from tank2sim.gap.inference.kalman_filter import observer
from tank2sim.gap.inference.likelihood import COUNTED, Likelihood

LEAST_AMPLITUDE = 0.05
"""Smallest initial size, as a share of the typical one (a search cannot begin at zero)."""


@dataclass(frozen=True, eq=False)
class Variant:
    """An effect at one size and shape.

    Parameters
    ----------
    hypothesis : Hypothesis
        The ship with this effect alone.
    theta : array (k,)
        Size and shape.
    amplitudes : tuple of int
        Indices in `theta` of the parameters that make the effect vanish; empty for an effect that replaces something.
    driving : array (R, T - 1, 6, a)
    shown : array (R, T, ny, a)
        Contribution of each amplitude at its size in `theta` (one column for an effect without amplitudes).
    """

    hypothesis: Hypothesis
    theta: Array
    amplitudes: tuple[int, ...]
    driving: Array
    shown: Array

    @property
    def effect(self) -> str:
        """Name of the effect."""
        return self.hypothesis.effects[0]

    @property
    def signs(self) -> Array:
        """Size of each column here, and whether the bounds allow less and more than zero (a, 3)."""
        places = list(self.amplitudes)
        if not places:
            return np.ones((self.driving.shape[-1], 3))
        low, high = (bound[places] for bound in self.hypothesis.bounds)
        return np.column_stack([self.theta[places], low < 0, high > 0])

    def start(self, shares: Array) -> Array:
        """Parameters to begin a search from, for amplitudes in shares of their size here (a,)."""
        theta = self.theta.copy()
        for place, share in zip(self.amplitudes, shares, strict=False):
            theta[place] *= np.sign(share or 1.0) * max(abs(share), LEAST_AMPLITUDE)
        low, high = self.hypothesis.bounds
        inside: Array = np.clip(theta, low, high)
        return inside


def variants(likelihood: Likelihood, hypothesis: Hypothesis) -> tuple[Variant, ...]:
    """An effect at each of its typical shapes.

    Parameters
    ----------
    likelihood : Likelihood
    hypothesis : Hypothesis
        With one effect.
    """
    card = likelihood.none.card
    grids = [
        estimate.parameter.typical_values(card) or (hypothesis.prior[0][place],)
        for place, estimate in enumerate(hypothesis.estimated)
    ]
    amplitudes = tuple(place for place, estimate in enumerate(hypothesis.estimated) if estimate.is_amplitude)
    return tuple(_variant(likelihood, hypothesis, np.array(theta), amplitudes) for theta in product(*grids))


def variants_at(likelihood: Likelihood, variant: Variant, shares: Sequence[float]) -> tuple[Variant, ...]:
    """A variant with its first parameter at shares of its value, where the effect's bounds allow it."""
    low, high = variant.hypothesis.bounds
    thetas = [np.concatenate([[share * variant.theta[0]], variant.theta[1:]]) for share in shares]
    inside = [theta for theta in thetas if low[0] <= theta[0] <= high[0]]
    return tuple(_variant(likelihood, variant.hypothesis, theta, variant.amplitudes) for theta in inside)


def resized(likelihood: Likelihood, variant: Variant, shares: Array) -> Variant:
    """A variant with its amplitudes multiplied by `shares` (a,), as far as the effect's bounds allow."""
    return _variant(likelihood, variant.hypothesis, variant.start(shares), variant.amplitudes)


def _variant(likelihood: Likelihood, hypothesis: Hypothesis, theta: Array, amplitudes: tuple[int, ...]) -> Variant:
    columns = []
    for amplitude in amplitudes or (None,):
        alone = theta.copy()
        for place in amplitudes:
            if place != amplitude:
                alone[place] = hypothesis.estimated[place].parameter.absent
        columns.append(likelihood.added(hypothesis, alone))
    driving, shown = (np.stack(parts, axis=-1) for parts in zip(*columns, strict=True))
    return Variant(hypothesis, theta, amplitudes, driving, shown)


@dataclass(frozen=True, eq=False)
class Screened:
    """A set of effects as the screen sees it.

    Parameters
    ----------
    thetas : mapping
        Effect to its parameters to begin a search from.
    gain : float
        Decrease of the score, after the penalty of the parameters.
    """

    thetas: dict[str, Array]
    gain: float

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the effects."""
        return tuple(self.thetas)


class Screen:
    """Gain of each set of variants, at one noise.

    Attributes
    ----------
    cost : float
        Score of `base` at this noise, except for a constant.

    Parameters
    ----------
    likelihood : Likelihood
    base : ExplanationFit
        The fit that gives the motion and the noise: "none", or the effects that are assumed present.
    every : sequence of Variant
    """

    def __init__(self, likelihood: Likelihood, base: ExplanationFit, every: Sequence[Variant]):
        self.likelihood = likelihood
        self.every = tuple(variant for variant in every if variant.effect not in base.hypothesis.effects)
        assumed = base.hypothesis
        self._linear = likelihood.linear(assumed, base.theta) if assumed.effects else likelihood.base
        self._columns = columns = likelihood.columns(assumed, base.theta, likelihood.coefficient_columns)
        self._driving = np.concatenate([columns.driving, *(variant.driving for variant in self.every)], axis=-1)
        of_coefficients = np.zeros((*columns.shown.shape[:-1], columns.driving.shape[-1] - columns.shown.shape[-1]))
        of_variants = [-variant.shown for variant in self.every]
        self._shown = np.concatenate([columns.shown, of_coefficients, *of_variants], axis=-1)
        widths = [variant.driving.shape[-1] for variant in self.every]
        ends = 1 + np.cumsum(widths)
        self.places = [np.arange(end - width, end) for end, width in zip(ends, widths, strict=True)]
        price = np.log(likelihood.count / COUNTED)
        self._prices = [np.count_nonzero(variant.hypothesis.prior[1] == 0) * price for variant in self.every]
        signs = [np.zeros((1, 3))] + [variant.signs for variant in self.every]
        self._size, negative, positive = np.concatenate(signs).T
        self._negative, self._positive = negative > 0, positive > 0
        self._project(base)

    def at(self, noisy: ExplanationFit) -> Screen:
        """The same at another noise and width.

        Parameters
        ----------
        noisy : ExplanationFit
            With the same effects and sizes as the base.
        """
        other = copy(self)
        other.__dict__.pop("_alone", None)
        other._project(noisy)
        return other

    def _project(self, base: ExplanationFit) -> None:
        """Gram matrix of residual and variants at the noise of a fit, what is assumed projected out, and its cost."""
        likelihood, columns, assumed = self.likelihood, self._columns, base.hypothesis
        seen = observer(self._linear, base.noise, likelihood.belief.waves)
        flat = seen.whiten(self._driving, self._shown).reshape(-1, self._driving.shape[-1])
        factors = np.ones(flat.shape[-1])
        factors[: columns.driving.shape[-1]] = columns.factors(base.width)
        gram = flat.T @ flat * np.outer(factors, factors)
        count = columns.driving.shape[-1]
        # The coefficients (with a prior) and the assumed effects (without) are projected out of the residual.
        held = np.arange(1, count)
        kept = np.concatenate([[0], np.arange(count, len(gram))])
        known = np.concatenate([np.maximum(assumed.prior[1], 1e-12), np.ones(count - 1 - columns.parameter_count)])
        inner = cho_factor(gram[np.ix_(held, held)] + np.diag(known))
        mixed = gram[np.ix_(held, kept)]
        mixed[: columns.parameter_count, 0] += assumed.prior[1] * (base.theta - assumed.prior[0])
        self.gram = gram[np.ix_(kept, kept)] - mixed.T @ cho_solve(inner, mixed)
        believed = likelihood.belief.cost(base.logs)[0]
        self.cost = float(seen.log_det + self.gram[0, 0] + 2 * np.sum(np.log(np.diag(inner[0]))) + believed)

    def of(self, chosen: Sequence[int]) -> tuple[float, Array]:
        """Gain of some variants together, and the shares of their amplitudes; none where a sign is not allowed."""
        return self.of_each([tuple(chosen)])[0]

    def of_each(self, sets: Sequence[tuple[int, ...]]) -> list[tuple[float, Array]]:
        """Gain and shares as of :meth:`of` for each set of variants, sets of as many columns at once."""
        columns = [np.concatenate([self.places[place] for place in chosen]) for chosen in sets]
        found: list[tuple[float, Array]] = [(0.0, np.zeros(0))] * len(sets)
        for width in {len(each) for each in columns}:
            rows = [row for row, each in enumerate(columns) if len(each) == width]
            at = np.array([columns[row] for row in rows])
            block = self.gram[at[:, :, None], at[:, None, :]]
            size = np.sqrt(np.maximum(np.diagonal(block, axis1=1, axis2=2), 1e-300))
            scaled = block / (size[:, :, None] * size[:, None, :]) + 1e-9 * np.eye(width)
            pull = -self.gram[at, 0] / size
            shares = np.linalg.solve(scaled, pull[..., None])[..., 0]
            sizes = self._size[at] * shares / size
            allowed = np.all(((sizes >= 0) | self._negative[at]) & ((sizes <= 0) | self._positive[at]), axis=1)
            prices = np.array([sum(self._prices[place] for place in sets[row]) for row in rows])
            gains = np.where(allowed, np.sum(pull * shares, axis=1), 0.0) - prices
            for row, gain, each in zip(rows, gains, np.where(allowed[:, None], shares / size, 0.0), strict=True):
                found[row] = float(gain), each
        return found

    def singles(self) -> tuple[Screened, ...]:
        """Each effect at its best variant, the best first."""
        best: dict[str, tuple[float, int]] = {}
        for place, (gain, _) in enumerate(self._alone):
            name = self.every[place].effect
            if name not in best or gain > best[name][0]:
                best[name] = gain, place
        return self._sorted([(place,) for _, place in best.values()])

    def pairs(self, of_each: int = 2) -> tuple[Screened, ...]:
        """Each pair of effects at the best of some variants of each, the best first."""
        names = dict.fromkeys(variant.effect for variant in self.every)
        kept: dict[str, list[int]] = {name: [] for name in names}
        for place in sorted(range(len(self.every)), key=lambda place: -self._alone[place][0]):
            effect = self.every[place].effect
            if len(kept[effect]) < of_each:
                kept[effect].append(place)
        tried = [list(product(kept[a], kept[b])) for a, b in combinations(names, 2)]
        gains = iter([gain for gain, _ in self.of_each([pair for pairs in tried for pair in pairs])])
        chosen = [max([(next(gains), pair) for pair in pairs], key=lambda found: found[0])[1] for pairs in tried]
        return self._sorted(chosen)

    @cached_property
    def _alone(self) -> list[tuple[float, Array]]:
        """Gain and share of each variant by itself."""
        return self.of_each([(place,) for place in range(len(self.every))])

    def _sorted(self, chosen: Sequence[tuple[int, ...]]) -> tuple[Screened, ...]:
        found = []
        for places, (gain, shares) in zip(chosen, self.of_each(chosen), strict=True):
            parts = np.split(shares, np.cumsum([len(self.places[place]) for place in places])[:-1])
            starts = {
                self.every[place].effect: self.every[place].start(part)
                for place, part in zip(places, parts, strict=True)
            }
            found.append(Screened(starts, gain))
        return tuple(sorted(found, key=lambda screened: -screened.gain))
