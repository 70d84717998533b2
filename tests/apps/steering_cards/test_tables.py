"""Paper 4 reproduced: every printed value here is the paper's (Tables 1, 3, 4, 5, 6 and eq. (4)), typed from it."""

from __future__ import annotations

from dataclasses import asdict, replace

import pytest

from tank2sim.analysis.influence.percent import change_percent
from tank2sim.apps.steering_cards.card import SteeringCard, read_steering_card
from tank2sim.apps.steering_cards.comparison import (
    agreed_variation,
    combined_prediction,
    complete,
    draught_polynomials,
    form_of,
    influence_of,
    model_of,
    not_given,
    turns_of,
)
from tank2sim.apps.steering_cards.steady_points import TurningPoints
from tank2sim.errors import InputError

TABLE_1 = {
    5: (814.8, 8.0, 32.5),
    10: (561.0, 11.4, 47.2),
    15: (458.1, 14.0, 57.8),
    20: (399.6, 16.2, 66.3),
    25: (361.0, 18.0, 73.3),
    30: (333.3, 19.6, 79.4),
    35: (312.2, 21.2, 84.8),
}
BASE_TABLE_1 = {5: (865.7, 10.8), 10: (622.9, 15.2), 15: (521.1, 18.5), 20: (462.2, 21.3), 25: (422.9, 23.7)} | {
    30: (394.3, 25.8),
    35: (372.4, 27.8),
}
TABLE_3 = {"C_y_b": 407.0, "C_y_w": 392.7, "C_y_bb": 399.7, "C_y_d": 396.4, "C_y_bw": 403.0, "C_y_ww": 399.5} | {
    "C_m_b": 376.4,
    "C_m_w": 427.8,
    "C_m_ww": 403.2,
    "C_m_d": 385.1,
    "C_m_bww": 400.9,
}
TABLE_2 = {"C_y_b": 459.9, "C_y_w": 464.5, "C_y_bb": 460.3, "C_y_d": 464.5, "C_m_bbw": 469.5, "C_m_d": 442.5} | {
    "C_m_ww": 470.6,
    "C_m_wwb": 465.4,
}
KC = {
    "inoue-hirano-deeper": {"C_y_b": 0.62, "C_y_w": -2.153, "C_y_bb": 20.1529, "C_y_bw": 0.8781, "C_y_ww": 4.8633}
    | {"C_y_d": -0.401, "C_m_b": 1.6676, "C_m_w": 1.356, "C_m_ww": 5.1959, "C_m_bww": 0.4026}
    | {"C_m_bbw": -0.737, "C_m_d": -0.551},
    "inoue-hirano-lighter": {"C_y_b": -0.698, "C_y_w": 1.9835, "C_y_bb": -19.642, "C_y_bw": -0.879, "C_y_ww": -4.764}
    | {"C_y_d": 0.3425, "C_m_b": -1.872, "C_m_w": -1.554, "C_m_ww": -2.949, "C_m_bww": -0.65}
    | {"C_m_bbw": 0.478, "C_m_d": 0.2986},
}


@pytest.fixture(scope="module")
def card() -> SteeringCard:
    return read_steering_card("poznyakov-yudin")


def test_the_japanese_model_gives_table_1(card: SteeringCard) -> None:
    for turn, (radius, drift, rate) in zip(turns_of(card, "inoue-hirano"), TABLE_1.values(), strict=True):
        found = asdict(turn.in_degrees())
        assert found["radius_m"] == pytest.approx(radius, abs=0.25)
        assert found["drift_deg"] == pytest.approx(drift, abs=0.2)
        assert found["yaw_rate_degpmin"] == pytest.approx(rate, abs=0.1)


def test_the_base_model_restored_by_fit_gives_its_tables_1_and_2(card: SteeringCard) -> None:
    """Its radii and drift angles to the printed digits; Table 2 but for C_m_b and C_m_w, which are 0.5 m off."""
    for turn, (radius, drift) in zip(turns_of(card, "base-restored"), BASE_TABLE_1.values(), strict=True):
        assert turn.radius_m == pytest.approx(radius, abs=0.15)
        assert turn.in_degrees().drift_deg == pytest.approx(drift, abs=0.06)
    found = influence_of(card, "base-restored").radii_m
    assert {name: found[name] for name in TABLE_2} == pytest.approx(TABLE_2, abs=0.2)
    assert (found["C_m_b"], found["C_m_w"]) == pytest.approx((450.6, 475.2), abs=0.5)


def test_ten_per_cent_of_each_coefficient_gives_table_3(card: SteeringCard) -> None:
    """Eleven radii to 0.15 m; the printed 406.8 m for C_m_bbw is the one that nothing fits."""
    found = influence_of(card, "inoue-hirano")
    assert found.radius_m == pytest.approx(399.6, abs=0.1)
    assert {name: found.radii_m[name] for name in TABLE_3} == pytest.approx(TABLE_3, abs=0.15)
    assert found.radii_m["C_m_bbw"] == pytest.approx(405.49, abs=0.1)
    assert len(found.K_percent) == 12
    percents = {name: change_percent(radius, 399.6) for name, radius in TABLE_3.items()}
    assert {name: found.K_percent[name] for name in TABLE_3} == pytest.approx(percents, abs=0.03)


