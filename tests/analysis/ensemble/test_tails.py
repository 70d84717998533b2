"""Importance sampling of small probabilities against the normal integral, and against members by the thousand."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest
from scipy.stats import norm

from tank2sim.analysis.ensemble.questions import BEYOND_CARD_MARK
from tank2sim.analysis.ensemble.tails import EFFECTIVE, FEW_FAILING, tails
from tank2sim.simulation.ensemble import Ask, BatchResult, Draws, MixtureDraws, ensemble

SLOPES = np.array([3.0, -2.0, 0.5, 0.0, 1.0])


@dataclass(frozen=True)
class Made:
    """Figures ``a`` linear in the numbers, ``b`` linear across it, ``c`` with a curve along ``a``.

    A member with ``a`` above `missing` shows none of them; one with its third number above `broken` cannot be used.
    """

    missing: float = math.inf
    broken: float = math.inf

    def prepared(self) -> Ask:
        def ask(count, values, kept) -> BatchResult:
            x = np.array([values[f"x{k}"] for k in range(5)])
            a = SLOPES @ x
            figures = {"a": a.copy(), "b": np.array([2.0, 3.0, 0, 0, 0]) @ x, "c": a + 0.15 * a * np.abs(a)}
            for figure in list(figures):
                figures[figure][a > self.missing] = np.nan
                figures[figure + BEYOND_CARD_MARK] = (figures[figure] > 5.0).astype(float)
            return BatchResult(figures, None, ["broken" if number > self.broken else "" for number in x[2]])

        return ask


def draws(*, correlated: bool = False, lowest: float = -np.inf) -> Draws:
    root = np.diag([0.5, 1.0, 2.0, 1.0, 0.1])
    if correlated:
        root[1, 0] = 0.7
    low = np.full(5, -np.inf)
    low[0] = lowest
    return Draws(tuple(f"x{k}" for k in range(5)), np.zeros(5), root, low, np.full(5, np.inf), 3)


def deviation(of: Draws, slopes=SLOPES) -> float:
    return float(np.linalg.norm(of.root.T @ slopes))


@pytest.mark.parametrize("beta", [3.5, 4.5])
@pytest.mark.parametrize("correlated", [False, True])
def test_a_linear_figure_has_the_normal_integral(beta: float, correlated: bool) -> None:
    own = draws(correlated=correlated)
    limit = beta * deviation(own)
    one, of_any, _ = tails(Made(), own, ensemble(Made(), own, 1000), {"a": limit})
    found = one["a"]
    assert found.probability is not None and found.standard_error is not None and of_any is not None
    assert found.probability == pytest.approx(norm.sf(beta), abs=4 * found.standard_error)
    assert found.standard_error < 0.12 * found.probability and found.effective_size >= EFFECTIVE
    assert found.distance == pytest.approx(beta, rel=1e-6) and found.figure == pytest.approx(limit)
    assert found.linear_probability == pytest.approx(norm.sf(beta), rel=1e-4)
    assert of_any.probability == pytest.approx(found.probability)


def test_failing_ships_are_where_the_figure_rises() -> None:
    own = draws()
    found = tails(Made(), own, ensemble(Made(), own, 1000), {"a": 4 * deviation(own)})[0]["a"]
    along = own.root.T @ SLOPES / deviation(own)
    # Beyond b of a standard normal its mean is phi(b) / Phi(-b).
    expected = along * norm.pdf(4) / norm.sf(4)
    assert [found.failing_ships[f"x{k}"] for k in range(3)] == pytest.approx(expected[:3], abs=0.15)


@pytest.mark.slow
def test_a_figure_that_is_not_linear_is_seen_and_its_tail_is_that_of_its_inverse() -> None:
    own = draws()
    sigma = deviation(own)
    y = 4.2 * sigma
    limit = y + 0.15 * y**2  # c rises with a: P(c > limit) = P(a > y)
    found = tails(Made(), own, ensemble(Made(), own, 2000), {"c": limit})[0]["c"]
    assert found.probability == pytest.approx(norm.sf(4.2), abs=4 * found.standard_error)
    assert found.linear_probability < 0.2 * norm.sf(4.2)
    assert found.figure is not None and abs(found.figure / found.linear_figure - 1) > 0.1


def test_any_of_two_criteria_is_the_union() -> None:
    own, across = draws(), np.array([2.0, 3.0, 0, 0, 0])
    limits = {"a": 4.0 * deviation(own), "b": 3.9 * deviation(own, across)}
    one, of_any, _ = tails(Made(), own, ensemble(Made(), own, 2000), limits)
    assert of_any is not None and of_any.probability is not None
    # Their correlation is -0.66 at most: both together are rarer than 1e-9.
    expected = norm.sf(4.0) + norm.sf(3.9)
    assert of_any.probability == pytest.approx(expected, abs=4 * of_any.standard_error)
    assert of_any.probability == pytest.approx(sum(tail.probability for tail in one.values()), rel=0.02)


def test_members_that_show_nothing_count_as_failing() -> None:
    own = draws()
    blind = Made(missing=3.8 * deviation(own))
    found = tails(blind, own, ensemble(blind, own, 2000), {"a": 4 * deviation(own)})[0]["a"]
    assert found.probability == pytest.approx(norm.sf(3.8), abs=4 * found.standard_error)
    assert found.not_shown == found.failing > 500 and found.beyond_card == 0


@pytest.mark.slow
def test_members_that_cannot_be_used_count_as_neither() -> None:
    own = draws()
    broken = Made(broken=2.0)  # a standard error of x2
    kept = tails(broken, own, ensemble(broken, own, 2000), {"a": 4 * deviation(own)})[0]["a"]
    assert kept.unusable > 100 and kept.not_shown == 0 and kept.beyond_card == kept.failing
    z = np.random.default_rng(0).standard_normal((4_000_000, 2))  # the part of a along x2 and that across it
    along = 1.0 / deviation(own)
    a = along * z[:, 0] + math.sqrt(1 - along**2) * z[:, 1]
    usable = z[:, 0] <= 1.0
    expected = float(np.mean(a[usable] > 4.0))
    error = math.sqrt(expected / usable.sum())
    assert kept.probability == pytest.approx(expected, abs=4 * math.hypot(kept.standard_error, error))
    assert kept.unusable_probability == pytest.approx(norm.sf(1.0), rel=0.5)


@pytest.mark.slow
def test_members_beyond_a_bound_are_no_ships() -> None:
    own = draws(lowest=-0.4)
    found = tails(Made(), own, ensemble(Made(), own, 2000), {"a": 4 * deviation(own)})[0]["a"]
    # x0 raises a: of the ships that fail none is cut off, but the whole is: P / P(x0 > -0.4).
    assert found.probability == pytest.approx(norm.sf(4) / norm.cdf(0.8), abs=4 * found.standard_error)


def test_a_limit_out_of_reach_has_no_probability_and_says_so() -> None:
    own = draws()
    one, of_any, _ = tails(Made(), own, ensemble(Made(), own, 400), {"a": 9 * deviation(own)})
    assert one["a"].probability is None and one["a"].remark and one["a"].members == 0 and of_any is None
    assert one["a"].distance == pytest.approx(9, rel=1e-6)


def test_nothing_is_searched_that_members_show() -> None:
    own = draws()
    found = ensemble(Made(), own, 1000)
    often = float(np.sort(found.figures["a"])[-FEW_FAILING - 1])
    assert tails(Made(), own, found, {"a": often})[0] == {}
    few, _, notices = tails(Made(), own, ensemble(Made(), own, 100), {"a": 4 * deviation(own)})
    assert few == {} and len(notices) == 1


def test_weights_are_ratios_of_normal_densities() -> None:
    own = draws()
    kinds = {name: getattr(own, name) for name in ("names", "mean", "root", "lowest", "highest", "seed")}
    centres = np.array([np.zeros(5), [1.0, -2, 0, 0, 0.5]])
    mixture = MixtureDraws(**kinds, centres=centres, shares=np.array([0.3, 0.7]), round=1)
    z = np.array([[0.1, -3.0, 1.0, 0.2, 2.0], [30.0, -50.0, 0, 0, 0]])
    ratio = [
        norm.logpdf(row).sum()
        - np.logaddexp(math.log(0.3) + norm.logpdf(row).sum(), math.log(0.7) + norm.logpdf(row - centres[1]).sum())
        for row in z
    ]
    assert np.log(mixture.weights(z)) == pytest.approx(ratio, rel=1e-12)
    drawn = mixture.members(0, 4000).standard
    assert drawn.mean(axis=0) == pytest.approx(0.7 * centres[1], abs=0.08)
