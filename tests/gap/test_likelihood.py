"""The score of the gap against the Gaussian density written out whole, on a linear toy."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.linalg import block_diag
from scipy.optimize import minimize_scalar

from tank2sim.gap.inference import form_error, kalman_kernels
from tank2sim.gap.inference import likelihood as module
from tank2sim.gap.inference.fit import NARROWER, Belief, ExplanationFit
from tank2sim.gap.inference.likelihood import COUNTED, LEAST_GAIN, WIDTHS, Likelihood, least_in_box
from tests.gap.dense import Dense
from tests.gap.toy import WHITE, Toy, toy_motion, toy_trials
from tests.gap.toy_likelihood import LOGS, NOISE, WIDTH, forms_of, judge

NOTHING = np.zeros(0)


def fitted(of: Likelihood, toy: Toy, start=None, logs=LOGS) -> ExplanationFit:
    theta = np.zeros(len(toy.priors)) if start is None else start
    return of.at_best(toy, theta, [logs], [0])


def dense_cost(of: Likelihood, toy: Toy, theta, *, about=None, marginal=(), forms=None) -> float:
    """-2 log density of both runs as one Gaussian, without its n log 2 pi.

    Integrated out: the coefficients, the form of the effects `about` some parameters, the `marginal` parameters, and
    other `forms` (R, T - 1, 6, nf).
    """
    theta = np.asarray(theta, dtype=float)
    driving, shown = of.residual(toy, theta)
    what = of.linear(toy, theta)
    slopes = toy.coefficient_slopes(of.motion, theta, of.coefficients.names) if of.coefficients.names else np.zeros(())
    inside = of.motion.inside[:, 1:, None, None]
    mixed = WIDTH * of.motion.block_s * inside * (slopes @ of.coefficients.mixing) if slopes.ndim else slopes[None][:0]
    vary = list(np.moveaxis(mixed, -1, 0))
    if len(theta):
        vary += list(np.moveaxis(forms_of(of, toy, theta if about is None else about), -1, 0))
    if forms is not None:
        vary += list(np.moveaxis(forms, -1, 0))
    for place in marginal:
        moved = theta.copy()
        moved[place] += toy.priors[place][1]
        vary.append(of.residual(toy, moved)[0] - driving)
    parts = [Dense(what, NOISE, run) for run in range(2)]
    error = np.concatenate([part.error(driving[run], shown[run]) for run, part in enumerate(parts)])
    covariance = block_diag(*(part.covariance for part in parts))
    for change in vary:  # the runs share them
        column = np.concatenate([part.of_driving @ change[run].ravel() for run, part in enumerate(parts)])
        covariance += np.outer(column, column)
    return float(np.linalg.slogdet(covariance)[1] + error @ np.linalg.solve(covariance, error))


def believed(of: Likelihood, logs=LOGS) -> float:
    away = (logs - of.belief.logs) / of.belief.spread
    away[-1] /= NARROWER if away[-1] < 0 else 1.0
    return float(np.sum(away**2))


@pytest.mark.parametrize("names", [(), ("0",), ("0", "1")])
def test_coefficients_are_integrated_out(names) -> None:
    of = judge(toy_motion(coefficients=(0.3, -0.2)), names=names)
    assert fitted(of, Toy()).score == pytest.approx(dense_cost(of, Toy(), NOTHING) + believed(of), rel=1e-9)


MIXED = np.array([[0.5, 0.0, 0.4], [0.0, 0.3, -0.2]])
"""Errors of two coefficients: each its own, and one that they share with opposite signs."""


def test_errors_that_coefficients_share_are_integrated_out() -> None:
    of = judge(toy_motion(coefficients=(0.3, -0.2)), mixing=MIXED)
    fit = fitted(of, Toy())
    assert fit.score == pytest.approx(dense_cost(of, Toy(), NOTHING) + believed(of), rel=1e-9)
    assert fit.score != pytest.approx(fitted(judge(of.motion, mixing=np.abs(MIXED)), Toy()).score, abs=0.1)
    assert of.coefficients.errors == pytest.approx([np.hypot(0.5, 0.4), np.hypot(0.3, 0.2)])
    assert WIDTH * MIXED @ fit.change == pytest.approx([0.3, -0.2], abs=0.1)


def test_most_probable_coefficients_explain_what_they_caused() -> None:
    of = judge(toy_motion(coefficients=(0.3, -0.2)), errors=(0.5, 0.3))
    change = WIDTH * fitted(of, Toy()).change * of.coefficients.errors
    assert change == pytest.approx([0.3, -0.2], abs=0.1)


def test_a_free_parameter_is_at_the_least_cost_and_pays_its_price() -> None:
    of, toy = judge(toy_motion((0.8,))), Toy((None,))
    fit = fitted(of, toy)

    def cost(size: float) -> float:
        return dense_cost(of, toy, [size], about=fit.theta)

    price, spread = np.log(of.count / COUNTED), np.sqrt(fit.covariance[0, 0])
    assert fit.score == pytest.approx(cost(fit.theta[0]) + price + believed(of), rel=1e-9)
    best = minimize_scalar(cost, bracket=(0.5, 1.0))
    assert fit.theta[0] == pytest.approx(best.x, abs=np.sqrt(LEAST_GAIN) * spread)
    for side in (-1, 1):  # one standard deviation away -2 log of the likelihood is 1 more
        assert cost(best.x + side * spread) - best.fun == pytest.approx(1.0, rel=2e-3)


@pytest.mark.parametrize("spread", [0.4, 0.02])
def test_a_parameter_known_beforehand_is_integrated_out(spread: float) -> None:
    of, toy = judge(toy_motion((0.8,))), Toy(((0.5, spread),))
    fit = fitted(of, toy, np.array([0.1]))
    assert 0.5 < fit.theta[0] < 0.9
    # its mean is where the density of the measurements is asked for; at the best parameter nothing is left to gain
    whole = dense_cost(of, toy, [0.5], about=fit.theta, marginal=[0]) + believed(of)
    assert fit.score == pytest.approx(whole, abs=LEAST_GAIN)


def test_a_free_parameter_next_to_a_known_one() -> None:
    of, toy = judge(toy_motion((0.8, -0.6))), Toy((None, (-0.5, 0.2)))
    fit = fitted(of, toy)
    best = minimize_scalar(
        lambda size: dense_cost(of, toy, [size, -0.5], about=fit.theta, marginal=[1]), bracket=(0.5, 1.0)
    )
    # in the toy surge and yaw know nothing of each other: the prices simply add
    assert fit.score == pytest.approx(best.fun + np.log(of.count / COUNTED) + believed(of), abs=2 * LEAST_GAIN)


def test_a_force_with_a_direction_may_differ_with_the_heading() -> None:
    of = judge(toy_motion((0.8,)))
    for toy in (Toy((None,)), Toy((None,), directed=True)):
        fit = fitted(of, toy)
        price = np.log(of.count / COUNTED)
        whole = dense_cost(of, toy, fit.theta, about=fit.theta) + price + believed(of)
        assert fit.score == pytest.approx(whole, rel=1e-9)


@pytest.mark.parametrize("largest", [0.0, 0.05])
def test_a_form_that_differs_beyond_belief_costs_its_excess(monkeypatch, largest: float) -> None:
    of, toy = judge(toy_motion((0.8,))), Toy((None,))
    fit = fitted(of, toy)
    away = np.abs(fit.change[2:])
    assert np.all(away < module.LARGEST_FORM) and np.count_nonzero(away > largest) > 2
    monkeypatch.setattr(module, "LEAST_GAIN", np.inf)  # the parameters stay where they begin
    scores = []
    for limit in (np.inf, largest):
        monkeypatch.setattr(module, "LARGEST_FORM", limit)
        repeated = fitted(of, toy, fit.theta)
        np.testing.assert_array_equal(repeated.theta, fit.theta)
        scores.append(repeated.score)
    assert scores[1] - scores[0] == pytest.approx(module.IMPOSSIBLE * np.maximum(away - largest, 0).sum())


class Bent(Toy):
    """A toy whose force grows with the logarithm of its parameter: a step of Gauss and Newton goes far too far."""

    def rates_between(self, motion, theta):
        return super().rates_between(motion, np.log(theta + 10.001))


@pytest.mark.parametrize("start", [-9.0, 0.0, 9.0])
def test_a_strongly_bent_force_is_found_from_either_side(start: float) -> None:
    truth = -9.5
    of = judge(toy_motion((np.log(truth + 10.001),)), names=())
    fit = of.at_best(Bent((None,)), np.array([start]), [LOGS], [0, 0, 0])
    assert fit.theta[0] == pytest.approx(truth, abs=4 * np.sqrt(fit.covariance[0, 0]))


def test_a_damped_step_has_a_larger_diagonal_and_keeps_its_bounds() -> None:
    normal, pull = np.array([[4.0, 1.0], [1.0, 3.0]]), np.array([1.0, 2.0])
    free, wide = np.linalg.solve(normal, pull), np.full(2, 9.0)
    step = module._Step(normal, pull, -wide, wide, free)
    assert step.move(0.0) is free
    np.testing.assert_allclose(step.move(2.0), np.linalg.solve(normal + 2 * np.diag([4.0, 3.0]), pull), rtol=1e-9)
    narrow = replace(step, high=np.array([9.0, 0.1]))
    np.testing.assert_allclose(narrow.move(0.0), [(1.0 - 0.1) / 4.0, 0.1], rtol=1e-9)


def test_residuals_are_remembered_for_each_explanation_and_its_parameters(monkeypatch) -> None:
    of, asked = judge(toy_motion((0.8, -0.6))), []
    first, second, both = Toy((None,)), Toy((None,), indices=(1,)), Toy((None, None))
    fresh = Likelihood._residual

    def counted(self, hypothesis, theta):
        asked.append(theta)
        return fresh(self, hypothesis, theta)

    monkeypatch.setattr(Likelihood, "_residual", counted)
    for hypothesis, theta in (
        (first, [0.5]),
        (second, [0.5]),
        (first, [0.6]),
        (both, [0.5, 0.0]),
        (first, [0.5]),
        (both, [0.5, 0.1]),
    ):
        exact = fresh(of, hypothesis, np.array(theta))
        for found, true in zip(of.residual(hypothesis, np.array(theta)), exact, strict=True):
            np.testing.assert_array_equal(found, true)
    assert len(asked) == 5
    for size in np.arange(3 * module.REMEMBERED):
        of.residual(first, np.array([float(size)]))
    assert len(of._residuals) <= module.REMEMBERED


@pytest.mark.parametrize("priors", [(), (None,), ((0.5, 0.4),), (None, (-0.5, 0.2))])
def test_slopes_of_the_cost_in_noise_and_width(priors, monkeypatch) -> None:
    theta = np.array([0.7, -0.55])[: len(priors)]
    of = judge(toy_motion((0.8, -0.6)[: len(priors)], (0.3, -0.2)))
    asked = []

    def ask(cost, start, **_):
        asked.append(cost)
        return SimpleNamespace(x=start)

    monkeypatch.setattr(module, "minimize", ask)
    of.at_best(Toy(priors), theta, [LOGS], [1])
    (cost,) = asked
    step = 1e-4 * np.eye(len(LOGS))
    quotients = [(cost(LOGS + h)[0] - cost(LOGS - h)[0]) / 2e-4 for h in step]
    assert cost(LOGS)[1] == pytest.approx(np.array(quotients), abs=2e-6)
    assert np.abs(quotients[-1]) > 0.1  # the width counts


def test_the_score_falls_as_the_noise_is_sought_and_stays_in_its_bounds() -> None:
    of, toy = judge(toy_motion((0.8,))), Toy((None,))
    first = fitted(of, toy)
    best = of.at_best(toy, np.zeros(1), [LOGS], [15])
    assert best.score < first.score - 1
    low, high = of.belief.bounds
    assert np.all(best.logs[:-1] >= low[:-1]) and np.all(best.logs[:-1] <= high[:-1])
    assert WIDTHS[0] <= best.width * (1 + 1e-12) and best.width <= WIDTHS[1] * (1 + 1e-12)


def test_belief_is_a_parabola_with_bounds_at_three_deviations() -> None:
    belief = Belief(np.array([1.0, -2.0]), np.array([0.5, 2.0]))
    assert belief.bounds[0] == pytest.approx([-0.5, -8.0]) and belief.bounds[1] == pytest.approx([2.5, 4.0])
    value, slope = belief.cost(np.array([2.0, -2.0]))
    assert value == pytest.approx(4.0) and slope == pytest.approx([8.0, 0.0])


@pytest.mark.parametrize(("width", "cost", "slope"), [(0.0, 1.0, 1.0), (-4.0, 0.25, -0.25)])
def test_coefficients_that_are_better_than_the_card_states_cost_less_than_worse_ones(width, cost, slope) -> None:
    """By hand: two from the mean of -2, with a standard deviation of 2 above it and of 4 below."""
    value, slopes = Belief(np.array([1.0, -2.0]), np.array([0.5, 2.0])).cost(np.array([1.0, width]))
    assert NARROWER == 2.0
    assert value == pytest.approx(cost) and slopes == pytest.approx([0.0, slope])


def test_the_best_of_several_noises_is_begun_with() -> None:
    of, toy = judge(toy_motion((0.8,)), spread=5.0), Toy((None,))
    starts = [LOGS + 3.0, LOGS, LOGS - 3.0]
    assert of.at_best(toy, np.zeros(1), starts, [0]).logs == pytest.approx(LOGS)


def test_known_amplitudes_are_recovered_within_their_errors(monkeypatch) -> None:
    """Over five sets of noise the squared errors in standard deviations have a mean near one, for an exact formula."""
    monkeypatch.setattr(form_error, "FORM", 1e-6)
    toy, away = Toy((None, None)), []
    true = np.array([0.8, -0.6])
    for seed in range(5):
        of = judge(toy_motion(tuple(true), seed=seed), names=(), spread=1.0)
        fit = of.at_best(toy, np.zeros(2), [LOGS], [6])
        away.append(np.linalg.solve(np.linalg.cholesky(fit.covariance), fit.theta - true))
        assert fit.theta == pytest.approx(true, abs=0.15)
    assert 0.3 < np.mean(np.square(away)) < 2.0


def test_what_is_not_there_does_not_pay() -> None:
    of = judge(toy_motion(), spread=1.0)
    none, single = (of.at_best(toy, np.zeros(len(toy.priors)), [LOGS], [8]) for toy in (Toy(), Toy((None,))))
    assert single.score > none.score - 2
    judged = judge(toy_motion((0.8,)), spread=1.0)
    none, single = (judged.at_best(toy, np.zeros(len(toy.priors)), [LOGS], [8]) for toy in (Toy(), Toy((None,))))
    assert single.score < none.score - 10


def test_a_parameter_at_its_bound_stays_there() -> None:
    class Bounded(Toy):
        @property
        def bounds(self):
            return np.array([-0.2]), np.array([0.3])

    of = judge(toy_motion((0.8,)), spread=2.0)
    fit = fitted(of, Bounded((None,)))
    assert fit.theta == pytest.approx([0.3])
    # the noise covers what the parameter may not explain
    again = of.at_best(Bounded((None,)), np.zeros(1), [LOGS], [6])
    assert again.theta == pytest.approx([0.3]) and again.score < fit.score - 1
    assert again.noise.force[2] > NOISE.force[2]


def test_beside_a_parameter_at_its_bound_the_others_go_where_they_fit_best(monkeypatch) -> None:
    """Two effects that act alike, of which one may not be as large as it is: against the density along the bound."""
    monkeypatch.setattr(form_error, "FORM", 1e-6)

    class Alike(Toy):
        bounds = np.array([-0.2, -10.0]), np.array([0.3, 10.0])

        def rates_between(self, motion, theta):
            return super().rates_between(motion, np.array([[1.0, 0.9], [0.0, 0.4]]) @ theta)

    toy = Alike((None, None))
    of = judge(toy_motion((0.8, -0.6)))
    along = minimize_scalar(lambda size: dense_cost(of, toy, np.array([0.3, size])), bounds=(-5, 5), method="bounded")
    assert along.x > 0  # without the bound it is -1.5
    assert fitted(of, toy).theta == pytest.approx([0.3, along.x], abs=1e-3)


def test_about_an_explanation_the_motion_is_nearer_to_the_true_one() -> None:
    motion, true = toy_trials((0.8,))
    of, toy = judge(motion), Toy((None,))
    moved = of.about(fitted(of, toy)).motion
    for run, end in enumerate(motion.lengths * motion.fine):
        before, after = (np.abs((batch.states - true)[run, :end]) / WHITE for batch in (motion, moved))
        assert np.all(np.sqrt(np.mean(after**2, axis=0)) < 0.8 * np.sqrt(np.mean(before**2, axis=0)))
        assert np.all(after < 2.0)  # up to the end of a shorter run


def test_about_an_explanation_the_heading_turns_with_the_yaw_rate_that_nobody_modelled() -> None:
    """A hidden moment of 0.04 rad/s2, taken for noise: in a block it bends the heading as it raises the yaw rate."""
    of = judge(toy_motion((0.8,)))
    loud = replace(NOISE, force=np.array([0.02, 0.02, 0.2]))
    moved = of.about(fitted(of, Toy(), logs=np.append(loud.logs, np.log(WIDTH)))).motion
    psi, r, begin = moved.states[0, :, 3], moved.states[0, :, 2], moved.fine // 2
    away = np.diff(psi) / moved.step_s - 0.5 * (r[1:] + r[:-1])
    inside = away[begin : begin + (moved.blocks - 1) * moved.fine].reshape(-1, moved.fine)
    assert np.median(np.ptp(inside, axis=1)) < 0.1 * 0.04 * moved.block_s


def test_the_gain_of_one_measurement_is_that_of_the_signals_that_were_seen() -> None:
    rng = np.random.default_rng(2)
    start, reading, known = rng.uniform(0.5, 2.0, 13), rng.standard_normal((4, 6)), np.array([True, False, True, True])
    white_noise = rng.uniform(0.1, 1.0, 4)
    H = np.hstack([reading, np.zeros((4, 3)), np.eye(4)])[known]
    S = H @ np.diag(start) @ H.T + np.diag(white_noise[known])
    expected = np.zeros((13, 4))
    expected[:, known] = np.diag(start) @ H.T @ np.linalg.inv(S)
    seeing = np.where(known[:, None], reading, 0.0)[None, None], known[None, None]
    nothing, process = np.zeros((1, 0, 6, 6)), (np.ones(7), np.ones(3), np.ones(3), np.ones(3), np.ones(7))
    motion = nothing, nothing, *seeing
    gain, white, filtered = kalman_kernels.covariances(motion, process, start, white_noise[None])
    assert gain[0, 0] == pytest.approx(expected, abs=1e-12)
    assert (white[0, 0].T @ white[0, 0])[np.ix_(known, known)] == pytest.approx(np.linalg.inv(S))
    assert filtered[0, 0] == pytest.approx(np.diag(start) - expected[:, known] @ S @ expected[:, known].T)


def test_a_matrix_that_rounding_made_indefinite_has_a_least_point_in_its_box() -> None:
    normal, pull = np.array([[1.0, 1.0], [1.0, 1.0 - 1e-9]]), np.array([3.0, 3.0])
    low, high = np.array([-1.0, -1.0]), np.array([1.0, 2.5])

    def cost(x: np.ndarray) -> float:
        return float(x @ normal @ x / 2 - x @ pull)

    found = least_in_box(normal, pull, low, high)
    corners = [cost(np.array([a, b])) for a in np.linspace(-1, 1, 21) for b in np.linspace(-1, 2.5, 36)]
    assert np.all((found >= low) & (found <= high))
    assert cost(found) <= min(corners) + 1e-6
