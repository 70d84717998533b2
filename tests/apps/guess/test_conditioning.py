"""Figures that go exponentially with the numbers of a ship: what conditioning does to them is known in closed form."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from tank2sim.analysis.ensemble.draws import draws_of
from tank2sim.apps.guess import study
from tank2sim.apps.guess.prior import ShipDimensions, prior_card, rudder_by_rules
from tank2sim.apps.guess.study import (
    FIGURE_KEYS,
    GivenFigure,
    GuessMembers,
    PosterFigures,
    conditioned,
    guess_ship,
    study_members,
)
from tank2sim.cards import ManoeuvringCard, read_card
from tank2sim.errors import InputError

TANKER = ShipDimensions(length_m=320.0, beam_m=58.0, draught_m=20.8, block=0.81, speed_kn=15.5)
CARD = prior_card(TANKER, "tanker")
DRAWS, _ = draws_of(CARD, 1)
SPREAD = np.sqrt(np.diag(DRAWS.root @ DRAWS.root.T))
ADVANCE, TACTICAL = "advance_m@35", "tactical_diameter_m@35"
MEMBERS = 2000


def given(key: str, sizes: float, error: float = 0.1) -> GivenFigure:
    """A figure that lies so many relative units above 1000, with a relative standard error."""
    manoeuvre, word = FIGURE_KEYS[key]
    value = 1000.0 * math.exp(sizes)
    return GivenFigure(manoeuvre, word, value, error * value)


@pytest.fixture
def linear(monkeypatch):
    """Log figures are 0.2 times a number of the ship in its standard errors: the tactical diameter the third, all
    others the first; a number at its bound may be asked for."""
    places = dict.fromkeys(FIGURE_KEYS, 0) | {TACTICAL: 2}

    class Linear:
        def __init__(self, card: ManoeuvringCard, names: tuple[str, ...]):
            assert names == DRAWS.names

        def at(self, values: np.ndarray) -> dict[str, np.ndarray]:
            z = (values - DRAWS.mean) / SPREAD
            return {key: 1000.0 * np.exp(0.2 * z[:, place]) for key, place in places.items()}

    monkeypatch.setattr(study, "PosterFigures", Linear)
    return places


def test_a_figure_moves_the_members_as_exact_estimation_does_and_nothing_else(linear) -> None:
    """Variance 0.04 of the ship, 0.01 of the figure: the mean goes 0.8 of the way, the variance to 0.008."""
    found = conditioned(CARD, [given(ADVANCE, 0.3)], MEMBERS, 1)
    logs = np.log(found.after[ADVANCE] / 1000.0)
    assert logs.mean() == pytest.approx(0.8 * 0.3, abs=0.015)
    assert logs.std() == pytest.approx(math.sqrt(0.008), rel=0.08)
    before, after = (np.log(one[TACTICAL] / 1000.0) for one in (found.before, found.after))
    assert after.mean() == pytest.approx(before.mean(), abs=0.015) and after.std() == pytest.approx(
        before.std(), rel=0.06
    )


class Silent:
    """A stream of random numbers that are all zero."""

    def standard_normal(self, shape: tuple[int, ...]) -> np.ndarray:
        return np.zeros(shape)


def test_a_step_takes_each_member_by_the_covariances_of_the_members() -> None:
    """p + C_py (C_yy + 4 R)^-1 (y - f), Emerick and Reynolds (2013), with the sample covariances of five members."""
    stream = np.random.default_rng(5)
    values, shown = stream.normal(size=(5, 3)), stream.normal(size=(5, 2))
    target, errors = np.array([0.5, -0.2]), np.array([0.3, 0.6])
    moved = study._moved(values, shown, (target, errors), Silent())
    both = np.cov(np.hstack([values, shown]).T)
    gain = both[:3, 3:] @ np.linalg.inv(both[3:, 3:] + 4 * np.diag(errors**2))
    np.testing.assert_allclose(moved, values + (target - shown) @ gain.T, rtol=1e-12)


def test_without_figures_the_members_stay_as_they_are_drawn(linear) -> None:
    found = conditioned(CARD, [], MEMBERS, 1)
    np.testing.assert_array_equal(found.posterior, found.prior)
    assert np.log(found.before[ADVANCE]).std() == pytest.approx(0.2, rel=0.06)


def test_members_stay_within_the_bounds_of_their_numbers(linear) -> None:
    """No rudder straightens the flow by less than nothing; a figure that asks for less finds members there."""
    place = linear[ADVANCE] = DRAWS.names.index("loaded_rudder.straightening")
    found = conditioned(CARD, [given(ADVANCE, -0.7)], MEMBERS, 1)
    assert (found.posterior >= DRAWS.lowest).all() and (found.posterior <= DRAWS.highest).all()
    assert found.posterior[:, place].min() == DRAWS.lowest[place] == 0.0


@pytest.mark.parametrize("side", [1, -1])
def test_a_figure_is_refused_from_three_and_a_half_deviations_of_ship_and_figure_together(linear, side) -> None:
    together = math.hypot(0.2, 0.1)
    conditioned(CARD, [given(ADVANCE, side * 3.3 * together)], MEMBERS, 1)
    with pytest.raises(InputError, match="not a figure of a ship"):
        conditioned(CARD, [given(ADVANCE, side * 3.7 * together)], MEMBERS, 1)


def test_figures_contradict_each_other_from_three_and_a_half_deviations_of_one_by_the_other(linear) -> None:
    """Both are the same number of the ship: the second lies at 0.8 of the first, with variance 0.05 - 0.04^2/0.05."""
    linear[TACTICAL] = 0
    deviation = math.sqrt(0.05 - 0.04**2 / 0.05)
    first = 0.3
    conditioned(CARD, [given(ADVANCE, first), given(TACTICAL, 0.8 * first - 3.2 * deviation)], MEMBERS, 1)
    with pytest.raises(InputError, match="contradicts") as refused:
        conditioned(CARD, [given(ADVANCE, first), given(TACTICAL, 0.8 * first - 3.8 * deviation)], MEMBERS, 1)
    low, high = map(float, re.findall(r"[\d.]+(?:e\+\d+)?", refused.value.remedy))
    named = first if refused.value.place.startswith("tactical") else 0.8 * first - 3.8 * deviation
    expected = [1000.0 * math.exp(0.8 * named + side * 2 * deviation) for side in (-1, 1)]
    assert [low, high] == pytest.approx(expected, rel=0.05)


def test_the_card_has_means_and_errors_of_the_members_and_their_covariance(linear) -> None:
    figures = [given(ADVANCE, 0.3), given(TACTICAL, -0.2)]
    _, card = guess_ship(TANKER, figures, "tanker", 600, 1)
    values = conditioned(prior_card(TANKER, "tanker"), figures, 600, 1).posterior
    for place, name in enumerate(DRAWS.names):
        mean, spread = values[:, place].mean(), values[:, place].std(ddof=1)
        group, _, key = name.partition(".")
        if group == "derivatives":
            found, error = card.derivatives[key], card.uncertainty[key]
        else:
            (effect,) = (one for one in card.effects if one.name == group)
            found, error = effect.parameters[key], effect.uncertainty[key]
        assert found == pytest.approx(mean, rel=1e-5, abs=1e-12) and error == pytest.approx(spread, rel=1e-4), name
    assert card.covariance is not None and len(card.covariance.samples) == 500
    np.testing.assert_allclose(card.covariance.matrix, np.cov(values.T), rtol=1e-9)
    assert card.ship.name == "tanker"


@pytest.mark.parametrize(("value", "error", "words"), [(1000.0, 50.0, True), (1000.0, 49.0, False)])
def test_errors_that_were_not_given_and_ships_that_were_left_out_are_said(value, error, words) -> None:
    members = np.zeros((180, len(SPREAD)))
    shown = {ADVANCE: 1000.0 + np.linspace(-80.0, 80.0, 180)}
    found = GuessMembers(DRAWS, members, members, shown, shown)
    figures = [GivenFigure("turn35", "advance_m", value, error)]
    notices = study_members(TANKER, "tanker", figures, found, 200, 1).notices
    assert any(notice.startswith("20 of 200") for notice in notices)
    assert any("5 % of distances, 1 deg" in notice for notice in notices) == words
    whole = study_members(TANKER, "tanker", [], found, 180, 1).notices
    assert len(whole) == 2


@pytest.mark.parametrize(
    ("value", "place", "marked"),
    [(1139.0, "before", False), (1143.0, "before", True), (861.0, "after", False), (857.0, "after", True)],
)
def test_a_figure_outside_nine_of_ten_ships_by_more_than_its_error_is_marked(value, place, marked) -> None:
    """Figures evenly from 900 to 1100: nine of ten are within 910 to 1090; the error of the figure is 50 or so."""
    members = np.zeros((181, len(SPREAD)))
    narrow, wide = np.linspace(900.0, 1100.0, 181), np.linspace(0.0, 2000.0, 181)
    figures = {"before": {ADVANCE: wide}, "after": {ADVANCE: wide}, place: {ADVANCE: narrow}}
    found = GuessMembers(DRAWS, members, members, figures["before"], figures["after"])
    study = study_members(TANKER, "tanker", [GivenFigure("turn35", "advance_m", value, 51.0)], found, 181, 1)
    assert any(notice.leads for notice in study.notices) == marked


def test_members_that_show_no_figure_are_left_out_and_too_few_are_refused(linear, monkeypatch) -> None:
    whole = study.PosterFigures

    class Some(whole):
        shown = 0.5

        def at(self, values):
            found = super().at(values)
            hidden = np.arange(len(values)) >= self.shown * len(values)
            return {key: np.where(hidden, np.nan, v) for key, v in found.items()}

    monkeypatch.setattr(study, "PosterFigures", Some)
    assert len(conditioned(CARD, [], 400, 1).prior) == 200
    Some.shown = 0.2
    with pytest.raises(InputError, match="only 80 of 400"):
        conditioned(CARD, [], 400, 1)


def test_the_next_figure_is_the_one_that_takes_most_variance_away() -> None:
    """Two figures that are one number tell of each other by v/(v + e^2); one that is alone tells of itself."""
    stream, count = np.random.default_rng(3), 40_000
    logs = {key: 0.3 * stream.standard_normal(count) for key in FIGURE_KEYS}
    logs["transfer_m@35"] = logs[TACTICAL] = 0.1 * stream.standard_normal(count)
    after = {key: (30.0 if "zigzag" in key else 1000.0) * np.exp(values) for key, values in logs.items()}
    draws = DRAWS
    members = np.column_stack([draws.mean + SPREAD * stream.standard_normal(len(SPREAD)) for _ in range(50)]).T
    narrow = draws.mean + (members - draws.mean) * np.where(np.arange(len(SPREAD)) == 0, 0.6, 0.8)
    found = GuessMembers(draws, members, narrow, after, after)
    study = study_members(TANKER, "tanker", [given(ADVANCE, 0.0)], found, 50, 1)
    open_figures = len(FIGURE_KEYS) - 1
    gains = study.next_figures
    share = 0.01 / (0.01 + 0.05**2)
    assert gains[TACTICAL] == gains["transfer_m@35"] == pytest.approx(2 * share / open_figures, rel=0.02)
    error = 1.0 / 30.0
    assert gains["overshoot_1_deg@10/10"] == pytest.approx(0.09 / (0.09 + error**2) / open_figures, rel=0.02)
    assert list(gains)[:2] == ["transfer_m@35", TACTICAL] or list(gains)[:2] == [TACTICAL, "transfer_m@35"]
    settled = [number.settled for number in study.parameters.values()]
    assert settled == [True] + [False] * (len(SPREAD) - 1)  # below 0.7 of before
    assert study.figures[TACTICAL].found.p50 == pytest.approx(1000.0, rel=0.01)


@pytest.mark.parametrize(
    ("name", "low", "high"),
    [("length_m", 1.0, 500.0), ("speed_kn", 1.0, 45.0), ("block", 0.35, 1.0)],
)
def test_dimensions_are_bounded_at_what_ships_have(name: str, low: float, high: float) -> None:
    for value, other in ((low, -1), (high, 1)):
        size = {**vars(TANKER), name: value}
        if name == "length_m":
            size |= {"beam_m": value / 6, "draught_m": value / 15}
            size |= {"speed_kn": 1.5} if value < 20 else {}
        ShipDimensions(**size)
        with pytest.raises(InputError) as refused:
            ShipDimensions(**{**size, name: value * (1 + 0.01 * other)})
        assert refused.value.source == name


@pytest.mark.parametrize(("speed_kn", "taken"), [(2.29, True), (15.5, False), (0.05, False)])
def test_a_model_runs_at_a_speed_of_models(speed_kn: float, taken: bool) -> None:
    """1.18 m/s of a model of 5.01 m, 1 : 63.9, are 18 kn of the ship of 320 m; 15.5 kn would be those of the ship."""
    size = {"length_m": 5.01, "beam_m": 0.908, "draught_m": 0.326, "block": 0.81, "speed_kn": speed_kn}
    if taken:
        ShipDimensions(**size)
        return
    with pytest.raises(InputError) as refused:
        ShipDimensions(**size)
    assert refused.value.source == "speed_kn" and "models of this length" in refused.value.remedy


def test_a_model_is_its_ship_by_froude() -> None:
    """A ship of 200 m and its model 1 : 40: the same coefficients, the gear and yaw rates faster by the root of 40."""
    ship = ShipDimensions(length_m=200.0, beam_m=32.0, draught_m=12.0, block=0.8, speed_kn=15.0)
    model = ShipDimensions(length_m=5.0, beam_m=0.8, draught_m=0.3, block=0.8, speed_kn=15.0 / math.sqrt(40.0))
    large, small = prior_card(ship, "ship"), prior_card(model, "model")
    assert small.derivatives == pytest.approx(large.derivatives, rel=1e-5)
    assert large.steering_gear and small.steering_gear
    assert small.steering_gear.max_rate_radps == pytest.approx(
        large.steering_gear.max_rate_radps * math.sqrt(40.0), rel=1e-3
    )
    values = np.array([[]]).reshape(1, 0)
    of_ship, of_model = (PosterFigures(card, []).at(values) for card in (large, small))
    for name, value in of_ship.items():
        lengths = 40.0 if name.split("@")[0].endswith("_m") else 1.0
        assert of_model[name][0] == pytest.approx(value[0] / lengths, rel=2e-3), name


@pytest.mark.parametrize(
    ("changed", "option"),
    [
        ({"beam_m": 320.0 / 2.95, "draught_m": 38.0}, "beam_m"),
        ({"beam_m": 320.0 / 12.1, "draught_m": 10.0}, "beam_m"),
        ({"draught_m": 58.0 / 1.45}, "draught_m"),
        ({"draught_m": 58.0 / 8.1}, "draught_m"),
        ({"beam_m": 320.0 / 3.3, "draught_m": 38.0}, ""),
        ({"beam_m": 320.0 / 11.9, "draught_m": 10.0}, ""),
        ({"draught_m": 58.0 / 1.55}, ""),
        ({"draught_m": 58.0 / 7.9}, ""),
    ],
)
def test_proportions_of_no_ship_are_refused(changed: dict[str, float], option: str) -> None:
    size = {**vars(TANKER), **changed}
    if not option:
        ShipDimensions(**size)
        return
    with pytest.raises(InputError) as refused:
        ShipDimensions(**size)
    assert refused.value.source == option


def test_the_prior_encloses_the_three_ships_it_is_made_after_and_not_far_more() -> None:
    """Errors from its mean, of the KVLCC2, the Esso Osaka and, where her card has the same terms, the Mariner."""
    apart: dict[str, list[float]] = {}
    for name, without in (("kvlcc2", ()), ("esso-osaka-ship", ()), ("mariner", ("Yr", "Nvvr"))):
        card = read_card(name)
        assert isinstance(card, ManoeuvringCard)
        ship = card.ship
        block = card.rigid_body.mass * ship.length_m**2 / (2 * ship.beam_m * ship.draught_m)
        prior = prior_card(
            ShipDimensions(
                length_m=ship.length_m,
                beam_m=ship.beam_m,
                draught_m=ship.draught_m,
                block=block,
                speed_kn=card.model.speed_mps * 3600 / 1852,
            ),
            "guessed",
        )
        for key, mean in prior.derivatives.items():
            if key in card.derivatives and key not in without and prior.uncertainty.get(key):
                apart.setdefault(key, []).append((card.derivatives[key] - mean) / prior.uncertainty[key])
    assert len(apart) == 20
    for key, errors in apart.items():
        assert max(map(abs, errors)) < 2.5, key
    formulas = {"Xudot", "Yvdot", "Yrdot", "Nvdot", "Nrdot", "Yv", "Yr", "Nv", "Nr", "Nd"}
    for key in apart.keys() - formulas:
        assert max(map(abs, apart[key])) > 0.5, key


def test_the_rudder_of_the_prior_has_the_area_by_rule_the_slope_by_fujii_and_the_gear_of_solas() -> None:
    """DNV: A = L T/100 (1 + 25 (B/L)^2); 6.13 x 1.5/3.75 by 1.3 for the hull and 1.4 for the race; arm 0.45 L."""
    area = 320.0 * 20.8 / 100 * (1 + 25 * (58.0 / 320.0) ** 2)
    side = 2.452 * 1.3 * 1.4 * area / 320.0**2
    assert rudder_by_rules(320.0, 58.0, 20.8) == pytest.approx(side, rel=1e-9)
    assert rudder_by_rules(320.0, 58.0, 20.8, 112.5) == pytest.approx(side * 112.5 / area, rel=1e-9)
    derivatives = CARD.derivatives
    assert derivatives["Yd"] == pytest.approx(-side) and derivatives["Nd"] == pytest.approx(0.45 * side)
    assert derivatives["Xdd"] == pytest.approx(-0.6 * side)
    assert derivatives["Xvr"] == pytest.approx(-0.8 * derivatives["Yvdot"])
    gear = CARD.steering_gear
    assert gear.max_rate_radps == pytest.approx(math.radians(65 / 28), rel=1e-3)
    assert gear.max_angle_rad == pytest.approx(math.radians(35))
    assert CARD.rigid_body.x_G == pytest.approx(0.276 * (0.81 - 0.683))
    assert CARD.model.speed_mps == pytest.approx(15.5 * 1852 / 3600)
