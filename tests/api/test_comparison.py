"""Cards compared through the public API."""

from __future__ import annotations

import pytest

import tank2sim as t2s


@pytest.fixture(scope="module")
def found():
    """The Mariner with a rudder a fifth stronger than its card."""
    ship = t2s.load("mariner")
    return t2s.compare([ship, ship.replace({"derivatives.Nd": -1.2 * 139e-5})], members=3)


def test_the_coefficient_that_was_changed_differs_and_no_other(found):
    rows = found.coefficients.set_index("coefficient")
    assert rows.loc["Nd", "difference_percent"] == pytest.approx(-20.0)  # of its size: the card's Nd is negative
    # 2 % of either value is assumed: 0.2/(0.02 sqrt(1 + 1.2^2))
    assert abs(rows.loc["Nd", "standard_errors"]) == pytest.approx(0.2 / (0.02 * (1 + 1.2**2) ** 0.5), rel=1e-6)
    assert rows["standard_errors"].notna().sum() == 1
    assert found.summary.iloc[0].to_dict() | {"rms_standard_errors": 0} == {
        "compared": 1, "same_number": 44, "beyond_two_standard_errors": 1, "rms_standard_errors": 0
    }  # fmt: skip


def test_the_figures_are_those_of_each_ship(found):
    rows = found.figures.set_index(["trial", "figure", "card"])
    for ship, label in zip(found.ships, found.labels, strict=True):
        own = ship.turn(35).figures["tactical_diameter_m"]
        assert rows.loc[("turn 35 deg to starboard", "tactical_diameter_m", label), "value"] == pytest.approx(own)
    weak, strong = (rows.loc[("turn 35 deg to starboard", "advance_m", label)] for label in found.labels)
    assert strong["difference"] == pytest.approx(strong["value"] - weak["value"]) and strong["difference"] < 0
    assert weak["standard_deviation"] > 0


@pytest.mark.parametrize(
    ("cards", "place"), [(["mariner"], ""), ("mariner", ""), (["mariner", "wilinski-zellman"], "model.kind")]
)
def test_bad_input_is_refused_with_place_and_remedy(cards, place):
    with pytest.raises(t2s.InputError) as refusal:
        t2s.compare(cards)
    assert refusal.value.place == place and refusal.value.problem and refusal.value.remedy
