"""Cards of ships and craft compared through the public API."""

from __future__ import annotations

import pytest

import tank2sim as t2s
from tank2sim.errors import InputError


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


@pytest.fixture(scope="module")
def otter() -> t2s.Ship:
    return t2s.load("otter")


def test_what_differs_is_found_in_si_and_in_the_figures(otter) -> None:
    changed = otter.replace({"derivatives.Xu": 1.1 * otter.card.derivatives["Xu"]})
    found = t2s.compare([otter, changed], members=0)
    apart = found.coefficients.query("difference_percent != 0").set_index("coefficient")
    assert list(apart.index) == ["Xu"]
    assert apart.loc["Xu", "reference"] == pytest.approx(otter.card.derivatives["Xu"])
    assert apart.loc["Xu", "difference_percent"] == pytest.approx(-10)
    speeds = found.figures.query("figure == 'final_speed_mps'")["value"].to_list()
    assert speeds[0] / speeds[1] == pytest.approx(1.1, rel=1e-3)  # the otter's surge is linear
    turns = found.figures.query("figure == 'steady_rate_degps'")["value"].to_list()
    assert turns[0] > 0 > turns[2] and turns[0] == pytest.approx(-turns[2])


def test_thrust_is_compared_and_the_place_of_a_thruster_does_not_agree_by_chance(otter) -> None:
    found = t2s.compare([otter, otter.replace({"thrusters.0.ahead_Ns2": 0.0133})], members=0)
    rows = found.coefficients.set_index("coefficient")
    assert rows.loc["thrusters.port.ahead", "difference_percent"] == pytest.approx(20, rel=0.01)
    assert rows["standard_errors"].isna()["thrusters.port.y"]
    assert found.summary["compared"].to_list() == [1]


@pytest.mark.slow
def test_errors_of_the_card_give_deviations(otter) -> None:
    found = t2s.compare([otter, otter], members=6)
    speed = found.figures.query("figure == 'final_speed_mps'").iloc[0]
    # 2 % of Xu and of both thrust curves: sqrt(2^2 + 1 + 1) % at most, and six members
    assert 0.005 < speed["standard_deviation"] / speed["value"] < 0.06


def test_a_ship_and_a_craft_of_another_size_are_refused(otter) -> None:
    with pytest.raises(InputError, match="rudder"):
        t2s.compare([otter, "mariner"], members=0)
    with pytest.raises(InputError, match=r"ship\.length_m"):
        t2s.compare([otter, otter.replace({"ship.length_m": 2.5})], members=0)


def test_a_craft_compared_with_itself_has_no_empty_table_and_no_words_of_ships(otter) -> None:
    found = t2s.compare([otter, otter], members=0)
    assert "all 13 coefficients are the reference's own" in found.headline[0]
    assert found.headline[-1] == "No figure of the manoeuvres differs."
    tables = [table for section in found.sections for table in section.tables]
    assert all(table.rows for table in tables)
    assert tables[0].caption == "Main figures"  # no ships were drawn
    assert all(column.title in {"trial", "figure", *found.labels} for column in tables[0].columns)
    text = next(section.text for section in found.sections if section.heading == "Coefficients")
    assert text.startswith("In SI units.") and "rudder" not in text


def test_coefficients_of_a_craft_are_shown_in_si(otter) -> None:
    found = t2s.compare([otter, otter.replace({"derivatives.Xu": 1.1 * otter.card.derivatives["Xu"]})], members=0)
    differing = next(
        table
        for section in found.sections
        for table in section.tables
        if table.caption == "Coefficients that differ, SI"
    )
    assert differing.rows[0][:2] == ["Xu", pytest.approx(otter.card.derivatives["Xu"])]
