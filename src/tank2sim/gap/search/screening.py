"""Every effect and every pair at once, from one pass of the filter at one noise.

Each effect is evaluated at one or several sizes and shapes (its *variants*); the contribution of each to the motion is
a column, or one for each of its amplitudes. With the card's coefficients projected out (Schur complement), the gain of
any set of columns follows from one Gram matrix.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
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

    def allowed(self, shares: Array) -> bool:
        """Whether the bounds allow the signs of amplitudes in such shares of their size here (a,)."""
        places = list(self.amplitudes)
        sizes = self.theta[places] * shares[: len(places)]
        low, high = (bound[places] for bound in self.hypothesis.bounds)
        return bool(np.all((sizes >= 0) | (low < 0)) and np.all((sizes <= 0) | (high > 0)))

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
        The fit about which, and at the noise of which: "none", or the effects that are assumed present.
    every : sequence of Variant
    """

    def __init__(self, likelihood: Likelihood, base: ExplanationFit, every: Sequence[Variant]):
        self.likelihood, self.base = likelihood, base
        self.every = tuple(variant for variant in every if variant.effect not in base.hypothesis.effects)
        assumed = base.hypothesis
        linear = likelihood.linear(assumed, base.theta) if assumed.effects else likelihood.base
        seen = observer(linear, base.noise, likelihood.belief.waves)
        columns = likelihood.columns(assumed, base.theta, likelihood.coefficient_columns).scaled(base.width)
        driving = np.concatenate([columns.driving, *(variant.driving for variant in self.every)], axis=-1)
        of_coefficients = np.zeros((*columns.shown.shape[:-1], columns.driving.shape[-1] - columns.shown.shape[-1]))
        of_variants = [-variant.shown for variant in self.every]
        shown = np.concatenate([columns.shown, of_coefficients, *of_variants], axis=-1)
        flat = seen.whiten(driving, shown).reshape(-1, driving.shape[-1])
        gram = flat.T @ flat
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
        widths = [variant.driving.shape[-1] for variant in self.every]
        ends = 1 + np.cumsum(widths)
        self.places = [np.arange(end - width, end) for end, width in zip(ends, widths, strict=True)]

    def of(self, chosen: Sequence[int]) -> tuple[float, Array]:
        """Gain of some variants together, and the shares of their amplitudes; none where a sign is not allowed."""
        gram_places = np.concatenate([self.places[place] for place in chosen])
        block = self.gram[np.ix_(gram_places, gram_places)]
        size = np.sqrt(np.maximum(np.diag(block), 1e-300))
        scaled = block / np.outer(size, size) + 1e-9 * np.eye(len(block))
        pull = -self.gram[gram_places, 0] / size
        shares = np.linalg.solve(scaled, pull)
        free_parameters = sum(np.count_nonzero(self.every[place].hypothesis.prior[1] == 0) for place in chosen)
        price = free_parameters * np.log(self.likelihood.count / COUNTED)
        found = shares / size
        ends = np.cumsum([len(self.places[place]) for place in chosen])
        parts = zip(chosen, np.split(found, ends[:-1]), strict=True)
        if not all(self.every[place].allowed(part) for place, part in parts):
            return -float(price), np.zeros(len(found))
        return float(pull @ shares - price), found

    def singles(self) -> tuple[Screened, ...]:
        """Each effect at its best variant, the best first."""
        found = [(self.of([place])[0], place) for place in range(len(self.every))]
        best: dict[str, tuple[float, int]] = {}
        for gain, place in found:
            name = self.every[place].effect
            if name not in best or gain > best[name][0]:
                best[name] = gain, place
        return self._sorted([(place,) for _, place in best.values()])

    def pairs(self, of_each: int = 2) -> tuple[Screened, ...]:
        """Each pair of effects at the best of some variants of each, the best first."""
        names = dict.fromkeys(variant.effect for variant in self.every)
        kept: dict[str, list[int]] = {name: [] for name in names}
        for place in sorted(range(len(self.every)), key=lambda place: -self.of([place])[0]):
            effect = self.every[place].effect
            if len(kept[effect]) < of_each:
                kept[effect].append(place)
        chosen = []
        for a, b in combinations(names, 2):
            chosen.append(max(product(kept[a], kept[b]), key=lambda pair: self.of(pair)[0]))
        return self._sorted(chosen)

    def _sorted(self, chosen: Iterable[tuple[int, ...]]) -> tuple[Screened, ...]:
        found = []
        for places in chosen:
            gain, shares = self.of(places)
            begins = np.cumsum([0] + [len(self.places[place]) for place in places])
            starts = [
                self.every[place].start(shares[begin : begin + len(self.places[place])])
                for place, begin in zip(places, begins, strict=False)
            ]
            found.append(Screened(dict(zip((self.every[place].effect for place in places), starts, strict=True)), gain))
        return tuple(sorted(found, key=lambda screened: -screened.gain))
