"""The filter of the gap against the same Gaussian written out whole, and against difference quotients."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm

from tank2sim.gap.inference.kalman_filter import Linear, NoiseLevels, linear_filter, observer, slopes
from tests.gap.dense import Dense, pushed, van_loan
from tests.gap.random_filter import NY, RUNS, columns, problem


@pytest.mark.parametrize("seed", range(4))
def test_innovations_tell_the_density_of_the_whole_gaussian(seed: int) -> None:
    what, noise, rng = problem(seed, gaps=seed > 0)
    driving, shown = columns(what, rng, 3)
    seen = observer(what, noise)
    whitened = seen.whiten(driving, shown)
    assert np.all(whitened[~what.known] == 0)
    for column in range(3):
        cost = seen.log_det + np.sum(whitened[..., column] ** 2) + what.known.sum() * np.log(2 * np.pi)
        dense = sum(Dense(what, noise, run).cost(driving[run, ..., column], shown[run, ..., column]) for run in (0, 1))
        assert cost == pytest.approx(dense, rel=1e-10)


def test_innovations_are_linear_in_their_columns() -> None:
    what, noise, rng = problem(7)
    driving, shown = columns(what, rng, 2)
    seen, mixture = observer(what, noise), np.array([[0.7], [-1.9]])
    mixed = seen.whiten(driving @ mixture, shown @ mixture)
    assert mixed == pytest.approx(seen.whiten(driving, shown) @ mixture)


@pytest.mark.parametrize("seed", range(3))
def test_smoothed_states_are_the_conditional_mean(seed: int) -> None:
    what, noise, rng = problem(seed)
    driving, shown = columns(what, rng)
    states = observer(what, noise).smooth(driving[..., 0], shown[..., 0])
    for run in range(RUNS):
        assert states[run] == pytest.approx(Dense(what, noise, run).states(driving[run, ..., 0], shown[run, ..., 0]))


@pytest.mark.parametrize("count", [1, 3])
def test_slopes_are_difference_quotients_in_every_noise(count: int) -> None:
    what, noise, rng = problem(2)
    driving, shown = columns(what, rng, count)

    def cost(logs: np.ndarray) -> float:
        seen = observer(what, NoiseLevels.of(logs))
        return seen.log_det + float(np.sum(seen.whiten(driving, shown) ** 2))

    seen = observer(what, noise)
    found = slopes(seen, driving, shown)
    step = 1e-4 * np.eye(len(noise.logs))
    quotients = [
        (8 * (cost(noise.logs + h) - cost(noise.logs - h)) - cost(noise.logs + 2 * h) + cost(noise.logs - 2 * h))
        / 12e-4
        for h in step
    ]
    assert found.shape == noise.logs.shape == (3 * NY + 6,)
    assert found == pytest.approx(np.array(quotients), abs=1e-7, rel=1e-8)
    assert np.abs(found).min() > 1e-3  # each noise counts in this problem


def test_logarithms_of_the_noise_go_there_and_back() -> None:
    _, noise, _ = problem(1)
    again = NoiseLevels.of(noise.logs)
    for name in ("white", "slow", "slow_s", "force", "force_s"):
        assert getattr(again, name) == pytest.approx(getattr(noise, name))
    longer = replace(noise, force_s=noise.force_s * np.e)
    assert longer.logs - noise.logs == pytest.approx(np.r_[np.zeros(3 * NY + 3), np.ones(3)])


def still(A: np.ndarray, h: float) -> Linear:
    """One block of a motion with slopes A, read in all its states."""
    known = np.ones((1, 2, 6), dtype=bool)
    return linear_filter(A[None, None], np.tile(np.eye(6), (1, 2, 1, 1)), known, h, np.ones(6), np.ones(1))


def test_transition_and_spreading_are_the_exponential_and_its_integral_to_third_order() -> None:
    A = np.random.default_rng(3).standard_normal((6, 6))

    def errors(h: float) -> tuple[float, float]:
        what = still(A, h)
        # van Loan: the exponential of [[A, I], [0, 0]] holds that of A and its integral
        whole = expm(np.block([[A, np.eye(6)], [np.zeros((6, 12))]]) * h)
        return (
            float(np.abs(what.transition[0, 0] - whole[:6, :6]).max()),
            float(np.abs(h * what.spreading[0, 0] - whole[:6, 6:]).max()),
        )

    coarse, fine = errors(0.08), errors(0.04)
    for before, after in zip(coarse, fine, strict=True):
        assert after < 1e-6 and before / after == pytest.approx(2**4, rel=0.15)


@pytest.mark.parametrize("blocks_in_a_time", [0.4, 2.0])
def test_a_hull_that_moves_much_in_a_block_is_moved_rightly(blocks_in_a_time: float) -> None:
    """In very shallow water sway fades in half a block: a series without doublings would be off by whole units."""
    h = 2.0
    A = np.zeros((6, 6))
    A[:3, :3] = np.array([[-0.1, 0.0, 0.0], [0.0, -1.0, 0.5], [0.0, 0.3, -0.8]]) / (blocks_in_a_time * h)
    A[3, 2] = A[4, 0] = A[5, 1] = 1.0
    what = still(A, h)
    whole = expm(np.block([[A, np.eye(6)], [np.zeros((6, 12))]]) * h)
    assert what.transition[0, 0] == pytest.approx(whole[:6, :6], abs=2e-3)
    assert h * what.spreading[0, 0] == pytest.approx(whole[:6, 6:], abs=2e-3)


# -- the unmodelled acceleration in continuous time -----------------------------------------------------------------


def forecast(A: np.ndarray, noise: NoiseLevels, h: float) -> tuple[np.ndarray, np.ndarray]:
    """Transition (9, 9) of motion and accelerations over a block, and what the block adds to their covariance.

    Of the filter alone: P after a block, less what the transition makes of P before, with everything read.
    """
    seen = observer(still(A, h), noise)
    before, after = seen.filtered[0, 0], seen.filtered[0, 1]
    H, R = np.hstack([seen.linear.reading[0, 1], np.zeros((6, 3)), np.eye(6)]), np.diag(noise.white**2)
    fading, gain = seen.process[:2]
    F = np.diag(np.concatenate([np.zeros(6), fading]))  # six sensors, one a state
    F[:6, :9] = np.hstack([seen.linear.transition[0, 0], seen.linear.spreading[0, 0][:, :3] * gain])
    S = np.linalg.inv(seen.white[0, 1].T @ seen.white[0, 1])
    # the filter's own identities give P beforehand: S = H P H' + R, gain = P H' inv(S), after = P - gain S gain'
    P = after + seen.gain[0, 1] @ S @ seen.gain[0, 1].T
    assert pytest.approx(S) == H @ P @ H.T + R
    added = P - F @ before @ F.T
    return F[:9, :9], added[:9, :9]


def exact(A: np.ndarray, noise: NoiseLevels, h: float) -> tuple[np.ndarray, np.ndarray]:
    """The same by Van Loan's exponential of motion and accelerations together, nothing taken as even."""
    slope = np.zeros((9, 9))
    slope[:6, :6], slope[:3, 6:] = A, np.eye(3)
    slope[6:, 6:] = -np.diag(1 / noise.force_s)
    return van_loan(slope, np.diag(np.r_[np.zeros(6), 2 * noise.force**2 / noise.force_s]), h)


