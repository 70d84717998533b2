"""Ensembles against plain NumPy: draws, independence of batches and executors, bands."""

from __future__ import annotations

import pickle
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
import pytest

from tank2sim.simulation import ensemble as module
from tank2sim.simulation.bands import figure_bands, history_bands
from tank2sim.simulation.ensemble import Answer, Draws, Ensemble, ensemble

COVARIANCE = np.array([[4.0, 1.0], [1.0, 9.0]])
DRAWS = Draws(
    ("a", "b"),
    np.array([1.0, -2.0]),
    np.linalg.cholesky(COVARIANCE),
    np.array([-np.inf, -np.inf]),
    np.array([np.inf, np.inf]),
    seed=7,
)


@dataclass(frozen=True)
class Linear:
    """3 a - b, and a line of that slope; those with a beyond 4 cannot be used."""

    def prepared(self):
        def ask(values) -> Answer:
            if values["a"] > 4:
                return Answer({}, trouble="a is too large")
            slope = 3 * values["a"] - values["b"]
            return Answer({"slope": slope}, np.array([[0.0, slope, 2 * slope]], dtype=np.float32))

        return lambda members: [ask(values) for values in members]


def test_draws_are_those_of_numpy_with_the_same_seeds() -> None:
    for member in (0, 5, 4_000_000):
        normal = np.random.default_rng(np.random.SeedSequence(7, spawn_key=(member,))).standard_normal(2)
        expected = DRAWS.mean + np.linalg.cholesky(COVARIANCE) @ normal
        np.testing.assert_allclose(list(DRAWS.member(member).values()), expected, rtol=1e-14)


def test_moments_of_draws_and_of_a_linear_figure_are_those_of_the_covariance() -> None:
    drawn = np.array([list(DRAWS.member(k).values()) for k in range(4000)])
    np.testing.assert_allclose(np.cov(drawn.T), COVARIANCE, rtol=0.08, atol=0.25)
    slope = drawn @ [3.0, -1.0]
    assert slope.var() == pytest.approx(np.array([3, -1]) @ COVARIANCE @ np.array([3, -1]), rel=0.08)


@pytest.mark.parametrize("batch", [1, 7, 100])
def test_the_result_depends_on_neither_batches_nor_executor(batch: int) -> None:
    whole = ensemble(Linear(), DRAWS, 60)
    with ThreadPoolExecutor(3) as pool:
        parts = ensemble(Linear(), DRAWS, 60, pool, batch=batch)
    np.testing.assert_array_equal(whole.figures["slope"], parts.figures["slope"])
    np.testing.assert_array_equal(whole.histories, parts.histories)
    assert whole.unusable == parts.unusable
    more = ensemble(Linear(), DRAWS, 80)
    np.testing.assert_array_equal(more.figures["slope"][:60], whole.figures["slope"])


def test_members_that_cannot_be_used_are_counted_and_told() -> None:
    found = ensemble(Linear(), DRAWS, 200)
    expected = sum(DRAWS.member(k)["a"] > 4 for k in range(200))
    assert expected > 3 and found.unusable == {"a is too large": expected}
    assert found.usable == 200 - expected == figure_bands(found)["slope"].shown
    assert found.notices == [f"{expected} of 200 members cannot be used: a is too large"]


def test_only_the_first_members_keep_their_histories(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "KEPT", 10)
    found = ensemble(Linear(), DRAWS, 30, batch=8)
    assert found.histories is not None and found.histories.shape == (10, 1, 3)
    assert np.isfinite(found.figures["slope"][10:]).any()


def test_bounds_hold_what_is_drawn_beyond_them() -> None:
    held = Draws(DRAWS.names, DRAWS.mean, DRAWS.root, np.array([0.0, -np.inf]), np.array([2.0, np.inf]), 7)
    drawn = np.array([list(held.member(k).values()) for k in range(300)])
    assert drawn[:, 0].min() == 0.0 and drawn[:, 0].max() == 2.0


def test_bands_are_numpys_quantiles_and_end_where_members_end() -> None:
    rng = np.random.default_rng(1)
    values = rng.normal(size=(100, 2, 5)).astype(np.float32)
    values[:10, :, 4] = np.nan
    values[99] = np.nan  # one that never ran
    found = Ensemble(100, 0, {"f": np.append(values[:99, 0, 0], np.nan).astype(float)}, values)
    times, bands, track = history_bands(found, np.arange(5.0), ("x_m", "r_degps"))
    assert len(times) == 4 and track is None
    np.testing.assert_allclose(bands["r_degps"].high, np.quantile(values[:99, 1, :4].astype(float), 0.95, axis=0))
    band = figure_bands(found)["f"]
    assert band.shown == 99 and band.low == pytest.approx(np.quantile(values[:99, 0, 0].astype(float), 0.05))


def test_the_band_of_a_track_lies_across_its_course() -> None:
    t, offset = np.linspace(0, 10, 21), np.linspace(-1, 1, 201)
    # All members go north-east, beside each other: their distance across the course is the offset itself.
    x = t / np.sqrt(2) - offset[:, None] / np.sqrt(2)
    y = t / np.sqrt(2) + offset[:, None] / np.sqrt(2)
    found = Ensemble(201, 0, {}, np.stack([x, y], axis=1).astype(np.float32))
    _, _, track = history_bands(found, t, ("x_m", "y_m"))
    assert track is not None
    away = (track.high - track.middle) @ np.array([-1, 1]) / np.sqrt(2)  # to starboard of north-east
    np.testing.assert_allclose(away, 0.9, atol=1e-5)
    np.testing.assert_allclose((track.low - track.middle) @ np.array([-1, 1]) / np.sqrt(2), -0.9, atol=1e-5)


def test_a_question_is_prepared_once_for_many_batches() -> None:
    module._prepared.cache_clear()
    ensemble(Linear(), DRAWS, 20, batch=4)
    assert module._prepared.cache_info().misses == 1 and pickle.loads(pickle.dumps(Linear())) == Linear()