def test_a_percent_of_draught_gives_the_24_agreed_variations_of_table_4(card: SteeringCard) -> None:
    for other, printed in KC.items():
        found = agreed_variation(card, "inoue-hirano", other)
        assert found.keys() == printed.keys()
        assert found == pytest.approx(printed, abs=0.0006)


def test_table_5_is_404_with_the_right_pairing_and_410_6_as_printed(card: SteeringCard) -> None:
    found = combined_prediction(card, "inoue-hirano-deeper")
    assert (found.percent, found.predicted_m) == pytest.approx((1.110, 404.04), abs=0.005)
    assert (found.misread_percent, found.misread_m) == pytest.approx((2.749, 410.58), abs=0.005)
    assert found.direct_m == pytest.approx(404.4, abs=0.06)
    assert found.direct_misread_m == pytest.approx(411.4, abs=0.06)
    assert found.own_m == pytest.approx(found.direct_m, abs=0.1)


def test_a_percent_less_draught_is_predicted_as_the_model_gives_it(card: SteeringCard) -> None:
    found = combined_prediction(card, "inoue-hirano-lighter")
    assert found.percent == pytest.approx(-0.884, abs=0.001)
    assert found.predicted_m == pytest.approx(396.1, abs=0.06)
    assert found.direct_m == pytest.approx(396.2, abs=0.06)


def test_influence_over_draught_is_equation_4(card: SteeringCard) -> None:
    found = draught_polynomials(card)
    assert found["C_m_b"] == pytest.approx((-0.58, -0.66, 0.008889), abs=1e-6)
    assert found["C_m_w"] == pytest.approx((-6.73, 2.31667, -0.0866667), abs=1e-5)
    assert len(found) == 12


def test_curve_3_meets_the_trial_at_35_deg_and_misses_that_at_15(card: SteeringCard) -> None:
    slow, fast = (turn.in_degrees().yaw_rate_degpmin for turn in turns_of(card, "curve-3", [15, 35]))
    assert fast == pytest.approx(61.5, abs=0.05)
    assert slow == pytest.approx(38.4, abs=0.05)


def test_a_turn_to_port_mirrors_one_to_starboard(card: SteeringCard) -> None:
    points = TurningPoints(model_of(card, "inoue-hirano"))
    here, there = points.turn_at(0.3)[0], points.turn_at(-0.3)[0]
    assert (there.yaw_rate_radps, there.drift_rad) == pytest.approx((-here.yaw_rate_radps, -here.drift_rad))
    assert there.radius_m == pytest.approx(here.radius_m)


def test_the_turn_is_that_of_the_smooth_branch_from_zero_rudder(card: SteeringCard) -> None:
    """Along the branch the yaw rate grows steadily, from nothing."""
    diagram = TurningPoints(model_of(card, "inoue-hirano")).diagram(0.6)
    rates = [turn.yaw_rate_radps for turn in diagram]
    assert rates == sorted(rates) and rates[0] < 0.1 * rates[-1]


def test_a_stable_ship_does_not_turn_with_the_rudder_amidships(card: SteeringCard) -> None:
    points = TurningPoints(model_of(card, "inoue-hirano"))
    assert points.holds_course()
    with pytest.raises(InputError, match="does not turn the ship"):
        points.turn_at(0.0)


def test_a_rudder_that_turns_the_ship_the_wrong_way_has_no_turn(card: SteeringCard) -> None:
    model = model_of(card, "inoue-hirano")
    with pytest.raises(InputError, match="makes no steady turn"):
        TurningPoints(model).turn_at(0.3, {"coefficients.C_m_d": -1.63118, "coefficients.C_y_d": -0.15768})


def test_the_model_of_a_steering_card_names_the_file_of_the_card(card: SteeringCard) -> None:
    model = model_of(replace(card, source="mine/steering.toml"), "inoue-hirano")
    assert model.origin == f"mine/steering.toml ({card.ship.name})"
    with pytest.raises(InputError, match=r"^mine/steering\.toml .*does not turn the ship"):
        TurningPoints(model).turn_at(0.0)


def test_a_model_without_its_coefficients_is_refused_with_what_is_missing(card: SteeringCard) -> None:
    assert set(card.models) - set(complete(card)) == {"base", "pavlenko", "sobolev"}
    assert "C_m_bbw" in not_given(card, "base")
    with pytest.raises(InputError, match=r"C_m_d not given; .*not printed"):
        model_of(card, "base")
    with pytest.raises(InputError, match="inoue-hirano"):
        form_of(card, "nobody")
