"""Where innovations are not noise, on innovations that are made up."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter

from tank2sim.gap.diagnosis import strangeness
from tank2sim.gap.diagnosis.strangeness import find_strangeness
from tank2sim.gap.inference.fit import ExplanationFit
from tests.gap.toy import Toy
from tests.gap.toy_likelihood import LOGS

RUNS, BLOCKS, NY, BLOCK_S = 4, 200, 6, 2.5
LENGTHS = np.array([200, 200, 150, 90])


def made_up(seed: int, *, added=0.0, theta=None, gaps: float = 0.05, pushed=0.0):
    """A likelihood and a fit of two parameters by least squares, to white noise; `theta` (R, 2) are each trial's own
    values of them, less those of the fit. The force that is left over is of first order by scipy's filter, four times
    as large as the smoother may be wrong by, and `pushed` (R, BLOCKS, 3) more."""
    rng = np.random.default_rng(seed)
    inside = np.arange(BLOCKS) < LENGTHS[:, None]
    known = inside[..., None] & (rng.random((RUNS, BLOCKS, NY)) > gaps)
    X = np.where(known[..., None], rng.standard_normal((RUNS, BLOCKS, NY, 2)), 0.0)
    e = rng.standard_normal((RUNS, BLOCKS, NY)) + added
    if theta is not None:
        e = e + np.einsum("rtyk,rk->rty", X, theta)
    e = np.where(known, e, 0.0)
    flat = X.reshape(-1, 2)
    best = np.linalg.lstsq(flat, e.ravel(), rcond=None)[0]
    e = e - X @ best
    motion = SimpleNamespace(
        names=tuple("abcd"),
        blocks=BLOCKS,
        block_s=BLOCK_S,
        lengths=LENGTHS,
        times=100.0 * np.arange(RUNS)[:, None] + BLOCK_S * (np.arange(BLOCKS) + 0.5),
    )
    fades = np.exp(-BLOCK_S / np.exp(LOGS[-4:-1]))
    shocks = rng.standard_normal((RUNS, 2 * BLOCKS, 3))
    forces = np.stack([lfilter([np.sqrt(1 - f**2)], [1, -f], shocks[..., i], axis=1) for i, f in enumerate(fades)], -1)
    states = np.zeros((RUNS, BLOCKS, 9 + NY))
    states[..., 6:9] = 4 * forces[:, BLOCKS:] + pushed
    spread = np.broadcast_to(np.eye(3), (RUNS, BLOCKS, 3, 3))
    motion.inside = inside
    # what is left over falls as a parameter grows
    whitened = np.concatenate([e[..., None], -X], axis=-1)
    likelihood = SimpleNamespace(
        motion=motion,
        known=known,
        innovations=lambda fit: e,
        whiten=lambda fit: (whitened, e),
        smooth=lambda fit: (states, spread),
    )
    return likelihood, ExplanationFit(Toy((None, None)), best, np.linalg.inv(flat.T @ flat), LOGS, 0.0, np.zeros(0))


@pytest.mark.parametrize("seeds", [range(60), pytest.param(range(60, 200), marks=pytest.mark.slow)])
def test_white_noise_is_not_strange(seeds) -> None:
    strange = {seed: found for seed in seeds if (found := find_strangeness(*made_up(seed, gaps=0.05 * (seed % 3))))}
    assert strange == {}


@pytest.mark.parametrize("run", [0, 3])
def test_a_burst_is_a_passage_of_its_trial(run: int) -> None:
    added = np.zeros((RUNS, BLOCKS, NY))
    added[run, 60:75, 1:3] = 3.0
    first, *_ = find_strangeness(*made_up(1, added=added))
    assert (first.kind, first.trial) == ("passage", "abcd"[run])
    begin, end = 100.0 * run + BLOCK_S * np.array([60.5, 74.5])
    assert first.begin_s == pytest.approx(begin, abs=12 * BLOCK_S)
    assert first.end_s == pytest.approx(end, abs=12 * BLOCK_S)


def test_a_burst_at_the_end_of_a_short_run_ends_with_it() -> None:
    added = np.zeros((RUNS, BLOCKS, NY))
    added[3, 80:90] = 3.0
    found = [strange for strange in find_strangeness(*made_up(2, added=added)) if strange.kind == "passage"]
    assert [strange.trial for strange in found] == ["d"]
    assert 300.0 + BLOCK_S * 65.5 < found[0].begin_s < found[0].end_s <= 300.0 + BLOCK_S * 89.5 + 1e-9


@pytest.mark.parametrize("period", [8.3, 21.0, 60.0])
def test_a_line_in_all_trials_is_a_period(period: float) -> None:
    """Its phase differs between trials; it is in one of six signals, as large as the noise: no passage stands out."""
    t = BLOCK_S * np.arange(BLOCKS)
    added = np.zeros((RUNS, BLOCKS, NY))
    added[..., 4] = np.sin(2 * np.pi * t / period + np.arange(RUNS)[:, None])
    found = find_strangeness(*made_up(3, added=added, gaps=0.0))
    assert [strange.kind for strange in found] == ["period"]
    assert found[0].begin_s == found[0].end_s == pytest.approx(period, rel=0.05)


@pytest.mark.parametrize(("run", "axis"), [(1, 1), (2, 2)])
def test_a_force_that_pushes_once_is_strange_and_one_that_pushes_always_is_not(run: int, axis: int) -> None:
    pushed = np.zeros((RUNS, BLOCKS, 3))
    pushed[run, 70:95, axis] = 40.0
    (first,) = find_strangeness(*made_up(6, pushed=pushed))
    assert (first.kind, first.trial) == ("push", "abcd"[run])
    begin, end = 100.0 * run + BLOCK_S * np.array([70.5, 94.5])
    assert first.begin_s == pytest.approx(begin, abs=25 * BLOCK_S) and first.end_s == pytest.approx(
        end, abs=25 * BLOCK_S
    )
    pushed[...] = 40.0 * np.sin(np.arange(BLOCKS))[:, None]
    assert find_strangeness(*made_up(6, pushed=pushed)) == ()


def test_a_trial_that_has_another_value_disagrees() -> None:
    theta = np.zeros((RUNS, 2))
    theta[2, 1] = 0.35  # some ten of its standard errors; in a trial's passages it drowns
    found = find_strangeness(*made_up(4, theta=theta))
    assert [(strange.kind, strange.trial) for strange in found] == [("trial", "c")]
    assert (found[0].begin_s, found[0].end_s) == pytest.approx((200.0 + 0.5 * BLOCK_S, 200.0 + 149.5 * BLOCK_S))


def test_the_strangest_is_reported_first() -> None:
    added, theta = np.zeros((RUNS, BLOCKS, NY)), np.zeros((RUNS, 2))
    added[0, 20:60] = 4.0
    theta[2, 1] = 0.35
    found = find_strangeness(*made_up(5, added=added, theta=theta))
    assert found[0].kind == "passage" and {strange.kind for strange in found} >= {"passage", "trial"}
    assert [strange.excess for strange in found] == sorted((strange.excess for strange in found), reverse=True)
    assert all(np.isfinite(strange.excess) for strange in found)


@pytest.mark.parametrize("memory", [0.0, 0.9])
def test_noise_of_another_colour_has_no_strange_passage(memory: float) -> None:
    """Sums of squares of coloured noise vary more: chance still makes one in twenty as strange as once in twenty."""
    blocks, rng, excess = 400, np.random.default_rng(4), []
    for _ in range(60):
        white = rng.standard_normal((blocks + 100, 3))
        noise = lfilter([math.sqrt(1 - memory**2)], [1.0, -memory], white, axis=0)[100:]
        motion = SimpleNamespace(names=("a",), blocks=blocks, lengths=[blocks], times=np.arange(blocks)[None, :])
        likelihood = SimpleNamespace(motion=motion, known=np.ones((1, blocks, 3), dtype=bool))
        (found,) = strangeness._passages(likelihood, noise[None])
        excess.append(found.excess)
    assert np.mean(np.array(excess) > -2 * math.log(0.05)) < 0.25
    assert np.mean(np.array(excess) > -2 * math.log(3e-3)) < 0.1


def test_a_burst_in_white_noise_is_the_strangest_passage() -> None:
    noise = np.random.default_rng(4).standard_normal((1, 400, 3))
    noise[0, 200:212] *= 3
    motion = SimpleNamespace(names=("a",), blocks=400, lengths=[400], times=10.0 * np.arange(400)[None, :])
    (found,) = strangeness._passages(SimpleNamespace(motion=motion, known=np.ones((1, 400, 3), dtype=bool)), noise)
    assert found.excess > -2 * math.log(1e-6)
    assert (found.begin_s, found.end_s) == pytest.approx((2000, 2110), abs=30)
