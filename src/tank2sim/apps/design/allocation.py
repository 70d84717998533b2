"""Optimal allocation of time to tests: the runs, with repeats, that make linear functions of coefficients most certain.

Tests i of cost t_i have Fisher information M_i about coefficients; a plan with n_i of each leaves the covariance
C = (P + sum n_i M_i)^-1, P the prior. A target is a positive matrix L, and tr(L C) its expected variance: an L-optimal
design (Fedorov 1972, Theory of Optimal Experiments; Atkinson, Donev and Tobias 2007, Optimum Experimental
Designs). With shares of the time in place of whole numbers it is convex, and solved by the multiplicative
algorithm (Yu 2010, Annals of Statistics 38); whole numbers follow by rounding down and exchange (Fedorov). The worst
target counts: its weight is raised until no other is worse.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement

import numpy as np
from numpy.typing import NDArray

from tank2sim.apps.design.study import Certainty
from tank2sim.arrays import Array

_ROUNDS = 400
_GAP = 1e-2
"""Relative gap to the optimum at which the multiplicative algorithm ends (project choice: 1 % of a variance,
less than whole numbers of runs cost)."""
_LEVELLING = 25
"""Rounds in which the weights of the targets are levelled."""
_EXCHANGES = 60
_SMALL_PLAN = 15
"""Tests in a plan up to which two at a time are exchanged. Project choice: with more, one at a time is as good."""
_LIKELY = 0.01
"""Least count of a test, over the largest, with which it takes part in exchanges. Project choice: others are not
in the plan with whole numbers."""


@dataclass(frozen=True, eq=False)
class InformationBlock:
    """Coefficients that are estimated together, independent of other blocks (a force of the captive tests).

    `prior` (k, k): information before any test, positive definite; `tests` (n, k, k): information of each test;
    `targets` (m, k, k): L of each target, for the coefficients of this block.
    """

    prior: Array
    tests: Array
    targets: Array

    def covariance(self, counts: Array) -> Array:
        """Covariance (k, k) of the coefficients with `counts` (n,) of each test."""
        return _inverse(self.information(counts))

    def information(self, counts: Array) -> Array:
        """Information (k, k) of the prior and of `counts` (n,) of each test."""
        flat = self.tests.reshape(len(self.tests), -1)
        found: Array = self.prior + (counts @ flat).reshape(self.prior.shape)
        return found


@dataclass(frozen=True, eq=False)
class Allocation:
    """Tests to choose from, their cost, and the targets. `cost` (n,): time of each test, s."""

    blocks: tuple[InformationBlock, ...]
    cost: Array

    def variances(self, counts: Array) -> Array:
        """Variance tr(L C) of each target, (m,), with `counts` (n,) of each test."""
        found: Array = np.sum(
            [block.targets.reshape(len(block.targets), -1) @ block.covariance(counts).ravel() for block in self.blocks],
            axis=0,
        )
        return found

    def scaled(self, variances: Array) -> Allocation:
        """The same with each target's variance in units of `variances` (m,)."""
        blocks = [
            InformationBlock(block.prior, block.tests, block.targets / variances[:, None, None])
            for block in self.blocks
        ]
        return Allocation(tuple(blocks), self.cost)

    def with_fixed(self, counts: Array) -> Allocation:
        """The same with `counts` (n,) of the tests done before."""
        blocks = [InformationBlock(block.information(counts), block.tests, block.targets) for block in self.blocks]
        return Allocation(tuple(blocks), self.cost)

    def relaxed(self, budget: float, start: Array | None = None) -> tuple[Array, Array]:
        """Counts (n,), not whole, that use the budget (s) and make the worst target best; the targets' weights (m,)."""
        targets = len(self.blocks[0].targets)
        weights = np.full(targets, 1.0 / targets)
        shares = np.full(len(self.cost), 1.0 / len(self.cost)) if start is None else start * self.cost
        shares = 0.9 * shares / shares.sum() + 0.1 / len(self.cost)
        for _ in range(_LEVELLING):
            shares = self._optimal_shares(budget, weights, shares)
            found = self.variances(shares * budget / self.cost)
            if found.max() <= 1.01 * (weights @ found):
                break
            # Variances of the targets that are too well known may rise; the worst gains weight.
            weights = weights * found
            weights = weights / weights.sum()
        return shares * budget / self.cost, weights

    def _optimal_shares(self, budget: float, weights: Array, shares: Array) -> Array:
        for _ in range(_ROUNDS):
            gain = self._gains(shares * budget / self.cost, weights)
            rate = gain / self.cost
            usual = float(shares @ rate)
            if rate.max() <= (1 + _GAP) * usual:
                break
            shares = shares * np.sqrt(rate / usual)
            shares = shares / shares.sum()
        return shares

    def _gains(self, counts: Array, weights: Array) -> Array:
        """Fall of the weighted variance by a little more of each test, (n,): tr(M_i C L C)."""
        gain = np.zeros(len(self.cost))
        for block in self.blocks:
            covariance = block.covariance(counts)
            slope = covariance @ np.einsum("m,mij->ij", weights, block.targets) @ covariance
            gain += block.tests.reshape(len(gain), -1) @ slope.T.ravel()
        return gain

    def whole(self, budget: float, counts: Array) -> NDArray[np.int64]:
        """Whole counts (n,) near the relaxed `counts` that keep the budget: rounded down, filled up, then exchanged."""
        whole = np.floor(counts + 1e-9).astype(np.int64)
        likely = np.flatnonzero(counts > _LIKELY * counts.max())
        whole = self._filled(whole, budget, likely)
        for _ in range(_EXCHANGES):
            better = self._exchanged(whole, budget, likely)
            if better is None:
                break
            whole = better
        return self._filled(whole, budget, np.arange(len(self.cost)))

    def _worst(self, whole: NDArray[np.int64], likely: NDArray[np.int64]) -> Array:
        """The worst target's variance with one more of each of the `likely` tests, (len(likely),)."""
        total = np.zeros((len(likely), len(self.blocks[0].targets)))
        for block in self.blocks:
            covariances = _inverse(block.information(whole.astype(float)) + block.tests[likely])
            total += np.einsum("mij,nji->nm", block.targets, covariances)
        worst: Array = total.max(axis=1)
        return worst

    def _filled(self, whole: NDArray[np.int64], budget: float, likely: NDArray[np.int64]) -> NDArray[np.int64]:
        whole = whole.copy()
        while True:
            left = budget - float(whole @ self.cost)
            fitting = likely[self.cost[likely] <= left]
            if not len(fitting):
                return whole
            now = float(self.variances(whole.astype(float)).max())
            rate = (now - self._worst(whole, fitting)) / self.cost[fitting]
            whole[fitting[int(np.argmax(rate))]] += 1

    def _exchanged(
        self, whole: NDArray[np.int64], budget: float, likely: NDArray[np.int64]
    ) -> NDArray[np.int64] | None:
        """The best plan with a test exchanged for others, in a small plan also two; None if none is better."""
        best, least = None, float(self.variances(whole.astype(float)).max()) * (1 - 1e-4)
        used = np.flatnonzero(whole).tolist()
        removed: list[tuple[int, ...]] = [(place,) for place in used]
        if whole.sum() <= _SMALL_PLAN:
            removed += [
                pair for pair in combinations_with_replacement(used, 2) if whole[pair[0]] > (pair[0] == pair[1])
            ]
            likely = np.arange(len(self.cost))
        for places in removed:
            fewer = whole.copy()
            for place in places:
                fewer[place] -= 1
            if len(places) > 1:
                other = self._filled(fewer, budget, likely)
                if (worst_of_two := float(self.variances(other.astype(float)).max())) < least:
                    best, least = other, worst_of_two
                continue
            fitting = likely[self.cost[likely] <= budget - float(fewer @ self.cost)]
            worst = self._worst(fewer, fitting)
            if len(fitting) and worst.min() < least:
                least = float(worst.min())
                best = fewer.copy()
                best[fitting[int(np.argmin(worst))]] += 1
        return None if best is None else self._filled(best, budget, likely)


