"""Ensembles against plain NumPy: draws, independence of batches and executors, bands."""

from __future__ import annotations

import pickle
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields, replace

import numpy as np
import pytest

from tank2sim.simulation import ensemble as module
from tank2sim.simulation.bands import FOLLOWED, figure_bands, history_bands, track_band
from tank2sim.simulation.ensemble import Draws, Ensemble, MemberResult, each_alone, ensemble, member_stream

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
        def ask(values) -> MemberResult:
            if values["a"] > 4:
                return MemberResult({}, trouble="a is too large")
            slope = 3 * values["a"] - values["b"]
            return MemberResult({"slope": slope}, np.array([[0.0, slope, 2 * slope]], dtype=np.float32))

        return each_alone(ask)


def test_draws_are_those_of_numpy_with_the_same_seeds() -> None:
    for member in (0, 5, 4_000_000):
        normal = np.random.default_rng(np.random.SeedSequence(7, spawn_key=(member,))).standard_normal(2)
        expected = DRAWS.mean + np.linalg.cholesky(COVARIANCE) @ normal
        np.testing.assert_allclose(list(DRAWS.member(member).values()), expected, rtol=1e-14)


@pytest.mark.parametrize("seed", [0, 2**32, 2**130 + 1])
@pytest.mark.parametrize("round_number", [None, 0, 3])
def test_streams_are_those_of_numpy_for_seeds_of_any_length(seed: int, round_number: int | None) -> None:
    for number in (0, 255, 256, 2**31 + 5):
        key = (number,) if round_number is None else (round_number, number)
        expected = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key)).standard_normal(3)
        np.testing.assert_array_equal(member_stream(seed, number, round_number).standard_normal(3), expected)


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


def test_members_that_cannot_be_used_are_counted_and_reported() -> None:
    found = ensemble(Linear(), DRAWS, 200)
    expected = sum(DRAWS.member(k)["a"] > 4 for k in range(200))
    assert expected > 3 and found.unusable == {"a is too large": expected}
    assert found.usable == 200 - expected == figure_bands(found)["slope"].shown_by
    assert found.notices == [f"{expected} of 200 members cannot be used: a is too large"]


@pytest.mark.parametrize(("lost", "first"), [(9, False), (11, True)])
def test_more_lost_members_than_a_band_leaves_out_are_said_first(lost: int, first: bool) -> None:
    found = replace(ensemble(Linear(), DRAWS, 200), unusable={"no steady motion": lost})
    assert [notice.leads for notice in found.notices] == [first]


def test_only_the_first_members_keep_their_histories(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "KEPT", 10)
    found = ensemble(Linear(), DRAWS, 30, batch=8)
    assert found.histories is not None and found.histories.shape == (10, 1, 3)
    assert np.isfinite(found.figures["slope"][10:]).any()


def test_what_is_drawn_beyond_a_bound_is_drawn_again_as_a_whole_and_reported() -> None:
    root = np.array([[1.0, 0.0], [1.0, 0.01]])  # correlation 0.99995
    held = Draws(DRAWS.names, DRAWS.mean, root, np.array([0.0, -np.inf]), np.array([2.0, np.inf]), 7)
    first = 0
    for member in range(200):
        stream = np.random.default_rng(np.random.SeedSequence(7, spawn_key=(member,)))
        values = held.mean + root @ stream.standard_normal(2)
        first += not 0 <= values[0] <= 2
        while not 0 <= values[0] <= 2:
            values = held.mean + root @ stream.standard_normal(2)
        np.testing.assert_allclose(list(held.member(member).values()), values, rtol=1e-13)
    drawn = np.array([list(held.member(k).values()) for k in range(200)])
    assert np.corrcoef(drawn.T)[0, 1] > 0.999  # held at the bounds: less than 0.98
    found = ensemble(Linear(), held, 200, batch=7)
    assert found.redrawn.members == first > 40 and found.redrawn.beyond == {"a": first}
    assert f"{first} of 200 members" in found.notices[0] and f"(a {first})" in found.notices[0]
    assert not found.unusable and ensemble(Linear(), DRAWS, 10).notices == []