PUSHED = NoiseLevels(
    np.full(6, 0.1), np.full(6, 0.1), np.full(6, 5.0), np.array([0.5, 1.0, 2.0]), np.array([0.3, 4.0, 200.0])
)
"""Accelerations much faster than a block, as fast, and nearly constant."""


def test_an_acceleration_pushes_as_in_continuous_time_where_nothing_else_moves() -> None:
    found, added = forecast(np.zeros((6, 6)), PUSHED, 2.0)
    transition, covariance = exact(np.zeros((6, 6)), PUSHED, 2.0)
    assert found == pytest.approx(transition, rel=1e-12, abs=1e-12)
    assert added == pytest.approx(covariance, rel=1e-7, abs=1e-10)


def test_the_push_over_a_block_is_that_of_many_small_steps() -> None:
    """Against the sum written out: no exponential of a matrix."""
    time_s, level, block_s, count = 4.0, 1.0, 2.0, 4000
    h = block_s / count
    fade = np.exp(-h / time_s)
    decay = fade ** np.arange(count)  # of a kick that many steps later
    way = h * (1 - decay) / (1 - fade)  # and the speed that it has made
    kick = level**2 * (1 - fade**2)
    transition, covariance = pushed(time_s, level, block_s)
    found, added = forecast(np.zeros((6, 6)), PUSHED, block_s)  # of which sway is as here
    assert PUSHED.force_s[1] == time_s and PUSHED.force[1] == level
    assert [transition[0, 1], found[1, 7]] == pytest.approx([h * decay.sum()] * 2, rel=1e-3)
    for of_way, of_both, of_end in (
        (covariance[0, 0], covariance[0, 1], covariance[1, 1]),
        (added[1, 1], added[1, 7], added[7, 7]),
    ):
        assert of_way == pytest.approx(kick * way @ way, rel=2e-3)
        assert of_both == pytest.approx(kick * way @ decay, rel=2e-3)
        assert of_end == pytest.approx(kick * decay @ decay, rel=2e-3)


SHIP = np.zeros((6, 6))
SHIP[:3, :3] = [[-0.02, 0.0, 0.1], [0.0, -0.1, -0.4], [0.0, 0.05, -0.2]]
SHIP[3, 2] = SHIP[4, 0] = SHIP[5, 1] = 1.0
"""Slopes of a hull whose motions fade in some blocks of a second or two."""


def test_entering_evenly_is_right_to_the_order_of_the_block() -> None:
    """Where the hull moves the acceleration enters evenly over a block: wrong by one order more than what it does."""
    slow = replace(PUSHED, force_s=np.array([4.0, 6.0, 9.0]))
    off = []
    for h in (0.4, 0.2):
        found, added = forecast(SHIP, slow, h)
        transition, covariance = exact(SHIP, slow, h)
        assert found[:6, 6:] == pytest.approx(transition[:6, 6:], abs=0.02 * h**2)
        speeds = np.ix_(range(3), range(3))
        off.append(
            (
                np.abs(found - transition)[:6, 6:].max(),
                np.abs(added - covariance)[speeds].max(),
                np.abs(added - covariance)[:3, 6:].max(),
            )
        )
        # a speed's own variance and its tie to the acceleration, which the measurements tell: nearly right
        assert np.diag(added)[:3] == pytest.approx(np.diag(covariance)[:3], rel=0.05)
        assert np.diag(added[:3, 6:]) == pytest.approx(np.diag(covariance[:3, 6:]), rel=0.05)
    # gain errs with h^3, the variance of a speed with h^4, its tie to the acceleration with h^3
    ratios = np.array(off[0]) / np.array(off[1])
    assert ratios == pytest.approx([2**3, 2**4, 2**3], rel=0.2)