def certainty(
    figures: Sequence[str], tests: Allocation, plans: Mapping[float, Array], usual: Array, usual_s: Sequence[float]
) -> Certainty:
    """Standard errors of figures by plans (share of the time to counts), and by the `usual` counts in `usual_s` s."""
    shares = sorted(plans)
    design = np.sqrt([tests.variances(plans[share]) for share in shares])
    by_usual = np.sqrt([tests.variances(usual * each / float(usual @ tests.cost)) for each in usual_s])
    return Certainty(
        time_s=tuple(float(plans[share] @ tests.cost) for share in shares),
        usual_time_s=tuple(usual_s),
        design={figure: tuple(design[:, row].tolist()) for row, figure in enumerate(figures)},
        usual={figure: tuple(by_usual[:, row].tolist()) for row, figure in enumerate(figures)},
    )


def least_time(
    targets: Allocation, plans: Mapping[float, Array], plan: Callable[[float], Array | None], lowest: float | None
) -> float | None:
    """Least time (s), to 2 % of all, of a plan with no target above 1; None without one.

    `plans`: share of the time to counts; `plan`: makes one of a share, None where that has no room for a test;
    `lowest`: share below the shares in `plans`, by default half of the least that is good.
    """
    good = [share for share, counts in plans.items() if targets.variances(counts).max() <= 1.0]
    if not good:
        return None
    high, found = min(good), plans[min(good)]
    low = max((share for share in plans if share < high), default=0.5 * high if lowest is None else lowest)
    while high - low > 0.02:
        middle = (low + high) / 2
        if (counts := plan(middle)) is None:
            break
        if targets.variances(counts).max() <= 1.0:
            high, found = middle, counts
        else:
            low = middle
    return float(found @ targets.cost)


def target_matrices(slopes: Sequence[Array]) -> Array:
    """L (m, k, k) of targets from their slopes by the coefficients, each (draws, k): the mean of c c'."""
    return np.stack([np.einsum("dk,dl->kl", slope, slope) / len(slope) for slope in slopes])


def _inverse(information: Array) -> Array:
    """Inverse of positive definite matrices (..., k, k), scaled by their diagonals."""
    scale = np.sqrt(np.einsum("...ii->...i", information))
    outer = scale[..., :, None] * scale[..., None, :]
    return np.asarray(np.linalg.inv(information / outer) / outer, dtype=np.float64)