def test_members_drawn_together_are_those_drawn_by_themselves_to_the_bit() -> None:
    rng = np.random.default_rng(8)
    root, bounds = rng.normal(size=(45, 45)), np.full(45, 16.0)
    usual = Draws(tuple(map(str, range(45))), rng.normal(size=45), root, -bounds, bounds, 3)
    sampled = replace(usual, samples=rng.normal(size=(9, 2)), sampled=np.array([1, 40]))
    own = {field.name: getattr(usual, field.name) for field in fields(Draws)}
    mixture = module.MixtureDraws(**own, centres=np.zeros((2, 45)), shares=np.array([0.5, 0.5]), round=1)
    for draws in (usual, sampled, mixture):
        together, single = draws.members(250, 12), [draws.members(number, 1) for number in range(250, 262)]
        for row, draw in enumerate(single):
            np.testing.assert_array_equal(draw.values[0], together.values[row])
            np.testing.assert_array_equal(draw.standard[0], together.standard[row])
            assert draw.beyond == {number: names for number, names in together.beyond.items() if number == 250 + row}
        assert together.troubles == [trouble for draw in single for trouble in draw.troubles]
    assert usual.members(250, 12).beyond and any(mixture.members(250, 12).troubles)


@pytest.mark.parametrize(("members", "batches"), [(256, 1), (10_000, 40), (100_000, 64), (1_000_000, 489)])
def test_batches_of_large_ensembles_are_larger(members: int, batches: int) -> None:
    assert -(-members // module._batch(256, members)) == batches


def test_a_member_that_no_draw_brings_within_its_bounds_cannot_be_used() -> None:
    nowhere = Draws(DRAWS.names, DRAWS.mean, DRAWS.root, np.array([90.0, -np.inf]), np.array([91.0, np.inf]), 7)
    found = ensemble(Linear(), nowhere, 2)
    assert found.unusable == {module.NOT_WITHIN: 2} and not found.figures


def test_bands_are_numpys_quantiles_and_end_where_members_end() -> None:
    rng = np.random.default_rng(1)
    values = rng.normal(size=(100, 2, 5)).astype(np.float32)
    values[:10, :, 4] = np.nan
    values[99] = np.nan  # one that never ran
    found = Ensemble(100, 0, {"f": np.append(values[:99, 0, 0], np.nan).astype(float)}, values)
    times, bands, track = history_bands(found, np.arange(5.0), ("x_m", "r_degps"))
    assert len(times) == 4 and track is None
    np.testing.assert_allclose(bands["r_degps"].p95, np.quantile(values[:99, 1, :4].astype(float), 0.95, axis=0))
    band = figure_bands(found)["f"]
    assert band.shown_by == 99 and band.p5 == pytest.approx(np.quantile(values[:99, 0, 0].astype(float), 0.05))


def test_the_band_of_a_track_lies_across_its_course() -> None:
    t, offset = np.linspace(0, 10, 21), np.linspace(-1, 1, 201)
    # All members go north-east, next to each other: their distance across the course is the offset itself.
    x = t / np.sqrt(2) - offset[:, None] / np.sqrt(2)
    y = t / np.sqrt(2) + offset[:, None] / np.sqrt(2)
    found = Ensemble(201, 0, {}, np.stack([x, y], axis=1).astype(np.float32))
    _, _, track = history_bands(found, t, ("x_m", "y_m"))
    assert track is not None
    away = (track.high_m - track.middle_m) @ np.array([-1, 1]) / np.sqrt(2)  # to starboard of north-east
    np.testing.assert_allclose(away, 0.9, atol=1e-5)
    np.testing.assert_allclose((track.low_m - track.middle_m) @ np.array([-1, 1]) / np.sqrt(2), -0.9, atol=1e-5)


def test_the_band_of_a_track_ends_before_its_edges_run_back() -> None:
    # A circle of 100 m: members next to each other, more and more, up to 200 m inwards.
    angle, offset = np.linspace(0, 2, 101), np.linspace(-1, 1, 201)[:, None]
    radius = 100 - 100 * angle * offset
    xy = np.stack([radius * np.sin(angle), 100 - radius * np.cos(angle)], axis=1)
    _, _, track = history_bands(Ensemble(201, 0, {}, xy.astype(np.float32)), angle, ("x_m", "y_m"))
    assert track is not None
    # The inmost reach the centre at a = 1; with 1 of 100 of them it ends.
    assert angle[track.count - 1] == pytest.approx(1 / 0.98, abs=0.05)
    assert np.isfinite(track.high_m[: track.count]).all() and np.isnan(track.low_m[track.count :]).all()
    assert len(track.low_m) == len(angle)


def test_the_band_of_tracks_is_of_where_members_go_and_not_of_when() -> None:
    # Two laps of circles that touch in the origin; members of all radii are up to half a radian ahead or astern.
    rng, t = np.random.default_rng(4), np.linspace(0, 4 * np.pi, 601)
    radius = np.sort(rng.normal(500, 20, 41))
    heading = t * rng.uniform(0.96, 1.04, 41)[:, None]
    xy = radius[:, None, None] * np.stack([np.sin(heading), 1 - np.cos(heading)], axis=1)
    _, _, track = history_bands(Ensemble(41, 0, {}, xy.astype(np.float32)), t, ("x_m", "y_m"))
    assert track is not None
    assert 0.9 * len(t) < track.count < len(t)  # those astern do not come to the end
    for line, place in (
        (track.high_m, 2),
        (track.middle_m, 20),
        (track.low_m, 38),
    ):  # 5, 50 and 95 % of 41, from inside
        x, y = line[: track.count].T
        away = y > 100  # where they touch all are one
        np.testing.assert_allclose((x**2 + y**2)[away] / (2 * y[away]), radius[place], atol=0.2)


def test_a_member_that_stops_short_ends_the_band_of_the_track_where_it_stops() -> None:
    t = np.linspace(0, 100, 101)
    x = np.minimum(t, np.linspace(50, 90, 51)[:, None])
    xy = np.stack([x, np.linspace(-1, 1, 51)[:, None] * t / 100], axis=1)
    _, _, track = history_bands(Ensemble(51, 0, {}, xy.astype(np.float32)), t, ("x_m", "y_m"))
    assert track is not None and track.middle_m[track.count - 1, 0] == pytest.approx(50, abs=1.5)


def test_bands_end_where_the_first_members_do() -> None:
    values = np.zeros((200, 1, 6), dtype=np.float32)
    values[:3, 0, 3:] = np.nan  # 1.5 % end early
    assert len(history_bands(Ensemble(200, 0, {}, values), np.arange(6.0), ("r_degps",))[0]) == 3
    values[:1, 0, 3:] = 0.0
    assert len(history_bands(Ensemble(200, 0, {}, values), np.arange(6.0), ("r_degps",))[0]) == 6


def test_a_question_is_prepared_once_for_many_batches() -> None:
    module._prepared.cache_clear()
    ensemble(Linear(), DRAWS, 20, batch=4)
    assert module._prepared.cache_info().misses == 1 and pickle.loads(pickle.dumps(Linear())) == Linear()


def test_a_member_is_followed_for_ten_steps_to_the_next_normal_and_not_further():
    """Two of ten ships go aside before they go on, parallel to the others; without them the band ends."""
    count = 30
    straight = np.column_stack([np.arange(count, dtype=float), np.zeros(count)])

    def length(aside: float) -> int:
        other = np.vstack([straight[:1], straight[:-1] + np.array([0.0, aside])])
        band = track_band(np.array([straight] * 8 + [other] * 2), 20)
        return int(np.isfinite(band.middle_m).all(axis=1).sum())

    assert length(FOLLOWED - 1.0) == 20  # with the step ahead exactly as far as is followed
    assert length(FOLLOWED - 0.75) == 1
