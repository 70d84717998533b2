"""Optimal allocations against designs that are known in closed form, and against trying every plan."""

from itertools import product

import numpy as np
import pytest

from tank2sim.apps.design.allocation import Allocation, InformationBlock, target_matrices

LITTLE = 1e-9


def allocation(rows, targets, cost=None):
    """Tests of one reading each, of unit variance, with these regressors (n, k)."""
    rows = np.asarray(rows, dtype=float)
    tests = np.einsum("ni,nj->nij", rows, rows)
    block = InformationBlock(
        LITTLE * np.eye(rows.shape[1]), tests, target_matrices([np.atleast_2d(t) for t in targets])
    )
    return Allocation((block,), np.ones(len(rows)) if cost is None else np.asarray(cost, dtype=float))


def test_the_curvature_of_a_parabola_is_read_at_its_ends_and_twice_as_often_in_the_middle():
    """Weights 1/4, 1/2, 1/4: the second difference of three means of variance 1/n_i is exact with these."""
    x = np.linspace(-1, 1, 9)
    problem = allocation(np.column_stack([np.ones(9), x, x**2]), [[0, 0, 1.0]])
    found, _ = problem.relaxed(40.0)
    assert found[[0, 4, 8]] == pytest.approx([10, 20, 10], abs=1.0) and found.sum() == pytest.approx(40)
    # The variance of that design is 4 over the number of readings.
    assert problem.variances(found) == pytest.approx([0.1], rel=0.01)
    assert problem.whole(40.0, found).tolist() == [10, 0, 0, 0, 20, 0, 0, 0, 10]


def test_a_slope_is_read_at_the_ends_and_its_variance_is_that_of_the_straight_line():
    x = np.linspace(-1, 1, 5)
    problem = allocation(np.column_stack([np.ones(5), x]), [[0, 1.0]])
    whole = problem.whole(10.0, problem.relaxed(10.0)[0])
    assert whole.tolist() == [5, 0, 0, 0, 5]
    assert problem.variances(whole.astype(float)) == pytest.approx([0.1])


def test_time_goes_by_the_root_of_variance_over_cost():
    """min a/n1 + b/n2 with t1 n1 + t2 n2 = T: n proportional to root of a/t."""
    both = [np.array([2.0, 0.0]), np.array([0.0, 1.0])]
    block = InformationBlock(
        LITTLE * np.eye(2), np.stack([np.diag([1.0, 0]), np.diag([0, 1.0])]), target_matrices([np.stack(both)])
    )
    found, _ = Allocation((block,), np.array([1.0, 4.0])).relaxed(100.0)
    assert found[0] / found[1] == pytest.approx(np.sqrt(4.0 / 1.0) / np.sqrt(1.0 / 4.0), rel=0.02)
    assert found @ [1.0, 4.0] == pytest.approx(100)


def test_the_worst_of_two_targets_is_made_as_good_as_the_other():
    """9/27 and 1/3: no plan of 30 readings has both below a third."""
    problem = allocation(np.eye(2), [[3.0, 0], [0, 1.0]])
    found, weights = problem.relaxed(30.0)
    assert problem.variances(found).max() * (1 + 1e-9) >= 1 / 3 and problem.variances(found).max() < 1.015 / 3
    assert found.sum() == pytest.approx(30) and weights.sum() == pytest.approx(1)


def test_targets_in_two_blocks_add_up():
    one = allocation(np.eye(2), [[1.0, 1.0]])
    two = Allocation((one.blocks[0], one.blocks[0]), one.cost)
    counts = np.array([4.0, 2.0])
    assert one.variances(counts) == pytest.approx([0.75]) and two.variances(counts) == pytest.approx([1.5])


def test_whole_counts_are_as_good_as_the_best_of_all_plans():
    rng = np.random.default_rng(5)
    rows, cost = rng.standard_normal((5, 3)), np.array([1.0, 1.5, 2.0, 1.2, 0.8])
    problem = allocation(rows, [[1.0, 0.5, -0.3], [0.0, 1.0, 1.0]], cost)
    budget = 7.0
    found = problem.whole(budget, problem.relaxed(budget)[0])
    plans = [np.array(plan) for plan in product(range(9), repeat=5) if np.dot(plan, cost) <= budget]
    best = min(problem.variances(plan.astype(float)).max() for plan in plans)
    assert found @ cost <= budget
    assert problem.variances(found.astype(float)).max() <= 1.05 * best


def test_tests_done_before_are_counted():
    problem = allocation(np.eye(2), [[1.0, 0], [0, 1.0]])
    after = problem.with_fixed(np.array([10.0, 0.0])).relaxed(10.0)[0]
    assert after == pytest.approx([0, 10], abs=0.2)
